//! Insertions into vessels that move.

use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use crate::methods::kirchhoff::{Accuracy, KirchhoffOptions};
use crate::vessel::motion::{Around, Displacement, MotionMode, Turn, VesselMotion, Waveform};
use crate::vessel::{GeneratedWall, Lumen, Resolution, SweptVessel, Wall, anatomy};
use crate::{Result, Vec3};
use nalgebra::{Rotation3, Unit};

/// Parameters of the device and the wall.
#[derive(Clone, Copy)]
struct Setting {
    modulus_n_per_mm2: f64,
    friction: f64,
    hook: bool,
}

/// Tolerance of equilibria: the default leaves errors of 10⁻⁷ mm, by which two paths to one equilibrium differ.
const TOLERANCE: f64 = 1e-12;

const SOFT: Setting = Setting { modulus_n_per_mm2: 1.0, friction: 0.0, hook: false };

/// A tube of radius 4 mm, straight for 100 mm and then bent.
fn tube() -> Wall {
    GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.5)).unwrap().wall
}

/// A wire of radius 0.445 mm at the mouth of a sheath of this direction in a wall.
fn wire_in(wall: Wall, direction: Vec3, setting: Setting, motion: &[MotionMode]) -> Simulation {
    let shape = if setting.hook { [0.05, 0.0] } else { [0.0; 2] };
    let tip = Section { rest_curvature_per_mm: shape, ..Section::straight(20.0, 0.445, 5.0) };
    let device = Device::new(vec![tip, Section::straight(220.0, 0.445, 5.0)]).unwrap();
    let properties = WallProperties {
        modulus_n_per_mm2: setting.modulus_n_per_mm2,
        friction: setting.friction,
        deviation_mm: 0.0,
        ..WallProperties::default()
    };
    Simulation::builder(wall, device, Sheath::new(Vec3::z() * 6.0, direction).unwrap())
        .properties(properties)
        .motion(VesselMotion::new(motion).unwrap())
        .method(&KirchhoffOptions { tolerance: TOLERANCE, ..KirchhoffOptions::of(Accuracy::Fine) })
        .build()
        .unwrap()
}

/// The same in the tube.
fn wire(setting: Setting, motion: &[MotionMode]) -> Simulation {
    wire_in(tube(), Vec3::z(), setting, motion)
}

/// As [`wire`], in the tube displaced by a field.
fn wire_in_moved(setting: Setting, displacement: &Displacement) -> Simulation {
    let mut mesh = tube().mesh().clone();
    mesh.vertices_mm.iter_mut().for_each(|v| *v = displacement.place(v));
    wire_in(Wall::welded(&mesh).unwrap(), Vec3::z(), setting, &[])
}

/// A uniform displacement of the vessel.
fn displaced(waveform: Waveform) -> MotionMode {
    MotionMode {
        waveform,
        period_s: (waveform != Waveform::Steady).then_some(4.0),
        phase: 0.0,
        displacement_mm: [0.8, -0.5, 0.3],
        turn: None,
        still: None,
        within: None,
    }
}

/// A rotation of the vessel about the sheath's mouth.
fn turned(waveform: Waveform) -> MotionMode {
    let turn = Some(Turn { centre_mm: [0.0, 0.0, 6.0], axis: AXIS, angle_deg: ANGLE_DEG });
    MotionMode { displacement_mm: [0.0; 3], turn, ..displaced(waveform) }
}

const AXIS: [f64; 3] = [1.0, 2.0, 0.7];
const ANGLE_DEG: f64 = 4.0;

/// 10 mm aside, fading towards the sheath.
fn breathing() -> MotionMode {
    MotionMode {
        displacement_mm: [-4.0, 6.0, 7.0],
        turn: None,
        still: Some(Around { centre_mm: [0.0, 0.0, 5.0], radius_mm: 20.0, fade_mm: 100.0 }),
        ..displaced(Waveform::Breathing)
    }
}

fn push(simulation: &mut Simulation, length_mm: f64) -> Result<()> {
    for _ in 0..(0.5 * length_mm) as usize {
        simulation.step(Command::advance(2.0))?;
    }
    Ok(())
}

/// Waits until a time in steps of a tenth of a second, with hands still.
fn wait(simulation: &mut Simulation, until_s: f64) -> Result<()> {
    let start_s = simulation.time_s();
    let count = ((until_s - start_s) / 0.1).round();
    for k in 1..=count as u32 {
        let time_s = start_s + (until_s - start_s) * f64::from(k) / count;
        simulation.step_until(&[], Some(time_s))?;
    }
    Ok(())
}

/// Largest distance between nodes, mm.
fn apart_mm(a: &Simulation, b: &Simulation) -> f64 {
    let pairs = a.shape().positions_mm.iter().zip(&b.shape().positions_mm);
    assert_eq!(a.shape().len(), b.shape().len());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

const SETTINGS: [Setting; 4] = [
    SOFT,
    Setting { modulus_n_per_mm2: 1000.0, ..SOFT },
    Setting { friction: 0.2, ..SOFT },
    Setting { hook: true, friction: 0.1, ..SOFT },
];

#[test]
fn in_a_vessel_that_is_displaced_the_rod_is_that_of_the_moved_scene() {
    let mode = displaced(Waveform::Steady);
    let there = VesselMotion::new(&[mode]).unwrap().unwrap().at(0.0);
    for setting in SETTINGS {
        let (mut moving, mut moved) = (wire(setting, &[mode]), wire_in_moved(setting, &there));
        let mut resting = wire(setting, &[]);
        for step in 0..80 {
            for simulation in [&mut moving, &mut moved, &mut resting] {
                simulation.step(Command { advance_mm: 2.0, rotate_rad: 0.02, ..Command::default() }).unwrap();
            }
            let off_mm = apart_mm(&moving, &moved);
            assert!(off_mm < 1e-8, "{off_mm} mm in step {step}");
        }
        assert!(!moving.report().contacts.is_empty());
        // The difference the motion makes.
        assert!(apart_mm(&resting, &moved) > 0.5);
        let (one, other) = (moving.report(), moved.report());
        assert!((one.push_force_n - other.push_force_n).abs() < 1e-7 * other.push_force_n.abs().max(0.01));
    }
}

#[test]
fn in_a_vessel_that_is_turned_the_rod_is_that_of_the_moved_scene() {
    // Relative to the vessel, the sheath is rotated the other way.
    let mode = turned(Waveform::Steady);
    let rotation = Rotation3::from_axis_angle(&Unit::new_normalize(Vec3::from(AXIS)), ANGLE_DEG.to_radians());
    let mouth = Vec3::z() * 6.0;
    for setting in &SETTINGS[..3] {
        let mut moving = wire(*setting, &[mode]);
        let mut seen = wire_in(tube(), rotation.inverse() * Vec3::z(), *setting, &[]);
        for step in 0..80 {
            moving.step(Command::advance(2.0)).unwrap();
            seen.step(Command::advance(2.0)).unwrap();
            let pairs = moving.shape().positions_mm.iter().zip(&seen.shape().positions_mm);
            let off_mm = pairs.map(|(x, y)| (mouth + rotation * (y - mouth) - x).norm()).fold(0.0, f64::max);
            assert!(off_mm < 1e-8, "{off_mm} mm in step {step}");
        }
        assert!(!moving.report().contacts.is_empty());
        assert!(apart_mm(&moving, &seen) > 5.0);
    }
    // And compared with a rotated mesh.
    let there = VesselMotion::new(&[mode]).unwrap().unwrap().at(0.0);
    for setting in &SETTINGS[..3] {
        let (mut moving, mut moved) = (wire(*setting, &[mode]), wire_in_moved(*setting, &there));
        push(&mut moving, 160.0).unwrap();
        push(&mut moved, 160.0).unwrap();
        let off_mm = apart_mm(&moving, &moved);
        assert!(off_mm < 1e-8, "{off_mm} mm");
    }
}

#[test]
fn a_vessel_that_moves_with_the_device_in_it_leads_it_to_where_the_moved_scene_has_it() {
    let mode = displaced(Waveform::Breathing);
    let there = VesselMotion::new(&[mode]).unwrap().unwrap().at(2.0);
    for modulus_n_per_mm2 in [1.0, 1000.0] {
        let setting = Setting { modulus_n_per_mm2, ..SOFT };
        let mut moving = wire(setting, &[mode]);
        push(&mut moving, 160.0).unwrap();
        let mut moved = wire_in_moved(setting, &there);
        push(&mut moved, 160.0).unwrap();
        assert!(apart_mm(&moving, &moved) > 0.5);
        wait(&mut moving, 2.0).unwrap();
        let off_mm = apart_mm(&moving, &moved);
        assert!(off_mm < 1e-8, "{off_mm}");
    }
}

#[test]
fn a_breath_comes_back_to_itself() {
    for modulus_n_per_mm2 in [1.0, 1000.0] {
        let mut simulation = wire(Setting { modulus_n_per_mm2, ..SOFT }, &[breathing()]);
        push(&mut simulation, 180.0).unwrap();
        let begun = simulation.clone();
        wait(&mut simulation, 2.0).unwrap();
        assert!(apart_mm(&simulation, &begun) > 5.0);
        assert!(simulation.report().max_penetration_mm < 0.2);
        wait(&mut simulation, 4.0).unwrap();
        let off_mm = apart_mm(&simulation, &begun);
        assert!(off_mm < 1e-6, "{off_mm}");
    }
}

#[test]
fn what_a_breath_stores_is_the_work_of_the_wall() {
    let mut simulation = wire(SOFT, &[breathing()]);
    push(&mut simulation, 180.0).unwrap();
    let begun_mj = simulation.report().energy.total();
    let (mut work_mj, mut moved_mm): (f64, f64) = (0.0, 0.0);
    for k in 1..=100 {
        let before = (simulation.report().contacts.clone(), simulation.displacement().unwrap());
        simulation.step_until(&[], Some(0.02 * f64::from(k))).unwrap();
        let after = (simulation.report().contacts.clone(), simulation.displacement().unwrap());
        // Mean of the work of the forces before and after: the hand rests, and the sheath does not move.
        for (contacts, here) in [&before, &after] {
            for contact in contacts {
                let material = here.material(&contact.position_mm);
                let way = after.1.place(&material) - before.1.place(&material);
                work_mj += 0.5 * contact.total_n().dot(&way);
                moved_mm = moved_mm.max(way.norm());
            }
        }
    }
    let stored_mj = simulation.report().energy.total() - begun_mj;
    assert!((stored_mj - work_mj).abs() < 1e-3 * work_mj.abs(), "{stored_mj} {work_mj}");
    assert!(stored_mj.abs() > 1e-3 && moved_mm > 0.1, "{stored_mj} {moved_mm}");
}

#[test]
fn several_instruments_breathe_and_come_back() {
    let hollow = |length_mm: f64, bore: Option<f64>, radius_mm: f64, stiffness: f64| {
        let section = Section::straight(length_mm, radius_mm, stiffness);
        Device::new(vec![Section { inner_radius_mm: bore, ..section }]).unwrap()
    };
    let each = [("wire", hollow(500.0, None, 0.2, 10.0)), ("catheter", hollow(240.0, Some(0.3), 0.6, 30.0))];
    let each = each.map(|(name, device)| Instrument { name: name.to_owned(), device, may_lead: true });
    let mut simulation = Simulation::builder(
        tube(),
        Stack::new(each.into()).unwrap(),
        Sheath::new(Vec3::z() * 6.0, Vec3::z()).unwrap(),
    )
    .motion(VesselMotion::new(&[breathing()]).unwrap())
    .method(&KirchhoffOptions { tolerance: TOLERANCE, ..KirchhoffOptions::of(Accuracy::Fine) })
    .build()
    .unwrap();
    let go = |instrument, mm| Move { instrument, command: Command::advance(mm) };
    for _ in 0..80 {
        simulation.step_together(&[go(0, 2.0), go(1, 1.5)]).unwrap();
    }
    let begun = simulation.clone();
    wait(&mut simulation, 2.0).unwrap();
    assert!(apart_mm(&simulation, &begun) > 5.0);
    wait(&mut simulation, 4.0).unwrap();
    let off_mm = apart_mm(&simulation, &begun);
    assert!(off_mm < 1e-6, "{off_mm}");
}

#[test]
fn friction_slips_along_the_material_points_of_the_wall() {
    let sticking = Setting { friction: 0.5, hook: false, ..SOFT };
    let mut simulation = wire(sticking, &[breathing()]);
    push(&mut simulation, 180.0).unwrap();
    let begun = simulation.clone();
    wait(&mut simulation, 4.0).unwrap();
    // A breath does work against friction, and the device ends at another state than it started from.
    assert!(apart_mm(&simulation, &begun) > 1e-3);
    let mut again = begun.clone();
    let mut taken_mj = 0.0;
    for k in 1..=40 {
        taken_mj += again.step_until(&[], Some(0.1 * f64::from(k))).unwrap().dissipated_mj;
    }
    assert!(taken_mj > 0.0, "{taken_mj}");
}

#[test]
fn a_wall_that_goes_along_with_the_device_does_not_rub() {
    // Along the straight piece, in which the wire lies on the wall: a motion of the wall equals the opposite motion
    // of the hand.
    let along = MotionMode { displacement_mm: [0.0, 0.0, 1.0], turn: None, ..displaced(Waveform::Breathing) };
    let setting = Setting { friction: 0.3, ..SOFT };
    let surface = |motion: &[MotionMode], advance_mm: f64| {
        let mut simulation = wire(setting, motion);
        push(&mut simulation, 150.0).unwrap();
        // The hand moves like a breath, 1 mm in 2 s: any difference between them on the way would cause friction.
        let breath = VesselMotion::new(&[along]).unwrap().unwrap();
        let at_mm = |k: u32| advance_mm * breath.at(0.1 * f64::from(k)).place(&Vec3::zeros()).z;
        let mut step = |k: u32| {
            let moves = [Move { instrument: 0, command: Command::advance(at_mm(k) - at_mm(k - 1)) }];
            simulation.step_until(&moves, Some(0.1 * f64::from(k))).unwrap().dissipated_mj
        };
        (1..=20).map(&mut step).sum::<f64>()
    };
    let (held, alone, together) = (surface(&[along], 0.0), surface(&[], 1.0), surface(&[along], 1.0));
    assert!(held > 0.2 * alone && alone > 0.0, "{held} {alone}");
    assert!(together < 0.2 * alone, "{together} {alone}");
}

#[test]
fn a_state_holds_the_time_and_goes_on_to_the_bit() {
    let mut simulation = wire(Setting { friction: 0.2, ..SOFT }, &[breathing()]);
    push(&mut simulation, 150.0).unwrap();
    wait(&mut simulation, 1.3).unwrap();
    let state = simulation.state();
    assert_eq!(state.time_s(), simulation.time_s());
    let mut other = wire(Setting { friction: 0.2, ..SOFT }, &[breathing()]);
    other.restore(&state).unwrap();
    for one in [&mut simulation, &mut other] {
        wait(one, 2.0).unwrap();
        one.step(Command::advance(1.0)).unwrap();
    }
    assert_eq!((simulation.shape(), simulation.report()), (other.shape(), other.report()));
    let refused = simulation.step_until(&[], Some(1.0)).unwrap_err().to_string();
    assert!(refused.contains("time_s = 1"), "{refused}");
    assert!(simulation.step_until(&[], Some(f64::NAN)).is_err());
}

/// What sticks between instruments may creep by a part of what moves, as on the wall: with still hands that is the vessel.
#[test]
fn instruments_that_rub_each_other_rest_in_a_vessel_that_breathes() {
    let each = [("wire", 800.0, 0.445, 5000.0), ("catheter", 600.0, 0.665, 60.0)];
    let each = each.map(|(name, length_mm, radius_mm, stiffness)| {
        let inner_radius_mm = (radius_mm > 0.5).then_some(0.5);
        let section = Section { inner_radius_mm, ..Section::straight(length_mm, radius_mm, stiffness) };
        let tip = Section { bending_stiffness_nmm2: 5.0, length_mm: 60.0, ..section };
        let device = Device::new(vec![tip, section]).unwrap();
        Instrument { name: name.to_owned(), device, may_lead: true }
    });
    let stack = Stack::new(each.into()).unwrap().with_friction(vec![0.1, 0.0]).unwrap();
    let tree = anatomy::tree("aorto_iliac").unwrap();
    let lumen = Lumen::from(SweptVessel::new(tree, Resolution::EdgeMm(2.0)).unwrap());
    let around = Around { centre_mm: [40.0, 0.0, 150.0], radius_mm: 20.0, fade_mm: 100.0 };
    let breath = MotionMode {
        displacement_mm: [0.0, 2.0, 6.0],
        turn: None,
        within: Some(around),
        ..displaced(Waveform::Breathing)
    };
    let mut simulation =
        Simulation::builder(lumen, stack, Sheath::new(Vec3::zeros(), Vec3::new(0.41, 0.235, 0.88)).unwrap())
            .properties(WallProperties { modulus_n_per_mm2: 0.5, friction: 0.1, ..WallProperties::default() })
            .motion(VesselMotion::new(&[breath]).unwrap())
            .method(&KirchhoffOptions::of(Accuracy::Fine))
            .build()
            .unwrap();
    for (instrument, length_mm) in [(0, 200.0), (1, 190.0)] {
        for _ in 0..(0.1 * length_mm) as usize {
            let moves = [Move { instrument, command: Command::advance(10.0) }];
            simulation.step_together(&moves).unwrap();
        }
    }
    let mut most = 0;
    for k in 1..=20 {
        let report = simulation.step_until(&[], Some(0.2 * f64::from(k))).unwrap();
        assert!(report.converged);
        most = most.max(report.iterations);
    }
    // If what sticks did not creep at all: up to 1,800.
    assert!(most <= 60, "{most}");
}

#[test]
fn a_motion_that_takes_the_wall_over_the_sheath_is_refused() {
    let far = MotionMode { displacement_mm: [5.0, 0.0, 0.0], turn: None, ..displaced(Waveform::Breathing) };
    let built = |mode: MotionMode| {
        let sheath = Sheath::new(Vec3::z() * 6.0, Vec3::z()).unwrap();
        let device = Device::uniform(100.0, 0.445, 5.0).unwrap();
        let motion = VesselMotion::new(&[mode]).unwrap();
        Simulation::builder(tube(), device, sheath).motion(motion).build().map(drop)
    };
    let refused = built(far).unwrap_err().to_string();
    assert!(refused.contains("vessel.motion = 5.000") && refused.contains("sheath's mouth"), "{refused}");
    built(MotionMode { displacement_mm: [3.0, 0.0, 0.0], ..far }).unwrap();
    built(breathing()).unwrap();
}
