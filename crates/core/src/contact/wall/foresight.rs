//! What a step of Newton's method does to the contacts, foreseen to first order, and how far a trial strays from that.
//!
//! A step δx from a base where point i presses with wᵢ k pᵢ leads to gᵢ + ∇dᵢ·δx, g = d − r, as long as that is negative. Walls and
//! the rod are curved, and a trial ends off it by what is of second order: micrometres, where a hard wall is pressed in by nanometres.
//! Seen from there a contact has been lost, or presses a thousand times too hard. So a trial is brought back with the matrix at hand,
//!
//! ```text
//! K η = −Σ wᵢ k (gᵢ(trial) − gᵢ − ∇dᵢ·δx) ∇dᵢ    over the points that are foreseen to press,
//! ```
//!
//! the second-order correction of sequential quadratic programming against the Maratos effect (Nocedal and Wright, *Numerical
//! Optimization*, 2nd ed., section 15.6).

use nalgebra::Matrix3;

use super::{Reading, WallContact};
use crate::Vec3;
use crate::contact::point::{ContactPoint, FOLLOW};
use crate::rod::quadrature::hermite;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::Moved;

/// A search ends where this part of the slope is left, …
const SEARCHED: f64 = 1e-3;
/// … and after so many trials.
const SEARCHES: usize = 60;

/// A contact in a step, and what that does to it.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Foreseen {
    /// Number of the point.
    index: usize,
    /// Gap d − r at the base, mm, and its change by the whole step, to first order, mm.
    gap_mm: [f64; 2],
    /// ∇d at the base, or where a trial has met the wall.
    gradient: Vec3,
    /// w k, N/mm.
    spring_n_per_mm: f64,
    /// The force that the rod's own stiffness is in balance with, as a spring's of that deflection, N.
    carried_n: f64,
    /// Whether it presses at the base.
    at_base: bool,
    /// Whether the matrix knows of it.
    presses: bool,
    /// Whether it is not let go in this step: without it there is no minimum.
    kept: bool,
}

impl Foreseen {
    /// Force of its spring in the system after a step that changes its gap so much, N.
    fn linear_n(&self, change_mm: f64) -> f64 {
        if self.presses { self.spring_n_per_mm * (self.gap_mm[0] + change_mm) } else { 0.0 }
    }

    /// Adds its spring to a system, or takes it away.
    fn switch(
        &self,
        point: &ContactPoint,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) {
        let sign = if self.presses { 1.0 } else { -1.0 };
        let along = self.gradient * (sign * self.spring_n_per_mm);
        let force = along * self.gap_mm[0];
        let hessian = along * self.gradient.transpose();
        let e = point.element;
        if self.gap_mm[0] >= 0.0 {
            straighten(point, &elements[e], base, &force, into);
        }
        let mut sum = PointSum::default();
        sum.add(point.xi, &force, Some(&hessian));
        into.add_points(base, &elements[e], e, &sum);
    }
}

/// Part of a way, at most all of it, up to which a convex function falls whose slope is given (the Illinois method).
pub(super) fn falls_until(slope: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = ((0.0, slope(0.0)), (1.0, slope(1.0)));
    if high.1 <= 0.0 || low.1 >= 0.0 {
        return 1.0;
    }
    let least = SEARCHED * -low.1;
    let mut last = 0.0;
    for _ in 0..SEARCHES {
        let part = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
        let here = slope(part);
        if here.abs() <= least {
            return part;
        }
        let (end, other) = if here < 0.0 { (&mut low, &mut high) } else { (&mut high, &mut low) };
        *end = (part, here);
        if last * here > 0.0 {
            other.1 *= 0.5;
        }
        last = here;
    }
    low.0
}

/// Takes away what a force on a point that is added to a system, as a gradient, does to the tangents as they turn: those by which a plane
/// that is not reached yet would pull, or friction is linear, are none under which they do.
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
    /// See [`External::foresee`](crate::solve::External::foresee).
    pub(super) fn foresee_contacts(&mut self, moved: &Moved<'_>) -> bool {
        let mut foreseen = std::mem::take(&mut self.cache.foreseen);
        foreseen.clear();
        self.cache.slipping.clear();
        for (index, d) in self.cache.all_pressed() {
            let point = &self.points[index];
            let (gap_mm, change_mm) =
                (d.value_mm - point.potential.radius_mm, moved(point.place()).0.dot(&d.gradient));
            let spring_n_per_mm = self.weight_mm(index) * point.potential.modulus_n_per_mm2;
            foreseen.push(Foreseen {
                index,
                gap_mm: [gap_mm, change_mm],
                gradient: d.gradient,
                spring_n_per_mm,
                carried_n: spring_n_per_mm * (gap_mm + change_mm),
                at_base: true,
                presses: true,
                kept: false,
            });
        }
        self.cache.foreseen = foreseen;
        !self.cache.foreseen.is_empty()
    }

    /// See [`External::meet`](crate::solve::External::meet).
    pub(super) fn meet_contacts(
        &mut self,
        elements: &[ElementData],
        trial: &RodState,
        part: f64,
        moved: &Moved<'_>,
    ) -> bool {
        let known = self.cache.foreseen.len();
        let (mut next, mut met) = (0, 0);
        for span in 0..self.cache.spans.len() {
            for index in self.near(span, elements, trial).into_iter().flatten() {
                next += self.cache.foreseen[next..known].partition_point(|contact| contact.index < index);
                let old = self.cache.foreseen[next..known].first().filter(|contact| contact.index == index);
                // Those that press are brought back to what was foreseen of them.
                if old.is_some_and(|contact| contact.presses) {
                    continue;
                }
                let old = old.copied();
                let Some(contact) = self.met(elements, trial, part, moved, (index, old.as_ref())) else {
                    continue;
                };
                met += 1;
                match old {
                    Some(_) => self.cache.foreseen[next] = contact,
                    None => self.cache.foreseen.push(contact),
                }
            }
        }
        self.cache.foreseen.sort_unstable_by_key(|contact| contact.index);
        met > 0
    }

    /// What point `index` meets at a trial, if it does; `old` is what was foreseen of it.
    fn met(
        &mut self,
        elements: &[ElementData],
        trial: &RodState,
        part: f64,
        moved: &Moved<'_>,
        (index, old): (usize, Option<&Foreseen>),
    ) -> Option<Foreseen> {
        let point = self.points[index];
        let (x, radius_mm) = (self.material(index, elements, trial), point.potential.radius_mm);
        let limit_mm = if old.is_some() { radius_mm } else { (1.0 + FOLLOW) * radius_mm };
        let Reading::Pressed(d) = self.read_within(index, &x, limit_mm) else { return None };
        let factor = self.surface.stiffness(&x, self.cache.points[index].triangle, self.softness).factor;
        let change_mm = moved(point.place()).0.dot(&d.gradient);
        // At the base it presses as it does there, or not at all, whatever the plane says of there.
        let at_base = old.is_some_and(|contact| contact.at_base);
        let plane_mm = d.value_mm - radius_mm - part * change_mm;
        let base_mm = self.cache.points[index].base_clearance_mm - radius_mm;
        let least_mm = if at_base { base_mm } else { base_mm.max(0.0) };
        let gap_mm = if plane_mm < 0.0 { least_mm } else { plane_mm };
        Some(Foreseen {
            index,
            gap_mm: [gap_mm, change_mm],
            gradient: d.gradient,
            spring_n_per_mm: factor * point.weight_mm * point.potential.modulus_n_per_mm2,
            carried_n: 0.0,
            at_base,
            presses: false,
            kept: false,
        })
    }

    /// See [`External::press_or_let_go`](crate::solve::External::press_or_let_go).
    pub(super) fn press_or_let_go_contacts(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &Moved<'_>,
        into: &mut dyn Stencils,
    ) -> usize {
        let mut changed = 0;
        for contact in &mut self.cache.foreseen {
            let point = &self.points[contact.index];
            contact.gap_mm[1] = moved(point.place()).0.dot(&contact.gradient);
            let presses = contact.gap_mm[0] + contact.gap_mm[1] < 0.0;
            if presses == contact.presses || contact.kept {
                continue;
            }
            (contact.presses, changed) = (presses, changed + 1);
            contact.switch(point, elements, base, into);
        }
        changed
    }

    /// See [`External::part_towards`](crate::solve::External::part_towards).
    pub(super) fn part_towards_contacts(&mut self, moved: &Moved<'_>, most: f64) -> f64 {
        let (mut ends, mut slips) = std::mem::take(&mut self.cache.ends);
        ends.clear();
        ends.extend(self.cache.foreseen.iter().map(|contact| {
            let point = &self.points[contact.index];
            moved(point.place()).0.dot(&contact.gradient)
        }));
        self.slips_to(moved, &mut slips);
        let slope = |part: f64| -> f64 {
            let each = self.cache.foreseen.iter().zip(&ends).map(|(contact, end)| {
                let way = end - contact.gap_mm[1];
                let there = contact.gap_mm[0] + contact.gap_mm[1] + part * way;
                let surface = if contact.kept { there } else { there.min(0.0) };
                let carried = contact.carried_n + part * (contact.linear_n(*end) - contact.carried_n);
                (contact.spring_n_per_mm * surface - carried) * way
            });
            each.sum::<f64>() + self.slipping_slope(&slips, part)
        };
        let part = falls_until(slope).min(most);
        for (contact, end) in self.cache.foreseen.iter_mut().zip(&ends) {
            contact.carried_n += part * (contact.linear_n(*end) - contact.carried_n);
        }
        self.carry_slipping(&slips, part);
        self.cache.ends = (ends, slips);
        part
    }

    /// See [`External::hold_on`](crate::solve::External::hold_on).
    pub(super) fn hold_on_contacts(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) -> usize {
        let mut kept = 0;
        for contact in self.cache.foreseen.iter_mut().filter(|contact| contact.at_base && !contact.presses) {
            (contact.presses, contact.kept, kept) = (true, true, kept + 1);
            contact.switch(&self.points[contact.index], elements, base, into);
        }
        kept
    }

    /// See [`External::stray`](crate::solve::External::stray).
    pub(super) fn stray_contacts(
        &mut self,
        elements: &[ElementData],
        (base, trial): (&RodState, &RodState),
        part: f64,
        into: &mut dyn Stencils,
    ) -> f64 {
        let (mut stray_n, mut foreseen_n) = (0.0, self.least_force_n());
        for k in 0..self.cache.foreseen.len() {
            let contact = self.cache.foreseen[k];
            let Foreseen { index, gap_mm: [gap, change], gradient, spring_n_per_mm, presses, .. } = contact;
            let foreseen_mm = gap + part * change;
            if !presses || foreseen_mm >= 0.0 {
                continue;
            }
            let point = self.points[index];
            let x = self.material(index, elements, trial);
            let limit_mm = self.asked_mm(point.potential.radius_mm);
            let gap_mm = self.read_within(index, &x, limit_mm).distance_mm() - point.potential.radius_mm;
            let force = gradient * (spring_n_per_mm * (gap_mm - foreseen_mm));
            stray_n += force.norm();
            foreseen_n -= spring_n_per_mm * foreseen_mm;
            let mut sum = PointSum::default();
            sum.add(point.xi, &force, None);
            into.add_points(base, &elements[point.element], point.element, &sum);
        }
        stray_n / foreseen_n
    }
}
