//! Hands that steer: a [`Controller`] looks at a simulation and says what to do next.
//!
//! ```text
//! Simulation ──► Controller::next ──► Action::Move(moves) ──► Simulation::step_together ──► …
//! ```
//! A controller reads no clock and draws no random number that its seed does not give: the same simulation and controller make the same
//! moves, to the bit.

mod follow;
mod search;
mod team;
#[cfg(test)]
mod tests;

use crate::insertion::{Move, Simulation};
use crate::{Error, Result};

pub use follow::FollowPath;
pub use search::SearchAhead;
pub use team::{Follower, Team};

/// What a hand does next.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Moves these, all at the same time.
    Move(Vec<Move>),
    /// Nothing: it is where it should be.
    Arrived,
    /// Nothing: it knows no further.
    GivenUp,
}

/// A hand that steers instruments somewhere.
pub trait Controller {
    /// What to do with a simulation as it is now. It is asked once before every step, and what it said last has been carried out.
    ///
    /// # Errors
    /// Instruments that the simulation does not have.
    fn next(&mut self, simulation: &Simulation) -> Result<Action>;

    /// How often it has pulled back to try something else.
    fn retries(&self) -> usize;
}

/// How a controller's way ended.
#[derive(Debug)]
pub enum Outcome {
    /// It is where it should be.
    Arrived,
    /// It knows no further.
    GivenUp,
    /// It was stopped after as many steps as it was given.
    Stopped,
    /// A step could not be carried out.
    Failed(Error),
}

/// Has a controller move a simulation for at most `most_steps`; `seen` is called after every step.
///
/// # Errors
/// As [`Controller::next`], and what `seen` says.
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
    // The last step may have been the one that arrived.
    Ok(match controller.next(simulation)? {
        Action::Arrived => Outcome::Arrived,
        _ => Outcome::Stopped,
    })
}
