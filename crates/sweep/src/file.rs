//! Sweep files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_core::file::FileSystem;
use endowire_core::input::{from_toml, parse_toml};
use endowire_core::{Error, Result};
use endowire_methods::{Key, Scene, SceneTables, Setting};
use endowire_recording::hash_inputs;
use serde::Deserialize;
use toml::Value;

use crate::axis::{Axis, AxisSpec, RUN_LIMIT};
use crate::row::{Columns, ParameterKind};

/// A sweep file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SweepSpec {
    scene: PathBuf,
    #[serde(default)]
    seed: u64,
    samples: Option<usize>,
    record: Option<Recorded>,
    #[serde(default)]
    set: BTreeMap<String, Value>,
    #[serde(default)]
    axis: Vec<AxisSpec>,
}

/// What is recorded of each run besides its row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Recorded {
    /// A recording without frames.
    Shapes,
    /// A recording with the frames of the scene's `[view]`.
    Frames,
}

/// A scene and the values of its keys.
#[derive(Debug)]
pub struct Sweep {
    /// The scene with the settings of `[set]`.
    base: SceneTables,
    pub(crate) axes: Vec<Axis>,
    pub(crate) samples: usize,
    recorded: Option<Recorded>,
    columns: Columns,
    hash: String,
}

impl Sweep {
    /// Reads a sweep file and its scene. Every value of a list and both ends of every range are tried in the scene.
    ///
    /// # Errors
    /// Names file, key and value of what is invalid: a key that the scene does not know, a value that its key does
    /// not accept, an axis without values, more than a million runs.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_with(path, &[])
    }

    /// Reads a sweep file with additional settings, which override those of its table `[set]`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_with(path: &Path, settings: &[Setting]) -> Result<Self> {
        let (mut spec, text): (SweepSpec, String) = from_toml(path)?;
        let settings = settings.iter().map(|setting| (setting.key.to_string(), setting.value.clone()));
        spec.set.extend(settings);
        Self::of_spec(&spec, text, path)
    }

    /// Reads a sweep from the text of a file. The path of its scene is relative to the folder of `path`, which is
    /// also the name in errors.
    ///
    /// # Errors
    /// As [`Self::read`], except for reading the file.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        Self::of_spec(&parse_toml(text, path)?, text.to_owned(), path)
    }

    fn of_spec(spec: &SweepSpec, text: String, path: &Path) -> Result<Self> {
        let at_path = |error: Error| match error {
            Error::Parameter { .. } => Error::content(path, error.to_string()),
            other => other,
        };
        let scene_path = path.parent().unwrap_or(Path::new("")).join(&spec.scene);
        let scene = Scene::read(&scene_path).map_err(|error| match error {
            Error::File { source, .. } => {
                Error::content(path, format!("scene = {}: {source}", scene_path.display()))
            }
            other => other,
        })?;
        let mut base = SceneTables::of_file(scene.text(), &scene_path, Arc::new(FileSystem))?;
        for (key, value) in &spec.set {
            let key = Key::parse(key).map_err(at_path)?;
            let tried = base.check(&key, value, |_| Ok(()));
            tried.map_err(|e| in_table(path, "[set]", &e))?;
            base.set(&key, value).map_err(at_path)?;
        }
        let samples = samples(spec).map_err(at_path)?;
        let axes = spec.axis.iter().enumerate();
        let axes = axes.map(|(index, axis)| Axis::new(axis, index, spec.seed, samples));
        let axes: Vec<Axis> = axes.collect::<Result<_>>().map_err(at_path)?;
        check_axes(&axes, spec).map_err(at_path)?;
        for (index, axis) in axes.iter().enumerate() {
            for value in axis.examples() {
                let tried = base.check(&axis.key, &value, |_| Ok(()));
                tried.map_err(|e| in_table(path, &format!("axis[{index}]"), &e))?;
            }
        }
        let base_scene = base.scene()?;
        if base_scene.script.is_empty() && axes.iter().all(|axis| axis.key.begins() != "script") {
            let reason = "script = []: give at least one [[script]] table, what the hand does";
            return Err(Error::content(&scene_path, reason));
        }
        // Settings may come from files that the scene no longer names.
        let set = base.text()?;
        let mut inputs = vec![text.into_bytes(), scene.text().as_bytes().to_vec(), set.into_bytes()];
        for input in base_scene.input_paths() {
            inputs.push(endowire_core::file::read(&input, u64::MAX)?);
        }
        let parameters = axes.iter().map(|axis| (axis.key.to_string(), ParameterKind::of(&axis.examples())));
        let instruments = base_scene.instrument.iter().map(|one| one.name.clone());
        let columns = Columns { parameters: parameters.collect(), instruments: instruments.collect() };
        let recorded = spec.record;
        let sweep = Self { base, axes, samples, recorded, columns, hash: hash_inputs(&inputs) };
        sweep.check_devices().map_err(at_path)?;
        Ok(sweep)
    }

    /// Refuses axes of device files if none of the first runs yields a valid device, for example because the value
    /// conflicts with another key in every run.
    fn check_devices(&self) -> Result<()> {
        if self.axes.iter().all(|axis| !axis.key.is_of_device()) {
            return Ok(());
        }
        let device = |number| self.scene(&self.run(number).values)?.scene()?.stack();
        let mut tried = (0..self.len().min(TRIED)).map(device);
        match tried.next() {
            Some(Err(error)) if tried.all(|other| other.is_err()) => Err(error),
            _ => Ok(()),
        }
    }

    /// A remark on an axis that has no effect, to be shown before the sweep runs; `None` if there is no such axis.
    pub fn remark(&self) -> Option<String> {
        let index = self.axes.iter().position(|axis| axis.key.to_string() == SEED)?;
        Some(format!(
            "axis[{index}].key = {SEED}: nothing in a scene is random, so runs that differ in it alone are the same; what is drawn has the \
             seed of the sweep, noise of frames view.detector.seed"
        ))
    }

    /// Number of runs.
    pub fn len(&self) -> usize {
        self.axes.iter().map(Axis::crossed).product::<usize>() * self.samples
    }

    /// Always false: a sweep has at least one run.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What is recorded of each run besides its row.
    pub fn recorded(&self) -> Option<Recorded> {
        self.recorded
    }

    /// SHA-256 of the sweep file, its scene and the files that the scene names.
    pub(crate) fn hash(&self) -> &str {
        &self.hash
    }

    pub(crate) fn columns(&self) -> &Columns {
        &self.columns
    }

    /// The scene with these values of the axes.
    pub(crate) fn scene(&self, values: &[Value]) -> Result<SceneTables> {
        let mut scene = self.base.clone();
        let of_device = |axis: &&(&Axis, &Value)| axis.0.key.is_of_device();
        let pairs: Vec<(&Axis, &Value)> = self.axes.iter().zip(values).collect();
        // Values of device files come last, since the device file itself may be a value.
        for (axis, value) in
            pairs.iter().filter(|pair| !of_device(pair)).chain(pairs.iter().filter(of_device))
        {
            scene.set(&axis.key, value)?;
        }
        Ok(scene)
    }

    /// The base scene file; paths are relative to its folder.
    pub(crate) fn scene_path(&self) -> &Path {
        self.base.path()
    }
}

/// A key of the scene that is written to recordings but affects no step.
const SEED: &str = "seed";

/// Number of runs whose devices are checked before the sweep starts.
const TRIED: usize = 16;

/// Number of samples; 1 if nothing is drawn.
fn samples(spec: &SweepSpec) -> Result<usize> {
    let drawn = spec.axis.iter().any(|axis| axis.random.is_some() || axis.latin.is_some());
    match (spec.samples, drawn) {
        (None, false) => Ok(1),
        (Some(samples), true) if (1..=RUN_LIMIT).contains(&samples) => Ok(samples),
        (Some(samples), true) => {
            Err(Error::parameter("samples", samples, format!("must be 1 to {RUN_LIMIT}")))
        }
        (Some(samples), false) => {
            let remedy = "nothing is drawn: leave it out, or give an axis random or latin";
            Err(Error::parameter("samples", samples, remedy))
        }
        (None, true) => {
            let remedy = "an axis is drawn: say how many runs each combination of lists and grids has";
            Err(Error::parameter("samples", "none", remedy))
        }
    }
}

fn check_axes(axes: &[Axis], spec: &SweepSpec) -> Result<()> {
    for (index, axis) in axes.iter().enumerate() {
        let name = format!("axis[{index}].key");
        let same = |other: &Key| other.holds(&axis.key) && axis.key.holds(other);
        let overlaps = |other: &&Axis| other.key.holds(&axis.key) || axis.key.holds(&other.key);
        if let Some(other) = axes[..index].iter().find(overlaps) {
            let remedy = match same(&other.key) {
                true => "is the key of another axis too: keep one of them".to_owned(),
                false => format!("overlaps with that of another axis, {}: keep one of them", other.key),
            };
            return Err(Error::parameter(name, &axis.key, remedy));
        }
        for given in spec.set.keys() {
            let key = Key::parse(given)?;
            // An axis inside a table of `[set]` replaces only its own key, as inside a table of the scene.
            if axis.key.holds(&key) {
                let what = if same(&key) { String::new() } else { format!("with {given} in it ") };
                let remedy = format!("{what}is given in [set] too: keep one of the two");
                return Err(Error::parameter(name, &axis.key, remedy));
            }
        }
        if axis.key.begins() == "view" && spec.record != Some(Recorded::Frames) {
            let remedy = "a view changes no row: give record = \"frames\", or leave the axis out";
            return Err(Error::parameter(name, &axis.key, remedy));
        }
    }
    let runs = axes.iter().try_fold(1usize, |runs, axis| runs.checked_mul(axis.crossed()));
    let runs = runs.and_then(|runs| runs.checked_mul(spec.samples.unwrap_or(1)));
    match runs {
        Some(runs) if runs <= RUN_LIMIT => Ok(()),
        _ => {
            let runs = runs.map_or("more than can be counted".to_owned(), |runs| runs.to_string());
            Err(Error::parameter("axis", format!("{runs} runs"), format!("at most {RUN_LIMIT} in all")))
        }
    }
}

/// Prefixes an error with the table of the sweep file.
fn in_table(path: &Path, table: &str, error: &Error) -> Error {
    Error::content(path, format!("{table}: {error}"))
}
