//! States of simulations.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_core::field::{Field, FieldSpec};
use endowire_core::file::whole;
use endowire_core::insertion;
use endowire_core::{Error, Result};
use endowire_recording::seal;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error::{InputError, exception};
use crate::report::StepReport;

/// First bytes of a saved state, which ends with a hash, and those common to all versions.
const FORMAT: &[u8] = b"endowire.State 15\n";
const ANY_FORMAT: &[u8] = b"endowire.State ";

/// Whether a file was written by `State.save` of any version, or is empty, so that overwriting it loses nothing.
fn is_state(path: &Path) -> io::Result<bool> {
    let mut begins = Vec::new();
    File::open(path)?.take(ANY_FORMAT.len() as u64).read_to_end(&mut begins)?;
    Ok(begins.is_empty() || begins == ANY_FORMAT)
}

/// Everything that changes in a simulation: all that the next step depends on, except for what the simulation was made
/// of. The fields are part of it.
///
/// It is immutable and small, and can be copied, pickled, sent and saved. `Simulation.restore` continues from it to
/// the bit.
#[pyclass(frozen, module = "endowire", name = "State")]
pub(crate) struct State {
    state: insertion::State,
    /// The fields in which the instruments last came to rest, and those to which the next step leads.
    fields: [Vec<FieldSpec>; 2],
}

#[pymethods]
impl State {
    /// Name of its method.
    #[getter]
    fn method(&self) -> &str {
        self.state.method()
    }

    /// The report of the step that led to it.
    #[getter]
    fn report(&self) -> StepReport {
        StepReport::new(self.state.report().clone())
    }

    /// The state as bytes, which keep every bit of its numbers.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.bytes()?))
    }

    /// A state from the bytes of `to_bytes`.
    ///
    /// Raises InputError for bytes that are not a state, are incomplete, or were changed.
    #[staticmethod]
    fn from_bytes(data: &[u8]) -> PyResult<Self> {
        let refuse = |what: String| InputError::new_err(format!("the bytes of a state: {what}"));
        if !data.starts_with(FORMAT) {
            return Err(refuse(format!(
                "they do not begin with {:?}: give what State.to_bytes or State.save has written",
                String::from_utf8_lossy(FORMAT)
            )));
        }
        let Some(state) = seal::opened(data).and_then(|body| body.strip_prefix(FORMAT)) else {
            return Err(refuse("they are not whole, or were changed since they were written".to_owned()));
        };
        let (state, fields): (_, String) = postcard::from_bytes(state).map_err(|e| refuse(e.to_string()))?;
        let fields = serde_json::from_str(&fields).map_err(|e| refuse(format!("fields: {e}")))?;
        Ok(Self { state, fields })
    }

    /// Writes the state to a file. At any time the file is completely the previous or the new one, even if the
    /// program or the power fails.
    ///
    /// Raises InputError for a file that cannot be written, and for an existing file without a state, which is not
    /// overwritten.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        let failed = |e| exception(Error::file(&path, e));
        // A link is kept, and the file that it points to is replaced.
        let place = match path.canonicalize() {
            Ok(place) => place,
            Err(e) if e.kind() == ErrorKind::NotFound && path.symlink_metadata().is_err() => path.clone(),
            Err(e) => return Err(failed(e)),
        };
        // What is in a device or a pipe is not read: it is not lost, either.
        if place.exists() && !whole::is_special(&place) && !is_state(&place).map_err(failed)? {
            return Err(InputError::new_err(format!(
                "{}: is there and no state of endowire: give another name, or remove it first",
                path.display()
            )));
        }
        whole::write_bytes(&place, &self.bytes()?).map_err(failed)
    }

    /// Reads a state from a file written by `save`.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        Self::from_bytes(&endowire_core::file::read(&path, u64::MAX).map_err(exception)?)
    }

    /// A state is immutable, so it is its own copy.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let py = slf.py();
        Ok((slf.get_type().getattr("from_bytes")?, (slf.get().to_bytes(py)?,)))
    }

    fn __repr__(&self) -> String {
        let report = self.state.report();
        format!(
            "<endowire.State of {}: {} mm inserted, turned by {} rad>",
            self.state.method(),
            report.inserted_mm,
            report.rotation_rad
        )
    }
}

impl State {
    /// The state of a simulation.
    pub(crate) fn of(simulation: &insertion::Simulation) -> Self {
        // All fields that Python and scenes can name have their numbers.
        let fields = simulation.fields().map(|fields| fields.iter().filter_map(|one| one.spec()).collect());
        Self { state: simulation.state(), fields }
    }

    /// Restores it in a simulation of the same start; after an error nothing has changed.
    pub(crate) fn restore_in(&self, simulation: &mut insertion::Simulation) -> Result<()> {
        let [before, now] = &self.fields;
        let mut restored = simulation.clone();
        restored.set_fields(fields_of(before)?)?;
        restored.restore(&self.state)?;
        restored.set_fields(fields_of(now)?)?;
        *simulation = restored;
        Ok(())
    }

    fn bytes(&self) -> PyResult<Vec<u8>> {
        let failed =
            |e: &dyn std::fmt::Display| InputError::new_err(format!("the state cannot be written: {e}"));
        // Their tags need a format that describes itself.
        let fields = serde_json::to_string(&self.fields).map_err(|e| failed(&e))?;
        let bytes = postcard::to_extend(&(&self.state, fields), FORMAT.to_vec()).map_err(|e| failed(&e))?;
        Ok(seal::sealed(bytes))
    }
}

/// The fields of these numbers.
pub(crate) fn fields_of(specs: &[FieldSpec]) -> Result<Vec<Arc<dyn Field>>> {
    specs.iter().map(FieldSpec::field).collect()
}
