//! Matrices that also couple distant nodes, and their factorisation.
//!
//! Where a rod touches itself the Newton system has blocks far from its band. [`couplings`] holds them, [`structure`]
//! finds an order of elimination, and [`ldlt`] factors band and blocks together.

pub(crate) mod couplings;
pub(crate) mod ldlt;
mod structure;

pub(crate) use couplings::Couplings;
pub(crate) use ldlt::CoupledFactor;

#[cfg(test)]
mod tests;
