//! `endowire assess`: what sessions and recorded runs are scored by.

use std::path::{Path, PathBuf};

use endowire_assess::{Better, Metric, Record, Way};
use endowire_methods::Scene;
use serde::Serialize;

use crate::args::AssessArgs;
use crate::cache::Cache;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::recording::RecordedSummary;
use crate::output::session::SessionFile;
use crate::output::{SUMMARY, answer};
use crate::scenes;

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

/// Measures each session and tells the values.
pub(crate) fn assess(args: &AssessArgs) -> Result<(), Failure> {
    if !(args.within_mm > 0.0 && args.within_mm.is_finite()) {
        return Err(Failure::Input(format!("--within-mm {}: must be a length above 0", args.within_mm)));
    }
    let mut inputs = vec![];
    let mut all = vec![];
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

fn assessed(args: &AssessArgs, session: &Path) -> Result<Assessed, Failure> {
    let record = Record::read(session)?;
    let summary = if session.is_dir() {
        RecordedSummary::read(&session.join(SUMMARY))?
    } else {
        SessionFile::read_summary(session)?
    };
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
        let better = match metric.better {
            Better::Lower => "less is better",
            Better::Higher => "more is better",
        };
        text += &format!("  {:<8} {better}\n", metric.unit);
    }
    text.pop();
    text
}
