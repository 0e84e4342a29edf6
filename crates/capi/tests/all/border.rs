//! The functions, called as C would: lists, states, pictures, threads.

use std::ffi::{CStr, CString};
use std::path::{Path, PathBuf};
use std::ptr::null_mut;

use endowire_c::*;
use endowire_core::insertion::Simulation;
use endowire_core::vessel::NoStore;
use endowire_core::{Command, Move};
use endowire_methods::Scene;
use endowire_viewer::{Backend, Moment, Pushed, Renderer, View, ViewSpec};

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes")
}

/// A wire in a catheter, of which 60 mm and 40 mm are in.
fn two() -> PathBuf {
    scenes().join("arch_vertebral.toml")
}

/// A simulation that frees itself.
struct Owned(*mut EndowireSimulation);

// SAFETY: one thread at a time uses it, as the header asks for.
unsafe impl Send for Owned {}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: it was made and is not used any more.
        unsafe { endowire_simulation_free(self.0) };
    }
}

#[track_caller]
fn good(status: EndowireStatus) {
    assert_eq!(status, EndowireStatus::Ok, "{}", last());
}

fn last() -> String {
    // SAFETY: the text is copied before the next call.
    unsafe { CStr::from_ptr(endowire_last_error()) }.to_str().unwrap().to_owned()
}

/// The simulation of a scene's text, with its files in this folder.
fn simulation(text: &str, folder: &Path) -> Owned {
    let (text, folder) = (CString::new(text).unwrap(), CString::new(folder.to_str().unwrap()).unwrap());
    let (mut scene, mut made) = (null_mut(), null_mut());
    // SAFETY: texts and places for handles; the scene is freed once.
    unsafe {
        good(endowire_scene_from_text(text.as_ptr(), folder.as_ptr(), &raw mut scene));
        good(endowire_simulation_new(scene, &raw mut made));
        endowire_scene_free(scene);
    }
    Owned(made)
}

fn of_two() -> Owned {
    simulation(&std::fs::read_to_string(two()).unwrap(), &scenes())
}

fn clone_of(simulation: &Owned) -> Owned {
    let mut made = null_mut();
    // SAFETY: a handle and a place for another.
    good(unsafe { endowire_simulation_clone(simulation.0, &raw mut made) });
    Owned(made)
}

/// Both instruments by 3 mm, and the catheter turned.
const MOVES: [EndowireMove; 2] = [
    EndowireMove { instrument: 0, advance_mm: 3.0, rotate_rad: 0.0, steer: 0.0 },
    EndowireMove { instrument: 1, advance_mm: 3.0, rotate_rad: 0.2, steer: 0.0 },
];

fn step(simulation: &Owned) {
    // SAFETY: a handle and as many moves as are said.
    good(unsafe { endowire_step(simulation.0, MOVES.as_ptr(), MOVES.len()) });
}

/// A list, of elements of `width` values, by asking for its length first.
fn list<T: Default + Clone>(
    width: usize,
    ask: impl Fn(*mut T, usize, *mut usize) -> EndowireStatus,
) -> Vec<T> {
    let mut count = usize::MAX;
    good(ask(null_mut(), 0, &raw mut count));
    let mut values = vec![T::default(); width * count];
    good(ask(values.as_mut_ptr(), count, &raw mut count));
    assert_eq!(values.len(), width * count);
    values
}

fn positions_mm(simulation: &Owned) -> Vec<f64> {
    // SAFETY: a handle and room for as many as are said, here and below.
    list(3, |out, capacity, count| unsafe { endowire_positions_mm(simulation.0, out, capacity, count) })
}

fn state(simulation: &Owned) -> Vec<u8> {
    // SAFETY: as above.
    list(1, |out, capacity, count| unsafe { endowire_state_save(simulation.0, out, capacity, count) })
}

fn picture(renderer: *mut EndowireRenderer, simulation: &Owned) -> Vec<u8> {
    // SAFETY: as above.
    list(1, |out, capacity, count| unsafe { endowire_picture(renderer, simulation.0, out, capacity, count) })
}

fn fluoroscopy(simulation: &Owned, side_px: u32) -> *mut EndowireRenderer {
    let mut made = null_mut();
    // SAFETY: a handle and a place for another.
    good(unsafe { endowire_fluoroscopy_new(simulation.0, side_px, side_px, &raw mut made) });
    made
}

/// The same scene without the C interface, after so many steps.
fn expected(steps: usize) -> Simulation {
    let mut simulation = Scene::read(&two()).unwrap().simulation(&NoStore).unwrap();
    let moves = MOVES.map(|one| Move {
        instrument: one.instrument as usize,
        command: Command { advance_mm: one.advance_mm, rotate_rad: one.rotate_rad, steer: one.steer },
    });
    for _ in 0..steps {
        simulation.step_together(&moves).unwrap();
    }
    simulation
}

#[test]
fn lists_and_reports_are_those_of_the_library() {
    let (ours, simulation) = (expected(10), of_two());
    (0..10).for_each(|_| step(&simulation));

    let positions: Vec<f64> = ours.shape().positions_mm.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    assert_eq!(positions_mm(&simulation), positions);
    let radii = |instrument: usize| -> Vec<f64> {
        // SAFETY: as above.
        list(1, |out, capacity, count| unsafe {
            endowire_radii_mm(simulation.0, instrument, out, capacity, count)
        })
    };
    let (wire, catheter) = (radii(0), radii(1));
    // The wire leads by 20 mm: there the catheter is not.
    for ((from_tip_mm, wire), catheter) in ours.shape().from_tip_mm.iter().zip(wire).zip(catheter) {
        assert!(
            wire > 0.0 && (catheter > wire) == (*from_tip_mm > 20.0 - 1e-6),
            "{from_tip_mm}: {wire} {catheter}"
        );
    }

    let report = ours.report();
    // SAFETY: zeros are numbers; the size is that of the structure.
    let (mut told, mut one) =
        unsafe { (std::mem::zeroed::<EndowireReport>(), std::mem::zeroed::<EndowireInstrument>()) };
    (told.size, one.size) = (size_of_val(&told) as u64, size_of_val(&one) as u64);
    // SAFETY: a handle and structures as large as they say.
    unsafe {
        good(endowire_report(simulation.0, &raw mut told));
        good(endowire_instrument(simulation.0, 1, &raw mut one));
    }
    assert_eq!((told.inserted_mm, told.instruments, told.under_way), (report.inserted_mm, 2, 0));
    assert_eq!((told.push_force_n, told.bend_energy_mj), (report.push_force_n, report.energy.bend));
    assert_eq!(told.tip_mm, <[f64; 3]>::from(ours.tip_of_mm(0).unwrap()));
    assert_eq!(told.wall_force_sum_n, ours.wall_force().sum_n);
    assert_eq!(one.tip_mm, <[f64; 3]>::from(ours.tip_of_mm(1).unwrap()));
    assert_eq!((one.inserted_mm, one.torque_nmm), (report.hand(1).inserted_mm, report.hand(1).torque_nmm));

    let mut contacts = vec![
        EndowireContact {
            position_mm: [0.0; 3],
            normal: [0.0; 3],
            force_n: 0.0,
            friction_n: [0.0; 3],
            penetration_mm: 0.0,
            triangle: 0
        };
        told.contacts as usize
    ];
    let mut count = 0;
    // SAFETY: as above.
    good(unsafe { endowire_contacts(simulation.0, contacts.as_mut_ptr(), contacts.len(), &raw mut count) });
    assert!(count > 0 && count == report.contacts.len());
    for (told, ours) in contacts.iter().zip(&report.contacts) {
        assert_eq!((told.force_n, told.triangle), (ours.force_n, ours.triangle.into()));
        assert_eq!(told.position_mm, <[f64; 3]>::from(ours.position_mm));
    }

    // SAFETY: as above.
    let vertices: Vec<f64> = list(3, |out, capacity, count| unsafe {
        endowire_vessel_vertices_mm(simulation.0, out, capacity, count)
    });
    // SAFETY: as above.
    let triangles: Vec<u32> = list(3, |out, capacity, count| unsafe {
        endowire_vessel_triangles(simulation.0, out, capacity, count)
    });
    assert_eq!(triangles.iter().max().copied(), Some(vertices.len() as u32 / 3 - 1));
    assert!(contacts.iter().all(|contact| (contact.triangle as usize) < triangles.len() / 3));
}

#[test]
fn a_vessel_that_yields_is_where_it_is_now() {
    let text = std::fs::read_to_string(scenes().join("aorto_iliac_stiff.toml")).unwrap();
    let simulation = simulation(&text, &scenes());
    let vertices = |now: bool| -> Vec<f64> {
        // SAFETY: a handle, and room for as many points as the capacity says.
        list(3, |out, capacity, count| unsafe {
            if now {
                endowire_vessel_vertices_now_mm(simulation.0, out, capacity, count)
            } else {
                endowire_vessel_vertices_mm(simulation.0, out, capacity, count)
            }
        })
    };
    let rest = vertices(false);
    assert_eq!(vertices(true), rest);
    let push = EndowireMove { instrument: 0, advance_mm: 60.0, rotate_rad: 0.0, steer: 0.0 };
    // SAFETY: a handle and one move.
    good(unsafe { endowire_step(simulation.0, &raw const push, 1) });
    assert_eq!(vertices(false), rest);
    let farthest = vertices(true).iter().zip(&rest).map(|(now, rest)| (now - rest).abs()).fold(0.0, f64::max);
    assert!((0.01..5.0).contains(&farthest), "{farthest}");
}

#[test]
fn states_continue_to_the_bit_and_clones_on_other_threads_too() {
    let simulation = of_two();
    (0..3).for_each(|_| step(&simulation));
    let (saved, mut clone, other) = (state(&simulation), clone_of(&simulation), of_two());
    // SAFETY: a handle and as many bytes as are said, here and below.
    good(unsafe { endowire_state_restore(other.0, saved.as_ptr(), saved.len()) });
    (0..3).for_each(|_| step(&simulation));
    let arrived = state(&simulation);
    clone = std::thread::spawn(move || {
        (0..3).for_each(|_| step(&clone));
        clone
    })
    .join()
    .unwrap();
    (0..3).for_each(|_| step(&other));
    assert!(arrived != saved && state(&clone) == arrived && state(&other) == arrived);
    assert_eq!(positions_mm(&other), positions_mm(&simulation));

    // What is no state of this scene changes nothing.
    let restore = |bytes: &[u8]| {
        // SAFETY: as above.
        let status = unsafe { endowire_state_restore(other.0, bytes.as_ptr(), bytes.len()) };
        assert_eq!(status, EndowireStatus::Input);
        assert_eq!(state(&other), arrived);
        last()
    };
    let mut damaged = saved.clone();
    damaged[saved.len() / 2] ^= 1;
    assert!(restore(&damaged).contains("changed since"), "{}", last());
    assert!(restore(&saved[..saved.len() - 1]).contains("not whole"), "{}", last());
    assert!(restore(b"nothing").contains("do not begin"), "{}", last());
    let text = std::fs::read_to_string(scenes().join("aortic_arch.toml")).unwrap();
    assert!(restore(&state(&self::simulation(&text, &scenes()))).contains("another scene"), "{}", last());
}

#[test]
fn states_have_the_format_of_the_python_package() {
    let first = |source: &str| {
        let (_, after) = source.split_once("const FORMAT: &[u8] = ").unwrap();
        after.split_once(';').unwrap().0.to_owned()
    };
    let python = include_str!("../../../python/src/state.rs");
    assert_eq!(first(include_str!("../../src/state.rs")), first(python), "both are read by both");
}

#[test]
fn pictures_are_those_of_the_viewer() {
    let simulation = of_two();
    let renderer = fluoroscopy(&simulation, 64);
    let scene = Scene::read(&two()).unwrap();
    let spec = ViewSpec::of_scene(&scene, &two()).unwrap();
    let spec = ViewSpec { views: vec![View::Fluoro], size_px: [64, 64], backend: Backend::Cpu, ..spec };
    let mut viewer =
        Renderer::of_wall(&spec, scene.lumen(&NoStore).unwrap().wall(&NoStore).unwrap()).unwrap();
    let mut pushed = Pushed::new(&scene, &spec).unwrap();
    for ours in [expected(0), expected(1)] {
        // The second has another number, and so other noise: what only asks for the length is no picture.
        let moment = Moment {
            frame: viewer.next_frame(),
            shape: ours.shape(),
            inserted_mm: &ours.report().lengths_mm(),
            coils: &[],
            contacts: &[],
            displacement: None,
            before: None,
        };
        let frames = viewer.draw(&mut pushed, &moment).unwrap();
        assert!(picture(renderer, &simulation) == frames.fluoro.unwrap().data());
        step(&simulation);
    }
    // SAFETY: it is freed once, and so are those below.
    unsafe { endowire_renderer_free(renderer) };

    let mut three_d = null_mut();
    // SAFETY: a handle and a place for another.
    good(unsafe { endowire_view_3d_new(simulation.0, 32, 16, &raw mut three_d) });
    let pixels = picture(three_d, &simulation);
    assert_eq!(pixels.len(), 4 * 32 * 16);
    assert!(pixels.chunks(4).all(|rgba| rgba[3] == 255) && pixels.iter().any(|value| *value < 100));
    let elsewhere = of_two();
    let mut count = 0;
    // SAFETY: two handles and a place for a count.
    let status = unsafe { endowire_picture(three_d, elsewhere.0, null_mut(), 0, &raw mut count) };
    assert_eq!(status, EndowireStatus::Input);
    assert!(last().contains("another scene"), "{}", last());
    // SAFETY: as above.
    unsafe { endowire_renderer_free(three_d) };
}

#[test]
fn the_c_arm_turns_and_medium_flows() {
    // A field as large as the vessel, whose lower end the catheter has just entered.
    let text = std::fs::read_to_string(two()).unwrap().replace("field_mm = 400.0", "field_mm = 700.0");
    let simulation = simulation(&text, &scenes());
    let [still, turned, injected] = [(); 3].map(|()| fluoroscopy(&simulation, 64));
    // SAFETY: handles.
    unsafe {
        good(endowire_turn_c_arm(turned, -30.0, 0.0));
        assert_eq!(endowire_turn_c_arm(turned, f64::NAN, 0.0), EndowireStatus::Input);
        good(endowire_inject(injected, simulation.0, 10.0, 20.0));
        assert_eq!(endowire_inject(injected, simulation.0, 0.0, 20.0), EndowireStatus::Input);
        assert!(last().starts_with("ml = 0"), "{}", last());
    }
    let mean =
        |pixels: &[u8]| pixels.iter().map(|value| f64::from(*value)).sum::<f64>() / pixels.len() as f64;
    // The same frames, and so the same noise.
    let [first, other, before] = [still, turned, injected].map(|one| picture(one, &simulation));
    assert!(first != other && mean(&first) - mean(&before) < 0.1);
    // Half a second of medium.
    let [without, with] =
        [still, injected].map(|one| (0..8).map(|_| picture(one, &simulation)).next_back().unwrap());
    assert!(mean(&with) < mean(&without) - 0.2, "{} {}", mean(&with), mean(&without));
    for renderer in [still, turned, injected] {
        // SAFETY: each is freed once.
        unsafe { endowire_renderer_free(renderer) };
    }
}

/// A coil of 6 mm in a catheter that stands in a tube.
const COIL_SCENE: &str = r#"
[vessel]
tree = "tube.csv"

[[instrument]]
name = "coil"
file = "coil.toml"

[[instrument]]
name = "catheter"
inserted_mm = 5.0

[[instrument.section]]
length_mm = 80.0
radius_mm = 0.45
inner_radius_mm = 0.25
bending_stiffness_nmm2 = 5.0

[sheath]
opening = 0
depth_mm = 2.0

[method]
name = "kirchhoff"
element_mm = 2.0
self_contact = true
"#;
const COIL: &str = r#"
name = "coil"
kind = "coil"

[[part]]
name = "coil"
length_mm = 6.0
outer_diameter_mm = 0.3
winding = { wire_diameter_mm = 0.05, modulus_gpa = 170.0, poisson_ratio = 0.38 }
material = "platinum"

[[part]]
name = "pusher"
length_mm = 100.0
outer_diameter_mm = 0.3
bending_stiffness_nmm2 = 0.5
material = "steel_316l"
"#;

#[test]
fn a_coil_is_left_behind() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("coil.toml"), COIL).unwrap();
    let tube = "x_mm,y_mm,z_mm,radius_mm,parent\n0,0,0,4,-1\n0,0,60,4,0\n";
    std::fs::write(folder.path().join("tube.csv"), tube).unwrap();
    let simulation = simulation(COIL_SCENE, folder.path());
    let push = EndowireMove { instrument: 0, advance_mm: 12.0, rotate_rad: 0.0, steer: 0.0 };
    let mut count = 0;
    // SAFETY: a handle, one move, and a place for a count.
    unsafe {
        assert_eq!(endowire_detach(simulation.0, 0), EndowireStatus::Input);
        good(endowire_step(simulation.0, &raw const push, 1));
        good(endowire_detach(simulation.0, 0));
        let none = endowire_coil_positions_mm(simulation.0, 1, null_mut(), 0, &raw mut count);
        assert_eq!(none, EndowireStatus::Input);
    }
    // SAFETY: a handle and room for as many as are said.
    let coil: Vec<f64> = list(3, |out, capacity, count| unsafe {
        endowire_coil_positions_mm(simulation.0, 0, out, capacity, count)
    });
    // Along the axis, 12 mm beyond a mouth at 2 mm.
    let (first, last) = (coil[2], coil[coil.len() - 1]);
    assert!((last - first - 6.0).abs() < 0.2 && (last - 14.0).abs() < 0.5, "{first} to {last}");
}
