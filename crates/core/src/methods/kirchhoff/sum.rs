//! What the parts of a command add up to in its report.

use super::part::{Effort, Found};
use super::state::Flight;
use crate::methods::{Jump, StepReport};

/// Accumulated results of the parts of a command.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sum {
    /// Number of parts tried.
    pub(super) parts: usize,
    /// Number of relaxations.
    pub(super) relaxations: u32,
    slides: u32,
    imbalance: f64,
    dissipated_mj: f64,
    /// Energy by which relaxations that stopped on their way exceed what was put in, mJ: the rest of their way gives it
    /// back.
    borrowed_mj: f64,
    jump: Option<Jump>,
    largest_mj: f64,
}

impl Sum {
    /// Adds the energy that was lost on the way to where the device came to rest.
    pub(super) fn add(&mut self, flight: &Flight, effort: Effort) {
        let Some(balance) = flight.balance else { return };
        let jumps = flight.jumps();
        let (dissipated_mj, released_mj) = balance.lost_mj(jumps);
        self.dissipated_mj += dissipated_mj;
        if effort == Effort::Flight {
            self.borrowed_mj += balance.borrowed_mj(dissipated_mj + released_mj);
        }
        if jumps {
            let position_mm = flight.farthest_mm;
            let so_far = self.jump.get_or_insert(Jump { released_mj: 0.0, position_mm });
            // The position is that of the largest jump.
            if released_mj > self.largest_mj {
                (self.largest_mj, so_far.position_mm) = (released_mj, position_mm);
            }
            so_far.released_mj += released_mj;
        }
    }

    /// Adds what does not wait until the device comes to rest.
    pub(super) fn go_on(&mut self, found: &Found, effort: Effort) {
        self.slides += found.slides;
        self.dissipated_mj += found.outside_mj;
        let relaxed = effort == Effort::Flight || found.is_interrupted;
        self.imbalance = if relaxed { found.residual.max(found.unsettled) } else { 0.0 };
    }

    /// The same without a jump.
    pub(super) fn without_jump(self) -> Self {
        Self { jump: None, ..self }
    }

    /// Adds energy dissipated by friction, mJ.
    pub(super) fn rub(&mut self, dissipated_mj: f64) {
        self.dissipated_mj += dissipated_mj;
    }

    pub(super) fn write(&self, report: &mut StepReport) {
        report.substeps = self.parts as u32;
        (report.relaxations, report.slides) = (self.relaxations, self.slides);
        (report.imbalance, report.dissipated_mj) = (self.imbalance, self.dissipated_mj);
        let released =
            |jump: Jump| Jump { released_mj: (jump.released_mj - self.borrowed_mj).max(0.0), ..jump };
        (report.jump, report.jumped) = (self.jump.map(released), self.jump.is_some());
    }
}
