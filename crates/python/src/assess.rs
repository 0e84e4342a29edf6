//! What sessions and recorded runs are scored by.

use std::path::PathBuf;

use endowire_assess::{Exam, Record, Subject, Way};
use endowire_core::vessel::CentrelineTree;
use pyo3::prelude::*;

use crate::document;
use crate::error::{exception, refuse};
use crate::interrupt::interruptible;

/// Measures a session of `endowire play` (*.session.json) or the folder of a recorded run, as `endowire assess` does. `centreline` is the
/// table of the vessel's centre line, and `target` the name of its point that was to be reached, within `within_mm` of it; without a
/// table what depends on the way has no value, and without a target the way is that to where the tip ended.
///
/// Returns a list of dictionaries: name, group, value (None where what it needs was not recorded), unit, better ("lower" or "higher"),
/// definition and study. Raises InputError for files that do not fit, and for a target that is not there.
#[pyfunction]
#[pyo3(signature = (path, *, centreline=None, target=None, within_mm=5.0))]
pub(crate) fn assess<'py>(
    py: Python<'py>,
    path: PathBuf,
    centreline: Option<PathBuf>,
    target: Option<String>,
    within_mm: f64,
) -> PyResult<Bound<'py, PyAny>> {
    if !(within_mm > 0.0 && within_mm.is_finite()) {
        return Err(refuse("within_mm", within_mm, "must be a length above 0"));
    }
    if let (None, Some(target)) = (&centreline, &target) {
        return Err(refuse(
            "target",
            format!("{target:?}"),
            "is a point of a centre line: give centreline too",
        ));
    }
    let measured = interruptible(py, move || {
        let record = Record::read(&path)?;
        let tree = centreline.map(|table| CentrelineTree::read(&table)).transpose()?;
        let last_mm = record.samples.iter().rev().find_map(|sample| sample.tip_mm);
        let way = match (&tree, &target, last_mm) {
            (Some(tree), Some(name), _) => Way::to_target(tree, name, within_mm)?,
            (Some(tree), None, Some(place_mm)) => Way::to_place(tree, &place_mm),
            _ => None,
        };
        Ok::<_, endowire_core::Error>(endowire_assess::assess(&record, way.as_ref()))
    })?;
    document::write(py, &measured.map_err(exception)?)
}

/// Scores a session of `endowire play` (*.session.json) or the folder of a recorded run by a training subject, the file of one, as
/// `endowire assess --subject` does. `centreline` is the table of the vessel's centre line, which names the subject's target.
///
/// Returns a dictionary: subject, passed, score (0 to 100), ended (None, or what ended it and when), and metrics, which are those of assess
/// with threshold and passed, None where nothing was asked. Raises InputError for files that do not fit.
#[pyfunction]
#[pyo3(signature = (path, subject, *, centreline))]
pub(crate) fn score<'py>(
    py: Python<'py>,
    path: PathBuf,
    subject: PathBuf,
    centreline: PathBuf,
) -> PyResult<Bound<'py, PyAny>> {
    let scored = interruptible(py, move || {
        let exam = Exam::new(Subject::read(&subject)?, &CentrelineTree::read(&centreline)?)?;
        Ok::<_, endowire_core::Error>(exam.score(&Record::read(&path)?))
    })?;
    document::write(py, &*scored.map_err(exception)?)
}
