//! B5: the whip of a pre-curved wire that is turned in a curved tube.

use super::Row;
use super::contact::falling;
use super::insertion::{Tube, push};
use crate::device::{Device, Section};
use crate::insertion::{Command, Sheath, Simulation, WallProperties};
use crate::methods::MethodChoice;
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::{Error, Result, Vec3};
use std::f64::consts::SQRT_2;

/// Radius of tube and wire, mm: κt = κ0 = 1/40, and EI = GJ, so λ is the angle of the tube.
const BEND: f64 = 40.0;
const STIFFNESS: f64 = 10.0;
/// Radius of the wire's section, mm.
const WIRE_RADIUS: f64 = 0.1;

/// A wire as long as the tube's bend of `lambda` radians, with `play_mm` about it.
fn in_tube(lambda: f64, play_mm: f64) -> Result<Simulation> {
    let length_mm = lambda * BEND;
    let radius_mm = WIRE_RADIUS + play_mm;
    let tube =
        Tube { begin_mm: 1.0, straight_mm: 0.0, bend_mm: BEND, turn: lambda + 0.1, end_mm: 0.5, radius_mm };
    let wall = tube.wall(0.5, 0.5 * radius_mm)?;
    let wire = Device::new(vec![Section {
        torsional_stiffness_nmm2: Some(STIFFNESS),
        rest_curvature_per_mm: [1.0 / BEND, 0.0],
        ..Section::straight(length_mm + 1.0, WIRE_RADIUS, STIFFNESS)
    }])?;
    let sheath = Sheath::new(Vec3::zeros(), Vec3::x())?;
    let element_mm = length_mm / 40.0;
    let method = MethodChoice::Kirchhoff(KirchhoffOptions { element_mm, ..KirchhoffOptions::default() });
    let rigid = WallProperties { modulus_n_per_mm2: 1e4, ..WallProperties::default() };
    let mut simulation = Simulation::with_properties(wall, rigid, wire, sheath, &method)?;
    push(&mut simulation, length_mm, 40)?;
    Ok(simulation)
}

/// Turns the hand to `hand` degrees in steps of at most `step`; the number of jumps on the way.
fn turn_to(simulation: &mut Simulation, hand: f64, step: f64) -> Result<usize> {
    let way = hand.to_radians() - simulation.report().rotation_rad;
    let count = (way.abs() / step.to_radians()).ceil().max(1.0);
    let mut jumps = 0;
    for _ in 0..count as usize {
        jumps += usize::from(simulation.step(Command::rotate(way / count))?.jumped);
    }
    Ok(jumps)
}

/// Angle of the hand, in degrees, at which the tip has turned by `tip` degrees.
fn hand_for(simulation: &mut Simulation, tip: f64) -> Result<f64> {
    let mut hand = tip;
    for _ in 0..20 {
        turn_to(simulation, hand, 5.0)?;
        let off = tip - simulation.report().tip_rotation_rad.to_degrees();
        if off.abs() < 1e-6 {
            return Ok(hand);
        }
        hand += off;
    }
    Err(Error::Computation(format!("B5: no hand angle found for a tip at {tip}°")))
}

/// Angles of the hand for tips at 30° and 90° with λ = 1, and jumps in a whole turn.
fn slow_turn(play_mm: f64) -> Result<([f64; 2], usize)> {
    let mut simulation = in_tube(1.0, play_mm)?;
    let hands = [hand_for(&mut simulation, 30.0)?, hand_for(&mut simulation, 90.0)?];
    turn_to(&mut simulation, 0.0, 5.0)?;
    Ok((hands, turn_to(&mut simulation, 360.0, 5.0)?))
}

/// Angle of the hand, within a quarter of a degree, at which the tip jumps with λ = 2, and jumps up to there.
fn jump(play_mm: f64) -> Result<(f64, usize)> {
    let mut simulation = in_tube(2.0, play_mm)?;
    let mut jumps = turn_to(&mut simulation, 185.0, 5.0)?;
    let mut hand = 185.0;
    while hand < 205.0 {
        hand += 0.5;
        let here = turn_to(&mut simulation, hand, 0.5)?;
        jumps += here;
        if here > 0 {
            return Ok((hand - 0.25, jumps));
        }
    }
    Err(Error::Computation("B5: no jump up to 205°".to_owned()))
}

/// What a value comes to without play, from those at some play and half of it: near the ends the wire straightens over a length
/// √(2 play/Δκ), so errors go with the root of the play.
fn without_play(with: f64, with_half: f64) -> f64 {
    (SQRT_2 * with_half - with) / (SQRT_2 - 1.0)
}

/// λ = 1: the tip follows the hand.
pub(super) fn whip() -> Result<Vec<Row>> {
    const HANDS: [f64; 2] = [45.35271903, 118.41209714];
    let mut rows = Vec::new();
    let turns = [slow_turn(0.4)?, slow_turn(0.2)?, slow_turn(0.1)?];
    for (k, tip) in [30, 90].into_iter().enumerate() {
        let hand = turns.map(|(hands, _)| hands[k]);
        let errors = hand.map(|found| (found / HANDS[k] - 1.0).abs());
        let found = without_play(hand[1], hand[2]);
        let quantity = format!("hand for a tip at {tip}°");
        rows.push(Row::relative("B5 λ=1, play to 0", &quantity, found, HANDS[k], 2e-2));
        let quantity = format!("error for a tip at {tip}°");
        rows.push(falling("B5 λ=1, play 0.4, 0.2, 0.1 mm", &quantity, &errors, 0.75));
    }
    let jumps: usize = turns.iter().map(|(_, jumps)| jumps).sum();
    rows.push(Row::with_error("B5 λ=1, all plays", "jumps in a turn", jumps as f64, 0.0, jumps as f64, 0.0));
    Ok(rows)
}

/// λ = 2: the tip jumps.
pub(super) fn jumps() -> Result<Vec<Row>> {
    const JUMP: f64 = 197.78561425;
    let turns = [jump(0.2)?, jump(0.1)?];
    let found = without_play(turns[0].0, turns[1].0);
    let errors = turns.map(|(hand, _)| (hand / JUMP - 1.0).abs());
    let mut rows = vec![
        Row::relative("B5 λ=2, play to 0", "hand where the tip jumps", found, JUMP, 1e-2),
        falling("B5 λ=2, play 0.2, 0.1 mm", "error of the jump", &errors, 0.75),
    ];
    for (play, (_, jumps)) in [0.2, 0.1].into_iter().zip(turns) {
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
        // λ 5 % longer: the hand goes 1 % farther, and a jump comes elsewhere.
        let mut simulation = in_tube(1.05, 0.2).unwrap();
        let longer = hand_for(&mut simulation, 90.0).unwrap();
        let ([_, hand], _) = slow_turn(0.2).unwrap();
        assert!((longer / hand - 1.0).abs() > 1e-2, "{longer} {hand}");
    }
}
