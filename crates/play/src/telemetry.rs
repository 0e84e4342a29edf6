//! The record for assessment: instruments, beam and injector, tick by tick. A script is not enough, because it
//! contains neither rests nor the beam.

use endowire_assess::{BeamState, Injection, Record};
use endowire_core::insertion::{Move, Packing, Simulation};

use crate::hand::Motion;

/// The record of a session so far. It includes undone motions, because they took place.
#[derive(Debug, Clone, Default)]
pub(crate) struct Telemetry {
    record: Record,
}

impl Telemetry {
    /// The record so far.
    pub(crate) fn record(&self) -> &Record {
        &self.record
    }

    /// Records a tick that ends at `time_s`, with these motions.
    pub(crate) fn tick(
        &mut self,
        time_s: f64,
        motions: &[Motion],
        (simulation, packing): (&Simulation, Option<Packing>),
        beam: BeamState,
    ) {
        let beams = self.record.beam.get_or_insert_default();
        let same = |last: &BeamState| BeamState { time_s: last.time_s, ..beam } == *last;
        if !beams.last().is_some_and(same) {
            beams.push(beam);
        }
        let moves: Vec<Move> = motions.iter().map(|motion| motion.as_move()).collect();
        self.record.note(time_s, &moves, simulation, packing);
    }

    /// Records an injection.
    pub(crate) fn inject(&mut self, time_s: f64, volume_ml: f64, rate_ml_per_s: f64) {
        self.record.injections.push(Injection { time_s, volume_ml, rate_ml_per_s });
    }
}
