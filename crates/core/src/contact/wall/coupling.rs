//! What the matrix of lagged normal forces leaves out, for wall and friction solved for together, and what a point feels.

use super::WallContact;
use crate::Vec3;
use crate::contact::ContactPoint;
use crate::contact::friction::Coupling;
use crate::rod::{ElementData, RodState};

impl WallContact<'_> {
    /// From now on the normal forces of friction follow the state at once.
    pub fn couple(&mut self) {
        self.friction.couple();
    }

    /// The normal forces of friction stay as they are.
    pub fn uncouple(&mut self) {
        self.friction.uncouple();
    }

    /// Normal forces of friction stay as they are.
    pub fn hold_friction(&mut self) {
        self.friction.hold();
    }

    /// Normal forces of friction may be renewed again.
    pub fn unsettle_friction(&mut self) {
        self.friction.unsettle();
    }

    /// Normal forces of friction are again those with which the step began, and are held.
    pub fn rewind_friction(&mut self) {
        self.friction.rewind();
    }

    /// Slip begins anew at `state`, the state assembled last, with the normal forces there.
    pub fn anchor_friction(&mut self, elements: &[ElementData], state: &RodState) {
        self.friction.anchor(elements, state, self.points);
    }

    /// Part by which the lagged normal forces differ from those of the state assembled last.
    pub fn unsettled(&self) -> f64 {
        self.friction.unsettled(self.least_force_n())
    }

    /// Tells the derivatives of friction at the base, `state`, that lagged normal forces leave out, point by point.
    pub fn couplings(&self, state: &RodState, mut to: impl FnMut(&ContactPoint, &Coupling)) {
        for (index, d) in self.cache.all_pressed() {
            let (point, known) = (&self.points[index], &self.cache.points[index]);
            let x = &self.surface.place(&known.base);
            let w = self.weight_mm(index);
            let rough = self.surface.rough(&known.base, known.triangle);
            let (size, n) = (d.gradient.norm(), d.gradient / d.gradient.norm());
            let second = point.potential.holding(d.value_mm).1;
            // The force is −w ψ′ |∇d|. Where moduli and coefficients of friction differ they are taken as even in a step.
            let bent = d.hessian * n / size;
            let force_rate = (n * (-w * second * size * size) + bent * known.force_n) * rough;
            let normal_rate = (d.hessian - n * (d.hessian * n).transpose()) / size;
            let (angle, radius_mm) = (point.angle(state), point.potential.radius_mm);
            let Some(more) = self.friction.coupling(index, x, angle, radius_mm, (&force_rate, &normal_rate))
            else {
                continue;
            };
            to(point, &more);
        }
    }

    /// What points press with at the state assembled last, held ones that pull included, goes to friction.
    pub(super) fn press_friction(&mut self) {
        let (surface, cache, softness) = (self.surface, &*self.cache, self.softness);
        let pressed = self.points.iter().enumerate().map(|(index, point)| {
            let d = cache.pressed(index)?;
            let known = &cache.points[index];
            let w = surface.stiffness(&known.base, known.triangle, softness).factor * point.weight_mm;
            let rough = surface.rough(&known.base, known.triangle);
            let size = d.gradient.norm();
            let force = -w * point.potential.holding(d.value_mm).0 * size;
            Some((d.gradient / size, force * rough, known.force_n * rough))
        });
        self.friction.take(pressed);
    }

    /// The forces that a step from the base leads to: `moved` tells how much of it moves a point along a direction.
    pub fn aim(&mut self, moved: impl Fn(&ContactPoint, &Vec3) -> f64) {
        self.cache.aims.clear();
        for (index, point) in self.points.iter().enumerate() {
            let force = self.cache.pressed(index).map_or(0.0, |d| {
                let (first, second) = point.potential.holding(d.value_mm);
                let along = moved(point, &d.gradient);
                -self.weight_mm(index) * (first + second * along) * d.gradient.norm()
            });
            self.cache.aims.push(force);
        }
    }

    /// Takes a part of the way to the forces aimed at: points that would pull are let go.
    pub fn take_aim(&mut self, fraction: f64) {
        for (known, aim) in self.cache.points.iter_mut().zip(&self.cache.aims).filter(|(k, _)| k.presses) {
            known.force_n += fraction * (aim - known.force_n);
            if known.force_n <= 0.0 {
                (known.force_n, known.presses) = (0.0, false);
            }
        }
    }

    /// What held points pull with, over what the others press with.
    pub fn pull(&self) -> f64 {
        let (mut pull, mut press) = (0.0, 0.0);
        for (index, d) in self.cache.all_pressed() {
            let (point, w) = (&self.points[index], self.weight_mm(index));
            let force = -w * point.potential.holding(d.value_mm).0;
            if force < 0.0 {
                pull -= force;
            } else {
                press += force;
            }
        }
        if pull > 0.0 { pull / (press + self.least_force_n()) } else { 0.0 }
    }
}
