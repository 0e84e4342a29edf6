//! How far the next part of a command goes.
//!
//! An equilibrium far from its prediction is none of this path: half the part. One much nearer is followed by twice as much. Where parts
//! become shorter than a stated length the path has come to its end, a fold: the device moves, and comes to rest elsewhere.

use super::substep::{Effort, Found};

/// Longest way of the hands in which the device moves from a fold, mm: how exactly the place of a fold is known.
const FOLD_MM: f64 = 0.05;
/// Shortest way of the hands in which it moves, mm.
const LEAST_MM: f64 = 1e-3;
/// An equilibrium nearer to its prediction than this part of what is far is followed by a part twice as long. Predictions of first order are
/// twice as far then, those of second order four times.
const NEARER: f64 = 0.2;

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
            // In equal parts, so that none is a small rest.
            None => (Effort::Near, rest_mm / (rest_mm / self.part_mm).ceil().max(1.0)),
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
            None => {}
        }
    }

    /// A part of this length has come to nothing. Returns whether that is all.
    pub(super) fn failed(&mut self, part_mm: f64) -> bool {
        if self.flight_mm.is_some() {
            return true;
        }
        if part_mm <= FOLD_MM || self.budget == 0 {
            self.flight_mm = Some(part_mm.min(FOLD_MM));
        } else {
            self.part_mm = 0.5 * part_mm;
        }
        false
    }

    /// Whether a part of this length, in which the device has moved, can be shorter.
    pub(super) fn can_shorten(&self, part_mm: f64) -> bool {
        part_mm > LEAST_MM && self.budget > 0
    }

    /// Goes on with parts of half that length, and looks for an equilibrium near by again.
    pub(super) fn shorten(&mut self, part_mm: f64) {
        (self.part_mm, self.flight_mm) = (0.5 * part_mm, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(off: f64) -> Found {
        Found {
            slides: 0,
            dissipated_mj: 0.0,
            residual: 0.0,
            unsettled: 0.0,
            balanced: true,
            lacks: false,
            off,
            jump: None,
        }
    }

    #[test]
    fn what_is_far_is_halved_and_what_is_much_nearer_doubled() {
        let mut control = StepControl::new(100, 10.0);
        assert_eq!(control.next(4.0), (Effort::Near, 4.0));
        assert!(!control.failed(4.0));
        assert_eq!(control.next(4.0), (Effort::Near, 2.0));
        control.succeeded(2.0, &found(0.5));
        assert_eq!(control.next(2.0), (Effort::Near, 2.0));
        control.succeeded(2.0, &found(0.01));
        // In equal parts.
        assert_eq!(control.next(6.0), (Effort::Near, 3.0));
        assert_eq!(control.part_mm(), 4.0);
    }

    #[test]
    fn at_a_fold_it_moves_once_and_goes_on_as_before() {
        let mut control = StepControl::new(100, 0.06);
        assert!(!control.failed(0.06));
        assert_eq!(control.next(1.0).0, Effort::Near);
        assert!(!control.failed(0.03));
        assert_eq!(control.next(1.0), (Effort::Flight, 0.03));
        // With energy that nobody put in it goes less far.
        assert!(control.can_shorten(0.03) && !control.can_shorten(LEAST_MM));
        control.shorten(0.03);
        assert!(matches!(control.next(1.0), (Effort::Near, part_mm) if part_mm <= 0.015));
        assert!(!control.failed(0.015));
        control.succeeded(0.015, &found(7.0));
        assert_eq!(control.next(1.0).0, Effort::Near);
    }

    #[test]
    fn in_a_jam_it_moves_on_and_what_does_not_come_to_rest_is_the_end() {
        let mut control = StepControl::new(100, 1.0);
        control.took(200);
        assert!(!control.failed(1.0));
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
        control.succeeded(FOLD_MM, &found(0.01));
        assert_eq!(control.next(1.0), (Effort::Flight, 2.0 * FOLD_MM));
        control.succeeded(2.0 * FOLD_MM, &found(0.9));
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
        assert!(control.failed(FOLD_MM));
    }
}
