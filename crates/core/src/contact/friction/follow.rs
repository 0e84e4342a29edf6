//! Updating the normal forces of friction from the contact forces.
//!
//! Within a Newton step they are those of its base, so that friction has a potential. They are renewed at every base
//! until they match the contact forces and barely change, and again after an equilibrium at which they turn out to
//! differ.

use super::coulomb::Coulomb;
use super::slider::Slider;
use crate::Vec3;

/// Whether normal forces are renewed at the next base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Renewal {
    /// Renewed for the first time: whether they settle shows from the second base on.
    #[default]
    Begins,
    /// Renewed at every base.
    Follows,
    /// Renewed at every base, from the depths there: for derivatives.
    Depths,
    /// Not renewed, until an equilibrium shows that they differ from the contact forces.
    Settled,
    /// Not renewed.
    Held,
}

/// A sum of differences of forces, relative to a sum of forces.
struct Difference {
    change_n: f64,
    sum_n: f64,
}

impl Difference {
    fn new(least_n: f64) -> Self {
        Self { change_n: 0.0, sum_n: least_n }
    }

    /// Adds the difference of one force from another.
    #[inline]
    fn add(&mut self, from: (Vec3, f64), to: (Vec3, f64)) {
        self.change_n += (from.0 * from.1 - to.0 * to.1).norm();
        self.sum_n += to.1;
    }

    fn relative(&self) -> f64 {
        self.change_n / self.sum_n
    }
}

impl Coulomb {
    /// Renews the normal forces, unless they are settled or held, and records the contact forces at the base. Each
    /// contact comes with its normal, its force unknown, and the force of its depth, N. `least_n` is a negligible
    /// force.
    pub(in crate::contact) fn follow<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a mut Slider, Vec3, [f64; 2])>,
        least_n: f64,
    ) {
        let follows = !matches!(self.renewal, Renewal::Settled | Renewal::Held);
        let by_depth = self.renewal == Renewal::Depths;
        let (mut change, mut off) = (Difference::new(least_n), Difference::new(least_n));
        for (slider, normal, [force_n, presses_n]) in contacts {
            slider.seen = (normal, presses_n);
            let force_n = if by_depth { presses_n } else { force_n };
            if follows {
                // Most points are clear of the wall.
                if slider.force_n != 0.0 || force_n != 0.0 {
                    change.add((slider.normal, slider.force_n), (normal, force_n));
                }
                (slider.normal, slider.force_n) = (normal, force_n);
            }
            if slider.force_n != 0.0 || presses_n > 0.0 {
                off.add((slider.normal, slider.force_n), slider.seen);
            }
        }
        let settled = self.tuning.settled;
        let steady = change.change_n < settled * change.sum_n && off.relative() < settled;
        self.renewal = match self.renewal {
            Renewal::Begins => Renewal::Follows,
            Renewal::Follows if steady => Renewal::Settled,
            same => same,
        };
    }

    /// Whether normal forces at an equilibrium match the contact forces, or are held; otherwise they are renewed
    /// again.
    pub(in crate::contact) fn settles(&mut self, unsettled: f64) -> bool {
        if self.renewal == Renewal::Held || unsettled < self.tuning.settled {
            return true;
        }
        self.renewal = Renewal::Follows;
        false
    }

    /// Renews normal forces from the depths at each base.
    pub(in crate::contact) fn follow_depths(&mut self) {
        self.renewal = Renewal::Depths;
    }

    /// Stops renewing normal forces.
    pub(in crate::contact) fn hold(&mut self) {
        self.renewal = Renewal::Held;
    }

    /// Resumes renewing normal forces.
    pub(in crate::contact) fn release(&mut self) {
        self.renewal = Renewal::Begins;
    }
}

/// Relative difference of normal forces from the contact forces at the last base.
pub(in crate::contact) fn unsettled<'a>(sliders: impl Iterator<Item = &'a Slider>, least_n: f64) -> f64 {
    let mut off = Difference::new(least_n);
    for slider in sliders.filter(|slider| slider.force_n != 0.0 || slider.seen.1 > 0.0) {
        off.add((slider.normal, slider.force_n), slider.seen);
    }
    off.relative()
}
