//! Inertia and shift: a matrix that is not that of a minimum is made one by a uniform tension.
//!
//! A minimum has one negative pivot for each multiplier. With more, the stiffness of a uniform tension ([`Assembly::unit_shift`]) is added until they are right
//! (Nocedal and Wright, *Numerical Optimization*, 2nd ed., section 3.4, with the inertia in the place of a failed Cholesky factorisation).

use super::newton::{Newton, Problem};
use super::report::StopReason;
use crate::banded::{FactorError, Inertia};
use crate::rod::{Assembly, ElementData, Supports};

/// Part of EI/L² that is always added as a uniform tension.
pub(super) const REGULARISATION: f64 = 1e-8;
/// Least shift, over the one that is always on.
const LEAST_SHIFT: f64 = 1e5;
/// A shift that does not do grows by this factor.
pub(super) const SHIFT_GROWTH: f64 = 4.0;
/// One is looked for from this part of the last on, which it falls to in an iteration that needs none.
pub(super) const SHIFT_DECAY: f64 = 1.0 / 8.0;
/// Shifts tried before a matrix is called singular.
pub(super) const SHIFTS: usize = 60;

impl<const C: usize> Newton<C> {
    /// Inertia of the assembled matrix with the shift `sigma`; `None` where it cannot be factored.
    pub fn inertia(&mut self, elements: &[ElementData], supports: &Supports, sigma: f64) -> Option<Inertia> {
        Assembly::<C>::unit_shift(elements, &supports.held::<C>(), &mut self.unit_shift);
        self.factor.factor_shifted(&self.assembly, &self.unit_shift, sigma).ok()
    }

    /// Factors the assembled matrix with the shift that is always on, for [`Self::apply_inverse`].
    pub fn factor(&mut self, elements: &[ElementData], supports: &Supports) -> Option<Inertia> {
        self.inertia(elements, supports, Self::regularisation(elements))
    }

    /// Replaces a right-hand side by the step that answers it, with the matrix factored last.
    pub fn apply_inverse(&self, elements: &[ElementData], b: &mut [f64]) {
        self.factor.solve(b);
        Self::restore_tensions(elements, b);
    }

    /// Newton's step from the assembled state, with the shift that is always on, and the inertia of its matrix; `None` where that
    /// cannot be factored.
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

    /// Sets the step to the right-hand side it answers.
    pub(super) fn right_hand_side(&mut self) {
        let (residual, correction) = (&self.assembly.residual, &self.assembly.correction);
        for (s, (r, c)) in self.step.iter_mut().zip(residual.iter().zip(correction)) {
            *s = -(r + c);
        }
    }

    /// The shift that is always on.
    pub(crate) fn regularisation(elements: &[ElementData]) -> f64 {
        let rods = || elements.iter().filter(|data| !data.is_break());
        let length: f64 = rods().map(|e| e.length).sum();
        // EI averaged as springs in series: the stiffness the whole rod shows.
        let soft: f64 = rods().map(|e| e.length / e.bending[1]).sum();
        REGULARISATION / (length * soft)
    }

    /// Factors the matrix and solves for the step under the regularisation. Where its inertia is not that of a minimum, if one is looked for, a
    /// shift is added and grows ([`Self::first_shift`]). Returns the shift, not 0 where the matrix is not that of the state, and the inertia of that
    /// if it could be factored.
    pub(super) fn factor_shifted(
        &mut self,
        problem: &Problem<'_>,
    ) -> Result<(f64, Option<Inertia>), StopReason> {
        let regularisation = Self::regularisation(problem.elements);
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
        for attempt in 0..SHIFTS {
            let found = self.factor_step(regularisation + sigma);
            if right(&found) {
                return Ok((sigma, natural));
            }
            if attempt > 20 && matches!(found, Err(FactorError::NotFinite { .. })) {
                return Err(StopReason::NotFinite);
            }
            sigma *= SHIFT_GROWTH;
        }
        Err(StopReason::Singular)
    }

    /// The shift that is tried first where one is wanted.
    pub(super) fn first_shift(&self, elements: &[ElementData]) -> f64 {
        (LEAST_SHIFT * Self::regularisation(elements)).max(SHIFT_DECAY * self.last_shift)
    }

    /// Factors the assembled matrix with a shift, and sets the step that it answers.
    pub(super) fn factor_step(&mut self, sigma: f64) -> Result<Inertia, FactorError> {
        self.solves += 1;
        self.right_hand_side();
        let Self { assembly, unit_shift, step, .. } = self;
        self.factor.factor_solve_shifted(assembly, unit_shift, sigma, step)
    }
}
