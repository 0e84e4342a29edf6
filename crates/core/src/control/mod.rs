//! Controllers: a [`Controller`] observes a simulation and decides what to do next.
//!
//! ```text
//! Simulation ──► Controller::next ──► Action::Move(moves) ──► Simulation::step_together ──► …
//! ```
//! A controller reads no clock and draws no random number except from its seed: the same simulation and controller
//! make the same moves, to the bit.

mod follow;
#[cfg(test)]
mod ring_tests;
mod search;
mod team;
#[cfg(test)]
mod tests;

use crate::insertion::{Move, Simulation};
use crate::{Error, Result};

pub use follow::FollowPath;
pub use search::SearchAhead;
pub use team::{Follower, Team};

/// The next action of a controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Makes these moves, all at the same time.
    Move(Vec<Move>),
    /// Nothing: it has arrived.
    Arrived,
    /// Nothing: it has given up.
    GivenUp,
}

/// A controller that steers instruments to a target.
pub trait Controller {
    /// The action for the current simulation. Called once before every step; its last action has been carried out.
    ///
    /// # Errors
    /// Instruments that do not exist in the simulation.
    fn next(&mut self, simulation: &Simulation) -> Result<Action>;

    /// Number of times it has pulled back to try something else.
    fn retries(&self) -> usize;
}

/// How a controlled run ended.
#[derive(Debug)]
pub enum Outcome {
    /// The target was reached.
    Arrived,
    /// The controller gave up.
    GivenUp,
    /// It used up its steps.
    Stopped,
    /// A step failed.
    Failed(Error),
}

/// Lets a controller move a simulation for at most `most_steps`; `seen` is called after every step.
///
/// # Errors
/// Those of [`Controller::next`] and of `seen`.
pub fn drive<E: From<Error>>(
    simulation: &mut Simulation,
    controller: &mut dyn Controller,
    most_steps: usize,
    mut seen: impl FnMut(&Simulation, &[Move]) -> std::result::Result<(), E>,
) -> std::result::Result<Outcome, E> {
    for _ in 0..most_steps {
        let moves = match controller.next(simulation)? {
            Action::Move(moves) => moves,
            Action::Arrived => return Ok(Outcome::Arrived),
            Action::GivenUp => return Ok(Outcome::GivenUp),
        };
        if let Err(error) = simulation.step_together(&moves) {
            return Ok(Outcome::Failed(error));
        }
        seen(simulation, &moves)?;
    }
    // The last step may have reached the target.
    Ok(match controller.next(simulation)? {
        Action::Arrived => Outcome::Arrived,
        _ => Outcome::Stopped,
    })
}
