//! The shaft outside the body: what hands turn, and what arrives at the sheath's mouth.

use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, StepReport};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

/// Torsional stiffness of the wire, N·mm², and its radius, mm.
const TORSION_NMM2: f64 = 300.0;
const RADIUS_MM: f64 = 0.4;
/// Length in the body, mm: round the bend.
const INSERTED_MM: f64 = 150.0;

/// A wire with a bent tip and this length outside.
fn wire(tail_mm: f64) -> Device {
    let shaft = Section {
        torsional_stiffness_nmm2: Some(TORSION_NMM2),
        ..Section::straight(INSERTED_MM - 15.0 + tail_mm, RADIUS_MM, 20.0)
    };
    let tip = Section { rest_curvature_per_mm: [0.05, 0.0], length_mm: 15.0, ..shaft };
    Device::new(vec![tip, shaft]).unwrap()
}

/// Instruments in the bent tube, with friction in the sheath.
fn outside(stack: impl Into<Stack>, friction_n: f64) -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let options = KirchhoffOptions { tolerance: 1e-9, ..KirchhoffOptions::default() };
    let sheath = sheath.with_friction(friction_n, 0.0).unwrap();
    Simulation::builder(made.wall, stack, sheath).method(&options).build().unwrap()
}

/// A wire round the bend, with this length outside.
fn in_bend(tail_mm: f64, friction_n: f64) -> Simulation {
    let mut simulation = outside(wire(tail_mm), friction_n);
    for _ in 0..75 {
        simulation.step(Command::advance(INSERTED_MM / 75.0)).unwrap();
    }
    simulation
}

/// Turns the hand so far in so many steps.
fn turn(simulation: &mut Simulation, by_rad: f64, steps: u32) -> StepReport {
    for _ in 0..steps {
        let report = simulation.step(Command::rotate(by_rad / f64::from(steps))).unwrap();
        assert!(report.converged && !report.jumped, "{report:?}");
    }
    simulation.report().clone()
}

/// What hands do in a step, mJ: by the mean of their forces before and after it, but for the push force where they have
/// begun another motion, as friction along the line then jumps.
fn work_mj(was: &StepReport, is: &StepReport, begins: bool) -> f64 {
    let each = was.hands().into_iter().zip(is.hands()).map(|(was, is)| {
        let [was_n, is_n] = [was, is].map(|hand| hand.push_force_n.unwrap_or(0.0));
        let push_n = if begins { is_n } else { 0.5 * (was_n + is_n) };
        let torque_nmm = 0.5 * (was.torque_nmm + is.torque_nmm);
        push_n * (is.inserted_mm - was.inserted_mm) + torque_nmm * (is.rotation_rad - was.rotation_rad)
    });
    each.sum()
}

/// A metre more of a tail turns by M/GJ metres more: with the hand that much ahead the device is the same.
#[test]
fn a_longer_tail_lags_by_its_torque_over_its_stiffness() {
    let (mut short, mut long, mut unaware) =
        (in_bend(105.0, 0.0), in_bend(1105.0, 0.0), in_bend(1105.0, 0.0));
    for hand_rad in [0.5, 0.5, 0.5] {
        let here = turn(&mut short, hand_rad, 5);
        let lag_rad = here.torque_nmm * 1000.0 / TORSION_NMM2;
        let to_rad = here.rotation_rad + lag_rad;
        let by_rad = to_rad - long.report().rotation_rad;
        let there = turn(&mut long, by_rad, (by_rad.abs() / 0.1).ceil() as u32);
        assert!(lag_rad.abs() > 0.01, "{lag_rad}");
        let off = |a: f64, b: f64| (a - b).abs() / lag_rad.abs();
        let [here_rad, there_rad] = [&here, &there].map(|report| report.tip_rotation_rad);
        assert!(off(there_rad, here_rad) < 1e-6, "{here_rad} {there_rad}");
        assert!(off(there.mouth_rotation_rad, here.mouth_rotation_rad) < 1e-6);
        assert!((there.torque_nmm / here.torque_nmm - 1.0).abs() < 1e-6);
        let apart_mm = (short.shape().tip_mm().unwrap() - long.shape().tip_mm().unwrap()).norm();
        assert!(apart_mm < 1e-6, "{apart_mm}");
        let own_rad = here.torque_nmm * 105.0 / TORSION_NMM2;
        assert!(off(here.rotation_rad - here.mouth_rotation_rad, own_rad) < 1e-6, "{here:?}");
        // At the same angle of the hand it would be elsewhere.
        let other = turn(&mut unaware, hand_rad, 5);
        assert!((other.tip_rotation_rad - here.tip_rotation_rad).abs() > 0.005);
    }
}

#[test]
fn work_of_the_hand_is_stored_in_wire_wall_and_tail() {
    for friction_n in [0.0, 0.3] {
        let mut simulation = in_bend(600.0, friction_n);
        let mut was = turn(&mut simulation, 0.0, 1);
        let first = was.clone();
        let (mut put_in_mj, mut lost_mj, mut turned_mj) = (0.0, 0.0, 0.0f64);
        let steps = [Command::rotate(0.02); 60].into_iter().chain([Command::advance(0.1); 60]);
        let steps = steps.chain([Command { advance_mm: -0.1, rotate_rad: 0.02 }; 60]);
        for (k, command) in steps.enumerate() {
            let is = simulation.step(command).unwrap().clone();
            assert!(is.converged && !is.jumped, "{k}");
            put_in_mj += work_mj(&was, &is, k % 60 == 0);
            lost_mj += is.dissipated_mj;
            turned_mj = turned_mj.max(is.energy.tail);
            was = is;
        }
        let stored_mj = was.energy.total() - first.energy.total();
        let off_mj = put_in_mj - stored_mj - lost_mj;
        assert!(turned_mj > 0.002, "{turned_mj}");
        let size_mj = stored_mj.abs() + lost_mj;
        assert!(off_mj.abs() < 1e-3 * size_mj, "{put_in_mj} {stored_mj} {lost_mj} {off_mj}");
    }
}

/// A hand that turns to and fro against a grip of F r loses what it puts in, and the loop closes.
#[test]
fn a_loop_against_friction_in_the_sheath_takes_what_the_hand_puts_in() {
    const FRICTION_N: f64 = 0.3;
    let mut simulation = in_bend(105.0, FRICTION_N);
    turn(&mut simulation, 1.2, 60);
    let first = turn(&mut simulation, 0.0, 1);
    let (mut was, mut put_in_mj, mut lost_mj) = (first.clone(), 0.0, 0.0);
    let (mut held, mut stuck) = (0, 0);
    for k in 0..480 {
        let by_rad = if k < 240 { -0.01 } else { 0.01 };
        let is = simulation.step(Command::rotate(by_rad)).unwrap().clone();
        put_in_mj += work_mj(&was, &is, false);
        lost_mj += is.dissipated_mj;
        // While it sticks the mouth turns by the twist of a radius of the wire alone.
        let moves = (is.mouth_rotation_rad - was.mouth_rotation_rad).abs();
        stuck += usize::from(is.dissipated_mj == 0.0);
        held += usize::from(moves < 0.02 * 0.01);
        was = is;
    }
    assert!(stuck > 10 && held > 10, "{stuck} {held}");
    let stored_mj = was.energy.total() - first.energy.total();
    assert!(lost_mj > 0.2, "{lost_mj}");
    assert!((put_in_mj - stored_mj - lost_mj).abs() < 1e-3 * lost_mj, "{put_in_mj} {stored_mj} {lost_mj}");
    // Without friction nothing is lost.
    let mut loose = in_bend(105.0, 0.0);
    assert!(turn(&mut loose, 1.2, 60).dissipated_mj < 1e-9);
}

/// A straight wire without friction in the body turns as a whole once the grip gives way, and lags by F r c.
#[test]
fn a_straight_wire_turns_once_the_sheath_lets_it() {
    let straight = Section {
        torsional_stiffness_nmm2: Some(TORSION_NMM2),
        ..Section::straight(INSERTED_MM + 100.0 + RADIUS_MM, RADIUS_MM, 20.0)
    };
    let mut simulation = outside(Device::new(vec![straight]).unwrap(), 3.0);
    simulation.step(Command::advance(INSERTED_MM)).unwrap();
    let lag_rad = 3.0 * RADIUS_MM * 100.0 / TORSION_NMM2;
    let stuck = turn(&mut simulation, 0.9 * lag_rad, 3);
    assert!(
        stuck.mouth_rotation_rad.abs() < 1e-12 && (stuck.torque_nmm - 0.9 * 1.2).abs() < 1e-9,
        "{stuck:?}"
    );
    let turned = turn(&mut simulation, lag_rad, 3);
    assert!((turned.rotation_rad - turned.mouth_rotation_rad - lag_rad).abs() < 1e-9, "{turned:?}");
    assert!((turned.torque_nmm - 1.2).abs() < 1e-9 && turned.tip_rotation_rad == turned.mouth_rotation_rad);
    // Pulled, it lets go of what it held.
    let pulled = simulation.step(Command::retract(20.0)).unwrap();
    assert!((pulled.rotation_rad - pulled.mouth_rotation_rad).abs() < 0.05 * lag_rad, "{pulled:?}");
}

/// A wire in a catheter, each with a tail, and a valve on the catheter's hub.
fn two(valve_n: f64) -> Simulation {
    let catheter = Section {
        inner_radius_mm: Some(0.5),
        torsional_stiffness_nmm2: Some(200.0),
        ..Section::straight(260.0, 0.8, 60.0)
    };
    let bent = Section { rest_curvature_per_mm: [0.02, 0.0], length_mm: 20.0, ..catheter };
    let instrument = |name: &str, device: Device| Instrument { name: name.into(), device, may_lead: true };
    let stack = Stack::new(vec![
        instrument("wire", wire(300.0)),
        instrument("catheter", Device::new(vec![bent, catheter]).unwrap()),
    ]);
    let mut simulation = outside(stack.unwrap().sealed(vec![0.0, valve_n]).unwrap(), 0.5);
    for _ in 0..60 {
        simulation.step_together(&[moved(0, 2.5, 0.0), moved(1, 2.0, 0.0)]).unwrap();
    }
    simulation
}

fn moved(instrument: usize, advance_mm: f64, rotate_rad: f64) -> Move {
    Move { instrument, command: Command { advance_mm, rotate_rad } }
}

#[test]
fn hands_of_several_put_in_what_tails_store_and_valves_take() {
    for valve_n in [0.0, 1.0] {
        let mut simulation = two(valve_n);
        let first = simulation.report().clone();
        let (mut was, mut put_in_mj, mut lost_mj) = (first.clone(), 0.0, 0.0);
        for k in 0..240 {
            let moves = match k / 80 {
                0 => [moved(0, 0.0, 0.01), moved(1, 0.0, -0.005)],
                1 => [moved(0, 0.0, -0.015), moved(1, -0.025, 0.0)],
                _ => [moved(0, 0.025, 0.0), moved(1, 0.0, 0.01)],
            };
            let is = simulation.step_together(&moves).unwrap().clone();
            assert!(is.converged && !is.jumped, "{is:?}");
            put_in_mj += work_mj(&was, &is, k % 80 == 0);
            lost_mj += is.dissipated_mj;
            was = is;
        }
        let stored_mj = was.energy.total() - first.energy.total();
        let off_mj = put_in_mj - stored_mj - lost_mj;
        assert!(was.energy.tail > 0.01 && (valve_n == 0.0 || lost_mj > 0.1), "{was:?}");
        let size_mj = stored_mj.abs() + lost_mj;
        assert!(off_mj.abs() < 3e-3 * size_mj, "{valve_n}: {put_in_mj} {stored_mj} {lost_mj} {off_mj}");
    }
}

#[test]
fn tails_go_on_from_states_and_copies_and_ticks_are_steps() {
    let bits = |simulation: &Simulation| {
        let report = simulation.report();
        (report.mouth_rotation_rad.to_bits(), report.torque_nmm.to_bits(), report.energy.tail.to_bits())
    };
    let mut first = in_bend(105.0, 1.5);
    turn(&mut first, 0.6, 6);
    let state: endowire_core::insertion::State =
        serde_json::from_slice(&serde_json::to_vec(&first.state()).unwrap()).unwrap();
    let (mut copy, mut restored) = (first.clone(), outside(wire(105.0), 1.5));
    restored.restore(&state).unwrap();
    assert_eq!(bits(&restored), bits(&first));
    let mut ticked = first.clone();
    for command in [Command::rotate(-0.2), Command { advance_mm: 1.0, rotate_rad: 0.3 }] {
        for other in [&mut first, &mut copy, &mut restored] {
            other.step(command).unwrap();
        }
        let moves = [Move { instrument: 0, command }];
        ticked.tick(&moves, ticked.most_solves(&moves).unwrap(), None).unwrap();
        assert!(
            bits(&first) == bits(&copy) && bits(&first) == bits(&restored) && bits(&first) == bits(&ticked)
        );
    }
}
