//! `endowire subject`, and subjects that are played and assessed: what is shipped can be done, and what is done badly does not pass.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::common::{assets, document, endowire, reported, said, scene, text, workspace};

/// The program where it finds subjects by their names.
fn in_workspace() -> Command {
    let mut command = endowire();
    command.current_dir(workspace());
    command
}

fn subject_file(name: &str) -> PathBuf {
    assets().join("subjects").join(format!("{name}.toml"))
}

/// Does a subject by its reference; its score and its session.
fn done(name: &str, folder: &Path) -> (Value, PathBuf) {
    let out = folder.join(name);
    let score = reported(
        &in_workspace().args(["subject", "run", name, "--json", "--out", text(&out)]).output().unwrap(),
    );
    (score, out.join("played.session.json"))
}

fn metric<'a>(score: &'a Value, name: &str) -> &'a Value {
    score["metrics"].as_array().unwrap().iter().find(|metric| metric["name"] == name).unwrap()
}

/// Plays a subject without a window; its answers and its score.
fn played(name: &str, folder: &Path, lines: &[Value]) -> (Vec<Value>, Value) {
    let record = folder.join("played.toml");
    let mut command = in_workspace();
    command.args(["play", name, "--headless", "--size", "64", "--record", text(&record)]);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let lines: String = lines.iter().map(|line| format!("{line}\n")).collect();
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let answers = String::from_utf8(output.stdout.clone()).unwrap();
    let answers = answers.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let verdict = said(&output);
    assert!(verdict.contains("level 1") && verdict.contains(&format!("{name}: ")), "{verdict}");
    (answers, document(folder.join("played.score.json")))
}

#[test]
fn every_subject_can_be_done_by_its_reference() {
    let folder = tempfile::tempdir().unwrap();
    let listed = reported(&in_workspace().args(["subject", "list", "--json"]).output().unwrap());
    let subjects = listed["subjects"].as_array().unwrap();
    assert!(subjects.len() >= 8);
    for level in 1..=4 {
        assert!(subjects.iter().filter(|subject| subject["level"] == level).count() >= 2, "level {level}");
    }
    for subject in subjects {
        let name = subject["subject"].as_str().unwrap();
        let (score, session) = done(name, folder.path());
        assert_eq!(
            (&score["passed"], &score["band"], &score["schema"]),
            (&json!(true), &json!("passed"), &json!(2))
        );
        assert!(score["score"].as_f64().unwrap() >= 90.0, "{score}");
        assert_eq!((&score["subject"], &score["ended"]["by"]), (&json!(name), &json!("goal")));
        // The session says the same to those who assess it later.
        let again = in_workspace().args(["assess", text(&session), "--subject", name, "--json"]).output();
        let again = reported(&again.unwrap());
        for key in ["schema", "subject", "exam", "passed", "score", "band", "ended", "metrics"] {
            assert_eq!(again[key], score[key], "{name}: {key}");
        }
        for key in ["name", "group", "value", "unit", "better", "threshold", "credit", "passed"] {
            assert!(score["metrics"][0].get(key).is_some(), "{key}");
        }
    }
}

#[test]
fn what_a_reference_has_done_is_run_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let (score, session) = done("curved_tube", folder.path());
    let session = document(session);
    let last = session["record"]["samples"].as_array().unwrap().last().unwrap().clone();
    let script = folder.path().join("curved_tube/played.toml");
    let run = |script: &Path| {
        let out = folder.path().join("again");
        let mut command = endowire();
        command.arg("run").arg(scene("curved_tube_friction.toml")).arg("--script").arg(script);
        reported(&command.args(["--json", "--out", text(&out)]).output().unwrap())
    };
    assert_eq!(run(&script)["tip_mm"], last["tip_mm"]);
    // A script that is another is seen.
    let other = folder.path().join("other.toml");
    std::fs::write(&other, "[[script]]\nadvance_mm = 100.0\n").unwrap();
    assert_ne!(run(&other)["tip_mm"], last["tip_mm"]);
    // And once more.
    let second = tempfile::tempdir().unwrap();
    assert_eq!(done("curved_tube", second.path()).0["metrics"], score["metrics"]);
}

#[test]
fn a_hand_is_reported_how_it_stands_and_is_scored_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let (answers, score) = played(
        "straight_tube",
        folder.path(),
        &[
            json!({"do": "read"}),
            json!({"do": "script"}),
            json!({"do": "pedal", "down": true}),
            json!({"do": "move", "mm_per_s": 10}),
            json!({"do": "wait", "ticks": 300}),
            json!({"do": "wait", "ticks": 360}),
        ],
    );
    let standing = |k: usize| &answers[k]["readout"]["subject"];
    assert_eq!(
        (&standing(0)["subject"], &standing(0)["distance_mm"]),
        (&json!("straight_tube"), &Value::Null)
    );
    assert_eq!(answers[1]["ok"], json!(false), "the script is not shown unless that was asked for");
    let to_go_mm = standing(4)["distance_mm"].as_f64().unwrap();
    assert!((40.0..60.0).contains(&to_go_mm), "{to_go_mm}");
    assert_eq!(standing(4)["used"][0]["limit"], json!(300.0));
    assert!(standing(4)["verdict"].is_null());
    assert_eq!(standing(5)["verdict"]["passed"], json!(true));
    assert_eq!(answers[5]["readout"]["event"]["kind"], json!("ended"));
    // The hand was made to rest once the tip was there.
    assert!(standing(5)["distance_mm"].as_f64().unwrap() > 7.0);
    assert_eq!((&score["passed"], &score["score"]), (&json!(true), &json!(100.0)));
}

#[test]
fn a_hand_that_goes_to_and_fro_unseen_arrives_and_does_not_pass() {
    let folder = tempfile::tempdir().unwrap();
    let push = |mm_per_s: i32| json!({"do": "move", "mm_per_s": mm_per_s});
    let wait = |ticks: u32| json!({"do": "wait", "ticks": ticks});
    let lines = [push(20), wait(120), push(-20), wait(60), push(20), wait(300)];
    let (_, score) = played("straight_tube", folder.path(), &lines);
    assert_eq!((&score["ended"]["by"], &score["passed"]), (&json!("goal"), &json!(false)));
    let passed = |name: &str| metric(&score, name)["passed"].as_bool();
    assert_eq!((passed("reversals"), passed("unseen_share")), (Some(false), Some(false)));
    assert_eq!((passed("total_s"), passed("wall_force_n"), passed("turns")), (Some(true), Some(true), None));
    let points = score["score"].as_f64().unwrap();
    assert!(score["band"] == "blind" && (5.0..10.0).contains(&points), "{points}");
}

/// A shipped subject with changes, in a file of its own; its score, and what was said, where it does not pass.
fn failed(name: &str, folder: &Path, changes: &[(&str, &str)]) -> (Value, String) {
    let file = folder.join(format!("{name}.toml"));
    let shipped = std::fs::read_to_string(subject_file(name)).unwrap();
    let own =
        [("\"../scenes", assets().join("scenes")), ("\"references", assets().join("subjects/references"))];
    let shipped =
        own.iter().fold(shipped, |shipped, (from, to)| shipped.replace(from, &format!("\"{}", to.display())));
    let changed = changes.iter().fold(shipped, |changed, (piece, other)| {
        assert!(changed.contains(piece), "{piece}");
        changed.replace(piece, other)
    });
    std::fs::write(&file, changed).unwrap();
    let out = folder.join("out");
    let args = ["subject", "run", text(&file), "--json", "--out", text(&out)];
    let output = endowire().args(args).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let score: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(score["passed"], json!(false));
    (score, said(&output))
}

#[test]
fn a_reference_that_misses_a_threshold_fails() {
    let folder = tempfile::tempdir().unwrap();
    let (score, said) = failed("curved_tube", folder.path(), &[("at_most = 0.02", "at_most = 0.001")]);
    assert_eq!((&score["ended"]["by"], &score["band"]), (&json!("goal"), &json!("missed")));
    assert_eq!(metric(&score, "hand_force_n")["passed"], json!(false));
    assert!(said.contains("curved_tube.toml: the reference script does not pass"), "{said}");
}

#[test]
fn a_folder_of_a_run_says_what_of_a_subject_it_cannot_tell() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut run = in_workspace();
    run.args([
        "run",
        "assets/scenes/curved_tube_exact.toml",
        "--script",
        "assets/subjects/references/straight_tube.toml",
    ]);
    // As the subject sets them.
    run.args(["--set", "vessel.file=../vessels/straight_tube.stl", "--set", "name=straight_tube"]);
    reported(&run.args(["--json", "--out", text(&out)]).output().unwrap());
    let assess = |args: &[&str]| {
        in_workspace().args(["assess", text(&out), "--subject", "straight_tube"]).args(args).output().unwrap()
    };
    let score = reported(&assess(&["--json"]));
    assert_eq!((&score["ended"]["by"], &score["passed"]), (&json!("goal"), &json!(false)));
    // Time, force and the way are there, and judged; of the beam nothing is.
    for name in ["total_s", "reversals", "wall_force_n"] {
        let judged = metric(&score, name);
        assert!(judged["passed"] == json!(true) && judged.get("unjudged").is_none(), "{judged}");
    }
    let beam = metric(&score, "unseen_share");
    assert!(
        beam["passed"].is_null() && beam["unjudged"].as_str().unwrap().contains("no beam was recorded"),
        "{beam}"
    );
    let unjudged: Vec<&str> =
        score["unjudged"].as_array().unwrap().iter().map(|one| one["what"].as_str().unwrap()).collect();
    assert_eq!(unjudged, ["beam_on_idle_s", "moving_in_acquisition_s", "unseen_share", "limits.beam_s"]);
    assert_eq!(score["band"], json!("missed"));
    let words = String::from_utf8(assess(&[]).stdout).unwrap();
    assert!(words.contains("unseen_share, limits.beam_s: no beam was recorded"), "{words}");
    // With the log of the beam beside the steps all is judged.
    let log = "time_s,on,frames_per_s,dose_ngy,field_mm2,primary_deg,secondary_deg,mode\n0,true,7.5,30,40000,0,0,fluoro\n";
    std::fs::write(out.join("beam.csv"), log).unwrap();
    let score = reported(&assess(&["--json"]));
    assert_eq!((&score["passed"], &score["score"]), (&json!(true), &json!(100.0)));
    assert!(score.get("unjudged").is_none());
}

#[test]
fn a_session_that_was_changed_is_found_when_it_is_carried_out_again() {
    let folder = tempfile::tempdir().unwrap();
    let lines = [
        json!({"do": "pedal", "down": true}),
        json!({"do": "move", "mm_per_s": 10}),
        json!({"do": "wait", "ticks": 620}),
    ];
    let (_, score) = played("straight_tube", folder.path(), &lines);
    let path = folder.path().join("played.session.json");
    let verify = || {
        let args = ["assess", text(&path), "--subject", "straight_tube", "--verify", "--json"];
        in_workspace().args(args).output().unwrap()
    };
    let verified = reported(&verify());
    assert_eq!((&verified["verified"], &verified["score"]), (&json!(true), &score["score"]));
    assert_eq!(verified["metrics"], score["metrics"]);
    let session = document(&path);
    let changed = |change: &dyn Fn(&mut Value), what: &str| {
        let mut other = session.clone();
        change(&mut other);
        std::fs::write(&path, other.to_string()).unwrap();
        let output = verify();
        assert!(output.status.code() == Some(2) && said(&output).contains(what), "{}", said(&output));
    };
    let sample = |session: &mut Value, key: &str, value: Value| session["record"]["samples"][7][key] = value;
    changed(&|session| sample(session, "wall_force_n", json!(0.0001)), "record.samples[7], at 0.13 s,");
    changed(&|session| session["record"]["beam"][0]["on"] = json!(false), "record.beam is not what");
    changed(&|session| session["inputs"]["inputs"][1][1]["mm_per_s"] = json!(9.0), "record.samples[0]");
    changed(&|session| session["schema"] = json!(99), "schema = 99");
    changed(&|session| drop(session.as_object_mut().unwrap().remove("inputs")), "does not have the inputs");
}

#[test]
fn who_pushes_on_in_a_wrong_branch_is_stopped() {
    let folder = tempfile::tempdir().unwrap();
    // A third of the turn that leads up to the liver.
    let pushes = "[[script]]\nrotate_deg = 270.0\n\n[[script]]\nadvance_mm = 116.0\nstep_mm = 1.0\n\n\
                  [[script]]\nrotate_deg = 120.0\n\n[[script]]\nadvance_mm = 200.0\nstep_mm = 1.0\n";
    let reference = folder.path().join("pushes.toml");
    std::fs::write(&reference, pushes).unwrap();
    let shipped = assets().join("subjects/references/right_hepatic.toml");
    let (score, _) = failed("right_hepatic", folder.path(), &[(text(&shipped), text(&reference))]);
    assert_eq!((&score["ended"]["by"], &score["band"]), (&json!("wall_force"), &json!("not_reached")));
    // Part of the way, of what a grave fault leaves.
    assert!((5.0..20.0).contains(&score["score"].as_f64().unwrap()), "{}", score["score"]);
    assert_eq!(metric(&score, "wall_force_n")["passed"], json!(false));
}

/// A subject in a shipped scene, in a file of its own.
fn own_subject(folder: &Path, text: &str) -> PathBuf {
    let file = folder.join("own.toml");
    let scenes = assets().join("scenes").display().to_string();
    let head = "name = \"a\"\nlevel = 1\ntext = \"b\"\n";
    std::fs::write(&file, format!("{head}{}", text.replace("SCENES", &scenes))).unwrap();
    file
}

#[test]
fn medium_counts_at_the_tip_that_it_leaves_and_once_it_has_flowed() {
    let folder = tempfile::tempdir().unwrap();
    // The wire is at the target, and its catheter behind it in the aorta.
    let reference = folder.path().join("ahead.toml");
    let script = "[[script]]\ninstrument = \"wire\"\nadvance_mm = 60.0\nstep_mm = 2.0\n\
        with = [{ instrument = \"catheter\", advance_mm = 60.0, step_mm = 2.0 }]\n\
        [[script]]\ninstrument = \"wire\"\nadvance_mm = 180.0\nstep_mm = 2.0\n\
        until = { tip_within_mm = 10, target = \"left subclavian\" }\n\
        [[script]]\ninject = { ml = 6, ml_per_s = 6, through = \"catheter\" }\n";
    let subject = |inject: &str| {
        own_subject(
            folder.path(),
            &format!(
                "scene = \"SCENES/arch_vertebral.toml\"\n\
                 set = [\"vessel.centreline=../vessels/aortic_arch.csv\"]\nreference = \"ahead.toml\"\n\
                 [goal]\ntarget = \"left subclavian\"\ntip_within_mm = 12.0\n{inject}"
            ),
        )
    };
    let run = |subject: &Path| {
        let out = folder.path().join("out");
        endowire().args(["subject", "run", text(subject), "--json", "--out", text(&out)]).output().unwrap()
    };
    std::fs::write(&reference, script).unwrap();
    assert!(run(&subject("")).status.success(), "the twin: the wire is there");
    let output = run(&subject("inject_ml = 5.0\n"));
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let score: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&score["passed"], &score["ended"]), (&json!(false), &Value::Null));
    // The medium was waited for, though the script ends with it.
    assert!((metric(&score, "contrast_ml")["value"].as_f64().unwrap() - 6.0).abs() < 1e-6, "{score}");
}

#[test]
fn what_does_not_fit_its_scene_is_refused_when_it_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let carotid = "scene = \"SCENES/arch_carotid.toml\"\n";
    let goal = "[goal]\ntarget = \"left carotid\"\ntip_within_mm = 10.0\n";
    std::fs::write(folder.path().join("far.toml"), "[[script]]\nadvance_mm = 10000.0\n").unwrap();
    for (content, reported) in [
        (format!("{carotid}{}", goal.replace("left carotid", "left carotis")), "goal.target"),
        (format!("{carotid}{goal}instrument = \"catheter\"\n"), "goal.instrument"),
        (format!("{carotid}set = [\"vessel.wall.frictoin=0.1\"]\n{goal}"), "frictoin"),
        (format!("{carotid}{goal}inject_ml = 5.0\n"), "goal.inject_ml = 5: no instrument has a lumen"),
        (
            format!("{carotid}set = [\"vessel.wall.friction=9\"]\n{goal}"),
            "own.toml: SCENES/arch_carotid.toml: vessel.wall.friction = 9: must be",
        ),
        (
            format!("{carotid}reference = \"SCENES/arch_carotid.toml\"\n{goal}"),
            "own.toml: SCENES/arch_carotid.toml: ",
        ),
        (
            format!("{carotid}reference = \"far.toml\"\n{goal}"),
            "far.toml: script[0].advance_mm = 10000: in its step",
        ),
        (
            format!("{carotid}{goal}[[threshold]]\nmetric = \"packing_density\"\nat_least = 0.2\n"),
            "threshold[0].metric = \"packing_density\": there is no sac",
        ),
    ] {
        let file = own_subject(folder.path(), &content);
        let output = endowire().args(["subject", "show", text(&file)]).output().unwrap();
        let reported = reported.replace("SCENES", &assets().join("scenes").display().to_string());
        assert!(
            output.status.code() == Some(2) && said(&output).contains(&reported),
            "{reported}: {}",
            said(&output)
        );
    }
    std::fs::write(folder.path().join("far.toml"), "[[script]]\nadvance_mm = 10.0\n").unwrap();
    let file = own_subject(folder.path(), &format!("{carotid}reference = \"far.toml\"\n{goal}"));
    assert!(endowire().args(["subject", "show", text(&file)]).output().unwrap().status.success(), "the twin");
    // One that cannot be read leaves the others in the list.
    std::fs::write(folder.path().join("bad.toml"), "level = 9\n").unwrap();
    let output = endowire().args(["subject", "list", text(folder.path())]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stdout).contains("own"), "{output:?}");
    assert!(said(&output).contains("bad.toml: "), "{}", said(&output));
}

#[test]
fn what_is_no_subject_or_does_not_belong_to_it_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = folder.path().join("wrong.toml");
    let shipped = std::fs::read_to_string(subject_file("curved_tube")).unwrap();
    std::fs::write(&wrong, shipped.replace("\"hand_force_n\"", "\"hand_force\"")).unwrap();
    let (_, session) = done("curved_tube", folder.path());
    let session = text(&session);
    let wrong = text(&wrong);
    for (args, named) in [
        (
            vec!["subject", "show", "inominate"],
            "inominate: is no file and no subject of assets/subjects; did you mean innominate?",
        ),
        (vec!["play", "inominate", "--headless"], "did you mean innominate?"),
        (vec!["subject", "list", "assets/nothing"], "assets/nothing"),
        (
            vec!["subject", "show", wrong],
            "wrong.toml: threshold[1].metric = \"hand_force\": is no measure; did you mean \"hand_force_n\"",
        ),
        (vec!["play", wrong, "--headless"], "wrong.toml: threshold[1].metric"),
        (
            vec!["play", "innominate", "--headless", "--set", "seed=2"],
            "--set seed=2: a subject is the same for all",
        ),
        (
            vec!["assess", session, "--subject", "innominate"],
            "was recorded in assets/subjects/../scenes/curved_tube_friction.toml, and the subject is in",
        ),
        (vec!["assess", session, "--subject", "curved_tube", "--target", "opening 0"], "--subject"),
    ] {
        let output = in_workspace().args(&args).stdin(Stdio::null()).output().unwrap();
        assert!(
            output.status.code() == Some(2) && said(&output).contains(named),
            "{args:?}: {}",
            said(&output)
        );
    }
    let shown = in_workspace().args(["subject", "show", "innominate"]).output().unwrap();
    let shown = String::from_utf8(shown.stdout).unwrap();
    assert!(shown.contains("tip within 10 mm of innominate") && shown.contains("level 2"), "{shown}");
}

#[test]
fn a_session_in_which_nothing_was_done_has_no_score() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("played.toml");
    let mut command = in_workspace();
    command.args(["play", "vertebral_catheter", "--headless", "--size", "64", "--record", text(&record)]);
    let output = command.stdin(Stdio::null()).output().unwrap();
    let said = said(&output);
    let reported = "vertebral_catheter: nothing was done: there is no score";
    assert!(output.status.success() && said.contains(reported) && !said.contains("of 100"), "{said}");
    assert!(folder.path().join("played.session.json").exists());
    assert!(!folder.path().join("played.score.json").exists());
}
