//! Sessions that are carried out again before they are scored: a record that was changed afterwards is found.

use std::path::Path;

use endowire_assess::{Exam, Record, SessionFile};
use endowire_methods::Scene;
use endowire_play::{Inputs, Limits};

use crate::cache::Cache;
use crate::commands::play;
use crate::failure::Failure;
use crate::subjects::SIDE_PX;

/// The record to which the inputs of a session lead, if it is the one that the session has, up to the end of the
/// exam.
pub(super) fn repeated(
    session: &SessionFile,
    path: &Path,
    (scene, scene_path): (&Scene, &Path),
    exam: &Exam,
    cache: &Cache,
) -> Result<Record, Failure> {
    let refused = |what: String| Failure::Input(format!("{}: {what}", path.display()));
    let Some(inputs) = session.inputs.clone() else {
        let what = "does not have the inputs of hands, by which it could be repeated: --verify needs a session of endowire play or of the page, of this version";
        return Err(refused(what.to_owned()));
    };
    let inputs: Inputs =
        serde_json::from_value(inputs).map_err(|error| refused(format!("inputs: {error}")))?;
    let (begun, _) = play::open(scene, scene_path, cache, SIDE_PX, Limits::default())?;
    let done = inputs.repeat_in(begun.with_exam(exam.clone()));
    let done = done.map_err(|error| Failure::from(error).at(path.display()))?;
    let ended = |record: &Record| match exam.clone().score(record).verdict.ended {
        Some(ended) => record.before(ended.time_s),
        None => record.clone(),
    };
    let (told, found) = (ended(&session.record), ended(done.record()));
    match difference(&told, &found) {
        None => Ok(done.record().clone()),
        Some(what) => Err(refused(format!(
            "{what} is not what the recorded inputs lead to: the file was changed, or is of another version of the program; record the session again"
        ))),
    }
}

/// The first part of a record that differs.
fn difference(told: &Record, found: &Record) -> Option<String> {
    if told == found {
        return None;
    }
    let pairs = told.samples.iter().zip(&found.samples);
    if let Some(index) = pairs.clone().position(|(told, found)| told != found) {
        return Some(format!("record.samples[{index}], at {:.2} s,", told.samples[index].time_s));
    }
    if told.samples.len() != found.samples.len() {
        let (told, found) = (told.samples.len(), found.samples.len());
        return Some(format!("record.samples, of which there are {told} and not {found},"));
    }
    let key = if told.injections != found.injections {
        "injections"
    } else if told.beam != found.beam {
        "beam"
    } else {
        "start_mm or instruments"
    };
    Some(format!("record.{key}"))
}
