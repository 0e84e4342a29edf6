//! The normal forces of friction follow those of contacts.
//!
//! In a step of Newton's method they are those of its base, so that friction has a potential. They are renewed at every base until they
//! are what presses there and hardly change, and after the equilibrium with them if they turn out not to be what presses in that.

use super::{Friction, NormalForce};
use crate::Vec3;

/// Normal forces are settled once they change, and differ from what presses, by less than this part.
pub const SETTLED: f64 = 1e-4;

/// Whether normal forces are renewed at the next base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::contact) enum Renewal {
    /// They are, for the first time: whether they settle shows from the second base on.
    #[default]
    Begins,
    /// They are.
    Follows,
    /// They are not, until an equilibrium shows that they are not what presses.
    Settled,
    /// They are not.
    Held,
}

impl Renewal {
    /// Whether they are renewed.
    pub(in crate::contact) fn follows(self) -> bool {
        matches!(self, Self::Begins | Self::Follows)
    }

    /// How it goes on from a base at which they were steady or not.
    pub(in crate::contact) fn after(self, steady: bool) -> Self {
        match self {
            Self::Begins => Self::Follows,
            Self::Follows if steady => Self::Settled,
            same => same,
        }
    }

    /// Whether an equilibrium at which they are what presses, or not, is one; otherwise they follow again.
    pub(in crate::contact) fn settles(&mut self, settled: bool) -> bool {
        if *self == Self::Held || settled {
            return true;
        }
        *self = Self::Follows;
        false
    }
}

impl Friction {
    /// Takes the forces of contacts as normal forces, unless they are settled or held, and looks at what presses at the base: the numbers of
    /// the points that are active, ascending, each with a normal, its force, and that with which it presses, N. `least_n` is a force not
    /// worth settling.
    pub fn follow(&mut self, active: impl Iterator<Item = (usize, (Vec3, [f64; 2]))>, least_n: f64) {
        let mut active = active.peekable();
        let follows = self.renewal.follows();
        let (mut change_n, mut sum_n) = (0.0, least_n);
        for (index, slider) in self.sliders.iter_mut().enumerate() {
            let (normal, [force_n, presses_n]) = active
                .next_if(|(point, _)| *point == index)
                .map_or((slider.normal, [0.0; 2]), |(_, now)| now);
            slider.seen = (normal, presses_n);
            if follows {
                change_n += (slider.normal * slider.force_n - normal * force_n).norm();
                sum_n += force_n;
                (slider.normal, slider.force_n) = (normal, force_n);
            }
        }
        let steady = change_n < SETTLED * sum_n && self.unsettled(least_n) < SETTLED;
        self.renewal = self.renewal.after(steady);
    }

    /// Whether normal forces at an equilibrium are what presses there, or are held; otherwise they follow again.
    pub fn settles(&mut self, least_n: f64) -> bool {
        let settled = self.unsettled(least_n) < SETTLED;
        self.renewal.settles(settled)
    }

    /// Part by which normal forces differ from what pressed at the last base.
    pub fn unsettled(&self, least_n: f64) -> f64 {
        let (mut change_n, mut sum_n) = (0.0, least_n);
        for slider in self.sliders.iter().filter(|slider| slider.force_n != 0.0 || slider.seen.1 > 0.0) {
            change_n += (slider.normal * slider.force_n - slider.seen.0 * slider.seen.1).norm();
            sum_n += slider.seen.1;
        }
        change_n / sum_n
    }

    /// Normal forces are renewed no more.
    pub fn hold(&mut self) {
        self.renewal = Renewal::Held;
    }

    /// Normal forces follow from here on.
    pub fn release(&mut self) {
        self.renewal = Renewal::Begins;
    }

    /// Normal forces are those that a solution has come to, one for each point, and follow from there.
    pub fn resume<'a>(&mut self, forces: impl IntoIterator<Item = &'a NormalForce>) {
        self.release();
        self.sliders.iter_mut().zip(forces).for_each(|(s, f)| (s.normal, s.force_n) = (f.normal, f.force_n));
    }

    /// Normal forces are again those with which the step began, and are held.
    pub fn rewind(&mut self) {
        self.hold();
        self.sliders.iter_mut().for_each(|s| (s.normal, s.force_n) = s.begun);
    }
}
