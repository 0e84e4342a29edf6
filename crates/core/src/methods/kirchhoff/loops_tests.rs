//! Self-contact of devices.

use super::{Kirchhoff, KirchhoffOptions};
use crate::Vec3;
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use crate::methods::{Method, Surroundings};
use crate::random::{splitmix64, unit};
use crate::rod::TWISTED;
use crate::rod::quadrature::hermite;
use crate::shape::Shape;
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Lumen, NoStore, Resolution};

const RADIUS_MM: f64 = 0.2;

/// A soft wire whose rest shape is a helix of 3 mm radius, a tube of this radius, and a sheath beside its axis.
pub(super) fn parts(tube_mm: f64) -> (GeneratedWall, Device, Sheath) {
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * (20.0 * i as f64),
        radius_mm: tube_mm,
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..4).map(node).collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(1.0)).unwrap();
    let position_mm = Vec3::new(-0.5 * tube_mm, 0.0, 30.0);
    let sheath =
        Sheath { position_mm, direction: Vec3::x(), friction: 0.0, friction_n: 0.0, bends_towards: None };
    let wire = Section::straight(200.0, RADIUS_MM, 0.05);
    let section = Section { rest_curvature_per_mm: [1.0 / 3.0, 0.02], ..wire };
    (made, Device::new(vec![section]).unwrap(), sheath)
}

fn properties() -> WallProperties {
    WallProperties { modulus_n_per_mm2: 10.0, ..WallProperties::default() }
}

fn method(self_contact: bool) -> KirchhoffOptions {
    KirchhoffOptions { element_mm: 1.0, self_contact, ..KirchhoffOptions::default() }
}

fn curling(tube_mm: f64, self_contact: bool) -> Simulation {
    let (made, device, sheath) = parts(tube_mm);
    let builder = Simulation::builder(made.wall, device, sheath).properties(properties());
    builder.method(&method(self_contact)).build().unwrap()
}

/// Points of the device's axis, at most a twentieth of a millimetre apart.
pub(super) fn axis(shape: &Shape) -> Vec<Vec3> {
    let mut points = Vec::new();
    for e in 0..shape.len() - 1 {
        let h = shape.from_tip_mm[e] - shape.from_tip_mm[e + 1];
        let count = (h / 0.05).ceil();
        for k in 0..count as usize {
            let [w0, s0, w1, s1] = hermite(k as f64 / count);
            let along = (shape.tangents[e] * s0 + shape.tangents[e + 1] * s1) * h;
            points.push(shape.positions_mm[e] * w0 + shape.positions_mm[e + 1] * w1 + along);
        }
    }
    points
}

/// Smallest distance of two pieces of the device's axis that are not adjacent, mm.
fn least_distance_mm(shape: &Shape) -> f64 {
    let points = axis(shape);
    let apart = 40;
    let mut least = f64::INFINITY;
    for (i, a) in points.iter().enumerate() {
        for b in points.iter().skip(i + apart) {
            least = least.min((a - b).norm());
        }
    }
    least
}

#[test]
fn loops_lie_on_each_other_and_do_not_pass() {
    let run = |self_contact: bool| {
        let mut simulation = curling(4.0, self_contact);
        let (mut least_mm, mut deepest_mm, mut touching) = (f64::INFINITY, 0.0f64, 0);
        for step in 0..120 {
            let done = simulation.step(Command::advance(0.5));
            assert!(done.is_ok(), "step {step}: {done:?}");
            least_mm = least_mm.min(least_distance_mm(simulation.shape()));
            let found = simulation.touching();
            touching += usize::from(!found.is_empty());
            deepest_mm = found.iter().map(|t| t.penetration_mm).fold(deepest_mm, f64::max);
        }
        (least_mm, deepest_mm, touching)
    };
    let (least_mm, deepest_mm, touching) = run(true);
    assert!(touching > 10 && deepest_mm < 0.01 * RADIUS_MM, "{touching} {deepest_mm}");
    assert!(least_mm > 1.98 * RADIUS_MM, "{least_mm}");
    // Counter-check: without self-contact they pass through each other.
    let (least_mm, _, touching) = run(false);
    assert!(touching == 0 && least_mm < RADIUS_MM, "{least_mm}");
}

/// Energy of the wire with 36 mm out, mJ, and whether it touches itself.
fn curled(element_mm: f64, step_mm: f64, self_contact: bool) -> (f64, bool) {
    let (made, device, sheath) = parts(4.0);
    let builder = Simulation::builder(made.wall, device, sheath).properties(properties());
    let method = KirchhoffOptions { element_mm, ..method(self_contact) };
    let mut simulation = builder.method(&method).build().unwrap();
    for _ in 0..(36.0 / step_mm) as usize {
        assert!(simulation.step(Command::advance(step_mm)).unwrap().converged);
    }
    (simulation.report().energy.total(), !simulation.touching().is_empty())
}

#[test]
fn steps_and_elements_do_not_change_the_energy_of_loops() {
    let (mj, touches) = curled(1.0, 0.5, true);
    assert!(touches);
    let off = |(other_mj, _): (f64, bool)| (other_mj / mj - 1.0).abs();
    let found = [curled(1.0, 0.25, true), curled(0.5, 0.5, true), curled(1.0, 0.5, false)].map(off);
    assert!(found[0] < 1e-4 && found[1] < 0.01, "{found:?}");
    assert!(found[2] > 0.02, "the twin, which passes through itself: {found:?}");
}

#[test]
fn nothing_is_built_where_nothing_can_touch() {
    let (made, device, sheath) = parts(4.0);
    let (lumen, stack) = (Lumen::from(made.wall), Stack::from(device));
    let properties = properties();
    let surroundings = Surroundings::at_rest(&lumen, &properties, &sheath, &stack);
    let searches = |to_mm: f64| {
        let mut wire = Kirchhoff::<TWISTED>::new(method(true), &surroundings, &NoStore).unwrap();
        while wire.report().inserted_mm < to_mm {
            wire.step(&surroundings, Command::advance(0.5)).unwrap();
        }
        wire.workspace.as_ref().unwrap().tools.loops.counters()
    };
    // A quarter of a circle turns by less than two radians.
    assert_eq!(searches(4.5).searches, 0);
    assert!(searches(40.0).pairs > 0);
}

/// Whether near pieces of the axis have changed sides between two shapes: a test independent of gaps and forces.
/// Points are taken at equal arc lengths from the sheath.
fn has_passed(before: &[Vec3], after: &[Vec3]) -> bool {
    let apart = 40;
    let side = |points: &[Vec3], i: usize, j: usize| {
        let (u, v) = (points[i + 1] - points[i], points[j + 1] - points[j]);
        let across = u.cross(&v);
        let between = points[j] - points[i];
        // Of segments whose common normal meets both.
        let (a, b, c) = (u.norm_squared(), u.dot(&v), v.norm_squared());
        let det = a * c - b * b;
        let (d, e) = (between.dot(&u), between.dot(&v));
        let (s, t) = ((d * c - e * b) / det, (d * b - e * a) / det);
        let meets = det > 0.01 * a * c && (-1.0..=2.0).contains(&s) && (-1.0..=2.0).contains(&t);
        (meets && between.norm() < 5.0 * RADIUS_MM).then(|| across.dot(&between).signum())
    };
    let n = before.len().min(after.len()) - 1;
    (0..n).any(|i| {
        (i + apart..n).any(|j| match (side(before, i, j), side(after, i, j)) {
            (Some(was), Some(is)) => was != is,
            _ => false,
        })
    })
}

/// Pushes and rotates a wire of random shape at random. Returns the smallest distance of its axis from itself, mm,
/// the number of commands carried out, and whether it passed through itself.
fn at_random(seed: u64, self_contact: bool) -> (f64, usize, bool) {
    let mut index = 0;
    let mut draw = |low: f64, high: f64| {
        index += 1;
        low + (high - low) * unit(splitmix64(seed, index))
    };
    let (made, _, sheath) = parts(4.0);
    let section = Section {
        rest_curvature_per_mm: [draw(0.25, 0.5), draw(-0.1, 0.1)],
        ..Section::straight(200.0, RADIUS_MM, draw(0.02, 0.2))
    };
    let device = Device::new(vec![section]).unwrap();
    let builder = Simulation::builder(made.wall, device, sheath).properties(properties());
    let mut simulation = builder.method(&method(self_contact)).build().unwrap();
    let (mut least_mm, mut done, mut passed) = (f64::INFINITY, 0, false);
    let from_sheath = |simulation: &Simulation| axis(simulation.shape());
    let mut before = Vec::new();
    for _ in 0..40 {
        let command =
            Command { advance_mm: draw(-0.5, 2.0), rotate_rad: draw(-0.4, 0.4), ..Command::default() };
        if simulation.step(command).is_err() {
            continue;
        }
        done += 1;
        least_mm = least_mm.min(least_distance_mm(simulation.shape()));
        let after = from_sheath(&simulation);
        passed |= !before.is_empty() && has_passed(&before, &after);
        before = after;
    }
    (least_mm, done, passed)
}

#[test]
fn wires_pushed_and_turned_at_random_do_not_pass_through_themselves() {
    let mut twins = 0;
    for seed in 0..6 {
        let (least_mm, done, passed) = at_random(seed, true);
        assert!(least_mm > 1.98 * RADIUS_MM && !passed, "{seed}: {least_mm} mm, {passed}");
        assert!(done > 25, "{seed}: {done}");
        let (least_mm, _, passed) = at_random(seed, false);
        twins += usize::from(passed || least_mm < RADIUS_MM);
    }
    assert!(twins > 3, "{twins}");
}

/// A wire that curls, in a catheter that protrudes by 6 mm from the sheath.
fn through_catheter(self_contact: bool) -> Simulation {
    let (made, wire, sheath) = parts(4.0);
    let catheter = Section { inner_radius_mm: Some(0.3), ..Section::straight(100.0, 0.5, 0.5) };
    let one = |name: &str, device: Device| Instrument { name: name.to_owned(), device, may_lead: true };
    let catheter = Device::new(vec![catheter]).unwrap();
    let stack = Stack::new(vec![one("wire", wire), one("catheter", catheter)]).unwrap();
    let builder = Simulation::builder(made.wall, stack, sheath).properties(properties());
    let mut simulation = builder.method(&method(self_contact)).build().unwrap();
    let together = [0, 1].map(|instrument| Move { instrument, command: Command::advance(1.0) });
    for _ in 0..3 {
        simulation.step_together(&together).unwrap();
    }
    simulation
}

#[test]
fn hands_of_several_instruments_feel_what_loops_do() {
    let run = |self_contact: bool| {
        let mut simulation = through_catheter(self_contact);
        let mut least_mm = f64::INFINITY;
        while simulation.report().inserted_mm < 30.0 {
            simulation.step(Command::advance(0.5)).unwrap();
            least_mm = least_mm.min(least_distance_mm(simulation.shape()));
        }
        (simulation, least_mm)
    };
    let (simulation, least_mm) = run(true);
    assert!(!simulation.touching().is_empty() && least_mm > 1.98 * RADIUS_MM, "{least_mm}");
    // The slope of the energy is the push force, besides the energy released by the sheath.
    let straightened_n = [simulation.device().section_at(50.0).straightening_n(), 0.0];
    for instrument in [0, 1] {
        let energy = |mm: f64| {
            let mut beside = simulation.clone();
            let moves = [Move { instrument, command: Command::advance(mm) }];
            beside.step_together(&moves).unwrap().energy.total()
        };
        let step_mm = 0.01;
        let [a, b, d, e] = [-2.0, -1.0, 1.0, 2.0].map(|k| energy(k * step_mm));
        let slope_n = (8.0 * (d - b) - (e - a)) / (12.0 * step_mm) - straightened_n[instrument];
        let felt_n = simulation.report().instruments[instrument].push_force_n.unwrap();
        assert!(
            (felt_n - slope_n).abs() < 2e-3 * slope_n.abs().max(1e-3),
            "{instrument}: {felt_n} {slope_n}"
        );
    }
    // Counter-check: without self-contact the wire passes through itself.
    let (twin, least_mm) = run(false);
    assert!(twin.touching().is_empty() && least_mm < RADIUS_MM, "{least_mm}");
}

#[test]
fn loops_that_rub_on_each_other_take_work() {
    let run = |self_friction: f64| {
        let (made, device, sheath) = parts(4.0);
        let builder = Simulation::builder(made.wall, device, sheath).properties(properties());
        let options = KirchhoffOptions { self_friction, ..method(true) };
        let mut simulation = builder.method(&options).build().unwrap();
        let (mut work_mj, mut dissipated_mj) = (0.0, 0.0);
        for step in 0..110 {
            let before_n = simulation.report().push_force_n;
            let report = simulation.step(Command::advance(0.5)).unwrap();
            assert!(report.converged, "step {step}: {}", report.imbalance);
            work_mj += 0.25 * (before_n + report.push_force_n);
            dissipated_mj += report.dissipated_mj;
        }
        (work_mj, dissipated_mj)
    };
    let (smooth, rough) = (run(0.0), run(0.3));
    assert!(smooth.1 == 0.0 && rough.1 > 0.0 && rough.0 > smooth.0, "{smooth:?} {rough:?}");
}

#[test]
fn friction_of_loops_that_nothing_feels_is_refused() {
    let (made, device, sheath) = parts(4.0);
    let refused = |self_friction: f64, self_contact: bool| {
        let options = KirchhoffOptions { self_friction, ..method(self_contact) };
        let builder = Simulation::builder(made.wall.clone(), device.clone(), sheath);
        builder.method(&options).build().err().map(|error| error.to_string())
    };
    assert!(refused(0.2, false).unwrap().contains("self_contact = true"));
    assert!(refused(-0.1, true).unwrap().contains("method.self_friction"));
    assert_eq!(refused(0.2, true), None);
}
