//! All steps of a session, and states to go back to.

use std::fmt::Write as _;

use endowire_core::Result;
use endowire_core::device::Stack;
use endowire_core::insertion::{Move, Simulation, State};

use crate::hand::Motion;

/// Least increment of a line, mm and degrees: less than that a line does in one step.
const LEAST: f64 = 1e-9;

/// A state is kept each so many steps: those between are carried out once more, which takes less than a second.
const EVERY: usize = 64;

/// What was done, step by step.
#[derive(Debug)]
pub(crate) struct History {
    steps: Vec<Vec<Motion>>,
    /// State after step `EVERY · index`.
    states: Vec<State>,
    /// Steps after which a hand began to move.
    begun: Vec<usize>,
}

impl History {
    pub(crate) fn new(start: &Simulation) -> Self {
        Self { steps: Vec::new(), states: vec![start.state()], begun: Vec::new() }
    }

    pub(crate) fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Notes that a motion begins after this step.
    pub(crate) fn begin_motion(&mut self) {
        if self.begun.last() != Some(&self.steps.len()) {
            self.begun.push(self.steps.len());
        }
    }

    /// Where the last motion began, before this moment.
    pub(crate) fn last_motion(&self) -> Option<usize> {
        self.begun.iter().rev().copied().find(|step| *step < self.steps.len())
    }

    /// Adds a step that `after` has just carried out.
    pub(crate) fn push(&mut self, motions: Vec<Motion>, after: &Simulation) {
        self.steps.push(motions);
        if self.steps.len().is_multiple_of(EVERY) {
            self.states.push(after.state());
        }
    }

    /// Brings the simulation back to the moment after step `step`, of those there are; later ones are dropped.
    ///
    /// # Errors
    /// As [`Simulation::step_together`]; steps that were carried out once can be again.
    pub(crate) fn go_back(&mut self, step: usize, simulation: &mut Simulation) -> Result<()> {
        let kept = step / EVERY;
        simulation.restore(&self.states[kept])?;
        for motions in &self.steps[kept * EVERY..step] {
            simulation.step_together(&moves(motions))?;
        }
        self.steps.truncate(step);
        self.states.truncate(kept + 1);
        self.begun.retain(|begun| *begun < step);
        Ok(())
    }

    /// The steps as a script, one line a step; alike ones in a row are one line where that has the same bits.
    pub(crate) fn script(&self, stack: &Stack) -> String {
        let mut text = String::new();
        for run in self.steps.chunk_by(|a, b| a == b) {
            let mut left = run.len();
            while left > 0 {
                let count = (1..=left).rev().find(|count| cuts_evenly(&run[0], *count)).unwrap_or(1);
                line(&mut text, stack, &run[0], count);
                left -= count;
            }
        }
        text
    }
}

pub(crate) fn moves(motions: &[Motion]) -> Vec<Move> {
    motions.iter().map(|motion| motion.as_move()).collect()
}

/// Whether a line of `count` times these motions is cut into them to the bit (see `Motion::steps` of scripts).
fn cuts_evenly(motions: &[Motion], count: usize) -> bool {
    let share = 1.0 / count as f64;
    let small = |value: f64| value != 0.0 && value.abs() < LEAST;
    motions.iter().all(|one| {
        if small(one.advance_mm) || small(one.rotate_deg) {
            return count == 1;
        }
        let whole_mm = one.advance_mm * count as f64;
        let whole_deg = one.rotate_deg * count as f64;
        whole_mm * share == one.advance_mm && whole_deg.to_radians() * share == one.rotate_deg.to_radians()
    })
}

/// Writes a line of a script.
fn line(text: &mut String, stack: &Stack, motions: &[Motion], count: usize) {
    let keys = |one: &Motion| {
        let mut keys = Vec::new();
        if stack.is_several() {
            keys.push(format!("instrument = {:?}", stack.instruments()[one.instrument].name));
        }
        let key = if one.advance_mm < 0.0 { "retract_mm" } else { "advance_mm" };
        if one.advance_mm != 0.0 || one.rotate_deg == 0.0 {
            keys.push(format!("{key} = {:?}", one.advance_mm.abs() * count as f64));
            keys.push(format!("step_mm = {:?}", one.advance_mm.abs().max(LEAST)));
        }
        if one.rotate_deg != 0.0 {
            keys.push(format!("rotate_deg = {:?}", one.rotate_deg * count as f64));
            keys.push(format!("step_deg = {:?}", one.rotate_deg.abs().max(LEAST)));
        }
        keys
    };
    let Some((first, others)) = motions.split_first() else { return };
    let with: Vec<String> = others.iter().map(|one| format!("{{ {} }}", keys(one).join(", "))).collect();
    // Writing into a string cannot fail.
    let _ = writeln!(text, "[[script]]\n{}", keys(first).join("\n"));
    if !with.is_empty() {
        let _ = writeln!(text, "with = [{}]", with.join(", "));
    }
    text.push('\n');
}
