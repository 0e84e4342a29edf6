//! How far the next attempt of a command goes, and how hard it tries.
//!
//! The whole command first, and a quarter where that finds nothing; what succeeds is followed by twice as much. Where attempts have gone
//! astray twice, the way is likely to end in a fold: parts of it only come nearer to that, and what is beyond is far away. It is looked
//! for once, over all that is left of the command and with patience. Where the budget is used up, or parts have become too small, the
//! device is let come to rest as it can: as far as the command goes, then in parts, and in the end whatever comes of it. That takes no more
//! than a dozen budgets: in a jam every part may find an equilibrium, and the next one as hardly.

use super::substep::{AT_REST, Effort};

/// The least part of a command that an attempt is for.
const LEAST_SHARE: f64 = 1e-4;
/// Attempts that go astray before one with patience.
const ASTRAY: usize = 2;
/// How often the last resort may find nothing in a command; after that what it comes to is taken whatever is left over.
const RESORTS: usize = 6;

/// What a command has tried.
#[derive(Debug)]
pub(super) struct StepControl {
    /// Newton iterations that are left.
    pub(super) budget: usize,
    /// Those that are left for last resorts.
    for_resorts: usize,
    /// Most of the command that the next attempt is for.
    share: f64,
    /// Attempts that went astray.
    astray: usize,
    /// Last resorts that found nothing.
    failures: usize,
}

impl StepControl {
    /// With a budget of so many Newton iterations, and so many for last resorts, after which what one comes to is taken whatever is left
    /// over.
    pub(super) fn new(budget: usize, for_resorts: usize) -> Self {
        Self { budget, for_resorts, share: 1.0, astray: 0, failures: 0 }
    }

    /// How hard the next attempt tries, and the part of the command that it is for where this `rest` of it is left: none where the device is
    /// at the end of its way, and is let go on.
    pub(super) fn next(&mut self, rest: f64) -> (Effort, f64) {
        let resort = self.budget == 0 || self.share < LEAST_SHARE;
        if !resort && self.astray == ASTRAY {
            return (Effort::Patient, rest);
        }
        if self.for_resorts == 0 {
            self.failures = self.failures.max(RESORTS);
        }
        // Where patience over all of it was in vain, the last resort begins with parts.
        if resort && (self.failures == RESORTS || (self.failures == 0 && self.astray <= ASTRAY)) {
            self.share = rest;
        }
        let effort = match self.failures {
            _ if !resort => Effort::Usual,
            _ if rest == 0.0 => Effort::Resort(f64::INFINITY),
            // What is out of balance is not taken before parts of the way were tried.
            0 => Effort::Resort(0.0),
            RESORTS => Effort::Resort(f64::INFINITY),
            _ => Effort::Resort(AT_REST),
        };
        (effort, rest.min(self.share))
    }

    /// An attempt has taken so many iterations.
    pub(super) fn took(&mut self, effort: Effort, iterations: usize) {
        if matches!(effort, Effort::Resort(_)) {
            self.for_resorts = self.for_resorts.saturating_sub(iterations);
        }
    }

    /// An attempt for this part has succeeded.
    pub(super) fn succeeded(&mut self, part: f64) {
        self.share = (2.0 * part).min(1.0);
    }

    /// An attempt for this part has come to nothing, and gone `astray` or not.
    pub(super) fn failed(&mut self, (effort, part): (Effort, f64), astray: bool) {
        let patient = effort == Effort::Patient;
        self.astray += usize::from(astray || patient);
        // Where patience was in vain, whatever the reason, it goes on as it would have without.
        if !patient {
            self.share = 0.25 * part;
        }
        if matches!(effort, Effort::Resort(_)) {
            self.budget = 0;
            self.failures += 1;
        }
    }

    /// Whether nothing is left to be tried.
    pub(super) fn are_over(&self) -> bool {
        self.failures > RESORTS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_astray_twice_is_tried_with_patience_once() {
        let mut control = StepControl::new(100, 100);
        assert_eq!(control.next(1.0), (Effort::Usual, 1.0));
        control.failed((Effort::Usual, 1.0), true);
        assert_eq!(control.next(1.0), (Effort::Usual, 0.25));
        control.succeeded(0.25);
        assert_eq!(control.next(0.75), (Effort::Usual, 0.5));
        control.failed((Effort::Usual, 0.5), true);
        assert_eq!(control.next(0.75), (Effort::Patient, 0.75));
        // What it came to may be no step of the command.
        control.failed((Effort::Patient, 0.75), false);
        assert_eq!(control.next(0.75), (Effort::Usual, 0.125));
    }

    #[test]
    fn what_is_no_step_of_the_command_asks_for_parts_alone() {
        let mut control = StepControl::new(100, 100);
        for part in [1.0, 0.25, 0.0625] {
            assert_eq!(control.next(1.0), (Effort::Usual, part));
            control.failed((Effort::Usual, part), false);
        }
    }

    #[test]
    fn the_last_resort_takes_what_is_out_of_balance_only_after_parts_and_all_of_it_in_the_end() {
        let mut control = StepControl::new(0, 100);
        assert_eq!(control.next(1.0), (Effort::Resort(0.0), 1.0));
        for part in [1.0, 0.25, 0.0625, 0.015625, 0.00390625, 0.0009765625] {
            let (effort, tried) = control.next(1.0);
            assert_eq!(tried, part);
            assert_eq!(effort, Effort::Resort(if part == 1.0 { 0.0 } else { AT_REST }));
            control.failed((effort, part), true);
        }
        assert_eq!(control.next(1.0), (Effort::Resort(f64::INFINITY), 1.0));
        control.failed((Effort::Resort(f64::INFINITY), 1.0), true);
        assert!(control.are_over());
    }

    #[test]
    fn last_resorts_come_to_an_end_that_is_taken_as_it_is() {
        let mut control = StepControl::new(0, 100);
        for (took, expected) in [(60, 0.0), (60, 0.0), (0, f64::INFINITY)] {
            let (effort, part) = control.next(1.0);
            assert_eq!((effort, part), (Effort::Resort(expected), 1.0));
            control.took(effort, took);
            control.succeeded(part);
        }
        let (effort, part) = control.next(1.0);
        control.failed((effort, part), false);
        assert!(control.are_over());
    }

    #[test]
    fn after_patience_in_vain_the_last_resort_begins_with_parts() {
        let mut control = StepControl::new(100, 100);
        for (effort, part) in [(Effort::Usual, 1.0), (Effort::Usual, 0.25), (Effort::Patient, 1.0)] {
            assert_eq!(control.next(1.0), (effort, part));
            control.failed((effort, part), true);
        }
        control.budget = 0;
        assert_eq!(control.next(1.0), (Effort::Resort(0.0), 0.0625));
    }
}
