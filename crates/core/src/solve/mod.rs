//! Newton's method on the rod's potential energy, with globalisation.
//!
//! [`newton`] is the iteration, [`report`] its options and results. An iteration consists of inertia and shift, step,
//! line search and stopping criterion, one file each; further files hold the size of a residual, the trial state,
//! contacts within a step, the descent from saddle points, and unsymmetric stiffness.

pub(crate) mod contacts;
pub(crate) mod external;
mod factors;
mod krylov;
mod line_search;
pub(crate) mod neighbourhood;
pub(crate) mod newton;
pub(crate) mod report;
mod residual;
mod saddle;
mod shift;
mod stop;
mod together;
mod trial;
mod unsymmetric;

pub use external::{ContactMerit, Moved};
pub use external::{Contacts, External, Sizes};
pub(crate) use krylov::gmres;
pub(crate) use neighbourhood::Neighbourhood;
pub use newton::Newton;
pub use report::NewtonOptions;
pub use report::StepRecord;
pub use report::{NewtonReport, StopReason};
pub use residual::ResidualSize;
pub(crate) use together::Together;

#[cfg(test)]
pub(crate) mod newton_tests;
