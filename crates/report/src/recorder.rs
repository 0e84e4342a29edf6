//! Follows a running simulation in memory.

use endowire_core::insertion::Simulation;
use endowire_recording::StepRow;

use crate::run::{MOST_NODES, Moment};

/// Data of a page about the steps so far: one row per step, and as many shapes as fit.
#[derive(Debug, Default)]
pub struct Recorder {
    rows: Vec<StepRow>,
    moments: Vec<Moment>,
}

impl Recorder {
    /// Records a simulation after this many steps. Rows and shapes from this step on, left by steps that were undone,
    /// are dropped.
    pub fn note(&mut self, step: usize, simulation: &Simulation) {
        self.rows.truncate(self.rows.partition_point(|row| row.step < step));
        self.moments.truncate(self.moments.partition_point(|moment| moment.step < step));
        if step == 0 {
            return;
        }
        self.rows.push(StepRow::of(step, &[], simulation.time_s(), simulation));
        let report = simulation.report();
        let contacts = report.contacts.iter().map(|contact| (contact.position_mm, contact.total_n()));
        let line_mm = &simulation.shape().positions_mm;
        self.moments.push(Moment::new(step, line_mm, &report.lengths_mm(), contacts));
        self.make_room();
    }

    /// Drops every other shape when there are too many; the last one stays.
    fn make_room(&mut self) {
        let nodes: usize = self.moments.iter().map(Moment::nodes).sum();
        if nodes <= MOST_NODES {
            return;
        }
        let count = self.moments.len();
        let mut index = 0;
        self.moments.retain(|_| {
            index += 1;
            (count - index).is_multiple_of(2)
        });
    }

    /// Rows of the steps so far.
    pub fn rows(&self) -> &[StepRow] {
        &self.rows
    }

    /// Shapes of some of the steps, including the last.
    pub fn moments(&self) -> &[Moment] {
        &self.moments
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use endowire_core::insertion::Command;
    use endowire_core::scene::Scene;
    use endowire_core::vessel::NoStore;

    use super::*;

    #[test]
    fn undone_steps_are_forgotten_and_shapes_are_few_with_the_last_among_them() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/scenes/curved_tube_exact.toml");
        let scene = Scene::read(Path::new(file)).unwrap();
        let mut simulation = scene.simulation(&NoStore).unwrap();
        simulation.step(Command { advance_mm: 40.0, rotate_rad: 0.0, ..Command::default() }).unwrap();
        let mut recorder = Recorder::default();
        let nodes = simulation.shape().len();
        let many = 2 * MOST_NODES / nodes;
        (1..=many).for_each(|step| recorder.note(step, &simulation));
        let last = |recorder: &Recorder| recorder.moments.last().map(|moment| moment.step);
        assert_eq!((recorder.rows.len(), last(&recorder)), (many, Some(many)));
        assert!((MOST_NODES / 4..=MOST_NODES).contains(&(recorder.moments.len() * nodes)));
        recorder.note(10, &simulation);
        assert_eq!((recorder.rows.len(), last(&recorder)), (10, Some(10)));
        recorder.note(0, &simulation);
        assert!(recorder.rows.is_empty() && recorder.moments.is_empty());
    }
}
