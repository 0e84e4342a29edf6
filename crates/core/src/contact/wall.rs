//! The wall as an energy of the rod: contact points along the device, each with its distance from the wall.
//!
//! U = Σᵢ wᵢ ψ(d(xᵢ)) with the trapezoidal rule over each element, which is the most accurate one for a pressure that
//! begins and ends inside it, and the tip's cap as a further weight r at the last point: ½ k r p² (without it the
//! force of the tip concentrates in a layer that no mesh resolves). Points are identified by their arc length from
//! the tip, so what is known of their surroundings stays with them while the device slides.
//!
//! On a wall with regions ψ is multiplied by the local eˢ ([`super::regions`]), and so is the cap's.
//!
//! Whether a point is active does not depend on depth alone: contacts have forces of their own (`contact/set.rs`), for
//! which Newton's method solves.
//!
//! A point queries the bounding volume hierarchy only when it may have come near something new: while it has moved
//! less than its last clearance, it cannot touch anything.

mod clear;
mod contacts;
mod friction;
mod passing;
mod reactions;
mod reading;
mod slopes;

use super::cache::ContactCache;
use super::point::{Contact, ContactPoint, Counters, Touch};
use crate::Vec3;
use crate::contact::set::Geometry;
use crate::contact::{Between, Drag, Friction, MovedWall};
use crate::flow::BloodFlow;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::{Contacts, External, Sizes};

pub(super) use clear::Span;
pub(super) use contacts::PointPlace;
pub(crate) use reactions::Reaction;
use reading::Reading;
pub(crate) use slopes::{FrictionSlopes, PressingSlopes};

/// Force scale of a device of this bending stiffness, N·mm², bent to this radius, mm, N.
pub(crate) fn least_force_n(bending_nmm2: f64, bend_mm: f64) -> f64 {
    bending_nmm2 / (bend_mm * bend_mm)
}

/// The wall's energy along a device.
pub(crate) struct WallContact<'a> {
    surface: MovedWall<'a>,
    points: &'a [ContactPoint],
    /// Moment of the softest piece in the gentlest relevant bend, N·mm.
    least_moment_nmm: f64,
    /// Drag of flowing blood.
    drag: Option<&'a mut Drag>,
    cache: &'a mut ContactCache,
    friction: &'a mut Friction,
    /// Rounding error of the forces at the last state due to rounding of positions, N.
    rounding_n: f64,
    counters: Counters,
}

impl<'a> WallContact<'a> {
    /// The wall's energy at `points` (tip first), with knowledge from earlier steps. `softest_nmm2` is the device's
    /// smallest bending stiffness.
    pub(crate) fn new(
        surface: impl Into<MovedWall<'a>>,
        points: &'a [ContactPoint],
        cache: &'a mut ContactCache,
        friction: &'a mut Friction,
        softest_nmm2: f64,
    ) -> Self {
        cache.look_at(points);
        Self::of(surface.into(), points, (cache, friction), softest_nmm2)
    }

    /// As [`Self::new`], where material points of the vessel have moved under these points by at most so much since the
    /// cache was used for them, mm.
    pub(crate) fn again(
        surface: MovedWall<'a>,
        points: &'a [ContactPoint],
        (cache, friction): (&'a mut ContactCache, &'a mut Friction),
        softest_nmm2: f64,
        moved_mm: f64,
    ) -> Self {
        cache.look_again(moved_mm);
        Self::of(surface, points, (cache, friction), softest_nmm2)
    }

    fn of(
        surface: MovedWall<'a>,
        points: &'a [ContactPoint],
        (cache, friction): (&'a mut ContactCache, &'a mut Friction),
        softest_nmm2: f64,
    ) -> Self {
        Self {
            surface,
            points,
            least_moment_nmm: softest_nmm2 / cache.tuning.gentlest_bend_mm,
            drag: None,
            cache,
            friction,
            rounding_n: 0.0,
            counters: Counters::default(),
        }
    }

    /// The material point of the vessel where point `index` is at a state; knowledge of the wall refers to these.
    fn material(&mut self, index: usize, elements: &[ElementData], state: &RodState) -> Vec3 {
        let x = self.points[index].position(elements, state);
        self.material_at(index, &x)
    }

    /// The material point of the vessel where point `index` is at position `x`.
    fn material_at(&mut self, index: usize, x: &Vec3) -> Vec3 {
        if !self.surface.is_displaced() {
            return *x;
        }
        let (place, material) = self.cache.places[index];
        if place == *x {
            return material;
        }
        // It has moved with the point, if it was known elsewhere.
        let base = &self.cache.points[index].base;
        let nearby = if place.x.is_nan() { *base } else { material + (x - place) };
        let material = self.surface.material_near(x, &nearby);
        self.cache.places[index] = (*x, material);
        material
    }

    /// Position of point `index` at the base.
    fn base_place(&self, index: usize) -> Vec3 {
        let base = &self.cache.points[index].base;
        let (place, material) = &self.cache.places[index];
        if material == base { *place } else { self.surface.place(base) }
    }

    /// Distance from the wall within which a point of this radius is tracked, mm.
    fn followed_mm(&self, radius_mm: f64) -> f64 {
        (1.0 + self.cache.tuning.follow) * radius_mm
    }

    /// Sets the drag of a flow at a state; none without flow. Returns its potential there, mJ.
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

    /// Renews the drag of a flow at a state. Returns its relative change.
    pub(crate) fn renew_drag(&mut self, flow: &BloodFlow, elements: &[ElementData], state: &RodState) -> f64 {
        let Some(drag) = &mut self.drag else { return 0.0 };
        drag.renew(flow, self.surface, self.points, elements, state)
    }

    /// Potential of the current drag, mJ; 0 without flow.
    pub(crate) fn drag_mj(&self, elements: &[ElementData], state: &RodState) -> f64 {
        self.drag.as_ref().map_or(0.0, |drag| drag.value_mj(elements, state))
    }

    /// Friction between instruments.
    pub(crate) fn between(&mut self) -> &mut Between {
        &mut self.friction.between
    }

    /// Work done and avoided since the last count, including the search for the tip's passage.
    pub(crate) fn count(&mut self) -> Counters {
        self.counters.queries += std::mem::take(&mut self.cache.proximity.queries);
        std::mem::take(&mut self.counters)
    }

    /// Fraction of its way from the base to `to`, at most `fraction`, that point `index` may move.
    fn safe_fraction_of(
        &mut self,
        elements: &[ElementData],
        to: &RodState,
        index: usize,
        fraction: f64,
    ) -> f64 {
        let x = self.material(index, elements, to);
        let known = &self.cache.points[index];
        let safe = self.cache.tuning.safe;
        let safe_mm = safe * known.base_clearance_mm / self.surface.stretch();
        let way_mm = (x - known.base).norm();
        if known.side.is_some() || fraction * way_mm <= safe_mm {
            return fraction;
        }
        // Between two positions that are as far from the wall as from each other there is no wall.
        let to_mm = self.read(index, &x).distance_mm();
        if way_mm <= safe_mm + safe * to_mm / self.surface.stretch() {
            return fraction;
        }
        self.counters.queries += 1;
        let known = &self.cache.points[index];
        let Some(met) = self.surface.crossing(&known.base, &x, fraction / safe) else {
            return fraction;
        };
        // Near the wall flat triangles may stand into the smooth lumen, and the smooth distance decides.
        let from_mm = known.base_clearance_mm;
        match known.piece.map(|triangle| self.surface.distance_from(triangle, &x)) {
            Some(to_mm) if to_mm > 0.0 => fraction,
            Some(to_mm) => fraction.min(safe * from_mm / (from_mm - to_mm)),
            None => safe * met,
        }
    }

    /// Contact at point `index` at a state, if it presses on the wall.
    pub(crate) fn touch(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        index: usize,
    ) -> Option<Touch> {
        let point = self.points[index];
        let x = point.position(elements, state);
        let material = self.material_at(index, &x);
        let Reading::Pressed(distance) = self.read(index, &material) else { return None };
        let penetration_mm = point.potential.penetration_mm(distance.value_mm);
        let stiffness = self.surface.stiffness(&material, self.cache.points[index].piece);
        let (mut normal, mut force_n) = point.pressed(&distance, stiffness.factor);
        if stiffness.slope.is_some() {
            let force = -stiffness.derivatives(&point.potential, &distance, point.weight_mm).0;
            force_n = force.norm();
            normal = force / force_n;
        }
        let friction = self.friction.derivatives(index, &x, point.angle(state));
        Some(Touch {
            energy_mj: stiffness.factor * point.weight_mm * point.potential.value(distance.value_mm),
            contact: Contact {
                position_mm: x,
                normal,
                force_n,
                friction_n: friction.map_or_else(Vec3::zeros, |f| -f.gradient),
                penetration_mm,
                triangle: self.cache.points[index].piece.unwrap_or(0),
            },
            friction_nmm: friction.map_or(0.0, |f| -f.turn),
        })
    }

    /// Contacts of all points that press on the wall at a state.
    pub(crate) fn touches(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        to: &mut Vec<(usize, Touch)>,
    ) {
        to.clear();
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, state).into_iter().flatten() {
                to.extend(self.touch(elements, state, index).map(|touch| (index, touch)));
            }
        }
    }
}

impl External for WallContact<'_> {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        self.look_at_base(elements, state);
        self.follow_contacts();
        self.friction.between.add(state, into);
        if let Some(drag) = &self.drag {
            drag.add(elements, state, into);
        }
        self.rounding_n = 0.0;
        let mut sum = PointSum::default();
        for span in 0..self.cache.spans.len() {
            let Span { ref points, element, at_base, .. } = self.cache.spans[span];
            // Points not known there are clear of the wall.
            if !at_base {
                continue;
            }
            for index in points.clone() {
                self.add_friction(elements, state, into, &mut sum, index);
                self.press((elements, state), into, &mut sum, index);
            }
            if !sum.is_empty() {
                into.add_points(state, &elements[element], element, &std::mem::take(&mut sum));
            }
        }
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let mut sum = self.friction.between.taken_mj(state);
        sum += self.drag_mj(elements, state);
        let mut next = 0;
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, state).into_iter().flatten() {
                sum += self.contact_mj(elements, state, index, &mut next);
                sum += self.friction_mj(elements, state, index);
            }
        }
        sum
    }

    /// In a device with smaller loads, force and moment have no scale of their own to compare with.
    fn sizes(&self) -> Sizes {
        Sizes {
            force_n: self.least_force_n(),
            moment_nmm: self.least_moment_nmm,
            rounding_n: self.rounding_n,
        }
    }

    fn visit_contacts(&mut self, ask: &mut dyn FnMut(&mut dyn Contacts)) {
        ask(self);
    }

    /// A point may move by nearly its clearance in any direction: the ball about it contains no wall. Farther it may
    /// move if its straight path does not meet the wall, or nearly up to the wall if it does. A point that has sunk
    /// in knows its side, and the energy holds it there.
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
