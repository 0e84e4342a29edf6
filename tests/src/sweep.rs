//! Scripts driven step by step, with everything about every step that a user relies on checked.

use std::fmt;
use std::time::Instant;

use endowire_core::insertion::{Command, Move, Simulation};

use crate::crossing::CrossingTest;

/// What became of a list of commands.
#[derive(Debug, Default)]
pub struct Tally {
    /// Commands carried out.
    pub steps: usize,
    /// Newton iterations of every step.
    pub iterations: Vec<u32>,
    /// Sub-steps of every step.
    pub substeps: Vec<u32>,
    /// Time of every step, s.
    pub seconds: Vec<f64>,
    /// Commands that failed: number and reason.
    pub failures: Vec<(usize, String)>,
    /// Steps after which the device was behind a triangle, and had not sunk in there as deep.
    pub crossings: Vec<usize>,
    /// Steps that returned without having converged.
    pub unconverged: Vec<usize>,
    /// Failed commands that did not leave the state as before.
    pub disturbed: Vec<usize>,
    /// Steps that freed energy in a jump.
    pub jumps: usize,
}

impl Tally {
    /// Whether every command was carried out, converged and crossed nothing.
    pub fn is_clean(&self) -> bool {
        self.failures.is_empty() && self.is_safe()
    }

    /// Whether no step crossed, stopped short of convergence, or failed with traces.
    pub fn is_safe(&self) -> bool {
        self.crossings.is_empty() && self.unconverged.is_empty() && self.disturbed.is_empty()
    }

    /// Carries out a command of the innermost instrument and checks it. Returns whether it was carried out.
    pub fn step(&mut self, simulation: &mut Simulation, crossing: &CrossingTest, command: Command) -> bool {
        self.step_together(simulation, crossing, &[Move { instrument: 0, command }])
    }

    /// Carries out one command, moves of several instruments at a time, and checks it. Returns whether it was carried out.
    pub fn step_together(
        &mut self,
        simulation: &mut Simulation,
        crossing: &CrossingTest,
        moves: &[Move],
    ) -> bool {
        let number = self.steps + self.failures.len();
        let (shape, report) = (simulation.shape().clone(), simulation.report().clone());
        let clock = Instant::now();
        let done = simulation.step_together(moves).map(|_| ());
        self.seconds.push(clock.elapsed().as_secs_f64());
        if let Err(error) = done {
            if simulation.shape() != &shape || simulation.report() != &report {
                self.disturbed.push(number);
            }
            self.failures.push((number, error.to_string()));
            return false;
        }
        self.steps += 1;
        let report = simulation.report();
        self.iterations.push(report.iterations);
        self.substeps.push(report.substeps);
        self.jumps += usize::from(report.jumped);
        if !report.converged {
            self.unconverged.push(number);
        }
        if crossing.is_crossed_by(simulation) {
            self.crossings.push(number);
        }
        true
    }

    /// Carries out commands up to the first that fails.
    pub fn drive(&mut self, simulation: &mut Simulation, crossing: &CrossingTest, commands: &[Command]) {
        for command in commands {
            if !self.step(simulation, crossing, *command) {
                break;
            }
        }
    }
}

/// Middle and largest of a list.
fn middle_and_largest<T: Copy + PartialOrd + Default>(list: &[T]) -> (T, T) {
    let mut sorted = list.to_vec();
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    (sorted.get(sorted.len() / 2).copied().unwrap_or_default(), sorted.last().copied().unwrap_or_default())
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (iterations, most) = middle_and_largest(&self.iterations);
        let (substeps, most_substeps) = middle_and_largest(&self.substeps);
        let (seconds, longest) = middle_and_largest(&self.seconds);
        write!(
            f,
            "{:>5} steps {iterations:>3}/{most:>4} it. {substeps:>2}/{most_substeps:>4} sub. {:>7.2}/{:>8.1} ms {:>3} jumps",
            self.steps,
            1e3 * seconds,
            1e3 * longest,
            self.jumps
        )?;
        for (name, list) in
            [("CROSSED", &self.crossings), ("UNCONVERGED", &self.unconverged), ("DISTURBED", &self.disturbed)]
        {
            if let Some(first) = list.first() {
                write!(f, "  {name} {} times from step {first}", list.len())?;
            }
        }
        if let Some((number, reason)) = self.failures.first() {
            write!(f, "  {} FAILED, first {number}: {reason}", self.failures.len())?;
        }
        Ok(())
    }
}
