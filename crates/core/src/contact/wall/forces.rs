//! Contact forces as unknowns beside the device's shape.
//!
//! With p = r − d the depth of a point, κ = w k and a force f ≥ 0 of its own, equilibrium is ∇E − Σ f ∇d = 0 and f = κ p₊. A thread presses on a hard
//! wall by nanometres, and a step along a curved wall is off it by more: depths say little of what presses, and forces much. So a point is
//! active while
//!
//! ```text
//! f + ρ p > 0,    ρ = c w EI/h⁴
//! ```
//!
//! with a penalty ρ of the size of the element's own stiffness. Newton's method for x and f, with f eliminated, is
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
//! which is as soft as the rod: what is of second order in a step costs nothing there.
//!
//! Where the modulus differs from place to place κ stays that of the base in a step, and ½ k p² ∇s, by which it pulls along the wall, is a dead load.

use super::WallContact;
use crate::Vec3;
use crate::contact::Distance;
use crate::rod::{ElementData, RodState};
use crate::solve::{ContactMerit, Moved};

/// c: ρ over the stiffness of the element. Larger ones let points go and take them up by less depth, smaller ones by less force.
const PENALTY: f64 = 0.1;

/// Merit of a point, mJ, and its force, N.
fn merit(kappa: f64, rho: f64, force_n: f64, depth_mm: f64) -> (f64, f64) {
    let t = (force_n + rho * depth_mm).max(0.0);
    (0.5 * kappa * t * t / (rho * (kappa + rho)) - 0.5 * force_n * force_n / rho, kappa * t / (kappa + rho))
}

impl WallContact<'_> {
    /// ρ of a point, N/mm.
    pub(super) fn penalty_n_per_mm(&self, index: usize, elements: &[ElementData]) -> f64 {
        let point = &self.points[index];
        let element = &elements[point.element];
        PENALTY * point.weight_mm * element.bending[1] / element.length.powi(4)
    }

    /// κ of a point at the base, N/mm.
    pub(super) fn spring_n_per_mm(&self, index: usize) -> f64 {
        let known = &self.cache.points[index];
        let factor = self.surface.stiffness(&known.base, known.base_triangle).factor;
        factor * self.points[index].weight_mm * self.points[index].potential.modulus_n_per_mm2
    }

    /// What the slope of the modulus does to a point that presses at the base, as a gradient, N.
    pub(super) fn along_n(&self, index: usize, d: &Distance) -> Vec3 {
        let (point, known) = (&self.points[index], &self.cache.points[index]);
        let stiffness = self.surface.stiffness(&known.base, known.base_triangle);
        let stored_mj = stiffness.factor * point.weight_mm * point.potential.value(d.value_mm);
        stiffness.slope.map_or_else(Vec3::zeros, |(slope, _)| slope * stored_mj)
    }

    /// See [`Contacts::merit`](crate::solve::Contacts::merit).
    pub(super) fn contact_merit(&mut self, moved: &Moved<'_>) -> ContactMerit {
        let mut sum = ContactMerit::default();
        for k in 0..self.cache.foreseen.len() {
            let mut contact = self.cache.foreseen[k];
            contact.change_mm = moved(self.points[contact.index].place()).0.dot(&contact.gradient);
            // What the rod's own stiffness is in balance with, which is κ (p − ∇d·δx) where the contacts at the end are found.
            contact.aim_n = (-contact.carried_n).max(0.0);
            self.cache.foreseen[k] = contact;
            let (kappa, depth_mm) = (contact.spring_n_per_mm, -contact.gap_mm);
            let rho = contact.penalty_n_per_mm;
            let (value_mj, force_n) = merit(kappa, rho, contact.aim_n, depth_mm);
            let assembled_n = if contact.at_base { kappa * depth_mm } else { 0.0 };
            let stored_mj = 0.5 * kappa * depth_mm.max(0.0).powi(2);
            sum.slope_mj += (assembled_n - force_n) * contact.change_mm;
            sum.excess_mj += value_mj - stored_mj;
            sum.size_mj += value_mj.abs() + contact.aim_n * contact.aim_n / rho;
        }
        self.cache.aimed = true;
        sum
    }

    /// Merit of a point at a state, or what the wall stores there if no forces are aimed at, mJ. Points are asked for in ascending order; `next` is
    /// the first of those foreseen that is not yet.
    pub(super) fn contact_mj(
        &mut self,
        elements: &[ElementData],
        state: &RodState,
        index: usize,
        next: &mut usize,
    ) -> f64 {
        let (point, x) = (self.points[index], self.material(index, elements, state));
        let radius_mm = point.potential.radius_mm;
        let limit_mm = self.asked_mm(radius_mm);
        let depth_mm = radius_mm - self.read_within(index, &x, limit_mm).distance_mm();
        if !self.cache.aimed {
            let factor = self.surface.stiffness(&x, self.cache.points[index].triangle).factor;
            return factor * point.weight_mm * point.potential.value(radius_mm - depth_mm);
        }
        let foreseen = &self.cache.foreseen;
        *next += foreseen[*next..].partition_point(|contact| contact.index < index);
        let contact = foreseen.get(*next).filter(|contact| contact.index == index);
        let force_n = contact.map_or(0.0, |contact| contact.aim_n);
        let dead_mj = contact.filter(|contact| contact.along_n != Vec3::zeros()).map_or(0.0, |contact| {
            let from = self.surface.place(&self.cache.points[index].base);
            contact.along_n.dot(&(point.position(elements, state) - from))
        });
        if force_n == 0.0 && depth_mm <= 0.0 {
            return dead_mj;
        }
        let rho = self.penalty_n_per_mm(index, elements);
        dead_mj + merit(self.spring_n_per_mm(index), rho, force_n, depth_mm).0
    }

    /// See [`Contacts::take`](crate::solve::Contacts::take).
    pub(super) fn take_forces(&mut self, part: f64) {
        for contact in &self.cache.foreseen {
            let force_n = &mut self.cache.points[contact.index].force_n;
            *force_n += part * (contact.aim_n - *force_n);
        }
    }

    /// Lets points go that pull by more than this part of what the others press with. Returns whether there are none.
    pub(super) fn let_go_of_pulling(&mut self, tolerance: f64) -> bool {
        let (mut pull_n, mut press_n) = (0.0, self.least_force_n());
        for (index, d) in self.cache.all_pressed() {
            let depth_mm = self.points[index].potential.radius_mm - d.value_mm;
            let force_n = self.spring_n_per_mm(index) * depth_mm;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merit_falls_by_its_force_and_is_the_walls_energy_where_it_is_stiff() {
        let (kappa, rho) = (30.0, 2.0);
        for (force_n, depth_mm) in [(0.0, 0.1), (0.5, 0.02), (0.5, -0.1), (0.5, -0.3), (0.0, -0.1)] {
            let h = 1e-6;
            let at = |by: f64| merit(kappa, rho, force_n, depth_mm + by).0;
            let slope = (at(h) - at(-h)) / (2.0 * h);
            assert!((slope - merit(kappa, rho, force_n, depth_mm).1).abs() < 1e-8, "{force_n} {depth_mm}");
        }
        // At the depth of its force it exerts that, whatever the penalty.
        for rho in [0.1, 2.0, 1e4] {
            assert!((merit(kappa, rho, 0.6, 0.6 / kappa).1 - 0.6).abs() < 1e-12);
        }
        let depth_mm: f64 = 0.05;
        let stored_mj = 0.5 * kappa * depth_mm * depth_mm;
        assert!((merit(kappa, 1e9, 0.2, depth_mm).0 / stored_mj - 1.0).abs() < 1e-6);
        assert!(merit(kappa, rho, 0.2, depth_mm).0 < 0.5 * stored_mj);
    }
}
