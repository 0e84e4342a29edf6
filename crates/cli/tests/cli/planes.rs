//! Two planes at once, and a C-arm that turns.

use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::common::{SHORT, assets, bytes, document, reported, said, scene_text, text};

fn endowire(args: &[&str]) -> Output {
    crate::common::endowire().args(args).output().unwrap()
}

/// A short run in the curved tube, recorded with fluoroscopy in two planes.
fn recorded(folder: &Path) -> PathBuf {
    let views = "biplane_deg = 90.0\nviews = [\"fluoro\"]";
    let changes = [&SHORT[..], &[("views = [\"3d\", \"fluoro\"]", views)]].concat();
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene_text("curved_tube.toml", &changes)).unwrap();
    let run = folder.join("run");
    let output = endowire(&["run", text(&path), "--out", text(&run)]);
    assert!(output.status.success(), "{}", said(&output));
    run
}

/// Pixel coordinates by a camera matrix of a document.
fn seen(matrix: &Value, point_mm: &[f64]) -> [f64; 2] {
    let row = |k: usize| -> f64 {
        let row = matrix[k].as_array().unwrap().iter().map(|v| v.as_f64().unwrap());
        row.zip(point_mm.iter().chain(&[1.0])).map(|(a, x)| a * x).sum()
    };
    [row(0) / row(2), row(1) / row(2)]
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Draws fluoroscopy of the last step of that run.
fn last_step<'a>(run: &'a Path, out: &'a Path) -> [&'a str; 11] {
    let [run, out] = [run, out].map(text);
    ["render", run, "--from", "106", "--to", "106", "--view", "fluoro", "--out", out, "--json"]
}

#[test]
fn a_run_in_two_planes_has_the_frames_and_the_matrix_of_each() {
    let folder = tempfile::tempdir().unwrap();
    let run = recorded(folder.path());
    let summary = document(run.join("summary.json"));
    let [first, second] =
        ["step_000106_fluoro.png", "step_000106_fluoro_b.png"].map(|name| run.join("frames").join(name));
    assert_ne!(bytes(&first), bytes(&second));
    let frames: Vec<&str> = summary["frames"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert!(
        frames.contains(&"frames/step_000106_fluoro.png")
            && frames.contains(&"frames/step_000106_fluoro_b.png")
    );
    let angles: Vec<f64> =
        summary["planes"].as_array().unwrap().iter().map(|p| p["primary_deg"].as_f64().unwrap()).collect();
    assert_eq!(angles[1] - angles[0], 90.0);
    // Frames afterwards are in the planes of the scene too, with labels of both: the tip is where each matrix has it.
    let out = folder.path().join("out");
    let files = reported(&endowire(&[&last_step(&run, &out)[..], &["--labels", "--raw"]].concat()));
    let files: Vec<&str> = files["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    for rest in ["fluoro.png", "mask.png", "mask_vessel.png", "labels.json", "line_integral.npy"] {
        let (name, ending) = rest.split_once('.').unwrap();
        assert!(files.contains(&format!("step_000106_{name}_b.{ending}").as_str()), "{rest}: {files:?}");
    }
    let mut tips = Vec::new();
    for (plane, ending) in ["", "_b"].into_iter().enumerate() {
        let labels = document(out.join(format!("step_000106_labels{ending}.json")));
        assert_eq!(labels["camera_matrix"], summary["planes"][plane]["camera_matrix"]);
        let device = &labels["devices"][0];
        let (reported, expected) =
            (numbers(&device["tip_px"]), seen(&labels["camera_matrix"], &numbers(&device["tip_mm"])));
        assert!((0..2).all(|k| (reported[k] - expected[k]).abs() < 1e-6), "{reported:?} {expected:?}");
        tips.push(reported);
    }
    assert_ne!(tips[0], tips[1], "the twin: the planes see it elsewhere");
}

#[test]
fn two_planes_are_drawn_at_once_and_each_is_what_it_is_alone() {
    let folder = tempfile::tempdir().unwrap();
    let run = recorded(folder.path());
    let [both, alone, dicom] = ["both", "alone", "pair.dcm"].map(|name| folder.path().join(name));
    let draw = |args: &[&str]| {
        let mut all =
            vec!["render", text(&run), "--from", "106", "--to", "106", "--view", "fluoro", "--json"];
        all.extend(args);
        reported(&endowire(&all))
    };
    let pair = draw(&["--pose", "RAO 20", "--biplane", "90", "--dicom", text(&dicom), "--out", text(&both)]);
    draw(&["--pose", "LAO 70", "--out", text(&alone)]);
    let [first, second] =
        ["step_000106_fluoro.png", "step_000106_fluoro_b.png"].map(|name| bytes(both.join(name)));
    assert_eq!(second, bytes(alone.join("step_000106_fluoro.png")));
    assert_ne!(first, second, "the twin: the planes differ");
    let files: Vec<&str> = pair["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let other = folder.path().join("pair_b.dcm");
    assert!(files.contains(&text(&dicom)) && files.contains(&text(&other)), "{files:?}");
    assert!(bytes(dicom).len() > 1000 && bytes(other).len() > 1000);
    let refused = endowire(&["render", text(&run), "--view", "3d", "--biplane", "90"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--biplane"));
}

/// Frames of an empty arch after an injection, drawn in one of the modes: those of the call, in order.
fn arch(folder: &Path, mode: &str, more: &[&str]) -> Vec<Vec<u8>> {
    let scene = assets().join("scenes/arch_angiography.toml");
    let out = folder.join(mode).join(more.join("_"));
    // What a frame shows without noise and without what is left of the one before it.
    let still =
        ["detector.noise=false", "detector.lag=0", "xray.brightness_s=0"].map(|set| ["--set", set]).concat();
    let still = [&still[..], &["--size", "64", "--view", "fluoro"]].concat();
    let scene = ["fluoro", text(&scene), "--steps", "0", "--mode", mode, "--out", text(&out), "--json"];
    let files = reported(&endowire(&[&scene[..], &still, more].concat()));
    let names = files["files"].as_array().unwrap().iter().filter_map(Value::as_str);
    names.filter(|name| name.ends_with(".png")).map(|name| bytes(out.join(name))).collect()
}

#[test]
fn frames_of_a_c_arm_that_turns_are_those_of_each_angle_in_every_mode() {
    let folder = tempfile::tempdir().unwrap();
    for mode in ["fluoro", "cine", "dsa", "roadmap"] {
        // 15 frames a second: 0, 20 and 40 degrees from the first, 1/15 s apart.
        let turned = arch(
            folder.path(),
            mode,
            &["--time", "0.8", "--pose", "RAO 10", "--turn", "40", "--deg-per-s", "300"],
        );
        assert_eq!(turned.len(), 3);
        let last_s = format!("{}", 0.8 + 2.0 / 15.0);
        let still = arch(folder.path(), mode, &["--time", &last_s, "--pose", "LAO 30"]);
        assert!(turned[2] == still[0], "{mode}");
        let lateral = arch(folder.path(), mode, &["--time", &last_s, "--pose", "LAO 29"]);
        assert!(turned[2] != lateral[0], "{mode}: the twin, a degree aside");
    }
}

#[test]
fn a_state_of_a_run_is_drawn_all_around_in_two_planes() {
    let folder = tempfile::tempdir().unwrap();
    let run = recorded(folder.path());
    let [out, dicom] = ["out", "turn.dcm"].map(|name| folder.path().join(name));
    let step = last_step(&run, &out);
    let files = reported(&endowire(
        &[&step[..], &["--turn", "180", "--count", "4", "--labels", "--dicom", text(&dicom)]].concat(),
    ));
    let files: Vec<&str> = files["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    let matrix = |frame: usize, ending: &str| {
        let name = format!("step_000106_frame_{frame:06}_labels{ending}.json");
        assert!(files.contains(&name.as_str()), "{name}: {files:?}");
        let matrix = document(out.join(name))["camera_matrix"].clone();
        matrix.as_array().unwrap().iter().flat_map(numbers).collect::<Vec<f64>>()
    };
    // The first plane stands after 60 degrees and a half where the second, 90 degrees on, never does, and at the end opposite to its beginning.
    let [first, last] = [matrix(0, ""), matrix(3, "")];
    let depth = |m: &[f64]| [m[8], m[9], m[10]];
    assert!((0..2).all(|k| (depth(&first)[k] + depth(&last)[k]).abs() < 1e-12), "{first:?} {last:?}");
    assert_ne!(matrix(1, ""), matrix(1, "_b"));
    assert!(bytes(&dicom).len() > 1000 && bytes(folder.path().join("turn_b.dcm")).len() > 1000);
    for (more, words) in [
        (vec!["--turn", "10"], "--turn 10: one frame is drawn"),
        (vec!["--turn", "10", "--deg-per-s", "0"], "--deg-per-s 0e0: give 0.01 to 10000"),
        (vec!["--turn", "1e9", "--count", "2"], "--turn 1e9: give -36000 to 36000 degrees"),
        (vec!["--turn", "36000", "--deg-per-s", "0.01"], "and at most 100000 are drawn"),
        (vec!["--turn", "300", "--count", "3"], "view.c_arm.primary_deg = 390"),
        (vec!["--deg-per-s", "5"], "--turn"),
    ] {
        let output = endowire(&[&step[..], &more].concat());
        assert!(said(&output).contains(words), "{more:?}: {}", said(&output));
        assert_eq!(output.status.code(), Some(2), "{more:?}");
    }
    let several = endowire(&["render", text(&run), "--from", "1", "--count", "3"]);
    assert!(said(&several).contains("belong to one step"), "{}", said(&several));
}

#[test]
fn a_pulse_shows_the_way_of_a_device_in_a_run_and_afterwards_alike() {
    let folder = tempfile::tempdir().unwrap();
    // A step is a fifteenth of a second; pulses last for 60 ms of it, and the tube's voltage follows the patient.
    let run = |name: &str, pulse_ms: &str| {
        let views = "views = [\"fluoro\"]\nexposure.current_ma = [0.1, 1000.0]\ndetector.lag = 0.0\nbits = 16\nc_arm = { field_mm = 30.0, isocentre_mm = [0.0, 0.0, 10.0] }";
        let pulse = format!("contrast_fraction = 0.05\nbrightness_s = 0.0\npulse_ms = {pulse_ms}");
        let more = [("views = [\"3d\", \"fluoro\"]", views), ("contrast_fraction = 0.05", pulse.as_str())];
        let changes = [&SHORT[..], &more].concat();
        let path = folder.path().join(format!("{name}.toml"));
        std::fs::write(&path, scene_text("curved_tube.toml", &changes)).unwrap();
        let run = folder.path().join(name);
        let output = endowire(&["run", text(&path), "--out", text(&run)]);
        assert!(output.status.success(), "{}", said(&output));
        run
    };
    let [long, short] = [run("long", "60.0"), run("short", "0.1")];
    let frame = |run: &Path| bytes(run.join("frames/step_000106_fluoro.png"));
    let render = ["render", text(&long), "--from", "105", "--view", "fluoro", "--json", "--labels"];
    reported(&endowire(&render));
    assert!(frame(&long) == bytes(long.join("render/step_000106_fluoro.png")));
    assert!(frame(&long) != frame(&short), "the twin: a pulse that is over at once");
    let exposure = &document(long.join("summary.json"))["planes"][0]["exposure"];
    assert_eq!(exposure["pulse"]["pulse_ms"], 60.0);
    assert_eq!(exposure["kvp"], 60.0, "10 cm of tissue");
    assert_eq!(&document(long.join("render/step_000106_labels.json"))["exposure"], exposure);
}
