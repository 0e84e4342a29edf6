//! Training subjects by name or file, and their scores as documents and text.

use std::path::{Path, PathBuf};

use endowire_assess::{Exam, Score, Scored, Site, Subject, Threshold};
use endowire_core::error::nearest_name;
use endowire_methods::{Scene, Setting};
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
    let in_subject = |error: endowire_core::Error| Failure::from(error).at(&place);
    // Only a place is looked for along the centre line, which may have to be found first.
    let tree = subject.goal.target().map(|_| scene.centreline(cache)).transpose().map_err(in_subject)?;
    let stack = scene.stack().map_err(in_subject)?;
    let instruments: Vec<String> = stack.instruments().iter().map(|one| one.name.clone()).collect();
    let site = Site { tree, instruments: &instruments, has_sac: scene.vessel.sac.is_some() };
    Ok(Exam::new(subject, &site)?)
}

/// What has come of a subject, on one line.
pub(crate) fn verdict(score: &Score) -> String {
    format!("{}: {}", score.subject, score.verdict.words())
}

/// A score for a person.
pub(crate) fn text(score: &Score) -> String {
    let row = |(scored, threshold): (&Scored, &Threshold)| {
        let (kept, value) = (scored.kept_words(), scored.value_words());
        let (name, asked, points) = (scored.metric.name, threshold.words(), threshold.points);
        format!("  {kept:<10}  {name:<22} {value:>14}  {asked:<16} points {points}")
    };
    let rows = std::iter::once(verdict(score)).chain(score.asked().map(row));
    rows.chain(score.unjudged_words()).collect::<Vec<_>>().join("\n")
}
