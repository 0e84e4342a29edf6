//! General static problems of one rod: what `endowire rod CASE.toml` solves.
//!
//! Units are the caller's: any consistent set, or none at all (a case may well say length 1 and EI 1).

pub mod case;
pub mod continuation;
pub mod critical;
pub mod guess;
pub mod loads;
pub mod problem;
pub mod solution;
mod validate;

pub use case::{End, EndKind, Initial, Load, LoadKind, Rod, Section, Solver, Start, StartKind, StaticCase};
pub use continuation::PathPoint;
pub use critical::Parameter;
pub use loads::Loads;
pub use problem::StaticProblem;
pub use solution::{Energies, Reaction, Reactions, StaticSolution};
