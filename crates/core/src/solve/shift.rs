//! Inertia and shift: a uniform tension is added to a matrix until it has the inertia of a minimum.
//!
//! A minimum has one negative pivot per multiplier. If there are more, the stiffness of a uniform tension
//! ([`Assembly::unit_shift`]) is added until the number is right (Nocedal and Wright, *Numerical Optimization*, 2nd
//! ed., section 3.4, with the inertia in place of a failed Cholesky factorisation).

use super::newton::{Newton, Problem};
use super::report::StopReason;
use crate::banded::{FactorError, Inertia};
use crate::rod::{Assembly, ElementData, Supports};

impl<const C: usize> Newton<C> {
    /// Inertia of the assembled matrix with the shift `sigma`; `None` where it cannot be factored.
    pub(crate) fn inertia(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        sigma: f64,
    ) -> Option<Inertia> {
        Assembly::<C>::unit_shift(elements, &supports.held::<C>(), &mut self.unit_shift);
        self.factor.factor_shifted(&self.assembly, &self.unit_shift, sigma).ok()
    }

    /// Factors the assembled matrix with the regularisation, for the inverse.
    pub(crate) fn factor(&mut self, elements: &[ElementData], supports: &Supports) -> Option<Inertia> {
        self.inertia(elements, supports, self.regularisation(elements))
    }

    /// Replaces a right-hand side by the solution with the matrix factored last.
    pub(crate) fn apply_inverse(&self, elements: &[ElementData], b: &mut [f64]) {
        self.factor.solve(b);
        Self::restore_tensions(elements, b);
    }

    /// Newton's step from the assembled state with the regularisation, and the inertia of its matrix; `None` where
    /// that cannot be factored.
    pub(crate) fn full_step(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
    ) -> Option<(Inertia, &[f64])> {
        let inertia = self.factor(elements, supports)?;
        self.right_hand_side();
        self.factor.solve(&mut self.step);
        Self::restore_tensions(elements, &mut self.step);
        Some((inertia, &self.step))
    }

    /// Sets `step` to the right-hand side of Newton's step.
    pub(super) fn right_hand_side(&mut self) {
        let (residual, correction) = (&self.assembly.residual, &self.assembly.correction);
        for (s, (r, c)) in self.step.iter_mut().zip(residual.iter().zip(correction)) {
            *s = -(r + c);
        }
    }

    /// The regularisation: the shift that is always added.
    pub(crate) fn regularisation(&self, elements: &[ElementData]) -> f64 {
        let rods = || elements.iter().filter(|data| !data.is_break());
        let length: f64 = rods().map(|e| e.length).sum();
        // EI averaged like springs in series: the effective stiffness of the whole rod.
        let soft: f64 = rods().map(|e| e.length / e.bending[1]).sum();
        self.tuning.regularisation / (length * soft)
    }

    /// Factors the matrix and solves for the step with the regularisation. If a minimum is sought and the inertia is
    /// not that of one, a growing shift is added ([`Self::first_shift`]). Returns the shift, 0 if none was added, and
    /// the inertia of the unshifted matrix if it could be factored.
    pub(super) fn factor_shifted(
        &mut self,
        problem: &Problem<'_>,
    ) -> Result<(f64, Option<Inertia>), StopReason> {
        let regularisation = self.regularisation(problem.elements);
        let wanted = problem.minimum.then(|| problem.multipliers());
        let right = |found: &Result<Inertia, FactorError>| {
            found.as_ref().is_ok_and(|inertia| wanted.is_none_or(|negative| inertia.negative == negative))
        };
        let found = self.factor_step(regularisation);
        let natural = found.as_ref().ok().copied();
        if right(&found) {
            return Ok((0.0, natural));
        }
        let mut sigma = self.first_shift(problem.elements);
        for attempt in 0..self.tuning.shifts {
            let found = self.factor_step(regularisation + sigma);
            if right(&found) {
                return Ok((sigma, natural));
            }
            if attempt > 20 && matches!(found, Err(FactorError::NotFinite { .. })) {
                return Err(StopReason::NotFinite);
            }
            sigma *= self.tuning.shift_growth;
        }
        Err(StopReason::Singular)
    }

    /// The first shift to try.
    pub(super) fn first_shift(&self, elements: &[ElementData]) -> f64 {
        let Self { tuning, last_shift, .. } = self;
        (tuning.least_shift * self.regularisation(elements)).max(tuning.shift_decay * last_shift)
    }

    /// Factors the assembled matrix with a shift, and solves for the step.
    pub(super) fn factor_step(&mut self, sigma: f64) -> Result<Inertia, FactorError> {
        self.solves += 1;
        self.right_hand_side();
        let Self { assembly, unit_shift, step, .. } = self;
        self.factor.factor_solve_shifted(assembly, unit_shift, sigma, step)
    }
}
