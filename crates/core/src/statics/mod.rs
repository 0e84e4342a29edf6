//! General static problems of one rod, or of several coaxial instruments: what `endowire rod CASE.toml` solves.
//!
//! A [`StaticCase`] is a rod with its loads, and [`StaticCase::solve`] its equilibrium. A [`StaticProblem`] is a case made
//! ready, to begin from a shape of one's own, to look for critical loads, or to add energies
//! ([`Field`](crate::field::Field)). A [`WallRod`] is a rod among walls, a [`Channel`] holds several instruments.
//!
//! Any consistent units may be used, or none at all (a case may have length 1 and EI 1).

/// Calls a method that is generic in the number of unknowns of two nodes, given the number of sets of angles.
macro_rules! by_angles {
    ($angles:expr, $this:ident.$method:ident($($argument:expr),*)) => {
        match $angles {
            0 => $this.$method::<{ crate::rod::PLAIN }>($($argument),*),
            1 => $this.$method::<{ crate::rod::TWISTED }>($($argument),*),
            2 => $this.$method::<{ crate::rod::PLAIN + 8 }>($($argument),*),
            _ => $this.$method::<{ crate::rod::PLAIN + 12 }>($($argument),*),
        }
    };
}

mod case;
mod channel;
mod continuation;
mod critical;
mod guess;
mod loads;
mod mesh;
mod problem;
mod solution;
mod stack;
mod validate;
mod wall_rod;

pub use case::{
    End, EndKind, Initial, Instrument, Load, LoadKind, Rod, Section, Solver, Start, StartKind, StaticCase,
    Surface,
};
pub use channel::Channel;
pub use continuation::PathPoint;
pub use critical::Parameter;
pub use loads::Loads;
pub use problem::{Solved, StaticProblem};
pub use solution::{Energies, InstrumentSolution, Reaction, Reactions, StaticSolution, TouchSolution};
pub use wall_rod::{WallRod, WallRodSpec};

pub use crate::contact::Touch;
pub use crate::rod::{Clamp, RodState, Supports};

#[cfg(test)]
mod play_tests;
#[cfg(test)]
mod stack_tests;
#[cfg(test)]
mod touching_tests;
