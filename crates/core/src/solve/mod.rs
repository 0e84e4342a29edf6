//! Linear and nonlinear solvers: the banded LDLᵀ kernel and Newton's method with globalisation.

pub mod band;
pub mod newton;

pub use band::{BandMatrix, Factor, FactorError, Inertia};
pub use newton::{External, Newton, NewtonOptions, NewtonReport, StepRecord, StopReason};

#[cfg(test)]
mod newton_tests;
