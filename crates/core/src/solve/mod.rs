//! Newton's method on the rod's potential energy, with globalisation.
//!
//! [`newton`] is the iteration; [`report`] what goes in and comes out. An iteration is inertia and shift, step, line search and stop,
//! a file each; beside them are the size of a residual, the trial state, contacts within a step, the way out of saddle points, and stiffness that is not
//! symmetric.

pub(crate) mod contacts;
pub mod external;
mod factors;
mod line_search;
pub(crate) mod neighbourhood;
pub mod newton;
pub mod report;
mod residual;
mod saddle;
mod shift;
mod stop;
mod together;
mod trial;
mod unsymmetric;

pub use external::{ContactMerit, Contacts, External, Moved, Sizes};
pub(crate) use neighbourhood::Neighbourhood;
pub use newton::Newton;
pub use report::{NewtonOptions, NewtonReport, StepRecord, StopReason};
pub use residual::ResidualSize;
pub use together::Together;

#[cfg(test)]
pub(crate) mod newton_tests;
