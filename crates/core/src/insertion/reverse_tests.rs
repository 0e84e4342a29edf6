//! The reverse pass against the forward one over the same parts, and its cost.

use std::time::Instant;

use super::gradient_tests::{Numbers, SCENES, parameters, simulation, then_s};
use super::{Move, Recorded, Simulation};
use crate::Vec3;
use crate::methods::{Gradient, Parameter, Weights};

/// A simulation after some commands, the next ones and their times.
fn before(scene: usize, seed: u64, commands: usize) -> (Simulation, Vec<Vec<Move>>, Vec<f64>) {
    let mut now = simulation(SCENES[scene]);
    let mut numbers = Numbers(seed);
    let hands = now.stack().instruments().len();
    for _ in 0..14 {
        let time_s = then_s(&now);
        now.step_until(&numbers.moves(hands), Some(time_s)).unwrap();
    }
    let next: Vec<Vec<Move>> = (0..commands).map(|_| numbers.moves(hands)).collect();
    let step_s = then_s(&now) - now.time_s();
    let times_s = (1..=commands).map(|k| now.time_s() + step_s * k as f64).collect();
    (now, next, times_s)
}

/// Weights of all that commands lead to.
fn weights(recording: &Recorded, instruments: usize) -> Vec<Weights> {
    let mut numbers = Numbers(5);
    let mut number = || numbers.between([-1.0, 1.0]);
    let mut vector = || Vec3::new(number(), number(), number());
    let each = recording.passed().iter().map(|passed| {
        let mut list = |count: usize| (0..count).map(|_| vector().x).collect::<Vec<f64>>();
        Weights {
            push_force_n: list(instruments),
            torque_nmm: list(instruments),
            energy_mj: list(1)[0],
            contact_forces_n: list(passed.report.contacts.len()),
            tip_mm: vector(),
            positions_mm: passed.shape.positions_mm.iter().map(|_| vector()).collect(),
        }
    });
    each.collect()
}

/// The sum of numbers with their weights.
fn sum(weights: &[Weights], gradients: &[Gradient]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let each = weights.iter().zip(gradients).map(|(a, b)| {
        let b = &b.slopes[0];
        let pushes: Vec<f64> = b.push_force_n.iter().map(|push_n| push_n.unwrap_or(0.0)).collect();
        let places = a.positions_mm.iter().zip(&b.positions_mm).map(|(a, b)| a.dot(b)).sum::<f64>();
        places
            + a.tip_mm.dot(&b.tip_mm)
            + a.energy_mj * b.energy_mj
            + dot(&a.push_force_n, &pushes)
            + dot(&a.torque_nmm, &b.torque_nmm)
            + dot(&a.contact_forces_n, &b.contact_forces_n)
    });
    each.sum()
}

/// Push forces of several instruments are slopes of an energy, differenced once more: along a direction forwards, by each unknown backwards. Forwards
/// they are always read, and then columns are differences that are in closed form where they are not.
const OF_SEVERAL: [f64; 2] = [1e-6, 1e-5];
const OF_ONE: [f64; 2] = [1e-9; 2];

#[test]
fn backwards_and_forwards_are_the_same() {
    for scene in 0..SCENES.len() {
        let (now, commands, times_s) = before(scene, 300 + scene as u64, 3);
        let instruments = now.stack().instruments().len();
        let by = parameters(instruments, SCENES[scene].friction);
        let recording = now.record(&commands, &times_s).unwrap();
        let all = weights(&recording, instruments);
        let mut without = all.clone();
        without.iter_mut().for_each(|one| one.push_force_n.clear());
        let most = if instruments == 1 { OF_ONE } else { OF_SEVERAL };
        for (weights, most) in [without, all].into_iter().zip(most) {
            let back = recording.vjp(&weights, &by).unwrap();
            let scale = back.by.iter().fold(0.0f64, |most, one| most.max(one.abs()));
            for (parameter, back) in by.iter().zip(&back.by) {
                let on = sum(&weights, &recording.jvp(&[(*parameter, 1.0)]).unwrap());
                let off = (on - back).abs() / on.abs().max(1e-6 * scale);
                println!("{scene} {parameter:?}: {on:.6e} {off:.1e}");
                assert!(off < most, "{scene} {parameter:?}: {on} {back}");
            }
            // With other weights it is another one.
            let fewer = recording.vjp_by(&weights[..2], &by).unwrap();
            assert!(fewer.by.iter().zip(&back.by).any(|(a, b)| (a - b).abs() > 1e-3 * b.abs()));
            assert!(fewer.hands.is_empty() && back.hands.len() == 3);
            // The first command's hands are parameters too.
            for (parameter, back) in by.iter().zip(&back.by) {
                match *parameter {
                    Parameter::Advance { instrument } => {
                        assert_eq!(back.to_owned(), first(&recording, &weights, instrument).0);
                    }
                    Parameter::Rotation { instrument } => {
                        assert_eq!(back.to_owned(), first(&recording, &weights, instrument).1);
                    }
                    _ => {}
                }
            }
        }
    }
}

fn first(recording: &Recorded, weights: &[Weights], instrument: usize) -> (f64, f64) {
    let hand = recording.vjp(weights, &[]).unwrap().hands[0][instrument];
    (hand.advance_mm, hand.rotate_rad)
}

#[test]
fn recorded_or_not_steps_take_the_same() {
    for scene in [0, 2, 4] {
        let (now, commands, times_s) = before(scene, 300 + scene as u64, 3);
        let recording = now.record(&commands, &times_s).unwrap();
        let mut alone = now.clone();
        let mut last = None;
        for ((moves, time_s), passed) in commands.iter().zip(&times_s).zip(recording.passed()) {
            let report = alone.step_until(moves, Some(*time_s)).unwrap();
            assert_eq!(report, &passed.report);
            // Each command leads elsewhere.
            assert_ne!(last.replace(report.clone()).as_ref(), Some(report));
        }
    }
}

/// Times of a reverse pass are measured so often, beside the commands themselves.
const REPEATS: usize = 15;

/// `cargo test -p endowire-core --lib what_a_reverse_pass_costs -- --ignored --nocapture`.
#[test]
#[ignore = "measures time"]
fn what_a_reverse_pass_costs() {
    for scene in 0..SCENES.len() {
        let (now, commands, times_s) = before(scene, 300, 6);
        let instruments = now.stack().instruments().len();
        let all = parameters(instruments, SCENES[scene].friction);
        let of_the_hand = |one: &Parameter| {
            matches!(one, Parameter::Advance { .. } | Parameter::Rotation { .. } | Parameter::Steering { .. })
        };
        let by_sides =
            |one: &Parameter| matches!(one, Parameter::Radius { .. } | Parameter::EntryDirection { .. });
        let local: Vec<Parameter> =
            all.iter().copied().filter(|one| !of_the_hand(one) && !by_sides(one)).collect();
        let lists = [&local[..0], &local[..1], &local[..10], &local[..], &all[..]];
        let recording = now.record(&commands, &times_s).unwrap();
        let weights: Vec<Weights> =
            (0..6).map(|_| Weights { tip_mm: Vec3::x(), ..Weights::default() }).collect();
        let mut costs = vec![Vec::new(); lists.len() + 1];
        for _ in 0..REPEATS {
            let began = Instant::now();
            let mut alone = now.clone();
            for (moves, time_s) in commands.iter().zip(&times_s) {
                alone.step_until(moves, Some(*time_s)).unwrap();
            }
            let steps_s = began.elapsed().as_secs_f64();
            for (costs, by) in costs.iter_mut().zip(lists) {
                let began = Instant::now();
                recording.vjp_by(&weights, by).unwrap();
                costs.push(began.elapsed().as_secs_f64() / steps_s);
            }
            costs[lists.len()].push(1e3 * steps_s / 6.0);
        }
        let median = |list: &mut Vec<f64>| {
            list.sort_by(f64::total_cmp);
            list[list.len() / 2]
        };
        let found: Vec<String> = costs.iter_mut().map(|list| format!("{:.2}", median(list))).collect();
        let counts: Vec<usize> = lists.iter().map(|by| by.len()).collect();
        println!("{:?}: {counts:?} parameters, in steps, and ms a step: {}", SCENES[scene], found.join(", "));
    }
}
