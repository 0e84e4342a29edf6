//! How far the next part of a command goes.

use super::substep::Effort;

/// Longest way of the hands in which the device is let move where no equilibrium is near, mm.
const LEAST_MM: f64 = 0.05;
/// An equilibrium that is nearer to its prediction than this is followed by a part twice as long.
const NEARER: f64 = 0.125;

/// What a command has tried.
#[derive(Debug)]
pub(super) struct StepControl {
    /// Newton iterations that are left.
    pub(super) budget: usize,
    /// Longest way of the hands in the next part, mm.
    pub(super) part_mm: f64,
    flies: bool,
    flight_mm: f64,
}

impl StepControl {
    pub(super) fn new(budget: usize, part_mm: f64) -> Self {
        Self { budget, part_mm, flies: false, flight_mm: 0.0 }
    }

    /// How hard the next attempt tries, and how far it goes where this `rest` is left.
    pub(super) fn next(&mut self, rest_mm: f64) -> (Effort, f64) {
        if self.budget == 0 && !self.flies {
            (self.flies, self.flight_mm) = (true, LEAST_MM);
        }
        if self.flies {
            return (Effort::Resort(f64::INFINITY), rest_mm.min(self.flight_mm));
        }
        (Effort::Usual, rest_mm.min(self.part_mm))
    }

    /// An attempt for this part has succeeded.
    pub(super) fn succeeded(&mut self, part_mm: f64, off_prediction: f64) {
        let near = off_prediction < NEARER * super::substep::near_limit();
        if self.flies {
            self.flies = self.budget == 0;
            self.flight_mm = if near { 2.0 * part_mm } else { LEAST_MM };
            return;
        }
        self.part_mm = if near { self.part_mm.max(2.0 * part_mm) } else { part_mm };
    }

    /// An attempt for this part has come to nothing. Returns whether nothing is left to be tried.
    pub(super) fn failed(&mut self, part_mm: f64) -> bool {
        if self.flies {
            return true;
        }
        if part_mm <= LEAST_MM {
            (self.flies, self.flight_mm) = (true, LEAST_MM);
        } else {
            self.part_mm = 0.5 * part_mm;
        }
        false
    }
}
