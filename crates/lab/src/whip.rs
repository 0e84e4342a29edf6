//! B5: the whip of a pre-curved wire rotated in a curved tube.

use super::Row;
use super::contact::falling;
use super::insertion::{Tube, push};
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::{Error, Result, Vec3};
use std::f64::consts::SQRT_2;

/// Radius of tube and wire, mm: κt = κ0 = 1/40, and EI = GJ, so λ is the angle of the tube.
const BEND: f64 = 40.0;
const STIFFNESS: f64 = 10.0;
/// Radius of the wire's section, mm.
const WIRE_RADIUS: f64 = 0.1;

/// A wire as long as the tube's bend of `lambda` radians, with a clearance `play_mm`: no tail twists outside.
pub(crate) fn in_tube(lambda: f64, play_mm: f64) -> Result<Simulation> {
    let length_mm = lambda * BEND;
    let radius_mm = WIRE_RADIUS + play_mm;
    let tube =
        Tube { begin_mm: 1.0, straight_mm: 0.0, bend_mm: BEND, turn: lambda + 0.1, end_mm: 0.5, radius_mm };
    let wall = tube.wall(0.5, 0.5 * radius_mm)?;
    let wire = Device::new(vec![Section {
        torsional_stiffness_nmm2: Some(STIFFNESS),
        rest_curvature_per_mm: [1.0 / BEND, 0.0],
        ..Section::straight(length_mm, WIRE_RADIUS, STIFFNESS)
    }])?;
    let sheath = Sheath::new(Vec3::zeros(), Vec3::x())?;
    let element_mm = length_mm / 40.0;
    let method = KirchhoffOptions { element_mm, ..KirchhoffOptions::default() };
    let rigid = WallProperties { modulus_n_per_mm2: 1e4, ..WallProperties::default() };
    let mut simulation = Simulation::builder(wall, wire, sheath).properties(rigid).method(&method).build()?;
    push(&mut simulation, length_mm, 40)?;
    Ok(simulation)
}

/// Rotates the hand to `hand` degrees in steps of at most `step`; returns the number of jumps on the way.
fn turn_to(simulation: &mut Simulation, hand: f64, step: f64) -> Result<usize> {
    let way = hand.to_radians() - simulation.report().rotation_rad;
    let count = (way.abs() / step.to_radians()).ceil().max(1.0);
    let mut jumps = 0;
    for _ in 0..count as usize {
        jumps += usize::from(simulation.step(Command::rotate(way / count))?.jumped);
    }
    Ok(jumps)
}

/// Angle of the hand, in degrees, at which the tip has rotated by `tip` degrees, by the secant method.
fn hand_for(simulation: &mut Simulation, tip: f64) -> Result<f64> {
    let (mut hand, mut slope) = (tip, 1.0);
    let mut last = None;
    for _ in 0..20 {
        turn_to(simulation, hand, 15.0)?;
        let off = tip - simulation.report().tip_rotation_rad.to_degrees();
        if off.abs() < 1e-6 {
            return Ok(hand);
        }
        if let Some((before, before_off)) = last {
            slope = (before_off - off) / (hand - before);
        }
        last = Some((hand, off));
        hand += off / slope;
    }
    Err(Error::Computation(format!("B5: no hand angle found for a tip at {tip}°")))
}

/// Angle of the hand at which the tip jumps with λ = 2, in degrees, and number of jumps up to there.
///
/// Before the jump the tip overtakes the hand, and the hand's angle as a function of the tip's is a parabola with its
/// maximum at the jump.
fn jump(play_mm: f64) -> Result<(f64, usize)> {
    let mut simulation = in_tube(2.0, play_mm)?;
    let mut hand = 190.0;
    let mut jumps = turn_to(&mut simulation, hand, 10.0)?;
    let mut way = Vec::new();
    while hand < 205.0 {
        way.push((simulation.report().tip_rotation_rad.to_degrees(), hand));
        hand += 0.5;
        let here = turn_to(&mut simulation, hand, 0.5)?;
        jumps += here;
        if let ([.., (a, fa), (b, fb), (c, fc)], true) = (&way[..], here > 0) {
            let (first, second) = ((fb - fa) / (b - a), (fc - fb) / (c - b));
            let bend = (second - first) / (c - a);
            let slope = second + bend * (c - b);
            return Ok((fc - 0.25 * slope * slope / bend, jumps));
        }
    }
    Err(Error::Computation("B5: no jump up to 205°".to_owned()))
}

/// Extrapolation to zero clearance from the values at a clearance and at half of it: near the ends the wire
/// straightens over a length √(2 play/Δκ), so errors are proportional to the square root of the clearance.
fn without_play(with: f64, with_half: f64) -> f64 {
    (SQRT_2 * with_half - with) / (SQRT_2 - 1.0)
}

/// λ = 1: the tip follows the hand.
pub(super) fn whip() -> Result<Vec<Row>> {
    const HANDS: [f64; 2] = [45.35271903, 118.41209714];
    const PLAYS: [f64; 4] = [0.1, 0.05, 0.025, 0.0125];
    let mut rows = Vec::new();
    let mut hands = [const { Vec::new() }; 2];
    for play in PLAYS {
        let mut simulation = in_tube(1.0, play)?;
        for (hands, tip) in hands.iter_mut().zip([30.0, 90.0]) {
            hands.push(hand_for(&mut simulation, tip)?);
        }
    }
    for ((hands, expected), tip) in hands.iter().zip(HANDS).zip([30, 90]) {
        let errors: Vec<f64> = hands.iter().map(|found| (found / expected - 1.0).abs()).collect();
        let found = without_play(hands[2], hands[3]);
        let quantity = format!("hand for a tip at {tip}°");
        rows.push(Row::relative("B5 λ=1, play to 0", &quantity, found, expected, 5e-3));
        let quantity = format!("error for a tip at {tip}°");
        rows.push(falling("B5 λ=1, play 0.1 … 0.0125 mm", &quantity, &errors, 0.75));
    }
    let jumps = turn_to(&mut in_tube(1.0, PLAYS[0])?, 360.0, 5.0)?;
    rows.push(Row::with_error(
        "B5 λ=1, play 0.1 mm",
        "jumps in a turn",
        jumps as f64,
        0.0,
        jumps as f64,
        0.0,
    ));
    Ok(rows)
}

/// λ = 2: the tip jumps.
pub(super) fn jumps() -> Result<Vec<Row>> {
    const JUMP: f64 = 197.78561425;
    const PLAYS: [f64; 2] = [0.1, 0.05];
    let turns = [jump(PLAYS[0])?, jump(PLAYS[1])?];
    let found = without_play(turns[0].0, turns[1].0);
    let errors = turns.map(|(hand, _)| (hand / JUMP - 1.0).abs());
    let mut rows = vec![
        Row::relative("B5 λ=2, play to 0", "hand where the tip jumps", found, JUMP, 5e-3),
        falling("B5 λ=2, play 0.1, 0.05 mm", "error of the jump", &errors, 0.75),
    ];
    for (play, (_, jumps)) in PLAYS.into_iter().zip(turns) {
        let name = format!("B5 λ=2, play {play} mm");
        let off = (jumps as f64 - 1.0).abs();
        rows.push(Row::with_error(&name, "jumps up to there", jumps as f64, 1.0, off, 0.0));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_tube_turns_otherwise() {
        // λ 5 % longer: the hand goes 1 % farther, and the jump is elsewhere.
        let mut simulation = in_tube(1.05, 0.2).unwrap();
        let longer = hand_for(&mut simulation, 90.0).unwrap();
        let hand = hand_for(&mut in_tube(1.0, 0.2).unwrap(), 90.0).unwrap();
        assert!((longer / hand - 1.0).abs() > 1e-2, "{longer} {hand}");
    }

    #[test]
    fn contacts_that_open_and_close_within_rounding_are_no_hindrance() {
        let mut simulation = in_tube(2.0, 0.05).unwrap();
        assert_eq!(turn_to(&mut simulation, 45.0, 5.0).unwrap(), 0);
    }
}
