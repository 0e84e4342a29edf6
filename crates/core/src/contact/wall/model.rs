//! The contacts' part of the model of a Newton step: gaps to first order, and springs where they close.
//!
//! Point i has the gap gᵢ = dᵢ − r at the base and gᵢ + ∇dᵢ·δx at the end of a step, and presses there with κᵢ times
//! that if it is negative. Planes are needed for all points that a step may bring into contact, whether they touch at
//! the base or not; the others' planes have no effect. See [`crate::solve`] for the purpose of the model, and
//! [`super::forces`] for the merit along the step to its minimum.

use nalgebra::Matrix3;

use super::{Reading, WallContact};
use crate::Vec3;
use crate::contact::point::{ContactPoint, FOLLOW};
use crate::rod::quadrature::hermite;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::Moved;

/// Assumed bound of the distance's gradient: the smooth wall of a mesh is steeper than 1 near crests.
const STEEPEST: f64 = 2.0;

/// A contact in a step.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Foreseen {
    /// Number of the point.
    pub(super) index: usize,
    /// g at the base, mm.
    pub(super) gap_mm: f64,
    /// Its change in the full step, to first order, mm.
    pub(super) change_mm: f64,
    /// ∇d at the base.
    pub(super) gradient: Vec3,
    /// κ, N/mm.
    pub(super) spring_n_per_mm: f64,
    /// ∇s, the relative slope of κ, 1/mm.
    pub(super) slope_per_mm: Vec3,
    /// ρ, N/mm.
    pub(super) penalty_n_per_mm: f64,
    /// The force that balances the rod's own stiffness, N; negative where it presses.
    pub(super) carried_n: f64,
    /// Whether it is active in the system at the base.
    pub(super) at_base: bool,
    /// Whether it is active now.
    presses: bool,
    /// f⁺: the force at the end of the step, N.
    pub(super) aim_n: f64,
}

/// A point near the wall that no step has brought into contact.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Aside {
    /// Number of the point.
    index: usize,
    /// Lower bound of g at the base, mm.
    clear_mm: f64,
    /// ρ, N/mm.
    penalty_n_per_mm: f64,
    /// Its displacement in the step, mm.
    way: Vec3,
}

impl Foreseen {
    /// Force of its spring in the system after a step with this change of its gap, N.
    fn linear_n(&self, change_mm: f64) -> f64 {
        if self.presses { self.spring_n_per_mm * (self.gap_mm + change_mm) } else { 0.0 }
    }

    /// Adds its spring to a system, or removes it.
    fn switch(
        &self,
        point: &ContactPoint,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) {
        let sign = if self.presses { 1.0 } else { -1.0 };
        let along = self.gradient * (sign * self.spring_n_per_mm);
        let force = along * self.gap_mm;
        let e = point.element;
        straighten(point, &elements[e], base, &force, into);
        let mut sum = PointSum::default();
        sum.add(point.xi, &force, Some(&(along * self.gradient.transpose())));
        into.add_points(base, &elements[e], e, &sum);
    }
}

/// Removes the effect of a point force, added as a gradient, on the rotation of tangents: springs not under that
/// force, or linearised friction, have no such effect.
pub(super) fn straighten(
    point: &ContactPoint,
    element: &ElementData,
    base: &RodState,
    force: &Vec3,
    into: &mut dyn Stencils,
) {
    let [_, near, _, far] = hermite(point.xi);
    for (node, share) in [(point.element, near), (point.element + 1, far)] {
        let back = share * element.length * force.dot(&base.frames[node].t);
        into.add_turn(node, &Vec3::zeros(), &Matrix3::from_diagonal(&Vec3::new(back, back, 0.0)));
    }
}

impl WallContact<'_> {
    /// See [`Contacts::foresee`](crate::solve::Contacts::foresee).
    pub(super) fn foresee_contacts(&mut self, elements: &[ElementData], base: &RodState, moved: &dyn Moved) {
        if self.cache.foreseen.is_empty() && self.cache.aside.is_empty() {
            for span in 0..self.cache.spans.len() {
                for index in self.near(span, elements, base).into_iter().flatten() {
                    self.note(index, elements);
                }
            }
        }
        self.take_note_of_ways(moved);
        for contact in &mut self.cache.foreseen {
            contact.change_mm = moved.point(self.points[contact.index].place()).0.dot(&contact.gradient);
            contact.carried_n = contact.linear_n(contact.change_mm);
        }
    }

    /// Records a point that is active at the base, or near the wall there.
    fn note(&mut self, index: usize, elements: &[ElementData]) {
        let penalty_n_per_mm = self.penalty_n_per_mm(index, elements);
        let (known, radius_mm) = (&self.cache.points[index], self.points[index].potential.radius_mm);
        if known.presses {
            let contact = self.at_base(index, penalty_n_per_mm);
            self.cache.foreseen.extend(contact);
        } else if known.base_clearance_mm < (1.0 + FOLLOW) * radius_mm {
            let clear_mm = known.base_clearance_mm - radius_mm;
            self.cache.aside.push(Aside { index, clear_mm, penalty_n_per_mm, way: Vec3::zeros() });
        }
    }

    /// Moves to `foreseen` the points aside that a step may bring into contact. The planes of the others are out of
    /// its reach.
    fn take_note_of_ways(&mut self, moved: &dyn Moved) {
        let mut aside = std::mem::take(&mut self.cache.aside);
        let before = self.cache.foreseen.len();
        aside.retain(|point| {
            let way_mm = moved.point(self.points[point.index].place()).0.norm();
            let stays = STEEPEST * way_mm <= point.clear_mm;
            if !stays && let Some(mut contact) = self.at_base(point.index, point.penalty_n_per_mm) {
                contact.change_mm = point.way.dot(&contact.gradient);
                self.cache.foreseen.push(contact);
            }
            stays
        });
        self.cache.aside = aside;
        if self.cache.foreseen.len() > before {
            self.cache.foreseen.sort_unstable_by_key(|contact| contact.index);
        }
    }

    /// The linearised contact at the base of a point that may touch.
    fn at_base(&mut self, index: usize, penalty_n_per_mm: f64) -> Option<Foreseen> {
        let radius_mm = self.points[index].potential.radius_mm;
        let at_base = self.cache.points[index].presses;
        let d = if at_base {
            *self.cache.pressed(index)?
        } else {
            let (x, near_mm) = (self.cache.points[index].base, (1.0 + FOLLOW) * radius_mm);
            let Reading::Pressed(d) = self.read_within(index, &x, near_mm) else { return None };
            d
        };
        let (spring_n_per_mm, slope_per_mm) = self.spring_at_base(index);
        Some(Foreseen {
            index,
            gap_mm: d.value_mm - radius_mm,
            change_mm: 0.0,
            gradient: d.gradient,
            spring_n_per_mm,
            slope_per_mm,
            penalty_n_per_mm,
            carried_n: 0.0,
            at_base,
            presses: at_base,
            aim_n: 0.0,
        })
    }

    /// See [`Contacts::press_or_let_go`](crate::solve::Contacts::press_or_let_go).
    pub(super) fn press_or_let_go_contacts(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Moved,
        into: &mut dyn Stencils,
    ) -> usize {
        for point in &mut self.cache.aside {
            point.way = moved.point(self.points[point.index].place()).0;
        }
        let mut changed = 0;
        for contact in &mut self.cache.foreseen {
            let point = &self.points[contact.index];
            contact.change_mm = moved.point(point.place()).0.dot(&contact.gradient);
            let presses = contact.gap_mm + contact.change_mm < 0.0;
            if presses != contact.presses {
                (contact.presses, changed) = (presses, changed + 1);
                contact.switch(point, elements, base, into);
            }
        }
        changed
    }

    /// See [`Contacts::look_towards`](crate::solve::Contacts::look_towards).
    pub(super) fn look_towards_contacts(&mut self, moved: &dyn Moved) {
        self.take_note_of_ways(moved);
        let (mut ends, mut slips) = std::mem::take(&mut self.cache.ends);
        ends.clear();
        ends.extend(self.cache.foreseen.iter().map(|contact| {
            let point = &self.points[contact.index];
            moved.point(point.place()).0.dot(&contact.gradient)
        }));
        self.slips_to(moved, &mut slips);
        self.cache.ends = (ends, slips);
    }

    /// See [`Contacts::slope_towards`](crate::solve::Contacts::slope_towards).
    pub(super) fn slope_towards_contacts(&self, part: f64) -> f64 {
        let (ends, slips) = &self.cache.ends;
        let each = self.cache.foreseen.iter().zip(ends).map(|(contact, end)| {
            let way = end - contact.change_mm;
            let there = contact.gap_mm + contact.change_mm + part * way;
            let carried = contact.carried_n + part * (contact.linear_n(*end) - contact.carried_n);
            (contact.spring_n_per_mm * there.min(0.0) - carried) * way
        });
        each.sum::<f64>() + self.slipping_slope(slips, part)
    }

    /// See [`Contacts::go_towards`](crate::solve::Contacts::go_towards).
    pub(super) fn go_towards_contacts(&mut self, part: f64) {
        let (ends, slips) = std::mem::take(&mut self.cache.ends);
        for (contact, end) in self.cache.foreseen.iter_mut().zip(&ends) {
            contact.carried_n += part * (contact.linear_n(*end) - contact.carried_n);
        }
        self.carry_slipping(&slips, part);
        self.cache.ends = (ends, slips);
    }
}
