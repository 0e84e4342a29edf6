//! Updating the normal forces of friction from the contact forces.
//!
//! Within a Newton step they are those of its base, so that friction has a potential. They are renewed at every base
//! until they match the contact forces and hardly change, and again after an equilibrium at which they turn out to
//! differ.

use super::{Friction, NormalForce};
use crate::Vec3;

/// Normal forces are settled once their relative change, and their relative difference from the contact forces, is
/// below this.
pub const SETTLED: f64 = 1e-4;

/// Whether normal forces are renewed at the next base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::contact) enum Renewal {
    /// Renewed for the first time: whether they settle shows from the second base on.
    #[default]
    Begins,
    /// Renewed at every base.
    Follows,
    /// Not renewed, until an equilibrium shows that they differ from the contact forces.
    Settled,
    /// Not renewed.
    Held,
}

impl Renewal {
    /// Whether they are renewed.
    pub(in crate::contact) fn follows(self) -> bool {
        matches!(self, Self::Begins | Self::Follows)
    }

    /// The mode after a base at which they were steady or not.
    pub(in crate::contact) fn after(self, steady: bool) -> Self {
        match self {
            Self::Begins => Self::Follows,
            Self::Follows if steady => Self::Settled,
            same => same,
        }
    }

    /// Whether normal forces are valid at an equilibrium, given whether they match the contact forces; otherwise they
    /// are renewed again.
    pub(in crate::contact) fn settles(&mut self, settled: bool) -> bool {
        if *self == Self::Held || settled {
            return true;
        }
        *self = Self::Follows;
        false
    }
}

impl Friction {
    /// Renews the normal forces, unless they are settled or held, and records the contact forces at the base.
    /// `active` gives the ascending indices of the active points, each with its normal, its force unknown, and the
    /// force of its depth, N. `least_n` is a negligible force.
    pub(crate) fn follow(&mut self, active: impl Iterator<Item = (usize, (Vec3, [f64; 2]))>, least_n: f64) {
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

    /// Whether normal forces at an equilibrium match the contact forces, or are held; otherwise they are renewed
    /// again.
    pub(crate) fn settles(&mut self, least_n: f64) -> bool {
        let settled = self.unsettled(least_n) < SETTLED;
        self.renewal.settles(settled)
    }

    /// Relative difference of normal forces from the contact forces at the last base.
    pub(crate) fn unsettled(&self, least_n: f64) -> f64 {
        let (mut change_n, mut sum_n) = (0.0, least_n);
        for slider in self.sliders.iter().filter(|slider| slider.force_n != 0.0 || slider.seen.1 > 0.0) {
            change_n += (slider.normal * slider.force_n - slider.seen.0 * slider.seen.1).norm();
            sum_n += slider.seen.1;
        }
        change_n / sum_n
    }

    /// Stops renewing normal forces.
    pub(crate) fn hold(&mut self) {
        self.renewal = Renewal::Held;
    }

    /// Resumes renewing normal forces.
    pub fn release(&mut self) {
        self.renewal = Renewal::Begins;
    }

    /// Sets the normal forces to those of a solution, one per point, and renews them from there.
    pub fn resume<'a>(&mut self, forces: impl IntoIterator<Item = &'a NormalForce>) {
        self.release();
        self.sliders.iter_mut().zip(forces).for_each(|(s, f)| (s.normal, s.force_n) = (f.normal, f.force_n));
    }

    /// Resets and holds the normal forces of the start of the step.
    pub(crate) fn rewind(&mut self) {
        self.hold();
        self.sliders.iter_mut().for_each(|s| (s.normal, s.force_n) = s.begun);
    }
}
