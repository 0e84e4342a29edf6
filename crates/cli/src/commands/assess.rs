//! `endowire assess`: what sessions and recorded runs are scored by.

use std::path::{Path, PathBuf};

use endowire_assess::{Metric, Record, Score, Subject, Way};
use endowire_methods::{Scene, Setting};
use serde::Serialize;

use crate::args::AssessArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::recording::RecordedSummary;
use crate::output::{SUMMARY, answer, session as session_file};
use crate::{scenes, subjects};

/// The document of one session.
#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    #[serde(flatten)]
    assessed: Assessed,
}

/// That of several.
#[derive(Serialize)]
struct Documents {
    #[serde(flatten)]
    provenance: Provenance,
    sessions: Vec<Assessed>,
}

#[derive(Serialize)]
struct Assessed {
    session: PathBuf,
    scene: String,
    target: Option<String>,
    metrics: Vec<Metric>,
}

/// A session and its score.
#[derive(Serialize)]
struct ScoredSession<'a> {
    session: &'a Path,
    #[serde(flatten)]
    score: Score,
}

/// The document of one that is scored.
#[derive(Serialize)]
struct ScoreOf<'a> {
    #[serde(flatten)]
    provenance: Provenance,
    #[serde(flatten)]
    session: &'a ScoredSession<'a>,
}

/// That of several.
#[derive(Serialize)]
struct ScoresOf<'a> {
    #[serde(flatten)]
    provenance: Provenance,
    sessions: &'a [ScoredSession<'a>],
}

/// Measures each session and tells the values.
pub(crate) fn assess(args: &AssessArgs) -> Result<(), Failure> {
    if !(args.within_mm > 0.0 && args.within_mm.is_finite()) {
        return Err(Failure::Input(format!("--within-mm {}: must be a length above 0", args.within_mm)));
    }
    let mut inputs = vec![];
    let mut all = vec![];
    if let Some(which) = &args.subject {
        return score(args, &subjects::read(which)?);
    }
    for session in &args.sessions {
        inputs.push(read_input(&if session.is_dir() { session.join("steps.csv") } else { session.clone() })?);
        all.push(assessed(args, session)?);
    }
    let provenance = Provenance::new(&inputs, 0);
    match <[Assessed; 1]>::try_from(all) {
        Ok([assessed]) => {
            let document = Document { provenance, assessed };
            answer(&document, args.json, || table(std::slice::from_ref(&document.assessed)))
        }
        Err(sessions) => {
            let documents = Documents { provenance, sessions };
            answer(&documents, args.json, || table(&documents.sessions))
        }
    }
}

/// What a session or a run says of its scene.
fn read_summary(session: &Path) -> Result<RecordedSummary, Failure> {
    if session.is_dir() {
        RecordedSummary::read(&session.join(SUMMARY))
    } else {
        session_file::read_summary(session)
    }
}

/// Scores each session by a subject.
fn score(args: &AssessArgs, subject: &Subject) -> Result<(), Failure> {
    let path = subject.resolve(&subject.scene);
    let settings = subjects::settings(subject)?;
    let scene = scenes::read(&path, &settings)?;
    let exam = subjects::exam(subject.clone(), &scene, &Cache::new(&args.cache))?;
    let provenance = Provenance::of_scene(&scene, &settings)?;
    let mut sessions = vec![];
    for session in &args.sessions {
        check_scene(session, &read_summary(session)?, &path, &settings)?;
        let score = exam.clone().score(&Record::read(session)?);
        sessions.push(ScoredSession { session, score: (*score).clone() });
    }
    let text = || {
        let each =
            |one: &ScoredSession<'_>| format!("{}\n{}", one.session.display(), subjects::text(&one.score));
        sessions.iter().map(each).collect::<Vec<_>>().join("\n")
    };
    match sessions.as_slice() {
        [session] => answer(&ScoreOf { provenance, session }, args.json, text),
        _ => answer(&ScoresOf { provenance, sessions: &sessions }, args.json, text),
    }
}

/// Refuses a session that was recorded in another scene than the subject's.
fn check_scene(
    session: &Path,
    recorded: &RecordedSummary,
    scene: &Path,
    settings: &[Setting],
) -> Result<(), Failure> {
    let same = match (recorded.scene_file.canonicalize(), scene.canonicalize()) {
        (Ok(recorded), Ok(scene)) => recorded == scene,
        // A scene that has gone elsewhere cannot be told from the subject's.
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

fn assessed(args: &AssessArgs, session: &Path) -> Result<Assessed, Failure> {
    let record = Record::read(session)?;
    let summary = read_summary(session)?;
    let (path, scene) = scenes::of_recording(&summary, args.scene.as_deref(), &[])?;
    let cache = Cache::new(&args.cache);
    let in_scene = |e: endowire_core::Error| Failure::from(e).at(path.display());
    let tree = scene.centreline(&cache).map_err(in_scene)?;
    scenes::tell_found_centreline(&path, &scene);
    let target = args.target.clone().or_else(|| target(&scene));
    let last_mm = record.samples.iter().rev().find_map(|sample| sample.tip_mm);
    let way = match (&target, last_mm) {
        (Some(name), _) => Way::to_target(tree, name, args.within_mm).map_err(in_scene)?,
        (None, Some(place)) => Way::to_place(tree, &place),
        (None, None) => None,
    };
    let metrics = endowire_assess::assess(&record, way.as_ref());
    Ok(Assessed { session: session.to_path_buf(), scene: scene.name.clone(), target, metrics })
}

/// Where the script goes in the end, if it says so.
fn target(scene: &Scene) -> Option<String> {
    scene.script.iter().rev().find_map(|line| line.until.as_ref()?.target.clone())
}

/// A row for each measure, and a column for each session.
fn table(sessions: &[Assessed]) -> String {
    let mut text = String::new();
    let columns = sessions.first().map_or(0, |first| first.metrics.len());
    for index in 0..columns {
        let metric = &sessions[0].metrics[index];
        let before = index.checked_sub(1).map(|before| sessions[0].metrics[before].group);
        if before != Some(metric.group) {
            text += &format!("{}\n", metric.group.name());
        }
        text += &format!("  {:<24}", metric.name);
        for session in sessions {
            text += &match session.metrics[index].value {
                Some(value) => format!(" {value:>11.4}"),
                None => format!(" {:>11}", "-"),
            };
        }
        text += &format!("  {:<8} {} is better\n", metric.unit, metric.better.words());
    }
    text.pop();
    text
}
