//! Friction within a Newton step.
//!
//! The linearised system contains the friction of the base: a point that sticks there acts as a spring, however far
//! the step moves it, and one that slips drives the step on, even where it would stick or slip back. The friction
//! energy, μ N φ(|u|), is convex in the slip, and the slip u is linear in the step. So where a step is recomputed
//! with the contacts at its end ([`super::model`]), friction is included, in every round with the force and the
//! stiffness at the slip of the previous round,
//!
//! ```text
//! f(u) + H(u) (u′ − u),    f = μ N φ′ û,    H = ∂f/∂u
//! ```
//!
//! and as far along the round as the model decreases.

use nalgebra::Matrix3;

use super::WallContact;
use crate::Vec3;
use crate::contact::friction::{CHANGED, FrictionDerivatives, RENEWED};
use crate::contact::point::ContactPoint;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::Moved;

/// Displacement, mm, and rotation, rad, of a point in a step.
pub(super) type Motion = (Vec3, f64);

/// A force on a point, N, and a moment, N·mm.
type Wrench = (Vec3, f64);

/// A point with friction in a step.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Slipping {
    /// Number of the point.
    index: usize,
    /// Its position, mm, and material angle, rad, at the base.
    base: (Vec3, f64),
    /// Its motion in the step.
    way: Motion,
    /// Linearised force and moment of friction in the system at zero motion.
    at_rest: Wrench,
    /// Their derivatives in the system.
    stiffness: (Matrix3<f64>, Vec3, f64),
    /// The friction that balances the rod's own stiffness.
    carried: Wrench,
}

/// Motion of a point with friction in a round.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Slip {
    /// Its slip at the start of the round, mm.
    begin_mm: Vec3,
    /// Change of its slip, mm.
    change_mm: Vec3,
    /// Change of the balanced force in a full round.
    carried: Wrench,
    /// Work of the initial balanced force, and of its change, over the motion, mJ.
    work_mj: [f64; 2],
}

fn times((hessian, mixed, turn2): &(Matrix3<f64>, Vec3, f64), (way, turn): &Motion) -> Wrench {
    (hessian * way + mixed * *turn, mixed.dot(way) + turn2 * turn)
}

fn plus(a: &Wrench, part: f64, b: &Wrench) -> Wrench {
    (a.0 + b.0 * part, a.1 + b.1 * part)
}

fn work(force: &Wrench, (way, turn): &Motion) -> f64 {
    force.0.dot(way) + force.1 * turn
}

impl Slipping {
    /// Force and moment in the system at the end of a step.
    fn linear(&self, way: &Motion) -> Wrench {
        plus(&self.at_rest, 1.0, &times(&self.stiffness, way))
    }

    /// Changes the system to the friction at the end of the step.
    fn switch(
        &mut self,
        f: &FrictionDerivatives,
        (point, element): (&ContactPoint, &ElementData),
        base: &RodState,
        into: &mut dyn Stencils,
    ) {
        let at_rest = plus(&(f.gradient, f.turn), -1.0, &times(&stiffness(f), &self.way));
        let force = plus(&at_rest, -1.0, &self.at_rest);
        let (old_hessian, old_mixed, old_turn2) = self.stiffness;
        super::model::straighten(point, element, base, &force.0, into);
        let mut sum = PointSum::default();
        sum.add(point.xi, &force.0, Some(&(f.hessian - old_hessian)));
        into.add_points(base, element, point.element, &sum);
        into.add_spin(base, element, point.place(), &(f.mixed - old_mixed), (force.1, f.turn2 - old_turn2));
        (self.at_rest, self.stiffness) = (at_rest, stiffness(f));
    }
}

/// Stiffness of friction in a point's position and angle.
fn stiffness(f: &FrictionDerivatives) -> (Matrix3<f64>, Vec3, f64) {
    (f.hessian, f.mixed, f.turn2)
}

impl WallContact<'_> {
    /// Stores the friction in a step from the base that solves the current system.
    pub(super) fn foresee_slipping(&mut self, base: &RodState, moved: &dyn Moved) {
        let mut slipping = std::mem::take(&mut self.cache.slipping);
        if slipping.is_empty() && self.friction.acts() {
            let rubbing =
                self.points.iter().enumerate().filter(|(index, _)| self.friction.holding(*index).is_some());
            slipping.extend(rubbing.filter_map(|(index, point)| {
                let x = self.surface.place(&self.cache.points[index].base);
                let angle = point.angle(base);
                let f = self.friction.derivatives(index, &x, angle)?;
                Some(Slipping {
                    index,
                    base: (x, angle),
                    way: (Vec3::zeros(), 0.0),
                    at_rest: (f.gradient, f.turn),
                    stiffness: stiffness(&f),
                    carried: (Vec3::zeros(), 0.0),
                })
            }));
        }
        for rubbing in &mut slipping {
            rubbing.way = moved.point(self.points[rubbing.index].place());
            rubbing.carried = rubbing.linear(&rubbing.way);
        }
        self.cache.slipping = slipping;
    }

    /// Updates friction to the end of the step; returns at how many points it changes.
    pub(super) fn slip_on(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Moved,
        into: &mut dyn Stencils,
    ) -> usize {
        let mut changed = 0;
        for slipping in &mut self.cache.slipping {
            let (index, point) = (slipping.index, &self.points[slipping.index]);
            slipping.way = moved.point(point.place());
            let (x, angle) = plus(&slipping.base, 1.0, &slipping.way);
            let Some(f) = self.friction.derivatives(index, &x, angle) else {
                continue;
            };
            let off = plus(&(f.gradient, f.turn), -1.0, &slipping.linear(&slipping.way));
            let (off_n, largest_n) =
                (off.0.norm(), self.friction.law.largest_n(&self.friction.sliders[index]));
            changed += usize::from(off_n > CHANGED * largest_n);
            if off_n > RENEWED * largest_n {
                slipping.switch(&f, (point, &elements[point.element]), base, into);
            }
        }
        changed
    }

    /// Computes the slips of the points with friction in a round.
    pub(super) fn slips_to(&self, moved: &dyn Moved, slips: &mut Vec<Slip>) {
        let slip = |slipping: &Slipping, way: &Motion| {
            let (x, angle) = plus(&slipping.base, 1.0, way);
            self.friction.sliders[slipping.index].slip(&x, angle).0
        };
        let of = |slipping: &Slipping| {
            let point = &self.points[slipping.index];
            let end = moved.point(point.place());
            let (begin_mm, end_mm) = (slip(slipping, &slipping.way), slip(slipping, &end));
            let way = plus(&end, -1.0, &slipping.way);
            let carried = plus(&slipping.linear(&end), -1.0, &slipping.carried);
            Slip {
                begin_mm,
                change_mm: end_mm - begin_mm,
                carried,
                work_mj: [work(&slipping.carried, &way), work(&carried, &way)],
            }
        };
        slips.clear();
        slips.extend(self.cache.slipping.iter().map(of));
    }

    /// Slope of the friction energy at a `part` of a round, minus the work of the balanced forces.
    pub(super) fn slipping_slope(&self, slips: &[Slip], part: f64) -> f64 {
        let each = self.cache.slipping.iter().zip(slips).map(|(slipping, slip)| {
            let there = slip.begin_mm + slip.change_mm * part;
            let against = self.friction.law.resistance(&self.friction.sliders[slipping.index], &there)
                * there.dot(&slip.change_mm);
            against - (slip.work_mj[0] + part * slip.work_mj[1])
        });
        each.sum()
    }

    /// Updates the balanced forces after that part of the round.
    pub(super) fn carry_slipping(&mut self, slips: &[Slip], part: f64) {
        for (slipping, slip) in self.cache.slipping.iter_mut().zip(slips) {
            slipping.carried = plus(&slipping.carried, part, &slip.carried);
        }
    }
}
