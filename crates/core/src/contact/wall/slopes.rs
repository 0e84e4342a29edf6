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
//! On an even wall at rest, with the distance d, its gradient g and Hessian G,
//!
//! ```text
//! N = w k (r − d)|g|,   ∂N/∂x = w k ((r − d) G n − |g| g),   ∂n/∂x = (1 − n nᵀ) G/|g|
//! ```
//!
//! Where the wall has regions or is displaced they are differenced in x: there the matrix lacks small terms of the curvature of the moved
//! wall, which the difference of its force gives.

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
    /// Of force and moment in its place, with all that follows from it.
    pub(crate) by_place: BySpace,
    /// What acts there.
    pub(crate) acts: PointForces,
}

/// What acts at a point that presses on the wall.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointForces {
    /// Gradient of the wall's energy.
    pub(crate) wall: Vec3,
    /// That of friction, and its moment about the device.
    pub(crate) friction: (Vec3, f64),
    /// The normal force, N.
    pub(crate) force_n: f64,
    /// The wall's energy, mJ.
    pub(crate) energy_mj: f64,
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
    /// In the slip within which it sticks.
    pub(crate) by_stick: (Vec3, f64),
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

/// Derivatives of what presses in the place.
struct PressingBy {
    normal: Matrix3<f64>,
    rubs_n: Vec3,
    gradient: Matrix3<f64>,
    force_n: Vec3,
}

impl WallContact<'_> {
    /// Derivatives at all points that press at the base, the state assembled last.
    pub(crate) fn slopes(&self, elements: &[ElementData], state: &RodState) -> Vec<PressingSlopes> {
        let pressing = (0..self.points.len()).filter(|index| self.cache.pressed(*index).is_some());
        pressing.filter_map(|index| self.slopes_at(index, elements, state)).collect()
    }

    fn slopes_at(&self, index: usize, elements: &[ElementData], state: &RodState) -> Option<PressingSlopes> {
        let point = &self.points[index];
        let (x, angle) = (point.position(elements, state), point.angle(state));
        let (d, pressed) = (self.cache.pressed(index)?, self.pressed(index)?);
        let PressingBy { normal, rubs_n, gradient, force_n } = match self.is_even() {
            true => self.even_by_place(index, d),
            false => self.pressing_by(index, &x)?,
        };
        let mut lagging: BySpace = (Matrix3::zeros(), Vec3::zeros());
        if self.surface.is_displaced() {
            lagging.0 += gradient - pressed.hessian(d, self.cache.points[index].force_n);
        }
        let mut by_place: BySpace = (gradient, Vec3::zeros());
        let mut rubs = (Vec3::zeros(), 0.0);
        let friction = self.friction.holding(index).and_then(|slider| {
            let f = self.friction.derivatives(index, &x, angle)?;
            let share = 1.0 / slider.force_n;
            let (bent, turned) = self.friction.law.by_normal(slider, (&x, angle));
            let force = f.gradient * rubs_n.transpose() * share + bent * normal;
            let moment = rubs_n * (f.turn * share) + normal.tr_mul(&turned);
            (lagging.0, lagging.1) = (lagging.0 + force, lagging.1 + moment);
            (by_place.0, by_place.1) = (by_place.0 + f.hessian + force, f.mixed + moment);
            rubs = (f.gradient, f.turn);
            let by_stick = self.friction.law.by_stick(slider, (&x, angle));
            Some(slider_slopes(slider, (&f.hessian, &f.gradient), by_stick, angle))
        });
        let at = self.pressing_at(index, d);
        let acts = PointForces {
            wall: pressed.gradient,
            friction: rubs,
            force_n: at.force_n,
            energy_mj: pressed.stored_mj,
        };
        Some(PressingSlopes { index, lagging, force_n, friction, by_place, acts })
    }

    /// Whether the wall is the same everywhere, and where it was.
    fn is_even(&self) -> bool {
        !self.surface.is_displaced() && self.surface.is_uniform()
    }

    /// Derivatives on an even wall.
    fn even_by_place(&self, index: usize, d: &Distance) -> PressingBy {
        let point = &self.points[index];
        let (first, second) = point.potential.derivatives(d.value_mm);
        let (g, size) = (d.gradient, d.gradient.norm());
        let normal = g / size;
        let force_n = -(g * (second * size) + d.hessian * normal * first) * point.weight_mm;
        PressingBy {
            normal: (Matrix3::identity() - normal * normal.transpose()) * d.hessian / size,
            rubs_n: force_n,
            gradient: (g * g.transpose() * second + d.hessian * first) * point.weight_mm,
            force_n,
        }
    }

    /// Derivatives by differences; none at the edge of what is known.
    fn pressing_by(&self, index: usize, x: &Vec3) -> Option<PressingBy> {
        let by = |axis: usize, sign: f64| self.pressing_near(index, &(x + Vec3::ith(axis, sign * STEP_MM)));
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
        Some(PressingBy {
            normal: column(&|at| at.normal),
            rubs_n: number(&|at| at.rubs_n),
            gradient: column(&|at| at.gradient),
            force_n: number(&|at| at.force_n),
        })
    }

    /// What presses at point `index` where it would be at `x`, near its base.
    fn pressing_near(&self, index: usize, x: &Vec3) -> Option<PressingAt> {
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        let material = self.surface.material_near(x, &known.base);
        let hint = self.cache.readings[index].hint;
        let limit_mm = self.followed_mm(point.potential.radius_mm);
        let nearness: Nearness = self.surface.nearness(&material, hint, limit_mm);
        let Reading::Pressed(d) = Reading::of(nearness, limit_mm) else { return None };
        Some(self.pressing(index, &material, &d))
    }

    /// What presses at point `index` at its base, at this distance.
    fn pressing_at(&self, index: usize, d: &Distance) -> PressingAt {
        self.pressing(index, &self.cache.points[index].base, d)
    }

    /// What presses at point `index` where the vessel's material is so.
    fn pressing(&self, index: usize, material: &Vec3, d: &Distance) -> PressingAt {
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        let stiffness = self.surface.stiffness(material, known.base_piece);
        let (normal, presses_n) = point.pressed(d, stiffness.factor);
        let gradient = stiffness.derivatives(&point.potential, d, point.weight_mm).0;
        let rubs_n = presses_n * self.surface.rough(material, known.base_piece);
        let force_n = if stiffness.slope.is_some() { gradient.norm() } else { presses_n };
        PressingAt { normal, rubs_n, gradient, force_n }
    }
}

/// Derivatives of the friction of a slider with this force, its Jacobian, and these in the slip within which it sticks.
fn slider_slopes(
    slider: &Slider,
    (hessian, force): (&Matrix3<f64>, &Vec3),
    by_stick: (Vec3, f64),
    angle: f64,
) -> FrictionSlopes {
    let turn = slider.normal.cross_matrix() * slider.radius_mm;
    let spin = turn * slider.along;
    let (mixed, spun_rad) = (hessian * spin, angle - slider.from_rad);
    FrictionSlopes {
        by_spin: (mixed, mixed.dot(&spin)),
        by_place: (-hessian, -mixed),
        by_direction: (hessian * turn * spun_rad, turn.tr_mul(&mixed) * spun_rad + turn.tr_mul(force)),
        by_stick,
    }
}
