//! Matrices that couple neighbouring nodes alone, and their factorisations.
//!
//! [`matrix`] holds the symmetric block tridiagonal ones, [`ldlt`] factors them without pivoting and tells their inertia; [`lu`] is
//! the band with row interchanges for those that are not symmetric.

pub mod ldlt;
pub mod lu;
pub mod matrix;

pub use ldlt::{Factor, FactorError, Inertia};
pub use lu::BandLu;
pub use matrix::{BandMatrix, Shift};

#[cfg(test)]
mod tests;
