//! Detached coils.

use super::KirchhoffOptions;
use super::loops_tests::{axis, parts};
use crate::Vec3;
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, DetachedCoil, Move, Sheath, Simulation, State, WallProperties};

const COIL_MM: f64 = 30.0;
/// Length that must be out for it to be free: its end is at the touching distance from the catheter's.
const OUT_MM: f64 = COIL_MM + 0.5;
const RADIUS_MM: f64 = 0.15;
const CATHETER: usize = 2;

/// A coil that curls to a radius of 2 mm, on a pusher.
fn coil() -> Device {
    let wound = Section {
        rest_curvature_per_mm: [0.5, 0.05],
        torsional_stiffness_nmm2: Some(0.002),
        ..Section::straight(COIL_MM, RADIUS_MM, 0.002)
    };
    Device::new(vec![wound, Section::straight(150.0, RADIUS_MM, 0.5)]).unwrap().with_coil(COIL_MM).unwrap()
}

/// Two coils, and a catheter that protrudes by 3 mm from the sheath.
fn two_coils(friction: f64, self_contact: bool) -> Simulation {
    let (made, _, sheath) = parts(4.0);
    let catheter = Section { inner_radius_mm: Some(0.2), ..Section::straight(100.0, 0.3, 0.5) };
    let catheter = Device::new(vec![catheter]).unwrap();
    let one = |name: &str, device: Device| Instrument { name: name.to_owned(), device, may_lead: true };
    let stack = vec![one("framing", coil()), one("filling", coil()), one("catheter", catheter)];
    let properties = WallProperties { modulus_n_per_mm2: 1.0, friction, ..WallProperties::default() };
    let method = KirchhoffOptions { element_mm: 0.75, self_contact, ..KirchhoffOptions::default() };
    let sheath = Sheath { direction: Vec3::new(1.0, 0.2, 0.1).normalize(), ..sheath };
    let builder = Simulation::builder(made.wall, Stack::new(stack).unwrap(), sheath);
    let mut simulation = builder.properties(properties).method(&method).build().unwrap();
    advance(&mut simulation, &[0, CATHETER], 3.0).unwrap();
    simulation
}

/// Advances instruments by 0.5 mm per step.
fn advance(simulation: &mut Simulation, instruments: &[usize], mm: f64) -> crate::Result<()> {
    let moves: Vec<Move> = instruments
        .iter()
        .map(|instrument| Move { instrument: *instrument, command: Command::advance(0.5) })
        .collect();
    for step in 0..(2.0 * mm) as usize {
        let report = simulation.step_together(&moves)?;
        assert!(report.converged, "step {step}: {}", report.imbalance);
    }
    Ok(())
}

/// Smallest distance of a coil from the inserted devices, mm.
fn clearance_mm(simulation: &Simulation, coil: &DetachedCoil) -> f64 {
    let (coil, line) = (axis(&coil.shape), axis(simulation.shape()));
    let each = coil.iter().flat_map(|a| line.iter().map(move |b| (a - b).norm()));
    each.fold(f64::INFINITY, f64::min)
}

#[test]
fn a_coil_that_is_detached_yields_to_the_next_one_which_does_not_pass_it() {
    let mut simulation = two_coils(0.1, true);
    advance(&mut simulation, &[0], OUT_MM).unwrap();
    let was = axis(simulation.shape());
    let report = simulation.detach(0).unwrap();
    assert!(report.converged && !report.jumped && report.inserted_mm == 3.0, "{report:?}");
    let coil = simulation.coils()[0].clone();
    assert_eq!((coil.instrument, coil.shape.from_tip_mm[0]), (0, COIL_MM));
    // It springs back where the pusher had held it, and stays near its position.
    let moved_mm = (coil.shape.tip_mm().unwrap() - was[was.len() - 1]).norm();
    assert!(moved_mm < 1.0, "{moved_mm}");
    let (mut least_mm, mut touched) = (f64::INFINITY, false);
    for step in 0..40 {
        simulation.step_together(&[Move { instrument: 1, command: Command::advance(0.5) }]).unwrap();
        let clearance_mm = clearance_mm(&simulation, &simulation.coils()[0]);
        assert!(clearance_mm > 1.95 * RADIUS_MM, "step {step}: {clearance_mm}");
        least_mm = least_mm.min(clearance_mm);
        touched |= simulation.touching().iter().any(|touch| touch.rods == [0, 1]);
    }
    assert!(touched && least_mm < 2.01 * RADIUS_MM, "they do not touch: {least_mm}");
    // It has been pushed aside, and keeps its length.
    let now = &simulation.coils()[0];
    let farthest_mm = farthest_mm(now, &coil);
    assert!(farthest_mm > 0.1 * RADIUS_MM, "{farthest_mm}");
    let length_mm =
        |coil: &DetachedCoil| axis(&coil.shape).windows(2).map(|p| (p[1] - p[0]).norm()).sum::<f64>();
    assert!((length_mm(now) - length_mm(&coil)).abs() < 1e-3 * COIL_MM, "{} mm", length_mm(now));
    // It is part of the state.
    let saved = serde_json::to_string(&simulation.state()).unwrap();
    let mut again = two_coils(0.1, true);
    again.restore(&serde_json::from_str::<State>(&saved).unwrap()).unwrap();
    assert_eq!(again.coils(), simulation.coils());
    let step = |of: &mut Simulation| {
        of.step_together(&[Move { instrument: 1, command: Command::advance(-0.5) }]).unwrap().clone()
    };
    assert_eq!(step(&mut again), step(&mut simulation));
    assert_eq!(again.coils(), simulation.coils());
}

/// Largest distance of a coil's node from its earlier position, mm.
fn farthest_mm(coil: &DetachedCoil, was: &DetachedCoil) -> f64 {
    let nodes = coil.shape.positions_mm.iter().zip(&was.shape.positions_mm);
    nodes.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn ticks_of_a_few_solves_go_on_beside_a_coil() {
    let mut simulation = two_coils(0.1, true);
    advance(&mut simulation, &[0], OUT_MM).unwrap();
    simulation.detach(0).unwrap();
    let pushed = |mm: f64| [Move { instrument: 1, command: Command::advance(mm) }];
    for _ in 0..26 {
        simulation.step_together(&pushed(0.5)).unwrap();
    }
    assert!(simulation.touching().iter().any(|touch| touch.rods == [0, 1]));
    let from_mm = simulation.report().lengths_mm()[1];
    // Forces of pairs and the shift go on from tick to tick: found anew in each, they would take all solves of it.
    let behind_mm = |of: &Simulation| of.report().behind.get(1).map_or(0.0, |command| command.advance_mm);
    let mut most_mm = 0.0f64;
    for _ in 0..60 {
        simulation.tick(&pushed(0.02), 4, None).unwrap();
        most_mm = most_mm.max(behind_mm(&simulation));
    }
    assert!(most_mm < 0.5, "{most_mm}");
    for _ in 0..60 {
        simulation.tick(&[], 4, None).unwrap();
    }
    assert_eq!(behind_mm(&simulation), 0.0);
    assert!((simulation.report().lengths_mm()[1] - from_mm - 1.2).abs() < 1e-9);
    // They are part of the state.
    simulation.tick(&pushed(0.1), 2, None).unwrap();
    let saved = serde_json::to_string(&simulation.state()).unwrap();
    let mut again = two_coils(0.1, true);
    again.restore(&serde_json::from_str::<State>(&saved).unwrap()).unwrap();
    for of in [&mut again, &mut simulation] {
        for _ in 0..5 {
            of.tick(&pushed(0.02), 2, None).unwrap();
        }
    }
    let text = |of: &Simulation| serde_json::to_string(&of.state()).unwrap();
    assert!(text(&again) == text(&simulation));
}

#[test]
fn what_presses_on_a_coil_is_what_holds_it() {
    let mut simulation = two_coils(0.0, true);
    advance(&mut simulation, &[0], OUT_MM).unwrap();
    simulation.detach(0).unwrap();
    for _ in 0..20 {
        simulation.step_together(&[Move { instrument: 1, command: Command::advance(0.5) }]).unwrap();
    }
    // Time passes until the resistance to its motion has vanished.
    for _ in 0..10 {
        let nudge = |mm: f64| [Move { instrument: 1, command: Command::advance(mm) }];
        simulation.step_together(&nudge(1e-6)).unwrap();
        simulation.step_together(&nudge(-1e-6)).unwrap();
    }
    let (mut on_coil_n, mut sizes_n) = (Vec3::zeros(), 0.0);
    for touch in simulation.touching() {
        for (rod, sign) in touch.rods.into_iter().zip([1.0, -1.0]) {
            if rod == 1 {
                on_coil_n += touch.normal * (sign * touch.force_n);
                sizes_n += touch.force_n;
            }
        }
    }
    let axis = axis(&simulation.coils()[0].shape);
    let is_on_coil = |at: &Vec3| axis.iter().any(|x| (x - at).norm() < 0.05);
    for contact in &simulation.report().contacts {
        if is_on_coil(&contact.position_mm) {
            on_coil_n += contact.normal * contact.force_n;
            sizes_n += contact.force_n;
        }
    }
    assert!(sizes_n > 0.0 && on_coil_n.norm() < 1e-3 * sizes_n, "{on_coil_n:?} of {sizes_n} N");
}

#[test]
fn a_catheter_that_is_pushed_into_a_coil_shoves_it_along() {
    let mut simulation = two_coils(0.1, true);
    advance(&mut simulation, &[0], OUT_MM).unwrap();
    simulation.detach(0).unwrap();
    let was = simulation.coils()[0].clone();
    advance(&mut simulation, &[CATHETER], 4.0).unwrap();
    let now = simulation.coils()[0].clone();
    assert!(farthest_mm(&now, &was) > 0.5, "{}", farthest_mm(&now, &was));
    assert!(clearance_mm(&simulation, &now) > 1.9 * RADIUS_MM);
    // Everything is withdrawn: the coil stays, and no hand feels it.
    while simulation.report().lengths_mm()[CATHETER] > 0.0 {
        simulation.step_together(&[Move { instrument: CATHETER, command: Command::advance(-0.5) }]).unwrap();
    }
    assert!(simulation.shape().len() == 1 && simulation.report().converged);
    assert!(simulation.report().push_force_n == 0.0 && simulation.report().energy.bend > 0.0);
    assert!(farthest_mm(&simulation.coils()[0], &now) < 3.0);
}

#[test]
fn what_cannot_be_detached_is_refused_and_nothing_is_lost() {
    let mut simulation = two_coils(0.0, true);
    advance(&mut simulation, &[0], 20.0).unwrap();
    let before = serde_json::to_string(&simulation.state()).unwrap();
    let reported = |simulation: &mut Simulation, instrument: usize| {
        simulation.detach(instrument).unwrap_err().to_string()
    };
    assert!(reported(&mut simulation, 0).contains("not out yet: advance it by 10.450 mm"));
    assert!(reported(&mut simulation, 1).contains("not out yet"));
    assert!(reported(&mut simulation, CATHETER).contains("is no coil"));
    assert!(reported(&mut simulation, 3).contains("there are 3"));
    assert_eq!(serde_json::to_string(&simulation.state()).unwrap(), before);
    advance(&mut simulation, &[0], 10.5).unwrap();
    simulation.detach(0).unwrap();
    assert!(reported(&mut simulation, 0).contains("detached already"));
    let again = advance(&mut simulation, &[0], 0.5).unwrap_err().to_string();
    assert!(again.contains("its coil is detached"), "{again}");
    // Counter-check: without self-contact.
    let mut blind = two_coils(0.0, false);
    advance(&mut blind, &[0], OUT_MM).unwrap();
    assert!(reported(&mut blind, 0).contains("method.self_contact = false: what follows"));
}
