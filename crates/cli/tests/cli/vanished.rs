//! What a command has written goes away under its hands: it says so and ends with 1, for no input would have avoided it.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{assets, endowire, said, scene_text, text, wait_until};

/// Begins a command, takes its folder away once `begun`, and says what it then says. It must end with 1 and name the folder.
fn robbed(command: &mut Command, out: &Path, begun: impl Fn() -> bool) -> String {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until(begun);
    // A file may be added meanwhile.
    wait_until(|| std::fs::remove_dir_all(out).is_ok());
    let output = child.wait_with_output().unwrap();
    let reported = said(&output);
    assert_eq!(output.status.code(), Some(1), "{reported}");
    assert!(reported.contains(text(out)), "{reported}");
    reported
}

/// A scene in the curved tube, of so many steps.
fn scene(folder: &Path, step: &str) -> String {
    let changes = [
        ("advance_mm = 220.0", "advance_mm = 30.0"),
        ("step_mm = 1.0", step),
        ("[\"3d\", \"fluoro\"]", "[]"),
    ];
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene_text("curved_tube_exact.toml", &changes)).unwrap();
    text(&path).to_owned()
}

/// Files of a folder, or none.
fn count(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

#[test]
fn a_sweep_whose_folder_vanishes_says_so() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), "step_mm = 1.0");
    let sweep = folder.path().join("sweep.toml");
    let axis = "scene = \"scene.toml\"\n[[axis]]\nkey = \"vessel.wall.friction\"\ngrid = { from = 0.0, to = 0.2, count = 1000 }\n";
    for (name, record) in [("rows", ""), ("recordings", "record = \"shapes\"\n")] {
        std::fs::write(&sweep, record.to_owned() + axis).unwrap();
        let out = folder.path().join(name);
        let lines = || std::fs::read_to_string(out.join("runs.jsonl")).map_or(0, |text| text.lines().count());
        let reported = robbed(
            endowire().args(["sweep", text(&sweep), "--jobs", "1", "--out", text(&out)]),
            &out,
            || lines() > 2,
        );
        assert!(reported.contains("went on") || reported.contains("recorded"), "{reported}");
        assert!(!out.join("runs.parquet").exists());
    }
}

#[test]
fn frames_whose_folder_vanishes_are_missed() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path(), "step_mm = 0.25");
    let run = folder.path().join("run");
    let recorded = endowire().args(["run", &scene, "--out", text(&run)]).output().unwrap();
    assert!(recorded.status.success(), "{}", said(&recorded));
    let out = folder.path().join("frames");
    let draw = ["render", text(&run), "--from", "1", "--view", "3d", "--size", "320x240"];
    let reported = robbed(endowire().args(draw).args(["--out", text(&out)]), &out, || count(&out) > 2);
    assert!(reported.contains("while frames were drawn"), "{reported}");
    // The twin: left alone, it draws them all.
    let drawn = endowire().args(draw).args(["--every", "40", "--out", text(&out)]).output().unwrap();
    assert!(drawn.status.success() && count(&out) > 2, "{}", said(&drawn));
}

#[test]
fn a_dataset_whose_folder_vanishes_says_so() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path(), "step_mm = 2.0");
    let spec = folder.path().join("spec.toml");
    let device = assets().join("devices/wire_035_soft.toml");
    let dataset = format!(
        "scenes = [\"scene.toml\"]\ndevices = [{device:?}]\nposes = 500\nmoments = 1\n[view]\nsize_px = [256, 192]\nbackend = \"cpu\"\n"
    );
    std::fs::write(&spec, dataset).unwrap();
    let out = folder.path().join("dataset");
    let reported = robbed(endowire().args(["dataset", text(&spec), "--out", text(&out)]), &out, || {
        count(&out.join("parts")) > 1
    });
    assert!(reported.trim_end().lines().count() == 1, "{reported}");
}
