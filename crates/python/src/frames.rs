//! Pictures of both views, and their labels.

use std::sync::{Arc, Mutex, PoisonError};

use endowire_core::Vec3;
use endowire_core::shape::Shape;
use endowire_core::vessel::NoStore;
use endowire_viewer::{
    self as viewer, ContactView, DevicePart, FrameTime, Image, Moment, PixelFormat, Pushed, Seen, View,
    ViewSpec,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{array, natural, natural_or};
use crate::document;
use crate::error::{exception, refuse};
use crate::forked::on_own_threads;
use crate::interrupt::interruptible;
use crate::simulation::Simulation;
use crate::vessel::Vessel;

/// Draws instruments in a vessel: the 3D view, fluoroscopy, or both.
#[pyclass(frozen, module = "endowire", name = "Renderer")]
pub(crate) struct Renderer {
    inner: Mutex<viewer::Renderer>,
    /// The last frame: a pulse shows the motion of the same simulation since then.
    before: Mutex<Option<Before>>,
}

/// What a frame has shown.
struct Before {
    /// Address of its simulation: another one has not moved.
    of: usize,
    shape: Shape,
    inserted_mm: Vec<f64>,
    time_s: f64,
}

/// The frames of one state: `three_d`, 8-bit RGBA of shape (height, width, 4), and `fluoro`, 8 or 16 bits of shape
/// (height, width); None for a view that was not requested.
#[pyclass(frozen, get_all, module = "endowire", name = "Frames")]
pub(crate) struct Frames {
    /// The 3D view.
    three_d: Option<Py<PyAny>>,
    /// The fluoroscopic view.
    fluoro: Option<Py<PyAny>>,
}

impl Renderer {
    /// A renderer for a plane of `spec`, overridden by `view`.
    pub(crate) fn prepare(
        py: Python<'_>,
        spec: &ViewSpec,
        view: Option<&Bound<'_, PyAny>>,
        plane: Option<&Bound<'_, PyAny>>,
        vessel: &Vessel,
    ) -> PyResult<Self> {
        let mut spec = overridden(spec, view)?;
        let plane = natural_or("plane", plane, 0)?;
        if spec.wants(View::Fluoro) && !spec.injection.is_empty() && spec.flow.tree.is_none() {
            spec.flow.centreline = Some(Arc::new(vessel.tree(py)?.clone()));
        }
        // An injection outside the vessel would be a picture without medium.
        if spec.wants(View::Fluoro) {
            spec.check_places().map_err(exception)?;
        }
        let lumen = vessel.lumen.clone();
        let mut planes = spec.planes();
        if plane >= planes.len() {
            let remedy = match planes.len() {
                1 => "the view has one plane, 0; a second is that of view.biplane_deg",
                _ => "the view has two planes, 0 and 1",
            };
            return Err(refuse("plane", plane, remedy));
        }
        let spec = planes.swap_remove(plane);
        let made = interruptible(py, move || viewer::Renderer::of_wall(&spec, lumen.wall(&NoStore)?))?;
        Ok(Self { inner: Mutex::new(made.map_err(exception)?), before: Mutex::new(None) })
    }

    /// Runs `work` on the renderer with the interpreter released.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut viewer::Renderer) -> endowire_core::Result<T> + Send,
    ) -> PyResult<T> {
        let worked = py.detach(|| {
            on_own_threads(|| work(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner)))
        });
        worked?.map_err(exception)
    }

    /// The instruments, with the materials of the view's table if it gives them.
    fn views(&self, py: Python<'_>, simulation: &Simulation) -> PyResult<Vec<viewer::DeviceView>> {
        let mut views = simulation.views(py);
        let several = views.len() > 1;
        let own = self.with(py, |renderer| {
            renderer.spec().own_parts(several).map(|parts| parts.map(<[DevicePart]>::to_vec))
        })?;
        if let Some(own) = own {
            views[0].parts = own;
        }
        Ok(views)
    }

    /// Moves the vessel to its position in a simulation.
    fn move_vessel(&self, py: Python<'_>, simulation: &Simulation) -> PyResult<()> {
        let displacement = simulation.with(py, |simulation| simulation.displacement());
        self.with(py, |renderer| renderer.move_vessel(displacement.as_ref()))
    }
}

#[pymethods]
impl Renderer {
    /// Prepares views of a vessel. `view` has the keys of `[view]` of a scene file: views (["3d", "fluoro"]),
    /// size_px, c_arm, xray, detector, patient, camera, … If it contains `biplane_deg`, `plane` 1 is the fluoroscopy
    /// of the second plane.
    ///
    /// Raises InputError for values out of range, and for a vessel that cannot be drawn.
    #[new]
    #[pyo3(signature = (vessel, view, plane=None), text_signature = "(vessel, view, plane=0)")]
    fn new(
        py: Python<'_>,
        vessel: &Vessel,
        view: &Bound<'_, PyAny>,
        plane: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        Self::prepare(py, &ViewSpec::default(), Some(view), plane, vessel)
    }

    /// Name of the backend: "CPU reference", or the graphics interface and adapter.
    #[getter]
    fn backend(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |renderer| Ok(renderer.backend().to_owned()))
    }

    /// Fraction of the vessel's surface inside the tomogram of its patient, 0 to 1; None without a tomogram.
    #[getter]
    fn vessel_held(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        self.with(py, |renderer| Ok(renderer.vessel_held()))
    }

    /// Draws the views of a simulation in its current state. `frame` is the number of the frame, which determines its
    /// noise and its time; by default the next one. With `xray.pulse_ms` it shows the motion since the last frame of this
    /// simulation.
    ///
    /// Raises InputError for a view that requests no frames, for a negative frame, and for a simulation that cannot be
    /// drawn.
    #[pyo3(signature = (simulation, frame=None))]
    fn render(
        &self,
        py: Python<'_>,
        simulation: &Simulation,
        frame: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Frames> {
        let frame: Option<u64> = frame.map(|frame| natural("frame", frame)).transpose()?;
        let views = self.views(py, simulation)?;
        if self.with(py, |renderer| Ok(renderer.spec().views.is_empty()))? {
            return Err(refuse("view.views", "[]", "nothing is drawn: give \"3d\", \"fluoro\" or both"));
        }
        let of = std::ptr::from_ref(simulation) as usize;
        let (stack, shape, report, coils, displacement) = simulation.with(py, |simulation| {
            let (shape, report) = (simulation.shape().clone(), simulation.report().clone());
            let coils = simulation.coils().to_vec();
            (simulation.stack().clone(), shape, report, coils, simulation.displacement())
        });
        let inserted_mm = report.lengths_mm();
        let contacts = report.contacts.iter();
        let contacts: Vec<_> =
            contacts.map(|c| ContactView { position_mm: c.position_mm, force_n: c.total_n() }).collect();
        let parts = views.iter().zip(simulation.pushed());
        let parts = parts.map(
            |(view, one)| {
                if view.parts.is_empty() { one.parts.clone() } else { view.parts.clone() }
            },
        );
        let mut pushed = Pushed::of_parts(stack, parts.collect());
        let before = self.before.lock().unwrap_or_else(PoisonError::into_inner).take();
        let (frames, time_s) = self.with(py, |renderer| {
            let frame = match frame {
                None => renderer.next_frame(),
                Some(frame) => FrameTime { frame, time_s: frame as f64 / renderer.spec().frames_per_s },
            };
            let before = before.as_ref().filter(|before| before.of == of).map(|before| Seen {
                shape: &before.shape,
                inserted_mm: &before.inserted_mm,
                time_s: before.time_s,
            });
            let moment = Moment {
                frame,
                shape: &shape,
                inserted_mm: &inserted_mm,
                coils: &coils,
                contacts: &contacts,
                displacement: displacement.as_ref(),
                before,
            };
            Ok((renderer.draw(&mut pushed, &moment)?, frame.time_s))
        })?;
        let now = Before { of, shape, inserted_mm, time_s };
        *self.before.lock().unwrap_or_else(PoisonError::into_inner) = Some(now);
        let of = |image: Option<Image>| image.map(|image| pixels(py, image)).transpose();
        Ok(Frames { three_d: of(frames.three_d)?, fluoro: of(frames.fluoro)? })
    }

    /// Labels of the fluoroscopic view, without noise: a dictionary of `mask` (height, width; k + 1 where instrument
    /// k covers half of the pixel), `vessel` (the same for the lumen, 255; None if the wall is not closed), `devices`
    /// (centre_line_px, centre_line_mm, depth_mm, tip_px, tip_mm, tip_visible, and shaft_px: its shaft outside the
    /// vessel, which is in the picture and not simulated), `contacts` (pixel, position_mm, visible) and `camera_matrix` (3, 4), which maps (x, y, z, 1) in mm to pixel coordinates times the depth from
    /// the source. Pixel coordinates are x and y from the top left.
    fn labels<'py>(&self, py: Python<'py>, simulation: &Simulation) -> PyResult<Bound<'py, PyDict>> {
        let views = self.views(py, simulation)?;
        self.move_vessel(py, simulation)?;
        let contacts: Vec<Vec3> = simulation
            .with(py, |simulation| simulation.report().contacts.iter().map(|c| c.position_mm).collect());
        let labels = self.with(py, |renderer| renderer.labels(&views, &contacts))?;
        let reported = PyDict::new(py);
        let devices = PyList::empty(py);
        for device in labels.devices {
            let one = PyDict::new(py);
            let line = device.centre_line_px;
            one.set_item("centre_line_px", array(py, line.as_flattened().to_vec(), [line.len(), 2])?)?;
            let line = device.centre_line_mm;
            one.set_item("centre_line_mm", array(py, line.as_flattened().to_vec(), [line.len(), 3])?)?;
            let line = device.shaft_px;
            one.set_item("shaft_px", array(py, line.as_flattened().to_vec(), [line.len(), 2])?)?;
            let depths = device.depth_mm.len();
            one.set_item("depth_mm", array(py, device.depth_mm, [depths])?)?;
            one.set_item("tip_mm", device.tip_mm)?;
            one.set_item("tip_px", device.tip_px)?;
            one.set_item("tip_visible", device.tip_visible)?;
            devices.append(one)?;
        }
        reported.set_item("devices", devices)?;
        reported.set_item("contacts", document::write(py, &labels.contacts)?)?;
        reported.set_item("mask", pixels(py, labels.mask)?)?;
        reported.set_item("vessel", labels.vessel.map(|mask| pixels(py, mask.image())).transpose()?)?;
        reported
            .set_item("camera_matrix", array(py, labels.camera_matrix.as_flattened().to_vec(), [3, 4])?)?;
        Ok(reported)
    }
}

/// Checks the keys and values of a `[view]` table: used where there is no vessel to draw yet.
#[pyfunction]
#[pyo3(name = "_check_view")]
pub(crate) fn check_view(view: &Bound<'_, PyAny>) -> PyResult<()> {
    overridden(&ViewSpec::default(), Some(view)).map(drop)
}

/// A view, overridden by a `[view]` table.
fn overridden(spec: &ViewSpec, view: Option<&Bound<'_, PyAny>>) -> PyResult<ViewSpec> {
    let vessel_moves = spec.patient.vessel_moves;
    let mut spec = match view {
        Some(table) => document::read_over("view", spec, table)?,
        None => spec.clone(),
    };
    spec.patient.vessel_moves = vessel_moves;
    spec.validate().map_err(exception)?;
    Ok(spec)
}

/// A picture as an array that takes over its pixels.
fn pixels(py: Python<'_>, image: Image) -> PyResult<Py<PyAny>> {
    let (height, width) = (image.height() as usize, image.width() as usize);
    Ok(match image.format() {
        PixelFormat::Gray8 => array(py, image.into_data(), [height, width])?.into_any().unbind(),
        PixelFormat::Rgba8 => array(py, image.into_data(), [height, width, 4])?.into_any().unbind(),
        PixelFormat::Gray16 => {
            let wide = image.data().chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect();
            PyArray1::<u16>::from_vec(py, wide).reshape([height, width])?.into_any().unbind()
        }
    })
}
