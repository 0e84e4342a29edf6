//! The wall's contacts: what the wall supplies to a [`ContactSet`], and their curvature in the system of a base.
//!
//! The gap of a point is g = d − r, of the distance d of the device's axis and the device's radius r.

use nalgebra::Matrix3;

use super::{Reading, WallContact};
use crate::Vec3;
use crate::contact::friction::{Coulomb, unsettled};
use crate::contact::regions;
use crate::contact::set::{
    ContactSet, Geometry, LinearContact, Motion, Nearby, Slipping, Stencil, Stiffness, System, Wrench, merit,
    penalty_n_per_mm,
};
use crate::contact::{Distance, ROUNDING};
use crate::rod::quadrature::hermite;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::Moved;

/// Element, ξ and set of angles of a point.
pub(in crate::contact) type PointPlace = (usize, f64, usize);

impl Stencil for PointPlace {
    fn add(&self, to: &mut System<'_>, (force, moment): &Wrench, (hessian, mixed, turn2): &Stiffness) {
        let System { elements, base, into } = to;
        let (e, xi, _) = *self;
        straighten((e, xi), &elements[e], base, force, *into);
        let mut sum = PointSum::default();
        sum.add(xi, force, Some(hessian));
        into.add_points(base, &elements[e], e, &sum);
        // A normal force has no moment.
        if (*moment, *turn2) != (0.0, 0.0) || *mixed != Vec3::zeros() {
            into.add_spin(base, &elements[e], *self, mixed, (*moment, *turn2));
        }
    }
}

/// Removes the effect of a point force, added as a gradient, on the rotation of tangents: springs not under that
/// force, or linearised friction, have no such effect.
fn straighten(
    (e, xi): (usize, f64),
    element: &ElementData,
    base: &RodState,
    force: &Vec3,
    into: &mut dyn Stencils,
) {
    let [_, near, _, far] = hermite(xi);
    for (node, share) in [(e, near), (e + 1, far)] {
        let back = share * element.length * force.dot(&base.frames[node].t);
        into.add_turn(node, &Vec3::zeros(), &Matrix3::from_diagonal(&Vec3::new(back, back, 0.0)));
    }
}

/// What the wall's elasticity does at a contact at its base.
pub(super) struct Pressed {
    /// κ, N/mm.
    kappa: f64,
    /// Its energy, mJ, and the gradient of that in its position, N.
    pub(super) stored_mj: f64,
    pub(super) gradient: Vec3,
    /// The part of the gradient along that of the distance.
    pressing: Vec3,
    /// The part of the Hessian by the slope of the modulus, N/mm.
    graded: Matrix3<f64>,
}

impl Pressed {
    /// The Hessian of its energy, N/mm, at this distance, with the curvature under its force unknown, N.
    pub(super) fn hessian(&self, d: &Distance, force_n: f64) -> Matrix3<f64> {
        let plane = d.gradient * d.gradient.transpose();
        plane * self.kappa - d.hessian * force_n + self.graded
    }
}

impl Geometry for WallContact<'_> {
    type Stencil = PointPlace;

    fn set(&mut self) -> &mut ContactSet<PointPlace> {
        &mut self.cache.set
    }

    fn motion(&self, place: &PointPlace, moved: &dyn Moved) -> Motion {
        moved.point(*place)
    }

    fn find_nearby(&mut self, elements: &[ElementData], base: &RodState) {
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, base).into_iter().flatten() {
                let (known, point) = (&self.cache.points[index], &self.points[index]);
                let radius_mm = point.potential.radius_mm;
                if !known.presses && known.base_clearance_mm < self.followed_mm(radius_mm) {
                    let free_mm = (known.base_clearance_mm - radius_mm) / self.cache.tuning.steepest;
                    let penalty_n_per_mm = self.penalty_n_per_mm(index, elements);
                    self.cache.set.nearby.push(Nearby::new(
                        (index, point.place()),
                        free_mm,
                        penalty_n_per_mm,
                    ));
                }
            }
        }
    }

    fn linearised(&mut self, nearby: &Nearby<PointPlace>) -> Option<LinearContact<PointPlace>> {
        let index = nearby.key;
        let near_mm = self.followed_mm(self.points[index].potential.radius_mm);
        let x = self.cache.points[index].base;
        let Reading::Pressed(d) = self.read_within(index, &x, near_mm) else { return None };
        Some(self.contact(index, (d.value_mm, d.gradient), nearby.penalty_n_per_mm))
    }

    fn law(&mut self) -> &mut Coulomb {
        &mut self.friction.law
    }

    fn find_slipping(&self, base: &RodState, into: &mut Vec<Slipping<PointPlace>>) {
        let all = self.friction.sliders.iter().zip(self.points).enumerate();
        let held = all.filter(|(_, (slider, _))| slider.holds());
        into.extend(held.filter_map(|(index, (slider, point))| {
            let at = (self.base_place(index), point.angle(base));
            Slipping::new(point.place(), slider, at, &self.friction.law)
        }));
    }

    fn store_forces(&mut self) {
        for contact in &self.cache.set.contacts {
            self.cache.points[contact.key].force_n = contact.force_n;
        }
    }

    fn least_force_n(&self) -> f64 {
        self.least_moment_nmm / self.cache.tuning.gentlest_bend_mm
    }

    fn friction_off(&self) -> f64 {
        unsettled(self.friction.sliders.iter(), self.least_force_n())
    }
}

impl WallContact<'_> {
    /// ρ of a point, N/mm.
    pub(super) fn penalty_n_per_mm(&self, index: usize, elements: &[ElementData]) -> f64 {
        let point = &self.points[index];
        penalty_n_per_mm(point.weight_mm, &elements[point.element], self.cache.tuning.penalty)
    }

    /// The wall's modulus at the base position of a point.
    fn stiffness_at_base(&self, index: usize) -> regions::Stiffness {
        let known = &self.cache.points[index];
        self.surface.stiffness(&known.base, known.base_piece)
    }

    /// κ of a point for this modulus of the wall, N/mm.
    fn spring_with(&self, index: usize, stiffness: &regions::Stiffness) -> f64 {
        let point = &self.points[index];
        stiffness.factor * point.weight_mm * point.potential.modulus_n_per_mm2
    }

    /// The contact of a point at this distance at its base, with the gradient there.
    pub(super) fn contact(
        &self,
        index: usize,
        (distance_mm, gradient): (f64, Vec3),
        penalty_n_per_mm: f64,
    ) -> LinearContact<PointPlace> {
        let point = &self.points[index];
        let stiffness = self.stiffness_at_base(index);
        let springs = (self.spring_with(index, &stiffness), penalty_n_per_mm);
        let gap = (distance_mm - point.potential.radius_mm, gradient);
        let force_n = self.cache.points[index].force_n;
        let mut contact = LinearContact::new((index, point.place()), gap, springs, force_n);
        if let Some((slope_per_mm, _)) = stiffness.slope {
            contact.slope_per_mm = slope_per_mm;
        }
        contact
    }

    /// Contribution of a contact at its base, as gradient, N, and Hessian, N/mm.
    pub(super) fn press(
        &mut self,
        (elements, state): (&[ElementData], &RodState),
        into: &mut dyn Stencils,
        sum: &mut PointSum,
        index: usize,
    ) {
        let Some(pressed) = self.pressed(index) else { return };
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        self.rounding_n = self.rounding_n.max(ROUNDING * f64::EPSILON * pressed.kappa * known.base.amax());
        into.add_value(pressed.stored_mj);
        if !into.wants_hessian() {
            sum.add(point.xi, &pressed.gradient, None);
            return;
        }
        let Some(d) = self.cache.pressed(index) else { return };
        let excess = pressed.pressing + d.gradient * known.force_n;
        straighten((point.element, point.xi), &elements[point.element], state, &excess, into);
        sum.add(point.xi, &pressed.gradient, Some(&pressed.hessian(d, known.force_n)));
    }

    /// What the wall's elasticity does at a contact at its base; none where nothing presses.
    pub(super) fn pressed(&self, index: usize) -> Option<Pressed> {
        let d = self.cache.pressed(index)?;
        let point = &self.points[index];
        let stiffness = self.stiffness_at_base(index);
        let kappa = self.spring_with(index, &stiffness);
        let stored_mj = stiffness.factor * point.weight_mm * point.potential.value(d.value_mm);
        let pressing = d.gradient * (kappa * (d.value_mm - point.potential.radius_mm));
        let (along, graded) = stiffness.graded(stored_mj, &pressing);
        Some(Pressed { kappa, stored_mj, gradient: pressing + along, pressing, graded })
    }

    /// Merit of a point at a state, or the wall's energy there if forces have no target, mJ. Points are visited in
    /// ascending order; `next` is the first contact not yet visited.
    pub(super) fn contact_mj(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        index: usize,
        next: &mut usize,
    ) -> f64 {
        let (point, x) = (self.points[index], self.material(index, elements, state));
        let radius_mm = point.potential.radius_mm;
        let ContactSet { contacts, has_targets, .. } = &self.cache.set;
        let has_targets = *has_targets;
        *next += contacts[*next..].partition_point(|contact| contact.key < index);
        let contact = contacts.get(*next).filter(|contact| has_targets && contact.key == index);
        let force_n = contact.map_or(0.0, |contact| contact.target_n);
        // Where a force has a target, its distance off the wall counts as well.
        let limit_mm = if force_n > 0.0 { self.followed_mm(radius_mm) } else { self.asked_mm(radius_mm) };
        let depth_mm = radius_mm - self.read_within(index, &x, limit_mm).distance_mm();
        if force_n == 0.0 && depth_mm <= 0.0 {
            return 0.0;
        }
        let stiffness = self.surface.stiffness(&x, self.cache.points[index].piece);
        if !has_targets {
            return stiffness.factor * point.weight_mm * point.potential.value(radius_mm - depth_mm);
        }
        let rho = self.penalty_n_per_mm(index, elements);
        merit(self.spring_with(index, &stiffness), rho, force_n, depth_mm).0
    }
}
