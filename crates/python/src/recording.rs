//! Recordings of runs: written beside a simulation, and read.

use std::ffi::CString;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use endowire_core::Error;
use endowire_methods::Scene as SceneFile;
use endowire_recording as recording;
use endowire_recording::table::{Row, read_if_any};
use endowire_recording::{
    COILS, CoilRow, Column, EndedBy, INJECTIONS, INSTRUMENTS, InjectionRow, InstrumentRow, PACKING, PLACES,
    PackingRow, PlaceRow, Program, Provenance, STEPS, SUMMARY, StepFailure, StepRow, Summary, UnknownRow,
    VESSEL, schema,
};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeWarning, PySystemExit};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::arrays::{points, shown};
use crate::document;
use crate::error::{EndOfWay, InputError, exception, refuse};
use crate::interrupt::interruptible;
use crate::simulation::Simulation;

/// This package, as it is named in recordings and rows of sweeps.
pub(crate) const PROGRAM: Program =
    Program { version: env!("CARGO_PKG_VERSION"), git_revision: env!("ENDOWIRE_GIT_REVISION") };

/// A recorded run, of `endowire run` or of a `Recorder`: of one that goes on or was killed, all whole steps. `len` is
/// the number of its steps; steps are counted from 0, and from the end by negative numbers.
#[pyclass(frozen, module = "endowire", name = "Recording")]
pub(crate) struct Recording {
    inner: recording::Recording,
}

#[pymethods]
impl Recording {
    /// Reads the recording in a folder. What a run that was killed has not written whole is left out, and a RuntimeWarning says
    /// so.
    ///
    /// Raises InputError for a folder without one, for files that are damaged, and for tables that are not of the same steps.
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let read = interruptible(py, move || recording::Recording::read(&folder))?;
        let inner = read.map_err(exception)?;
        if let Some(what) = inner.left_out() {
            let text = format!("{}: {what}: read up to the last whole step", inner.folder().display());
            let text = CString::new(text).unwrap_or_default();
            PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), &text, 1)?;
        }
        Ok(Self { inner })
    }

    /// What was left out because a run that was killed has not written it whole; None without any.
    #[getter]
    fn left_out(&self) -> Option<&str> {
        self.inner.left_out()
    }

    /// Its folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.inner.folder().to_path_buf()
    }

    /// Its summary.json, a dictionary.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let path = self.inner.folder().join(SUMMARY);
        let text = std::fs::read(&path).map_err(|e| exception(Error::file(&path, e)))?;
        let read: Result<Value, _> = serde_json::from_slice(&text);
        document::write(py, &read.map_err(|e| exception(Error::content(&path, e.to_string())))?)
    }

    /// The columns of steps.csv by name, each an array with a number for every step: floats, with NaN where there is
    /// none, or booleans.
    #[getter]
    fn steps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.table(py, STEPS)
    }

    /// The columns of a table by name, as `steps`; names in it are lists. `name` is that of a file: steps.csv,
    /// instruments.csv, injections.csv, coils.csv, vessel.csv, places.csv or packing.csv. Without that file columns
    /// are empty.
    ///
    /// Raises InputError for another name and for a damaged table.
    fn table<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
        let of = &self.inner;
        match name {
            STEPS => columns::<StepRow>(py, of, name, StepRow::COLUMNS),
            INSTRUMENTS => columns::<InstrumentRow>(py, of, name, InstrumentRow::COLUMNS),
            INJECTIONS => columns::<InjectionRow>(py, of, name, InjectionRow::COLUMNS),
            COILS => columns::<CoilRow>(py, of, name, CoilRow::COLUMNS),
            VESSEL => columns::<UnknownRow>(py, of, name, UnknownRow::COLUMNS),
            PLACES => columns::<PlaceRow>(py, of, name, PlaceRow::COLUMNS),
            PACKING => columns::<PackingRow>(py, of, name, PackingRow::COLUMNS),
            _ => {
                let known: Vec<&str> = schema::TABLES.iter().map(|(name, _)| *name).collect();
                Err(refuse("name", format!("{name:?}"), &format!("give one of {}", known.join(", "))))
            }
        }
    }

    /// The JSON schema of recordings, a dictionary: keys of summary.json, columns of tables and arrays, with units and
    /// meanings.
    #[staticmethod]
    fn schema(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        document::write(py, &schema::document())
    }

    /// Places of the nodes after a step, shape (n, 3), from the sheath to the tip.
    ///
    /// Raises InputError for a step that there is not, as the next two do.
    #[pyo3(signature = (step=None))]
    fn positions_mm<'py>(
        &self,
        py: Python<'py>,
        step: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        points(py, self.inner.shape(self.row(step)?).positions_mm)
    }

    /// Arc lengths of these nodes from the tip.
    #[pyo3(name = "from_tip_mm", signature = (step=None))]
    fn lengths_mm<'py>(
        &self,
        py: Python<'py>,
        step: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.inner.shape(self.row(step)?).from_tip_mm))
    }

    /// Places of the contacts after a step, and the forces of the wall on the device there, N: two arrays of shape
    /// (n, 3).
    #[pyo3(signature = (step=None))]
    fn contacts<'py>(&self, py: Python<'py>, step: Option<&Bound<'py, PyAny>>) -> PyResult<Contacts<'py>> {
        let contacts = self.inner.contacts(self.row(step)?);
        let places = points(py, contacts.iter().map(|one| one.position_mm))?;
        Ok((places, points(py, contacts.iter().map(|one| one.force_n))?))
    }

    fn __len__(&self) -> usize {
        self.inner.steps()
    }

    fn __repr__(&self) -> String {
        format!("<endowire.Recording of {} steps in {}>", self.inner.steps(), self.inner.folder().display())
    }
}

impl Recording {
    /// Number of the row of a step, from 1; by default the last.
    fn row(&self, step: Option<&Bound<'_, PyAny>>) -> PyResult<usize> {
        let steps = self.inner.steps() as i64;
        let given = step.map_or(Ok(-1), |step| {
            step.extract::<i64>().map_err(|_| refuse("step", shown(step), "must be a whole number"))
        })?;
        let from_0 = if given < 0 { given + steps } else { given };
        if (0..steps).contains(&from_0) {
            return Ok(from_0 as usize + 1);
        }
        Err(refuse("step", given, &format!("must be from {} to {}", -steps, steps - 1)))
    }
}

/// Places and forces of contacts.
type Contacts<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// The columns of a table of a recording, without rows of a step that was not written whole.
fn columns<'py, T: DeserializeOwned + Serialize + Row + Send + 'static>(
    py: Python<'py>,
    of: &recording::Recording,
    name: &str,
    columns: &[Column],
) -> PyResult<Bound<'py, PyDict>> {
    let path = of.folder().join(name);
    let rows = interruptible(py, move || read_if_any::<T>(&path))?.map_err(exception)?.unwrap_or_default();
    let rows: Result<Vec<Value>, _> = rows.iter().map(serde_json::to_value).collect();
    let mut rows = rows.map_err(|e| InputError::new_err(format!("{name}: {e}")))?;
    let last = of.rows().last().map_or(0, |row| row.step as u64);
    rows.retain(|row| row["step"].as_u64().is_none_or(|step| step <= last));
    let table = PyDict::new(py);
    for column in columns {
        let cells = rows.iter().map(|row| &row[column.name]);
        match column.kind {
            "string" => {
                let texts: Vec<&str> = cells.map(|cell| cell.as_str().unwrap_or_default()).collect();
                table.set_item(column.name, texts)?;
            }
            "boolean" if !column.optional => {
                let answers: Vec<bool> = cells.map(|cell| cell.as_bool().unwrap_or_default()).collect();
                table.set_item(column.name, PyArray1::from_vec(py, answers))?;
            }
            _ => {
                let number = |cell: &Value| cell.as_f64().or_else(|| cell.as_bool().map(f64::from));
                let numbers = cells.map(|cell| number(cell).unwrap_or(f64::NAN)).collect();
                table.set_item(column.name, PyArray1::from_vec(py, numbers))?;
            }
        }
    }
    Ok(table)
}

/// A recording that is being written.
struct Open {
    recorder: recording::Recorder,
    provenance: Provenance,
    scene: Option<(String, PathBuf)>,
    summary: Summary,
    /// Whether the last step could not be written.
    is_unwritten: bool,
}

impl Open {
    fn summarise(&mut self, simulation: &endowire_core::Simulation) {
        let mut summary = self.recorder.summary(&self.provenance, simulation);
        if let Some((name, file)) = &self.scene {
            (summary.scene, summary.scene_file) = (name.clone(), Some(file.clone()));
        }
        self.summary = summary;
    }

    /// Writes the summary so far at intervals.
    fn checkpoint(&mut self) -> endowire_core::Result<()> {
        let Self { recorder, summary, .. } = self;
        recorder.checkpoint(|_| summary.clone())
    }
}

/// Writes a recording step by step, in the format of `endowire run`: what is noted is on disk, and a program that is
/// killed leaves a recording of all steps before. Use it in a `with` statement, or call `close`.
///
/// `endowire report`, `render` and `export` show what is recorded in the scene that `scene` names.
#[pyclass(frozen, module = "endowire", name = "Recorder")]
pub(crate) struct Recorder {
    open: Mutex<Option<Open>>,
    folder: PathBuf,
}

#[pymethods]
impl Recorder {
    /// Begins a recording in a folder, of a simulation as it is before its next step. An earlier recording there is
    /// replaced. `scene` is the file of the scene that the simulation is of.
    ///
    /// Raises InputError for a folder with other files, and for one in which another program records.
    #[new]
    #[pyo3(signature = (simulation, folder, scene=None))]
    fn new(
        py: Python<'_>,
        simulation: &Simulation,
        folder: PathBuf,
        scene: Option<PathBuf>,
    ) -> PyResult<Self> {
        let begun = simulation.with(py, |simulation| -> endowire_core::Result<Open> {
            let read = scene.map(|file| Ok::<_, Error>((SceneFile::read(&file)?, file))).transpose()?;
            let provenance = match &read {
                Some((scene, _)) => Provenance::of_scene(PROGRAM, scene)?,
                None => Provenance::new(PROGRAM, &[""; 0], 0),
            };
            let scene = read.map(|(scene, file)| (scene.name, std::path::absolute(&file).unwrap_or(file)));
            let recorder = recording::Recorder::new(&folder, simulation)?;
            let summary = recorder.summary(&provenance, simulation);
            let mut open = Open { recorder, provenance, scene, summary, is_unwritten: false };
            open.summarise(simulation);
            open.checkpoint()?;
            Ok(open)
        });
        Ok(Self { open: Mutex::new(Some(begun.map_err(exception)?)), folder })
    }

    /// Records the step that the simulation has just carried out, with its command as given to `Simulation.step`, which
    /// ended at `time_s` since the start.
    ///
    /// Raises InputError for a step that is not the next one of the same simulation, for a time before that of the last step,
    /// for numbers that are not finite, for what cannot be written, and after `close`; earlier steps are kept.
    #[pyo3(signature = (simulation, time_s, advance_mm=None, rotate_rad=None, steer=None))]
    fn note(
        &self,
        py: Python<'_>,
        simulation: &Simulation,
        time_s: f64,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
        steer: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let moves = simulation.moves(advance_mm, rotate_rad, steer)?;
        let noted = simulation.with(py, |simulation| {
            let mut open = self.lock();
            let Some(open) = open.as_mut() else {
                return Err(Error::content(&self.folder, "the recording is closed: begin another one"));
            };
            let recorded = open.recorder.record(&moves, time_s, simulation).and_then(|()| {
                open.summarise(simulation);
                open.checkpoint()
            });
            open.is_unwritten = matches!(recorded, Err(Error::File { .. }));
            recorded
        });
        noted.map_err(exception)
    }

    /// Completes the recording; further calls do nothing.
    ///
    /// Raises InputError or ComputationError if it cannot be written.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.end(py, |_| None)
    }

    /// The folder.
    #[getter]
    fn folder(&self) -> PathBuf {
        self.folder.clone()
    }

    fn __enter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    /// As `close`; an exception that ends the `with` statement is reported in the summary as what has ended the recording.
    #[pyo3(signature = (kind=None, raised=None, trace=None))]
    fn __exit__(
        &self,
        py: Python<'_>,
        kind: Option<&Bound<'_, PyAny>>,
        raised: Option<&Bound<'_, PyAny>>,
        trace: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let _ = (kind, trace);
        let Some(raised) = raised else { return self.close(py) };
        let ended_by = ended_by(raised)?;
        let name = raised.get_type().name()?;
        let reason = format!("{name}: {}", raised.str()?);
        self.end(py, |open| {
            let kind = if open.is_unwritten { EndedBy::Unrecorded } else { ended_by };
            Some(StepFailure { step: open.recorder.steps() + 1, reason, kind })
        })
    }
}

/// What an exception has ended a recording by.
fn ended_by(raised: &Bound<'_, PyAny>) -> PyResult<EndedBy> {
    let py = raised.py();
    if raised.is_instance_of::<PyKeyboardInterrupt>() || raised.is_instance_of::<PySystemExit>() {
        return Ok(EndedBy::Interrupted);
    }
    if !raised.is_instance(&py.get_type::<EndOfWay>())? {
        return Ok(EndedBy::Failed);
    }
    let known: String = raised.getattr("ended_by")?.extract()?;
    Ok(serde_json::from_value(known.into()).unwrap_or(EndedBy::Failed))
}

impl Recorder {
    /// Completes the recording; a failure has ended it if `failed` says so.
    fn end(&self, py: Python<'_>, failed: impl FnOnce(&Open) -> Option<StepFailure> + Send) -> PyResult<()> {
        let ended = py.detach(|| {
            let Some(open) = self.lock().take() else { return Ok(()) };
            let failure = failed(&open);
            let Open { recorder, mut summary, .. } = open;
            if let Some(failure) = failure {
                summary.outcome = summary.outcome.failed(failure);
            }
            recorder.finish(&mut summary)
        });
        ended.map_err(exception)
    }

    fn lock(&self) -> MutexGuard<'_, Option<Open>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
