//! Sweeps, as in the program.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use endowire_core::vessel::NoStore;
use endowire_sweep::{Order, Shard, Sweep, merge};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{List, natural};
use crate::error::{exception, refuse};
use crate::interrupt::{interruptible, stoppable};
use crate::recording::PROGRAM;

/// Carries out the runs of a sweep file that have no row in the folder `out` yet, `jobs` at the same time (by default
/// the number of cores), and writes runs.parquet there when all have one, as `endowire sweep` does. `shard` is the
/// part to carry out: "1/4" is the first of four.
///
/// Returns a dictionary of `runs`, `earlier` (those that had a row before), `failed`, `unconverged` (those with steps
/// that did not converge) and `table` (its path). Ctrl-C stops it; the same call resumes it. Raises InputError for an
/// invalid sweep, for `record` in it, and for a folder with another sweep. Failures within a run are reported in its
/// row.
#[pyfunction]
#[pyo3(signature = (path, out, *, jobs=None, shard="1/1"))]
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    path: PathBuf,
    out: PathBuf,
    jobs: Option<&Bound<'py, PyAny>>,
    shard: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let jobs = jobs.map(|jobs| natural("jobs", jobs)).transpose()?;
    let shard: Shard =
        shard.parse().map_err(|remedy: String| refuse("shard", format!("{shard:?}"), &remedy))?;
    let sweep = Sweep::read(&path).map_err(exception)?;
    if sweep.recorded().is_some() {
        let remedy = "recordings are made by the program, endowire sweep: leave it out, or use that";
        return Err(refuse("record", "given", remedy));
    }
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    let reported = stoppable(py, &stop, move || {
        sweep.carry_out(&Order {
            folder: &out,
            shard,
            jobs,
            store: &NoStore,
            program: PROGRAM,
            record: None,
            stop: &seen,
            progress: &|_| (),
        })
    })?;
    let reported = reported.map_err(exception)?;
    let document = PyDict::new(py);
    document.set_item("runs", reported.progress.runs)?;
    document.set_item("earlier", reported.earlier)?;
    document.set_item("failed", reported.progress.failed)?;
    document.set_item("unconverged", reported.progress.unconverged)?;
    document.set_item("table", reported.table)?;
    Ok(document)
}

/// Merges the rows in the folders of shards, in any order, into one table; returns the number of runs.
///
/// Raises InputError for rows of different sweeps, and for missing runs.
#[pyfunction]
pub(crate) fn merge_sweeps(py: Python<'_>, folders: List<PathBuf>, out: PathBuf) -> PyResult<usize> {
    interruptible(py, move || merge(&folders.0, &out))?.map_err(exception)
}
