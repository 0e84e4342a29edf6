//! Sections whose rest curvature follows a command.

use endowire_core::device::{Device, Instrument, Section, Stack, Steer};
use endowire_core::insertion::{Command, Move, ScriptLine, Sheath, Simulation, State};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::scene::Scene;
use endowire_core::vessel::{
    CentrelineNode, CentrelinePath, CentrelineTree, GeneratedWall, NoStore, Resolution, anatomy,
};
use endowire_core::{Error, Vec3};
use std::path::Path;

/// Curvature at the value 1, 1/mm, and length of the steered section, mm.
const BEND_PER_MM: f64 = 0.02;
const STEERED_MM: f64 = 60.0;

/// A straight section of this length that bends in this plane when steered.
fn steered(length_mm: f64, plane_deg: f64) -> Section {
    let steer = Some(Steer { plane_deg, curvature_per_mm_at_1: BEND_PER_MM });
    Section { steer, ..Section::straight(length_mm, 0.9, 60.0) }
}

/// A catheter with a steered tip on a straight shaft.
fn catheter(plane_deg: f64) -> Device {
    let shaft = Section { inner_radius_mm: Some(0.5), steer: None, ..steered(300.0, 0.0) };
    let tip = Section { inner_radius_mm: Some(0.5), ..steered(STEERED_MM, plane_deg) };
    Device::new(vec![tip, shaft]).unwrap()
}

/// In a vessel so wide that nothing touches it.
fn free(stack: impl Into<Stack>) -> Simulation {
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * (100.0 * i as f64),
        radius_mm: 150.0,
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..4).map(node).collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(40.0)).unwrap();
    let sheath = Sheath::new(Vec3::z() * 5.0, Vec3::z()).unwrap().bending_towards(Vec3::x()).unwrap();
    let options = KirchhoffOptions { element_mm: 2.0, tolerance: 1e-10, ..KirchhoffOptions::default() };
    Simulation::builder(made.wall, stack, sheath).method(&options).build().unwrap()
}

/// The end of an arc of this curvature and length, from the sheath's mouth, in this plane.
fn on_arc(curvature_per_mm: f64, length_mm: f64, plane_deg: f64) -> Vec3 {
    let angle = curvature_per_mm * length_mm;
    let (across, along) = ((1.0 - angle.cos()) / curvature_per_mm, angle.sin() / curvature_per_mm);
    let (sin, cos) = plane_deg.to_radians().sin_cos();
    Vec3::new(across * cos, across * sin, 5.0 + along)
}

fn tip_mm(simulation: &Simulation) -> Vec3 {
    simulation.shape().tip_mm().unwrap()
}

/// Free in space a uniform section is an arc of the curvature to which it is steered; where it is more than steered
/// half, it is not the arc of half.
#[test]
fn a_steered_cantilever_is_an_arc() {
    for plane_deg in [0.0, 30.0, -120.0] {
        let mut simulation = free(catheter(plane_deg));
        simulation.step(Command::advance(STEERED_MM)).unwrap();
        assert!((tip_mm(&simulation) - Vec3::new(0.0, 0.0, 65.0)).norm() < 1e-9);
        for (by, value) in [(0.5, 0.5), (0.5, 1.0), (-1.75, -0.75)] {
            let report = simulation.step(Command::steer(by)).unwrap();
            assert!(report.converged && !report.jumped && report.hand(0).steer == value, "{report:?}");
            let off_mm = (tip_mm(&simulation) - on_arc(BEND_PER_MM * value, STEERED_MM, plane_deg)).norm();
            assert!(off_mm < 1e-6 * STEERED_MM, "{plane_deg}° {value}: {off_mm}");
            let other_mm =
                (tip_mm(&simulation) - on_arc(BEND_PER_MM * (value - 0.01), STEERED_MM, plane_deg)).norm();
            assert!(other_mm > 0.1, "{other_mm}");
            // Free of forces it stores nothing, whatever it is steered to.
            assert!(
                simulation.report().energy.bend < 1e-6 && simulation.report().hand(0).steer_mj.abs() < 1e-4
            );
        }
    }
}

#[test]
fn two_values_one_after_the_other_are_the_second() {
    let (mut there, mut direct) = (free(catheter(20.0)), free(catheter(20.0)));
    for simulation in [&mut there, &mut direct] {
        simulation.step(Command::advance(STEERED_MM + 15.0)).unwrap();
    }
    there.step(Command::steer(0.9)).unwrap();
    there.step(Command::steer(-0.6)).unwrap();
    direct.step(Command::steer(0.3)).unwrap();
    let apart_mm = (tip_mm(&there) - tip_mm(&direct)).norm();
    assert!(apart_mm < 1e-6, "{apart_mm}");
    // While it comes out, and turned by its hand.
    let mut moving = free(catheter(20.0));
    for _ in 0..10 {
        let command = Command { advance_mm: 0.1 * STEERED_MM, rotate_rad: 0.07, steer: 0.05 };
        assert!(moving.step(command).unwrap().converged);
    }
    let turned_deg = 20.0 + 0.7f64.to_degrees();
    let off_mm = (tip_mm(&moving) - on_arc(0.5 * BEND_PER_MM, STEERED_MM, turned_deg)).norm();
    assert!(off_mm < 1e-6 * STEERED_MM, "{off_mm}");
}

/// A wire in a steered catheter shares its bend: the curvature is that of the stiffness that is steered.
#[test]
fn a_wire_stiffens_a_steered_catheter() {
    let instrument = |name: &str, device: Device| Instrument { name: name.into(), device, may_lead: true };
    let wire = Device::uniform(500.0, 0.4, 20.0).unwrap();
    let stack = Stack::new(vec![instrument("wire", wire), instrument("catheter", catheter(0.0))]).unwrap();
    let mut simulation = free(stack);
    let moved = |instrument: usize, command: Command| Move { instrument, command };
    let in_mm = Command::advance(STEERED_MM);
    simulation.step_together(&[moved(0, in_mm), moved(1, in_mm)]).unwrap();
    let report = simulation.step_together(&[moved(1, Command::steer(0.8))]).unwrap();
    let value_mj = report.hand(1).steer_mj;
    let curvature = 0.8 * BEND_PER_MM * 60.0 / 80.0;
    let off_mm = (tip_mm(&simulation) - on_arc(curvature, STEERED_MM, 0.0)).norm();
    assert!(off_mm < 1e-6 * STEERED_MM, "{off_mm}");
    // E = ½ v² k² L EI₁EI₂/(EI₁ + EI₂).
    let expected_mj = 0.8 * BEND_PER_MM * BEND_PER_MM * STEERED_MM * 20.0 * 60.0 / 80.0;
    assert!((value_mj / expected_mj - 1.0).abs() < 1e-5, "{value_mj} {expected_mj}");
    let bend_mj = simulation.report().energy.bend;
    assert!((bend_mj / (0.5 * 0.8 * expected_mj) - 1.0).abs() < 1e-5, "{bend_mj}");
}

/// In the bent tube, pressed against its wall.
fn in_bend() -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let mut simulation = Simulation::builder(made.wall, catheter(0.0), sheath).build().unwrap();
    for _ in 0..60 {
        simulation.step(Command::advance(2.0)).unwrap();
    }
    simulation
}

#[test]
fn steering_puts_in_what_is_stored() {
    let mut simulation = in_bend();
    let first = simulation.report().clone();
    let (mut was, mut put_in_mj, mut most_mj) = (first.clone(), 0.0, 0.0f64);
    for k in 0..120 {
        let by = if k < 80 { 0.01 } else { -0.015 };
        let is = simulation.step(Command { advance_mm: 0.02, rotate_rad: 0.0, steer: by }).unwrap().clone();
        assert!(is.converged && !is.jumped, "{k}");
        put_in_mj += 0.5 * (was.hand(0).steer_mj + is.hand(0).steer_mj) * by;
        put_in_mj += 0.5 * (was.push_force_n + is.push_force_n) * 0.02;
        most_mj = most_mj.max(is.energy.total());
        was = is;
    }
    let stored_mj = was.energy.total() - first.energy.total();
    assert!(most_mj > first.energy.total() + 0.05, "{most_mj} {first:?}");
    assert!((put_in_mj - stored_mj).abs() < 2e-3 * most_mj, "{put_in_mj} {stored_mj} {most_mj}");
}

#[test]
fn steering_goes_on_from_states_and_copies_and_ticks_are_steps() {
    let bits = |simulation: &Simulation| serde_json::to_vec(&simulation.state()).unwrap();
    let mut first = in_bend();
    first.step(Command::steer(0.4)).unwrap();
    let state: State = serde_json::from_slice(&bits(&first)).unwrap();
    let (mut copy, mut restored, mut ticked) = (first.clone(), in_bend(), first.clone());
    restored.restore(&state).unwrap();
    assert_eq!(restored.report().hand(0).steer, 0.4);
    let command = Command { advance_mm: 1.0, rotate_rad: 0.1, steer: -0.7 };
    for other in [&mut first, &mut copy, &mut restored] {
        other.step(command).unwrap();
    }
    let moves = [Move { instrument: 0, command }];
    ticked.tick(&moves, ticked.most_solves(&moves).unwrap(), None).unwrap();
    assert!(bits(&first) == bits(&copy) && bits(&first) == bits(&restored) && bits(&first) == bits(&ticked));
}

#[test]
fn what_cannot_be_steered_is_refused() {
    let refused = |error: Error, begins: &str, remedy: &str| {
        let text = error.to_string();
        assert!(error.is_input() && text.starts_with(begins) && text.contains(remedy), "{text}");
    };
    let mut simulation = free(catheter(0.0));
    simulation.step(Command { advance_mm: 20.0, rotate_rad: 0.0, steer: 0.8 }).unwrap();
    refused(simulation.step(Command::steer(0.3)).unwrap_err(), "steer = 0.3", "values are −1 to 1");
    refused(simulation.step(Command::steer(f64::NAN)).unwrap_err(), "steer = NaN", "values are −1 to 1");
    let mut plain = free(Device::uniform(100.0, 0.4, 5.0).unwrap());
    refused(plain.step(Command::steer(0.3)).unwrap_err(), "steer = 0.3", "it is not steered");
    let tight =
        Section { steer: Some(Steer { plane_deg: 0.0, curvature_per_mm_at_1: 1.2 }), ..steered(10.0, 0.0) };
    let name = "device.section[0].steer.curvature_per_mm_at_1 = 1.2";
    refused(Device::new(vec![tight]).unwrap_err(), name, "no tighter than its own radius");
}

#[test]
fn a_script_steers_to_a_value_in_increments() {
    let stack = Stack::from(catheter(0.0));
    let to = |steer: f64| ScriptLine { steer: Some(steer), ..ScriptLine::default() };
    let lines = [
        ScriptLine { advance_mm: Some(60.0), step_mm: Some(10.0), ..to(0.3) },
        ScriptLine { step_steer: Some(0.1), ..to(-0.2) },
        ScriptLine { rotate_deg: Some(10.0), ..ScriptLine::default() },
    ];
    let script = endowire_core::insertion::Script::new(&lines, &stack, &[0.0], None).unwrap();
    assert_eq!(script.len(), 6 + 5 + 2);
    let mut simulation = free(stack.clone());
    let mut run = script.begin();
    let mut values = Vec::new();
    while let Some(step) = run.next(&simulation).unwrap() {
        let step = step.into_owned();
        step.carry_out(&mut simulation).unwrap();
        run.carried_out();
        values.push(simulation.report().hand(0).steer);
    }
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(
        near(values[0], 0.05) && near(values[5], 0.3) && near(values[10], -0.2) && near(values[12], -0.2)
    );
    let refused = |steer: f64, stack: &Stack| {
        endowire_core::insertion::Script::new(&[to(steer)], stack, &[0.0], None).unwrap_err().to_string()
    };
    let plain = Stack::from(Device::uniform(100.0, 0.4, 5.0).unwrap());
    assert!(refused(0.3, &plain).starts_with("script[0].steer = 0.3: the instrument is not steered"));
    assert!(refused(1.3, &stack).starts_with("script[0].steer = 1.3: must be a value from −1 to 1"));
}

/// How far along the way to a branch the tip is, mm, with a penalty for being out of its lumen.
fn progress_mm(path: &CentrelinePath, simulation: &Simulation) -> f64 {
    let on = path.nearest(&tip_mm(simulation));
    on.arc_mm - 4.0 * (on.distance_mm - on.radius_mm).max(0.0) - 0.3 * on.distance_mm
}

/// The simplest search: of a few motions, tried on copies, the one that brings the tip farthest.
fn reaches(start: &Simulation, path: &CentrelinePath) -> bool {
    let mut simulation = start.clone();
    let short = [0.0, 0.25, -0.25];
    for _ in 0..90 {
        let mut best: Option<(f64, Simulation)> = None;
        for (steer, rotate_rad) in
            short.into_iter().map(|steer| (steer, 0.0)).chain([(0.0, 0.6), (0.0, -0.6)])
        {
            for advance_mm in [6.0, -4.0] {
                let mut tried = simulation.clone();
                if tried.step(Command { advance_mm, rotate_rad, steer }).is_ok() {
                    let mm = progress_mm(path, &tried);
                    if best.as_ref().is_none_or(|(most_mm, _)| mm > *most_mm) {
                        best = Some((mm, tried));
                    }
                }
            }
        }
        let Some((_, next)) = best else { return false };
        simulation = next;
        let on = path.nearest(&tip_mm(&simulation));
        if on.arc_mm > path.length_mm() - 10.0 && on.distance_mm < on.radius_mm {
            return true;
        }
    }
    false
}

#[test]
fn a_steered_tip_reaches_all_branches_of_the_arch() {
    let tree = anatomy::tree("aortic_arch").unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(2.5)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let shaft = Section { torsional_stiffness_nmm2: Some(400.0), ..Section::straight(600.0, 0.9, 60.0) };
    let bends = Steer { plane_deg: 0.0, curvature_per_mm_at_1: 0.06 };
    let tip = Section { steer: Some(bends), length_mm: 35.0, bending_stiffness_nmm2: 25.0, ..shaft };
    let device = Device::new(vec![tip, shaft]).unwrap();
    let options = KirchhoffOptions { element_mm: 5.0, ..KirchhoffOptions::default() };
    let mut start = Simulation::builder(made.wall, device, sheath).method(&options).build().unwrap();
    start.step(Command::advance(40.0)).unwrap();
    let branches = ["innominate", "left carotid", "left subclavian"];
    for target in branches.map(|name| tree.target(name).unwrap()) {
        let path = tree.path_to(target.row).unwrap();
        assert!(reaches(&start, &path), "{}", target.name);
    }
}

#[test]
fn a_scene_says_what_is_steered() {
    let text = r#"
name = "steered"
[vessel]
tree = "../vessels/curved_tube.csv"
[sheath]
opening = 0
[device]
[[device.section]]
length_mm = 30.0
radius_mm = 0.9
bending_stiffness_nmm2 = 60.0
steer = { plane_deg = 90.0, curvature_per_mm_at_1 = 0.03 }
[[device.section]]
length_mm = 200.0
radius_mm = 0.9
bending_stiffness_nmm2 = 60.0
[[script]]
advance_mm = 40.0
steer = 0.5
"#;
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/scenes/steered.toml");
    let scene = Scene::from_toml(text, &place).unwrap();
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    for moves in script.moves().unwrap() {
        simulation.step_together(&moves).unwrap();
    }
    assert!((simulation.report().hand(0).steer - 0.5).abs() < 1e-12);
    let misspelt = text.replace("plane_deg", "plain_deg");
    assert!(Scene::from_toml(&misspelt, &place).unwrap_err().to_string().contains("plane_deg"));
}
