//! A contact in a step: its gap to first order, a spring where that closes, and the merit of its force.
//! Derived in [`super`].

use super::{Stencil, System};
use crate::Vec3;
use crate::rod::ElementData;
use crate::solve::ContactMerit;

/// ρ of a contact that represents this length of an element, with the penalty c, N/mm.
#[inline]
pub(in crate::contact) fn penalty_n_per_mm(weight_mm: f64, element: &ElementData, c: f64) -> f64 {
    c * weight_mm * element.bending[1] / element.length.powi(4)
}

/// Merit of a contact, mJ, its force, N, and derivative in ln κ, mJ.
#[inline]
pub(in crate::contact) fn merit(kappa: f64, rho: f64, force_n: f64, depth_mm: f64) -> (f64, f64, f64) {
    let t = (force_n + rho * depth_mm).max(0.0);
    let by_force = t / (kappa + rho);
    let value_mj = 0.5 * (kappa * t * by_force - force_n * force_n) / rho;
    (value_mj, kappa * by_force, 0.5 * kappa * by_force * by_force)
}

/// A contact in a step.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct LinearContact<S> {
    /// Its number.
    pub(in crate::contact) key: usize,
    /// What it depends on.
    pub(in crate::contact) stencil: S,
    /// g at the base, mm.
    pub(in crate::contact) gap_mm: f64,
    /// Its change in the step, to first order, mm.
    change_mm: f64,
    /// Its change in the step that a round leads to, mm.
    pub(super) end_mm: f64,
    /// ∇g at the base.
    pub(in crate::contact) gradient: Vec3,
    /// κ, N/mm.
    pub(in crate::contact) spring_n_per_mm: f64,
    /// ∇s, the relative slope of κ, 1/mm.
    pub(in crate::contact) slope_per_mm: Vec3,
    /// ρ, N/mm.
    pub(in crate::contact) penalty_n_per_mm: f64,
    /// f, N.
    pub(in crate::contact) force_n: f64,
    /// f⁺: the force at the end of the step, N.
    pub(in crate::contact) target_n: f64,
    /// The force that balances the rod's own stiffness, N; negative where it presses.
    carried_n: f64,
    /// Whether it is active in the system at the base.
    pub(in crate::contact) at_base: bool,
    /// Whether it is active in the system now.
    is_active: bool,
}

impl<S: Stencil> LinearContact<S> {
    /// A contact of a number and what it depends on, with its gap at the base, mm, and the gradient of that, its
    /// stiffness and penalty, N/mm, and its force, N.
    #[inline]
    pub(in crate::contact) fn new(
        (key, stencil): (usize, S),
        (gap_mm, gradient): (f64, Vec3),
        (spring_n_per_mm, penalty_n_per_mm): (f64, f64),
        force_n: f64,
    ) -> Self {
        let active = force_n - penalty_n_per_mm * gap_mm > 0.0;
        Self {
            key,
            stencil,
            gap_mm,
            change_mm: 0.0,
            end_mm: 0.0,
            gradient,
            spring_n_per_mm,
            slope_per_mm: Vec3::zeros(),
            penalty_n_per_mm,
            force_n,
            target_n: 0.0,
            carried_n: 0.0,
            at_base: active,
            is_active: active,
        }
    }

    /// A contact that is not in the system at the base, after the first part of a step.
    pub(super) fn met_on_the_way(self, way: &Vec3) -> Self {
        Self { change_mm: way.dot(&self.gradient), at_base: false, is_active: false, ..self }
    }

    /// Force of its spring in the system after a step with this change of its gap, N.
    #[inline]
    fn linear_n(&self, change_mm: f64) -> f64 {
        if self.is_active { self.spring_n_per_mm * (self.gap_mm + change_mm) } else { 0.0 }
    }

    /// Begins with a step that solves the system as it is.
    #[inline]
    pub(super) fn predict(&mut self, way: &Vec3) {
        self.change_mm = way.dot(&self.gradient);
        self.carried_n = self.linear_n(self.change_mm);
    }

    /// Adds its spring to the system if the step closes it, or removes it if the step opens it. Returns whether
    /// either is so.
    #[inline]
    pub(super) fn switches(&mut self, way: &Vec3, system: &mut System<'_>) -> bool {
        self.change_mm = way.dot(&self.gradient);
        let closes = self.gap_mm + self.change_mm < 0.0;
        if closes == self.is_active {
            return false;
        }
        self.is_active = closes;
        let along = self.gradient * if closes { self.spring_n_per_mm } else { -self.spring_n_per_mm };
        let stiffness = (along * self.gradient.transpose(), Vec3::zeros(), 0.0);
        self.stencil.add(system, &(along * self.gap_mm, 0.0), &stiffness);
        true
    }

    /// Slope of the model at a `part` of a round: of a spring that presses and never pulls, minus the work of the
    /// balanced force.
    #[inline]
    pub(super) fn slope(&self, part: f64) -> f64 {
        let way = self.end_mm - self.change_mm;
        let there = self.gap_mm + self.change_mm + part * way;
        let carried = self.carried_n + part * (self.linear_n(self.end_mm) - self.carried_n);
        (self.spring_n_per_mm * there.min(0.0) - carried) * way
    }

    /// Moves on by that part of the round.
    #[inline]
    pub(super) fn advance(&mut self, part: f64) {
        self.carried_n += part * (self.linear_n(self.end_mm) - self.carried_n);
    }

    /// Takes the force at the end of the step as target, and adds its contribution to the merit.
    #[inline]
    pub(super) fn set_target(&mut self, way: &Vec3, sum: &mut ContactMerit) {
        self.change_mm = way.dot(&self.gradient);
        // The force that balances the rod's own stiffness, which is κ (p − ∇g·δx) once the contacts at the end are
        // found.
        self.target_n = (-self.carried_n).max(0.0);
        let (kappa, rho, depth_mm) = (self.spring_n_per_mm, self.penalty_n_per_mm, -self.gap_mm);
        let (value_mj, force_n, by_modulus_mj) = merit(kappa, rho, self.target_n, depth_mm);
        let assembled_n = if self.at_base { kappa * depth_mm } else { 0.0 };
        let stored_mj = 0.5 * kappa * depth_mm.max(0.0).powi(2);
        sum.slope_mj += (assembled_n - force_n) * self.change_mm;
        sum.slope_mj += (by_modulus_mj - stored_mj) * way.dot(&self.slope_per_mm);
        sum.excess_mj += value_mj - stored_mj;
        sum.size_mj += value_mj.abs() + self.target_n * self.target_n / rho;
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
            let stiffer = |by: f64| merit(kappa * by.exp(), rho, force_n, depth_mm).0;
            let slope = (at(h) - at(-h)) / (2.0 * h);
            let (_, exerted_n, by_modulus_mj) = merit(kappa, rho, force_n, depth_mm);
            assert!((slope - exerted_n).abs() < 1e-8, "{force_n} {depth_mm}");
            let slope = (stiffer(h) - stiffer(-h)) / (2.0 * h);
            assert!((slope - by_modulus_mj).abs() < 1e-8, "{force_n} {depth_mm}");
        }
        // At the depth f/κ the force is f, whatever the penalty.
        for rho in [0.1, 2.0, 1e4] {
            assert!((merit(kappa, rho, 0.6, 0.6 / kappa).1 - 0.6).abs() < 1e-12);
        }
        let depth_mm: f64 = 0.05;
        let stored_mj = 0.5 * kappa * depth_mm * depth_mm;
        assert!((merit(kappa, 1e9, 0.2, depth_mm).0 / stored_mj - 1.0).abs() < 1e-6);
        assert!(merit(kappa, rho, 0.2, depth_mm).0 < 0.5 * stored_mj);
    }
}
