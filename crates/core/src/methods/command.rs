//! Motions of the hand: advance, retract and rotate, alone or together.

use serde::{Deserialize, Serialize};

/// One input of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Command {
    /// Length pushed in, mm; negative pulls back.
    pub advance_mm: f64,
    /// Rotation of the tail about its axis, rad; positive is right-handed about the direction of insertion.
    pub rotate_rad: f64,
    /// Change of the value to which a steered device is steered, which stays within −1 and 1.
    pub steer: f64,
}

impl Command {
    /// Pushes in by `mm`.
    pub fn advance(mm: f64) -> Self {
        Self { advance_mm: mm, ..Self::default() }
    }

    /// Pulls back by `mm`.
    pub fn retract(mm: f64) -> Self {
        Self::advance(-mm)
    }

    /// Rotates the tail by `rad`.
    pub fn rotate(rad: f64) -> Self {
        Self { rotate_rad: rad, ..Self::default() }
    }

    /// Changes the steering value by so much.
    pub fn steer(by: f64) -> Self {
        Self { steer: by, ..Self::default() }
    }
}

/// The motion of the hand of one of several instruments.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Move {
    /// Index of the instrument, 0 being the innermost ([`Stack::find`](crate::device::Stack::find) finds it by name).
    pub instrument: usize,
    /// Its motion.
    pub command: Command,
}
