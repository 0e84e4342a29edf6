//! Linear and nonlinear solvers: the banded LDLᵀ kernel, an LU beside it, and Newton's method with globalisation.
//!
//! [`newton`] is the iteration with its line search; [`report`] what goes in and comes out. It rests on the parts beside it:
//! the size of a residual, the trial state, the way out of saddle points, and stiffness that is not symmetric.

pub mod band;
pub mod band_lu;
pub mod external;
pub mod newton;
pub mod report;
mod residual;
mod saddle;
mod trial;
mod unsymmetric;

pub use band::{BandMatrix, Factor, FactorError, Inertia, Shift};
pub use band_lu::BandLu;
pub use external::External;
pub use newton::Newton;
pub use report::{NewtonOptions, NewtonReport, StepRecord, StopReason};
pub use residual::ResidualSize;

#[cfg(test)]
mod band_tests;
#[cfg(test)]
mod newton_tests;
