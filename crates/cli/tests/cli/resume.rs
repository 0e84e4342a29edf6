//! A run that goes on from a saved state, after whatever ended it, leaves the files of a run that nothing has disturbed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use crate::common::{assets, endowire, said, scene_text};
use serde_json::Value;

/// The lines of the script, each of several steps: pushing, turning, pulling back.
const SCRIPT: [&str; 4] = [
    "advance_mm = 120.0\nstep_mm = 4.0",
    "advance_mm = 20.0\nrotate_deg = 90.0\nstep_mm = 1.0",
    "retract_mm = 5.0\nstep_mm = 0.5",
    "advance_mm = 12.0\nstep_mm = 1.0",
];
/// Steps of its first lines.
const STEPS: [usize; 5] = [0, 30, 50, 60, 72];

/// A wire with friction in the curved tube, and the first `lines` lines of the script.
fn scene(folder: &Path, name: &str, lines: usize, views: &str) -> PathBuf {
    scene_of(folder, name, &SCRIPT[..lines], views)
}

/// The same with these lines.
fn scene_of(folder: &Path, name: &str, lines: &[&str], views: &str) -> PathBuf {
    let changes = [
        ("size_px = [640, 640]", "size_px = [24, 16]"),
        ("every = 40", "every = 7"),
        ("[\"3d\", \"fluoro\"]", views),
    ];
    let text = scene_text("curved_tube_friction.toml", &changes);
    let (head, rest) = text.split_once("[[script]]").unwrap();
    let view = &rest[rest.find("[view]").unwrap()..];
    let script: String = lines.iter().map(|line| format!("[[script]]\n{line}\n\n")).collect();
    let path = folder.join(name);
    std::fs::write(&path, format!("{head}{script}{view}")).unwrap();
    path
}

fn command(scene: &Path, out: &Path, more: &[&Path]) -> Command {
    let mut command = endowire();
    command.args(["run".as_ref(), scene, "--out".as_ref(), out]).args(more);
    command
}

fn run(scene: &Path, out: &Path, more: &[&Path]) -> Output {
    command(scene, out, more).output().unwrap()
}

fn done(output: &Output) {
    assert!(output.status.success(), "{}", said(output));
}

/// Everything a run leaves, without what tells of time.
fn files(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for folder in [out.to_path_buf(), out.join("frames")] {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for entry in entries.flatten().filter(|e| e.file_type().unwrap().is_file()) {
            let path = entry.path();
            let mut bytes = std::fs::read(&path).unwrap();
            if path.ends_with("summary.json") {
                let mut summary: Value = serde_json::from_slice(&bytes).unwrap();
                for key in ["wall_time_s", "step_time_s", "scene_file", "scene_hash"] {
                    summary.as_object_mut().unwrap().remove(key);
                }
                bytes = serde_json::to_vec(&summary).unwrap();
            }
            files.insert(path.strip_prefix(out).unwrap().display().to_string(), bytes);
        }
    }
    files
}

fn same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(bytes == &b[name], "{name} differs");
    }
}

#[test]
fn a_run_goes_on_in_the_middle_of_a_line_with_a_condition() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let until = |mm: u32| {
        format!(
            "advance_mm = {mm}.0\nstep_mm = 4.0\nspeed_mm_per_s = 8.0\nuntil = {{ push_force_n = 0.002 }}"
        )
    };
    let (long, short) = (until(256), until(64));
    let back = "retract_mm = 5.0\nstep_mm = 0.5\nspeed_mm_per_s = 8.0";
    let whole = scene_of(folder.path(), "whole.toml", &[&long, back], "[\"3d\"]");
    done(&run(&whole, &at("whole"), &[]));
    let summary: Value = serde_json::from_slice(&std::fs::read(at("whole/summary.json")).unwrap()).unwrap();
    let line = &summary["until"][0];
    assert_eq!((&line["line"], &line["met"]), (&"script[0]".into(), &"push_force_n".into()), "{summary}");
    let steps = line["steps"].as_u64().unwrap();
    assert!((17..64).contains(&steps), "{summary}");
    assert_eq!((summary["steps"].as_u64(), summary["steps_asked"].as_u64()), (Some(steps + 10), Some(74)));
    // One that stops short of the condition, and says so.
    let part = scene_of(folder.path(), "part.toml", &[&short], "[\"3d\"]");
    let (out, state) = (at("out"), at("state"));
    let short = run(&part, &out, &["--save-state".as_ref(), &state]);
    done(&short);
    assert!(said(&short).contains("script[0]: its condition (until) was not met"), "{}", said(&short));
    let rest = at("rest");
    done(&run(&whole, &rest, &["--resume".as_ref(), &state]));
    let rows = |out: &Path| std::fs::read_to_string(out.join("steps.csv")).unwrap();
    let (whole, rest) = (rows(&at("whole")), rows(&rest));
    assert_eq!(rest.lines().skip(1).collect::<Vec<_>>(), whole.lines().skip(1 + 16).collect::<Vec<_>>());
    assert!(
        whole.lines().next().unwrap().ends_with(",time_s") && whole.lines().nth(2).unwrap().ends_with(",1.0")
    );
}

#[test]
fn a_condition_that_has_been_looked_at_stays_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let line = |until: &str| format!("advance_mm = 32.0\nstep_mm = 4.0\n{until}");
    let next = "advance_mm = 8.0\nstep_mm = 4.0";
    let said_of = |name: &str, lines: &[&str]| {
        let path = scene_of(folder.path(), &format!("{name}.toml"), lines, "[]");
        let output = run(&path, &at(name), &["--resume".as_ref(), &at("state")]);
        (output.status.code(), said(&output))
    };
    let first = line("until = { push_force_n = 5.0 }");
    let path = scene_of(folder.path(), "first.toml", &[&first], "[]");
    done(&run(&path, &at("first"), &["--save-state".as_ref(), &at("state")]));
    for (name, other) in [
        ("lower", "until = { push_force_n = 0.001 }"),
        ("higher", "until = { push_force_n = 6.0 }"),
        ("none", ""),
    ] {
        let (code, said) = said_of(name, &[&line(other), next]);
        assert!(
            code == Some(2) && said.contains("the part of the script that was carried out is not"),
            "{said}"
        );
    }
    let later = format!("{next}\nuntil = {{ push_force_n = 5.0 }}");
    assert_eq!(said_of("same", &[&first, &later]).0, Some(0));
    // One where there was none.
    let path = scene_of(folder.path(), "plain.toml", &[&line("")], "[]");
    done(&run(&path, &at("plain"), &["--save-state".as_ref(), &at("state")]));
    assert_eq!(said_of("given", &[&first, next]).0, Some(2));
}

#[test]
fn a_run_goes_on_from_the_end_of_another_as_if_it_had_been_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let whole_scene = scene(folder.path(), "whole.toml", 4, "[\"3d\", \"fluoro\"]");
    done(&run(&whole_scene, &at("whole"), &[]));
    let whole = std::fs::read_to_string(at("whole/steps.csv")).unwrap();
    let summary: Value = serde_json::from_slice(&std::fs::read(at("whole/summary.json")).unwrap()).unwrap();
    assert!(summary["push_force_n"].as_f64().unwrap().abs() > 1e-3, "nothing presses: {summary}");
    for lines in 1..=4 {
        let part = scene(folder.path(), "part.toml", lines, "[\"3d\", \"fluoro\"]");
        let (out, state) = (at(&format!("out{lines}")), at("state"));
        done(&run(&part, &out, &["--save-state".as_ref(), &state]));
        // Into a folder of its own: the steps that are left.
        let rest = at(&format!("rest{lines}"));
        done(&run(&whole_scene, &rest, &["--resume".as_ref(), &state]));
        let table = std::fs::read_to_string(rest.join("steps.csv")).unwrap();
        let left: Vec<&str> = table.lines().skip(1).collect();
        assert_eq!(left, whole.lines().skip(1 + STEPS[lines]).collect::<Vec<_>>(), "{lines} lines");
        // Into the folder of the part, which then is that of the whole.
        done(&run(&whole_scene, &out, &["--resume".as_ref(), &state]));
        same(&at("whole"), &out);
    }
}

#[test]
fn a_state_of_another_scene_or_no_state_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let path = scene(folder.path(), "scene.toml", 2, "[]");
    let state = at("state");
    done(&run(&path, &at("out"), &["--save-state".as_ref(), &state]));
    let kept = files(&at("out"));
    let text = std::fs::read_to_string(&path).unwrap();
    let refused = |text: &str, state: &Path, out: &str| {
        let other = at("other.toml");
        std::fs::write(&other, text).unwrap();
        let output = run(&other, &at(out), &["--resume".as_ref(), state]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert_eq!(said(&output).trim_end().lines().count(), 1, "{}", said(&output));
        said(&output)
    };
    for (from, to, reported) in [
        ("radius_mm = 0.445", "radius_mm = 0.4", "the device is not the same"),
        ("friction = 0.1", "friction = 0.2", "the properties of its wall (vessel.wall) is not"),
        ("position_mm = [0.0, 0.0, 1.0]", "position_mm = [0.0, 0.0, 1.5]", "the sheath is not"),
        ("direction = [0.0, 0.0, 1.0]", "direction = [0.0, 0.0, 1.0]\nfriction_n = 0.2", "the sheath is not"),
        ("element_mm = 2.0", "element_mm = 3.0", "the method or its options is not"),
        (
            "[sheath]",
            "[[vessel.motion]]\nwaveform = \"steady\"\ndisplacement_mm = [0.5, 0.0, 0.0]\n\n[sheath]",
            "how it moves (vessel.motion) is not",
        ),
        (
            "[sheath]",
            "[[field]]\nkind = \"weight\"\nforce_n_per_mm = [0.0, 0.0, 1e-5]\n\n[sheath]",
            "the fields that act on the device (field) is not",
        ),
        ("retract_mm", "advance_mm", "the script"),
        ("advance_mm = 120.0", "advance_mm = 100.0", "step 50, and the script has 45"),
        ("advance_mm = 120.0", "advance_mm = 119.0", "the part of the script that was carried out is not"),
        ("curved_tube.stl", "straight_tube.stl", "the vessel is not the same"),
    ] {
        if text.contains(from) {
            let said = refused(&text.replacen(from, to, 1), &state, "none");
            assert!(said.contains(reported) && said.contains("scene that it was saved in"), "{from}: {said}");
        }
    }
    let two = text.replacen("radius_mm = 0.445", "radius_mm = 0.4", 1).replacen(
        "friction = 0.1",
        "friction = 0.2",
        1,
    );
    let reported = refused(&two, &state, "none");
    assert!(reported.contains("(vessel.wall), the device are not the same"), "{reported}");

    // What is no state, and one that is damaged at any byte.
    let bytes = std::fs::read(&state).unwrap();
    let damaged = at("damaged");
    let newer = [b"endowire state 25", &bytes["endowire state 24".len()..]].concat();
    let mut changed = bytes.clone();
    let middle = changed.len() / 2;
    changed[middle] ^= 1;
    let reported = [
        (text.clone().into_bytes(), "is no saved state"),
        (newer, "its format is \"endowire state 25\""),
        (changed, "is not whole or was changed"),
        (bytes[..bytes.len() - 1].to_vec(), "is not whole"),
        (bytes[..20].to_vec(), "is not whole"),
        (Vec::new(), "is no saved state"),
    ];
    for (content, reported) in reported {
        std::fs::write(&damaged, content).unwrap();
        let said = refused(&text, &damaged, "none");
        assert!(said.contains(reported) && said.contains("--save-state"), "{reported}: {said}");
    }
    assert!(!at("none").exists());

    // A recording that does not hold the step, or another one of as many steps.
    let first = scene(folder.path(), "first.toml", 1, "[]");
    done(&run(&first, &at("short"), &[]));
    assert!(
        refused(&text, &state, "short")
            .contains("step 50, after which the state was saved, is not recorded there")
    );
    std::fs::write(at("less.toml"), text.replacen("advance_mm = 120.0", "advance_mm = 119.0", 1)).unwrap();
    done(&run(&at("less.toml"), &at("less"), &[]));
    assert!(refused(&text, &state, "less").contains("another shape"));
    assert_eq!(files(&at("out")), kept);
}

#[test]
fn a_state_of_another_sac_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let sac = "[vessel.sac]\ndome_mm = [2.0, 6.0, 35.0]\nparent_mm = [2.0, 0.0, 36.0]\n";
    let text = format!(
        "[vessel]\nfile = {:?}\n{sac}[sheath]\nopening = 0\n\
         [[device.section]]\nlength_mm = 50.0\nradius_mm = 0.2\nbending_stiffness_nmm2 = 1.0\n\
         [method]\nelement_mm = 2.0\n[[script]]\nadvance_mm = 4.0\n[view]\nviews = []\n",
        assets().join("vessels/sidewall_aneurysm.stl")
    );
    std::fs::write(at("without.toml"), text.replace(sac, "")).unwrap();
    std::fs::write(at("scene.toml"), text).unwrap();
    let state = at("state");
    done(&run(&at("scene.toml"), &at("out"), &["--save-state".as_ref(), &state]));
    let kept = files(&at("out"));
    // Without a coil nothing is filled, and nothing has no sign.
    let packing = std::fs::read_to_string(at("out/packing.csv")).unwrap();
    assert!(packing.lines().count() == 5 && !packing.contains("-0.0"), "{packing}");
    let other = run(&at("without.toml"), &at("out"), &["--resume".as_ref(), &state]);
    assert_eq!(other.status.code(), Some(2), "{}", said(&other));
    assert!(
        said(&other).contains("the sac that coils fill (vessel.sac) is not the same"),
        "{}",
        said(&other)
    );
    assert_eq!(files(&at("out")), kept);
    // The place in the artery does not matter.
    let set = "vessel.sac.parent_mm=[2.0, 0.5, 30.0]";
    let more: [&Path; 4] = ["--resume".as_ref(), &state, "--set".as_ref(), set.as_ref()];
    done(&run(&at("scene.toml"), &at("out"), &more));
}

#[test]
fn a_state_that_is_not_there_yet_is_begun_from_the_start_by_the_same_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let [part, whole] = [("part.toml", 2), ("whole.toml", 4)].map(|(n, k)| scene(folder.path(), n, k, "[]"));
    done(&run(&whole, &at("whole"), &[]));
    let state = at("state");
    let line: [&Path; 4] = ["--save-state".as_ref(), &state, "--resume".as_ref(), &state];
    // The first call of a job script, and what it says of that; the second goes on and says nothing.
    let first = run(&part, &at("out"), &line);
    done(&first);
    assert!(
        said(&first).contains("state: is not there yet: the run begins from the start"),
        "{}",
        said(&first)
    );
    let second = run(&whole, &at("out"), &line);
    done(&second);
    assert!(!said(&second).contains("not there yet"), "{}", said(&second));
    same(&at("whole"), &at("out"));
}

/// Whole lines of the table of steps.
fn rows(out: &Path) -> usize {
    std::fs::read(out.join("steps.csv")).map_or(0, |text| text.iter().filter(|byte| **byte == b'\n').count())
}

/// Kills runs into one folder at random moments and has each go on where the one before was killed, until one comes to its end.
/// Returns how often one was killed.
fn killed_and_resumed(scene: &Path, out: &Path, state: &Path, mut seed: u64) -> usize {
    let _ = std::fs::remove_dir_all(out);
    let _ = std::fs::remove_file(state);
    let mut random = |below: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % below
    };
    let mut kills = 0;
    loop {
        let resume: [&Path; 4] = ["--save-state".as_ref(), state, "--resume".as_ref(), state];
        let mut child: Child = command(scene, out, &resume).stderr(Stdio::piped()).spawn().unwrap();
        // Some while it reads or goes back, most some steps on, within a step.
        let wanted = rows(out) + random(14) as usize;
        let mut left = 20_000;
        while left > 0 && child.try_wait().unwrap().is_none() && rows(out) < wanted {
            std::thread::sleep(Duration::from_micros(500));
            left -= 1;
        }
        std::thread::sleep(Duration::from_micros(random(6_000)));
        if let Some(status) = child.try_wait().unwrap() {
            let output = child.wait_with_output().unwrap();
            assert!(status.success(), "after {kills} kills: {}", said(&output));
            return kills;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
    }
}

fn kills_leave_no_trace(wanted: usize, views: &str) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let path = scene(folder.path(), "scene.toml", 4, views);
    done(&run(&path, &at("whole"), &[]));
    let mut kills = 0;
    let mut seed = 1;
    while kills < wanted {
        kills += killed_and_resumed(&path, &at("out"), &at("state"), seed);
        same(&at("whole"), &at("out"));
        seed += 1;
    }
    println!("{kills} kills in {} runs", seed - 1);
}

#[test]
fn a_run_that_is_killed_again_and_again_ends_with_the_files_of_one_that_was_not() {
    kills_leave_no_trace(5, "[]");
    kills_leave_no_trace(3, "[\"3d\", \"fluoro\"]");
}

#[test]
#[ignore = "minutes: two hundred kills"]
fn two_hundred_kills_leave_no_trace() {
    kills_leave_no_trace(150, "[]");
    kills_leave_no_trace(50, "[\"3d\", \"fluoro\"]");
}

#[test]
fn a_vessel_that_moves_goes_on_where_it_was_with_its_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let lines = ["advance_mm = 120.0\nstep_mm = 4.0\nspeed_mm_per_s = 40.0", "wait_s = 2.0\nstep_s = 0.1"];
    let moving = |name: &str, lines: &[&str], views: &str| {
        let path = scene_of(folder.path(), name, lines, views);
        let text = std::fs::read_to_string(&path).unwrap();
        let motion = "[[vessel.motion]]\nwaveform = \"breathing\"\nperiod_s = 3.0\ndisplacement_mm = [0.0, 3.0, 8.0]\n\
                      still = { centre_mm = [0.0, 0.0, 0.0], radius_mm = 20.0, fade_mm = 90.0 }\n\n[sheath]";
        std::fs::write(&path, text.replacen("[sheath]", motion, 1)).unwrap();
        path
    };
    let whole = moving("whole.toml", &lines, "[\"3d\", \"fluoro\"]");
    done(&run(&whole, &at("whole"), &[]));
    // One that ends in the middle of the breath, saved and gone on from.
    let part = moving("part.toml", &[lines[0], "wait_s = 1.0\nstep_s = 0.1"], "[\"3d\", \"fluoro\"]");
    let (out, state) = (at("out"), at("state"));
    done(&run(&part, &out, &["--save-state".as_ref(), &state]));
    done(&run(&whole, &out, &["--resume".as_ref(), &state]));
    let rows = |out: &Path| std::fs::read_to_string(out.join("steps.csv")).unwrap();
    assert_eq!(rows(&out), rows(&at("whole")));
    assert_eq!(rows(&out).lines().count(), 1 + 30 + 20);
    let picture = |out: &str, name: &str| std::fs::read(at(out).join("frames").join(name)).unwrap();
    for name in ["step_000042_3d.png", "step_000049_3d.png"] {
        assert_eq!(picture("out", name), picture("whole", name), "{name}");
    }
    // The hand rests between the two, and the vessel does not.
    assert_ne!(picture("whole", "step_000042_3d.png"), picture("whole", "step_000035_3d.png"));
    // A script without times is refused.
    let timeless = moving("timeless.toml", &["advance_mm = 120.0"], "[]");
    let refused = run(&timeless, &at("none"), &[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("vessel.motion = 1 given: no time goes by"), "{}", said(&refused));
}

#[test]
fn what_a_script_injects_is_recorded_drawn_and_goes_on_as_if_nothing_had_been_between() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let lines = |ml: &str| {
        [
            "advance_mm = 40.0\nstep_mm = 4.0\nspeed_mm_per_s = 40.0".to_owned(),
            format!("inject = {{ ml = {ml}, ml_per_s = 4.0 }}"),
            "advance_mm = 16.0\nstep_mm = 1.0\nspeed_mm_per_s = 40.0".to_owned(),
            "advance_mm = 8.0\nstep_mm = 1.0\nspeed_mm_per_s = 40.0\ninject = { ml = 2.0, ml_per_s = 8.0 }"
                .to_owned(),
        ]
    };
    let scene = |name: &str, lines: &[String]| {
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let path = scene_of(folder.path(), name, &lines, "[\"fluoro\"]");
        let text = std::fs::read_to_string(&path).unwrap();
        let tree = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/vessels/curved_tube.csv");
        let flow = format!("[view.flow]\ntree = {tree:?}\n\n[view.xray]");
        std::fs::write(&path, text.replacen("[view.xray]", &flow, 1)).unwrap();
        path
    };
    let all = lines("6.0");
    let whole = scene("whole.toml", &all);
    done(&run(&whole, &at("whole"), &[]));
    let table = |out: &str| std::fs::read_to_string(at(out).join("injections.csv")).unwrap();
    let rows = table("whole");
    let rows: Vec<Vec<&str>> = rows.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..6].join(","), "after_step,time_s,instrument,volume_ml,rate_ml_per_s,inserted_mm");
    assert_eq!((rows[2][0], rows[2][3], rows[2][4], rows.len()), ("26", "2.0", "8.0", 3));
    let steps = std::fs::read_to_string(at("whole/steps.csv")).unwrap();
    assert_eq!(rows[1][..6], ["10", &end_s(&steps, 10), "device", "6.0", "4.0", "40.0"]);
    let tips = |step: usize| steps.lines().nth(step).unwrap().split(',').skip(8).take(3).collect::<Vec<_>>();
    assert_eq!(
        (&rows[1][6..9], &rows[2][6..9]),
        (&tips(10)[..], &tips(26)[..]),
        "from the tip as it was then"
    );
    // What holds that tip.
    let at_tip =
        steps.lines().next().unwrap().split(',').position(|name| name == "wall_force_tip_n").unwrap();
    let force = |step: usize| steps.lines().nth(step).unwrap().split(',').nth(at_tip).unwrap();
    assert_eq!((rows[0][9], rows[1][9], rows[2][9]), ("tip_force_n", force(10), force(26)));
    // Medium is in the frames from then on: a run without has the same before, and another after.
    let dry = scene("dry.toml", &[all[0].clone(), all[2].clone(), all[2].replace("16.0", "8.0")]);
    done(&run(&dry, &at("dry"), &[]));
    assert!(!at("dry/injections.csv").exists());
    let frame = |out: &str, step: usize| {
        std::fs::read(at(out).join(format!("frames/step_{step:06}_fluoro.png"))).unwrap()
    };
    assert_eq!(frame("whole", 7), frame("dry", 7));
    assert_ne!(frame("whole", 21), frame("dry", 21));
    // Saved before, within and behind what is injected.
    for count in 1..=3 {
        let part = scene("part.toml", &all[..count]);
        let (out, branch, state) = (format!("out{count}"), format!("branch{count}"), at("state"));
        done(&run(&part, &at(&out), &["--save-state".as_ref(), &state]));
        done(&run(&whole, &at(&branch), &["--resume".as_ref(), &state]));
        assert_eq!(table(&branch), table("whole"), "a branch knows what flows already");
        done(&run(&whole, &at(&out), &["--resume".as_ref(), &state]));
        same(&at("whole"), &at(&out));
    }
    // The twin: of another volume the state knows nothing.
    let other = run(&scene("other.toml", &lines("7.0")), &at("other"), &["--resume".as_ref(), &at("state")]);
    assert_eq!(other.status.code(), Some(2), "{}", said(&other));
    assert!(said(&other).contains("the part of the script that was carried out is not"), "{}", said(&other));
    // Rendered afterwards, and without a recording, it is there as well.
    let medium_mm = |words: &[&str], of: &Path, name: &str| {
        let mut command = endowire();
        command.arg(words[0]).arg(of).args(&words[1..]).args(["--set", "xray.contrast_fraction=0"]);
        done(&command.args(["--view", "fluoro", "--raw", "--out"]).arg(at(name)).output().unwrap());
        let mut files = std::fs::read_dir(at(name)).unwrap().flatten().map(|e| e.path());
        let map = files.find(|path| path.to_string_lossy().ends_with("_contrast_mm.npy"))?;
        let bytes = std::fs::read(map).unwrap();
        let floats = bytes[bytes.len() % 4..].chunks_exact(4).rev().take(24 * 16);
        Some(floats.map(|b| f32::from_le_bytes(b.try_into().unwrap())).sum::<f32>())
    };
    let render = ["render", "--from", "21", "--to", "21"];
    let rendered = medium_mm(&render, &at("whole"), "rendered").unwrap();
    assert!(rendered > 1.0, "{rendered}");
    assert_eq!(medium_mm(&render, &at("dry"), "rendered_dry"), None, "the twin");
    let time = end_s(&steps, 21);
    let fluoro = ["fluoro", "--steps", "21", "--time", &time];
    let drawn = medium_mm(&fluoro, &whole, "fluoro").unwrap();
    // What is still to be injected makes the steps of the flow shorter.
    assert!((drawn / rendered - 1.0).abs() < 1e-3, "{drawn} {rendered}");
}

/// When a step of the table ended.
fn end_s(steps: &str, step: usize) -> String {
    steps.lines().nth(step).unwrap().rsplit(',').next().unwrap().to_owned()
}
