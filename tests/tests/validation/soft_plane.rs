//! Sections that bend more easily in one plane than in the one across it.

use std::path::Path;
use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::device::{Device, Instrument, Section, SoftPlane, Stack};
use endowire_core::field::{Field, Weight};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, State};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::scene::Scene;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, NoStore, Resolution, anatomy};

/// Bending stiffness in the soft plane and across it, and torsional stiffness, N·mm²; length, mm.
const SOFT: f64 = 4.0;
const STIFF: f64 = 20.0;
const GJ: f64 = 9.0;
const LENGTH_MM: f64 = 60.0;

fn flat(plane_deg: f64) -> Section {
    Section {
        soft_plane: Some(SoftPlane { plane_deg, bending_stiffness_nmm2: SOFT }),
        torsional_stiffness_nmm2: Some(GJ),
        ..Section::straight(300.0, 0.4, STIFF)
    }
}

fn device(section: Section) -> Device {
    Device::new(vec![section]).unwrap()
}

/// In a vessel so wide that nothing touches it, its first direction along x.
fn free(stack: impl Into<Stack>) -> Simulation {
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * (100.0 * i as f64),
        radius_mm: 150.0,
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..4).map(node).collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(40.0)).unwrap();
    let sheath = Sheath::new(Vec3::z() * 5.0, Vec3::z()).unwrap().bending_towards(Vec3::x()).unwrap();
    let options = KirchhoffOptions { element_mm: 1.0, tolerance: 1e-11, ..KirchhoffOptions::default() };
    Simulation::builder(made.wall, stack, sheath).method(&options).build().unwrap()
}

/// Where the tip of a device that is all out of the sheath, so that nothing outside twists, hangs under a force per length, from
/// where it is without, mm.
fn hangs_mm(section: Section, per_mm: Vec3) -> Vec3 {
    let mut simulation = free(device(Section { length_mm: LENGTH_MM, ..section }));
    simulation.step(Command::advance(LENGTH_MM)).unwrap();
    let before = simulation.shape().tip_mm().unwrap();
    let weight: Arc<dyn Field> = Arc::new(Weight::new(0, per_mm).unwrap());
    simulation.set_fields([weight]).unwrap();
    assert!(simulation.step(Command::default()).unwrap().converged);
    simulation.shape().tip_mm().unwrap() - before
}

/// qL⁴/8EI in each plane, and its vector sum between them, in which the tip leaves the plane of the load.
#[test]
fn a_flat_cantilever_bends_in_each_plane_by_its_stiffness() {
    let q = 1e-8;
    for plane_deg in [0.0, 25.0, 90.0, -140.0] {
        let (sin, cos) = f64::to_radians(plane_deg).sin_cos();
        let (in_plane, across) = (Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0));
        for load_deg in [0.0, 45.0, 90.0] {
            let (s, c) = f64::to_radians(load_deg).sin_cos();
            let load = (in_plane * c + across * s) * q;
            let expected = (in_plane * (c / SOFT) + across * (s / STIFF)) * (q * LENGTH_MM.powi(4) / 8.0);
            // Along the line it comes short by the square of that.
            let across_mm = |tip: Vec3| Vec3::new(tip.x, tip.y, 0.0);
            let tip = across_mm(hangs_mm(flat(plane_deg), load));
            let off = (tip - expected).norm() / expected.norm();
            assert!(off < 1e-6, "{plane_deg}° {load_deg}°: {off:e}");
            // The twin: a round one of the mean stiffness is far off.
            let round =
                Section { soft_plane: None, bending_stiffness_nmm2: 0.5 * (SOFT + STIFF), ..flat(0.0) };
            let other = across_mm(hangs_mm(round, load));
            assert!((other - expected).norm() / expected.norm() > 0.1);
        }
    }
}

/// A Kirchhoff rod as an initial value problem from its clamp: position, directions d₁, d₂ and d₃, and moment.
#[derive(Clone, Copy)]
struct Place {
    x: Vec3,
    d: [Vec3; 3],
    m: Vec3,
}

/// m′ = n × d₃ with n the weight of what is ahead; κ from m in the directions of the section.
fn rate(at: &Place, s: f64, per_mm: Vec3) -> Place {
    let [d1, d2, d3] = at.d;
    // m = d₃ × (B κ) + GJ τ d₃.
    let (k1, k2) = (at.m.dot(&d2) / SOFT, -at.m.dot(&d1) / STIFF);
    let turn = d2 * k1 - d1 * k2 + d3 * (at.m.dot(&d3) / GJ);
    let n = per_mm * (LENGTH_MM - s);
    Place { x: d3, d: at.d.map(|d| turn.cross(&d)), m: n.cross(&d3) }
}

fn plus(a: &Place, b: &Place, h: f64) -> Place {
    let d = [0, 1, 2].map(|i| a.d[i] + b.d[i] * h);
    Place { x: a.x + b.x * h, d, m: a.m + b.m * h }
}

/// The end of the rod that begins with this moment: Runge and Kutta's method of order 4.
fn shot(m: Vec3, per_mm: Vec3) -> Place {
    const STEPS: usize = 2000;
    let h = LENGTH_MM / STEPS as f64;
    let mut at = Place { x: Vec3::zeros(), d: [Vec3::x(), Vec3::y(), Vec3::z()], m };
    for k in 0..STEPS {
        let s = k as f64 * h;
        let a = rate(&at, s, per_mm);
        let b = rate(&plus(&at, &a, 0.5 * h), s + 0.5 * h, per_mm);
        let c = rate(&plus(&at, &b, 0.5 * h), s + 0.5 * h, per_mm);
        let d = rate(&plus(&at, &c, h), s + h, per_mm);
        at = plus(&plus(&plus(&plus(&at, &a, h / 6.0), &b, h / 3.0), &c, h / 3.0), &d, h / 6.0);
    }
    at
}

/// The tip of the rod whose moment is 0 there, by Newton's method from a load of nothing on.
fn integrated(per_mm: Vec3) -> Vec3 {
    let mut m = Vec3::zeros();
    for part in 1..=10 {
        let load = per_mm * (0.1 * f64::from(part));
        for _ in 0..12 {
            let end = shot(m, load);
            let [a, b, c] = [Vec3::x(), Vec3::y(), Vec3::z()].map(|e| {
                let step = 1e-6;
                (shot(m + e * step, load).m - shot(m - e * step, load).m) / (2.0 * step)
            });
            // Cramer's rule.
            let across = Vec3::new(b.cross(&c).dot(&end.m), c.cross(&a).dot(&end.m), a.cross(&b).dot(&end.m));
            m -= across / a.dot(&b.cross(&c));
        }
    }
    let end = shot(m, per_mm);
    assert!(end.m.norm() < 1e-9, "{:e}", end.m.norm());
    end.x
}

/// Bent by most of a right angle between its planes, the rod twists: what the frame's terms are for.
#[test]
fn a_flat_cantilever_that_bends_far_agrees_with_the_equations_of_the_rod() {
    for load_deg in [20.0, 45.0, 75.0] {
        let (sin, cos) = f64::to_radians(load_deg).sin_cos();
        let load = Vec3::new(cos, sin, 0.0) * 8e-5;
        let tip = hangs_mm(flat(0.0), load) + Vec3::z() * LENGTH_MM;
        let expected = integrated(load);
        let off = (tip - expected).norm() / LENGTH_MM;
        assert!(expected.xy().norm() > 0.15 * LENGTH_MM, "{expected}");
        assert!(off < 2e-6, "{load_deg}°: {off:e} {tip} {expected}");
        // The twin: with the planes exchanged it is elsewhere.
        let other = hangs_mm(flat(90.0), load) + Vec3::z() * LENGTH_MM;
        assert!((other - expected).norm() > 0.05 * LENGTH_MM);
    }
}

/// A flat catheter that is bent at rest, on a round wire: κ = (B + EI)⁻¹ B κ⁰, an arc out of the plane of κ⁰.
#[test]
fn a_round_wire_bends_a_flat_catheter_towards_its_soft_plane() {
    let rest = [0.008, 0.006];
    let catheter =
        Section { radius_mm: 0.9, inner_radius_mm: Some(0.5), rest_curvature_per_mm: rest, ..flat(0.0) };
    let wire_nmm2 = 10.0;
    let instrument = |name: &str, device: Device| Instrument { name: name.into(), device, may_lead: true };
    let wire = Device::uniform(500.0, 0.4, wire_nmm2).unwrap();
    let stack = vec![instrument("wire", wire), instrument("catheter", device(catheter))];
    let mut simulation = free(Stack::new(stack).unwrap());
    let moved = |instrument: usize| Move { instrument, command: Command::advance(LENGTH_MM) };
    simulation.step_together(&[moved(0), moved(1)]).unwrap();
    let curvature =
        Vec3::new(rest[0] * SOFT / (SOFT + wire_nmm2), rest[1] * STIFF / (STIFF + wire_nmm2), 0.0);
    let arc = |curvature: Vec3| {
        let (k, angle) = (curvature.norm(), curvature.norm() * LENGTH_MM);
        curvature / k * ((1.0 - angle.cos()) / k) + Vec3::z() * (5.0 + angle.sin() / k)
    };
    let tip = simulation.shape().tip_mm().unwrap();
    assert!((tip - arc(curvature)).norm() < 1e-6 * LENGTH_MM, "{tip} {}", arc(curvature));
    let mean = 0.5 * (SOFT + STIFF);
    let round = Vec3::new(rest[0], rest[1], 0.0) * (mean / (mean + wire_nmm2));
    assert!((tip - arc(round)).norm() > 0.5);
    // What it stores is half of what each straightens the other by.
    let [b1, b2] = [SOFT, STIFF].map(|ei| ei * wire_nmm2 / (ei + wire_nmm2));
    let stored_mj = 0.5 * LENGTH_MM * (b1 * rest[0] * rest[0] + b2 * rest[1] * rest[1]);
    let energy = simulation.report().energy;
    assert!((energy.bend / stored_mj - 1.0).abs() < 1e-5, "{energy:?} {stored_mj}");
}

/// In the bent tube, turned by its hand.
fn in_bend(section: Section) -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let options = KirchhoffOptions { element_mm: 3.0, ..KirchhoffOptions::default() };
    let stack = device(section);
    let mut simulation = Simulation::builder(made.wall, stack, sheath).method(&options).build().unwrap();
    for _ in 0..95 {
        assert!(simulation.step(Command::advance(2.0)).unwrap().converged);
    }
    simulation
}

/// A wire that is stiff in twist stores least where its soft plane is that of the bend, twice in a turn; its hand puts in what it
/// stores, without a jump. One that twists easily stays there and flips by half a turn.
#[test]
fn a_flat_wire_turns_its_soft_plane_into_that_of_the_bend() {
    let steps = 72;
    let turned = |gj: f64| {
        let section = Section { torsional_stiffness_nmm2: Some(gj), ..flat(0.0) };
        let mut simulation = in_bend(section);
        let turn = std::f64::consts::TAU / steps as f64;
        let (mut energies, mut put_in_mj, mut jumps, mut was_nmm) = (vec![], 0.0, 0, None);
        // Twice round: the first turn brings it to where it repeats itself.
        for k in 0..2 * steps {
            let report = simulation.step(Command::rotate(turn)).unwrap();
            jumps += usize::from(report.jumped && k >= steps);
            let torque_nmm = report.torque_nmm;
            let before = was_nmm.replace(torque_nmm);
            if k >= steps {
                energies.push(report.energy.total());
                put_in_mj += before.map_or(0.0, |before| 0.5 * (before + torque_nmm) * turn);
            }
        }
        let least = energies.iter().copied().fold(f64::MAX, f64::min);
        let most = energies.iter().copied().fold(0.0, f64::max);
        (energies, put_in_mj, jumps, least, most)
    };
    let (energies, put_in_mj, jumps, least, most) = turned(4e4);
    assert_eq!(jumps, 0);
    // Over a turn nothing is gained, and half a turn is the same again.
    assert!(put_in_mj.abs() < 0.02 * (most - least), "{put_in_mj} {least} {most}");
    for k in 0..steps / 2 {
        assert!((energies[k] - energies[k + steps / 2]).abs() < 0.02 * most, "{k} {energies:?}");
    }
    assert!((most / least / (STIFF / SOFT) - 1.0).abs() < 0.01, "{least} {most}");
    let (_, put_in_mj, jumps, least, most) = turned(20.0);
    assert_eq!(jumps, 2, "a flip each half turn");
    assert!(put_in_mj > 0.2 * (most - least), "what is let go was put in: {put_in_mj} {least} {most}");
}

#[test]
fn a_flat_wire_goes_on_from_states_and_copies_and_ticks_are_steps() {
    let bits = |simulation: &Simulation| serde_json::to_vec(&simulation.state()).unwrap();
    let mut first = in_bend(flat(30.0));
    first.step(Command::rotate(0.4)).unwrap();
    let state: State = serde_json::from_slice(&bits(&first)).unwrap();
    let (mut copy, mut restored, mut ticked) = (first.clone(), in_bend(flat(30.0)), first.clone());
    restored.restore(&state).unwrap();
    let command = Command { advance_mm: 1.0, rotate_rad: 0.1, steer: 0.0 };
    for other in [&mut first, &mut copy, &mut restored] {
        other.step(command).unwrap();
    }
    let moves = [Move { instrument: 0, command }];
    ticked.tick(&moves, ticked.most_solves(&moves).unwrap(), None).unwrap();
    assert!(bits(&first) == bits(&copy) && bits(&first) == bits(&restored) && bits(&first) == bits(&ticked));
    // Another plane is another scene.
    assert!(in_bend(flat(31.0)).restore(&state).is_err());
}

/// What a hand pushes in, and what the sheath lets go of as a rest shape between the planes comes out, is what is stored.
#[test]
fn pushing_puts_in_what_is_stored() {
    let hook = Section { length_mm: 25.0, rest_curvature_per_mm: [0.02, 0.01], ..flat(30.0) };
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let options = KirchhoffOptions { element_mm: 3.0, ..KirchhoffOptions::default() };
    let stack = Device::new(vec![hook, flat(-20.0)]).unwrap();
    let mut simulation = Simulation::builder(made.wall, stack, sheath).method(&options).build().unwrap();
    simulation.step(Command::advance(4.0)).unwrap();
    let first = simulation.report().clone();
    let (mut was_n, mut put_in_mj, mut most_mj, mut off_mj) = (first.push_force_n, 0.0, 0.0f64, 0.0f64);
    // ½ κ⁰ᵀBκ⁰, along the plane and across it.
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    let (soft, stiff) = (0.02 * cos + 0.01 * sin, 0.01 * cos - 0.02 * sin);
    let let_go_n = 0.5 * (SOFT * soft * soft + STIFF * stiff * stiff);
    for _ in 0..1500 {
        let is = simulation.step(Command::advance(0.1)).unwrap();
        assert!(is.converged && !is.jumped);
        put_in_mj += 0.5 * (was_n + is.push_force_n) * 0.1;
        was_n = is.push_force_n;
        let stored_mj = is.energy.total() - first.energy.total();
        most_mj = most_mj.max(stored_mj.abs());
        let let_go_mj = let_go_n * (is.inserted_mm.min(25.0) - 4.0);
        off_mj = off_mj.max((put_in_mj + let_go_mj - stored_mj).abs());
    }
    assert!(most_mj > 0.02, "{most_mj}");
    assert!(off_mj < 5e-3 * most_mj, "{off_mj} {most_mj}");
}

#[test]
fn a_scene_says_what_is_flat_and_methods_that_know_one_stiffness_refuse_it() {
    let text = r#"
name = "flat"
[vessel]
tree = "../vessels/curved_tube.csv"
[sheath]
opening = 0
[device]
[[device.section]]
length_mm = 200.0
radius_mm = 0.2
bending_stiffness_nmm2 = 12.0
soft_plane = { plane_deg = 90.0, bending_stiffness_nmm2 = 3.0 }
[[script]]
advance_mm = 40.0
"#;
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/scenes/flat.toml");
    let scene = Scene::from_toml(text, &place).unwrap();
    let simulation = scene.simulation(&NoStore).unwrap();
    let section = simulation.stack().instruments()[0].device.sections()[0];
    assert_eq!(section.soft_plane, Some(SoftPlane { plane_deg: 90.0, bending_stiffness_nmm2: 3.0 }));
    let misspelt = text.replace("soft_plane", "soft_plan");
    assert!(Scene::from_toml(&misspelt, &place).unwrap_err().to_string().contains("soft_plane"));
    let refused = |name: &str| {
        let text = format!("{text}[method]\nname = {name:?}\n");
        let scene = endowire_methods::Scene::from_toml(&text, &place).unwrap();
        scene.simulation(&NoStore).map(|_| ()).unwrap_err().to_string()
    };
    for name in endowire_methods::NAMES.iter().filter(|name| **name != "kirchhoff") {
        assert!(refused(name).contains("soft_plane"), "{name}: {}", refused(name));
    }
}
