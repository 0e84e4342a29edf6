//! Factors of the assembled matrix: banded if it couples neighbouring nodes alone, sparse if distant nodes touch.

use crate::banded::{Factor, FactorError, Inertia, Shift};
use crate::coupled::CoupledFactor;
use crate::rod::Assembly;

/// A factorisation; its memory is reused.
#[derive(Debug, Clone)]
pub(super) struct Factors<const C: usize> {
    band: Factor<C>,
    /// Created with the first matrix that has couplings.
    coupled: Option<Box<CoupledFactor>>,
    /// Whether the matrix factored last had couplings.
    is_coupled: bool,
}

impl<const C: usize> Factors<C> {
    /// Allocates for matrices of this dimension.
    pub(super) fn new(dimension: usize) -> Self {
        Self { band: Factor::new(dimension), coupled: None, is_coupled: false }
    }

    /// Changes the dimension without releasing memory.
    pub(super) fn resize(&mut self, dimension: usize) {
        self.band.resize(dimension);
    }

    /// Inertia of the last matrix factored.
    pub(super) fn inertia(&self) -> Inertia {
        self.coupled().map_or_else(|| self.band.inertia(), CoupledFactor::inertia)
    }

    /// Factors the matrix with `factor` times `shift` and returns its inertia.
    pub(super) fn factor_shifted(
        &mut self,
        assembly: &Assembly<C>,
        shift: &Shift,
        factor: f64,
    ) -> Result<Inertia, FactorError> {
        self.is_coupled = !assembly.couplings.is_empty();
        if self.is_coupled {
            let coupled = self.coupled.get_or_insert_default();
            return coupled.factor_shifted(&assembly.matrix, &assembly.couplings, shift, factor);
        }
        self.band.factor_shifted(&assembly.matrix, shift, factor)
    }

    /// As [`Self::factor_shifted`], and replaces `b` by the solution. On an error `b` is overwritten with garbage.
    pub(super) fn factor_solve_shifted(
        &mut self,
        assembly: &Assembly<C>,
        shift: &Shift,
        factor: f64,
        b: &mut [f64],
    ) -> Result<Inertia, FactorError> {
        if assembly.couplings.is_empty() {
            self.is_coupled = false;
            return self.band.factor_solve_shifted(&assembly.matrix, shift, factor, b);
        }
        let inertia = self.factor_shifted(assembly, shift, factor)?;
        self.solve(b);
        Ok(inertia)
    }

    /// Replaces `b` by the solution with the matrix factored last.
    pub(super) fn solve(&self, b: &mut [f64]) {
        match self.coupled() {
            Some(coupled) => coupled.solve::<C>(b),
            None => self.band.solve(b),
        }
    }

    fn coupled(&self) -> Option<&CoupledFactor> {
        self.coupled.as_deref().filter(|_| self.is_coupled)
    }
}
