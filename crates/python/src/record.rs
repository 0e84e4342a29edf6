//! Records of instruments, tips and forces, step by step, for assessment.

use std::sync::{Mutex, MutexGuard, PoisonError};

use endowire_assess::Way;
use endowire_core::insertion::Move;
use endowire_recording::check_step;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::assess::check_within;
use crate::document;
use crate::error::{InputError, exception, refuse};
use crate::interrupt::interruptible;
use crate::simulation::Simulation;
use crate::vessel::{Goal, Vessel};

/// The record of a procedure, step by step; `assess` measures it as `endowire.assess` measures a recorded run.
#[pyclass(frozen, module = "endowire", name = "Record")]
#[derive(Default)]
pub(crate) struct Record {
    inner: Mutex<endowire_assess::Record>,
}

impl Record {
    pub(crate) fn lock(&self) -> MutexGuard<'_, endowire_assess::Record> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Record {
    /// An empty record. With a `simulation` as it is before the first step, the way of its tip begins there, and without
    /// one at the end of the first step.
    #[new]
    #[pyo3(signature = (simulation=None))]
    fn new(py: Python<'_>, simulation: Option<&Simulation>) -> Self {
        let record = Self::default();
        if let Some(simulation) = simulation {
            simulation.with(py, |simulation| record.lock().begin(simulation));
        }
        record
    }

    /// Number of recorded steps; consecutive rests are one.
    fn __len__(&self) -> usize {
        self.lock().samples.len()
    }

    /// Records a step of a simulation: its end `time_s` since the start, and the command as given to
    /// `Simulation.step`. Positions of tips, forces and jumps come from the simulation's report.
    ///
    /// Raises InputError for a time before that of the last step, and for numbers that are not finite.
    #[pyo3(signature = (simulation, time_s, advance_mm=None, rotate_rad=None))]
    fn note(
        &self,
        py: Python<'_>,
        simulation: &Simulation,
        time_s: f64,
        advance_mm: Option<&Bound<'_, PyAny>>,
        rotate_rad: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let moves = simulation.moves(advance_mm, rotate_rad, None)?;
        self.check(time_s, &moves)?;
        simulation.with(py, |simulation| self.lock().note(time_s, &moves, simulation, None));
        Ok(())
    }

    /// The measures: a list of dictionaries, as returned by `endowire.assess`. With a `vessel`, `target` is the name
    /// of a point of its centre line, or a place in mm, that was to be reached within `within_mm`; without a target,
    /// the way leads to the final position of the tip.
    ///
    /// Raises InputError for an unknown target, a target without a vessel, and a vessel without a centre line.
    #[pyo3(signature = (vessel=None, target=None, within_mm=5.0))]
    fn assess<'py>(
        &self,
        py: Python<'py>,
        vessel: Option<&Vessel>,
        target: Option<&Bound<'py, PyAny>>,
        within_mm: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        check_within(within_mm)?;
        let record = self.lock().clone();
        let target = target.map(|target| Goal::of("target", target)).transpose()?;
        let way = match (vessel, target) {
            (None, None) => None,
            (None, Some(_)) => {
                return Err(refuse("target", "a point of a centre line", "give the vessel too"));
            }
            (Some(vessel), Some(Goal::Place(place))) => {
                Way::towards(vessel.tree(py)?, place.into(), within_mm)
            }
            (Some(vessel), Some(Goal::Name(name))) => {
                Way::of_record(&record, vessel.tree(py)?, Some(&name), within_mm).map_err(exception)?
            }
            (Some(vessel), None) => {
                Way::of_record(&record, vessel.tree(py)?, None, within_mm).map_err(exception)?
            }
        };
        let measured = interruptible(py, move || endowire_assess::assess(&record, way.as_ref()))?;
        document::write(py, &measured)
    }

    /// An independent copy.
    fn copy(&self) -> Self {
        Self { inner: Mutex::new(self.lock().clone()) }
    }

    fn __copy__(&self) -> Self {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: Bound<'_, PyAny>) -> Self {
        self.copy()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let bytes = serde_json::to_vec(&*slf.get().lock())
            .map_err(|e| InputError::new_err(format!("a record: {e}")))?;
        Ok((slf.get_type().getattr("_unpickled")?, (PyBytes::new(slf.py(), &bytes),)))
    }

    #[staticmethod]
    fn _unpickled(data: &[u8]) -> PyResult<Self> {
        let record = serde_json::from_slice(data)
            .map_err(|e| InputError::new_err(format!("the bytes of a record: {e}")))?;
        Ok(Self { inner: Mutex::new(record) })
    }

    fn __repr__(&self) -> String {
        format!("<endowire.Record of {} steps>", self.__len__())
    }
}

impl Record {
    /// Refuses a time before that of the last step, and moves that are no numbers.
    pub(crate) fn check(&self, time_s: f64, moves: &[Move]) -> PyResult<()> {
        let last_s = self.lock().samples.last().map_or(0.0, |last| last.time_s);
        check_step(moves, time_s, last_s).map_err(exception)
    }
}
