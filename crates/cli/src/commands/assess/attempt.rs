//! Measured sessions, with the scenes in which they were recorded.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use endowire_assess::{Metric, Record, Score, SessionFile, Subject, Way};
use endowire_core::device::Stack;
use endowire_methods::Scene;
use endowire_recording::{About, Rows};

use super::verified;
use crate::args::AssessArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{session as session_file, tell};
use crate::{scenes, subjects};

/// Why a session is left out.
pub(super) const LEFT_OUT: &str = "nothing was done in it: it is left out";

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
    /// Whether it was carried out again, with the same record.
    pub(super) verified: bool,
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
    fn find(&mut self, about: &About) -> Result<usize, Failure> {
        let path = self.given.or(about.scene_file.as_deref());
        let known = self.all.iter().position(|one| Some(&*one.path) == path && one.set == about.set);
        if let Some(known) = known {
            return Ok(known);
        }
        let (path, scene) = scenes::of_recording(about, self.given, &[])?;
        Ok(self.add(Place { path, set: about.set.clone(), scene }))
    }

    /// The instruments of a scene.
    fn stack(&self, place: usize) -> Result<Stack, Failure> {
        let Place { path, scene, .. } = &self.all[place];
        scene.stack().map_err(|error| Failure::from(error).at(path.display()))
    }

    fn add(&mut self, place: Place) -> usize {
        self.all.push(place);
        self.all.len() - 1
    }
}

/// A session with its file.
type Given<'a> = (&'a Path, SessionFile);

/// The sessions that are assessed, with their files, and the files of those in which nothing was done. These are left
/// out and reported of, unless all are such.
pub(super) fn read(files: &[PathBuf]) -> Result<(Vec<Given<'_>>, Vec<&Path>), Failure> {
    let (mut sessions, mut left_out) = (vec![], vec![]);
    for file in files {
        let session = SessionFile::read(file)?;
        if file.is_dir() {
            let rows = Rows::read(file, &About::read(file)?)?;
            scenes::tell_left_out(file, rows.left_out.as_deref());
        }
        if session.record.is_empty() {
            left_out.push(file.as_path());
        } else {
            sessions.push((file.as_path(), session));
        }
    }
    if sessions.is_empty() {
        // This says what is wrong with it.
        for file in &left_out {
            Record::read(file)?;
        }
    }
    left_out.iter().for_each(|file| tell(format_args!("{}: {LEFT_OUT}", file.display())));
    Ok((sessions, left_out))
}

/// Measures a session on the way to a target.
pub(super) fn measured(
    args: &AssessArgs,
    (session, of_file): Given<'_>,
    places: &mut Places<'_>,
) -> Result<Attempt, Failure> {
    let (about, recorded_unix_s) = (session_file::about(&of_file), of_file.recorded_unix_s);
    let place = places.find(&about)?;
    let record = of_file.record;
    let refused = |error| Failure::from(error).at(session.display());
    record.check_in(&places.stack(place)?).map_err(refused)?;
    let Place { path, scene, .. } = &places.all[place];
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let tree = scene.centreline(&places.cache).map_err(in_scene)?;
    scenes::tell_found(path, scene);
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
        verified: false,
    })
}

/// The target of the last script line that has one.
fn target(scene: &Scene) -> Option<String> {
    scene.script.iter().rev().find_map(|line| line.until.as_ref()?.target.clone())
}

/// Scores sessions by a subject, after carrying them out again if `verify`; returns the provenance and the attempts.
pub(super) fn scored(
    subject: &Subject,
    sessions: Vec<Given<'_>>,
    places: &mut Places<'_>,
    verify: bool,
) -> Result<(Provenance, Vec<Attempt>), Failure> {
    let settings = subjects::settings(subject)?;
    let (scene, path, exam) = subjects::in_scene(subject, &places.cache)?;
    let provenance = Provenance::of_scene(&scene, &settings)?;
    let place = places.add(Place { path: path.clone(), set: subject.set.clone(), scene });
    let (stack, set) = (places.stack(place)?, settings.iter().map(ToString::to_string).collect::<Vec<_>>());
    let mut attempts = vec![];
    for (session, of_file) in sessions {
        of_file.check_in((&path, &set), &stack, session)?;
        let again = verify.then(|| {
            let scene = (&places.all[place].scene, path.as_path());
            verified::repeated(&of_file, session, scene, &exam, &places.cache)
        });
        let again = again.transpose()?;
        let SessionFile { record, recorded_unix_s, .. } = of_file;
        let record = again.unwrap_or(record);
        exam.check(&record).map_err(|error| Failure::from(error).at(session.display()))?;
        let score = exam.clone().score(&record);
        attempts.push(Attempt {
            session: session.to_path_buf(),
            recorded_unix_s,
            place,
            target: subject.goal.target().map(str::to_owned),
            record: score.verdict.ended.map_or_else(|| record.clone(), |ended| record.before(ended.time_s)),
            way: exam.way().cloned(),
            metrics: score.metrics.iter().map(|one| one.metric).collect(),
            score: Some(score),
            verified: verify,
        });
    }
    Ok((provenance, attempts))
}
