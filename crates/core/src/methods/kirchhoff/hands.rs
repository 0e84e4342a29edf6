//! Positions of the hands: one for a single device, one for each of several instruments.

use serde::{Deserialize, Serialize};

use crate::contact::HandMotion;
use crate::device::{Stack, line_mm};
use crate::methods::{Command, Move};

/// Lengths and slips up to this, mm, are rounding: within it of the sheath a device is retracted completely.
pub(super) const ROUNDED_MM: f64 = 1e-9;

/// Position of a hand relative to the start.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Hand {
    /// Length inserted, mm.
    pub(super) inserted_mm: f64,
    /// Rotation, rad.
    pub(super) turn_rad: f64,
}

impl Hand {
    /// The motion to another position.
    fn to(&self, target: &Self) -> Command {
        Command {
            advance_mm: target.inserted_mm - self.inserted_mm,
            rotate_rad: target.turn_rad - self.turn_rad,
        }
    }
}

/// Force and torque of a hand at an equilibrium. The energy balance of the device leaves out friction along the line
/// outside the body, which moves nothing inside.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct HandForce {
    /// Push force inside the body, N; where it jumps the hand's share of that of all instruments with level tips.
    pub(super) push_n: f64,
    /// Whether the push force of this hand alone jumps: its instrument's tip is at that of another, or it is not
    /// inserted.
    pub(super) jumps: bool,
    /// Torque, with that of friction at the sheath and at valves, N·mm.
    pub(super) torque_nmm: f64,
    /// Friction of the sheath and of valves on the push force, N.
    pub(super) outside_n: f64,
}

impl HandForce {
    /// Whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let Self { push_n, torque_nmm, outside_n, .. } = self;
        [push_n, torque_nmm, outside_n].into_iter().all(|part| part.is_finite())
    }
}

/// Sets `motions` to those from the hands `before` to those `after`.
pub(super) fn set_motions(before: &[Hand], after: &[Hand], motions: &mut Vec<HandMotion>) {
    motions.clear();
    motions.extend(before.iter().zip(after).map(|(was, is)| HandMotion {
        from_mm: was.inserted_mm,
        to_mm: is.inserted_mm,
        turn_rad: is.turn_rad - was.turn_rad,
    }));
}

/// Advance of the line in these motions, mm: of the instrument inserted farthest before to that after.
pub(super) fn line_advance_mm(motions: &[HandMotion]) -> f64 {
    line_mm(motions.iter().map(|hand| hand.to_mm)) - line_mm(motions.iter().map(|hand| hand.from_mm))
}

/// Largest advance of a hand, either way, mm.
pub(super) fn longest_mm(motions: &[HandMotion]) -> f64 {
    motions.iter().fold(0.0, |most_mm, hand| hand.advance_mm().abs().max(most_mm))
}

/// Writes the motion of each of so many hands: what earlier commands have left over, and these moves.
pub(super) fn add_moves(hands: usize, behind: &[Command], moves: &[Move], motions: &mut Vec<Command>) {
    motions.clear();
    motions.extend_from_slice(behind);
    motions.resize(hands, Command::default());
    for one in moves {
        // Moves of instruments that do not exist are refused before they are carried out.
        if let Some(motion) = motions.get_mut(one.instrument) {
            motion.advance_mm += one.command.advance_mm;
            motion.rotate_rad += one.command.rotate_rad;
        }
    }
}

/// Largest motion in commands, mm; a rotation of `turn_rad` counts as one.
pub(super) fn largest_mm(commands: impl Iterator<Item = Command>, turn_rad: f64) -> f64 {
    let each = commands.map(|one| one.advance_mm.abs().max(one.rotate_rad.abs() / turn_rad));
    each.fold(0.0, f64::max)
}

/// The lengths inserted, mm.
pub(super) fn lengths(hands: &[Hand]) -> impl Iterator<Item = f64> {
    hands.iter().map(|hand| hand.inserted_mm)
}

/// The simultaneous motion of all hands in a command.
#[derive(Debug, Clone, Default)]
pub(super) struct Way {
    /// Positions where it goes on.
    pub(super) start: Vec<Hand>,
    /// Positions at its end.
    pub(super) target: Vec<Hand>,
    /// The whole motion of each hand, with what earlier commands had left over.
    pub(super) commands: Vec<Command>,
}

impl Way {
    /// Sets the motion from these positions, with what earlier commands have left over for each hand.
    pub(super) fn begin(&mut self, stack: &Stack, (hands, behind): (&[Hand], &[Command]), moves: &[Move]) {
        self.go_on_from(hands);
        add_moves(hands.len(), behind, moves, &mut self.commands);
        self.target.clear();
        for ((hand, command), device) in self.start.iter().zip(&self.commands).zip(stack.devices()) {
            let target = (hand.inserted_mm + command.advance_mm).min(device.length_mm());
            let inserted_mm = if target < ROUNDED_MM { 0.0 } else { target };
            self.target.push(Hand { inserted_mm, turn_rad: hand.turn_rad + command.rotate_rad });
        }
    }

    /// Sets `hands` to the positions at this fraction of the remaining motion, 0 to 1.
    pub(super) fn at(&self, part: f64, hands: &mut Vec<Hand>) {
        if part == 1.0 {
            hands.clone_from(&self.target);
            return;
        }
        hands.clear();
        hands.extend(self.start.iter().zip(&self.target).map(|(start, target)| Hand {
            inserted_mm: start.inserted_mm + (target.inserted_mm - start.inserted_mm) * part,
            turn_rad: start.turn_rad + (target.turn_rad - start.turn_rad) * part,
        }));
    }

    /// Continues from `hands`: the motion before them is over.
    pub(super) fn go_on_from(&mut self, hands: &[Hand]) {
        self.start.clear();
        self.start.extend_from_slice(hands);
    }

    /// Whether no motion remains.
    pub(super) fn is_done(&self) -> bool {
        self.start == self.target
    }

    /// What remains of it for each hand.
    pub(super) fn left(&self) -> Vec<Command> {
        self.start.iter().zip(&self.target).map(|(hand, target)| hand.to(target)).collect()
    }

    /// Largest remaining motion of a hand, mm; a rotation of `turn_rad` counts as one.
    pub(super) fn travel_mm(&self, turn_rad: f64) -> f64 {
        largest_mm(self.start.iter().zip(&self.target).map(|(hand, target)| hand.to(target)), turn_rad)
    }
}
