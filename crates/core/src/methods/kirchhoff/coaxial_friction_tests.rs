//! Insertions of several instruments with friction on the wall.

use super::coaxial_tests::{CATHETER, WIRE, bend, push, rubbing_along, wire_in_catheter};
use crate::Vec3;
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, Move, Sheath, Simulation};
use crate::methods::State;
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution};

const FRICTION: f64 = 0.2;

fn one(name: &str, section: Section) -> Instrument {
    let device = Device::new(vec![section]).unwrap();
    Instrument { name: name.to_owned(), device, may_lead: true }
}

/// The catheter inserted by 80 mm, the wire by 14 mm more.
fn both_in() -> Simulation {
    let mut simulation = rubbing_along(bend(), 4.0, wire_in_catheter(), FRICTION);
    push(&mut simulation, &[(WIRE, 14.0)]).unwrap();
    for _ in 0..40 {
        push(&mut simulation, &[(WIRE, 2.0), (CATHETER, 2.0)]).unwrap();
    }
    simulation
}

/// Whether all friction is within Coulomb's cone, and the fraction that slips.
fn slipping(simulation: &Simulation) -> f64 {
    let (mut rubbing_n, mut all_n) = (0.0, 0.0);
    for contact in &simulation.report().contacts {
        let most = FRICTION * contact.force_n;
        assert!(contact.friction_n.norm() <= 1.001 * most + 1e-6, "{contact:?}");
        all_n += most;
        rubbing_n += contact.friction_n.norm();
    }
    rubbing_n / all_n
}

/// With two instruments of one length that move together, friction acts on the outer one, and twists only that.
#[test]
fn a_catheter_over_a_soft_wire_is_a_catheter() {
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(150.0, 0.8, 60.0) };
    let torsional_stiffness_nmm2 = Some(catheter.torsion_nmm2());
    let stack = vec![one("wire", Section::straight(150.0, 0.2, 0.06)), one("catheter", catheter)];
    let both = Section { bending_stiffness_nmm2: 60.06, torsional_stiffness_nmm2, ..catheter };
    let mut single = rubbing_along(bend(), 4.0, Device::new(vec![both]).unwrap(), FRICTION);
    let mut both = rubbing_along(bend(), 4.0, Stack::new(stack).unwrap(), FRICTION);
    let (mut apart_mm, mut torque_off_nmm, mut most_nmm) = (0.0f64, 0.0f64, 0.0f64);
    let (mut taken_mj, mut expected_mj) = (0.0, 0.0);
    for k in 0..120 {
        let command = Command { advance_mm: if k < 100 { 1.0 } else { -0.5 }, rotate_rad: 0.025 };
        let moves = [WIRE, CATHETER].map(|instrument| Move { instrument, command });
        both.step_together(&moves).unwrap();
        single.step(command).unwrap();
        let (reported, alone) = (both.report(), single.report());
        assert!(reported.converged && alone.converged);
        for (a, b) in both.shape().positions_mm.iter().zip(&single.shape().positions_mm) {
            apart_mm = apart_mm.max((a - b).norm());
        }
        torque_off_nmm =
            torque_off_nmm.max((reported.instruments[CATHETER].torque_nmm - alone.torque_nmm).abs());
        most_nmm = most_nmm.max(alone.torque_nmm.abs());
        assert!(reported.instruments[WIRE].torque_nmm.abs() < 1e-9);
        taken_mj += reported.dissipated_mj;
        expected_mj += alone.dissipated_mj;
    }
    // With friction an equilibrium depends on the sub-steps, and rounding may subdivide one command and not the
    // other.
    assert!(
        apart_mm < 2e-3
            && torque_off_nmm < 0.02 * most_nmm
            && (taken_mj - expected_mj).abs() < 1e-3 * expected_mj,
        "{apart_mm} mm apart, torques {torque_off_nmm} of {most_nmm} N·mm, {taken_mj} and {expected_mj} mJ"
    );
}

#[test]
fn hands_put_in_what_is_stored_and_rubbed_away_and_no_force_leaves_its_cone() {
    let mut simulation = both_in();
    // For a tip pushed along the wall, slip is measured from its straight continuation, which affects the work.
    for moves in [&[(WIRE, -0.1)][..], &[(CATHETER, -0.1)], &[(WIRE, -0.1), (CATHETER, -0.05)]] {
        let (mut work, mut taken) = (0.0, 0.0);
        let surface = |simulation: &Simulation| {
            let reported = &simulation.report().instruments;
            moves.iter().map(|(i, mm)| reported[*i].push_force_n.unwrap() * mm).sum::<f64>()
        };
        // The first steps reverse friction.
        for _ in 0..10 {
            push(&mut simulation, moves).unwrap();
        }
        let before = simulation.report().energy.total();
        for k in 0..50 {
            let was = surface(&simulation);
            push(&mut simulation, moves).unwrap();
            assert!(simulation.report().converged, "{moves:?}, step {k}");
            work += 0.5 * (was + surface(&simulation));
            taken += simulation.report().dissipated_mj;
            assert!(slipping(&simulation) > 0.5);
        }
        let stored = simulation.report().energy.total() - before;
        let off = (work - stored - taken).abs();
        assert!(off < 0.01 * taken && taken > 0.0, "{moves:?}: {work} = {stored} + {taken} mJ");
    }
}

#[test]
fn a_step_with_friction_can_be_taken_again_and_a_refused_one_changes_nothing() {
    let mut simulation = both_in();
    let bytes = |simulation: &Simulation| serde_json::to_vec(&simulation.state()).unwrap();
    let before = bytes(&simulation);
    let moves = |mm: f64| [(WIRE, 1.5), (CATHETER, mm)];
    assert!(push(&mut simulation, &moves(1e3)).is_err());
    assert_eq!(bytes(&simulation), before);
    push(&mut simulation, &moves(-0.5)).unwrap();
    let after = bytes(&simulation);
    let mut other = both_in();
    push(&mut other, &[(CATHETER, 2.0)]).unwrap();
    let state: State = serde_json::from_slice(&before).unwrap();
    other.restore(&state).unwrap();
    push(&mut other, &moves(-0.5)).unwrap();
    assert_eq!(bytes(&other), after);
}

#[test]
fn more_than_three_instruments_that_rub_are_refused() {
    let each = (0..4).map(|k| {
        let radius_mm = 0.2 + 0.2 * f64::from(k);
        let section = Section::straight(50.0, radius_mm, 1.0);
        one(&format!("tube {k}"), Section { inner_radius_mm: Some(radius_mm - 0.1), ..section })
    });
    let stack = Stack::new(each.collect()).unwrap();
    let error = stack.twisted().unwrap_err().to_string();
    assert!(error.starts_with("instrument = 4: friction twists every instrument"), "{error}");
}

/// A wire curved everywhere in a straight catheter, in free space: together they form an arc of 90°, in which the
/// wire is pulled by N₁ = ½EI₁(κ₁² − κ²) where it comes out.
fn arc(friction: f64) -> Simulation {
    let wire = Section { rest_curvature_per_mm: [ARC_REST, 0.0], ..Section::straight(165.0, 0.2, 20.0) };
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(150.0, 0.8, 60.0) };
    let stack = Stack::new(vec![one("wire", wire), one("catheter", catheter)]).unwrap();
    let stack = stack.with_friction(vec![friction, 0.0]).unwrap();
    let axis = (0..16).map(|i| Vec3::z() * (20.0 * f64::from(i)));
    let mut simulation = rubbing_along(axis, 120.0, stack, 0.0);
    for _ in 0..40 {
        push(&mut simulation, &[(WIRE, 2.075), (CATHETER, 2.0)]).unwrap();
    }
    simulation
}

const ARC_REST: f64 = 4.0 * std::f64::consts::FRAC_PI_2 / 80.0;

/// Case D5: pulled through an arc of 90° the axial force grows by e^{μφ}, and the catheter is held by the difference.
#[test]
fn a_wire_that_is_pulled_through_a_bend_obeys_the_capstan_law() {
    let friction = 0.15;
    let (mut smooth, mut rough) = (arc(0.0), arc(friction));
    let curvature: f64 = 0.25 * ARC_REST;
    let tension = 0.5 * 20.0 * (ARC_REST * ARC_REST - curvature * curvature);
    for (way, sign) in [(-0.1, 1.0), (0.1, -1.0)] {
        push(&mut smooth, &[(WIRE, way)]).unwrap();
        push(&mut rough, &[(WIRE, way)]).unwrap();
        let rubbed = |index: usize| {
            let surface = |s: &Simulation| s.report().instruments[index].push_force_n.unwrap();
            surface(&rough) - surface(&smooth)
        };
        let grown = 1.0 - rubbed(WIRE) / tension;
        let expected = (sign * friction * std::f64::consts::FRAC_PI_2).exp();
        assert!((grown - expected).abs() < 1e-2 * expected, "{grown} and {expected}");
        assert!((rubbed(WIRE) + rubbed(CATHETER)).abs() < 1e-9);
        let taken = rough.report().dissipated_mj - smooth.report().dissipated_mj;
        assert!((taken - rubbed(WIRE) * way).abs() < 1e-9 && taken > 0.0, "{taken}");
        for (a, b) in rough.shape().positions_mm.iter().zip(&smooth.shape().positions_mm) {
            assert!((a - b).norm() < 1e-9);
        }
    }
    push(&mut rough, &[(WIRE, 1.0), (CATHETER, 1.0)]).unwrap();
    assert!(rough.lateral_forces(WIRE).iter().all(|at| at.friction_n == 0.0));
}

#[test]
fn a_coefficient_that_is_none_is_refused() {
    let stack = wire_in_catheter();
    for (frictions, reported) in [
        (vec![0.1], "instrument.friction = 1: there are 2 instruments"),
        (vec![-0.1, 0.0], "instrument[0].friction = -0.1: must be a Coulomb coefficient"),
        (vec![0.1, 0.1], "instrument[1].friction = 0.1: the last instrument has none outside it"),
    ] {
        let error = stack.clone().with_friction(frictions).unwrap_err().to_string();
        assert!(error.starts_with(reported), "{error}");
    }
}

/// A single catheter in a bend, pushed and rotated through this sheath.
fn through(friction_n: f64, friction: f64) -> Vec<(f64, f64, f64)> {
    let tree = bend().enumerate().map(|(i, position_mm)| CentrelineNode {
        position_mm,
        radius_mm: 4.0,
        parent: i.checked_sub(1),
    });
    let made = GeneratedWall::new(&CentrelineTree::new(tree.collect()).unwrap(), Resolution::EdgeMm(1.6));
    let made = made.unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let sheath = sheath.with_friction(friction_n, friction).unwrap();
    let device = Device::uniform(150.0, 0.8, 60.0).unwrap();
    let mut simulation = Simulation::builder(made.wall, device, sheath).build().unwrap();
    for _ in 0..30 {
        simulation.step(Command::advance(2.0)).unwrap();
    }
    let commands = [Command::advance(1.0), Command::advance(-1.0), Command::rotate(0.5), Command::default()];
    commands
        .into_iter()
        .map(|command| {
            let reported = simulation.step(command).unwrap();
            (reported.push_force_n, reported.torque_nmm, reported.dissipated_mj)
        })
        .collect()
}

#[test]
fn a_valve_holds_against_the_hand_and_moves_nothing_inside() {
    let (smooth, tight, rough) = (through(0.0, 0.0), through(0.3, 0.0), through(0.0, 0.2));
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    // The grip slips by what the tail, less its own radius, does not take up.
    let lag_rad = 0.24 * (150.0 - 60.0 - 0.8) / (60.0 / 1.3);
    for (k, (push, torque, taken)) in
        [(0.3, 0.0, 0.3), (-0.3, 0.0, 0.3), (0.0, 0.24, 0.24 * (0.5 - lag_rad))].into_iter().enumerate()
    {
        near(tight[k].0 - smooth[k].0, push);
        near(tight[k].1 - smooth[k].1, torque);
        near(tight[k].2 - smooth[k].2, taken);
    }
    assert!(rough[0].0 > smooth[0].0 && rough[1].0 < smooth[1].0);
    let reported = |error: crate::Error| error.to_string();
    let sheath = Sheath::new(Vec3::zeros(), Vec3::z()).unwrap();
    assert!(reported(sheath.with_friction(-1.0, 0.0).unwrap_err()).starts_with("sheath.friction_n = -1"));
    assert!(reported(sheath.with_friction(0.0, 3.0).unwrap_err()).starts_with("sheath.friction = 3"));
}

/// What is rubbed off in a sheath and a valve while a wire comes out of its catheter and goes back into the sheath, in
/// steps of this length, mm: the energy, mJ, and the number of jumps.
fn out_and_back(step_mm: f64) -> (f64, usize) {
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(150.0, 0.8, 40.0) };
    let hook = Section { rest_curvature_per_mm: [0.04, 0.02], ..Section::straight(20.0, 0.3, 2.0) };
    let device = Device::new(vec![hook, Section::straight(200.0, 0.35, 12.0)]).unwrap();
    let wire = Instrument { name: "wire".into(), device, may_lead: true };
    let stack = Stack::new(vec![wire, one("catheter", catheter)]).unwrap().sealed(vec![0.0, 0.02]).unwrap();
    let tree = bend().enumerate().map(|(i, position_mm)| CentrelineNode {
        position_mm,
        radius_mm: 4.0,
        parent: i.checked_sub(1),
    });
    let tree = CentrelineTree::new(tree.collect()).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(1.6)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap().with_friction(0.05, 0.3).unwrap();
    let mut simulation = Simulation::builder(made.wall, stack, sheath).build().unwrap();
    let steps = (60.0 / step_mm) as usize;
    let (mut taken_mj, mut jumps) = (0.0, 0);
    let courses = [(CATHETER, step_mm), (WIRE, step_mm), (WIRE, -step_mm), (CATHETER, -step_mm)];
    for (index, step_mm) in courses {
        for _ in 0..steps {
            push(&mut simulation, &[(index, step_mm)]).unwrap();
            taken_mj += simulation.report().dissipated_mj;
            jumps += usize::from(simulation.report().jumped);
        }
    }
    (taken_mj, jumps)
}

#[test]
fn friction_outside_the_body_is_no_jump_for_any_step_and_counts_to_the_end() {
    let (coarse, fine) = (out_and_back(5.0), out_and_back(1.0));
    assert_eq!((coarse.1, fine.1), (0, 0));
    assert!((coarse.0 / fine.0 - 1.0).abs() < 0.02, "{coarse:?} {fine:?}");
    // The valve alone takes 2.4 mJ, and that of the sheath 6 for the catheter.
    assert!(fine.0 > 8.4, "{fine:?}");
}

#[test]
fn level_tips_on_a_rough_wall_are_pushed_as_one_device_is() {
    let wire = Section::straight(320.0, 0.3, 5.0);
    let catheter = Section { inner_radius_mm: Some(0.35), ..Section::straight(300.0, 0.6, 15.0) };
    let torsional_stiffness_nmm2 = Some(catheter.torsion_nmm2());
    let alone = Section { bending_stiffness_nmm2: 20.0, torsional_stiffness_nmm2, ..catheter };
    let single = rubbing_along(bend(), 4.0, Device::new(vec![alone]).unwrap(), FRICTION);
    // Level, nearly level, and apart.
    for ahead_mm in [0.0, 1e-6, 0.01] {
        let stack = Stack::new(vec![one("wire", wire), one("catheter", catheter)]).unwrap();
        let mut both = rubbing_along(bend(), 4.0, stack, FRICTION);
        let mut one = single.clone();
        if ahead_mm > 0.0 {
            push(&mut both, &[(WIRE, ahead_mm)]).unwrap();
        }
        for _ in 0..60 {
            push(&mut both, &[(WIRE, 1.0), (CATHETER, 1.0)]).unwrap();
            one.step(Command::advance(1.0)).unwrap();
            assert_eq!(
                both.report().relaxations,
                0,
                "{ahead_mm} mm ahead at {} mm",
                one.report().inserted_mm
            );
        }
        let [force_n, expected_n] = [&both, &one].map(|simulation| simulation.report().push_force_n);
        assert!((force_n / expected_n - 1.0).abs() < 0.01, "{ahead_mm} mm ahead: {force_n} {expected_n} N");
    }
}
