//! Friction of the device on the wall: its normal forces, and its contribution at a point.

use super::WallContact;
use crate::contact::ROUNDING;
use crate::contact::set::Geometry;
use crate::rod::{ElementData, PointSum, RodState, Stencils};

impl WallContact<'_> {
    /// Whether there is friction.
    pub(crate) fn has_friction(&self) -> bool {
        self.friction.acts()
    }

    /// Renews the normal forces of friction from the contact forces at the base, unless held.
    pub(super) fn follow_contacts(&mut self) {
        if !self.friction.acts() {
            return;
        }
        let least_n = self.least_force_n();
        let pressed = self.cache.set.at_base().filter_map(|contact| {
            let index = contact.key;
            let d = self.cache.pressed(index)?;
            let known = &self.cache.points[index];
            let factor = self.surface.stiffness(&known.base, known.base_piece).factor;
            let rough = self.surface.rough(&known.base, known.base_piece);
            let (normal, presses_n) = self.points[index].pressed(d, factor);
            Some((
                index,
                (normal, [known.force_n * d.gradient.norm(), presses_n].map(|force_n| force_n * rough)),
            ))
        });
        self.friction.follow(pressed, least_n);
    }

    /// From now on the normal forces of friction are those of the depths at each base.
    pub(crate) fn follow_depths(&mut self) {
        self.friction.law.follow_depths();
    }

    /// Holds the normal forces of friction.
    pub(crate) fn hold_friction(&mut self) {
        self.friction.law.hold();
    }

    /// Drops what has no potential: friction and drag.
    pub(crate) fn let_slip(&mut self) {
        self.friction.law.coefficient = 0.0;
        self.friction.between.clear();
        self.drag = None;
    }

    /// Normal forces of friction follow the contact forces again.
    pub(crate) fn release_friction(&mut self) {
        self.friction.release();
    }

    /// Resets and holds the normal forces of the start of the step.
    pub(crate) fn rewind_friction(&mut self) {
        self.friction.rewind();
    }

    /// Resets slip at `state`, the state assembled last, and holds the normal forces there.
    pub(crate) fn anchor_friction(&mut self, elements: &[ElementData], state: &RodState) {
        self.friction.anchor(elements, state, self.points);
    }

    /// Relative difference of the normal forces of friction from those of the state assembled last.
    pub(crate) fn unsettled(&self) -> f64 {
        self.friction_off()
    }

    /// Adds friction of point `index` at its base.
    pub(super) fn add_friction(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        into: &mut dyn Stencils,
        sum: &mut PointSum,
        index: usize,
    ) {
        if self.friction.holding(index).is_none() {
            return;
        }
        let (point, x) = (&self.points[index], &self.base_place(index));
        let angle = point.angle(state);
        let Some(f) = self.friction.derivatives(index, x, angle) else { return };
        into.add_value(self.friction.value(index, x, angle));
        self.rounding_n = self.rounding_n.max(ROUNDING * f64::EPSILON * f.hessian.norm() * x.amax());
        let e = point.element;
        sum.add(point.xi, &f.gradient, into.wants_hessian().then_some(&f.hessian));
        into.add_spin(state, &elements[e], (e, point.xi, point.set), &f.mixed, (f.turn, f.turn2));
    }

    /// Energy dissipated by friction at point `index` on its way to a state, mJ.
    pub(super) fn friction_mj(&self, elements: &[ElementData], state: &RodState, index: usize) -> f64 {
        if self.friction.holding(index).is_none() {
            return 0.0;
        }
        let point = &self.points[index];
        let x = point.position(elements, state);
        self.friction.value(index, &x, point.angle(state))
    }
}
