//! Static rods.

use std::path::PathBuf;

use endowire_core::statics::StaticCase;
use pyo3::prelude::*;

use crate::document;
use crate::error::exception;
use crate::interrupt::interruptible;

/// Solves a static rod case: the path of a case file, or its tables as dictionaries.
///
/// Returns the document of `endowire rod --json`, without the provenance; `converged` says whether it is an
/// equilibrium. Raises InputError for an invalid case.
#[pyfunction]
pub(crate) fn solve_rod<'py>(py: Python<'py>, case: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let case = match case.extract::<PathBuf>() {
        Ok(path) => StaticCase::from_file(&path).map_err(exception)?,
        Err(_) => document::read("case", case)?,
    };
    let solution = interruptible(py, move || case.solve())?.map_err(exception)?;
    document::write(py, &solution)
}
