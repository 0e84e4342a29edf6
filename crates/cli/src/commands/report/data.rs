//! Data of a page from a recording.

use std::path::Path;

use endowire_core::device::Stack;
use endowire_core::vessel::SurfaceMesh;
use endowire_methods::Scene;
use endowire_recording::{EndedBy, Lengths, Recording, SUMMARY, StepRow, UntilOutcome};
use endowire_report::{Event, Frame, MOST_NODES, Moment, Run, Series, Vessel, base64, setup};
use serde_json::Value;

use crate::failure::Failure;

/// Largest total size of all frames in bytes, and largest number of frames.
const MOST_FRAME_BYTES: usize = 2_000_000;
const MOST_FRAMES: usize = 24;

/// Gathers the data recorded in `folder`, of a run in this scene.
pub(super) fn collect(
    folder: &Path,
    recording: &Recording,
    scene: &Scene,
    stack: &Stack,
    vessel: &SurfaceMesh,
) -> Result<Run, Failure> {
    let path = folder.join(SUMMARY);
    // Without a valid summary, the rest is still shown.
    let summary = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
    let summary: Value = summary.unwrap_or(Value::Null);
    let rows = recording.rows();
    Ok(Run {
        instruments: stack.instruments().iter().map(|one| one.name.clone()).collect(),
        vessel: Vessel::of(vessel),
        steps: steps(folder, recording, stack)?,
        events: events(rows, &summary),
        series: Series::of(rows),
        frames: frames(folder),
        setup: setup(scene, stack)?,
        others: vec![],
        summary,
    })
}

/// Shapes of all steps, or of as many as fit, including the last.
fn steps(folder: &Path, recording: &Recording, stack: &Stack) -> Result<Vec<Moment>, Failure> {
    let count = recording.steps();
    let nodes: usize = (1..=count).map(|step| recording.shape(step).len()).sum();
    let every = nodes.div_ceil(MOST_NODES).max(1);
    let lengths = Lengths::read(folder, stack)?;
    let wanted = (1..=count).filter(|step| (count - step).is_multiple_of(every));
    wanted
        .map(|step| {
            let shape = recording.shape(step);
            let number = recording.rows()[step - 1].step;
            let inserted_mm = lengths.after(number, &shape)?;
            let contacts = recording.contacts(step);
            let contacts = contacts.iter().map(|contact| (contact.position_mm, contact.force_n));
            Ok(Moment::new(number, &shape.positions_mm, &inserted_mm, contacts))
        })
        .collect()
}

fn events(rows: &[StepRow], summary: &Value) -> Vec<Event> {
    let mut events = endowire_report::events(rows);
    if let (Some(step), Some(reason)) =
        (summary["failure"]["step"].as_u64(), summary["failure"]["reason"].as_str())
    {
        // Earlier versions did not write the kind.
        let kind = serde_json::from_value::<EndedBy>(summary["failure"]["kind"].clone());
        let blocked = reason.starts_with("blocked");
        let what = kind.map_or(if blocked { "blocked" } else { "ended" }, EndedBy::name);
        events.push(Event { step: step as usize, what, text: reason.to_owned() });
    }
    for line in serde_json::from_value::<Vec<UntilOutcome>>(summary["until"].clone()).unwrap_or_default() {
        let (what, how) = match line.met {
            Some(met) => (EndedBy::from(met).name(), "its condition (until) was met"),
            None => ("went on", "its condition (until) was not met on all of its way"),
        };
        let text = format!("{}: {how}, {} steps", line.line, line.steps);
        events.push(Event { step: line.after_step, what, text });
    }
    events.sort_by_key(|event| event.step);
    events
}

/// Frames of the run, evenly spaced, as many as fit.
fn frames(folder: &Path) -> Vec<Frame> {
    let Ok(entries) = std::fs::read_dir(folder.join("frames")) else { return Vec::new() };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let every = paths.len().div_ceil(MOST_FRAMES).max(1);
    let mut left = MOST_FRAME_BYTES;
    let mut frames = Vec::new();
    // Counted from the end, because the last frame is the most important one.
    for path in paths.iter().rev().step_by(every) {
        let name = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let Some((step, view)) = name.strip_prefix("step_").and_then(|rest| rest.split_once('_')) else {
            continue;
        };
        let (Ok(step), Ok(png)) = (step.parse(), std::fs::read(path)) else { continue };
        if png.len() > left {
            break;
        }
        left -= png.len();
        frames.push(Frame { step, view: view.to_owned(), png: base64(&png) });
    }
    frames.reverse();
    frames
}
