//! Scene files.

use std::path::PathBuf;
use std::sync::Arc;

use endowire_core::insertion::Command;
use endowire_core::vessel::NoStore;
use endowire_core::{Error, insertion};
use endowire_methods::Scene as SceneFile;
use endowire_viewer::ViewSpec;
use numpy::PyArray3;
use pyo3::prelude::*;

use crate::arrays::array;
use crate::error::exception;
use crate::frames::Renderer;
use crate::instrument::Instrument;
use crate::interrupt::interruptible;
use crate::report::StepReport;
use crate::simulation::Simulation;
use crate::start::Start;
use crate::vessel::{Vessel, warn};

/// A scene file: vessel, instruments, method, script and views.
#[pyclass(frozen, module = "endowire", name = "Scene")]
pub(crate) struct Scene {
    scene: Arc<SceneFile>,
    path: PathBuf,
}

#[pymethods]
impl Scene {
    /// Reads a scene file, or its `text`, in which paths are relative to the folder of `path`.
    ///
    /// Raises InputError naming file, line and key of an error.
    #[new]
    #[pyo3(signature = (path, text=None))]
    fn new(path: PathBuf, text: Option<&str>) -> PyResult<Self> {
        let scene = match text {
            Some(text) => SceneFile::from_toml(text, &path),
            None => SceneFile::read(&path),
        };
        Ok(Self { scene: Arc::new(scene.map_err(exception)?), path })
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Seed of everything random in it.
    #[getter]
    fn seed(&self) -> u64 {
        self.scene.seed
    }

    /// The simulation at its start; only what the instruments specify is inserted.
    fn simulation(slf: &Bound<'_, Self>) -> PyResult<Simulation> {
        Simulation::begin(slf.py(), Start::of_scene(slf)?)
    }

    /// Its vessel.
    fn vessel(&self, py: Python<'_>) -> PyResult<Vessel> {
        let scene = Arc::clone(&self.scene);
        interruptible(py, move || Vessel::of_scene(&scene))?.map_err(exception)
    }

    /// The moves of its script, shape (steps, n_instruments, 2): advance_mm and rotate_rad; with instruments that are
    /// steered (steps, n_instruments, 3), the changes of their steering too.
    ///
    /// Raises InputError if a line has `until`, because the number of steps is then not known beforehand, and if one
    /// has `detach`, which is no move. `run` carries out such scripts.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let stack = self.scene.stack().map_err(exception)?;
        let steps = self.scene.steps(&stack, &NoStore).and_then(|script| script.moves());
        let steps = steps.map_err(|error| match error {
            Error::Parameter { name, value, remedy } => {
                exception(Error::Parameter { name, value, remedy: remedy + " (Scene.run)" })
            }
            other => exception(other),
        })?;
        let hands = stack.instruments().len();
        let columns = if stack.is_steerable() { 3 } else { 2 };
        let mut numbers = vec![0.0; steps.len() * hands * columns];
        for (row, moves) in numbers.chunks_exact_mut(columns * hands).zip(&steps) {
            for one in moves {
                let Command { advance_mm, rotate_rad, steer } = one.command;
                let own = &mut row[columns * one.instrument..][..columns];
                own.copy_from_slice(&[advance_mm, rotate_rad, steer][..columns]);
            }
        }
        array(py, numbers, [steps.len(), hands, columns])
    }

    /// Carries out its script, including lines with `until`, in a simulation of the scene at its start. Returns the
    /// last StepReport. Ctrl-C ends it between two steps.
    ///
    /// Raises what `Simulation.step` raises; earlier steps are kept.
    fn run(&self, py: Python<'_>, simulation: &Simulation) -> PyResult<StepReport> {
        let script =
            self.scene.stack().and_then(|stack| self.scene.steps(&stack, &NoStore)).map_err(exception)?;
        let mut hand = script.begin();
        let mut step = |simulation: &mut insertion::Simulation| -> endowire_core::Result<bool> {
            let Some(next) = hand.next(simulation)? else { return Ok(false) };
            next.carry_out(simulation)?;
            hand.carried_out();
            Ok(true)
        };
        while simulation.with(py, &mut step).map_err(exception)? {
            py.check_signals()?;
        }
        Ok(simulation.report(py))
    }

    /// A renderer for its `[view]` table, overridden by `view`, in `vessel` if that already exists. With
    /// `biplane_deg`, `plane` 1 is the fluoroscopy of the second plane.
    #[pyo3(
        signature = (view=None, vessel=None, plane=None),
        text_signature = "($self, view=None, vessel=None, plane=0)"
    )]
    fn renderer(
        &self,
        py: Python<'_>,
        view: Option<&Bound<'_, PyAny>>,
        vessel: Option<&Vessel>,
        plane: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Renderer> {
        let spec = ViewSpec::of_scene(&self.scene, &self.path).map_err(exception)?;
        match vessel {
            Some(vessel) => Renderer::prepare(py, &spec, view, plane, vessel),
            None => Renderer::prepare(py, &spec, view, plane, &self.vessel(py)?),
        }
    }

    /// A scene is immutable, so it is its own copy.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (PathBuf, String))> {
        let scene = slf.get();
        let path = std::path::absolute(&scene.path).map_err(|e| exception(Error::file(&scene.path, e)))?;
        Ok((slf.get_type().into_any(), (path, scene.scene.text().to_owned())))
    }

    fn __repr__(&self) -> String {
        format!("<endowire.Scene {:?}>", self.scene.name)
    }
}

impl Scene {
    /// The simulation and its instruments.
    pub(crate) fn built(&self, py: Python<'_>) -> PyResult<(insertion::Simulation, Vec<Instrument>)> {
        let scene = Arc::clone(&self.scene);
        let built = interruptible(py, move || scene.simulation(&NoStore))?.map_err(exception)?;
        for note in self.scene.repair_notes() {
            warn(py, &format!("{}: {note}", self.path.display()))?;
        }
        let files = self.scene.device_files().map_err(exception)?;
        let instruments = files.into_iter().zip(built.stack().devices()).map(|(file, device)| match file {
            Some((_, file)) => Instrument::of_file(file),
            None => Ok(Instrument::of_device(device.clone())),
        });
        let instruments = instruments.collect::<PyResult<_>>()?;
        Ok((built, instruments))
    }
}
