//! `endowire subject`: training subjects and their reference solutions.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use endowire_assess::{Goal, Limits, Subject, Threshold};
use endowire_play::{Input, Limits as Warnings, Session};
use endowire_viewer::Mode;
use serde::Serialize;

use crate::args::{SubjectCommand, SubjectRunArgs};
use crate::cache::Cache;
use crate::commands::play::{self, Record};
use crate::commands::run::interrupts;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, tell};
use crate::scenes;
use crate::subjects::{self, SIDE_PX, ScoreDocument};

/// The document of `subject list`.
#[derive(Serialize)]
struct Listed {
    #[serde(flatten)]
    provenance: Provenance,
    folder: PathBuf,
    subjects: Vec<Row>,
}

/// One subject of a folder.
#[derive(Serialize)]
struct Row {
    subject: String,
    level: u8,
    name: String,
    /// The goal in words.
    goal: String,
    /// The target point of the centre line; `None` for a sac.
    target: Option<String>,
}

impl Row {
    fn of(subject: Subject) -> Self {
        Self {
            subject: subject.stem(),
            level: subject.level,
            goal: subject.goal.words(),
            target: subject.goal.target().map(str::to_owned),
            name: subject.name,
        }
    }
}

/// The document of `subject show`.
#[derive(Serialize)]
struct Shown<'a> {
    #[serde(flatten)]
    provenance: Provenance,
    subject: String,
    name: &'a str,
    level: u8,
    exam: bool,
    text: &'a str,
    #[serde(serialize_with = "crate::output::path_text")]
    scene: PathBuf,
    /// Overridden keys of the scene.
    scene_set: &'a [String],
    goal: &'a Goal,
    limits: Limits,
    thresholds: Vec<Named<'a>>,
}

/// A threshold with its measure.
#[derive(Serialize)]
struct Named<'a> {
    metric: &'a str,
    #[serde(flatten)]
    threshold: &'a Threshold,
}

/// Runs the requested command.
pub(crate) fn subject(command: &SubjectCommand) -> Result<(), Failure> {
    match command {
        SubjectCommand::List { folder, json } => list(folder, *json),
        SubjectCommand::Show { subject, cache, json } => show(subject, &Cache::new(cache), *json),
        SubjectCommand::Run(args) => run(args),
    }
}

fn list(folder: &Path, json: bool) -> Result<(), Failure> {
    let paths = scenes::files(folder)?;
    if paths.is_empty() {
        return Err(Failure::Input(format!("{}: has no subject files (.toml)", folder.display())));
    }
    let inputs = paths.iter().map(|path| read_input(path)).collect::<Result<Vec<_>, _>>()?;
    let (mut subjects, mut refused) = (vec![], vec![]);
    for path in &paths {
        match Subject::read(path) {
            Ok(subject) => subjects.push(Row::of(subject)),
            Err(error) => refused.push(error),
        }
    }
    subjects.sort_by_key(|row| row.level);
    let document = Listed { provenance: Provenance::new(&inputs, 0), folder: folder.to_path_buf(), subjects };
    answer(&document, json, || {
        let row = |row: &Row| format!("{}  {:<22} {}", row.level, row.subject, row.name);
        document.subjects.iter().map(row).collect::<Vec<_>>().join("\n")
    })?;
    // What can be read is listed; the rest is reported.
    let Some(last) = refused.pop() else { return Ok(()) };
    refused.iter().for_each(|error| tell(format_args!("endowire: {error}")));
    Err(last.into())
}

fn show(which: &Path, cache: &Cache, json: bool) -> Result<(), Failure> {
    let subject = subjects::read(which)?;
    // What does not fit its scene is refused here as in `run`. An exam has the thresholds that every subject has.
    let (_, _, exam) = subjects::in_scene(&subject, cache)?;
    let subject = exam.subject();
    let document = Shown {
        provenance: Provenance::new(&[read_input(subject.path())?], 0),
        subject: subject.stem(),
        name: &subject.name,
        level: subject.level,
        exam: subject.exam,
        text: subject.text.trim(),
        scene: subject.resolve(&subject.scene),
        scene_set: &subject.set,
        goal: &subject.goal,
        limits: subject.limits,
        thresholds: subject
            .threshold
            .iter()
            .map(|threshold| Named { metric: &threshold.metric, threshold })
            .collect(),
    };
    answer(&document, json, || text_of(&document))
}

fn text_of(shown: &Shown<'_>) -> String {
    let mut lines =
        vec![format!("{}: {}, level {}", shown.subject, shown.name, shown.level), shown.text.to_owned()];
    let set: String = shown.scene_set.iter().map(|setting| format!(" --set '{setting}'")).collect();
    lines.push(format!("scene      {}{set}", shown.scene.display()));
    lines.push(format!("goal       {}", shown.goal.words()));
    let limits = shown.limits.words();
    if !limits.is_empty() {
        lines.push(format!("ends at    {}", limits.join(", ")));
    }
    if shown.exam {
        lines.push("exam       the 3D view is hidden, and nothing can be undone".to_owned());
    }
    lines.extend(shown.thresholds.iter().map(|Named { metric, threshold }| {
        let grave = if threshold.grave { ", grave" } else { "" };
        format!("threshold  {metric:<22} {:<16} points {}{grave}", threshold.words(), threshold.points)
    }));
    lines.extend(shown.thresholds.iter().filter_map(|Named { metric, threshold }| {
        Some(format!("source     {metric:<22} {}", threshold.source.as_ref()?))
    }));
    lines.join("\n")
}

/// Carries out a subject with its reference script.
fn run(args: &SubjectRunArgs) -> Result<(), Failure> {
    let subject = subjects::read(&args.subject)?;
    let (stem, place) = (subject.stem(), subject.path().display().to_string());
    let path = subject.resolve(&subject.scene);
    let reference = subject.reference.as_ref().map(|file| subject.resolve(file));
    let settings = subjects::settings(&subject)?;
    let scene = scenes::with_script(&path, &settings, reference.as_deref())?;
    let cache = Cache::new(&args.cache);
    let (session, script) = play::open(&scene, &path, &cache, SIDE_PX, Warnings::default())?;
    let exam = subjects::exam(subject, (&scene, &path), session.simulation(), &cache)?;
    let mut session = session.with_script(script).with_exam(exam);
    let begun = [Input::Pedal { down: true, mode: Some(Mode::Fluoro) }, Input::Script {}];
    begun
        .iter()
        .try_for_each(|input| session.apply(input))
        .map_err(|error| Failure::from(error).at(&place))?;
    let interrupted = interrupts();
    let goes_on = |session: &Session| {
        // A script may end with an injection, which is over once its medium has flowed.
        let is_open = || session.standing().is_some_and(|standing| standing.verdict.is_none());
        session.demonstrates() || session.is_injecting() && is_open()
    };
    while goes_on(&session) && !interrupted.load(Ordering::Relaxed) {
        session.tick();
    }
    let folder = args.out.clone().unwrap_or_else(|| Path::new("out").join(&stem));
    let provenance = Provenance::of_scene(&scene, &settings)?;
    let record = Record::new(folder.join("played.toml"), &path, &settings)?;
    let mut record = record.scored(provenance.clone());
    record.finish(&session)?;
    let Some(score) = session.score() else {
        let what = "interrupted before the first step: nothing was done, and there is no score";
        return Err(Failure::Computation(format!("{place}: {what}")));
    };
    answer(&ScoreDocument { provenance: &provenance, score: &score }, args.json, || subjects::text(&score))?;
    if score.verdict.passed {
        return Ok(());
    }
    // A script that ended early has reported why.
    let event = session.events().last().filter(|_| score.verdict.ended.is_none());
    let last = event.map_or_else(String::new, |event| format!(" ({})", event.text));
    Err(Failure::Computation(format!(
        "{place}: the reference script does not pass{last}: change it, or limits and thresholds"
    )))
}
