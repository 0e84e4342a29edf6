//! The exact rod in a vessel, against independent values and its own conservation laws.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::FRAC_PI_2;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, StepReport, WallProperties};
use endowire_core::methods::MethodChoice;
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Wall, anatomy};
use endowire_tests::crossing::CrossingTest;

fn kirchhoff(element_mm: f64) -> MethodChoice {
    MethodChoice::Kirchhoff(KirchhoffOptions { element_mm, ..Default::default() })
}

/// Straight, a 90° bend and straight again, in the plane z = 0 from the origin along +x.
fn bent_tube(straight_mm: f64, bend_mm: f64, end_mm: f64, radius_mm: f64) -> CentrelineTree {
    let mut axis = Vec::new();
    let steps = |length: f64| length.round() as usize;
    for i in 0..steps(straight_mm) {
        axis.push((i as f64 * straight_mm / steps(straight_mm) as f64, 0.0));
    }
    let arc = steps(bend_mm * FRAC_PI_2);
    for i in 0..=arc {
        let angle = FRAC_PI_2 * i as f64 / arc as f64;
        axis.push((straight_mm + bend_mm * angle.sin(), bend_mm - bend_mm * angle.cos()));
    }
    for i in 1..=steps(end_mm) {
        axis.push((straight_mm + bend_mm, bend_mm + i as f64 * end_mm / steps(end_mm) as f64));
    }
    let node = |(i, (x, y)): (usize, &(f64, f64))| CentrelineNode {
        position_mm: Vec3::new(*x, *y, 0.0),
        radius_mm,
        parent: i.checked_sub(1),
    };
    CentrelineTree::new(axis.iter().enumerate().map(node).collect()).unwrap()
}

/// Reference case C5: a soft-walled tube, 40 mm of wire inserted. Returns triangles, tip and report.
fn soft_tube(edge_mm: f64, modulus_n_per_mm2: f64) -> (usize, Vec3, StepReport) {
    let wall =
        GeneratedWall::new(&bent_tube(20.0, 30.0, 10.0, 3.0), Resolution::EdgeMm(edge_mm)).unwrap().wall;
    let triangles = wall.mesh().triangles.len();
    let sheath = Sheath::new(Vec3::zeros(), Vec3::x()).unwrap();
    let wire = Device::uniform(100.0, 0.45, 10.0).unwrap();
    let soft = WallProperties { modulus_n_per_mm2, ..Default::default() };
    let mut simulation = Simulation::with_properties(wall, soft, wire, sheath, &kirchhoff(1.0)).unwrap();
    for _ in 0..20 {
        simulation.step(Command::advance(2.0)).unwrap();
    }
    (triangles, simulation.shape().tip_mm().unwrap(), simulation.report().clone())
}

#[test]
fn the_soft_walled_tube_is_met_on_a_mesh() {
    let (triangles, tip, report) = soft_tube(0.3, 1.0);
    assert!(triangles <= 40_000);
    let miss = (tip - Vec3::new(39.744407, 4.116002, 0.0)).norm();
    assert!(miss < 0.01, "tip off by {miss} mm");
    let forces: f64 = report.contacts.iter().map(|c| c.force_n).sum();
    for (name, computed, expected) in [
        ("bending energy", report.energy.bend, 0.00399283),
        ("wall energy", report.energy.wall, 0.00000551),
        ("wall force", forces, 0.002241),
        ("tip penetration", report.contacts[0].penetration_mm, 0.004922),
        ("push force", report.push_force_n, 0.00106708),
    ] {
        let error = (computed / expected - 1.0).abs();
        assert!(error < 0.01, "{name}: {computed} instead of {expected}, {error:.1e}");
    }
    let (_, _, stiffer) = soft_tube(0.6, 1.1);
    assert!(
        (stiffer.energy.wall / 0.00000551 - 1.0).abs() > 0.01,
        "another wall is seen by the same comparison"
    );
}

fn curved_tube() -> (Wall, Sheath) {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    (made.wall, sheath)
}

fn in_curved_tube(modulus_n_per_mm2: f64) -> Simulation {
    let (wall, sheath) = curved_tube();
    let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
    Simulation::with_properties(
        wall,
        WallProperties { modulus_n_per_mm2, ..Default::default() },
        wire,
        sheath,
        &kirchhoff(2.0),
    )
    .unwrap()
}

#[test]
fn the_result_does_not_depend_on_the_increment() {
    let run = |step_mm: f64| {
        let mut simulation = in_curved_tube(1.0);
        for _ in 0..(200.0 / step_mm).round() as usize {
            simulation.step(Command::advance(step_mm)).unwrap();
        }
        assert!(!CrossingTest::new(simulation.wall().mesh()).crosses_curve(simulation.shape()));
        (simulation.shape().tip_mm().unwrap(), simulation.report().push_force_n)
    };
    let (tip, force) = run(1.0);
    for step_mm in [0.5, 4.0] {
        let (other_tip, other_force) = run(step_mm);
        assert!((other_tip - tip).norm() < 0.02, "{step_mm} mm: {}", (other_tip - tip).norm());
        assert!((other_force / force - 1.0).abs() < 1e-4, "{step_mm} mm: {other_force} and {force}");
    }
}

#[test]
fn the_push_force_is_the_slope_of_the_energy() {
    let mut simulation = in_curved_tube(1.0);
    for _ in 0..160 {
        simulation.step(Command::advance(1.0)).unwrap();
    }
    for _ in 0..3 {
        simulation.step(Command::advance(7.3)).unwrap();
        let here = simulation.report().push_force_n;
        let step = 0.02;
        let before = simulation.step(Command::retract(step)).unwrap().energy.total();
        let after = simulation.step(Command::advance(2.0 * step)).unwrap().energy.total();
        let slope = (after - before) / (2.0 * step);
        simulation.step(Command::retract(step)).unwrap();
        assert!((here / slope - 1.0).abs() < 1e-3, "push force {here}, slope {slope}");
    }
}

#[test]
fn in_and_out_returns_to_the_same_energy() {
    let mut simulation = in_curved_tube(1.0);
    for _ in 0..150 {
        simulation.step(Command::advance(1.0)).unwrap();
    }
    let before = simulation.report().clone();
    for _ in 0..40 {
        assert!(!simulation.step(Command::advance(1.0)).unwrap().jumped);
    }
    for _ in 0..40 {
        assert!(!simulation.step(Command::retract(1.0)).unwrap().jumped);
    }
    let after = simulation.report();
    let change = (after.energy.total() / before.energy.total() - 1.0).abs();
    assert!(change < 1e-8, "{change:e}");
    assert!((after.energy.bend - simulation.step(Command::advance(1.0)).unwrap().energy.bend).abs() > 1e-6);
}

#[test]
fn walls_of_any_stiffness_are_met_and_never_crossed() {
    for modulus in [1e-3, 1e-1, 1e2, 1e4] {
        let mut simulation = in_curved_tube(modulus);
        let crossing = CrossingTest::new(simulation.wall().mesh());
        for _ in 0..50 {
            simulation.step(Command::advance(4.0)).unwrap_or_else(|e| panic!("{modulus} N/mm²: {e}"));
            assert!(!crossing.crosses_curve(simulation.shape()), "{modulus} N/mm²");
        }
        let deepest = simulation.report().max_penetration_mm;
        assert!(deepest < 0.445, "{modulus} N/mm²: {deepest} mm");
    }
}

#[test]
fn skipping_queries_changes_nothing() {
    let run = |skip: bool| {
        let (wall, sheath) = curved_tube();
        let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
        let method = MethodChoice::Kirchhoff(KirchhoffOptions { skip, ..Default::default() });
        let mut simulation = Simulation::new(wall, wire, sheath, &method).unwrap();
        for _ in 0..80 {
            simulation.step(Command::advance(2.0)).unwrap();
        }
        (simulation.shape().clone(), simulation.report().counters)
    };
    let ((with, saved), (without, spent)) = (run(true), run(false));
    for (a, b) in with.positions_mm.iter().zip(&without.positions_mm) {
        assert!((a - b).norm() < 1e-9, "{}", (a - b).norm());
    }
    assert!(saved.avoided > 0 && saved.walked > 0 && spent.avoided == 0 && spent.walked == 0);
    assert!(saved.queries * 5 < spent.queries, "{saved:?} {spent:?}");
}

#[test]
fn a_shaped_tip_turns_with_the_tail_and_finds_its_way_through_the_arch() {
    let arch =
        GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), Resolution::Triangles(5_000)).unwrap();
    let sheath = Sheath::at_opening(&arch.wall, arch.inlet, 2.0).unwrap();
    let tip = Section { rest_curvature_per_mm: [0.05, 0.0], ..Section::straight(30.0, 0.445, 5.0) };
    let wire = Device::new(vec![tip, Section::straight(400.0, 0.445, 15.0)]).unwrap();
    let mut simulation = Simulation::new(arch.wall, wire, sheath, &kirchhoff(4.0)).unwrap();
    let crossing = CrossingTest::new(simulation.wall().mesh());
    for _ in 0..50 {
        let report = simulation.step(Command { advance_mm: 5.0, rotate_rad: 0.1 }).unwrap();
        assert!(report.converged);
        assert!(!crossing.crosses_curve(simulation.shape()));
    }
    // The free tip of a wire in air would have turned with the hand: the torque is the wall's doing.
    assert!(simulation.report().torque_nmm.abs() > 1e-6);
}

#[test]
fn the_same_commands_give_the_same_bits() {
    let run = || {
        let mut simulation = in_curved_tube(1.0);
        for _ in 0..45 {
            simulation.step(Command::advance(4.0)).unwrap();
        }
        simulation.shape().clone()
    };
    assert_eq!(run(), run());
}
