//! A run that is killed at any moment leaves a recording, and runs do not get in one another's way.

use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};

use crate::common::{endowire, said, scene_text, wait_until};
use serde_json::Value;

/// A run in the curved tube of so many steps that it never ends by itself, without frames unless `views` asks for them.
fn endless_scene(folder: &Path, views: &str) -> PathBuf {
    let changes = [
        ("step_mm = 0.5", "step_mm = 0.001"),
        ("size_px = [640, 640]", "size_px = [24, 16]"),
        ("every = 40", "every = 1"),
        ("[\"3d\", \"fluoro\"]", views),
    ];
    let text = scene_text("curved_tube.toml", &changes);
    let path = folder.join("endless.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn start(scene: &Path, out: &Path) -> Child {
    let allowed = "--allow-unconverged".as_ref();
    let mut command = endowire();
    command.args(["run".as_ref(), scene, "--out".as_ref(), out, allowed]);
    command.stderr(Stdio::piped()).spawn().unwrap()
}

fn render(recording: &Path) -> Output {
    endowire()
        .args(["render".as_ref(), recording.as_os_str()])
        .args(["--json", "--view", "3d", "--size", "24x16", "--from", "1", "--every", "100000"])
        .output()
        .unwrap()
}

/// Whole lines of the table of steps, without its head.
fn rows(out: &Path) -> usize {
    std::fs::read(out.join("steps.csv"))
        .map_or(0, |text| text.iter().filter(|byte| **byte == b'\n').count().saturating_sub(1))
}

/// Ends a run as a power failure would, without a last word.
fn kill(mut child: Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

fn numbers(path: &Path) -> Vec<i64> {
    let bytes = std::fs::read(path).unwrap();
    bytes.chunks_exact(8).map(|b| i64::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn a_run_that_is_killed_keeps_every_step_and_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let scene = endless_scene(folder.path(), "[]");
    let out = folder.path().join("out");
    for wanted in [1, 2, 17, 400, 1500] {
        let _ = std::fs::remove_dir_all(&out);
        let run = start(&scene, &out);
        wait_until(|| rows(&out) >= wanted);
        kill(run);
        let recorded = rows(&out);
        let offsets = numbers(&out.join("shapes.part/offsets.i64"));
        let positions = std::fs::metadata(out.join("shapes.part/positions_mm.f64")).unwrap().len();
        assert!(offsets.len() > recorded, "{} offsets of {recorded} steps", offsets.len());
        assert!(positions >= 24 * offsets[recorded] as u64);
        let summary: Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(summary["complete"], false);
        assert!(summary["steps"].as_u64().unwrap() as usize <= recorded);

        let drawn = render(&out);
        let said = said(&drawn);
        assert!(drawn.status.success(), "{said}");
        // What the kill left of a step is dropped.
        let steps = recorded.min(offsets.len() - 1);
        assert!(said.contains(&format!("{steps} steps of it are recorded")), "{said}");
        assert!(out.join(format!("render/step_{steps:06}_3d.png")).exists());
    }
}

#[test]
fn frames_of_a_run_that_is_killed_are_whole() {
    let folder = tempfile::tempdir().unwrap();
    let scene = endless_scene(folder.path(), "[\"3d\"]");
    let out = folder.path().join("out");
    let run = start(&scene, &out);
    wait_until(|| rows(&out) >= 30);
    kill(run);
    let mut whole = 0;
    for entry in std::fs::read_dir(out.join("frames")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "png") {
            let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
            let mut reader = png::Decoder::new(file).read_info().unwrap();
            let mut data = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut data).unwrap();
            whole += 1;
        }
    }
    assert!(whole >= 29, "{whole}");
}

#[test]
fn a_second_run_into_the_same_folder_stops_until_the_first_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let scene = endless_scene(folder.path(), "[]");
    let out = folder.path().join("out");
    let first = start(&scene, &out);
    wait_until(|| rows(&out) >= 5);
    let second = start(&scene, &out).wait_with_output().unwrap();
    let reported = said(&second);
    assert_eq!(second.status.code(), Some(2), "{reported}");
    assert!(
        reported.contains("another run is recording") && reported.trim_end().lines().count() == 1,
        "{reported}"
    );
    // The first goes on, is drawn meanwhile, and its death frees the folder.
    let before = rows(&out);
    assert!(render(&out).status.success());
    wait_until(|| rows(&out) > before);
    kill(first);
    let text = std::fs::read_to_string(&scene).unwrap().replace("step_mm = 0.001", "step_mm = 5.0");
    std::fs::write(&scene, text).unwrap();
    let third = start(&scene, &out).wait_with_output().unwrap();
    let reported = said(&third);
    assert_eq!(third.status.code(), Some(0), "{reported}");
    assert!(
        reported.contains("replaces the earlier recording") && reported.contains("shapes.part/"),
        "{reported}"
    );
    assert!(out.join("shapes.npz").exists() && !out.join("shapes.part").exists());
}

#[test]
fn a_run_whose_folder_vanishes_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for (name, views) in [("without", "[]"), ("with", "[\"3d\", \"fluoro\"]")] {
        let scene = endless_scene(folder.path(), views);
        let out = folder.path().join(name);
        let run = start(&scene, &out);
        wait_until(|| rows(&out) >= 3);
        // A file may be added meanwhile.
        wait_until(|| std::fs::remove_dir_all(&out).is_ok());
        let output = run.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains(name), "{}", said(&output));
        assert!(!out.join("shapes.npz").exists() && !out.join("summary.json").exists());
    }
}
