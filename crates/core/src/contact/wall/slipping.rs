//! Friction within a step of Newton's method.
//!
//! A step knows of the friction where it begins: a point that sticks there holds like a spring, however far the step takes it, and one
//! that slips drives the step on, also where it is led back and would be held. What friction takes, μ N φ(|u|), is convex in the slip,
//! and the slip u is linear in the step. So where a step is found anew with the contacts that it leads to ([`super::foresight`]), it is found
//! with this too: in every round with the force and the stiffness at the slip that the last one led to,
//!
//! ```text
//! f(u) + H(u) (u′ − u),    f = μ N φ′ û,    H = ∂f/∂u
//! ```
//!
//! and as far along the round as the model falls.

use nalgebra::Matrix3;

use super::WallContact;
use crate::Vec3;
use crate::contact::friction::FrictionDerivatives;
use crate::contact::point::ContactPoint;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::Moved;

/// A point's friction has changed in a step where its force is off by more than this part of the largest that it can be.
const CHANGED: f64 = 0.05;

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
    /// How stiff it is.
    as_stiff: Stiffness,
}

/// How stiff friction is in a step: no more than it must be for the step to have a minimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Stiffness {
    /// As the second derivatives at its end.
    Tangent,
    /// As a spring that holds as it does at its end.
    Secant,
    /// As at the base.
    Base,
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

    /// Changes the system to another force without motion and another stiffness.
    fn switch(
        &mut self,
        to: (Wrench, (Matrix3<f64>, Vec3, f64)),
        (point, element): (&ContactPoint, &ElementData),
        base: &RodState,
        into: &mut dyn Stencils,
    ) {
        let force = plus(&to.0, -1.0, &self.at_rest);
        let (hessian, mixed, turn2) = to.1;
        let (old_hessian, old_mixed, old_turn2) = self.stiffness;
        super::foresight::straighten(point, element, base, &force.0, into);
        let mut sum = PointSum::default();
        sum.add(point.xi, &force.0, Some(&(hessian - old_hessian)));
        into.add_points(base, element, point.element, &sum);
        into.add_spin(base, element, point.place(), &(mixed - old_mixed), (force.1, turn2 - old_turn2));
        (self.at_rest, self.stiffness) = to;
    }
}

/// Stiffness of friction in a point's place and angle.
fn stiffness(f: &FrictionDerivatives) -> (Matrix3<f64>, Vec3, f64) {
    (f.hessian, f.mixed, f.turn2)
}

impl WallContact<'_> {
    /// Friction of a point after a motion from where it is at the base, as stiff as its derivatives or as its `secant`.
    fn friction_after(&self, slipping: &Slipping, way: &Motion, secant: bool) -> Option<FrictionDerivatives> {
        let radius_mm = self.points[slipping.index].potential.radius_mm;
        let (x, angle) = plus(&slipping.base, 1.0, way);
        self.friction.spring(slipping.index, (&x, angle), radius_mm, secant)
    }

    /// Begins to look at the friction of a step from the base; returns whether there is any.
    pub(super) fn begin_slipping(&mut self, base: &RodState, moved: &Moved<'_>) -> bool {
        let mut slipping = std::mem::take(&mut self.cache.slipping);
        if slipping.is_empty() && self.friction.acts() && !self.friction.is_coupled() {
            let rubbing = self.points.iter().enumerate().filter(|(index, _)| self.friction.holds(*index));
            for (index, point) in rubbing {
                let x = self.surface.place(&self.cache.points[index].base);
                let (angle, radius_mm) = (point.angle(base), point.potential.radius_mm);
                let Some(f) = self.friction.derivatives(index, &x, angle, radius_mm) else { continue };
                let way = moved(point.place());
                let mut new = Slipping {
                    index,
                    base: (x, angle),
                    way,
                    at_rest: (f.gradient, f.turn),
                    stiffness: stiffness(&f),
                    carried: (Vec3::zeros(), 0.0),
                    as_stiff: Stiffness::Tangent,
                };
                new.carried = new.linear(&way);
                slipping.push(new);
            }
        }
        self.cache.slipping = slipping;
        !self.cache.slipping.is_empty()
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
        for k in 0..self.cache.slipping.len() {
            let mut slipping = self.cache.slipping[k];
            let point = &self.points[slipping.index];
            let way = moved(point.place());
            let Some(f) = self.friction_after(&slipping, &way, false) else { continue };
            slipping.way = way;
            let off = plus(&(f.gradient, f.turn), -1.0, &slipping.linear(&way));
            if off.0.norm() > CHANGED * self.friction.largest_n(slipping.index) {
                changed += 1;
                self.switch(&mut slipping, f, (elements, base), into);
            }
            self.cache.slipping[k] = slipping;
        }
        changed
    }

    /// Has friction with the force `f` at the end of the step be in the system, as stiff as it is to be.
    fn switch(
        &self,
        slipping: &mut Slipping,
        f: FrictionDerivatives,
        (elements, base): (&[ElementData], &RodState),
        into: &mut dyn Stencils,
    ) {
        let point = &self.points[slipping.index];
        let spring = match slipping.as_stiff {
            Stiffness::Tangent => Some(f),
            Stiffness::Secant => self.friction_after(slipping, &slipping.way, true),
            Stiffness::Base => self.friction_after(slipping, &(Vec3::zeros(), 0.0), false),
        };
        let stiffness = spring.as_ref().map_or(slipping.stiffness, stiffness);
        let at_rest = plus(&(f.gradient, f.turn), -1.0, &times(&stiffness, &slipping.way));
        slipping.switch((at_rest, stiffness), (point, &elements[point.element]), base, into);
    }

    /// Has friction be stiffer; returns at how many points it could be.
    pub(super) fn stiffen(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) -> usize {
        let Some(least) = self.cache.slipping.iter().map(|slipping| slipping.as_stiff).min() else {
            return 0;
        };
        let stiffer = if least == Stiffness::Tangent { Stiffness::Secant } else { Stiffness::Base };
        let mut stiffened = 0;
        for k in 0..self.cache.slipping.len() {
            let mut slipping = self.cache.slipping[k];
            let Some(f) = self.friction_after(&slipping, &slipping.way, false) else { continue };
            if slipping.as_stiff < stiffer {
                (slipping.as_stiff, stiffened) = (stiffer, stiffened + 1);
                self.switch(&mut slipping, f, (elements, base), into);
                self.cache.slipping[k] = slipping;
            }
        }
        stiffened
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
