//! Contact forces as unknowns beside the device's shape.
//!
//! With p = r − d the depth of a point, κ = w k and a force unknown f ≥ 0, equilibrium is ∇E − Σ f ∇d = 0 and f = κ
//! p₊. A thread presses on a hard wall by nanometres, and the error of a step along a curved wall is larger: forces
//! indicate contact much better than depths. So a point is active while
//!
//! ```text
//! f + ρ p > 0,    ρ = c w EI/h⁴
//! ```
//!
//! with a penalty ρ of the magnitude of the element's own stiffness. Newton's method for x and f, with f eliminated,
//! is
//!
//! ```text
//! (∇∇E − Σ f ∇∇d + Σ κ ∇d ∇dᵀ) δx = −(∇E − Σ κ p ∇d),    f⁺ = κ (p − ∇d·δx)
//! ```
//!
//! over the active points, the primal-dual active set method (M. Hintermüller, K. Ito, K. Kunisch, *The primal-dual active set strategy as a semismooth
//! Newton method*, SIAM J. Optim. 13 (2002)). The merit along the step is the augmented Lagrangian at f⁺ (R. T. Rockafellar, *Augmented Lagrange
//! multiplier functions and duality in nonconvex programming*, SIAM J. Control 12 (1974)), with the depth s = f/κ by which the wall gives way
//! minimised out,
//!
//! ```text
//! E(x) + Σ [κ t²/(2 ρ (κ + ρ)) − f⁺²/(2 ρ)],    t = (f⁺ + ρ p)₊,    force κ t/(κ + ρ)
//! ```
//!
//! which is as soft as the rod, so second-order errors of a step cost nothing there.
//!
//! Where the modulus varies, κ = κ₀ eˢ, the merit also has a gradient towards the softer side: ½ κ p² ∇s where f = κ
//! p, like the energy, plus
//!
//! ```text
//! κ t²/(2 (κ + ρ)²) ∇s
//! ```
//!
//! The Hessian includes the energy's contribution ([`Stiffness::graded`]); the planes of points that become active do
//! not.

use super::model::straighten;
use super::{ROUNDING, WallContact};
use crate::Vec3;
use crate::contact::force::{PENALTY, merit};
use crate::contact::point::FOLLOW;
use crate::contact::regions::Stiffness;
use crate::rod::{ElementData, PointSum, RodState, Stencils};
use crate::solve::{ContactMerit, Moved};

impl WallContact<'_> {
    /// ρ of a point, N/mm.
    pub(super) fn penalty_n_per_mm(&self, index: usize, elements: &[ElementData]) -> f64 {
        let point = &self.points[index];
        let element = &elements[point.element];
        PENALTY * point.weight_mm * element.bending[1] / element.length.powi(4)
    }

    /// The wall's modulus at the base position of a point.
    fn stiffness_at_base(&self, index: usize) -> Stiffness {
        let known = &self.cache.points[index];
        self.surface.stiffness(&known.base, known.base_piece)
    }

    /// κ of a point for this modulus of the wall, N/mm.
    fn spring_with(&self, index: usize, stiffness: &Stiffness) -> f64 {
        let point = &self.points[index];
        stiffness.factor * point.weight_mm * point.potential.modulus_n_per_mm2
    }

    /// κ of a point at the base, N/mm, and ∇s, 1/mm.
    pub(super) fn spring_at_base(&self, index: usize) -> (f64, Vec3) {
        let stiffness = self.stiffness_at_base(index);
        (self.spring_with(index, &stiffness), stiffness.slope.map_or_else(Vec3::zeros, |(slope, _)| slope))
    }

    /// Contribution of point `index`, active at its base, as gradient, N, and Hessian, N/mm.
    pub(super) fn press(
        &mut self,
        (elements, state): (&[ElementData], &RodState),
        into: &mut dyn Stencils,
        sum: &mut PointSum,
        index: usize,
    ) {
        let Some(d) = self.cache.pressed(index) else { return };
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        let stiffness = self.stiffness_at_base(index);
        let kappa = self.spring_with(index, &stiffness);
        self.rounding_n = self.rounding_n.max(ROUNDING * f64::EPSILON * kappa * known.base.amax());
        let stored_mj = stiffness.factor * point.weight_mm * point.potential.value(d.value_mm);
        into.add_value(stored_mj);
        let pressing = d.gradient * (kappa * (d.value_mm - point.potential.radius_mm));
        let (along, graded) = stiffness.graded(stored_mj, &pressing);
        if !into.wants_hessian() {
            sum.add(point.xi, &(pressing + along), None);
            return;
        }
        let excess = pressing + d.gradient * known.force_n;
        straighten(point, &elements[point.element], state, &excess, into);
        let plane = d.gradient * d.gradient.transpose();
        let hessian = plane * kappa - d.hessian * known.force_n + graded;
        sum.add(point.xi, &(pressing + along), Some(&hessian));
    }

    /// See [`Contacts::merit`](crate::solve::Contacts::merit).
    pub(super) fn contact_merit(&mut self, moved: &dyn Moved) -> ContactMerit {
        let mut sum = ContactMerit::default();
        for k in 0..self.cache.foreseen.len() {
            let mut contact = self.cache.foreseen[k];
            let way = moved.point(self.points[contact.index].place()).0;
            contact.change_mm = way.dot(&contact.gradient);
            // The force that balances the rod's own stiffness, which is κ (p − ∇d·δx) once the contacts at the end
            // are found.
            contact.aim_n = (-contact.carried_n).max(0.0);
            self.cache.foreseen[k] = contact;
            let (kappa, depth_mm) = (contact.spring_n_per_mm, -contact.gap_mm);
            let rho = contact.penalty_n_per_mm;
            let (value_mj, force_n, by_modulus_mj) = merit(kappa, rho, contact.aim_n, depth_mm);
            let assembled_n = if contact.at_base { kappa * depth_mm } else { 0.0 };
            let stored_mj = 0.5 * kappa * depth_mm.max(0.0).powi(2);
            sum.slope_mj += (assembled_n - force_n) * contact.change_mm;
            sum.slope_mj += (by_modulus_mj - stored_mj) * way.dot(&contact.slope_per_mm);
            sum.excess_mj += value_mj - stored_mj;
            sum.size_mj += value_mj.abs() + contact.aim_n * contact.aim_n / rho;
        }
        self.cache.aimed = true;
        sum
    }

    /// Merit of a point at a state, or the wall's energy there if forces have no target, mJ. Points are visited in
    /// ascending order; `next` is the first of `foreseen` not yet visited.
    pub(super) fn contact_mj(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        index: usize,
        next: &mut usize,
    ) -> f64 {
        let (point, x) = (self.points[index], self.material(index, elements, state));
        let radius_mm = point.potential.radius_mm;
        let foreseen = &self.cache.foreseen;
        *next += foreseen[*next..].partition_point(|contact| contact.index < index);
        let contact = foreseen.get(*next).filter(|contact| self.cache.aimed && contact.index == index);
        let force_n = contact.map_or(0.0, |contact| contact.aim_n);
        // Where a force has a target, its distance off the wall counts as well.
        let limit_mm = if force_n > 0.0 { (1.0 + FOLLOW) * radius_mm } else { self.asked_mm(radius_mm) };
        let depth_mm = radius_mm - self.read_within(index, &x, limit_mm).distance_mm();
        if force_n == 0.0 && depth_mm <= 0.0 {
            return 0.0;
        }
        let stiffness = self.surface.stiffness(&x, self.cache.points[index].piece);
        if !self.cache.aimed {
            return stiffness.factor * point.weight_mm * point.potential.value(radius_mm - depth_mm);
        }
        let rho = self.penalty_n_per_mm(index, elements);
        merit(self.spring_with(index, &stiffness), rho, force_n, depth_mm).0
    }

    /// See [`Contacts::take`](crate::solve::Contacts::take).
    pub(super) fn take_forces(&mut self, part: f64) {
        for contact in &self.cache.foreseen {
            let force_n = &mut self.cache.points[contact.index].force_n;
            *force_n += part * (contact.aim_n - *force_n);
        }
    }

    /// Releases points that pull by more than this fraction of the largest pressing force. Returns whether there were
    /// none.
    pub(super) fn let_go_of_pulling(&mut self, tolerance: f64) -> bool {
        let (mut pull_n, mut press_n) = (0.0, self.least_force_n());
        for (index, d) in self.cache.all_pressed() {
            let depth_mm = self.points[index].potential.radius_mm - d.value_mm;
            let force_n = self.spring_with(index, &self.stiffness_at_base(index)) * depth_mm;
            pull_n -= force_n.min(0.0);
            press_n += force_n.max(0.0);
        }
        if pull_n <= tolerance * press_n {
            return true;
        }
        for &index in &self.cache.pressing {
            let known = &mut self.cache.points[index];
            if known.base_clearance_mm > self.points[index].potential.radius_mm {
                known.force_n = 0.0;
            }
        }
        false
    }
}
