//! Insertions of several instruments.

use super::coaxial::Nodes;
use super::mesh::{Fineness, Mesh};
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, LateralForce, Move, Sheath, Simulation, WallProperties};
use crate::methods::kirchhoff::{Accuracy, KirchhoffOptions};
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, anatomy};
use crate::{Result, Vec3};

pub(super) const WIRE: usize = 0;
pub(super) const CATHETER: usize = 1;

fn instrument(name: &str, sections: [Section; 2]) -> Instrument {
    Instrument { name: name.to_owned(), device: Device::new(sections.to_vec()).unwrap(), may_lead: true }
}

/// A hooked wire in a bent catheter.
pub(super) fn wire_in_catheter() -> Stack {
    let wire = Section::straight(330.0, 0.2, 20.0);
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(250.0, 0.8, 60.0) };
    let tip = |section: Section, length_mm, curvature| Section {
        length_mm,
        rest_curvature_per_mm: [curvature, 0.0],
        ..section
    };
    Stack::new(vec![
        instrument("wire", [tip(wire, 15.0, 0.06), wire]),
        instrument("catheter", [tip(catheter, 30.0, 0.02), catheter]),
    ])
    .unwrap()
}

/// Instruments at the mouth of a straight tube.
fn in_tube(stack: impl Into<Stack>, radius_mm: f64) -> Simulation {
    along((0..16).map(|i| Vec3::z() * (20.0 * f64::from(i))), radius_mm, stack)
}

/// Instruments at the mouth of a tube along these points.
fn along(axis: impl Iterator<Item = Vec3>, radius_mm: f64, stack: impl Into<Stack>) -> Simulation {
    rubbing_along(axis, radius_mm, stack, 0.0)
}

/// As [`along`], for a wall with this coefficient of friction.
pub(super) fn rubbing_along(
    axis: impl Iterator<Item = Vec3>,
    radius_mm: f64,
    stack: impl Into<Stack>,
    friction: f64,
) -> Simulation {
    let node =
        |(i, position_mm): (usize, Vec3)| CentrelineNode { position_mm, radius_mm, parent: i.checked_sub(1) };
    let tree = CentrelineTree::new(axis.enumerate().map(node).collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(0.4 * radius_mm)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let properties = WallProperties { friction, ..WallProperties::default() };
    Simulation::builder(made.wall, stack, sheath)
        .properties(properties)
        .method(&KirchhoffOptions::of(Accuracy::Fine))
        .build()
        .unwrap()
}

/// Straight for 30 mm, then an arc of radius 40 mm.
pub(super) fn bend() -> impl Iterator<Item = Vec3> {
    let place = |s: f64| {
        let angle = (s - 30.0).max(0.0) / 40.0;
        Vec3::new(40.0 * (1.0 - angle.cos()), 0.0, s.min(30.0) + 40.0 * angle.sin())
    };
    (0..36).map(move |i| place(4.0 * f64::from(i)))
}

pub(super) fn push(simulation: &mut Simulation, moves: &[(usize, f64)]) -> Result<f64> {
    let each =
        moves.iter().map(|(instrument, mm)| Move { instrument: *instrument, command: Command::advance(*mm) });
    simulation.step_together(&each.collect::<Vec<_>>()).map(|report| report.energy.total())
}

/// The catheter inserted by 80 mm and rotated, the wire by 1 mm more.
fn both_in(radius_mm: f64) -> Simulation {
    let mut simulation = in_tube(wire_in_catheter(), radius_mm);
    push(&mut simulation, &[(WIRE, 1.0)]).unwrap();
    for _ in 0..20 {
        push(&mut simulation, &[(WIRE, 4.0), (CATHETER, 4.0)]).unwrap();
    }
    let turn = Move { instrument: CATHETER, command: Command::rotate(0.7) };
    simulation.step_together(&[turn]).unwrap();
    simulation
}

/// Derivative of the energy by finite differences.
fn slope(energies: &[f64], step_mm: f64) -> f64 {
    let [a, b, _, d, e] = energies else { panic!("{energies:?}") };
    (8.0 * (d - b) - (e - a)) / (12.0 * step_mm)
}

/// Advances the wire out of the catheter, and returns energies and the wire's push forces.
fn advanced(simulation: &mut Simulation, step_mm: f64, count: usize) -> (Vec<f64>, Vec<f64>) {
    let step = |_| {
        let energy = push(simulation, &[(WIRE, step_mm)]).unwrap();
        assert!(simulation.report().converged);
        (energy, simulation.report().instruments[WIRE].push_force_n.unwrap())
    };
    (0..count).map(step).unzip()
}

/// Largest jump of five energies over their smooth trend: fourth differences contain it three times, and the trend
/// barely at all.
fn jump(w: &[f64]) -> f64 {
    (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs() / 3.0
}

#[test]
fn an_end_passes_through_the_mesh_without_a_jump_and_hands_feel_the_slope() {
    let mut simulation = both_in(120.0);
    let (step_mm, count) = (0.1, 400);
    let (energies, forces) = advanced(&mut simulation, step_mm, count);
    let largest = energies.iter().copied().fold(0.0, f64::max);
    let strongest = forces.iter().fold(0.0f64, |most, f| most.max(f.abs()));
    // Where the end of the hook leaves the catheter the force jumps, and the energy has a kink.
    let kink = |k: usize| (1.0 + step_mm * (k + 1) as f64 - 15.0).abs() < 1.01 * step_mm;
    for k in (0..count - 4).filter(|first| !(*first..first + 5).any(kink)) {
        let window = &energies[k..k + 5];
        assert!(jump(window) <= 1e-6 * largest, "{} of {largest} after {k} steps", jump(window));
        let off = (forces[k + 2] - slope(window, step_mm)).abs();
        assert!(off <= 1e-3 * strongest, "{off} of {strongest} after {k} steps");
    }
}

#[test]
fn the_largest_bend_of_an_element_is_reported() {
    let simulation = both_in(120.0);
    let (reported_rad, seen_rad) =
        (simulation.report().largest_bend_rad, simulation.shape().largest_turn_rad());
    // The hook of the wire bends by 0.06/mm and is held by the catheter.
    assert!(reported_rad == seen_rad && (0.03..0.13).contains(&reported_rad), "{reported_rad}");
}

#[test]
fn the_catheter_feels_the_slope_of_its_own_insertion_and_turn() {
    let mut simulation = both_in(120.0);
    push(&mut simulation, &[(WIRE, 12.3)]).unwrap();
    let step_mm = 0.05;
    let energies: Vec<f64> = (-2..=2)
        .map(|k| push(&mut simulation.clone(), &[(CATHETER, step_mm * f64::from(k))]).unwrap())
        .collect();
    let reported = simulation.report().instruments[CATHETER];
    let (found, force) = (slope(&energies, step_mm), reported.push_force_n.unwrap());
    assert!((found - force).abs() < 1e-3 * force.abs(), "{found} and {force}");
    let step_rad = 0.02;
    let turned = |k: i32| {
        let turn = Command::rotate(step_rad * f64::from(k));
        let turn = Move { instrument: CATHETER, command: turn };
        simulation.clone().step_together(&[turn]).unwrap().energy.total()
    };
    let found = slope(&(-2..=2).map(turned).collect::<Vec<_>>(), step_rad);
    assert!(
        (found - reported.torque_nmm).abs() < 1e-3 * reported.torque_nmm.abs(),
        "{found} and {}",
        reported.torque_nmm
    );
}

/// The outermost instrument touches the wall: the line is that of one device with the sum of both stiffnesses and the
/// catheter's radius. A hook of 7 mm and a radius of 3 mm: energy released by the sheath is stored outside, so no
/// push force is needed.
#[test]
fn a_hook_goes_out_and_in_freely_and_no_jump_is_reported() {
    let wire = Section::straight(200.0, 0.4, 5.0);
    let hook = Section { length_mm: 7.0, rest_curvature_per_mm: [1.0 / 3.0, 0.0], ..wire };
    let device = Device::new(vec![hook, Section::straight(25.0, 0.4, 5.0), wire]).unwrap();
    for element_mm in [1.0, 2.0, 4.0] {
        let made =
            GeneratedWall::new(&anatomy::tree("straight_tube").unwrap(), Resolution::EdgeMm(2.0)).unwrap();
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
        let properties = WallProperties { friction: 0.1, ..WallProperties::default() };
        let options = KirchhoffOptions { element_mm, ..KirchhoffOptions::default() };
        let builder = Simulation::builder(made.wall, device.clone(), sheath).properties(properties);
        let mut simulation = builder.method(&options).build().unwrap();
        for k in 0..116 {
            let advance_mm = if k < 60 { 0.25 } else { -0.25 };
            let report =
                simulation.step(Command { advance_mm, rotate_rad: 0.0, ..Command::default() }).unwrap();
            let what = format!("{element_mm} mm elements, {} mm in: {report:?}", report.inserted_mm);
            assert!(report.converged && !report.jumped && report.relaxations == 0, "{what}");
            // Where the tip reaches the wall a step may be subdivided twice.
            assert!(report.substeps <= 4, "{what}");
        }
    }
}

#[test]
fn a_mesh_beside_another_is_the_one_made_anew() {
    let (stack, modulus, by_mm) = (wire_in_catheter(), 1.0, 0.005);
    // Lengths before and after; compares the updated mesh with a new one, and checks the list of changed elements.
    let both = |lengths: [f64; 2], moved: [f64; 2], within_mm: f64| {
        let nodes = Nodes::new(&stack, &lengths, Fineness::of_elements(2.0));
        let [mut known, mut anew, mut beside] = [(); 3].map(|()| Mesh::default());
        nodes.mesh(&stack, &lengths, modulus, &mut known);
        nodes.mesh(&stack, &moved, modulus, &mut anew);
        let others = nodes.mesh_beside((&stack, &moved), (&known, within_mm), modulus, &mut beside);
        (known, anew, beside, others)
    };
    // Ends apart, at marks, at equal lengths, and the catheter's end next to the wire's tip on either side.
    for lengths in [[90.3, 71.1], [80.0, 60.0], [95.0, 95.0], [95.0, 80.002], [95.0, 79.998]] {
        for (index, by_mm) in [(WIRE, by_mm), (WIRE, -by_mm), (CATHETER, by_mm), (CATHETER, -by_mm)] {
            let mut moved = lengths;
            moved[index] += by_mm;
            let (known, anew, beside, others) = both(lengths, moved, 0.01);
            assert_eq!(beside.elements, anew.elements, "{moved:?}");
            assert_eq!(beside.points, anew.points, "{moved:?}");
            assert_eq!((beside.from_tip_mm, beside.inserted_mm), (anew.from_tip_mm, anew.inserted_mm));
            for e in (0..known.elements.len()).filter(|e| !others.contains(e)) {
                assert_eq!(beside.elements[e], known.elements[e], "{moved:?}, element {e}");
            }
            assert!(others.len() < known.elements.len() / 2 && !others.is_empty(), "{moved:?}: {others:?}");
            // Without the changed elements it is another mesh.
            assert!(others.iter().any(|e| anew.elements[*e] != known.elements[*e]), "{moved:?}");
        }
    }
}

#[test]
fn straight_instruments_of_one_length_are_one_device() {
    let one = |name: &str, section: Section| Instrument {
        name: name.to_owned(),
        device: Device::new(vec![section]).unwrap(),
        may_lead: true,
    };
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(150.0, 0.8, 60.0) };
    let wire = Section::straight(150.0, 0.2, 20.0);
    let stack = Stack::new(vec![one("wire", wire), one("catheter", catheter)]).unwrap();
    let mut both = in_tube(stack, 3.0);
    let mut single = in_tube(Device::uniform(150.0, 0.8, 80.0).unwrap(), 3.0);
    for _ in 0..30 {
        push(&mut both, &[(WIRE, 2.0), (CATHETER, 2.0)]).unwrap();
        single.step(Command::advance(2.0)).unwrap();
    }
    for (a, b) in both.shape().positions_mm.iter().zip(&single.shape().positions_mm) {
        assert!((a - b).norm() < 1e-9, "{a} and {b}");
    }
}

#[test]
fn a_refused_command_changes_nothing_and_a_wire_is_exchanged() {
    let mut instruments = wire_in_catheter().instruments().to_vec();
    instruments.insert(
        0,
        instrument("other", [Section::straight(10.0, 0.3, 4.0), Section::straight(300.0, 0.3, 30.0)]),
    );
    let mut simulation = in_tube(Stack::new(instruments).unwrap(), 20.0);
    let (other, wire, catheter) = (0, 1, 2);
    for _ in 0..10 {
        push(&mut simulation, &[(wire, 4.0), (catheter, 3.0)]).unwrap();
    }
    let bytes = |simulation: &Simulation| serde_json::to_vec(&simulation.state()).unwrap();
    let before = bytes(&simulation);
    for (moves, reported) in [
        (vec![(other, 1.0)], "other.radius_mm = 0.3: \"wire\" has no lumen"),
        (vec![(wire, 1.0), (wire, 1.0)], "moved twice"),
        (vec![(7, 1.0)], "move[0].instrument = 7"),
        (vec![(wire, 1e3)], "wire.advance_mm = 1000"),
        (vec![(catheter, -31.0)], "catheter.retract_mm = 31"),
    ] {
        let error = push(&mut simulation, &moves).unwrap_err().to_string();
        assert!(error.contains(reported), "{error}");
        assert_eq!(bytes(&simulation), before);
    }
    for _ in 0..10 {
        push(&mut simulation, &[(wire, -4.0)]).unwrap();
    }
    for _ in 0..9 {
        push(&mut simulation, &[(other, 4.0)]).unwrap();
    }
    let reported: Vec<f64> = simulation.report().instruments.iter().map(|i| i.inserted_mm.round()).collect();
    assert_eq!(reported, [36.0, 0.0, 30.0]);
    push(&mut simulation, &[(other, -36.0), (catheter, -30.0)]).unwrap();
    assert_eq!(simulation.report().inserted_mm, 0.0);
    assert_eq!(simulation.shape().positions_mm.len(), 1);
}
/// Energy and the wire's push force.
fn surface(simulation: &Simulation) -> (f64, f64) {
    let report = simulation.report();
    assert!(report.converged);
    (report.energy.total(), report.instruments[WIRE].push_force_n.unwrap())
}

/// Largest change of the energy along the wire's motion that its force does not explain, mJ. If that exceeds `bar_mj`
/// the motion is subdivided: smooth parts decrease quadratically, a jump remains.
fn unaccounted(simulation: &mut Simulation, way_mm: f64, bar_mj: f64) -> f64 {
    let start = simulation.clone();
    let (before, pushed) = surface(simulation);
    push(simulation, &[(WIRE, way_mm)]).unwrap();
    let (after, pushes) = surface(simulation);
    let off = (after - before - 0.5 * way_mm * (pushed + pushes)).abs();
    if off <= bar_mj || way_mm < 1e-4 {
        return off;
    }
    *simulation = start;
    let first = unaccounted(simulation, 0.5 * way_mm, bar_mj);
    first.max(unaccounted(simulation, 0.5 * way_mm, bar_mj))
}

/// Pushes the wire on in steps of 0.1 mm: its energy has no jumps, and at times all hands' forces are compared with
/// its slopes.
fn feels_slopes(simulation: &mut Simulation, steps: usize) {
    let bar_mj = 1e-6 * surface(simulation).0;
    for k in 0..steps {
        let off = unaccounted(simulation, 0.1, bar_mj);
        assert!(off <= bar_mj, "{off} of {bar_mj} mJ in step {k}");
        // Marks change at whole millimetres, which an odd number of steps avoids: there the energy has a small jump
        // and no slope.
        for instrument in [WIRE, CATHETER].into_iter().filter(|_| k % 8 == 0) {
            let step_mm = 0.01;
            let at = |k: i32| push(&mut simulation.clone(), &[(instrument, step_mm * f64::from(k))]).unwrap();
            let found = slope(&(-2..=2).map(at).collect::<Vec<_>>(), step_mm);
            let reported = simulation.report().instruments[instrument].push_force_n.unwrap();
            assert!((found - reported).abs() < 1e-3 * reported.abs(), "{found} and {reported} N in step {k}");
        }
    }
}

#[test]
fn in_a_bend_no_energy_jumps_and_hands_feel_its_slope() {
    let mut simulation = along(bend(), 4.0, wire_in_catheter());
    push(&mut simulation, &[(WIRE, 1.0)]).unwrap();
    for _ in 0..20 {
        push(&mut simulation, &[(WIRE, 4.0), (CATHETER, 4.0)]).unwrap();
    }
    feels_slopes(&mut simulation, 100);
}

#[test]
fn in_the_arch_no_energy_jumps_and_hands_feel_its_slope() {
    let tree = anatomy::tree("aortic_arch").unwrap();
    let made = GeneratedWall::new(&tree, anatomy::asset_resolution("aortic_arch")).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let mut simulation = Simulation::builder(made.wall, wire_in_catheter(), sheath)
        .method(&KirchhoffOptions::of(Accuracy::Fine))
        .build()
        .unwrap();
    push(&mut simulation, &[(WIRE, 20.0)]).unwrap();
    for _ in 0..44 {
        push(&mut simulation, &[(WIRE, 4.0), (CATHETER, 4.0)]).unwrap();
    }
    feels_slopes(&mut simulation, 400);
}

/// Two instruments in free space, the inner one curved everywhere, each inserted by 80 mm or more.
fn curved_in_straight([wire_mm, catheter_mm]: [f64; 2]) -> Simulation {
    let wire = Section { rest_curvature_per_mm: [0.02, 0.0], ..Section::straight(165.0, 0.2, 20.0) };
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(150.0, 0.8, 60.0) };
    let stack = Stack::new(vec![instrument("wire", [wire; 2]), instrument("catheter", [catheter; 2])]);
    let mut simulation = in_tube(stack.unwrap(), 120.0);
    for _ in 0..20 {
        push(&mut simulation, &[(WIRE, wire_mm / 20.0), (CATHETER, catheter_mm / 20.0)]).unwrap();
    }
    simulation
}

/// Case D3: the outer instrument bends the inner one from κ₁ to κ = κ₁ EI₁/(EI₁ + EI₂), and the force across the line
/// is −N₁κ per length. N₁ is that of a rod that slides without friction, N₁ + ½EI₁(κ² − κ₁²) = H along the line, with
/// H = −F₁ − ½EI₁κ₁² from its push force F₁.
#[test]
fn the_force_between_two_on_an_arc_is_that_of_the_rods() {
    let (stiffness, rest, curvature) = (20.0, 0.02, 0.005);
    for (lengths, potential) in [([101.0, 80.0], 0.0), ([80.0, 101.0], -0.5 * 15.0 * rest * rest)] {
        let simulation = curved_in_straight(lengths);
        let tension: f64 = potential + 0.5 * stiffness * (rest * rest - curvature * curvature);
        let pushed = simulation.report().instruments[WIRE].push_force_n.unwrap();
        assert!((pushed + potential + 0.5 * stiffness * rest * rest).abs() < 1e-6, "{pushed}");
        let (reported, shape) = (simulation.lateral_forces(WIRE), simulation.shape());
        let compared = |i: &usize| (4.0..76.0).contains(&(shape.from_tip_mm[0] - shape.from_tip_mm[*i]));
        for i in (0..shape.len()).filter(compared) {
            let inwards = (shape.tangents[i + 1] - shape.tangents[i - 1]).normalize();
            let (found, expected) =
                (reported[i].force_n / reported[i].length_mm, inwards * (-tension * curvature));
            assert!((found - expected).norm() < 1e-3 * expected.norm(), "{found} and {expected} at {i}");
        }
        assert!((0..shape.len()).filter(compared).count() > 30);
        let none = |force: &LateralForce| *force == LateralForce::default();
        assert!(simulation.lateral_forces(CATHETER).iter().all(none));
        assert!(none(&reported[0]) && none(&reported[shape.len() - 1]) || lengths[0] < lengths[1]);
    }
}

#[test]
fn instruments_with_flush_tips_push_together_as_one_does() {
    let straight = |name: &str, length_mm, radius_mm, inner_radius_mm| {
        let section = Section { inner_radius_mm, ..Section::straight(length_mm, radius_mm, 20.0) };
        Instrument { name: name.to_owned(), device: Device::new(vec![section]).unwrap(), may_lead: true }
    };
    let both =
        Stack::new(vec![straight("wire", 320.0, 0.2, None), straight("catheter", 300.0, 0.5, Some(0.3))]);
    let mut pair = along(bend(), 4.0, both.unwrap());
    let mut one = along(bend(), 4.0, Device::uniform(300.0, 0.5, 40.0).unwrap());
    for _ in 0..40 {
        push(&mut pair, &[(WIRE, 2.0), (CATHETER, 2.0)]).unwrap();
        one.step(Command::advance(2.0)).unwrap();
    }
    let reported = pair.report().clone();
    assert!(reported.instruments.iter().all(|each| each.push_force_n.is_none()));
    let alone_n = one.report().push_force_n;
    assert!(alone_n > 0.01, "{alone_n}");
    assert!((reported.push_force_n - alone_n).abs() < 1e-3 * alone_n, "{} {alone_n}", reported.push_force_n);
    // Counter-check: with tips apart each hand feels its share.
    push(&mut pair, &[(WIRE, 0.3)]).unwrap();
    let apart = pair.report();
    let sum: f64 = apart.instruments.iter().map(|each| each.push_force_n.unwrap()).sum();
    assert!(
        (apart.push_force_n - sum).abs() < 1e-12 && (sum - alone_n).abs() < 0.2 * alone_n,
        "{sum} {alone_n}"
    );
}

#[test]
fn the_end_of_a_section_leaves_the_sheath_without_a_jump_of_the_push_force() {
    let wire = Section::straight(300.0, 0.2, 50.0);
    let tip =
        Section { length_mm: 20.0, bending_stiffness_nmm2: 0.1, rest_curvature_per_mm: [0.05, 0.0], ..wire };
    let catheter = Section { inner_radius_mm: Some(0.4), ..Section::straight(200.0, 0.6, 20.0) };
    let catheter = [Section { length_mm: 100.0, ..catheter }, catheter];
    let stack = Stack::new(vec![instrument("wire", [tip, wire]), instrument("catheter", catheter)]).unwrap();
    let mut simulation = in_tube(stack, 20.0);
    push(&mut simulation, &[(CATHETER, 10.0)]).unwrap();
    for _ in 0..19 {
        push(&mut simulation, &[(WIRE, 1.0)]).unwrap();
    }
    // The soft tip pushes itself out by ½ EI κ², before and after.
    for beyond_mm in [-0.5, -1e-3, 0.0, 1e-7, 1e-5, 1e-4, 5e-4, 9.99e-4, 1e-3, 1.001e-3, 2e-3, 3e-3, 0.5] {
        let mut there = simulation.clone();
        push(&mut there, &[(WIRE, 1.0 + beyond_mm)]).unwrap();
        let reported = there.report().instruments[WIRE].push_force_n.unwrap();
        assert!((reported + 1.25e-4).abs() < 5e-6, "{reported} N at {beyond_mm} mm");
    }
}
