//! Linear and nonlinear solvers: the banded LDLᵀ kernel and Newton's method with globalisation.

pub mod band;

pub use band::{BandMatrix, Factor, FactorError, Inertia};
