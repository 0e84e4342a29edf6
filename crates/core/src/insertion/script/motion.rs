//! A simultaneous motion of hands, and the steps into which it is divided.

use super::inject::Bolus;
use super::until::Condition;
use crate::device::LENGTH_SLACK_MM;
use crate::insertion::{Command, Move};
use crate::{Error, Result};

/// Largest number of steps of a script: at one kilohertz, over 2 hours of manipulation.
pub(super) const STEP_LIMIT: f64 = 1e7;

/// The motion of a hand along the device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Travel {
    /// By this length, mm; negative pulls back.
    By(f64),
    /// Back by the whole inserted length.
    Out,
    /// In, as far as this instrument was before the previous motion.
    AsFarAs(usize),
}

/// The motion of one hand.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    /// Its line's name in messages.
    pub(super) name: String,
    pub(super) instrument: usize,
    pub(super) travel: Travel,
    pub(super) turn_rad: f64,
    /// The value to which it is steered, if it is.
    pub(super) steer: Option<f64>,
    pub(super) step_mm: f64,
    pub(super) step_deg: f64,
    pub(super) step_steer: f64,
    pub(super) speed_mm_per_s: Option<f64>,
    pub(super) speed_deg_per_s: Option<f64>,
    pub(super) speed_steer_per_s: Option<f64>,
}

/// Time for which hands rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wait {
    pub(super) wait_s: f64,
    /// Largest increment, s.
    pub(super) step_s: f64,
}

/// Simultaneous motions of hands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion {
    /// Its line's name in messages.
    pub(super) name: String,
    /// The line's own instrument first; empty while hands rest, which takes no step unless they wait.
    pub(super) parts: Vec<Part>,
    /// Time for which hands rest; then there are no parts.
    pub(super) wait: Option<Wait>,
    pub(super) until: Option<Condition>,
    /// Injection at its start.
    pub(super) inject: Option<Bolus>,
    /// The instrument inserted by the next motion, if this one is withdrawn for it.
    pub(super) exchange: Option<Incoming>,
    /// The instrument whose coil is detached, in a single step without parts.
    pub(super) detach: Option<usize>,
    /// Linear solves per step, if it is a tick.
    pub(super) solves: Option<usize>,
}

/// An instrument that replaces another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Incoming {
    /// The key that names it.
    pub(super) key: String,
    pub(super) instrument: usize,
    pub(super) name: String,
}

impl Incoming {
    /// Rejects it if it is already inserted.
    pub(super) fn check_out(&self, lengths: &Lengths) -> Result<()> {
        let now_mm = lengths.now_mm[self.instrument];
        if now_mm <= LENGTH_SLACK_MM {
            return Ok(());
        }
        let remedy =
            format!("{now_mm:.3} mm of it are in already: withdraw it before, or name one that is out");
        Err(Error::parameter(&self.key, format!("{:?}", self.name), remedy))
    }
}

/// A motion divided into equal steps.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Steps {
    /// The moves of each step.
    pub(super) moves: Vec<Move>,
    /// Number of steps.
    pub(super) count: usize,
    /// Duration of each step, s; 0 without a speed.
    pub(super) step_s: f64,
}

/// Inserted lengths of all instruments, mm: at the start of a motion, and of the one before; and the values to which they
/// are steered.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lengths {
    pub(super) now_mm: Vec<f64>,
    pub(super) before_mm: Vec<f64>,
    pub(super) steered: Vec<f64>,
}

impl Lengths {
    /// At the start of a script.
    pub(super) fn at(inserted_mm: &[f64]) -> Self {
        let steered = vec![0.0; inserted_mm.len()];
        Self { now_mm: inserted_mm.to_vec(), before_mm: inserted_mm.to_vec(), steered }
    }
}

/// Number of equal increments, rounded up from `steps`, for a line of this name.
fn increments(name: &str, steps: f64) -> Result<usize> {
    // The tolerance makes 0.3 mm in steps of 0.1 mm three increments, not four.
    let count = (steps - 1e-9).ceil().max(1.0);
    if count > STEP_LIMIT {
        let steps = format!("{} steps", crate::error::number(count));
        let remedy = format!("at most {STEP_LIMIT} steps in a line: use larger increments");
        return Err(Error::parameter(name, steps, remedy));
    }
    Ok(count as usize)
}

impl Part {
    /// Signed motion along the device from there, mm.
    pub(super) fn travel_mm(&self, lengths: &Lengths) -> f64 {
        match self.travel {
            Travel::By(mm) => mm,
            Travel::Out => -lengths.now_mm[self.instrument],
            Travel::AsFarAs(other) => lengths.before_mm[other],
        }
    }

    /// Change of the steering from there.
    fn steers_by(&self, lengths: &Lengths) -> f64 {
        self.steer.map_or(0.0, |to| to - lengths.steered[self.instrument])
    }

    /// Length, mm, turn, degrees, and change of the steering from there, without signs.
    fn ways(&self, lengths: &Lengths) -> [f64; 3] {
        [self.travel_mm(lengths), self.turn_rad.to_degrees(), self.steers_by(lengths)].map(f64::abs)
    }

    /// Number of equal increments from there.
    fn increments(&self, lengths: &Lengths) -> Result<usize> {
        let steps = [self.step_mm, self.step_deg, self.step_steer];
        let each = self.ways(lengths).into_iter().zip(steps).map(|(way, step)| way / step);
        increments(&self.name, each.fold(1.0, f64::max))
    }

    /// Whether it moves its instrument along and around itself, and steers it.
    pub(super) fn moves(&self) -> [bool; 3] {
        let along = match self.travel {
            Travel::By(mm) => mm != 0.0,
            Travel::Out | Travel::AsFarAs(_) => true,
        };
        [along, self.turn_rad != 0.0, self.steer.is_some()]
    }

    /// Whether its duration is known: it has a speed of a motion that it makes, or any if it makes none.
    fn is_timed(&self) -> bool {
        let moves = self.moves();
        let counts =
            |(speed, moves_so): (Option<f64>, bool)| speed.is_some() && (moves_so || moves == [false; 3]);
        self.speeds().into_iter().zip(moves).any(counts)
    }

    /// Speeds of pushing, turning and steering.
    fn speeds(&self) -> [Option<f64>; 3] {
        [self.speed_mm_per_s, self.speed_deg_per_s, self.speed_steer_per_s]
    }

    /// Its duration, s.
    fn duration_s(&self, lengths: &Lengths) -> f64 {
        let each = self.ways(lengths).into_iter().zip(self.speeds());
        each.map(|(way, speed)| speed.map_or(0.0, |speed| way / speed)).fold(0.0, f64::max)
    }
}

impl Motion {
    /// A motion of nothing.
    pub(super) fn resting(name: String) -> Self {
        Self {
            name,
            parts: Vec::new(),
            wait: None,
            until: None,
            inject: None,
            exchange: None,
            detach: None,
            solves: None,
        }
    }

    /// Whether its duration is known: from a part that moves, if one does.
    pub(super) fn is_timed(&self) -> bool {
        let moves = |part: &Part| part.moves() != [false; 3];
        let still = !self.parts.iter().any(moves);
        self.wait.is_some() || self.parts.iter().any(|part| part.is_timed() && (still || moves(part)))
    }

    /// The steps of the whole motion from these lengths.
    ///
    /// # Errors
    /// More steps than a script may have.
    pub(super) fn steps(&self, lengths: &Lengths) -> Result<Steps> {
        let (mut count, mut duration_s) =
            (usize::from(!self.parts.is_empty() || self.detach.is_some()), 0.0_f64);
        for part in &self.parts {
            count = count.max(part.increments(lengths)?);
            duration_s = duration_s.max(part.duration_s(lengths));
        }
        if let Some(Wait { wait_s, step_s }) = self.wait {
            count = increments(&self.name, wait_s / step_s)?;
            duration_s = wait_s;
        }
        let share = 1.0 / count.max(1) as f64;
        let command = |part: &Part| Command {
            advance_mm: part.travel_mm(lengths) * share,
            rotate_rad: part.turn_rad * share,
            steer: part.steers_by(lengths) * share,
        };
        let moves =
            self.parts.iter().map(|part| Move { instrument: part.instrument, command: command(part) });
        Ok(Steps { moves: moves.collect(), count, step_s: duration_s * share })
    }
}
