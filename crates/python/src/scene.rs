//! Scene files.

use std::path::PathBuf;
use std::sync::Arc;

use endowire_core::vessel::NoStore;
use endowire_methods::Scene as SceneFile;
use endowire_viewer::ViewSpec;
use numpy::PyArray3;
use pyo3::prelude::*;

use crate::arrays::array;
use crate::error::exception;
use crate::frames::Renderer;
use crate::instrument::Instrument;
use crate::interrupt::interruptible;
use crate::moves::INSTRUMENTS;
use crate::simulation::Simulation;
use crate::vessel::Vessel;

/// A scene file: what is pushed into what, how, and how it is seen.
#[pyclass(frozen, module = "endowire", name = "Scene")]
pub(crate) struct Scene {
    scene: Arc<SceneFile>,
    path: PathBuf,
}

#[pymethods]
impl Scene {
    /// Reads a scene file, or the text of one, from whose `path` its own paths start.
    ///
    /// Raises InputError naming file, line and key of what does not fit.
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

    /// The simulation, nothing inserted yet.
    fn simulation(&self, py: Python<'_>) -> PyResult<Simulation> {
        // Several instruments are refused.
        self.scene.device().map_err(exception)?;
        let scene = Arc::clone(&self.scene);
        let built = interruptible(py, move || scene.simulation(&NoStore))?.map_err(exception)?;
        let instrument = match self.scene.device_files().map_err(exception)?.into_iter().flatten().next() {
            Some((_, file)) => Instrument::of_file(file)?,
            None => Instrument { device: built.device().clone(), parts: vec![] },
        };
        Ok(Simulation::new(built, vec![instrument]))
    }

    /// Its vessel.
    fn vessel(&self, py: Python<'_>) -> PyResult<Vessel> {
        let scene = Arc::clone(&self.scene);
        let wall = interruptible(py, move || scene.wall(&NoStore))?.map_err(exception)?;
        Ok(Vessel::of_wall(wall))
    }

    /// The commands of its script, shape (steps, n_instruments, 2): advance_mm and rotate_rad.
    ///
    /// Raises InputError where a line has `until`: how many steps there are is not known beforehand.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let device = self.scene.device().map_err(exception)?;
        let commands = self.scene.commands(&device).map_err(exception)?;
        let numbers: Vec<f64> = commands.iter().flat_map(|c| [c.advance_mm, c.rotate_rad]).collect();
        array(py, numbers, [commands.len(), INSTRUMENTS, 2])
    }

    /// What draws the views of its `[view]` table, in which `view` says otherwise, in `vessel` if it is at hand.
    #[pyo3(signature = (view=None, vessel=None))]
    fn renderer(
        &self,
        py: Python<'_>,
        view: Option<&Bound<'_, PyAny>>,
        vessel: Option<&Vessel>,
    ) -> PyResult<Renderer> {
        let spec = ViewSpec::of_scene(&self.scene, &self.path).map_err(exception)?;
        let wall = match vessel {
            Some(vessel) => Arc::clone(&vessel.wall),
            None => self.vessel(py)?.wall,
        };
        Renderer::prepare(py, &spec, view, wall)
    }

    fn __repr__(&self) -> String {
        format!("<endowire.Scene {:?}>", self.scene.name)
    }
}
