//! Many insertions stepped in parallel, each with the same result as alone.

use std::cmp::Reverse;

#[cfg(feature = "threads")]
use rayon::iter::{ParallelBridge, ParallelIterator};

use crate::insertion::{Command, Move, Simulation};
use crate::{Error, Result};

/// Simulations that are stepped on all cores, or on the number of threads in `RAYON_NUM_THREADS`;
/// one after the other without the feature `threads`.
///
/// Each has its own state and shares what clones share: a thousand clones of one simulation contain one vessel.
/// Results are bitwise those of stepping one after the other.
#[derive(Clone, Default)]
pub struct Batch {
    simulations: Vec<Simulation>,
}

impl Batch {
    /// A batch of these simulations, in this order. They may differ in everything.
    pub fn new(simulations: Vec<Simulation>) -> Self {
        Self { simulations }
    }

    /// The simulations.
    pub fn simulations(&self) -> &[Simulation] {
        &self.simulations
    }

    /// The simulations, to restore, exchange or step one by one.
    pub fn simulations_mut(&mut self) -> &mut [Simulation] {
        &mut self.simulations
    }

    /// Carries out one command in each simulation. One that fails is unchanged and does not affect the others; its
    /// entry is the error of [`Simulation::step`].
    ///
    /// A command without motion ([`Command::default`]) costs nothing: for simulations that wait.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the numbers of commands and simulations differ; then nothing is stepped.
    pub fn step(&mut self, commands: &[Command]) -> Result<Vec<Result<()>>> {
        self.each("commands", commands, |simulation, command| simulation.step(*command).map(drop))
    }

    /// As [`Batch::step`], for several instruments: moves for each simulation ([`Simulation::step_together`]).
    ///
    /// # Errors
    /// As [`Batch::step`].
    pub fn step_together(&mut self, moves: &[Vec<Move>]) -> Result<Vec<Result<()>>> {
        self.each("moves", moves, |simulation, moves| simulation.step_together(moves).map(drop))
    }

    /// As [`Batch::step_together`], in ticks of about `solves` linear solves each ([`Simulation::tick`]): no
    /// simulation delays the others for long. One with unfinished motion continues it, even without moves.
    ///
    /// # Errors
    /// As [`Batch::step`].
    pub fn tick(&mut self, moves: &[Vec<Move>], solves: usize) -> Result<Vec<Result<()>>> {
        self.each("moves", moves, |simulation, moves| simulation.tick(moves, solves, None).map(drop))
    }

    /// Detaches the coil of an instrument in each simulation ([`Simulation::detach`]), except where none is given.
    ///
    /// # Errors
    /// As [`Batch::step`].
    pub fn detach(&mut self, instruments: &[Option<usize>]) -> Result<Vec<Result<()>>> {
        self.each("instruments", instruments, |simulation, instrument| match instrument {
            Some(instrument) => simulation.detach(*instrument).map(drop),
            None => Ok(()),
        })
    }

    /// Calls a function on each simulation with its input.
    fn each<T: Sync>(
        &mut self,
        name: &str,
        given: &[T],
        work: impl Fn(&mut Simulation, &T) -> Result<()> + Sync,
    ) -> Result<Vec<Result<()>>> {
        if given.len() != self.simulations.len() {
            let remedy = format!("give one for each of the {} simulations", self.simulations.len());
            return Err(Error::parameter(name, given.len(), remedy));
        }
        // Threads are started only for several simulations, since a program may have to fork.
        if let ([simulation], [one]) = (&mut self.simulations[..], given) {
            return Ok(vec![work(simulation, one)]);
        }
        // Steps differ in duration by orders of magnitude: each is a task of its own, and those expected to be long
        // come first, so that no thread starts one when the others have finished. A step usually resembles the one
        // before.
        let mut all: Vec<_> = self.simulations.iter_mut().zip(given).enumerate().collect();
        all.sort_by_cached_key(|(_, (simulation, _))| Reverse(labour(simulation)));
        let step = |(index, (simulation, one))| (index, work(simulation, one));
        #[cfg(feature = "threads")]
        let mut reported: Vec<_> = all.into_iter().par_bridge().map(step).collect();
        #[cfg(not(feature = "threads"))]
        let mut reported: Vec<_> = all.into_iter().map(step).collect();
        reported.sort_by_key(|(index, _)| *index);
        Ok(reported.into_iter().map(|(_, reported)| reported).collect())
    }
}

/// Cost of the last step: iterations times the number of nodes.
fn labour(simulation: &Simulation) -> usize {
    simulation.report().iterations as usize * simulation.shape().positions_mm.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, Instrument, Section, Stack};
    use crate::insertion::{Sheath, WallProperties};
    use crate::vessel::{GeneratedWall, Resolution, anatomy};

    fn simulation() -> Simulation {
        let tree = anatomy::tree("curved_tube").unwrap();
        let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0)).unwrap();
        let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0).unwrap();
        let tip = Section { rest_curvature_per_mm: [0.05, 0.0], ..Section::straight(20.0, 0.45, 5.0) };
        let wire = Device::new(vec![tip, Section::straight(180.0, 0.45, 20.0)]).unwrap();
        let rough = WallProperties { friction: 0.1, ..WallProperties::default() };
        Simulation::builder(vessel.wall, wire, sheath).properties(rough).build().unwrap()
    }

    /// The command of environment `k` in its `step`th step.
    fn command(k: usize, step: usize) -> Command {
        Command {
            advance_mm: 1.0 + 0.25 * k as f64,
            rotate_rad: 0.1 * ((k + step) % 5) as f64,
            ..Command::default()
        }
    }

    #[test]
    fn a_batch_gives_the_bits_of_one_by_one() {
        let start = simulation();
        let mut alone = vec![start.clone(); 5];
        let mut batch = Batch::new(alone.clone());
        for step in 0..40 {
            let commands: Vec<Command> = (0..5).map(|k| command(k, step)).collect();
            let reported = batch.step(&commands).unwrap();
            for (k, (one, reported)) in alone.iter_mut().zip(reported).enumerate() {
                assert_eq!(one.step(commands[k]).is_ok(), reported.is_ok());
                assert_eq!(one.shape(), batch.simulations()[k].shape());
                assert_eq!(one.report(), batch.simulations()[k].report());
            }
        }
        assert!(alone.iter().any(|one| !one.report().contacts.is_empty()));
    }

    #[test]
    fn several_instruments_move_together_to_the_bits_of_one_by_one() {
        let one = simulation();
        let hollow = |bore: Option<f64>, radius_mm: f64, length_mm: f64| {
            let section = Section::straight(length_mm, radius_mm, 10.0);
            Device::new(vec![Section { inner_radius_mm: bore, ..section }]).unwrap()
        };
        let each = [("wire", hollow(None, 0.2, 300.0)), ("catheter", hollow(Some(0.3), 0.5, 200.0))];
        let each = each.map(|(name, device)| Instrument { name: name.to_owned(), device, may_lead: true });
        let stack = Stack::new(each.into()).unwrap();
        let start = Simulation::builder(one.lumen().clone(), stack, *one.sheath()).build().unwrap();
        let moves = |k: usize| -> Vec<Move> {
            let command = |mm: f64| Command::advance(mm * (1.0 + 0.2 * k as f64));
            vec![Move { instrument: 0, command: command(3.0) }, Move { instrument: 1, command: command(2.0) }]
        };
        let mut alone = vec![start.clone(); 3];
        let mut batch = Batch::new(alone.clone());
        for _ in 0..15 {
            let all: Vec<Vec<Move>> = (0..3).map(moves).collect();
            batch.step_together(&all).unwrap().into_iter().for_each(|reported| reported.unwrap());
            for (one, moves) in alone.iter_mut().zip(&all) {
                one.step_together(moves).unwrap();
            }
        }
        for (one, other) in alone.iter().zip(batch.simulations()) {
            assert_eq!((one.shape(), one.report()), (other.shape(), other.report()));
        }
        let refused = batch.step_together(&[]).unwrap_err().to_string();
        assert!(refused.contains("moves = 0"), "{refused}");
    }

    #[test]
    fn ticks_side_by_side_are_those_of_one_by_one() {
        let mut alone = vec![simulation(); 3];
        let mut batch = Batch::new(alone.clone());
        let mut behind = 0;
        for step in 0..30 {
            let moves: Vec<Vec<Move>> =
                (0..3).map(|k| vec![Move { instrument: 0, command: command(k, step) }]).collect();
            batch.tick(&moves, 3).unwrap().into_iter().for_each(|reported| reported.unwrap());
            for (one, moves) in alone.iter_mut().zip(&moves) {
                behind += usize::from(!one.tick(moves, 3, None).unwrap().behind.is_empty());
            }
        }
        assert!(behind > 0);
        for (one, other) in alone.iter().zip(batch.simulations()) {
            assert_eq!((one.shape(), one.report()), (other.shape(), other.report()));
        }
        let refused = batch.tick(&vec![Vec::new(); 3], 0).unwrap();
        assert!(refused.into_iter().all(|reported| reported.unwrap_err().to_string().contains("solves = 0")));
    }

    #[test]
    fn what_is_no_coil_is_not_detached_and_the_others_wait() {
        let one = simulation();
        let mut batch = Batch::new(vec![one; 2]);
        batch.step(&[Command::advance(5.0); 2]).unwrap();
        let reported = batch.detach(&[None, Some(0)]).unwrap();
        assert!(
            reported[0].is_ok() && reported[1].as_ref().is_err_and(|e| e.to_string().contains("is no coil"))
        );
        assert!(batch.detach(&[None]).unwrap_err().to_string().contains("instruments = 1"));
    }

    #[test]
    fn one_that_fails_stays_as_it_was_and_the_others_go_on() {
        let mut batch = Batch::new(vec![simulation(); 3]);
        batch.step(&[Command::advance(5.0); 3]).unwrap();
        let before = batch.simulations()[1].shape().clone();
        let commands = [Command::advance(1.0), Command::advance(f64::NAN), Command::advance(2.0)];
        let reported = batch.step(&commands).unwrap();
        assert!(reported[0].is_ok() && reported[2].is_ok());
        assert!(reported[1].as_ref().is_err_and(|e| e.to_string().contains("advance_mm = NaN")));
        assert_eq!(batch.simulations()[1].shape(), &before);
        assert_eq!(batch.simulations()[2].report().inserted_mm, 7.0);
        let refused = batch.step(&commands[..2]).unwrap_err().to_string();
        assert!(refused.contains("commands = 2") && refused.contains("3 simulations"), "{refused}");
    }
}
