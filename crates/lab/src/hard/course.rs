//! Commands carried out one after the other, whole or in equal parts.

use std::time::Instant;

use endowire_core::Result;
use endowire_core::insertion::{Move, Simulation, Step};
use endowire_core::methods::StepReport;

use crate::sequences::part_of;

/// One way through commands, and what it took.
pub(super) struct Course {
    pub(super) simulation: Simulation,
    pub(super) commands: usize,
    pub(super) iterations: u64,
    pub(super) flights: u64,
    pub(super) jumps: usize,
    pub(super) unconverged: usize,
    pub(super) seconds: f64,
    pub(super) slowest_s: f64,
    pub(super) end: Option<String>,
}

impl Course {
    pub(super) fn new(simulation: Simulation) -> Self {
        let (commands, iterations, flights, jumps, unconverged) = (0, 0, 0, 0, 0);
        let (seconds, slowest_s, end) = (0.0, 0.0, None);
        Self { simulation, commands, iterations, flights, jumps, unconverged, seconds, slowest_s, end }
    }

    /// Carries out a step in equal parts, from one time to another; not once something has ended the way.
    pub(super) fn go(&mut self, moves: &[Move], times_s: Option<(f64, f64)>, parts: usize) {
        let part = part_of(moves, parts);
        for k in 1..=parts {
            if self.end.is_some() {
                return;
            }
            let time_s = times_s.map(|(from, to)| from + (to - from) * k as f64 / parts as f64);
            self.measure(|simulation| simulation.step_until(&part, time_s));
        }
    }

    /// Carries out a step of a script as it is: a tick as a tick.
    pub(super) fn carry_out(&mut self, step: &Step<'_>) {
        self.measure(|simulation| step.carry_out(simulation));
    }

    /// Carries out a tick of so many solves; not once something has ended the way.
    pub(super) fn tick(&mut self, moves: &[Move], solves: usize) {
        if self.end.is_none() {
            self.measure(|simulation| simulation.tick(moves, solves, None));
        }
    }

    fn measure(&mut self, step: impl FnOnce(&mut Simulation) -> Result<&StepReport>) {
        let begun = Instant::now();
        let done = step(&mut self.simulation);
        let took_s = begun.elapsed().as_secs_f64();
        self.seconds += took_s;
        self.slowest_s = self.slowest_s.max(took_s);
        match done {
            Ok(report) => {
                self.commands += 1;
                self.iterations += u64::from(report.iterations);
                self.flights += u64::from(report.relaxations);
                self.jumps += usize::from(report.jumped);
                self.unconverged += usize::from(report.has_failed());
            }
            Err(error) => self.end = Some(error.to_string()),
        }
    }

    /// Distance of its tip from that of another, mm.
    pub(super) fn apart_mm(&self, other: &Self) -> f64 {
        let tip_mm = |course: &Self| course.simulation.shape().tip_mm().unwrap_or_default();
        (tip_mm(self) - tip_mm(other)).norm()
    }
}
