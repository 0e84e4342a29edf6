//! Derivatives of what the wall does at the points that press on it, beside those in Newton's matrix.
//!
//! Newton's matrix holds the normal force N and the normal n of friction as they are at a base. Both follow from the place x of the
//! point, so friction F(x, θ; N, n), a force and a moment, has ∂F/∂N · ∂N/∂x + ∂F/∂n · ∂n/∂x more. It also depends on where its slip
//! begins: the angle there, the place a and the direction t̄. With the slip u = P (x − a) + r φ n × t̄, its force g(u) of Jacobian H in
//! the wall's plane, and X = r n ×,
//!
//! ```text
//! ∂g/∂φ = H X t̄,   ∂g/∂a = −H,   ∂g/∂t̄ = φ H X
//! ∂m/∂φ = X t̄ · H X t̄,   ∂m/∂a = −X t̄ · H,   ∂m/∂t̄ = φ X t̄ · H X + g · X
//! ```
//!
//! N and n are differenced in x: where the vessel is displaced the matrix lacks small terms of the curvature of the moved wall, which
//! the difference of its force gives.

use nalgebra::Matrix3;

use super::{Reading, WallContact};
use crate::Vec3;
use crate::contact::Distance;
use crate::contact::distance::Nearness;
use crate::contact::friction::Slider;
use crate::rod::{ElementData, RodState};

/// Step of differences, mm: rounding of places and curvature of the wall then cost as many digits.
const STEP_MM: f64 = 2e-5;

/// Derivatives of a force and a moment about the device in a vector.
pub(crate) type BySpace = (Matrix3<f64>, Vec3);

/// Derivatives at a point that presses on the wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PressingSlopes {
    /// Number of the point.
    pub(crate) index: usize,
    /// Of force and moment in its place, beyond those in Newton's matrix.
    pub(crate) lagging: BySpace,
    /// Of the normal force in its place.
    pub(crate) force_n: Vec3,
    /// Of friction in where its slip begins, if there is any.
    pub(crate) friction: Option<FrictionSlopes>,
}

/// Derivatives of friction, as a gradient of its energy, in where its slip begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrictionSlopes {
    /// In the angle by which the device has spun.
    pub(crate) by_spin: (Vec3, f64),
    /// In the place from which it slips.
    pub(crate) by_place: BySpace,
    /// In the direction that the device had there.
    pub(crate) by_direction: BySpace,
}

/// What presses at a place.
struct PressingAt {
    normal: Vec3,
    /// N of friction.
    rubs_n: f64,
    /// Gradient of the wall's energy, and its length.
    gradient: Vec3,
    force_n: f64,
}

impl WallContact<'_> {
    /// Derivatives at all points that press at the base, the state assembled last.
    pub(crate) fn slopes(&self, elements: &[ElementData], state: &RodState) -> Vec<PressingSlopes> {
        let pressing = (0..self.points.len()).filter(|index| self.cache.pressed(*index).is_some());
        pressing.filter_map(|index| self.slopes_at(index, elements, state)).collect()
    }

    fn slopes_at(&self, index: usize, elements: &[ElementData], state: &RodState) -> Option<PressingSlopes> {
        let point = &self.points[index];
        let x = point.position(elements, state);
        let by = |axis: usize, sign: f64| self.pressing_at(index, &(x + Vec3::ith(axis, sign * STEP_MM)));
        let mut sides = Vec::with_capacity(3);
        for axis in 0..3 {
            sides.push((by(axis, -1.0)?, by(axis, 1.0)?));
        }
        let column = |of: &dyn Fn(&PressingAt) -> Vec3| {
            let each = [0, 1, 2].map(|axis| (of(&sides[axis].1) - of(&sides[axis].0)) / (2.0 * STEP_MM));
            Matrix3::from_columns(&each)
        };
        let number = |of: &dyn Fn(&PressingAt) -> f64| {
            let each = [0, 1, 2].map(|axis| (of(&sides[axis].1) - of(&sides[axis].0)) / (2.0 * STEP_MM));
            Vec3::from(each)
        };
        let mut lagging: BySpace = (Matrix3::zeros(), Vec3::zeros());
        if self.surface.is_displaced() {
            let (d, pressed) = (self.cache.pressed(index)?, self.pressed(index)?);
            lagging.0 += column(&|at| at.gradient) - pressed.hessian(d, self.cache.points[index].force_n);
        }
        let angle = point.angle(state);
        let friction = self.friction.holding(index).and_then(|slider| {
            let f = self.friction.derivatives(index, &x, angle)?;
            let (force_slope, normals) = (number(&|at| at.rubs_n), column(&|at| at.normal));
            let share = 1.0 / slider.force_n;
            let (bent, turned) = self.friction.law.by_normal(slider, (&x, angle));
            lagging.0 += f.gradient * force_slope.transpose() * share + bent * normals;
            lagging.1 += force_slope * (f.turn * share) + normals.tr_mul(&turned);
            Some(slider_slopes(slider, &f.hessian, &f.gradient, angle))
        });
        Some(PressingSlopes { index, lagging, force_n: number(&|at| at.force_n), friction })
    }

    /// What presses at point `index` where it would be at `x`, near its base.
    fn pressing_at(&self, index: usize, x: &Vec3) -> Option<PressingAt> {
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        let material = self.surface.material_near(x, &known.base);
        let hint = self.cache.readings[index].hint;
        let limit_mm = self.followed_mm(point.potential.radius_mm);
        let nearness: Nearness = self.surface.nearness(&material, hint, limit_mm);
        let Reading::Pressed(d) = Reading::of(nearness, limit_mm) else { return None };
        let d: Distance = d;
        let stiffness = self.surface.stiffness(&material, known.base_piece);
        let (normal, presses_n) = point.pressed(&d, stiffness.factor);
        let gradient = stiffness.derivatives(&point.potential, &d, point.weight_mm).0;
        let rubs_n = presses_n * self.surface.rough(&material, known.base_piece);
        let force_n = if stiffness.slope.is_some() { gradient.norm() } else { presses_n };
        Some(PressingAt { normal, rubs_n, gradient, force_n })
    }
}

/// Derivatives of the friction of a slider with this force and its Jacobian.
fn slider_slopes(slider: &Slider, hessian: &Matrix3<f64>, force: &Vec3, angle: f64) -> FrictionSlopes {
    let turn = slider.normal.cross_matrix() * slider.radius_mm;
    let spin = turn * slider.along;
    let (mixed, spun_rad) = (hessian * spin, angle - slider.from_rad);
    FrictionSlopes {
        by_spin: (mixed, mixed.dot(&spin)),
        by_place: (-hessian, -mixed),
        by_direction: (hessian * turn * spun_rad, turn.tr_mul(&mixed) * spun_rad + turn.tr_mul(force)),
    }
}
