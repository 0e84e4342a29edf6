//! What `endowire run` leaves on disk, read back by an independent reader.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use npyz::npz::NpzArchive;
use serde_json::Value;

fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

fn run(scene: &Path, out: &Path) -> (Option<i32>, Value) {
    let output = Command::new(env!("CARGO_BIN_EXE_endowire"))
        .args(["run".as_ref(), scene, "--out".as_ref(), out, "--json".as_ref()])
        .output()
        .unwrap();
    let stdout = String::from_utf8(output.stdout).unwrap();
    let summary = serde_json::from_str(&stdout)
        .unwrap_or_else(|e| panic!("{e}: {stdout}{}", String::from_utf8_lossy(&output.stderr)));
    (output.status.code(), summary)
}

fn floats(path: &Path, name: &str) -> (Vec<u64>, Vec<f64>) {
    let mut archive = NpzArchive::new(File::open(path).unwrap()).unwrap();
    let array = archive.by_name(name).unwrap().unwrap();
    (array.shape().to_vec(), array.into_vec().unwrap())
}

fn integers(path: &Path, name: &str) -> Vec<i64> {
    let mut archive = NpzArchive::new(File::open(path).unwrap()).unwrap();
    archive.by_name(name).unwrap().unwrap().into_vec().unwrap()
}

/// A short run in the curved tube with two frames of each view.
fn short_scene(folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(assets().join("scenes/curved_tube.toml")).unwrap();
    let assets = assets().canonicalize().unwrap();
    let text = text
        .replace("\"../", &format!("\"{}/", assets.display()))
        .replace("advance_mm = 220.0", "advance_mm = 30.0")
        .replace("size_px = [640, 640]", "size_px = [96, 64]");
    let path = folder.join("short.toml");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_run_is_recorded_whole_and_the_parts_agree() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let (code, summary) = run(&short_scene(folder.path()), &out);
    assert_eq!(code, Some(0));

    let steps = summary["steps"].as_u64().unwrap() as usize;
    assert_eq!(steps, 60 + 6 + 40);
    assert_eq!(summary["converged"], true);
    assert!((summary["inserted_mm"].as_f64().unwrap() - 10.0).abs() < 1e-9);
    for key in [
        "version",
        "git_revision",
        "scene_hash",
        "seed",
        "tip_mm",
        "push_force_n",
        "torque_nmm",
        "energy_mj",
        "max_penetration_mm",
        "wall_time_s",
        "frames",
    ] {
        assert!(!summary[key].is_null(), "{key} is missing");
    }
    assert_eq!(summary["scene_hash"].as_str().unwrap().len(), 64);
    let on_disk: Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(on_disk, summary);

    let table = std::fs::read_to_string(out.join("steps.csv")).unwrap();
    assert_eq!(table.lines().count(), steps + 1);

    let offsets = integers(&out.join("shapes.npz"), "offsets");
    let (shape, positions) = floats(&out.join("shapes.npz"), "positions_mm");
    assert_eq!(offsets.len(), steps + 1);
    assert_eq!(shape, [offsets[steps] as u64, 3]);
    for (k, name) in ["x", "y", "z"].iter().enumerate() {
        let tip = summary["tip_mm"][k].as_f64().unwrap();
        let recorded = positions[3 * (offsets[steps] as usize - 1) + k];
        assert_eq!(tip.to_bits(), recorded.to_bits(), "tip {name}");
    }
    assert_eq!(floats(&out.join("shapes.npz"), "from_tip_mm").0, [offsets[steps] as u64]);

    let frames = summary["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 2 * 3, "steps 40, 80 and the last one, both views");
    for frame in frames {
        let decoder = png::Decoder::new(std::io::BufReader::new(
            File::open(out.join(frame.as_str().unwrap())).unwrap(),
        ));
        let info = decoder.read_info().unwrap();
        assert_eq!((info.info().width, info.info().height), (96, 64));
    }
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    let summary = run(&scene, &a).1;
    run(&scene, &b);
    let mut names = vec!["steps.csv".to_owned(), "shapes.npz".to_owned()];
    names.extend(summary["frames"].as_array().unwrap().iter().map(|f| f.as_str().unwrap().to_owned()));
    for name in names {
        assert!(
            std::fs::read(a.join(&name)).unwrap() == std::fs::read(b.join(&name)).unwrap(),
            "{name} differs"
        );
    }
}

#[test]
fn a_view_that_is_not_asked_for_leaves_no_frame() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let text = std::fs::read_to_string(&scene).unwrap().replace("[\"3d\", \"fluoro\"]", "[\"fluoro\"]");
    std::fs::write(&scene, text).unwrap();
    let (_, summary) = run(&scene, &folder.path().join("out"));
    let frames = summary["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 3);
    assert!(frames.iter().all(|f| f.as_str().unwrap().ends_with("_fluoro.png")));
}

#[test]
fn recording_anew_replaces_the_old_recording_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let out = folder.path().join("out");
    run(&scene, &out);
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    std::fs::write(out.join("frames/step_999999_3d.png"), "old").unwrap();
    run(&scene, &out);
    assert!(out.join("notes.txt").exists());
    assert!(!out.join("frames/step_999999_3d.png").exists());
}
