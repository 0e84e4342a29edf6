//! Options of the command line for frames.

use endowire_core::input::{nearest, plain};
use endowire_viewer::{View, ViewSpec};
use serde_json::Value;

use crate::args::{FrameArgs, ViewChoice};
use crate::failure::Failure;
use crate::scenes::of_scene_and_view;

/// Largest rotation: a hundred turns.
const MOST_TURN_DEG: f64 = 36_000.0;
/// Largest number of frames.
pub(crate) const MOST_FRAMES: u32 = 100_000;
/// Range of the speed of a turn.
const DEG_PER_S: [f64; 2] = [0.01, 1e4];

/// Number of frames of a C-arm turn with a given speed, including the first and the last.
pub(super) fn frames_of_turn(args: &FrameArgs, frames_per_s: f64) -> Result<Option<usize>, Failure> {
    let (Some(turn), Some(speed)) = (args.turn, args.deg_per_s) else { return Ok(None) };
    let [low, high] = DEG_PER_S;
    if !(low..=high).contains(&speed) {
        return Err(Failure::Input(format!("--deg-per-s {speed:e}: give {low} to {high} degrees a second")));
    }
    let frames = (turn.abs() / speed * frames_per_s).round() + 1.0;
    if frames.is_nan() || frames > f64::from(MOST_FRAMES) {
        let text = format!(
            "--turn {turn:e} --deg-per-s {speed:e}: {frames:e} frames, and at most {MOST_FRAMES} are drawn"
        );
        return Err(Failure::Input(text));
    }
    Ok(Some(frames as usize))
}

/// Options of their own for keys of `[view]`.
const OPTIONS: [(&str, &str); 6] = [
    ("--size", "size_px"),
    ("--bits", "bits"),
    ("--mode", "xray.mode"),
    ("--pose", "c_arm.pose"),
    ("--biplane", "biplane_deg"),
    ("--view", "views"),
];

/// Keys of `[view]` for `endowire run`, and what does the same here.
const OF_RUNS: [(&str, &str); 2] = [
    ("every", "is for endowire run; --every of endowire render draws every so many steps of a recording"),
    ("film", "is for endowire run; --animate FILE writes a film"),
];

/// The options that are given, with the keys of `[view]` that they set.
fn given(args: &FrameArgs) -> impl Iterator<Item = (&'static str, &'static str)> {
    let is_given = [
        args.size.is_some(),
        args.bits.is_some(),
        args.mode.is_some(),
        args.pose.is_some(),
        args.biplane.is_some(),
        args.view.is_some(),
    ];
    OPTIONS.into_iter().zip(is_given).filter(|(_, given)| *given).map(|(option, _)| option)
}

/// The key of `[view]` that a text `KEY=VALUE` sets, written from that table or from the top of the scene.
fn key_of_view(text: &str) -> &str {
    let key = text.split('=').next().unwrap_or_default().trim();
    key.strip_prefix("view.").unwrap_or(key)
}

/// The option that set the key which a message is about; `None` if the value is the scene file's own.
pub(super) fn at_fault(args: &FrameArgs, message: &str) -> Option<String> {
    let reported = message.strip_prefix("view.")?;
    let is_about = |key: &str| {
        let rest = reported.strip_prefix(key).filter(|_| !key.is_empty());
        rest.is_some_and(|rest| rest.starts_with([' ', '.', '[']))
    };
    let set = args.set.iter().rev().find(|text| is_about(key_of_view(text)));
    let option = || given(args).find(|(_, key)| is_about(key)).map(|(option, _)| option.to_owned());
    set.map(|text| format!("--set {text}")).or_else(option)
}

/// Refuses keys that are set twice, and those that have no effect.
fn check_set(args: &FrameArgs, spec: &ViewSpec, rests: bool) -> Result<(), Failure> {
    let patient = spec.patient.torso.is_some() || spec.patient.ct.is_some();
    for text in &args.set {
        let key = key_of_view(text);
        if let Some((option, _)) = given(args).find(|(_, other)| *other == key) {
            let text = format!("--set {text}: {option} gives the same: leave out one of the two");
            return Err(Failure::Input(text));
        }
        if let Some((_, remedy)) = OF_RUNS.iter().find(|(other, _)| *other == key) {
            return Err(Failure::Input(format!("--set {text}: {remedy}")));
        }
        if key == "xray.pulse_ms" && rests && spec.exposure.is_none() {
            let text = format!(
                "--set {text}: nothing moves here, so a pulse of any length shows the same: leave it out, or draw a run with \
                 endowire render"
            );
            return Err(Failure::Input(text));
        }
        if key == "xray.tissue_mm" && patient {
            let text = format!(
                "--set {text}: is the thickness of a slab, and the scene has a body (view.patient) in its place: leave it out, or \
                 set patient={{}} for the slab"
            );
            return Err(Failure::Input(text));
        }
    }
    Ok(())
}

/// Refuses options that are incompatible; `rests` says that nothing moves in what is drawn.
pub(super) fn check(args: &FrameArgs, spec: &ViewSpec, frames: usize, rests: bool) -> Result<(), Failure> {
    check_set(args, spec, rests)?;
    for (key, turn) in [("--orbit", args.orbit), ("--turn", args.turn)] {
        if let Some(turn) = turn.filter(|turn| !(-MOST_TURN_DEG..=MOST_TURN_DEG).contains(turn)) {
            let text = format!("{key} {turn:e}: give -{MOST_TURN_DEG} to {MOST_TURN_DEG} degrees");
            return Err(Failure::Input(text));
        }
    }
    for (key, turn) in [("--turn", args.turn), ("--orbit", args.orbit)] {
        if let (Some(turn), 1) = (turn, frames) {
            let text = format!(
                "{key} {turn}: one frame is drawn; say how many with --count, or draw several steps (or a --turn with --deg-per-s)"
            );
            return Err(Failure::Input(text));
        }
    }
    if let (Some(orbit), false) = (args.orbit, spec.wants(View::ThreeD)) {
        let text = format!("--orbit {orbit}: belongs to the 3D view: use --view 3d or --view both");
        return Err(Failure::Input(text));
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
        let fits = serde_json::from_value::<ViewSpec>(table.clone()).map_err(|e| plain(&e.to_string()));
        fits.map_err(|e| failed(format!("{set}: {e}{}", nearest(&e))))?;
    }
    let mut view: ViewSpec = serde_json::from_value(table).map_err(|e| failed(plain(&e.to_string())))?;
    view.patient.vessel_moves = spec.patient.vessel_moves;
    Ok(view)
}
