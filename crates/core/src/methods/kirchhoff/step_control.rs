//! How far the next part of a command goes.
//!
//! An equilibrium far from its prediction is none of this path: half the part. One much nearer is followed by twice as much. Where friction
//! that follows the wall's forces finds nothing near by, it is held, and the device slides to where it rests. Where parts
//! become shorter than a stated length the path has come to its end, a fold: the device moves, and comes to rest elsewhere.

use serde::{Deserialize, Serialize};

use super::substep::{Effort, Found};

/// Longest way of the hands in which the device moves from a fold, mm: how exactly the place of a fold is known.
pub(super) const FOLD_MM: f64 = 0.05;
/// Longest part in which friction is held for the first time, mm: longer ones mostly fail since they are too long.
pub(super) const HELD_MM: f64 = 0.5;
/// Shortest way of the hands in which it moves, mm.
const LEAST_MM: f64 = 1e-3;
/// An equilibrium nearer to its prediction than this part of what is far is followed by a part twice as long. Predictions of first order are
/// twice as far then, those of second order four times.
pub(super) const NEARER: f64 = 0.2;

/// How parts go, as the last ones went: what one command hands on to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Stride {
    /// Longest way of the hands in the next part, mm.
    pub(super) part_mm: f64,
    /// Whether friction is held in it.
    pub(super) held: bool,
}

/// What a command has come to.
#[derive(Debug)]
pub(super) struct StepControl {
    /// Newton iterations that are left.
    budget: usize,
    /// How the next part goes.
    stride: Stride,
    /// Whether there is friction that can be held.
    has_friction: bool,
    /// Longest way of the hands in the next part, mm, where the device moves in it.
    flight_mm: Option<f64>,
}

impl StepControl {
    /// With a budget of so many Newton iterations, where the command before went like this.
    pub(super) fn new(budget: usize, stride: Stride, has_friction: bool) -> Self {
        Self { budget, stride, has_friction, flight_mm: None }
    }

    /// The same, of what was set free and no hand moves: it goes to where it comes to rest at once.
    pub(super) fn set_free(self) -> Self {
        Self { flight_mm: Some(f64::INFINITY), ..self }
    }

    /// How the next command begins.
    pub(super) fn stride(&self) -> Stride {
        self.stride
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
            None => {
                let effort = if self.stride.held { Effort::Held } else { Effort::Near };
                (effort, rest_mm / (rest_mm / self.stride.part_mm).ceil().max(1.0))
            }
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
            None => {
                // What settles without sliding is found with friction that follows as well.
                self.stride.held &= found.slides > 0;
                if nearer {
                    self.stride.part_mm = self.stride.part_mm.max(2.0 * part_mm);
                }
            }
        }
    }

    /// A part of this length has come to nothing. Returns whether that is all.
    pub(super) fn failed(&mut self, part_mm: f64) -> bool {
        if self.flight_mm.is_some() {
            return true;
        }
        if self.has_friction && !self.stride.held && part_mm <= HELD_MM && self.budget > 0 {
            self.stride = Stride { part_mm, held: true };
        } else if part_mm <= FOLD_MM || self.budget == 0 {
            self.flight_mm = Some(part_mm.min(FOLD_MM));
            self.stride.held = false;
        } else {
            self.stride.part_mm = 0.5 * part_mm;
        }
        false
    }

    /// Whether a part of this length, in which the device has moved, can be shorter.
    pub(super) fn can_shorten(&self, part_mm: f64) -> bool {
        part_mm > LEAST_MM && self.budget > 0
    }

    /// Goes on with parts of half that length, and looks for an equilibrium near by again.
    pub(super) fn shorten(&mut self, part_mm: f64) {
        (self.stride.part_mm, self.flight_mm) = (0.5 * part_mm, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control(part_mm: f64) -> StepControl {
        StepControl::new(100, Stride { part_mm, held: false }, false)
    }

    fn found(off: f64) -> Found {
        Found {
            slides: 0,
            dissipated_mj: 0.0,
            borrowed_mj: 0.0,
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
        let mut control = control(10.0);
        assert_eq!(control.next(4.0), (Effort::Near, 4.0));
        assert!(!control.failed(4.0));
        assert_eq!(control.next(4.0), (Effort::Near, 2.0));
        control.succeeded(2.0, &found(0.5));
        assert_eq!(control.next(2.0), (Effort::Near, 2.0));
        control.succeeded(2.0, &found(0.01));
        // In equal parts.
        assert_eq!(control.next(6.0), (Effort::Near, 3.0));
        assert_eq!(control.stride().part_mm, 4.0);
    }

    #[test]
    fn friction_is_held_in_short_parts_until_the_device_need_not_slide() {
        let mut control = StepControl { has_friction: true, ..control(1.0) };
        assert!(!control.failed(1.0));
        assert_eq!(control.next(1.0), (Effort::Near, 0.5));
        assert!(!control.failed(0.5));
        assert_eq!(control.next(1.0), (Effort::Held, 0.5));
        control.succeeded(0.5, &Found { slides: 2, ..found(0.1) });
        assert_eq!(control.next(1.0), (Effort::Held, 1.0));
        control.succeeded(1.0, &found(0.5));
        assert_eq!(control.next(1.0), (Effort::Near, 1.0));
        // What it does not find either is a fold.
        assert!(!control.failed(FOLD_MM) && !control.failed(FOLD_MM));
        assert_eq!(control.next(1.0), (Effort::Flight, FOLD_MM));
    }

    #[test]
    fn at_a_fold_it_moves_once_and_goes_on_as_before() {
        let mut control = control(0.06);
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
        let mut control = control(1.0);
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
