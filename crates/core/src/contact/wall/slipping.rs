//! Friction within a step of Newton's method.
//!
//! A step knows of the friction where it begins: a point that sticks there holds like a spring, however far the step takes it, and one
//! that slips drives the step on, also where it is led back and would be held. What friction takes, μ N φ(|u|), is convex in the slip,
//! and the slip u is linear in the step. So where a step is found anew with the contacts that it leads to ([`super::model`]), it is found
//! with this too, in every round with the force and the stiffness at the slip that the last one led to,
//!
//! ```text
//! f(u) + H(u) (u′ − u),    f = μ N φ′ û,    H = ∂f/∂u
//! ```
//!
//! and as far along the round as the model falls.

use nalgebra::Matrix3;

use super::WallContact;
use crate::Vec3;
use crate::contact::friction::{CHANGED, FrictionDerivatives, RENEWED};
use crate::contact::point::ContactPoint;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::Moved;

/// How far a step moves a point, mm, and turns it, rad.
pub(super) type Motion = (Vec3, f64);

/// A force on a point, N, and a moment, N·mm.
type Wrench = (Vec3, f64);

/// A point with friction in a step.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Slipping {
    /// Number of the point.
    index: usize,
    /// Its place, mm, and material angle, rad, at the base.
    base: (Vec3, f64),
    /// What the step does to it.
    way: Motion,
    /// Force and moment of friction at the end of the step where they are linear: in the system, without a motion.
    at_rest: Wrench,
    /// Their derivatives in the system.
    stiffness: (Matrix3<f64>, Vec3, f64),
    /// What the rod's own stiffness is in balance with.
    carried: Wrench,
}

/// What a round does to a point with friction.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Slip {
    /// Its slip where the round begins, mm.
    begin_mm: Vec3,
    /// Change of its slip, mm.
    change_mm: Vec3,
    /// Change of what is carried, by a whole round.
    carried: Wrench,
    /// Work, on the way, of what is carried where it begins, and of that change, mJ.
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

    /// Changes the system to friction as it is at the end of the step.
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

/// Stiffness of friction in a point's place and angle.
fn stiffness(f: &FrictionDerivatives) -> (Matrix3<f64>, Vec3, f64) {
    (f.hessian, f.mixed, f.turn2)
}

impl WallContact<'_> {
    /// Takes note of the friction in a step from the base that answers the system as it is.
    pub(super) fn foresee_slipping(&mut self, base: &RodState, moved: &Moved<'_>) {
        let mut slipping = std::mem::take(&mut self.cache.slipping);
        if slipping.is_empty() && self.friction.acts() {
            let rubbing = self.points.iter().enumerate().filter(|(index, _)| self.friction.holds(*index));
            slipping.extend(rubbing.filter_map(|(index, point)| {
                let x = self.surface.place(&self.cache.points[index].base);
                let (angle, radius_mm) = (point.angle(base), point.potential.radius_mm);
                let f = self.friction.derivatives(index, &x, angle, radius_mm)?;
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
            rubbing.way = moved(self.points[rubbing.index].place());
            rubbing.carried = rubbing.linear(&rubbing.way);
        }
        self.cache.slipping = slipping;
    }

    /// Has friction be that at the end of the step; returns at how many points that changes it.
    pub(super) fn slip_on(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize {
        let mut changed = 0;
        for slipping in &mut self.cache.slipping {
            let (index, point) = (slipping.index, &self.points[slipping.index]);
            slipping.way = moved(point.place());
            let (x, angle) = plus(&slipping.base, 1.0, &slipping.way);
            let Some(f) = self.friction.derivatives(index, &x, angle, point.potential.radius_mm) else {
                continue;
            };
            let off = plus(&(f.gradient, f.turn), -1.0, &slipping.linear(&slipping.way));
            let (off_n, largest_n) = (off.0.norm(), self.friction.largest_n(index));
            changed += usize::from(off_n > CHANGED * largest_n);
            if off_n > RENEWED * largest_n {
                slipping.switch(&f, (point, &elements[point.element]), base, into);
            }
        }
        changed
    }

    /// What a round does to the points with friction.
    pub(super) fn slips_to(&self, moved: &Moved<'_>, slips: &mut Vec<Slip>) {
        let slip = |slipping: &Slipping, way: &Motion| {
            let (x, angle) = plus(&slipping.base, 1.0, way);
            let radius_mm = self.points[slipping.index].potential.radius_mm;
            self.friction.slip(slipping.index, &x, angle, radius_mm).0
        };
        let of = |slipping: &Slipping| {
            let point = &self.points[slipping.index];
            let end = moved(point.place());
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

    /// Slope of what friction takes at a `part` of a round, less what is carried there.
    pub(super) fn slipping_slope(&self, slips: &[Slip], part: f64) -> f64 {
        let each = self.cache.slipping.iter().zip(slips).map(|(slipping, slip)| {
            let there = slip.begin_mm + slip.change_mm * part;
            let against = self.friction.resistance(slipping.index, &there) * there.dot(&slip.change_mm);
            against - (slip.work_mj[0] + part * slip.work_mj[1])
        });
        each.sum()
    }

    /// What the rod's stiffness is in balance with after that part of the round.
    pub(super) fn carry_slipping(&mut self, slips: &[Slip], part: f64) {
        for (slipping, slip) in self.cache.slipping.iter_mut().zip(slips) {
            slipping.carried = plus(&slipping.carried, part, &slip.carried);
        }
    }
}
