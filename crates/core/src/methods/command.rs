//! What the hand does: advance, retract and rotate, alone or together.

use serde::{Deserialize, Serialize};

/// One input of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Command {
    /// Length pushed in, mm; negative pulls back.
    pub advance_mm: f64,
    /// Turn of the tail about its axis, rad; positive is right-handed about the direction of insertion.
    pub rotate_rad: f64,
}

impl Command {
    /// Pushes in by `mm`.
    pub fn advance(mm: f64) -> Self {
        Self { advance_mm: mm, rotate_rad: 0.0 }
    }

    /// Pulls back by `mm`.
    pub fn retract(mm: f64) -> Self {
        Self::advance(-mm)
    }

    /// Turns the tail by `rad`.
    pub fn rotate(rad: f64) -> Self {
        Self { advance_mm: 0.0, rotate_rad: rad }
    }
}

/// What the hand of one of several instruments does.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Move {
    /// Number of the instrument, the innermost being 0 ([`Stack::find`](crate::device::Stack::find) has it by name).
    pub instrument: usize,
    /// Its motion.
    pub command: Command,
}
