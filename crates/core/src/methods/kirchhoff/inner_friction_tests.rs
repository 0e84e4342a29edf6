//! Instruments with friction that rotate in one another.

use super::coaxial_tests::{CATHETER, WIRE, push, rubbing_along};
use crate::Vec3;
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, InstrumentReport, Move, Simulation};

const FRICTION: f64 = 0.2;
/// A straight wire: bending stiffness, N·mm², and radius, mm.
const WIRE_NMM2: f64 = 200.0;
const RADIUS_MM: f64 = 0.4;
/// Length of both in the body, mm, and the half of the element next to the sheath, where friction is not reported.
const LENGTH_MM: f64 = 60.0;
const MISSING: f64 = 1.0 / LENGTH_MM;
/// Curvature of the line with the wire in it, 1/mm.
const CURVATURE: f64 = 0.03;
/// A low torsional stiffness of the wire, N·mm²: it is twisted by a fraction of a turn.
const SOFT_NMM2: f64 = 0.5;
/// A high one: it is barely twisted.
const STIFF_NMM2: f64 = 100.0;

/// A straight wire of this torsional stiffness, N·mm², in a catheter that is curved everywhere and does not twist;
/// `first` is 2 mm ahead, other instruments are not inserted.
fn straight_in_arc(torsion_nmm2: f64, friction: f64, (first, others): (usize, usize)) -> Simulation {
    let catheter_nmm2 = 600.0;
    let rest = CURVATURE * (WIRE_NMM2 + catheter_nmm2) / catheter_nmm2;
    let wire = Section {
        torsional_stiffness_nmm2: Some(torsion_nmm2),
        ..Section::straight(165.0, RADIUS_MM, WIRE_NMM2)
    };
    let catheter = Section {
        inner_radius_mm: Some(0.5),
        rest_curvature_per_mm: [rest, 0.0],
        torsional_stiffness_nmm2: Some(1e5),
        ..Section::straight(150.0, 0.8, catheter_nmm2)
    };
    let one = |name: &str, section: Section| {
        let device = Device::new(vec![section]).unwrap();
        Instrument { name: name.to_owned(), device, may_lead: true }
    };
    let mut all = vec![one("wire", wire), one("catheter", catheter)];
    all.extend((0..others).map(|k| one(&format!("sheath {k}"), Section::straight(50.0, 2.0, 1.0))));
    let count = all.len();
    let frictions = std::iter::once(friction).chain(vec![0.0; count - 1]).collect();
    let stack = Stack::new(all).unwrap().with_friction(frictions).unwrap();
    let axis = (0..16).map(|i| Vec3::z() * (20.0 * f64::from(i)));
    let mut simulation = rubbing_along(axis, 120.0, stack, 0.0);
    push(&mut simulation, &[(first, 2.0)]).unwrap();
    for _ in 0..30 {
        push(&mut simulation, &[(WIRE, LENGTH_MM / 30.0), (CATHETER, LENGTH_MM / 30.0)]).unwrap();
    }
    simulation
}

/// Forces and torques of both hands after these moves.
fn go(simulation: &mut Simulation, moves: &[(usize, f64, f64)]) -> [InstrumentReport; 2] {
    let each = moves.iter().map(|(instrument, advance_mm, rotate_rad)| Move {
        instrument: *instrument,
        command: Command { advance_mm: *advance_mm, rotate_rad: *rotate_rad, ..Command::default() },
    });
    let reported = simulation.step_together(&each.collect::<Vec<_>>()).unwrap();
    assert!(reported.converged && reported.relaxations == 0 && reported.substeps == 1, "{reported:?}");
    [WIRE, CATHETER].map(|index| reported.instruments[index])
}

/// The wire is straight at rest, and first slides freely along the line: N₁ + ½EI₁κ² = 0, and it presses with n =
/// −N₁κ per length.
fn pressure_n_per_mm() -> f64 {
    0.5 * WIRE_NMM2 * CURVATURE.powi(3)
}

fn near(found: f64, expected: f64, part: f64) {
    assert!((found - expected).abs() <= part * expected.abs(), "{found} and {expected}");
}

/// dM/ds = −μ r n where the wire rotates in the catheter: from the mouth over a length ℓ; beyond it sticks. Outside it
/// twists under M = μ r n ℓ over the length T of its tail: the hand has turned by θ = μ r n (ℓ²/2 + ℓ T)/GJ.
#[test]
fn a_turned_wire_is_held_by_what_presses_and_sticks_where_its_turn_does_not_come() {
    let couple = FRICTION * RADIUS_MM * pressure_n_per_mm();
    const TAIL_MM: f64 = 165.0 - LENGTH_MM - 2.0;
    let lag_rad = couple * (0.5 * LENGTH_MM * LENGTH_MM + TAIL_MM * LENGTH_MM) / SOFT_NMM2;
    let mut simulation = straight_in_arc(SOFT_NMM2, FRICTION, (WIRE, 0));
    let mut free = straight_in_arc(SOFT_NMM2, 0.0, (WIRE, 0));
    for k in 1..=8 {
        let turn_rad = 0.25 * lag_rad;
        let [wire, catheter] = go(&mut simulation, &[(WIRE, 0.0, turn_rad)]);
        let turned_rad = f64::from(k) * turn_rad;
        let stuck = turned_rad < 0.99 * lag_rad;
        let both_mm = (TAIL_MM * TAIL_MM + 2.0 * SOFT_NMM2 * turned_rad / couple).sqrt();
        let reach_mm = if stuck { both_mm - TAIL_MM } else { LENGTH_MM };
        near(wire.torque_nmm, couple * reach_mm, 1.1 * MISSING * LENGTH_MM / reach_mm);
        assert!(!stuck || couple * LENGTH_MM > 1.1 * wire.torque_nmm);
        if stuck {
            assert!(wire.tip_rotation_rad < 1e-3 * turned_rad, "{wire:?}");
        } else if k > 4 {
            assert!((wire.tip_rotation_rad - (turned_rad - lag_rad)).abs() < MISSING * lag_rad, "{wire:?}");
        }
        near(-catheter.torque_nmm, wire.torque_nmm, 1e-4);
        // Once all of it rotates, friction dissipates the work of the hand.
        if k > 5 {
            near(simulation.report().dissipated_mj, wire.torque_nmm * turn_rad, 1e-4);
        }
        assert!(go(&mut free, &[(WIRE, 0.0, turn_rad)])[WIRE].torque_nmm.abs() < 1e-9);
    }
    // Moving together they do not change: friction holds the twist, except for the creep of stuck nodes.
    let [before, _] = [WIRE, CATHETER].map(|index| simulation.report().instruments[index]);
    for _ in 0..5 {
        go(&mut simulation, &[(WIRE, 0.0, 0.1), (CATHETER, 0.0, 0.1)]);
    }
    near(simulation.report().instruments[WIRE].torque_nmm, before.torque_nmm, 0.01);
}

/// Steadily pushed and rotated, the wire slips by u = (Δ, r θ): μn is divided in that ratio, so the force along it
/// grows by e^{μφ cos α} instead of e^{μφ}, and the torque is r tan α times the increase of the push force.
#[test]
fn a_wire_that_is_turned_is_pushed_more_easily() {
    let loose = straight_in_arc(STIFF_NMM2, 0.0, (WIRE, 0)).report().instruments[WIRE].push_force_n.unwrap();
    let inner_friction = |turn_rad: f64| {
        let mut simulation = straight_in_arc(STIFF_NMM2, FRICTION, (WIRE, 0));
        let steps = (0..4).map(|_| go(&mut simulation, &[(WIRE, 0.1, turn_rad)])[WIRE]);
        let reported = steps.last().unwrap();
        (reported.push_force_n.unwrap() - loose, reported.torque_nmm, simulation.report().dissipated_mj)
    };
    let mut last_n = f64::INFINITY;
    for turn_rad in [0.0f64, 0.1, 0.25, 1.0] {
        let (push_n, torque_nmm, taken_mj) = inner_friction(turn_rad);
        let along = 0.1 / 0.1f64.hypot(RADIUS_MM * turn_rad);
        let angle = CURVATURE * LENGTH_MM;
        let expected = 0.5 * WIRE_NMM2 * CURVATURE.powi(2) * ((FRICTION * angle * along).exp() - 1.0);
        near(push_n, expected, 1.5 * MISSING);
        near(torque_nmm, RADIUS_MM * RADIUS_MM * turn_rad / 0.1 * expected, 1.5 * MISSING);
        near(taken_mj, push_n * 0.1 + torque_nmm * turn_rad, 0.01);
        assert!(push_n < 0.97 * last_n);
        last_n = push_n;
    }
}

/// A hand that moves a twisted instrument moves the twist along the friction, and feels that.
#[test]
fn hands_put_in_what_is_stored_and_taken_while_a_twisted_wire_slides() {
    // Nodes are marks on the first instrument: the wire, or the catheter in which it is twisted.
    for (first, wire_mm, catheter_mm) in
        [(WIRE, 0.05, 0.0), (WIRE, 0.0, -0.05), (CATHETER, -0.05, 0.0), (CATHETER, 0.0, 0.05)]
    {
        let moves = [(WIRE, wire_mm, 0.1), (CATHETER, catheter_mm, 0.0)];
        let mut simulation = straight_in_arc(SOFT_NMM2, FRICTION, (first, 0));
        for _ in 0..20 {
            go(&mut simulation, &[(WIRE, 0.0, 0.1)]);
        }
        let mut was = go(&mut simulation, &moves);
        let before = simulation.report().energy.total();
        let (mut work, mut taken) = (0.0, 0.0);
        let inserted_mm = simulation.report().instruments[CATHETER].inserted_mm;
        for _ in 0..40 {
            let is = go(&mut simulation, &moves);
            for (index, advance_mm, turn_rad) in moves {
                let push_n = was[index].push_force_n.unwrap() + is[index].push_force_n.unwrap();
                work +=
                    0.5 * (push_n * advance_mm + (was[index].torque_nmm + is[index].torque_nmm) * turn_rad);
            }
            taken += simulation.report().dissipated_mj;
            was = is;
        }
        // The sheath straightens what is pulled into it, at the expense of the hand.
        let drawn_mm = inserted_mm - simulation.report().instruments[CATHETER].inserted_mm;
        let rest = CURVATURE * 800.0 / 600.0;
        let stored = simulation.report().energy.total() - before + 0.5 * 600.0 * rest * rest * drawn_mm;
        let off = (work - stored - taken).abs();
        assert!(off < 1.5e-3 * taken && taken > 0.0, "{moves:?}: {work} = {stored} + {taken} mJ");
    }
}

#[test]
fn a_wire_without_angles_turns_freely_and_slips_along_the_line() {
    let (mut angles, mut none) =
        (straight_in_arc(STIFF_NMM2, FRICTION, (WIRE, 0)), straight_in_arc(STIFF_NMM2, FRICTION, (WIRE, 2)));
    let [with, without] = [&mut angles, &mut none].map(|simulation| {
        let turned = go(simulation, &[(WIRE, 0.0, 0.5)])[WIRE];
        (turned.torque_nmm, go(simulation, &[(WIRE, 0.1, 0.0)])[WIRE].push_force_n.unwrap())
    });
    assert!(with.0 > 0.01 && without.0 == 0.0, "{with:?} {without:?}");
    near(without.1, with.1, 0.01);
}

#[test]
fn a_step_that_turns_can_be_taken_again() {
    let bytes = |simulation: &Simulation| serde_json::to_vec(&simulation.state()).unwrap();
    let mut simulation = straight_in_arc(SOFT_NMM2, FRICTION, (WIRE, 0));
    go(&mut simulation, &[(WIRE, 0.5, 0.3)]);
    let before = bytes(&simulation);
    let couples = |simulation: &Simulation| -> f64 {
        simulation.lateral_forces(WIRE).iter().map(|at| at.friction_nmm).sum()
    };
    let reported = couples(&simulation);
    near(-reported, simulation.report().instruments[WIRE].torque_nmm, 1e-3);
    go(&mut simulation, &[(WIRE, 0.2, 0.1)]);
    let after = bytes(&simulation);
    let mut other = straight_in_arc(SOFT_NMM2, FRICTION, (WIRE, 0));
    go(&mut other, &[(CATHETER, -0.1, 0.3)]);
    other.restore(&serde_json::from_slice(&before).unwrap()).unwrap();
    assert_eq!(couples(&other), reported);
    go(&mut other, &[(WIRE, 0.2, 0.1)]);
    assert_eq!(bytes(&other), after);
    // A state with more friction entries than nodes is rejected.
    let mut wrong: serde_json::Value = serde_json::from_slice(&before).unwrap();
    wrong["content"]["Kirchhoff"]["state"]["inner_friction"].as_array_mut().unwrap().pop();
    let error = other.restore(&serde_json::from_value(wrong).unwrap()).unwrap_err().to_string();
    assert!(error.contains("state.inner_friction"), "{error}");
}
