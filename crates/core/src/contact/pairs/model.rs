//! The model of a step: gaps to first order, and springs where they close; the counterpart of `wall/model.rs`.

use nalgebra::Matrix3;

use super::{Pair, SelfContact};
use crate::Vec3;
use crate::contact::point::FOLLOW;
use crate::rod::{ElementData, Link, RodState, Stencils};
use crate::solve::Moved;

/// Changes of what points of each element depend on, in a step: x₀, h t₀, x₁ and h t₁, mm.
pub(super) type Ways = [[Vec3; 4]];

impl Pair {
    /// Change of its gap in a step, to first order, mm.
    pub(super) fn change(&self, ways: &Ways) -> f64 {
        if self.foreseen { self.gap.direction().dot(&self.way(ways)) } else { 0.0 }
    }

    /// Relative displacement of its points in a step, mm.
    pub(super) fn way(&self, ways: &Ways) -> Vec3 {
        let [a, b] = self.gap.at.map(|place| &ways[place.element]);
        let each = self.weights.iter().zip(a.iter().chain(b));
        each.fold(Vec3::zeros(), |sum, (weight, way)| sum + way * *weight)
    }

    /// A spring in the difference of its points.
    pub(super) fn link(&self, gradient: Vec3, hessian: Matrix3<f64>) -> Link {
        Link { elements: self.gap.at.map(|place| place.element), weights: self.weights, gradient, hessian }
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
    /// Stores the motion of a step.
    pub(super) fn follow(&mut self, moved: &dyn Moved) {
        self.ways.clear();
        self.ways.extend((0..self.skins.len()).map(|e| moved.element(e)));
    }

    /// See [`Contacts::foresee`](crate::solve::Contacts::foresee).
    pub(super) fn foresee_pairs(&mut self) {
        for pair in &mut self.pairs {
            pair.foreseen = pair.at_base || -pair.depth_mm() < 0.5 * FOLLOW * pair.touch_mm;
            pair.change_mm = pair.change(&self.ways);
            pair.carried_n = pair.linear_n(pair.change_mm);
        }
    }

    /// See [`Contacts::press_or_let_go`](crate::solve::Contacts::press_or_let_go).
    pub(super) fn press_or_let_go_pairs(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) -> usize {
        let mut changed = 0;
        for pair in self.pairs.iter_mut().filter(|pair| pair.foreseen) {
            let presses = pair.change_mm < pair.depth_mm();
            if presses != pair.presses {
                (pair.presses, changed) = (presses, changed + 1);
                let spring = if presses { pair.spring_n_per_mm } else { -pair.spring_n_per_mm };
                // A plane: the gap has no curvature, and no force acts on the rotation of tangents.
                let along = pair.gap.direction();
                let plane = spring * along;
                into.add_link(
                    elements,
                    base,
                    &pair.link(-plane * pair.depth_mm(), plane * along.transpose()),
                );
            }
        }
        changed
    }
}
