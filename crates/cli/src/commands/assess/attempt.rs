//! Measured sessions, with the scenes in which they were recorded.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_assess::{Metric, Record, Score, Subject, Way};
use endowire_methods::{Scene, Setting};

use crate::args::AssessArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::recording::RecordedSummary;
use crate::output::{SUMMARY, session as session_file};
use crate::{scenes, subjects};

/// A measured session.
pub(super) struct Attempt {
    pub(super) session: PathBuf,
    pub(super) recorded_unix_s: Option<u64>,
    /// Index of its scene among the [`Places`].
    pub(super) place: usize,
    pub(super) target: Option<String>,
    /// The record; for a subject, up to its end.
    pub(super) record: Record,
    pub(super) way: Option<Way>,
    pub(super) metrics: Vec<Metric>,
    pub(super) score: Option<Arc<Score>>,
}

/// A scene in which sessions were recorded.
pub(super) struct Place {
    pub(super) path: PathBuf,
    /// Overridden keys of the scene.
    pub(super) set: Vec<String>,
    pub(super) scene: Scene,
}

/// The scenes, each read only once for all its sessions.
pub(super) struct Places<'a> {
    /// The scene given on the command line, which overrides those named by sessions.
    given: Option<&'a Path>,
    pub(super) cache: Cache,
    all: Vec<Place>,
}

impl<'a> Places<'a> {
    /// Without scenes yet.
    pub(super) fn new(args: &'a AssessArgs) -> Self {
        Self { given: args.scene.as_deref(), cache: Cache::new(&args.cache), all: vec![] }
    }

    /// The scene of an attempt.
    pub(super) fn of(&self, attempt: &Attempt) -> &Place {
        &self.all[attempt.place]
    }

    /// Index of the scene of a session; the scene is read if necessary.
    fn find(&mut self, summary: &RecordedSummary) -> Result<usize, Failure> {
        let path = self.given.unwrap_or(&summary.scene_file);
        let known = self.all.iter().position(|one| one.path == path && one.set == summary.set);
        if let Some(known) = known {
            return Ok(known);
        }
        let (path, scene) = scenes::of_recording(summary, self.given, &[])?;
        Ok(self.add(Place { path, set: summary.set.clone(), scene }))
    }

    /// The record of a session, which must be one of its scene.
    fn read(&self, session: &Path, place: usize) -> Result<Record, Failure> {
        let record = Record::read(session)?;
        let Place { path, scene, .. } = &self.all[place];
        let stack = scene.stack().map_err(|error| Failure::from(error).at(path.display()))?;
        record.check_in(&stack).map_err(|error| Failure::from(error).at(session.display()))?;
        Ok(record)
    }

    fn add(&mut self, place: Place) -> usize {
        self.all.push(place);
        self.all.len() - 1
    }
}

/// The scene of a session or a run, and the time of the recording, if known; a run does not contain it.
fn read_head(session: &Path) -> Result<(RecordedSummary, Option<u64>), Failure> {
    if session.is_dir() {
        Ok((RecordedSummary::read(&session.join(SUMMARY))?, None))
    } else {
        session_file::read_head(session)
    }
}

/// Measures sessions on the way to a target.
pub(super) fn measured(
    args: &AssessArgs,
    files: &[PathBuf],
    places: &mut Places<'_>,
) -> Result<Vec<Attempt>, Failure> {
    files.iter().map(|file| measured_one(args, file, places)).collect()
}

fn measured_one(args: &AssessArgs, session: &Path, places: &mut Places<'_>) -> Result<Attempt, Failure> {
    let (summary, recorded_unix_s) = read_head(session)?;
    let place = places.find(&summary)?;
    let record = places.read(session, place)?;
    let Place { path, scene, .. } = &places.all[place];
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let tree = scene.centreline(&places.cache).map_err(in_scene)?;
    scenes::tell_found_centreline(path, scene);
    let target = args.target.clone().or_else(|| target(scene));
    let way = Way::of_record(&record, tree, target.as_deref(), args.within_mm).map_err(in_scene)?;
    let metrics = endowire_assess::assess(&record, way.as_ref());
    Ok(Attempt {
        session: session.to_path_buf(),
        recorded_unix_s,
        place,
        target,
        record,
        way,
        metrics,
        score: None,
    })
}

/// The target of the last script line that has one.
fn target(scene: &Scene) -> Option<String> {
    scene.script.iter().rev().find_map(|line| line.until.as_ref()?.target.clone())
}

/// Scores sessions by a subject; returns the provenance and the attempts.
pub(super) fn scored(
    subject: &Subject,
    files: &[PathBuf],
    places: &mut Places<'_>,
) -> Result<(Provenance, Vec<Attempt>), Failure> {
    let settings = subjects::settings(subject)?;
    let (scene, path, exam) = subjects::in_scene(subject, &places.cache)?;
    let provenance = Provenance::of_scene(&scene, &settings)?;
    let place = places.add(Place { path: path.clone(), set: subject.set.clone(), scene });
    let mut attempts = vec![];
    for session in files {
        let (summary, recorded_unix_s) = read_head(session)?;
        check_scene(session, &summary, &path, &settings)?;
        let record = places.read(session, place)?;
        exam.check(&record).map_err(|error| Failure::from(error).at(session.display()))?;
        let score = exam.clone().score(&record);
        attempts.push(Attempt {
            session: session.clone(),
            recorded_unix_s,
            place,
            target: subject.goal.target().map(str::to_owned),
            record: score.verdict.ended.map_or_else(|| record.clone(), |ended| record.before(ended.time_s)),
            way: exam.way().cloned(),
            metrics: score.metrics.iter().map(|one| one.metric).collect(),
            score: Some(score),
        });
    }
    Ok((provenance, attempts))
}

/// Refuses a session that was recorded in a scene other than the subject's.
fn check_scene(
    session: &Path,
    recorded: &RecordedSummary,
    scene: &Path,
    settings: &[Setting],
) -> Result<(), Failure> {
    let same = match (recorded.scene_file.canonicalize(), scene.canonicalize()) {
        (Ok(recorded), Ok(scene)) => recorded == scene,
        // A scene that was moved or deleted can only be compared by its file name.
        _ => recorded.scene_file.file_name() == scene.file_name(),
    };
    let set: Vec<String> = settings.iter().map(ToString::to_string).collect();
    if same && recorded.set == set {
        return Ok(());
    }
    let told = |scene: &Path, set: &[String]| {
        let set: String = set.iter().map(|setting| format!(" --set '{setting}'")).collect();
        format!("{}{set}", scene.display())
    };
    Err(Failure::Input(format!(
        "{}: was recorded in {}, and the subject is in {}: name the subject that it was recorded with",
        session.display(),
        told(&recorded.scene_file, &recorded.set),
        told(scene, &set)
    )))
}
