//! A script that is shown: its steps in the time that they take, and what it injects as its lines begin.

use endowire_core::Result;
use endowire_core::insertion::{Injection, Move, Script, ScriptRun, Simulation};

use crate::hand::Motion;
use crate::history::Done;
use crate::{TICKS_PER_S, USUAL_DEG_PER_S, USUAL_MM_PER_S};

/// Least time of a step, s: a tick carries out no more than so many.
const LEAST_S: f64 = 1.0 / (16.0 * TICKS_PER_S);
/// Part of a tick by which a step may come too soon: sums of times are rounded.
const EARLY: f64 = 1e-6;

/// A script on its way.
#[derive(Debug)]
pub(crate) struct Demonstration {
    run: ScriptRun<'static>,
    /// Ticks that have gone by while it was shown.
    ticks: u64,
    /// When the steps so far end, s.
    done_s: f64,
    /// Injections that have been told.
    injected: usize,
    /// Lines that have been told.
    lines: usize,
    pub(crate) paused: bool,
}

/// What is next.
#[derive(Debug, PartialEq)]
pub(crate) enum Next {
    /// Nothing in this tick.
    Later,
    /// The script is at its end.
    End,
    /// A step.
    Step {
        step: Done,
        /// Whether it is the first of its line.
        begins: bool,
    },
}

impl Demonstration {
    pub(crate) fn new(script: Script) -> Self {
        Self { run: script.into_run(), ticks: 0, done_s: 0.0, injected: 0, lines: 0, paused: false }
    }

    /// A sixtieth of a second goes by.
    pub(crate) fn tick(&mut self) {
        self.ticks += 1;
    }

    /// What is next in this tick. A step that is told has been carried out when this is asked again.
    ///
    /// # Errors
    /// As [`ScriptRun::next`].
    pub(crate) fn next(&mut self, simulation: &Simulation) -> Result<Next> {
        let Some(step) = self.run.next(simulation)? else { return Ok(Next::End) };
        let took_s = if step.time_s.is_some() { step.duration_s } else { usual_s(&step.moves) }.max(LEAST_S);
        let end_s = self.done_s + took_s;
        if end_s * TICKS_PER_S > self.ticks as f64 + EARLY {
            return Ok(Next::Later);
        }
        let motions =
            step.moves.iter().map(shown).filter(|one| one.advance_mm != 0.0 || one.rotate_deg != 0.0);
        let (detach, solves) = (step.detach, step.solves);
        let step = Done { motions: motions.collect(), per_s: 1.0 / took_s, detach, solves };
        self.run.carried_out();
        self.done_s = end_s;
        let lines = self.run.course().motions.len();
        let begins = std::mem::replace(&mut self.lines, lines) != lines;
        Ok(Next::Step { step, begins })
    }

    /// What is injected now: by lines that have begun since this was asked last.
    pub(crate) fn injections(&mut self) -> Vec<Injection> {
        let told = std::mem::replace(&mut self.injected, self.run.injections().len());
        self.run.injections()[told..].to_vec()
    }
}

/// Time of a step that has none, s.
fn usual_s(moves: &[Move]) -> f64 {
    let each = moves.iter().map(|one| {
        let (mm, rad) = (one.command.advance_mm.abs(), one.command.rotate_rad.abs());
        (mm / USUAL_MM_PER_S).max(rad.to_degrees() / USUAL_DEG_PER_S)
    });
    each.fold(0.0, f64::max)
}

/// A move in the units of a hand. Some angles in radians are those of no degrees; then the nearest ones differ in the last bit.
fn shown(one: &Move) -> Motion {
    let (advance_mm, rad) = (one.command.advance_mm, one.command.rotate_rad);
    let near = rad.to_degrees();
    let same = |deg: &f64| deg.to_radians().to_bits() == rad.to_bits();
    let rotate_deg = [near, near.next_up(), near.next_down()].into_iter().find(same).unwrap_or(near);
    Motion { instrument: one.instrument, advance_mm, rotate_deg }
}
