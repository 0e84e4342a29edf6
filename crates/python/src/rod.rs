//! Static rods.

use std::path::PathBuf;

use endowire_core::statics::StaticCase;
use pyo3::prelude::*;

use crate::document;
use crate::error::exception;
use crate::interrupt::interruptible;

/// A case: the path of its file, or its tables.
#[derive(FromPyObject)]
pub(crate) enum Case<'py> {
    Path(PathBuf),
    Tables(Bound<'py, PyAny>),
}

/// Solves a static rod case: the path of a case file, or its tables as dictionaries.
///
/// Returns the document of `endowire rod --json`, without the provenance; `converged` says whether it is an
/// equilibrium. Raises InputError for an invalid case.
#[pyfunction]
pub(crate) fn solve_rod<'py>(py: Python<'py>, case: Case<'py>) -> PyResult<Bound<'py, PyAny>> {
    let case = match case {
        Case::Path(path) => StaticCase::from_file(&path).map_err(exception)?,
        Case::Tables(tables) => document::read("case", &tables)?,
    };
    let solution = interruptible(py, move || case.solve())?.map_err(exception)?;
    document::write(py, &solution)
}
