//! Drag of blood on devices.

use crate::Vec3;
use crate::device::{Device, Instrument, Stack};
use crate::flow::{BloodFlow, VesselFlow, drag_n_per_mm};
use crate::insertion::{Command, Move, Sheath, Simulation};
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Wall};

const RADIUS_MM: f64 = 4.0;
const THREAD_MM: f64 = 0.2;
const INFLOW_ML_PER_S: f64 = 20.0;
/// 8 μ Q / π R⁴.
const GRADIENT: f64 = 8.0 * 3.5e-9 * 1e3 * INFLOW_ML_PER_S / (std::f64::consts::PI * 256.0);

/// A straight tube along z, which the device enters from below.
fn tube() -> (Wall, CentrelineTree) {
    let node = |z: f64, parent| CentrelineNode { position_mm: Vec3::z() * z, radius_mm: RADIUS_MM, parent };
    let nodes = (0..=30).map(|k: usize| node(5.0 * k as f64, k.checked_sub(1))).collect();
    let tree = CentrelineTree::new(nodes).unwrap();
    (GeneratedWall::new(&tree, Resolution::EdgeMm(1.5)).unwrap().wall, tree)
}

fn flow(tree: &CentrelineTree, from_z_mm: f64, inflow_ml_per_s: f64) -> BloodFlow {
    let spec = VesselFlow {
        inflow_ml_per_s,
        inlet_mm: Some([0.0, 0.0, from_z_mm]),
        split_exponent: 3.0,
        viscosity_mpa_s: 3.5,
    };
    BloodFlow::new(tree, &spec).unwrap()
}

fn simulation(stack: impl Into<Stack>, start: (Vec3, Vec3), flow: Option<BloodFlow>) -> Simulation {
    let sheath = Sheath::new(start.0, start.1).unwrap();
    let method = KirchhoffOptions { element_mm: 2.0, ..KirchhoffOptions::default() };
    Simulation::builder(tube().0, stack, sheath).flow(flow).method(&method).build().unwrap()
}

#[test]
fn a_wire_on_the_axis_is_held_against_what_poiseuille_flow_drags() {
    let tree = tube().1;
    let wire = |stiffness_nmm2: f64| Device::uniform(120.0, THREAD_MM, stiffness_nmm2).unwrap();
    // The stiffest is an equilibrium within its tolerance before its axial force is known.
    for (from_z_mm, sign, stiffness_nmm2) in [(0.0, 1.0, 20.0), (150.0, -1.0, 20.0), (150.0, -1.0, 5000.0)] {
        let start = (Vec3::z() * 5.0, Vec3::z());
        let flow = flow(&tree, from_z_mm, INFLOW_ML_PER_S);
        let mut wire = simulation(wire(stiffness_nmm2), start, Some(flow));
        for _ in 0..20 {
            wire.step(Command::advance(5.0)).unwrap();
        }
        let report = wire.report();
        let annulus =
            (RADIUS_MM.powi(2) - THREAD_MM.powi(2)) / (RADIUS_MM / THREAD_MM).ln() - 2.0 * THREAD_MM.powi(2);
        let expected = 100.0 * 0.5 * std::f64::consts::PI * GRADIENT * annulus;
        assert!(
            (report.drag_n - Vec3::z() * (sign * expected)).norm() < 1e-9 * expected,
            "{}",
            report.drag_n
        );
        assert!((report.push_force_n + sign * expected).abs() < 1e-6 * expected, "{}", report.push_force_n);
        assert!(report.contacts.is_empty() && report.converged && !report.jumped);
    }
    // Counter-check: without flow there is no drag.
    let mut wire = simulation(wire(20.0), (Vec3::z() * 5.0, Vec3::z()), None);
    wire.step(Command::advance(50.0)).unwrap();
    assert_eq!((wire.report().drag_n, wire.report().push_force_n), (Vec3::zeros(), 0.0));
}

#[test]
fn a_wire_across_the_flow_bends_as_a_beam_under_its_drag() {
    let tree = tube().1;
    // From the side to the middle of the tube, thin enough to bend a little.
    let (length_mm, stiffness) = (3.0, 0.02);
    let wire = Device::uniform(5.0, THREAD_MM, stiffness).unwrap();
    let start = (Vec3::new(-3.0, 0.0, 75.0), Vec3::x());
    let mut wire = simulation(wire, start, Some(flow(&tree, 0.0, INFLOW_ML_PER_S)));
    for _ in 0..30 {
        wire.step(Command::advance(0.1)).unwrap();
    }
    let tip = *wire.shape().positions_mm.last().unwrap();
    // EI w(L) = ∫ q(s) s² (3L − s)/6 ds, q twice the drag along the tube where the wire is.
    let steps = 3000;
    let each = (0..steps).map(|k| {
        let s = length_mm * (f64::from(k) + 0.5) / f64::from(steps);
        2.0 * drag_n_per_mm(GRADIENT, RADIUS_MM, THREAD_MM, 3.0 - s) * s * s * (3.0 * length_mm - s) / 6.0
    });
    let expected = each.sum::<f64>() * length_mm / f64::from(steps) / stiffness;
    assert!((0.001..0.1).contains(&expected), "{expected}");
    assert!(((tip.z - 75.0) / expected - 1.0).abs() < 0.01, "{} {expected}", tip.z - 75.0);
}

#[test]
fn of_two_instruments_the_outer_is_dragged_where_it_is_and_the_hands_hold_both() {
    let tree = tube().1;
    let named = |name: &str, length_mm: f64, radius_mm: f64, inner_mm: Option<f64>| {
        let mut section = Device::uniform(length_mm, radius_mm, 20.0).unwrap().sections()[0];
        section.inner_radius_mm = inner_mm;
        Instrument { name: name.to_owned(), device: Device::new(vec![section]).unwrap(), may_lead: true }
    };
    let stack =
        Stack::new(vec![named("wire", 120.0, THREAD_MM, None), named("catheter", 60.0, 0.6, Some(0.3))])
            .unwrap();
    let start = (Vec3::z() * 5.0, Vec3::z());
    let mut both = simulation(stack, start, Some(flow(&tree, 0.0, INFLOW_ML_PER_S)));
    let advance = |instrument, mm| Move { instrument, command: Command::advance(mm) };
    both.step_together(&[advance(0, 80.0), advance(1, 30.0)]).unwrap();
    let report = both.report();
    let per_mm = |a: f64| drag_n_per_mm(GRADIENT, RADIUS_MM, a, 0.0);
    // The midpoint between the last point of one and the first of the other divides them.
    let (wire, catheter) = (50.0 * per_mm(THREAD_MM), 30.0 * per_mm(0.6));
    let found = |index: usize| -report.instruments[index].push_force_n.unwrap();
    assert!((found(0) / wire - 1.0).abs() < 0.01 && (found(1) / catheter - 1.0).abs() < 0.02, "{report:?}");
    assert!((found(0) + found(1) - report.drag_n.z).abs() < 1e-6 * report.drag_n.z);
    // Over a still wire the catheter moves with the flow or against it without a jump.
    for mm in [10.0, -10.0] {
        let report = both.step_together(&[advance(1, mm)]).unwrap();
        assert!(report.converged && !report.jumped, "{report:?}");
    }
}

#[test]
fn drag_outlives_a_state_that_is_taken_and_restored() {
    let tree = tube().1;
    let wire = Device::uniform(120.0, THREAD_MM, 1.0).unwrap();
    let start = (Vec3::new(0.0, 1.0, 5.0), Vec3::new(0.0, 0.3, 1.0));
    let mut first = simulation(wire, start, Some(flow(&tree, 150.0, 200.0)));
    let mut second = first.clone();
    for _ in 0..40 {
        first.step(Command::advance(2.0)).unwrap();
        second.step(Command::advance(2.0)).unwrap();
        let state = second.state();
        second.drop_workspace();
        second.restore(&state).unwrap();
        assert_eq!(first.shape(), second.shape());
    }
    assert!(first.report().drag_n.z < 0.0 && first.report() == second.report());
}
