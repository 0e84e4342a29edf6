//! Training subjects by name or file, and their scores as documents and text.

use std::path::{Path, PathBuf};

use endowire_assess::{Exam, Score, Scored, Subject, Threshold};
use endowire_core::error::nearest_name;
use endowire_methods::Scene;
use endowire_sweep::Setting;
use serde::Serialize;

use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::scenes;

/// Folder of the subjects that are called by their names.
pub(crate) const FOLDER: &str = "assets/subjects";

/// Largest file that is looked at whether it is one, bytes: input files are no larger.
const LARGEST_FILE: u64 = 16 << 20;

/// A score with where it comes from.
#[derive(Serialize)]
pub(crate) struct ScoreDocument<'a> {
    #[serde(flatten)]
    pub(crate) provenance: &'a Provenance,
    #[serde(flatten)]
    pub(crate) score: &'a Score,
}

/// The file of a subject that is called by its name.
fn named(which: &Path) -> PathBuf {
    Path::new(FOLDER).join(format!("{}.toml", which.display()))
}

/// Reads a subject by its file or its name.
pub(crate) fn read(which: &Path) -> Result<Subject, Failure> {
    if which.is_file() {
        return Ok(Subject::read(which)?);
    }
    let file = named(which);
    if file.is_file() {
        return Ok(Subject::read(&file)?);
    }
    let known = scenes::files(Path::new(FOLDER)).unwrap_or_default();
    let stems = known.iter().filter_map(|path| path.file_stem()?.to_str());
    let nearest = nearest_name(stems, &which.display().to_string())
        .map_or_else(String::new, |name| format!("; did you mean {name}?"));
    Err(Failure::Input(format!("{}: is no file and no subject of {FOLDER}{nearest}", which.display())))
}

/// The same of what may be a scene too: none then.
pub(crate) fn if_meant(which: &Path) -> Result<Option<Subject>, Failure> {
    let meant = if which.exists() {
        // What is wrong with a file its reader tells.
        let bytes = endowire_core::file::read(which, LARGEST_FILE).unwrap_or_default();
        std::str::from_utf8(&bytes).is_ok_and(Subject::is_meant)
    } else {
        // A name without an ending is hardly that of a scene.
        named(which).is_file() || which.extension().is_none()
    };
    meant.then(|| read(which)).transpose()
}

/// What a subject sets of its scene.
pub(crate) fn settings(subject: &Subject) -> Result<Vec<Setting>, Failure> {
    let parsed = subject.set.iter().map(|text| text.parse::<Setting>());
    parsed.collect::<Result<_, _>>().map_err(|error| Failure::from(error).at(subject.path().display()))
}

/// The subject in its scene, to be followed.
pub(crate) fn exam(subject: Subject, scene: &Scene, cache: &Cache) -> Result<Exam, Failure> {
    let place = subject.path().display().to_string();
    let tree = scene.centreline(cache).map_err(|error| Failure::from(error).at(place))?;
    Ok(Exam::new(subject, tree)?)
}

/// What a threshold asks for.
pub(crate) fn asked(threshold: &Threshold) -> String {
    let most = threshold.at_most.map(|most| format!("at most {most}"));
    most.or_else(|| threshold.at_least.map(|least| format!("at least {least}"))).unwrap_or_default()
}

/// What has come of a subject, on one line.
pub(crate) fn verdict(score: &Score) -> String {
    let verdict = &score.verdict;
    let how = if verdict.passed { "passed" } else { "not passed" };
    let end = match verdict.ended {
        Some(ended) => format!("{} after {:.1} s", ended.by.words(), ended.time_s),
        None => "left before the goal was reached".to_owned(),
    };
    format!("{}: {how}, {:.0} of 100: {end}", score.subject, verdict.score)
}

/// Whether a threshold is kept, and the value that it is of.
pub(crate) fn kept(scored: &Scored) -> (&'static str, String) {
    // Numbers and ratios have the unit 1.
    let unit = if scored.metric.unit == "1" { "" } else { scored.metric.unit };
    let value = scored.metric.value.map(|value| format!("{value:.3} {unit}"));
    let kept = if scored.passed == Some(true) { "kept" } else { "missed" };
    (kept, value.map_or_else(|| "not measured".to_owned(), |value| value.trim_end().to_owned()))
}

/// A score for a person.
pub(crate) fn text(score: &Score) -> String {
    let row = |(scored, threshold): (&Scored, &Threshold)| {
        let (kept, value) = kept(scored);
        let (name, asked, points) = (scored.metric.name, asked(threshold), threshold.points);
        format!("  {kept:<6}  {name:<22} {value:>14}  {asked:<16} points {points}")
    };
    std::iter::once(verdict(score)).chain(score.asked().map(row)).collect::<Vec<_>>().join("\n")
}
