//! The record for assessment: instruments, beam and injector over time. A script is not enough, because it contains
//! neither rests nor the beam.

use endowire_assess::{BeamState, Injection, Record};
use endowire_core::insertion::{Move, Packing, Simulation};

use crate::hand::Motion;

/// The record of a session so far. It includes undone motions, because they took place.
#[derive(Debug, Clone)]
pub(crate) struct Telemetry {
    record: Record,
    /// Whether the session has gone to another of its states since the last step.
    elsewhere: bool,
}

impl Telemetry {
    /// An empty record that begins at the state of this simulation, of the beam too: a session always knows its beam.
    pub(crate) fn new(simulation: &Simulation) -> Self {
        let mut record = Record { beam: Some(vec![]), ..Record::default() };
        record.begin(simulation);
        Self { record, elsewhere: false }
    }

    /// The record so far.
    pub(crate) fn record(&self) -> &Record {
        &self.record
    }

    /// Records the state of the beam, if it has changed.
    pub(crate) fn beam(&mut self, beam: BeamState) {
        let beams = self.record.beam.get_or_insert_default();
        let same = |last: &BeamState| BeamState { time_s: last.time_s, ..beam } == *last;
        if !beams.last().is_some_and(same) {
            beams.push(beam);
        }
    }

    /// Records a step that ends at `time_s`, with these motions. It begins where the last one ended.
    pub(crate) fn step(
        &mut self,
        time_s: f64,
        motions: &[Motion],
        (simulation, packing): (&Simulation, Option<Packing>),
    ) {
        let moves: Vec<Move> = motions.iter().map(|motion| motion.as_move()).collect();
        if std::mem::take(&mut self.elsewhere) {
            self.record.note_elsewhere(time_s, &moves, simulation, packing);
        } else {
            self.record.note(time_s, &moves, simulation, packing);
        }
    }

    /// Records whether the tip that moved in the last step was in the picture.
    pub(crate) fn in_picture(&mut self, is_seen: bool) {
        if let Some(last) = self.record.samples.last_mut() {
            last.out_of_picture = !is_seen;
        }
    }

    /// Records a rest until `time_s`, if nothing is recorded of that time: a script's step that was not finished.
    pub(crate) fn rest_until(&mut self, time_s: f64, state: (&Simulation, Option<Packing>)) {
        if self.record.samples.last().map_or(0.0, |last| last.time_s) < time_s {
            self.step(time_s, &[], state);
        }
    }

    /// Records that the session goes to another of its states: no hand moves the tip there.
    pub(crate) fn go_elsewhere(&mut self) {
        self.elsewhere = true;
    }

    /// Records an injection.
    pub(crate) fn inject(&mut self, injection: Injection) {
        self.record.injections.push(injection);
    }
}
