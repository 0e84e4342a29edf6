//! The model of a step: gaps to first order, and springs where they close; the counterpart of `wall/model.rs`.

use super::curve::Curve;
use super::{Pair, SelfContact};
use crate::Vec3;
use crate::contact::point::FOLLOW;
use crate::rod::{ElementData, RodState, Stencils};
use crate::solve::Moved;

impl Pair {
    /// Change of its gap in a step, to first order, mm.
    pub(super) fn change(&self, moved: &Moved<'_>) -> f64 {
        if !self.foreseen {
            return 0.0;
        }
        self.gap.direction().dot(&self.way(moved))
    }

    /// Relative displacement of its points in a step, mm.
    pub(super) fn way(&self, moved: &Moved<'_>) -> Vec3 {
        let [a, b] = self.gap.at.map(|place| moved((place.element, place.xi, 0)).0);
        a - b
    }

    /// Force of its spring in the system after a step with this change of its gap, N.
    pub(super) fn linear_n(&self, change_mm: f64) -> f64 {
        if self.presses { self.spring_n_per_mm * (change_mm - self.depth_mm()) } else { 0.0 }
    }

    /// Slope of the model at a fraction of the way to the other step.
    pub(super) fn slope_towards(&self, part: f64) -> f64 {
        let way = self.end_mm - self.change_mm;
        let there = self.change_mm - self.depth_mm() + part * way;
        let carried = self.carried_n + part * (self.linear_n(self.end_mm) - self.carried_n);
        (self.spring_n_per_mm * there.min(0.0) - carried) * way
    }
}

impl SelfContact {
    /// See [`Contacts::foresee`](crate::solve::Contacts::foresee).
    pub(super) fn foresee_pairs(&mut self, moved: &Moved<'_>) {
        for pair in &mut self.pairs {
            pair.foreseen = pair.at_base || -pair.depth_mm() < 0.5 * FOLLOW * pair.touch_mm;
            pair.change_mm = pair.change(moved);
            pair.carried_n = pair.linear_n(pair.change_mm);
        }
    }

    /// See [`Contacts::press_or_let_go`](crate::solve::Contacts::press_or_let_go).
    pub(super) fn press_or_let_go_pairs(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize {
        let curve = Curve { elements, state: base, skins: &self.skins, closed: self.closed };
        let mut changed = 0;
        for pair in self.pairs.iter_mut().filter(|pair| pair.foreseen) {
            pair.change_mm = pair.change(moved);
            let presses = pair.change_mm < pair.depth_mm();
            if presses != pair.presses {
                (pair.presses, changed) = (presses, changed + 1);
                let spring = if presses { pair.spring_n_per_mm } else { -pair.spring_n_per_mm };
                // A plane: the gap has no curvature, and no force acts on the rotation of tangents.
                into.add_couple(elements, base, &pair.couple(&curve, -spring * pair.depth_mm(), 0.0, spring));
            }
        }
        changed
    }
}
