//! Instruments.

use std::path::PathBuf;

use endowire_core::device::{Device, DeviceFile, Section};
use endowire_viewer::{DevicePart, device_parts, section_parts};
use pyo3::prelude::*;

use crate::document;
use crate::error::{InputError, exception, refuse};

/// The sections of an instrument, its materials, and the length of its coil, mm.
type Pickled<'py> = (Bound<'py, PyAny>, String, f64);

/// A wire or catheter: its sections, tip first.
#[pyclass(frozen, from_py_object, module = "endowire", name = "Instrument")]
#[derive(Clone)]
pub(crate) struct Instrument {
    pub(crate) device: Device,
    /// Its materials, for pictures.
    pub(crate) parts: Vec<DevicePart>,
}

#[pymethods]
impl Instrument {
    /// An instrument made of sections, tip first: dictionaries with the keys of `[[device.section]]` of a scene file
    /// (length_mm, radius_mm, bending_stiffness_nmm2, and optionally inner_radius_mm, soft_plane, torsional_stiffness_nmm2,
    /// rest_curvature_per_mm, steer). With `coil_mm` it is a coil on its pusher: so long, from the tip to the end of a section,
    /// is what `Simulation.detach` detaches.
    ///
    /// Raises InputError naming the section and the value that is out of range.
    #[new]
    #[pyo3(signature = (sections, *, coil_mm=0.0))]
    fn new(sections: &Bound<'_, PyAny>, coil_mm: f64) -> PyResult<Self> {
        let sections: Vec<Section> = document::read_list("sections", sections)?;
        let device = Device::new(sections).map_err(exception)?;
        Ok(Self::of_device(if coil_mm == 0.0 { device } else { coil(device, coil_mm)? }))
    }

    /// A uniform instrument: lengths in mm, bending stiffness EI in N·mm².
    #[staticmethod]
    fn uniform(length_mm: f64, radius_mm: f64, bending_stiffness_nmm2: f64) -> PyResult<Self> {
        let device = Device::uniform(length_mm, radius_mm, bending_stiffness_nmm2).map_err(exception)?;
        Ok(Self { device, parts: vec![] })
    }

    /// Reads a device file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        Self::of_file(DeviceFile::read(&path).map_err(exception)?)
    }

    /// Length, mm.
    #[getter]
    fn length_mm(&self) -> f64 {
        self.device.length_mm()
    }

    /// Length of its coil, from the tip, which can be detached, mm; 0 if it is no coil.
    #[getter]
    fn coil_mm(&self) -> f64 {
        self.device.coil_mm()
    }

    /// Sections, tip first, as dictionaries. They do not say whether it is a coil: `coil_mm` does.
    #[getter]
    fn sections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        document::write(py, &self.device.sections())
    }

    /// An instrument is immutable, so it is its own copy.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Pickled<'py>)> {
        let instrument = slf.get();
        let parts = serde_json::to_string(&instrument.parts)
            .map_err(|e| InputError::new_err(format!("the instrument cannot be written: {e}")))?;
        Ok((
            slf.get_type().getattr("_unpickled")?,
            (instrument.sections(slf.py())?, parts, instrument.coil_mm()),
        ))
    }

    #[staticmethod]
    fn _unpickled(sections: &Bound<'_, PyAny>, parts: &str, coil_mm: f64) -> PyResult<Self> {
        let parts = serde_json::from_str(parts)
            .map_err(|e| InputError::new_err(format!("the parts of an instrument: {e}")))?;
        Ok(Self { parts, ..Self::new(sections, coil_mm)? })
    }

    fn __repr__(&self) -> String {
        let coil = match self.device.coil_mm() {
            0.0 => String::new(),
            coil_mm => format!(", a coil of {coil_mm} mm"),
        };
        let (length_mm, sections) = (self.device.length_mm(), self.device.sections().len());
        format!("<endowire.Instrument: {length_mm} mm, {sections} sections{coil}>")
    }
}

/// The device as a coil that ends where a section does.
fn coil(device: Device, coil_mm: f64) -> PyResult<Device> {
    let ends_mm = device.sections().iter().scan(0.0, |end_mm, section| {
        *end_mm += section.length_mm;
        Some(*end_mm)
    });
    let near_mm = 1e-9 * device.length_mm();
    if ends_mm.into_iter().any(|end_mm: f64| (end_mm - coil_mm).abs() < near_mm) {
        return device.with_coil(coil_mm).map_err(exception);
    }
    Err(refuse("coil_mm", coil_mm, "must be the distance from the tip to the end of a section"))
}

impl Instrument {
    /// A device without a file: tubes without a material.
    pub(crate) fn of_device(device: Device) -> Self {
        Self { parts: section_parts(&device), device }
    }

    pub(crate) fn of_file(file: DeviceFile) -> PyResult<Self> {
        let parts = device_parts(&file).map_err(exception)?;
        Ok(Self { device: file.device, parts })
    }
}
