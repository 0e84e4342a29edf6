//! The operator's hand on an instrument: its motion in a tick.

use endowire_core::device::MOST_STEER;
use endowire_core::insertion::{Command, Move, Simulation};
use endowire_core::{Error, Result};

use crate::{TICKS_PER_S, USUAL_STEER_PER_S};

/// Largest motion by nudges in one tick: 60 mm and 300° per second.
const NUDGE_MM: f64 = 1.0;
const NUDGE_DEG: f64 = 5.0;
/// Largest speeds, mm/s and degrees/s: ten turns a second.
const FASTEST_MM_PER_S: f64 = 300.0;
const FASTEST_DEG_PER_S: f64 = 3600.0;
/// Fastest steering, 1/s: from straight to the largest bend in a tick.
const FASTEST_STEER_PER_S: f64 = 60.0;
/// Largest pending motion of nudges, mm and degrees.
const MOST_MM: f64 = 1e4;
const MOST_DEG: f64 = 3.6e4;
/// Values of the steering are multiples of one over this power of two, so that their sums and differences are exact: a
/// script names the values that are steered to, and gives the same changes from them.
const STEERS_PER_UNIT: f64 = (1u64 << 40) as f64;

/// Motion of one instrument in one step, in the units of a script.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Index of the instrument; 0 is the innermost.
    pub instrument: usize,
    /// Advance, mm; negative when pulled back.
    pub advance_mm: f64,
    /// Rotation, degrees.
    pub rotate_deg: f64,
    /// Change of the value to which it is steered.
    pub steer: f64,
}

impl Motion {
    /// Whether it is no motion.
    pub(crate) fn rests(&self) -> bool {
        self.advance_mm == 0.0 && self.rotate_deg == 0.0 && self.steer == 0.0
    }

    /// The same motion as a command, computed as a script does, so that it has the same bits.
    pub(crate) fn as_move(self) -> Move {
        let command = Command {
            advance_mm: self.advance_mm,
            rotate_rad: self.rotate_deg.to_radians(),
            steer: self.steer,
        };
        Move { instrument: self.instrument, command }
    }
}

/// The hand on one instrument.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Hand {
    mm_per_s: f64,
    deg_per_s: f64,
    /// Pending motion of nudges.
    todo_mm: f64,
    todo_deg: f64,
    /// Value to which it steers, and how fast, 1/s.
    steer: Option<(f64, f64)>,
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

    /// Steers to this value, or holds the one that is reached; at the usual rate unless given.
    pub(crate) fn steer(&mut self, to: Option<f64>, per_s: Option<f64>) -> Result<()> {
        let per_s = per_s.unwrap_or(USUAL_STEER_PER_S);
        within("to", to.unwrap_or(0.0), MOST_STEER)?;
        if !(0.0..=FASTEST_STEER_PER_S).contains(&per_s) {
            let remedy = format!("must be a number from 0 to {FASTEST_STEER_PER_S}");
            return Err(Error::parameter("per_s", per_s, remedy));
        }
        self.steer = to.map(|to| (steer_value(to), per_s));
        Ok(())
    }

    /// The motion of instrument `instrument` in the next tick. The advance is limited to `room_mm`; pending nudges are
    /// reduced even if it is. `steered` is the value that it is steered to.
    pub(crate) fn tick(&mut self, instrument: usize, room_mm: [f64; 2], steered: f64) -> Motion {
        let nudge_mm = self.todo_mm.clamp(-NUDGE_MM, NUDGE_MM);
        let nudge_deg = self.todo_deg.clamp(-NUDGE_DEG, NUDGE_DEG);
        self.todo_mm -= nudge_mm;
        self.todo_deg -= nudge_deg;
        let mm = (self.mm_per_s / TICKS_PER_S + nudge_mm).clamp(room_mm[0], room_mm[1]);
        let rotate_deg = self.deg_per_s / TICKS_PER_S + nudge_deg;
        Motion { instrument, advance_mm: mm, rotate_deg, steer: self.steers_by(steer_value(steered)) }
    }

    /// Change of the steering in the next tick, from this value.
    fn steers_by(&mut self, from: f64) -> f64 {
        let Some((to, per_s)) = self.steer else { return 0.0 };
        // Rounded up: what rounding left over would be a step of its own at the end.
        let most = (per_s / TICKS_PER_S * STEERS_PER_UNIT).ceil() / STEERS_PER_UNIT;
        let next = steer_value(from + (to - from).clamp(-most, most));
        if next == to {
            self.steer = None;
        }
        next - from
    }
}

/// The nearest value of the steering that hands and scripts name without rounding.
pub(crate) fn steer_value(value: f64) -> f64 {
    // Rounding must not leave a minus sign before zero.
    (value * STEERS_PER_UNIT).round().clamp(-STEERS_PER_UNIT, STEERS_PER_UNIT) / STEERS_PER_UNIT + 0.0
}

/// Values to which hands have steered, by instrument; devices may not have followed yet.
pub(crate) fn steered(simulation: &Simulation) -> Vec<f64> {
    let report = simulation.report();
    let behind = |index: usize| report.behind.get(index).map_or(0.0, |behind| behind.steer);
    let each = report.hands().into_iter().enumerate();
    each.map(|(index, hand)| steer_value(hand.steer + behind(index))).collect()
}

fn within(name: &str, value: f64, most: f64) -> Result<()> {
    if (-most..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::parameter(name, value, format!("must be a number from -{most} to {most}")))
}
