//! Options of the command line for frames.

use endowire_core::input::nearest;
use endowire_viewer::{View, ViewSpec};
use serde_json::Value;

use crate::args::{FrameArgs, ViewChoice};
use crate::failure::Failure;
use crate::scenes::of_scene_and_view;

/// Largest rotation: a hundred turns.
const MOST_TURN_DEG: f64 = 36_000.0;
/// Largest number of frames of a turn, and range of its speed.
const MOST_FRAMES: f64 = 100_000.0;
const DEG_PER_S: [f64; 2] = [0.01, 1e4];

/// Number of frames of a C-arm turn with a given speed, including the first and the last.
pub(super) fn frames_of_turn(args: &FrameArgs, frames_per_s: f64) -> Result<Option<usize>, Failure> {
    let (Some(turn), Some(speed)) = (args.turn, args.deg_per_s) else { return Ok(None) };
    let [low, high] = DEG_PER_S;
    if !(low..=high).contains(&speed) {
        return Err(Failure::Input(format!("--deg-per-s {speed:e}: give {low} to {high} degrees a second")));
    }
    let frames = (turn.abs() / speed * frames_per_s).round() + 1.0;
    if frames.is_nan() || frames > MOST_FRAMES {
        let text = format!(
            "--turn {turn:e} --deg-per-s {speed:e}: {frames:e} frames, and at most {MOST_FRAMES} are drawn"
        );
        return Err(Failure::Input(text));
    }
    Ok(Some(frames as usize))
}

/// Refuses options that are incompatible.
pub(super) fn check(args: &FrameArgs, spec: &ViewSpec, frames: usize) -> Result<(), Failure> {
    if let (Some(turn), 1) = (args.turn, frames) {
        let text = format!(
            "--turn {turn}: one frame is drawn; say how many with --count, or --deg-per-s, or draw several steps"
        );
        return Err(Failure::Input(text));
    }
    for (key, turn) in [("--orbit", args.orbit), ("--turn", args.turn)] {
        if let Some(turn) = turn.filter(|turn| !(-MOST_TURN_DEG..=MOST_TURN_DEG).contains(turn)) {
            let text = format!("{key} {turn:e}: give -{MOST_TURN_DEG} to {MOST_TURN_DEG} degrees");
            return Err(Failure::Input(text));
        }
    }
    let of_fluoro = args.dicom.is_some()
        || args.labels
        || args.raw
        || args.hold
        || args.biplane.is_some()
        || args.turn.is_some();
    if !spec.wants(View::Fluoro) && of_fluoro {
        let text = "--dicom, --labels, --raw, --hold, --biplane and --turn belong to fluoroscopy: use --view fluoro or --view both";
        return Err(Failure::Input(text.to_owned()));
    }
    Ok(())
}

/// A `[view]` table with the options of the command line.
pub(super) fn wished(mut spec: ViewSpec, args: &FrameArgs, default: ViewChoice) -> Result<ViewSpec, Failure> {
    let choice = args.view.or(spec.views.is_empty().then_some(default));
    if let Some(choice) = choice {
        spec.views = match choice {
            ViewChoice::ThreeD => vec![View::ThreeD],
            ViewChoice::Fluoro => vec![View::Fluoro],
            ViewChoice::Both => vec![View::ThreeD, View::Fluoro],
        };
    }
    spec.biplane_deg = args.biplane.or(spec.biplane_deg);
    if let Some(pose) = args.pose {
        (spec.c_arm.primary_deg, spec.c_arm.secondary_deg) = (0.0, 0.0);
        spec.c_arm.pose = Some(pose);
    }
    spec.xray.mode = args.mode.unwrap_or(spec.xray.mode);
    spec.bits = args.bits.unwrap_or(spec.bits);
    match args.size.as_deref() {
        None => {}
        Some([side]) => spec.size_px = [*side, *side],
        Some([width, height]) => spec.size_px = [*width, *height],
        Some(other) => return Err(Failure::Input(format!("--size {other:?}: give WIDTH or WIDTHxHEIGHT"))),
    }
    let (_, set) = of_scene_and_view(&args.set)?;
    if set.is_empty() {
        return Ok(spec);
    }
    let failed = |text: String| Failure::Input(format!("--set: {text}"));
    let mut table = serde_json::to_value(&spec).map_err(|e| failed(e.to_string()))?;
    for set in set {
        let (key, value) = set.split_once('=').ok_or_else(|| failed(format!("{set}: say KEY=VALUE")))?;
        // JSON, which holds the table, has no such numbers, and no key accepts them.
        if value.trim().parse::<f64>().is_ok_and(|v| !v.is_finite()) {
            return Err(failed(format!("view.{} = {}: must be a finite number", key.trim(), value.trim())));
        }
        let value = serde_json::from_str(value).unwrap_or_else(|_| Value::from(value));
        let mut place = &mut table;
        for part in key.trim().split('.') {
            if place.is_null() {
                *place = Value::Object(serde_json::Map::new());
            }
            let Value::Object(members) = place else {
                return Err(failed(format!("{key}: there is nothing inside {part}'s parent")));
            };
            place = members.entry(part).or_insert(Value::Null);
        }
        *place = value;
        // Checked one by one, so that the message names the faulty one.
        let fits = serde_json::from_value::<ViewSpec>(table.clone()).map_err(|e| e.to_string());
        fits.map_err(|e| failed(format!("{set}: {e}{}", nearest(&e))))?;
    }
    serde_json::from_value(table).map_err(|e| failed(e.to_string()))
}
