//! Assessment of sessions and recorded runs.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_assess::{
    Attempt, Course, Exam, Metric, Record, Score, SessionFile, Site, Subject, Way, thinnest_mm,
};
use endowire_core::Error;
use endowire_core::device::Stack;
use endowire_core::vessel::{CentrelineTree, NoStore};
use endowire_methods::{Setting, scene_with};
use endowire_viewer::ViewSpec;
use pyo3::prelude::*;

use crate::arrays::List;
use crate::document;
use crate::error::{exception, refuse};
use crate::interrupt::interruptible;

/// The target and the centre line of a task.
struct Task {
    centreline: Option<PathBuf>,
    target: Option<String>,
    within_mm: f64,
}

impl Task {
    fn new(centreline: Option<PathBuf>, target: Option<String>, within_mm: f64) -> PyResult<Self> {
        check_within(within_mm)?;
        if let (None, Some(target)) = (&centreline, &target) {
            let remedy = "is a point of a centre line: give centreline too";
            return Err(refuse("target", format!("{target:?}"), remedy));
        }
        Ok(Self { centreline, target, within_mm })
    }

    /// Measures a record.
    fn measured(&self, path: &Path) -> endowire_core::Result<Vec<Metric>> {
        let record = Record::read(path)?;
        let tree = self.centreline.as_deref().map(CentrelineTree::read).transpose()?;
        let way = match &tree {
            Some(tree) => Way::of_record(&record, tree, self.target.as_deref(), self.within_mm)?,
            None => None,
        };
        Ok(endowire_assess::assess(&record, way.as_ref()))
    }
}

/// Refuses a distance that is not positive.
pub(crate) fn check_within(within_mm: f64) -> PyResult<()> {
    if within_mm > 0.0 && within_mm.is_finite() {
        return Ok(());
    }
    Err(refuse("within_mm", within_mm, "must be a length above 0"))
}

/// A subject in its scene.
struct InScene {
    exam: Exam,
    scene: PathBuf,
    set: Vec<String>,
    stack: Stack,
}

impl InScene {
    /// Reads a subject and its scene. A centre line, if given, must be that of the scene.
    fn read(subject: &Path, centreline: Option<&Path>) -> endowire_core::Result<Self> {
        let subject = Subject::read(subject)?;
        let of_subject = |error: Error| Error::content(subject.path(), error.to_string());
        let settings: Vec<Setting> = subject
            .set
            .iter()
            .map(|text| text.parse())
            .collect::<endowire_core::Result<_>>()
            .map_err(of_subject)?;
        let path = subject.resolve(&subject.scene);
        let scene = scene_with(&path, &settings, |scene| ViewSpec::of_scene(scene, &path).map(drop))?;
        let stack = scene.stack()?;
        let tree = subject.goal.target().map(|_| scene.centreline(&NoStore)).transpose()?;
        if let Some((given, tree)) = centreline.zip(tree)
            && CentrelineTree::read(given)? != *tree
        {
            let refused = format!("is not the centre line of {}: leave it out", path.display());
            return Err(Error::content(given, refused));
        }
        let instruments: Vec<String> = stack.instruments().iter().map(|one| one.name.clone()).collect();
        let has_sac = scene.vessel.sac.is_some();
        let radius_mm = Some(thinnest_mm(&stack));
        let site = Site { tree, instruments: &instruments, radius_mm, has_sac, ..Site::default() };
        let set = settings.iter().map(ToString::to_string).collect();
        Ok(Self { exam: Exam::new(subject, &site)?, scene: path, set, stack })
    }

    /// Scores a session, which must be of this scene.
    fn scored(&self, path: &Path) -> endowire_core::Result<Arc<Score>> {
        let session = SessionFile::read(path)?;
        session.check_in((&self.scene, &self.set), &self.stack, path)?;
        self.exam.check(&session.record)?;
        Ok(self.exam.clone().score(&session.record))
    }
}

/// Refuses a session that is given twice: it would count as two attempts.
fn check_distinct(paths: &[PathBuf]) -> PyResult<()> {
    let mut seen = HashMap::new();
    for (index, path) in paths.iter().enumerate() {
        if let Some(first) = seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone()), index) {
            let remedy = format!("is paths[{first}] again: give each attempt once");
            return Err(refuse(
                &format!("paths[{index}]"),
                format!("{:?}", path.display().to_string()),
                &remedy,
            ));
        }
    }
    Ok(())
}

/// Measures a session of `endowire play` (*.session.json) or the folder of a recorded run, as `endowire assess` does.
/// `centreline` is the table of the vessel's centre line, and `target` the name of the point on it that was to be
/// reached within `within_mm`. Without a table, measures that depend on the way have no value; without a target, the
/// way leads to the final position of the tip.
///
/// Returns a list of dictionaries: name, group, value (None if its data were not recorded), unit, better ("lower" or
/// "higher"), definition and study. Raises InputError for invalid files and for an unknown target.
#[pyfunction]
#[pyo3(signature = (path, *, centreline=None, target=None, within_mm=5.0))]
pub(crate) fn assess<'py>(
    py: Python<'py>,
    path: PathBuf,
    centreline: Option<PathBuf>,
    target: Option<String>,
    within_mm: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let task = Task::new(centreline, target, within_mm)?;
    let measured = interruptible(py, move || task.measured(&path))?;
    document::write(py, &measured.map_err(exception)?)
}

/// Scores a session of `endowire play` (*.session.json) or the folder of a recorded run by the file of a training
/// subject, as `endowire assess --subject` does: it must have been recorded in the scene of the subject, with its
/// settings. `centreline` need not be given, since the scene has one; a table that is given must be that of the scene.
///
/// Returns a dictionary: subject, passed, score (0 to 100), ended (None, or reason and time of the end), and metrics,
/// which are those of assess with threshold and passed (None without a threshold). Raises InputError for invalid
/// files, and for a session of another scene or in which nothing was done.
#[pyfunction]
#[pyo3(signature = (path, subject, *, centreline=None))]
pub(crate) fn score<'py>(
    py: Python<'py>,
    path: PathBuf,
    subject: PathBuf,
    centreline: Option<PathBuf>,
) -> PyResult<Bound<'py, PyAny>> {
    let scored = interruptible(py, move || InScene::read(&subject, centreline.as_deref())?.scored(&path))?;
    document::write(py, &*scored.map_err(exception)?)
}

/// The course of a trainee's attempts at one task, in the order of `paths`, as from `endowire assess` with several
/// sessions. The paths are sessions of `endowire play` (*.session.json) or folders of recorded runs. With the file of
/// a `subject`, they are scored by it; `centreline`, `target` and `within_mm` are as in assess and score.
///
/// Returns a dictionary: score and passed (None without a subject), and metrics, a list of dictionaries: name, group,
/// unit, better, values, first, last, best, per_attempt, chance and trend ("better", "worse" or "none"). Raises
/// InputError as assess and score, and for a session that is given twice.
#[pyfunction]
#[pyo3(signature = (paths, *, subject=None, centreline=None, target=None, within_mm=5.0))]
pub(crate) fn course<'py>(
    py: Python<'py>,
    paths: List<PathBuf>,
    subject: Option<PathBuf>,
    centreline: Option<PathBuf>,
    target: Option<String>,
    within_mm: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let task = Task::new(centreline, target, within_mm)?;
    if let (Some(_), Some(target)) = (&subject, &task.target) {
        return Err(refuse(
            "target",
            format!("{target:?}"),
            "a subject says where to go: leave one of the two out",
        ));
    }
    let paths = paths.0;
    check_distinct(&paths)?;
    let course = interruptible(py, move || {
        let subject =
            subject.map(|subject| InScene::read(&subject, task.centreline.as_deref())).transpose()?;
        let mut all: Vec<(Vec<Metric>, Option<Arc<Score>>)> = vec![];
        for path in &paths {
            all.push(match &subject {
                Some(subject) => {
                    let score = subject.scored(path)?;
                    (score.metrics.iter().map(|one| one.metric).collect(), Some(score))
                }
                None => (task.measured(path)?, None),
            });
        }
        let attempts = all.iter().map(|(metrics, score)| Attempt { metrics, score: score.as_deref() });
        Ok::<_, endowire_core::Error>(Course::of(&attempts.collect::<Vec<_>>()))
    })?;
    document::write(py, &course.map_err(exception)?)
}
