//! Training subjects by name or file, and their scores as documents and text.

use std::path::{Path, PathBuf};

use endowire_assess::{Exam, Score, Scored, Site, Subject, Threshold, thinnest_mm};
use endowire_core::insertion::Simulation;
use endowire_methods::{Scene, Setting};
use endowire_play::{Limits, lumens};
use endowire_viewer::ViewSpec;
use serde::Serialize;

use crate::cache::Cache;
use crate::commands::play;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::scenes;

/// Folder of subjects that can be named without a path.
pub(crate) const FOLDER: &str = "assets/subjects";

/// Size limit of input files, bytes; a larger file is not examined.
const LARGEST_FILE: u64 = 16 << 20;

/// Size of the pictures of a session that shows none, pixels.
pub(crate) const SIDE_PX: u32 = 64;

/// A score with its provenance.
#[derive(Serialize)]
pub(crate) struct ScoreDocument<'a> {
    #[serde(flatten)]
    pub(crate) provenance: &'a Provenance,
    #[serde(flatten)]
    pub(crate) score: &'a Score,
}

/// Reads a subject, given by file or name.
pub(crate) fn read(which: &Path) -> Result<Subject, Failure> {
    Ok(Subject::read(&scenes::named(which, FOLDER, "subject")?)?)
}

/// The same for what may be a scene instead; then `None`.
pub(crate) fn if_meant(which: &Path) -> Result<Option<Subject>, Failure> {
    let meant = if which.exists() {
        // The reader reports errors of the file.
        let bytes = endowire_core::file::read(which, LARGEST_FILE).unwrap_or_default();
        std::str::from_utf8(&bytes).is_ok_and(Subject::is_meant)
    } else {
        // A name without an extension is more likely a subject than a scene.
        scenes::file_of(which, FOLDER).is_file() || which.extension().is_none()
    };
    meant.then(|| read(which)).transpose()
}

/// The settings that a subject makes in its scene.
pub(crate) fn settings(subject: &Subject) -> Result<Vec<Setting>, Failure> {
    let parsed = subject.set.iter().map(|text| text.parse::<Setting>());
    parsed.collect::<Result<_, _>>().map_err(|error| Failure::from(error).at(subject.path().display()))
}

/// The scene of a subject with its path, and the exam there.
///
/// Everything is refused here that `subject run` refuses before its first step.
pub(crate) fn in_scene(subject: &Subject, cache: &Cache) -> Result<(Scene, PathBuf, Exam), Failure> {
    let path = subject.resolve(&subject.scene);
    let scene = scenes::read(&path, &settings(subject)?)?;
    let in_subject = |failure: Failure| failure.at(subject.path().display());
    let (session, _) = play::open(&scene, &path, cache, SIDE_PX, Limits::default()).map_err(in_subject)?;
    let exam = exam(subject.clone(), (&scene, &path), session.simulation(), cache)?;
    Ok((scene, path, exam))
}

/// The exam of a subject in its scene, which was read from a file and has this simulation at its start. A reference that
/// is no script for this scene is refused.
pub(crate) fn exam(
    subject: Subject,
    (scene, path): (&Scene, &Path),
    simulation: &Simulation,
    cache: &Cache,
) -> Result<Exam, Failure> {
    let place = subject.path().display().to_string();
    let in_subject = |error: endowire_core::Error| Failure::from(error).at(&place);
    // Only a target point needs the centre line, which may have to be extracted first.
    let tree = subject.goal.target().map(|_| scene.centreline(cache)).transpose().map_err(in_subject)?;
    let stack = simulation.stack();
    if let Some(reference) = &subject.reference {
        let file = subject.resolve(reference);
        let lines = scene.read_script(&file).map_err(in_subject)?;
        let place = |error: endowire_core::Error| Failure::from(error).at(file.display()).at(&place);
        scene.steps_of(&lines, stack, cache).map_err(place)?;
    }
    let instruments: Vec<String> = stack.instruments().iter().map(|one| one.name.clone()).collect();
    let all_solid = !lumens(stack, &ViewSpec::of_scene(scene, path)?).contains(&true);
    let (radius_mm, has_sac) = (Some(thinnest_mm(stack)), scene.vessel.sac.is_some());
    let site = Site { tree, instruments: &instruments, radius_mm, has_sac, all_solid };
    Ok(Exam::new(subject, &site)?)
}

/// The result of a subject in one line.
pub(crate) fn verdict(score: &Score) -> String {
    format!("{}: {}", score.subject, score.verdict.words())
}

/// A score as text.
pub(crate) fn text(score: &Score) -> String {
    let row = |(scored, threshold): (&Scored, &Threshold)| {
        let (kept, value) = (scored.kept_words(), scored.value_words());
        let (name, asked, points) = (scored.metric.name, threshold.words(), threshold.points);
        format!("  {kept:<10}  {name:<22} {value:>14}  {asked:<16} points {points}")
    };
    let rows = std::iter::once(verdict(score)).chain(score.asked().map(row));
    rows.chain(score.unjudged_words()).collect::<Vec<_>>().join("\n")
}
