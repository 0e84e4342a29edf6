//! The wall as an energy of the rod: quadrature points along the device, each with its distance from the wall.
//!
//! U = Σᵢ wᵢ ψ(d(xᵢ)) with the trapezoidal rule over each element, which is the most exact one for a pressure that
//! begins and ends inside it, and the tip's cap as a further weight r at the last point: ½ k r p² (without it the force of
//! the tip gathers in a layer that no mesh resolves). Points are labelled from the tip, like everything on a device, so
//! what is known of their surroundings stays with them while the device slides.
//!
//! On a wall with regions ψ is multiplied by eˢ, s of the place ([`super::regions`]), and so is the cap's.
//!
//! A point asks the bounding volume hierarchy only when it may have come near something new: while it has moved less than
//! its last clearance, nothing can touch it.

mod clear;
mod coupling;
mod foresight;
mod passing;
mod reading;
mod slipping;

use super::cache::ContactCache;
use super::point::{Contact, ContactPoint, Counters, Touch};
use crate::Vec3;
use crate::contact::{Between, Drag, Friction, MovedWall};
use crate::flow::BloodFlow;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::{External, Moved};

pub(super) use clear::Span;
pub(super) use foresight::Foreseen;
use reading::Reading;
pub(super) use slipping::{Slip, Slipping};

/// Radius of the gentlest bend worth a number, mm.
const LEAST_BEND_MM: f64 = 100.0;
/// Part of its clearance that a point may move in one step of Newton's method.
const SAFE: f64 = 0.9;
/// A point whose axis is nearer to the wall than this part of its radius has sunk into it: on which side of the wall it is says the
/// side that it came from, and the nearest piece of wall is looked for along the wall, not through space.
const SUNK: f64 = 0.3;
/// Roundings of a coordinate by which a distance is off.
const ROUNDING: f64 = 4.0;

/// The wall's energy along a device.
pub struct WallContact<'a> {
    surface: MovedWall<'a>,
    points: &'a [ContactPoint],
    /// Moment of the softest piece at a radius of 100 mm, N·mm.
    least_moment_nmm: f64,
    /// Part of the (stiffest) modulus that acts: a rigid wall is approached from a softer one.
    pub softness: f64,
    /// Whether points that pressed in the last equilibrium are held to the wall, should they have come off it.
    pub holding: bool,
    /// What the blood that flows does.
    drag: Option<&'a mut Drag>,
    cache: &'a mut ContactCache,
    friction: &'a mut Friction,
    /// What rounding of positions leaves of the forces at the last state, N.
    rounding_n: f64,
    counters: Counters,
}

impl<'a> WallContact<'a> {
    /// The wall's energy at `points` (tip first), with what is known from earlier steps. `softest_nmm2` is the device's
    /// least bending stiffness.
    pub fn new(
        surface: impl Into<MovedWall<'a>>,
        points: &'a [ContactPoint],
        cache: &'a mut ContactCache,
        friction: &'a mut Friction,
        softest_nmm2: f64,
    ) -> Self {
        cache.look_at(points);
        Self {
            surface: surface.into(),
            points,
            least_moment_nmm: softest_nmm2 / LEAST_BEND_MM,
            softness: 1.0,
            holding: false,
            drag: None,
            cache,
            friction,
            rounding_n: 0.0,
            counters: Counters::default(),
        }
    }

    /// The material point of the vessel where point `index` is at a state. What is known of the wall is known of those.
    fn material(&self, index: usize, elements: &[ElementData], state: &RodState) -> Vec3 {
        self.surface.material(&self.points[index].position(elements, state))
    }

    /// Has a flow drag at the device, as it does at a state; nothing where there is none. Returns its potential there, mJ.
    pub(crate) fn begin_drag(
        &mut self,
        flow: Option<&BloodFlow>,
        drag: &'a mut Drag,
        elements: &[ElementData],
        state: &RodState,
    ) -> f64 {
        let Some(flow) = flow else { return 0.0 };
        self.drag = Some(drag);
        self.renew_drag(flow, elements, state);
        self.drag_mj(elements, state)
    }

    /// Takes the drag of a flow at a state. Returns the part by which it has changed.
    pub(crate) fn renew_drag(&mut self, flow: &BloodFlow, elements: &[ElementData], state: &RodState) -> f64 {
        let Some(drag) = &mut self.drag else { return 0.0 };
        drag.renew(flow, self.surface, self.points, elements, state)
    }

    /// Potential of the drag as it is held, mJ; 0 where nothing flows.
    pub(crate) fn drag_mj(&self, elements: &[ElementData], state: &RodState) -> f64 {
        self.drag.as_ref().map_or(0.0, |drag| drag.value_mj(elements, state))
    }

    /// Friction between instruments.
    pub(crate) fn between(&mut self) -> &mut Between {
        &mut self.friction.between
    }

    /// Work done and avoided since it was counted last, looking for the tip's way included.
    pub fn count(&mut self) -> Counters {
        self.counters.queries += std::mem::take(&mut self.cache.proximity.queries);
        std::mem::take(&mut self.counters)
    }

    /// Friction of point `index` at its base.
    fn add_friction(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        into: &mut dyn Stencils,
        sum: &mut PointSum,
        index: usize,
    ) {
        if !self.friction.holds(index) {
            return;
        }
        let (point, x) = (&self.points[index], &self.surface.place(&self.cache.points[index].base));
        let (angle, radius_mm) = (point.angle(state), point.potential.radius_mm);
        let Some(f) = self.friction.derivatives(index, x, angle, radius_mm) else { return };
        into.add_value(self.friction.value(index, x, angle, radius_mm));
        self.rounding_n = self.rounding_n.max(ROUNDING * f64::EPSILON * f.hessian.norm() * x.amax());
        let e = point.element;
        sum.add(point.xi, &f.gradient, into.wants_hessian().then_some(&f.hessian));
        into.add_spin(state, &elements[e], (e, point.xi, point.set), &f.mixed, (f.turn, f.turn2));
    }

    /// What point `index` feels at its base.
    fn gather(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        into: &mut dyn Stencils,
        sum: &mut PointSum,
        index: usize,
    ) {
        self.add_friction(elements, state, into, sum, index);
        let Some(d) = self.cache.pressed(index) else { return };
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        let stiffness = self.surface.stiffness(&known.base, known.triangle, self.softness);
        let w = point.weight_mm;
        let spring = stiffness.factor * w * point.potential.modulus_n_per_mm2;
        self.rounding_n = self.rounding_n.max(ROUNDING * f64::EPSILON * spring * known.base.amax());
        let (gradient, hessian) = if self.holding {
            stiffness.holding(&point.potential, d, w, known.force_n)
        } else {
            into.add_value(stiffness.factor * w * point.potential.value(d.value_mm));
            let (gradient, hessian) = stiffness.derivatives(&point.potential, d, w);
            self.cache.points[index].force_n = gradient.norm();
            (gradient, hessian)
        };
        sum.add(point.xi, &gradient, into.wants_hessian().then_some(&hessian));
    }

    /// Adds the energy of point `index` at a state to a sum.
    fn value_of(&mut self, elements: &[ElementData], state: &RodState, index: usize, mut sum: f64) -> f64 {
        let point = self.points[index];
        let x = point.position(elements, state);
        let material = self.surface.material(&x);
        let radius_mm = point.potential.radius_mm;
        let limit_mm = self.asked_mm(radius_mm);
        let value_mm = self.read_within(index, &material, limit_mm).distance_mm();
        if value_mm < radius_mm {
            let triangle = self.cache.points[index].triangle;
            let factor = self.surface.stiffness(&material, triangle, self.softness).factor;
            sum += factor * point.weight_mm * point.potential.value(value_mm);
        }
        if self.friction.holds(index) {
            sum += self.friction.value(index, &x, point.angle(state), radius_mm);
        }
        sum
    }

    /// Length that point `index` stands for at its base, times the part of the modulus that acts there, mm.
    fn weight_mm(&self, index: usize) -> f64 {
        let known = &self.cache.points[index];
        let factor = self.surface.stiffness(&known.base, known.triangle, self.softness).factor;
        factor * self.points[index].weight_mm
    }

    /// Part of its way from the base to `to`, at most `fraction`, that point `index` may go.
    fn safe_fraction_of(
        &mut self,
        elements: &[ElementData],
        to: &RodState,
        index: usize,
        fraction: f64,
    ) -> f64 {
        let x = self.material(index, elements, to);
        let known = &self.cache.points[index];
        let safe_mm = SAFE * known.base_clearance_mm / self.surface.stretch();
        if known.side.is_some() || fraction * (x - known.base).norm() <= safe_mm {
            return fraction;
        }
        self.counters.queries += 1;
        let Some(met) = self.surface.query.crossing(&known.base, &x, fraction / SAFE) else {
            return fraction;
        };
        // Near the wall flat triangles may stand into the smooth lumen, and what it says counts.
        let from_mm = known.base_clearance_mm;
        match known.triangle.map(|triangle| self.surface.distance_from(triangle, &x)) {
            Some(to_mm) if to_mm > 0.0 => fraction,
            Some(to_mm) => fraction.min(SAFE * from_mm / (from_mm - to_mm)),
            None => SAFE * met,
        }
    }

    /// A device bent to a radius of 100 mm carries this.
    fn least_force_n(&self) -> f64 {
        self.least_moment_nmm / LEAST_BEND_MM
    }

    /// What happens at point `index` at the given state, where the wall is pressed.
    pub fn touch(&mut self, elements: &[ElementData], state: &RodState, index: usize) -> Option<Touch> {
        let point = self.points[index];
        let x = point.position(elements, state);
        let material = self.surface.material(&x);
        let Reading::Pressed(distance) = self.read(index, &material) else { return None };
        let penetration_mm = point.potential.penetration_mm(distance.value_mm);
        let (angle, radius_mm) = (point.angle(state), point.potential.radius_mm);
        let stiffness = self.surface.stiffness(&material, self.cache.points[index].triangle, 1.0);
        let (mut normal, mut force_n) = point.pressed(&distance, stiffness.factor);
        if stiffness.slope.is_some() {
            let force = -stiffness.derivatives(&point.potential, &distance, point.weight_mm).0;
            force_n = force.norm();
            normal = force / force_n;
        }
        let rub = self.friction.derivatives(index, &x, angle, radius_mm);
        Some(Touch {
            energy_mj: stiffness.factor * point.weight_mm * point.potential.value(distance.value_mm),
            contact: Contact {
                position_mm: x,
                normal,
                force_n,
                friction_n: rub.map_or_else(Vec3::zeros, |f| -f.gradient),
                penetration_mm,
                triangle: self.cache.points[index].triangle.unwrap_or(0),
            },
            friction_nmm: rub.map_or(0.0, |f| -f.turn),
        })
    }

    /// What happens at all points that press on the wall at a state.
    pub fn touches(&mut self, elements: &[ElementData], state: &RodState, to: &mut Vec<(usize, Touch)>) {
        to.clear();
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, state).into_iter().flatten() {
                to.extend(self.touch(elements, state, index).map(|touch| (index, touch)));
            }
        }
    }

    /// How much the forces on the wall differ at a state from those of the last equilibrium, over the latter; 0 where there were none.
    pub fn misfit(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let (mut misfit_n, mut sum_n) = (0.0, 0.0);
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, state).into_iter().flatten() {
                let point = self.points[index];
                let x = self.material(index, elements, state);
                let force_n = match self.read(index, &x) {
                    Reading::Pressed(d) => {
                        let triangle = self.cache.points[index].triangle;
                        let factor = self.surface.stiffness(&x, triangle, self.softness).factor;
                        point.pressed(&d, factor).1
                    }
                    Reading::Free(_) => 0.0,
                };
                let was_n = self.cache.points[index].force_n;
                misfit_n += (force_n - was_n).abs();
                sum_n += was_n;
            }
        }
        if sum_n > 0.0 { misfit_n / sum_n } else { 0.0 }
    }
}

impl External for WallContact<'_> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.look_at_base(elements, state);
        // Forces that hold are none that friction follows, unless it is solved for with them.
        if self.friction.is_coupled() {
            self.press_friction();
        } else if self.friction.acts() && !self.holding {
            let least_n = self.least_force_n();
            let (surface, cache, softness) = (self.surface, &*self.cache, self.softness);
            let pressed = cache.all_pressed().map(|(index, d)| {
                let known = &cache.points[index];
                let factor = surface.stiffness(&known.base, known.triangle, softness).factor;
                let (normal, force) = self.points[index].pressed(d, factor);
                (index, (normal, force * surface.rough(&known.base, known.triangle)))
            });
            self.friction.follow(pressed, least_n);
        }
        self.friction.between.add(state, into);
        if let Some(drag) = &self.drag {
            drag.add(elements, state, into);
        }
        self.rounding_n = 0.0;
        let mut sum = PointSum::default();
        for span in 0..self.cache.spans.len() {
            let Span { ref points, element, at_base, .. } = self.cache.spans[span];
            // What is not known there is clear of the wall.
            if !at_base {
                continue;
            }
            for index in points.clone() {
                self.gather(elements, state, into, &mut sum, index);
            }
            if !sum.is_empty() {
                into.add_points(state, &elements[element], element, &std::mem::take(&mut sum));
            }
        }
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let mut sum = self.friction.between.taken_mj(state);
        sum += self.drag_mj(elements, state);
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, state).into_iter().flatten() {
                sum = self.value_of(elements, state, index, sum);
            }
        }
        sum
    }

    fn foresee(&mut self, moved: &Moved<'_>) -> bool {
        self.foresee_contacts(moved)
    }

    fn meet(
        &mut self,
        elements: &[ElementData],
        (base, trial): (&RodState, &RodState),
        part: f64,
        moved: &Moved<'_>,
    ) -> bool {
        // Where the modulus changes by powers of ten from place to place, a plane and a spring are no model of what a trial has met.
        if self.surface.regions.is_some() {
            return false;
        }
        let slips = self.begin_slipping(base, moved);
        self.meet_contacts(elements, trial, part, moved) || slips
    }

    fn press_or_let_go(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize {
        self.press_or_let_go_contacts(elements, base, moved, into) + self.slip_on(elements, base, moved, into)
    }

    fn part_towards(&mut self, moved: &Moved<'_>, most: f64) -> f64 {
        self.part_towards_contacts(moved, most)
    }

    fn hold_on(&mut self, elements: &[ElementData], base: &RodState, into: &mut dyn Stencils) -> usize {
        self.hold_on_contacts(elements, base, into) + self.stiffen(elements, base, into)
    }

    fn forget(&mut self) {
        self.cache.foreseen.clear();
        self.cache.slipping.clear();
    }

    fn stray(
        &mut self,
        elements: &[ElementData],
        states: (&RodState, &RodState),
        part: f64,
        into: &mut dyn Stencils,
    ) -> f64 {
        self.stray_contacts(elements, states, part, into)
    }

    /// In a device that carries less, force and moment have no scale of their own to be compared with.
    fn scale(&self) -> [f64; 2] {
        [self.least_force_n(), self.least_moment_nmm]
    }

    fn rounding(&self) -> f64 {
        self.rounding_n
    }

    fn is_steep(&self) -> bool {
        true
    }

    /// A point may move by nearly its clearance, whatever the direction: the ball about it holds no wall. Farther it may go where its
    /// straight way meets no wall, and nearly up to the wall where it does. A point that has sunk in knows its side, and the energy
    /// holds it there.
    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        let mut fraction: f64 = 1.0;
        for span in 0..self.cache.spans.len() {
            for index in self.near_way(span, elements, to, fraction).into_iter().flatten() {
                fraction = self.safe_fraction_of(elements, to, index, fraction);
            }
        }
        fraction
    }
}

#[cfg(test)]
mod step_tests;
#[cfg(test)]
mod tests;
