//! Instruments.

use std::path::PathBuf;

use endowire_core::device::{Device, DeviceFile, Section};
use endowire_viewer::{DevicePart, device_parts, section_parts};
use pyo3::prelude::*;

use crate::document;
use crate::error::{InputError, exception};

/// The sections and the materials of an instrument.
type Pickled<'py> = (Bound<'py, PyAny>, String);

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
    /// (length_mm, radius_mm, bending_stiffness_nmm2, and optionally inner_radius_mm, torsional_stiffness_nmm2,
    /// rest_curvature_per_mm).
    ///
    /// Raises InputError naming the section and the value that is out of range.
    #[new]
    fn new(sections: &Bound<'_, PyAny>) -> PyResult<Self> {
        let sections: Vec<Section> = document::read("sections", sections)?;
        Ok(Self::of_device(Device::new(sections).map_err(exception)?))
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

    /// Sections, tip first, as dictionaries.
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
        Ok((slf.get_type().getattr("_unpickled")?, (instrument.sections(slf.py())?, parts)))
    }

    #[staticmethod]
    fn _unpickled(sections: &Bound<'_, PyAny>, parts: &str) -> PyResult<Self> {
        let parts = serde_json::from_str(parts)
            .map_err(|e| InputError::new_err(format!("the parts of an instrument: {e}")))?;
        Ok(Self { parts, ..Self::new(sections)? })
    }

    fn __repr__(&self) -> String {
        format!(
            "<endowire.Instrument: {} mm, {} sections>",
            self.device.length_mm(),
            self.device.sections().len()
        )
    }
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
