//! The inverse of a factored matrix, apart from the method that factored it.

use super::factors::Factors;
use super::newton::Newton;

/// The inverse of Newton's matrix of an inextensible rod, which is symmetric.
#[derive(Debug, Clone)]
pub(crate) struct Inverse<const C: usize>(Factors<C>);

impl<const C: usize> Inverse<C> {
    /// The product with a vector.
    pub(crate) fn times(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vector.to_vec();
        self.0.solve(&mut product);
        product
    }
}

impl<const C: usize> Newton<C> {
    /// The inverse of the matrix factored last.
    pub(crate) fn inverse(&self) -> Inverse<C> {
        Inverse(self.factor.clone())
    }
}
