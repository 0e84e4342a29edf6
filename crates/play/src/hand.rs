//! The operator's hand on an instrument: its motion in a tick.

use endowire_core::insertion::{Command, Move};
use endowire_core::{Error, Result};

use crate::TICKS_PER_S;

/// Largest motion by nudges in one tick: 60 mm and 300° per second.
const NUDGE_MM: f64 = 1.0;
const NUDGE_DEG: f64 = 5.0;
/// Largest speeds, mm/s and degrees/s: ten turns a second.
const FASTEST_MM_PER_S: f64 = 300.0;
const FASTEST_DEG_PER_S: f64 = 3600.0;
/// Largest pending motion of nudges, mm and degrees.
const MOST_MM: f64 = 1e4;
const MOST_DEG: f64 = 3.6e4;

/// Motion of one instrument in one step, in the units of a script.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Index of the instrument; 0 is the innermost.
    pub instrument: usize,
    /// Advance, mm; negative when pulled back.
    pub advance_mm: f64,
    /// Rotation, degrees.
    pub rotate_deg: f64,
}

impl Motion {
    /// The same motion as a command, computed as a script does, so that it has the same bits.
    pub(crate) fn as_move(self) -> Move {
        let command = Command {
            advance_mm: self.advance_mm,
            rotate_rad: self.rotate_deg.to_radians(),
            ..Command::default()
        };
        Move { instrument: self.instrument, command }
    }
}

/// The hand on one instrument.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Hand {
    mm_per_s: f64,
    deg_per_s: f64,
    /// Pending motion of nudges.
    todo_mm: f64,
    todo_deg: f64,
}

impl Hand {
    pub(crate) fn hold(&mut self, mm_per_s: f64, deg_per_s: f64) -> Result<()> {
        within("mm_per_s", mm_per_s, FASTEST_MM_PER_S)?;
        within("deg_per_s", deg_per_s, FASTEST_DEG_PER_S)?;
        (self.mm_per_s, self.deg_per_s) = (mm_per_s, deg_per_s);
        Ok(())
    }

    pub(crate) fn nudge(&mut self, mm: f64, deg: f64) -> Result<()> {
        within("mm", self.todo_mm + mm, MOST_MM)?;
        within("deg", self.todo_deg + deg, MOST_DEG)?;
        self.todo_mm += mm;
        self.todo_deg += deg;
        Ok(())
    }

    /// Advance (mm) and rotation (degrees) in the next tick. The advance is limited to `room_mm`; pending nudges are
    /// reduced even if it is.
    pub(crate) fn tick(&mut self, room_mm: [f64; 2]) -> (f64, f64) {
        let nudge_mm = self.todo_mm.clamp(-NUDGE_MM, NUDGE_MM);
        let nudge_deg = self.todo_deg.clamp(-NUDGE_DEG, NUDGE_DEG);
        self.todo_mm -= nudge_mm;
        self.todo_deg -= nudge_deg;
        let mm = (self.mm_per_s / TICKS_PER_S + nudge_mm).clamp(room_mm[0], room_mm[1]);
        (mm, self.deg_per_s / TICKS_PER_S + nudge_deg)
    }
}

fn within(name: &str, value: f64, most: f64) -> Result<()> {
    if (-most..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::parameter(name, value, format!("must be a number from -{most} to {most}")))
}
