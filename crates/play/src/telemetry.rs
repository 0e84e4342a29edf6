//! What a session is assessed by: what hands, beam and injector do, tick by tick. A script does not tell: it knows no rests and no beam.

use endowire_assess::{BeamState, Hand, Injection, Packed, Record, Sample};
use endowire_core::insertion::{Packing, Simulation};

use endowire_core::Vec3;

use crate::hand::Motion;

/// The record of a session so far. What is taken back by undo was done all the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct Telemetry {
    record: Record,
}

impl Telemetry {
    /// What it has noted.
    pub(crate) fn record(&self) -> &Record {
        &self.record
    }

    /// Notes a tick that ends at a time, in which hands carried out these motions. Rests that follow each other are one sample.
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
        let (report, force) = (simulation.report(), simulation.wall_force());
        let instruments = simulation.stack().instruments();
        if self.record.instruments.is_empty() {
            self.record.instruments = instruments.iter().map(|one| one.name.clone()).collect();
        }
        let displacement = simulation.displacement();
        let at_rest =
            |tip_mm: Option<Vec3>| displacement.as_ref().zip(tip_mm).map(|(now, tip)| now.material(&tip));
        // That of a device alone is the foremost one.
        let tip_of = |index: usize| (instruments.len() > 1).then(|| simulation.tip_of_mm(index)).flatten();
        let hands = report.hands().into_iter().enumerate().map(|(index, told)| {
            let moved = motions.iter().find(|motion| motion.instrument == index);
            let tip_mm = tip_of(index);
            Hand {
                advance_mm: moved.map_or(0.0, |motion| motion.advance_mm),
                rotate_rad: moved.map_or(0.0, |motion| motion.rotate_deg.to_radians()),
                inserted_mm: told.inserted_mm,
                push_force_n: told.push_force_n,
                torque_nmm: told.torque_nmm,
                tip_mm,
                tip_at_rest_mm: at_rest(tip_mm),
            }
        });
        let tip_mm = simulation.shape().tip_mm();
        let sample = Sample {
            time_s,
            tip_mm,
            tip_at_rest_mm: at_rest(tip_mm),
            hands: hands.collect(),
            wall_force_n: force.sum_n,
            tip_force_n: force.tip_n,
            jumped: report.jumped && !motions.is_empty(),
            packing: packing.map(|Packing { density, outside_mm, .. }| Packed { density, outside_mm }),
        };
        match self.record.samples.last_mut() {
            Some(last)
                if (Sample { time_s: last.time_s, ..sample.clone() }) == *last && motions.is_empty() =>
            {
                last.time_s = time_s;
            }
            _ => self.record.samples.push(sample),
        }
    }

    /// Notes an injection.
    pub(crate) fn inject(&mut self, time_s: f64, volume_ml: f64, rate_ml_per_s: f64) {
        self.record.injections.push(Injection { time_s, volume_ml, rate_ml_per_s });
    }
}
