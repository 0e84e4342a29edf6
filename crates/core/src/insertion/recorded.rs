//! Commands that are recorded, and derivatives of sums of what they lead to by any number of parameters at once.

use super::simulation::{Simulation, surroundings};
use crate::device::Stack;
use crate::methods::{
    Gradient, Move, Parameter, Passed, Pulled, StepReport, Surroundings, Tape, Together, Weights,
};
use crate::{Error, Result};

/// What commands from the state of a simulation have led to, recorded to be differentiated ([`Simulation::record`]).
///
/// A sum of what they lead to, each number with a weight, is differentiated by the reverse pass: at the cost of a part of a step, whatever the
/// number of parameters.
pub struct Recorded {
    simulation: Simulation,
    tape: Box<dyn Tape>,
}

impl Simulation {
    /// Carries out commands on a copy, one after the other, each until its time in `times_s`, s, and records them for derivatives. Nothing
    /// changes here.
    ///
    /// Contacts keep their status, as in [`Simulation::gradients`]. Memory is bounded: of many commands the first are carried out again
    /// when they are differentiated.
    ///
    /// # Errors
    /// As [`Simulation::gradients_until`], but those of parameters; no command.
    pub fn record(&self, commands: &[Vec<Move>], times_s: &[f64]) -> Result<Recorded> {
        self.check_times((commands, times_s))?;
        if commands.is_empty() {
            return Err(Error::parameter("record.commands", 0, "give one or more"));
        }
        let checked = |report: &StepReport, moves: &[Move]| self.check_moves_after(report, moves);
        let tape = self.method.record(&surroundings!(self, self.time_s), (commands, times_s), &checked)?;
        Ok(Recorded { simulation: self.clone(), tape })
    }
}

impl Recorded {
    /// What the commands led to, one after the other.
    pub fn passed(&self) -> &[Passed] {
        self.tape.passed()
    }

    /// The instruments that were moved.
    pub fn stack(&self) -> &Stack {
        self.simulation.stack()
    }

    /// Derivatives of the sum of what the commands led to, with the weights of each command in their order, by these parameters; and by the
    /// motion of each hand in each command.
    ///
    /// # Errors
    /// More weights than commands or than numbers, a parameter that does not exist or occurs twice, a singular equilibrium ([`Error::Computation`]).
    pub fn vjp(&self, weights: &[Weights], by: &[Parameter]) -> Result<Pulled> {
        self.pull(weights, by, true)
    }

    /// As [`Recorded::vjp`], without the derivatives by the hands of commands after the first, of which [`Pulled::hands`] is empty.
    ///
    /// # Errors
    /// As [`Recorded::vjp`].
    pub fn vjp_by(&self, weights: &[Weights], by: &[Parameter]) -> Result<Pulled> {
        self.pull(weights, by, false)
    }

    fn pull(&self, weights: &[Weights], by: &[Parameter], hands: bool) -> Result<Pulled> {
        let commands = self.passed().len();
        if weights.len() > commands {
            let remedy = format!("there are {commands} commands: give weights of each");
            return Err(Error::parameter("vjp.weights", weights.len(), remedy));
        }
        Parameter::check_each_once(by)?;
        let simulation = &self.simulation;
        self.tape.pull(&surroundings!(simulation, simulation.time_s), weights, (by, hands))
    }

    /// Derivatives of what each command led to, by these parameters: as [`Simulation::gradients_until`].
    ///
    /// # Errors
    /// A parameter that does not exist or occurs twice, a singular equilibrium ([`Error::Computation`]).
    pub fn gradients(&self, by: &[Parameter]) -> Result<Vec<Gradient>> {
        Parameter::check_each_once(by)?;
        let each: Vec<_> = by.iter().map(|parameter| vec![(*parameter, 1.0)]).collect();
        self.along(&each)
    }

    /// Derivatives of what each command led to along one change of parameters together, each so much: the product J dp, the one slope of
    /// each [`Gradient`].
    ///
    /// # Errors
    /// As [`Recorded::gradients`]; no change.
    pub fn jvp(&self, along: &[(Parameter, f64)]) -> Result<Vec<Gradient>> {
        Parameter::check_each_once(along.iter().map(|(parameter, _)| parameter))?;
        self.along(&[along.to_vec()])
    }

    fn along(&self, along: &[Together]) -> Result<Vec<Gradient>> {
        let simulation = &self.simulation;
        let slopes = self.tape.push(&surroundings!(simulation, simulation.time_s), along)?;
        let each = self.passed().iter().cloned().zip(slopes);
        Ok(each
            .map(|(Passed { report, shape, margin }, slopes)| Gradient { report, shape, slopes, margin })
            .collect())
    }

    /// What each command leads to where a parameter is larger by so much, solved anew at the same contacts and in the same parts.
    #[cfg(test)]
    pub(super) fn solved(&self, by: (Parameter, f64)) -> Result<Vec<Vec<f64>>> {
        let simulation = &self.simulation;
        self.tape.solved(&surroundings!(simulation, simulation.time_s), by)
    }
}
