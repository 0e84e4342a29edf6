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
use crate::contact::point::FOLLOW;
use crate::rod::quadrature::hermite;
use crate::rod::{ElementData, PointSum, RodState, Stencils};

/// A wall that bends away from the lumen by less than this, 1/mm, has no crest.
const CREST_PER_MM: f64 = 1e-3;

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
    /// Whether the matrix knows of it.
    presses: bool,
}

impl WallContact<'_> {
    /// See [`External::foresee`](crate::solve::External::foresee).
    pub(super) fn foresee_contacts(&mut self, moved: &dyn Fn((usize, f64), &Vec3) -> f64) -> bool {
        let mut foreseen = std::mem::take(&mut self.memory.foreseen);
        foreseen.clear();
        for (index, point) in self.points.iter().enumerate() {
            let Some(d) = self.memory.pressed(index) else { continue };
            foreseen.push(Foreseen {
                index,
                gap_mm: [
                    d.value_mm - point.potential.radius_mm,
                    moved((point.element, point.xi), &d.gradient),
                ],
                gradient: d.gradient,
                spring_n_per_mm: self.weight_mm(index) * point.potential.modulus_n_per_mm2,
                presses: true,
            });
        }
        self.memory.foreseen = foreseen;
        !self.memory.foreseen.is_empty()
    }

    /// See [`External::meet`](crate::solve::External::meet).
    pub(super) fn meet_contacts(
        &mut self,
        elements: &[ElementData],
        trial: &RodState,
        part: f64,
        moved: &dyn Fn((usize, f64), &Vec3) -> f64,
    ) -> bool {
        let known = self.memory.foreseen.len();
        let mut next = 0;
        for index in 0..self.points.len() {
            if next < known && self.memory.foreseen[next].index == index {
                next += 1;
                continue;
            }
            let point = self.points[index];
            let (x, radius_mm) = (self.material(index, elements, trial), point.potential.radius_mm);
            let limit_mm = (1.0 + FOLLOW) * radius_mm;
            let Reading::Pressed(d) = self.read_within(index, &x, limit_mm) else { continue };
            let factor = self.felt.stiffness(&x, self.memory.points[index].triangle, self.softness).factor;
            let change_mm = moved((point.element, point.xi), &d.gradient);
            // At the base it does not press, whatever the plane says of there.
            let plane_mm = d.value_mm - radius_mm - part * change_mm;
            let base_mm = self.memory.points[index].base_clearance_mm - radius_mm;
            let gap_mm = if plane_mm < 0.0 { base_mm.max(0.0) } else { plane_mm };
            self.memory.foreseen.push(Foreseen {
                index,
                gap_mm: [gap_mm, change_mm],
                gradient: d.gradient,
                spring_n_per_mm: factor * point.weight_mm * point.potential.modulus_n_per_mm2,
                presses: false,
            });
        }
        self.memory.foreseen.sort_unstable_by_key(|contact| contact.index);
        self.memory.foreseen.len() > known
    }

    /// See [`External::press_or_let_go`](crate::solve::External::press_or_let_go).
    pub(super) fn press_or_let_go_contacts(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        moved: &dyn Fn((usize, f64), &Vec3) -> f64,
        into: &mut dyn Stencils,
    ) -> usize {
        let mut changed = 0;
        for contact in &mut self.memory.foreseen {
            let point = &self.points[contact.index];
            contact.gap_mm[1] = moved((point.element, point.xi), &contact.gradient);
            let presses = contact.gap_mm[0] + contact.gap_mm[1] < 0.0;
            if presses == contact.presses {
                continue;
            }
            (contact.presses, changed) = (presses, changed + 1);
            let spring = if presses { contact.spring_n_per_mm } else { -contact.spring_n_per_mm };
            let along = contact.gradient * spring;
            let mut sum = PointSum::default();
            sum.add(point.xi, &(along * contact.gap_mm[0]), Some(&(along * contact.gradient.transpose())));
            into.add_points(base, &elements[point.element], point.element, &sum);
        }
        changed
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
        for k in 0..self.memory.foreseen.len() {
            let contact = self.memory.foreseen[k];
            let Foreseen { index, gap_mm: [gap, change], gradient, spring_n_per_mm, presses } = contact;
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

    /// See [`External::convexify`](crate::solve::External::convexify).
    pub(super) fn convexify_contacts(
        &mut self,
        elements: &[ElementData],
        base: &RodState,
        into: &mut dyn Stencils,
    ) -> bool {
        let mut any = false;
        for (index, point) in self.points.iter().enumerate() {
            let Some(d) = self.memory.pressed(index) else { continue };
            let press = -self.weight_mm(index) * point.potential.derivatives(d.value_mm).0;
            let curvature = d.hessian.symmetric_eigen();
            let mut crest = Matrix3::zeros();
            for (value, way) in curvature.eigenvalues.iter().zip(curvature.eigenvectors.column_iter()) {
                if *value > 0.0 {
                    crest += way * way.transpose() * (press * value);
                }
            }
            let (e, h) = (point.element, elements[point.element].length);
            if curvature.eigenvalues.max() > CREST_PER_MM {
                any = true;
                let mut sum = PointSum::default();
                sum.add(point.xi, &Vec3::zeros(), Some(&crest));
                into.add_points(base, &elements[e], e, &sum);
            }
            // A tangent that turns on its sphere moves back along itself by ½ δ² as well.
            let [_, near, _, far] = hermite(point.xi);
            for (node, share) in [(e, near), (e + 1, far)] {
                let back = -press * share * h * d.gradient.dot(&base.frames[node].t);
                if back > 0.0 {
                    any = true;
                    let turn = Matrix3::from_diagonal(&Vec3::new(back, back, 0.0));
                    into.add_turn(node, &Vec3::zeros(), &turn);
                }
            }
        }
        any
    }
}
