//! Shaped tips: to which side they bend, and what they store, in every method that has them.

use std::f64::consts::FRAC_PI_2;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{CentrelineNode, CentrelineTree, Resolution, SweptVessel, anatomy};
use endowire_methods::AnyMethod;
use nalgebra::Rotation3;

/// All methods that have shaped tips.
const SHAPED: [&str; 4] = ["kirchhoff", "beam-fem", "beam-fem-damped", "chord-energy"];
/// Length of the tip, mm, its rest curvature, 1/mm, and its bending stiffness, N·mm².
const TIP: (f64, f64, f64) = (20.0, 0.05, 5.0);

/// A hook of a radian, with this rest curvature, on a wire.
fn hook(rest_curvature_per_mm: [f64; 2]) -> Device {
    let tip = Section { rest_curvature_per_mm, ..Section::straight(TIP.0, 0.4, TIP.2) };
    Device::new(vec![tip, Section::straight(100.0, 0.4, 10.0)]).unwrap()
}

/// A device at the middle of a wide tube, in which it touches nothing.
fn in_the_open(name: &str, device: Device, direction: Vec3, towards: Option<Vec3>) -> Simulation {
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * (200.0 * i as f64),
        radius_mm: 80.0,
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..2).map(node).collect()).unwrap();
    let vessel = SweptVessel::new(tree, Resolution::EdgeMm(10.0)).unwrap();
    let sheath = Sheath::new(Vec3::z() * 100.0, direction).unwrap();
    let sheath = towards.map_or(sheath, |towards| sheath.bending_towards(towards).unwrap());
    let method = AnyMethod::named(name).unwrap().with_element_mm(1.0);
    let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
    Simulation::builder(vessel, device, sheath).properties(properties).method(&method).build().unwrap()
}

/// Where the tip is beside the sheath's axis, mm.
fn lateral(simulation: &Simulation) -> Vec3 {
    let (sheath, tip) = (simulation.sheath(), simulation.shape().tip_mm().unwrap());
    let from = tip - sheath.position_mm;
    from - sheath.direction * from.dot(&sheath.direction)
}

#[test]
fn all_methods_bend_to_the_same_side_and_there_where_the_sheath_says() {
    for direction in [Vec3::z(), Vec3::x(), -Vec3::y(), Vec3::new(0.577, 0.577, 0.578)] {
        for towards in [None, Some(Vec3::new(0.3, -1.0, 0.6))] {
            let sides = SHAPED.map(|name| {
                let mut simulation = in_the_open(name, hook([TIP.1, 0.0]), direction, towards);
                simulation.step(Command::advance(10.0)).unwrap();
                simulation.step(Command::advance(10.0)).unwrap();
                let lateral = lateral(&simulation);
                assert!((lateral.norm() - (1.0 - 1.0f64.cos()) / TIP.1).abs() < 0.1, "{name}: {lateral}");
                if let Some(way) = towards {
                    let t = simulation.sheath().direction;
                    let across = (way - t * way.dot(&t)).normalize();
                    assert!((lateral.normalize() - across).norm() < 1e-3, "{name}: {lateral} {across}");
                }
                lateral
            });
            for (side, name) in sides.iter().zip(SHAPED) {
                assert!((side - sides[0]).norm() < 0.1, "{name}, {direction}: {side} for {}", sides[0]);
            }
        }
    }
}

#[test]
fn a_scene_and_its_rotation_are_the_same_where_the_sheath_says_to_which_side_a_tip_bends() {
    let tree = anatomy::tree("curved_tube").unwrap();
    let pushed = |name: &str, turn: Rotation3<f64>, towards: Option<Vec3>| {
        let node = |node: &CentrelineNode| CentrelineNode { position_mm: turn * node.position_mm, ..*node };
        let turned = CentrelineTree::new(tree.nodes().iter().map(node).collect()).unwrap();
        let vessel = SweptVessel::new(turned, Resolution::EdgeMm(2.0)).unwrap();
        let sheath = Sheath::new(turn * Vec3::z(), turn * Vec3::z()).unwrap();
        let sheath = towards.map_or(sheath, |towards| sheath.bending_towards(turn * towards).unwrap());
        let method = AnyMethod::named(name).unwrap();
        let properties = WallProperties { deviation_mm: 0.0, ..WallProperties::default() };
        let builder = Simulation::builder(vessel, hook([0.06, 0.01]), sheath).properties(properties);
        let mut simulation = builder.method(&method).build().unwrap();
        for _ in 0..30 {
            simulation.step(Command::advance(2.0)).unwrap();
        }
        let tip = turn.inverse() * simulation.shape().tip_mm().unwrap();
        (tip, simulation.report().push_force_n)
    };
    let turn = Rotation3::new(Vec3::new(0.4, -1.1, 0.8));
    for (name, within_mm) in [("kirchhoff", 1e-4), ("beam-fem-damped", 1e-2), ("chord-energy", 1e-2)] {
        let towards = Some(Vec3::new(-1.0, 2.0, 0.5));
        let (was, is) = (pushed(name, Rotation3::identity(), towards), pushed(name, turn, towards));
        assert!((was.0 - is.0).norm() < within_mm, "{name}: {was:?} {is:?}");
        assert!((was.1 - is.1).abs() < within_mm * was.1.abs().max(1e-3), "{name}: {was:?} {is:?}");
    }
    // Without it the side belongs to the axes of the scene.
    let (was, is) = (pushed("kirchhoff", Rotation3::identity(), None), pushed("kirchhoff", turn, None));
    assert!((was.0 - is.0).norm() > 0.1, "{was:?} {is:?}");
}

#[test]
fn a_tip_at_rest_stores_nothing_and_comes_out_with_what_the_sheath_had_stored_in_it() {
    let in_sheath_n = 0.5 * TIP.2 * TIP.1 * TIP.1;
    let all_mj = in_sheath_n * TIP.0;
    for name in SHAPED {
        let mut simulation = in_the_open(name, hook([0.6 * TIP.1, -0.8 * TIP.1]), Vec3::x(), None);
        let (mut before_n, mut given_mj) = (-in_sheath_n, 0.0);
        for _ in 0..20 {
            let report = simulation.step(Command::advance(1.0)).unwrap();
            given_mj += 0.5 * (before_n + report.push_force_n);
            before_n = report.push_force_n;
        }
        let energy = simulation.report().energy;
        assert!(energy.total() < 0.01 * all_mj, "{name}: {energy:?} for {all_mj}");
        let lost_mj = given_mj + all_mj - energy.total();
        // The published methods stop at a tolerance that lets moments of short chains be off by a few per cent.
        assert!(lost_mj.abs() < 0.1 * all_mj, "{name}: {given_mj} {energy:?} for {all_mj}");
    }
}

#[test]
fn a_tip_that_has_turned_with_the_hand_says_so() {
    for name in SHAPED {
        let mut simulation = in_the_open(name, hook([TIP.1, 0.0]), Vec3::x(), None);
        simulation.step(Command::advance(20.0)).unwrap();
        let was = lateral(&simulation);
        for _ in 0..9 {
            simulation
                .step(Command { advance_mm: 0.0, rotate_rad: FRAC_PI_2 / 9.0, ..Command::default() })
                .unwrap();
        }
        let (is, report) = (lateral(&simulation), simulation.report());
        let went = was.cross(&is).x.atan2(was.dot(&is));
        assert!((went - FRAC_PI_2).abs() < 0.1, "{name}: {went}");
        assert!((report.tip_rotation_rad - went).abs() < 0.1, "{name}: {went} {report:?}");
        simulation.step(Command::advance(10.0)).unwrap();
        let turned = simulation.report().tip_rotation_rad;
        assert!((turned - FRAC_PI_2).abs() < 0.1, "{name}: {turned}");
    }
}

#[test]
fn a_state_is_not_that_of_a_sheath_that_says_another_side() {
    for name in SHAPED {
        let start = |towards: Option<Vec3>| in_the_open(name, hook([TIP.1, 0.0]), Vec3::z(), towards);
        let mut simulation = start(Some(Vec3::y()));
        simulation.step(Command::advance(10.0)).unwrap();
        let state = simulation.state();
        start(Some(Vec3::y())).restore(&state).unwrap();
        for other in [None, Some(Vec3::x())] {
            let reported = start(other).restore(&state).unwrap_err().to_string();
            assert!(reported.starts_with("state."), "{name}: {reported}");
        }
    }
}
