//! Playback of a script in a session: its steps in real time, and its injections as their lines begin.

use endowire_core::Result;
use endowire_core::insertion::{Command, Injection, Move, Script, ScriptRun, Simulation};

use crate::hand::{Motion, steer_value, steered};
use crate::history::Done;
use crate::{TICKS_PER_S, USUAL_DEG_PER_S, USUAL_MM_PER_S, USUAL_STEER_PER_S};

/// Shortest duration of a step, s: limits the steps per tick to 16.
const LEAST_S: f64 = 1.0 / (16.0 * TICKS_PER_S);
/// Tolerance, in ticks, by which a step may come early: sums of times are rounded.
const EARLY: f64 = 1e-6;

/// A script during playback.
#[derive(Debug)]
pub(crate) struct Demonstration {
    run: ScriptRun<'static>,
    /// Ticks during which it was played.
    ticks: u64,
    /// End time of the steps so far, s.
    done_s: f64,
    /// Number of injections already returned.
    injected: usize,
    /// Number of lines already returned.
    lines: usize,
    pub(crate) paused: bool,
}

/// What comes next.
#[derive(Debug, PartialEq)]
pub(crate) enum Next {
    /// Nothing more in this tick: the next step is under way.
    Later {
        /// Whether nothing moves in it.
        rests: bool,
    },
    /// The end of the script.
    End,
    /// A step.
    Step {
        step: Done,
        /// Whether it is the first step of its line.
        begins: bool,
        /// Time from its end to the end of the tick, s.
        ago_s: f64,
    },
}

impl Demonstration {
    pub(crate) fn new(script: Script) -> Self {
        Self { run: script.into_run(), ticks: 0, done_s: 0.0, injected: 0, lines: 0, paused: false }
    }

    /// Advances by one tick.
    pub(crate) fn tick(&mut self) {
        self.ticks += 1;
    }

    /// The next step within this tick. The caller must carry it out before the next call.
    ///
    /// # Errors
    /// As [`ScriptRun::next`].
    pub(crate) fn next(&mut self, simulation: &Simulation) -> Result<Next> {
        let Some(step) = self.run.next(simulation)? else { return Ok(Next::End) };
        let took_s = if step.time_s.is_some() { step.duration_s } else { usual_s(&step.moves) }.max(LEAST_S);
        let end_s = self.done_s + took_s;
        if end_s * TICKS_PER_S > self.ticks as f64 + EARLY {
            let rests =
                step.moves.iter().all(|one| one.command == Command::default()) && step.detach.is_none();
            return Ok(Next::Later { rests });
        }
        let from = steered(simulation);
        let motions = step.moves.iter().map(|one| shown(one, from[one.instrument]));
        let motions = motions.filter(|one| !one.rests());
        let (detach, solves) = (step.detach, step.solves);
        let step = Done { motions: motions.collect(), per_s: 1.0 / took_s, detach, solves };
        self.run.carried_out();
        self.done_s = end_s;
        let lines = self.run.course().motions.len();
        let begins = std::mem::replace(&mut self.lines, lines) != lines;
        let ago_s = (self.ticks as f64 / TICKS_PER_S - end_s).max(0.0);
        Ok(Next::Step { step, begins, ago_s })
    }

    /// Injections of lines that have begun since the last call.
    pub(crate) fn injections(&mut self) -> Vec<Injection> {
        let reported = std::mem::replace(&mut self.injected, self.run.injections().len());
        self.run.injections()[reported..].to_vec()
    }
}

/// Duration, s, of a step without a time.
fn usual_s(moves: &[Move]) -> f64 {
    let each = moves.iter().map(|one| {
        let Command { advance_mm, rotate_rad, steer } = one.command;
        let turns_s = rotate_rad.abs().to_degrees() / USUAL_DEG_PER_S;
        (advance_mm.abs() / USUAL_MM_PER_S).max(turns_s).max(steer.abs() / USUAL_STEER_PER_S)
    });
    each.fold(0.0, f64::max)
}

/// Converts a move to millimetres and degrees, of an instrument that is steered to this value. Not every angle in radians
/// is the image of one in degrees; in that case the last bit differs, as it may of values that are steered to.
fn shown(one: &Move, steered: f64) -> Motion {
    let Command { advance_mm, rotate_rad: rad, steer } = one.command;
    let near = rad.to_degrees();
    let same = |deg: &f64| deg.to_radians().to_bits() == rad.to_bits();
    let rotate_deg = [near, near.next_up(), near.next_down()].into_iter().find(same).unwrap_or(near);
    Motion {
        instrument: one.instrument,
        advance_mm,
        rotate_deg,
        steer: steer_value(steered + steer) - steered,
    }
}
