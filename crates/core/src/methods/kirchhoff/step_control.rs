//! How far the next part of a command goes.
//!
//! An equilibrium far from its prediction is none of this path: half the part. One much nearer is followed by twice as much. Where parts
//! become shorter than a stated length the path has come to its end, a fold: the device moves, and comes to rest elsewhere.

use super::substep::{Effort, Found};

/// Longest way of the hands in which the device moves from a fold, mm: how exactly the place of a fold is known.
const FOLD_MM: f64 = 0.05;
/// An equilibrium nearer to its prediction than this part of what is far is followed by a part twice as long. Predictions of first order are
/// twice as far then, those of second order four times.
const NEARER: f64 = 0.125;

/// What a command has come to.
#[derive(Debug)]
pub(super) struct StepControl {
    /// Newton iterations that are left.
    budget: usize,
    /// Longest way of the hands in the next part, mm.
    part_mm: f64,
    /// The same where the device moves next.
    flight_mm: Option<f64>,
}

impl StepControl {
    /// With a budget of so many Newton iterations, where the command before has left parts of this length.
    pub(super) fn new(budget: usize, part_mm: f64) -> Self {
        Self { budget, part_mm, flight_mm: None }
    }

    /// Longest way of the hands in the next part, mm.
    pub(super) fn part_mm(&self) -> f64 {
        self.part_mm
    }

    /// Newton iterations that are left.
    pub(super) fn budget(&self) -> usize {
        self.budget
    }

    /// How the next part is gone, and how long it is where this `rest_mm` of the command is left.
    pub(super) fn next(&self, rest_mm: f64) -> (Effort, f64) {
        match self.flight_mm {
            Some(most_mm) => (Effort::Flight, rest_mm.min(most_mm)),
            None => (Effort::Near, rest_mm.min(self.part_mm)),
        }
    }

    /// A part took so many Newton iterations.
    pub(super) fn took(&mut self, iterations: usize) {
        self.budget = self.budget.saturating_sub(iterations);
    }

    /// A part of this length has come to an equilibrium, or to rest.
    pub(super) fn succeeded(&mut self, part_mm: f64, found: &Found) {
        let nearer = found.off < NEARER;
        match self.flight_mm {
            // A budget that is used up is that of a jam.
            Some(_) if self.budget == 0 => {
                self.flight_mm = Some(if nearer { 2.0 * part_mm } else { FOLD_MM });
            }
            Some(_) => self.flight_mm = None,
            None if nearer => self.part_mm = self.part_mm.max(2.0 * part_mm),
            None => self.part_mm = part_mm,
        }
    }

    /// A part of this length has come to nothing. Returns whether that is all.
    pub(super) fn failed(&mut self, part_mm: f64) -> bool {
        if self.flight_mm.is_some() {
            return true;
        }
        if part_mm <= FOLD_MM || self.budget == 0 {
            self.flight_mm = Some(FOLD_MM);
        } else {
            self.part_mm = 0.5 * part_mm;
        }
        false
    }
}
