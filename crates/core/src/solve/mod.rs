//! Newton's method on the rod's potential energy, with globalisation.
//!
//! `newton` is the iteration, `report` its options and results. An iteration consists of inertia and shift, step,
//! line search and stopping criterion, one file each; further files hold the size of a residual, the trial state,
//! contacts within a step, the descent from saddle points, and unsymmetric stiffness.

pub(crate) mod contacts;
pub(crate) mod external;
mod factors;
mod inverse;
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

pub(crate) use external::{ContactMerit, Contacts, External, Moved, Sizes};
pub(crate) use inverse::Inverse;
pub(crate) use krylov::gmres;
pub(crate) use neighbourhood::Neighbourhood;
pub(crate) use newton::Newton;
pub(crate) use report::{NewtonOptions, NewtonReport, StopReason};
pub(crate) use together::Together;

#[cfg(test)]
pub(crate) mod newton_tests;
#[cfg(test)]
mod speed_tests;
