//! One run of a sweep.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use endowire_core::Result;
use endowire_core::insertion::{Move, Script, Simulation, Tally};
use endowire_core::vessel::WallStore;
use endowire_recording::{Program, RunOutcome, StepFailure, hash_inputs};
use toml::Value;

use crate::file::Sweep;
use crate::row::{Row, json};
use crate::shared::Shared;

/// One run: the scene of a sweep with one value for each axis.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    pub(crate) sweep: &'a Sweep,
    pub(crate) number: usize,
    pub(crate) values: Vec<Value>,
}

/// Records runs of a sweep, on several threads at once. A recording that cannot be written ends the sweep.
pub trait Record: Sync {
    /// Begins the recording of a run, before anything is inserted.
    ///
    /// # Errors
    /// What cannot be written, and where.
    fn begin(&self, run: &Run<'_>, simulation: &Simulation)
    -> std::result::Result<Box<dyn Recorder>, String>;
}

/// The recording of one run.
pub trait Recorder {
    /// Records a step; it ends at `time_s` if the script has speeds.
    ///
    /// # Errors
    /// What cannot be written, and where.
    fn step(
        &mut self,
        moves: &[Move],
        time_s: Option<f64>,
        last: bool,
        simulation: &Simulation,
    ) -> std::result::Result<(), String>;

    /// Ends the recording.
    ///
    /// # Errors
    /// What cannot be written, and where.
    fn end(self: Box<Self>, outcome: &RunOutcome) -> std::result::Result<(), String>;
}

/// Why a run has no row.
pub(crate) enum Interrupted {
    /// It was stopped on request.
    Stopped,
    /// It could not be recorded.
    Unrecorded(String),
}

/// Resources shared by the runs of a sweep.
pub(crate) struct Workshop<'a> {
    pub(crate) store: &'a (dyn WallStore + Sync),
    pub(crate) starts: &'a Shared<Simulation>,
    pub(crate) record: Option<&'a dyn Record>,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) program: Program,
}

impl Sweep {
    /// The run with this number, from 0. The sample varies fastest, then the last axis.
    pub fn run(&self, number: usize) -> Run<'_> {
        let (mut rest, sample) = (number / self.samples, number % self.samples);
        let mut values: Vec<Value> = Vec::with_capacity(self.axes.len());
        for axis in self.axes.iter().rev() {
            values.push(axis.value(rest % axis.crossed(), sample));
            rest /= axis.crossed();
        }
        values.reverse();
        Run { sweep: self, number, values }
    }
}

/// Tables and keys of a scene that do not affect the initial state.
const LATER: [&str; 4] = ["name", "seed", "script", "view"];

/// Keys of a scene file whose values are paths.
const PATHS: [&str; 3] = ["file", "tree", "centreline"];

impl Run<'_> {
    /// Number in the sweep, from 0.
    pub fn number(&self) -> usize {
        self.number
    }

    /// The scene as a file that is valid in any folder: its paths are absolute.
    ///
    /// # Errors
    /// Values of several axes that are incompatible.
    pub fn standalone(&self) -> Result<String> {
        let path = self.sweep.scene_path();
        let folder = path.parent().unwrap_or(Path::new(""));
        let folder = std::path::absolute(folder.join(".")).unwrap_or_else(|_| folder.to_path_buf());
        let mut scene = self.sweep.scene(&self.values)?;
        make_absolute(scene.tables_mut(), &folder);
        scene.text()
    }

    /// Carries out the run; failures are reported in its row.
    pub(crate) fn carry_out(&self, workshop: &Workshop<'_>) -> std::result::Result<Row, Interrupted> {
        let mut row = self.row(workshop.program, None);
        match self.begin(workshop, &mut row) {
            Ok((simulation, script)) => row.outcome = Some(self.steps(simulation, &script, workshop)?),
            Err(error) => row.refused = Some(error.to_string()),
        }
        Ok(row)
    }

    /// The row of a run without results.
    pub(crate) fn row(&self, program: Program, refused: Option<String>) -> Row {
        Row {
            run: self.number,
            parameters: self.values.iter().map(json).collect(),
            outcome: None,
            refused,
            scene_hash: String::new(),
            seed: 0,
            version: program.version.to_owned(),
            git_revision: program.git_revision.to_owned(),
        }
    }

    /// The simulation at the start, and the script.
    fn begin(&self, workshop: &Workshop<'_>, row: &mut Row) -> Result<(Simulation, Script)> {
        let mut tables = self.sweep.scene(&self.values)?;
        let text = tables.text()?;
        row.scene_hash = hash_inputs(&[&text]);
        let scene = tables.scene()?;
        let mut inputs = vec![text.into_bytes()];
        row.seed = scene.seed;
        for input in scene.input_paths() {
            inputs.push(endowire_core::file::read(&input, u64::MAX)?);
        }
        row.scene_hash = hash_inputs(&inputs);
        let script = scene.steps(&scene.stack()?, workshop.store)?;
        if let Value::Table(table) = tables.tables_mut() {
            table.retain(|key, _| !LATER.contains(&key));
        }
        let key = tables.text()?;
        let simulation = workshop.starts.get(key.as_bytes(), || scene.simulation(workshop.store))?;
        Ok((simulation, script))
    }

    /// Carries out the script.
    fn steps(
        &self,
        mut simulation: Simulation,
        script: &Script,
        workshop: &Workshop<'_>,
    ) -> std::result::Result<RunOutcome, Interrupted> {
        let begin = |record: &dyn Record| record.begin(self, &simulation);
        let mut recorder = workshop.record.map(begin).transpose().map_err(Interrupted::Unrecorded)?;
        let mut hand = script.begin();
        let (mut steps, mut tally) = (0, Tally::default());
        let failure = loop {
            if workshop.stop.load(Ordering::Relaxed) {
                return Err(Interrupted::Stopped);
            }
            let failed = |error: endowire_core::Error| Some(StepFailure::new(steps + 1, &error));
            let step = match hand.next(&simulation) {
                Ok(Some(step)) => step.into_owned(),
                Ok(None) => break None,
                Err(error) => break failed(error),
            };
            if let Err(error) = step.carry_out(&mut simulation) {
                break failed(error);
            }
            hand.carried_out();
            steps += 1;
            tally.count(steps, &simulation);
            if let Some(recorder) = &mut recorder {
                // Looks one step ahead on a copy, which changes nothing.
                let last = matches!(hand.clone().next(&simulation), Ok(None));
                recorder
                    .step(&step.moves, step.time_s, last, &simulation)
                    .map_err(Interrupted::Unrecorded)?;
            }
        };
        let outcome = RunOutcome::new(&simulation, &hand, (steps, script.len()), tally, failure);
        if let Some(recorder) = recorder {
            recorder.end(&outcome).map_err(Interrupted::Unrecorded)?;
        }
        Ok(outcome)
    }
}

/// Makes the paths in a scene absolute.
fn make_absolute(place: &mut Value, folder: &Path) {
    match place {
        Value::Table(table) => {
            for (key, value) in table.iter_mut() {
                match value {
                    Value::String(path) if PATHS.contains(&key.as_str()) => {
                        *path = folder.join(&*path).display().to_string();
                    }
                    value => make_absolute(value, folder),
                }
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|value| make_absolute(value, folder)),
        _ => {}
    }
}
