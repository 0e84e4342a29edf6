//! Step size control: the length of the next part of a command.
//!
//! An equilibrium far from its prediction may not be on this path: the part is halved. After one much nearer, the
//! next part is doubled. If friction that follows the contact forces finds nothing nearby, it is held, and the device
//! slides to rest. When parts become shorter than a given length the path has ended, at a fold: the device moves, and
//! comes to rest elsewhere.

use serde::{Deserialize, Serialize};

use super::part::{Effort, Found, Lost};
use crate::tuning::StepTuning;

/// Step size passed from one command to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Stride {
    /// Largest motion of the hands in the next part, mm.
    pub(super) part_mm: f64,
    /// Whether friction is held in it.
    pub(super) held: bool,
}

/// Step size control within a command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct StepControl {
    /// Newton iterations left.
    budget: usize,
    /// Step size of the next part.
    stride: Stride,
    /// Whether there is friction that can be held.
    has_friction: bool,
    /// Largest motion of the hands in the next part, mm, if the device relaxes in it.
    flight_mm: Option<f64>,
    /// How often a device that rests at the end of its command, but not in equilibrium, goes on from there.
    again: usize,
}

impl StepControl {
    /// With a budget of Newton iterations, and the step size of the command before.
    pub(super) fn new(budget: usize, stride: Stride, has_friction: bool, again: usize) -> Self {
        Self { budget, stride, has_friction, flight_mm: None, again }
    }

    /// The same with more Newton iterations, up to `most`, for more motion.
    pub(super) fn more(self, iterations: usize, most: usize) -> Self {
        Self { budget: self.budget.saturating_add(iterations).min(most), ..self }
    }

    /// For something that was released without hand motion: relaxes at once.
    pub(super) fn set_free(self) -> Self {
        Self { flight_mm: Some(f64::MAX), ..self }
    }

    /// Step size for the next command.
    pub(super) fn stride(&self) -> Stride {
        self.stride
    }

    /// Largest motion of the hands in the next part, mm, if the device relaxes in it.
    pub(super) fn flight_mm(&self) -> Option<f64> {
        self.flight_mm
    }

    /// Goes on from where the device rests at the end of the command.
    pub(super) fn try_again(&mut self) {
        self.again = self.again.saturating_sub(1);
    }

    /// How often it may still do so.
    pub(super) fn again(&self) -> usize {
        self.again
    }

    /// Newton iterations left.
    pub(super) fn budget(&self) -> usize {
        self.budget
    }

    /// Effort and length of the next part, given the remaining `rest_mm` of the command.
    pub(super) fn next(&self, rest_mm: f64) -> (Effort, f64) {
        match self.flight_mm {
            Some(most_mm) => (Effort::Flight, rest_mm.min(most_mm)),
            // Equal parts, so that no small remainder is left.
            None => {
                let effort = if self.stride.held { Effort::Held } else { Effort::Near };
                // A remainder at the level of rounding makes no further part.
                let parts = (rest_mm / self.stride.part_mm * (1.0 - 1e-9)).ceil().max(1.0);
                (effort, rest_mm / parts)
            }
        }
    }

    /// Subtracts the Newton iterations of a part.
    pub(super) fn took(&mut self, iterations: usize) {
        self.budget = self.budget.saturating_sub(iterations);
    }

    /// A part of this length reached an equilibrium, or came to rest.
    pub(super) fn succeeded(&mut self, part_mm: f64, found: &Found, tuning: &StepTuning) {
        let nearer = found.off < tuning.nearer;
        match self.flight_mm {
            // The budget is used up in a jam.
            Some(_) if self.budget == 0 => {
                self.flight_mm = Some(if nearer { 2.0 * part_mm } else { tuning.fold_mm });
            }
            Some(_) => self.flight_mm = None,
            None => {
                // If friction settles without slides, a part with friction that follows would succeed as well.
                self.stride.held &= found.slides > 0;
                if nearer {
                    self.stride.part_mm = self.stride.part_mm.max(2.0 * part_mm);
                }
            }
        }
    }

    /// A part of this length failed. Returns whether there is nothing else to try.
    pub(super) fn failed(&mut self, part_mm: f64, lost: Lost, tuning: &StepTuning) -> bool {
        if self.flight_mm.is_some() {
            // A tip that would be pushed through a loop goes less far in a shorter part.
            self.flight_mm = Some(0.5 * part_mm);
            return lost != Lost::Beyond || part_mm <= tuning.least_mm;
        }
        if self.has_friction && !self.stride.held && part_mm <= tuning.held_mm && self.budget > 0 {
            self.stride = Stride { part_mm, held: true };
        } else if part_mm <= tuning.fold_mm || self.budget == 0 {
            self.flight_mm = Some(part_mm.min(tuning.fold_mm));
            self.stride.held = false;
        } else {
            self.stride.part_mm = 0.5 * part_mm;
        }
        false
    }

    /// Whether a part of this length, in which the device relaxed, can be shortened.
    pub(super) fn can_shorten(&self, part_mm: f64, tuning: &StepTuning) -> bool {
        part_mm > tuning.least_mm && self.budget > 0
    }

    /// Continues with parts of half that length, seeking a nearby equilibrium again.
    pub(super) fn shorten(&mut self, part_mm: f64) {
        (self.stride.part_mm, self.flight_mm) = (0.5 * part_mm, None);
    }
}

#[cfg(test)]
mod tests {
    use super::super::balance::Balance;
    use super::*;

    const FAR: Lost = Lost::Unbalanced;
    const T: StepTuning = StepTuning::DEFAULT;
    const FOLD_MM: f64 = T.fold_mm;
    const LEAST_MM: f64 = T.least_mm;

    fn control(part_mm: f64) -> StepControl {
        StepControl::new(100, Stride { part_mm, held: false }, false, T.again)
    }

    fn found(off: f64) -> Found {
        Found {
            slides: 0,
            outside_mj: 0.0,
            residual: 0.0,
            unsettled: 0.0,
            balanced: true,
            is_interrupted: false,
            lacks: false,
            off,
            farthest_mm: crate::Vec3::zeros(),
            balance: Balance::default(),
        }
    }

    #[test]
    fn parts_are_halved_where_equilibria_are_far_and_doubled_where_near() {
        let mut control = control(10.0);
        assert_eq!(control.next(4.0), (Effort::Near, 4.0));
        assert!(!control.failed(4.0, FAR, &T));
        assert_eq!(control.next(4.0), (Effort::Near, 2.0));
        control.succeeded(2.0, &found(0.5), &T);
        assert_eq!(control.next(2.0), (Effort::Near, 2.0));
        control.succeeded(2.0, &found(0.01), &T);
        // In equal parts.
        assert_eq!(control.next(6.0), (Effort::Near, 3.0));
        assert_eq!(control.stride().part_mm, 4.0);
    }

    #[test]
    fn friction_is_held_in_short_parts_until_the_device_need_not_slide() {
        let mut control = StepControl { has_friction: true, ..control(1.0) };
        assert!(!control.failed(1.0, FAR, &T));
        assert_eq!(control.next(1.0), (Effort::Near, 0.5));
        assert!(!control.failed(0.5, FAR, &T));
        assert_eq!(control.next(1.0), (Effort::Held, 0.5));
        control.succeeded(0.5, &Found { slides: 2, ..found(0.1) }, &T);
        assert_eq!(control.next(1.0), (Effort::Held, 1.0));
        control.succeeded(1.0, &found(0.5), &T);
        assert_eq!(control.next(1.0), (Effort::Near, 1.0));
        // If that fails too, it is a fold.
        assert!(!control.failed(FOLD_MM, FAR, &T) && !control.failed(FOLD_MM, FAR, &T));
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
    }

    #[test]
    fn at_a_fold_it_moves_once_and_goes_on_as_before() {
        let mut control = control(0.06);
        assert!(!control.failed(0.06, FAR, &T));
        assert_eq!(control.next(1.0).0, Effort::Near);
        assert!(!control.failed(0.03, FAR, &T));
        assert_eq!(control.next(1.0), (Effort::Flight, 0.03));
        // With energy that nobody put in the part is shortened.
        assert!(control.can_shorten(0.03, &T) && !control.can_shorten(LEAST_MM, &T));
        control.shorten(0.03);
        assert!(matches!(control.next(1.0), (Effort::Near, part_mm) if part_mm <= 0.015));
        assert!(!control.failed(0.015, FAR, &T));
        control.succeeded(0.015, &found(7.0), &T);
        assert_eq!(control.next(1.0).0, Effort::Near);
    }

    #[test]
    fn in_a_jam_it_moves_on_and_what_does_not_come_to_rest_is_the_end() {
        let mut control = control(1.0);
        control.took(200);
        assert!(!control.failed(1.0, FAR, &T));
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
        control.succeeded(FOLD_MM, &found(0.01), &T);
        assert_eq!(control.next(1.0), (Effort::Flight, 2.0 * FOLD_MM));
        control.succeeded(2.0 * FOLD_MM, &found(0.9), &T);
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
        assert!(control.failed(FOLD_MM, FAR, &T));
    }

    #[test]
    fn a_tip_that_would_pass_a_loop_moves_less_and_less() {
        let mut control = control(FOLD_MM);
        assert!(!control.failed(FOLD_MM, Lost::Beyond, &T));
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
        assert!(!control.failed(FOLD_MM, Lost::Beyond, &T));
        assert_eq!(control.next(1.0), (Effort::Flight, 0.5 * FOLD_MM));
        assert!(control.failed(LEAST_MM, Lost::Beyond, &T));
    }
}
