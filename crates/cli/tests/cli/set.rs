//! `--set KEY=VALUE`: a scene with other values than its file has, in every command that takes one, and where that is reported.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{bytes, document, endowire, reported, said, text};
use serde_json::{Value, json};

const SCENE: &str = r#"
name = "tube"

[vessel]
tree = "tube.csv"
edge_mm = 2.0

[device]
file = "wire.toml"

[sheath]
position_mm = [1.0, 0.0, 0.0]
direction = [1.0, 0.4, 0.0]

[method]
element_mm = 4.0

[[script]]
advance_mm = 30.0
step_mm = 2.0

[view]
views = []
backend = "cpu"
size_px = [256, 256]
"#;

/// A wire as a data sheet has it.
const WIRE: &str = r#"
name = "wire"
kind = "guidewire"
length_cm = 12.0
source = "an invented data sheet"

[[part]]
name = "tip"
length_mm = 20.0
outer_diameter_inch = 0.035
bending_stiffness_nmm2 = 5.0
material = "platinum"

[[part]]
name = "shaft"
outer_diameter_inch = 0.035
flexural_modulus_gpa = 9.5
"#;

fn scene(folder: &Path) -> PathBuf {
    std::fs::write(folder.join("tube.csv"), "0 0 0 4 -1\n60 0 0 4 0\n").unwrap();
    std::fs::write(folder.join("wire.toml"), WIRE).unwrap();
    let path = folder.join("scene.toml");
    std::fs::write(&path, SCENE).unwrap();
    path
}

fn call(command: &str, file: &Path, out: &Path, more: &[&str]) -> Output {
    endowire().args([command, text(file), "--out", text(out)]).args(more).output().unwrap()
}

fn done(output: &Output) {
    assert!(output.status.success(), "{}", said(output));
}

/// The steps of a recording.
fn steps(out: &Path) -> Vec<u8> {
    bytes(out.join("steps.csv"))
}

#[test]
fn set_is_as_if_the_file_had_the_value_and_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let at = |name: &str| folder.path().join(name);
    done(&call("run", &file, &at("plain"), &[]));
    let set = ["--set", "vessel.wall.friction=0.3", "--set", "script[0].step_mm=3", "--set", "view.every=7"];
    done(&call("run", &file, &at("set"), &set));
    let written = SCENE
        .replace("edge_mm = 2.0", "edge_mm = 2.0\nwall.friction = 0.3")
        .replace("step_mm = 2.0", "step_mm = 3.0");
    std::fs::write(at("written.toml"), written).unwrap();
    done(&call("run", &at("written.toml"), &at("written"), &[]));
    assert!(steps(&at("set")) == steps(&at("written")));
    assert!(steps(&at("set")) != steps(&at("plain")), "the twin");
    let [plain, with] = ["plain", "set"].map(|out| document(at(out).join("summary.json")));
    assert_eq!(with["set"], json!(["vessel.wall.friction=0.3", "script[0].step_mm=3", "view.every=7"]));
    assert!(plain["set"].is_null());
    assert_ne!(with["scene_hash"], plain["scene_hash"]);

    // A run of a sweep that sets the same is the same run, and its row has the same hash.
    let sweep = at("sweep.toml");
    std::fs::write(
        &sweep,
        "scene = \"scene.toml\"\n[[axis]]\nkey = \"vessel.wall.friction\"\nlist = [0.3]\n",
    )
    .unwrap();
    let more = ["--set", "script[0].step_mm=3", "--set", "view.every=7"];
    done(&call("sweep", &sweep, &at("swept"), &more));
    let journal = String::from_utf8(bytes(at("swept/runs.jsonl"))).unwrap();
    let row: Value = serde_json::from_str(journal.lines().nth(1).unwrap()).unwrap();
    assert_eq!(
        (&row["scene_hash"], &row["outcome"]["push_force_n"]),
        (&with["scene_hash"], &with["push_force_n"])
    );
    // With other settings it is another sweep.
    let other = call("sweep", &sweep, &at("swept"), &more[..2]);
    assert!(
        other.status.code() == Some(2) && said(&other).contains("rows of another sweep"),
        "{}",
        said(&other)
    );
}

#[test]
fn a_wrong_key_or_value_is_refused_with_the_nearest_right_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let out = folder.path().join("out");
    for (command, set, reported) in [
        ("run", "vessel.wall.frction=0.1", "vessel.wall.frction = 0.1: "),
        ("run", "vessel.wall.frction=0.1", "did you mean `friction`?"),
        ("run", "vesel.wall.friction=0.1", "did you mean `vessel`?"),
        (
            "run",
            "vessel.wall.friction=much",
            "vessel.wall.friction = \"much\": friction: must be a number, not the text \"much\"",
        ),
        ("run", "vessel.wall.friction", "write KEY=VALUE"),
        ("run", "script[1].step_mm=2", "the scene has 1 in that list, and [0] is the first"),
        ("run", "scrpt[0].step_mm=2", "did you mean `script[0]`?"),
        ("run", "device.part[0].lenth_mm=2", "did you mean `length_mm`?"),
        ("run", "device.part[2].length_mm=2", "the scene has 2 in that list"),
        (
            "run",
            "device.part[0].radius_mm=0.4",
            "device.part \"tip\".outer_diameter_inch = 0.035: radius_mm is given too",
        ),
        ("run", "method.name=kirchof", "did you mean `kirchhoff`?"),
        ("run", "view.evry=2", "view.evry = 2: unknown field `evry`"),
        ("run", "view.evry=2", "did you mean `every`?"),
        ("fluoro", "vessel.wall.frction=0.1", "did you mean `friction`?"),
        ("fluoro", "c_arm.sid=1000", "did you mean `sid_mm`?"),
        ("dataset", "vessel.wall.frction=0.1", "did you mean `friction`?"),
        ("sweep", "vessel.wall.frction=0.1", "did you mean `friction`?"),
    ] {
        let file = match command {
            "dataset" => {
                std::fs::write(folder.path().join("data.toml"), "scenes = [\"scene.toml\"]\n").unwrap();
                folder.path().join("data.toml")
            }
            "sweep" => {
                std::fs::write(folder.path().join("sweep.toml"), "scene = \"scene.toml\"\n").unwrap();
                folder.path().join("sweep.toml")
            }
            _ => file.clone(),
        };
        let output = call(command, &file, &out, &["--set", set]);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{command} {set}: {said}");
        assert!(said.contains(reported), "{command} {set}: {said}");
        // What the parser of the command line refuses has a line on the usage too.
        assert!(
            reported.contains("KEY=VALUE") || said.trim_end().lines().count() == 1,
            "{command} {set}: {said}"
        );
    }
    let script = folder.path().join("script.toml");
    std::fs::write(&script, "[[script]]\nadvance_mm = 4.0\n").unwrap();
    let both = call("run", &file, &out, &["--script", text(&script), "--set", "script[0].step_mm=1"]);
    assert!(
        both.status.code() == Some(2) && said(&both).contains("change its lines there"),
        "{}",
        said(&both)
    );
    assert!(!out.exists());
}

#[test]
fn a_state_of_other_settings_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let [out, state] = ["out", "state"].map(|name| folder.path().join(name));
    let stiff = ["--set", "vessel.wall.friction=0.3"];
    done(&call("run", &file, &out, &[&stiff[..], &["--save-state", text(&state)]].concat()));
    let resume = ["--resume", text(&state)];
    let refused = call("run", &file, &out, &resume);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        said(&refused).contains("the properties of its wall (vessel.wall) is not the same"),
        "{}",
        said(&refused)
    );
    done(&call("run", &file, &out, &[&stiff[..], &resume].concat()));
    let part =
        call("run", &file, &out, &[&stiff[..], &resume, &["--set", "device.part[0].length_mm=30"]].concat());
    assert!(
        part.status.code() == Some(2) && said(&part).contains("the device is not the same"),
        "{}",
        said(&part)
    );
}

#[test]
fn parts_of_a_device_file_are_set_and_swept() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let at = |name: &str| folder.path().join(name);
    done(&call("run", &file, &at("plain"), &[]));
    done(&call("run", &file, &at("set"), &["--set", "device.part[0].bending_stiffness_nmm2=20"]));
    std::fs::write(at("wire.toml"), WIRE.replace("nmm2 = 5.0", "nmm2 = 20.0")).unwrap();
    done(&call("run", &file, &at("written"), &[]));
    assert!(steps(&at("set")) == steps(&at("written")) && steps(&at("set")) != steps(&at("plain")));
    scene(folder.path());

    let sweep = at("sweep.toml");
    let axis = "scene = \"scene.toml\"\nrecord = \"shapes\"\n[[axis]]\nkey = \"device.part[0].bending_stiffness_nmm2\"\nlist = [5.0, 20]\n";
    std::fs::write(&sweep, axis).unwrap();
    done(&call("sweep", &sweep, &at("swept"), &[]));
    for (run, as_run) in [("000000", "plain"), ("000001", "set")] {
        assert!(steps(&at("swept/recordings").join(run)) == steps(&at(as_run)), "{run}");
    }
    // A recording's scene holds the parts, with what they are made of.
    let own = std::fs::read_to_string(at("swept/recordings/000001.toml")).unwrap();
    assert!(own.contains("material = \"platinum\"") && !own.contains("wire.toml"), "{own}");
    done(&call("run", &at("swept/recordings/000001.toml"), &at("again"), &[]));
    assert!(steps(&at("again")) == steps(&at("set")));
    // Another file is another sweep, though the rows name it no more.
    std::fs::write(at("wire.toml"), WIRE.replace("9.5", "9.6")).unwrap();
    let other = call("sweep", &sweep, &at("swept"), &[]);
    assert!(
        other.status.code() == Some(2) && said(&other).contains("rows of another sweep"),
        "{}",
        said(&other)
    );
    // What no run can have is reported before the first.
    std::fs::write(
        &sweep,
        axis.replace("bending_stiffness_nmm2", "radius_mm").replace("[5.0, 20]", "[0.3, 0.4]"),
    )
    .unwrap();
    let refused = call("sweep", &sweep, &at("none"), &[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        said(&refused).contains("outer_diameter_inch = 0.035: radius_mm is given too"),
        "{}",
        said(&refused)
    );
    assert!(!at("none").exists());
}

#[test]
fn a_recording_is_shown_with_what_was_set_in_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let out = folder.path().join("out");
    done(&call(
        "run",
        &file,
        &out,
        &["--set", "vessel.edge_mm=1.5", "--set", "device.part[0].material=tungsten"],
    ));
    let shown = |command: &[&str]| {
        let output = endowire().args(command).output().unwrap();
        assert!(output.status.success(), "{command:?}: {}", said(&output));
        said(&output)
    };
    let render = ["render", text(&out), "--from", "9", "--view", "fluoro"];
    assert!(!shown(&render).contains("has changed since"));
    // Set anew for the picture: of the view, and of the scene.
    let wide =
        shown(&[&render[..], &["--set", "c_arm.sid_mm=900", "--set", "view.c_arm.sod_mm=700"]].concat());
    assert!(!wide.contains("has changed since"), "{wide}");
    for command in [vec!["report", text(&out)], vec!["export", text(&out), "--vtk", text(folder.path())]] {
        shown(&command);
        let wrong = endowire().args(&command).args(["--set", "vessel.edgemm=1"]).output().unwrap();
        assert!(said(&wrong).contains("did you mean `edge_mm`?"), "{}", said(&wrong));
    }
    // The twin: what the run was recorded with is not what the summary says.
    let path = out.join("summary.json");
    let mut summary = document(&path);
    summary["set"][0] = json!("vessel.edge_mm=1.4");
    std::fs::write(&path, summary.to_string()).unwrap();
    assert!(shown(&render).contains("has changed since"));
}

#[test]
fn frames_of_a_scene_and_of_a_dataset_are_of_what_is_set() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let at = |name: &str| folder.path().join(name);
    let frame = |name: &str, set: &[&str]| {
        done(&call("fluoro", &file, &at(name), set));
        bytes(at(name).join("frame_000000_fluoro.png"))
    };
    let plain = frame("plain", &[]);
    let shorter = frame("shorter", &["--set", "script[0].advance_mm=10"]);
    assert!(plain != shorter);
    assert!(frame("steps", &["--steps", "5"]) == shorter, "ten millimetres are five steps");
    assert!(frame("both", &["--set", "script[0].advance_mm=10", "--set", "xray.kvp=60"]) != shorter);
    let spec = at("data.toml");
    let spec_text = "scenes = [\"scene.toml\"]\nposes = 1\nmoments = 1\n[vary]\nprogress = [1.0, 1.0]\n[view]\nsize_px = [32, 32]\nbackend = \"cpu\"\n";
    std::fs::write(&spec, spec_text).unwrap();
    let step = |name: &str, set: &[&str]| {
        let written = reported(&call("dataset", &spec, &at(name), &[&["--json"], set].concat()));
        let images = document(at(name).join("annotations.json"))["images"].clone();
        (images[0]["step"].as_u64(), written["set"].clone())
    };
    assert_eq!(step("data", &[]), (Some(15), Value::Null));
    assert_eq!(
        step("set", &["--set", "script[0].advance_mm=10"]),
        (Some(5), json!(["script[0].advance_mm=10"]))
    );
    let other = call("dataset", &spec, &at("set"), &[]);
    assert!(said(&other).contains("holds another dataset"), "{}", said(&other));
}

#[test]
fn a_session_is_carried_out_again_with_what_was_set() {
    let folder = tempfile::tempdir().unwrap();
    let file = scene(folder.path());
    let at = |name: &str| folder.path().join(name);
    let lines = "{\"do\":\"nudge\",\"mm\":25}\n{\"do\":\"wait\",\"ticks\":60}\n{\"do\":\"quit\"}\n";
    std::fs::write(at("inputs.jsonl"), lines).unwrap();
    let set = ["--set", "vessel.wall.friction=0.3", "--set", "name=other tube"];
    let play =
        ["play", text(&file), "--record", text(&at("played.toml")), "--headless", "--size", "64", "--inputs"]
            .map(str::to_owned);
    let output = endowire().args(&play).arg(at("inputs.jsonl")).args(set).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let answers = String::from_utf8(output.stdout.clone()).unwrap();
    let last: Value = serde_json::from_str(answers.lines().nth(1).unwrap()).unwrap();
    let recorded = std::fs::read_to_string(at("played.toml")).unwrap();
    let reported = " --set 'vessel.wall.friction=0.3' --set 'name=\"other tube\"'";
    assert!(recorded.lines().nth(1).unwrap().ends_with(reported), "{recorded}");
    let script = ["--script", text(&at("played.toml"))].map(str::to_owned);
    let tip = |name: &str, set: &[&str]| {
        let output = endowire()
            .args(["run", text(&file), "--out", text(&at(name))])
            .args(&script)
            .args(set)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", said(&output));
        document(at(name).join("summary.json"))["tip_mm"].clone()
    };
    assert_eq!(tip("again", &set), last["readout"]["tip_mm"]);
    assert_ne!(tip("otherwise", &[]), last["readout"]["tip_mm"], "the twin");
}

#[test]
fn a_seed_that_changes_nothing_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path());
    let sweep = folder.path().join("sweep.toml");
    let said = |key: &str| {
        std::fs::write(&sweep, format!("scene = \"scene.toml\"\n[[axis]]\nkey = {key:?}\nlist = [1, 2]\n"))
            .unwrap();
        let output = call("sweep", &sweep, &folder.path().join(key), &[]);
        assert!(output.status.success(), "{}", said(&output));
        said(&output)
    };
    let reported = said("seed");
    assert!(
        reported.lines().next().unwrap().contains("axis[0].key = seed: nothing in a scene is random"),
        "{reported}"
    );
    assert!(!said("script[0].step_mm").contains("random"));
}
