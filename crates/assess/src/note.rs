//! Recording of a simulation, step by step.

use endowire_core::Vec3;
use endowire_core::insertion::{Command, Move, Packing, Simulation};

use crate::record::{Hand, Packed, Record, Sample};

impl Record {
    /// Records a step that ended at `time_s`, in which the instruments made these moves. `packing` is the state of
    /// coils in the vessel's sac, if it has one. Consecutive rests become one sample.
    pub fn note(&mut self, time_s: f64, moves: &[Move], simulation: &Simulation, packing: Option<Packing>) {
        let report = simulation.report();
        let [wall_force_n, tip_force_n] = self.wall_forces_n(simulation);
        let instruments = simulation.stack().instruments();
        if self.instruments.is_empty() {
            self.instruments = instruments.iter().map(|one| one.name.clone()).collect();
        }
        let rests = moves.iter().all(|one| one.command == Command::default());
        let displacement = simulation.displacement();
        let at_rest =
            |tip_mm: Option<Vec3>| displacement.as_ref().zip(tip_mm).map(|(now, tip)| now.material(&tip));
        // With a single device, its tip is already recorded as the foremost tip.
        let tip_of = |index: usize| (instruments.len() > 1).then(|| simulation.tip_of_mm(index)).flatten();
        let hands = report.hands().into_iter().enumerate().map(|(index, reported)| {
            let moved = moves.iter().find(|one| one.instrument == index);
            let Command { advance_mm, rotate_rad, steer } = moved.map(|one| one.command).unwrap_or_default();
            let tip_mm = tip_of(index);
            Hand {
                advance_mm,
                rotate_rad,
                steer_by: steer,
                inserted_mm: reported.inserted_mm,
                push_force_n: reported.push_force_n,
                torque_nmm: reported.torque_nmm,
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
            wall_force_n,
            tip_force_n,
            jumped: report.jumped && !rests,
            packing: packing.map(|Packing { density, outside_mm, .. }| Packed { density, outside_mm }),
            undone: false,
            out_of_picture: false,
        };
        match self.samples.last_mut() {
            Some(last)
                if rests
                    && Sample { time_s: last.time_s, undone: last.undone, ..sample.clone() } == *last =>
            {
                last.time_s = time_s;
            }
            _ => self.samples.push(sample),
        }
    }

    /// Forces of the wall, in all and at the tip, N. In a tick that ends on the way to an equilibrium contacts are those
    /// of an iteration, which may be a hundred times as large: then, as at the hands, the last ones remain.
    pub fn wall_forces_n(&self, simulation: &Simulation) -> [f64; 2] {
        let report = simulation.report();
        match self.samples.last() {
            Some(last) if report.is_under_way() && !report.converged => [last.wall_force_n, last.tip_force_n],
            _ => {
                let force = simulation.wall_force();
                [force.sum_n, force.tip_n]
            }
        }
    }

    /// Records the same where the session has gone to another of its states since the last step, as by undo.
    pub fn note_elsewhere(
        &mut self,
        time_s: f64,
        moves: &[Move],
        simulation: &Simulation,
        packing: Option<Packing>,
    ) {
        let known = self.samples.len();
        self.note(time_s, moves, simulation, packing);
        // Without a new sample, that state is the same.
        self.samples[known..].iter_mut().for_each(|sample| sample.undone = true);
    }
}
