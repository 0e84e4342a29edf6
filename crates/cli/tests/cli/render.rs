//! Frames of a recorded run and of a scene, as a user gets them.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{SHORT, document, reported, said, scene_text, text};
use npyz::NpyFile;

fn endowire(args: &[&str]) -> Output {
    crate::common::endowire().args(args).output().unwrap()
}

/// A short run in the curved tube, recorded without frames.
fn recorded(folder: &Path) -> (PathBuf, PathBuf) {
    let scene = scene_text("curved_tube.toml", &SHORT).replace("[\"3d\", \"fluoro\"]", "[]");
    let path = folder.join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    let run = folder.join("run");
    assert!(endowire(&["run", text(&path), "--out", text(&run)]).status.success());
    (path, run)
}

fn png_size(path: &Path) -> (u32, u32) {
    let reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
    (reader.info().width, reader.info().height)
}

#[test]
fn a_recorded_run_is_drawn_from_any_angle_with_all_that_belongs_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let (_, run) = recorded(folder.path());
    let [out, animation, dicom] = ["out", "turn.png", "run.dcm"].map(|name| folder.path().join(name));
    let output = endowire(&[
        "render",
        text(&run),
        "--from",
        "40",
        "--every",
        "40",
        "--pose",
        "RAO 30 CAU 20",
        "--view",
        "both",
        "--set",
        "c_arm.sid_mm=1000",
        "--labels",
        "--raw",
        "--orbit",
        "30",
        "--animate",
        text(&animation),
        "--dicom",
        text(&dicom),
        "--out",
        text(&out),
        "--json",
    ]);
    let written = reported(&output);
    let files: Vec<&str> = written["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    // Steps 40 and 80, and the last one.
    for step in ["step_000040", "step_000080", "step_000106"] {
        for rest in [
            "3d.png",
            "fluoro.png",
            "both.png",
            "mask.png",
            "labels.json",
            "line_integral.npy",
            "lumen_mm.npy",
        ] {
            let name = format!("{step}_{rest}");
            assert!(files.contains(&name.as_str()) && out.join(&name).exists(), "{name}");
        }
    }
    assert_eq!(png_size(&out.join("step_000040_both.png")), (192, 64));
    let mut animated =
        png::Decoder::new(BufReader::new(File::open(&animation).unwrap())).read_info().unwrap();
    assert_eq!(animated.info().animation_control.unwrap().num_frames, 3);
    let mut data = vec![0; animated.output_buffer_size().unwrap()];
    // A frame a step, 15 a second: 40 steps to the second, and 26 to the last.
    for delay in [2667, 1733, 2200] {
        animated.next_frame(&mut data).unwrap();
        assert_eq!(animated.info().frame_control.unwrap().delay_num, delay);
    }

    // The tip of the labels is the recorded one, seen by a pinhole at 1000 mm; the device attenuates there.
    let labels = document(out.join("step_000106_labels.json"));
    let tip: Vec<f64> =
        labels["devices"][0]["tip_px"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(labels["devices"][0]["tip_visible"].as_bool().unwrap(), "{tip:?}");
    let map = |name: &str| {
        let file = NpyFile::new(BufReader::new(File::open(out.join(name)).unwrap())).unwrap();
        assert_eq!(file.shape(), [64, 96]);
        file.into_vec::<f32>().unwrap()
    };
    let steel = map("step_000106_steel_316l_mm.npy");
    let near = (0..steel.len())
        .filter(|&i| steel[i] > 0.0)
        .map(|i| (((i % 96) as f64 + 0.5 - tip[0]).powi(2) + ((i / 96) as f64 + 0.5 - tip[1]).powi(2)).sqrt())
        .fold(f64::MAX, f64::min);
    assert!(near < 2.0, "{near}");
    let line = map("step_000106_line_integral.npy");
    assert!(line.iter().all(|p| p.is_finite() && *p > 0.5));
    let bytes = std::fs::read(&dicom).unwrap();
    assert_eq!(&bytes[128..132], b"DICM");
    let increments = b"0\\2666.667\\1733.333";
    assert!(bytes.windows(increments.len()).any(|window| window == increments));
}

#[test]
fn a_scene_is_drawn_without_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, _) = recorded(folder.path());
    let out = folder.path().join("out");
    let draw = |more: &[&str]| {
        let mut args = vec!["fluoro", text(&scene), "--out", text(&out), "--json", "--size", "48x32"];
        args.extend(more);
        reported(&endowire(&args))
    };
    assert_eq!(draw(&["--steps", "0"])["files"].as_array().unwrap().len(), 1);
    let bare = std::fs::read(out.join("frame_000000_fluoro.png")).unwrap();
    assert_eq!(png_size(&out.join("frame_000000_fluoro.png")), (48, 32));
    assert_eq!(draw(&["--count", "2", "--bits", "16", "--hold"])["files"].as_array().unwrap().len(), 3);
    assert_eq!(png_size(&out.join("hold.png")), (48, 32));
    assert_ne!(std::fs::read(out.join("frame_000000_fluoro.png")).unwrap(), bare);
}

#[test]
fn drawing_anew_replaces_what_was_drawn_before_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let (_, run) = recorded(folder.path());
    let draw = |more: &[&str]| {
        let output = endowire(&[&["render", text(&run), "--view", "3d", "--every", "40"], more].concat());
        assert!(output.status.success(), "{}", said(&output));
        said(&output)
    };
    let said = draw(&["--from", "26", "--size", "48x32"]);
    assert!(!said.contains("replaces"), "{said}");
    let frames = run.join("render");
    assert_eq!(png_size(&frames.join("step_000066_3d.png")), (48, 32));
    std::fs::write(frames.join("step_000099_3d.png"), "mine").unwrap();
    let said = draw(&["--from", "30", "--size", "24x16"]);
    assert!(said.contains("replaces 3 files of an earlier endowire render"), "{said}");
    let mut names: Vec<String> = std::fs::read_dir(&frames)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.starts_with('.'))
        .collect();
    names.sort();
    let ours = ["step_000030_3d.png", "step_000070_3d.png", "step_000099_3d.png", "step_000106_3d.png"];
    assert_eq!(names, ours);
    assert_eq!(png_size(&frames.join("step_000070_3d.png")), (24, 16));
}

#[test]
fn what_cannot_be_drawn_is_refused_by_key_value_and_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, run) = recorded(folder.path());
    let nothing = folder.path().join("nothing");
    let far = folder.path().join("no/such/folder/labels.png");
    let labels = folder.path().join("labels");
    std::fs::create_dir_all(labels.join("frame_000000_labels.json")).unwrap();
    let nan = folder.path().join("nan.toml");
    let pose = std::fs::read_to_string(&scene).unwrap().replace("[view]", "[view]\nc_arm.primary_deg = nan");
    std::fs::write(&nan, pose).unwrap();
    let still = |more: &[&'static str]| [&["fluoro", text(&scene), "--steps", "0"], more].concat();
    // Each message names key, value and remedy.
    let cases: [(Vec<&str>, &[&str]); 29] = [
        (vec!["render", text(&nothing)], &["nothing", "recorded run"]),
        (vec!["render", text(&run), "--pose", "north 3"], &["north 3", "say angles as in \"LAO 40\""]),
        (
            vec!["render", text(&run), "--set", "c_arm.sid_mm=0"],
            &["view.c_arm.sid_mm = 0: must be a number from 10 to 100000"],
        ),
        (
            vec!["render", text(&run), "--set", "c_arm.nothing=0"],
            &["c_arm.nothing=0", "expected one of", "sid_mm"],
        ),
        (vec!["render", text(&run), "--from", "900"], &["--from 900", "steps 1 to 106"]),
        (
            vec!["render", text(&run), "--from", "5", "--to", "2"],
            &["--from 5 --to 2: the last step to draw comes before the first"],
        ),
        (vec!["render", text(&run), "--every", "0"], &["--every 0: must be 1 or more"]),
        (vec!["render", text(&run), "--view", "3d", "--labels"], &["--labels", "use --view fluoro"]),
        (vec!["render", text(&run), "--view", "fluoro", "--animate", text(&far)], &["no/such/folder"]),
        (
            still(&["--set", "c_arm.primary_deg=nan"]),
            &["view.c_arm.primary_deg = nan: must be a finite number"],
        ),
        (
            vec!["fluoro", text(&nan), "--steps", "0"],
            &["view.c_arm.primary_deg = NaN: must be a number from"],
        ),
        (still(&["--count", "0"]), &["--count 0: draw 1 to 100000 frames"]),
        (still(&["--count", "100001"]), &["--count 100001: draw 1 to 100000 frames"]),
        (still(&["--time", "-1"]), &["--time -1: must be from 0 to 1000000 s"]),
        (still(&["--time", "nan"]), &["--time NaN: must be from 0"]),
        (still(&["--time", "1e30"]), &["--time 1e30: must be from 0"]),
        (still(&["--turn", "20", "--deg-per-s", "-1"]), &["--deg-per-s -1"]),
        (still(&["--set", "c_arm.sid_mm=0"]), &["view.c_arm.sid_mm = 0: must be a number from 10 to 100000"]),
        (
            still(&["--set", "patient.ct={\"file\":\"none.nii\"}"]),
            &["view.patient.ct.file = ", "none.nii", "No such file"],
        ),
        (
            still(&["--set", "c_arm.collimation_mm=[0.1, 20]"]),
            &["view.c_arm.collimation_mm = [0.1, 20]: leaves ", " pixels open at the detector"],
        ),
        (still(&["--size", "5000"]), &["view.size_px = [5000, 5000]: each side must be 1 to 4096 pixels"]),
        (
            [&still(&["--labels", "--out"])[..], &[text(&nan)]].concat(),
            &["--out", "nan.toml", "name a folder that can be made"],
        ),
        (
            [&still(&["--labels", "--out"])[..], &[text(&labels)]].concat(),
            &["cannot write", "frame_000000_labels.json", "is there already"],
        ),
        // Pixels, kernels and volumes of numbers that nobody means: reported before anything is computed.
        (
            still(&["--set", "c_arm.field_mm=1e-308"]),
            &["view.c_arm.field_mm = 1e-308: must be a number from 0.01 to 100000"],
        ),
        (
            still(&["--set", "c_arm.field_mm=0.01", "--size", "4096"]),
            &["view.c_arm.field_mm = 0.01: with 4096 pixels", "must be 0.0001 to 1000 mm"],
        ),
        (
            still(&["--set", "c_arm.pixel_mm=0.001"]),
            &["view.detector.blur_mm = 0.15: is 150 pixels", "give at most 0.05 mm"],
        ),
        (still(&["--orbit", "1e300", "--view", "both"]), &["--orbit 1", "give -36000 to 36000 degrees"]),
        (still(&["--set", "detector.seed=-1"]), &["detector.seed=-1", "a whole number, 0 or more"]),
        (still(&["--mode", "roadmap"]), &["view.xray.mode = roadmap", "give a [[view.injection]]"]),
    ];
    check_refused(&cases);
}

/// Each call is refused with exit code 2 and these words.
fn check_refused(cases: &[(Vec<&str>, &[&str])]) {
    for (args, words) in cases {
        let output = endowire(args);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(!said.contains("panicked"), "{args:?}: {said}");
        for word in *words {
            assert!(said.contains(word), "{args:?}: `{word}` is missing in: {said}");
        }
    }
}

#[test]
fn what_would_change_nothing_or_mix_with_a_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, run) = recorded(folder.path());
    let still = |more: &[&'static str]| [&["fluoro", text(&scene), "--steps", "0"], more].concat();
    let cases: [(Vec<&str>, &[&str]); 10] = [
        (vec!["render", text(&run), "--to", "500"], &["--to 500", "steps 1 to 106"]),
        (
            vec!["render", text(&run), "--view", "fluoro", "--orbit", "90"],
            &["--orbit 90: belongs to the 3D view", "--view both"],
        ),
        (
            vec!["render", text(&run), "--view", "3d", "--from", "106", "--orbit", "90"],
            &["--orbit 90: one frame is drawn"],
        ),
        (
            vec!["render", text(&run), "--set", "script[0].step_mm=3"],
            &["--set script[0].step_mm=3: the run is recorded", "run the scene again"],
        ),
        (
            still(&["--size", "128", "--set", "size_px=[64,64]"]),
            &["--set size_px=[64,64]: --size gives the same: leave out one"],
        ),
        (
            still(&["--set", "patient.torso.width_mm=200", "--set", "xray.tissue_mm=100"]),
            &["--set xray.tissue_mm=100", "the scene has a body (view.patient)"],
        ),
        // What was given on the command line is not blamed on the file.
        (still(&["--size", "5000"]), &["endowire: --size: view.size_px = [5000, 5000]"]),
        (
            still(&["--set", "c_arm.sod_mm=2000"]),
            &["endowire: --set c_arm.sod_mm=2000: view.c_arm.sod_mm = 2000"],
        ),
        // Files of a run are not mixed with others.
        (vec!["render", text(&run), "--out", text(&run)], &["--out", "holds a recording of endowire run"]),
        (
            [&still(&["--out"])[..], &[text(&run)]].concat(),
            &["--out", "holds a recording of endowire run", "pictures"],
        ),
    ];
    check_refused(&cases);
}

#[test]
fn medium_from_a_tip_is_where_the_tip_was_whichever_frames_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let small = [
        ("size_px = [640, 640]", "size_px = [96, 96]\nbackend = \"cpu\"\ndetector = { lag = 0.0 }"),
        ("mode = \"dsa\"", "mode = \"fluoro\"\nbrightness_s = 0.0"),
        ("advance_mm = 160.0", "advance_mm = 80.0"),
        ("rate_ml_per_s = 20.0", "rate_ml_per_s = 20.0\nat_tip = true"),
    ];
    // The last frame of 20 steps.
    let last = |name: &str, every: &str, at_tip: bool| {
        let scene = scene_text("arch_angiography.toml", &small).replace("every = 40", every);
        let scene = if at_tip { scene } else { scene.replace("at_tip = true", "at_tip = false") };
        let (path, out) = (folder.path().join(format!("{name}.toml")), folder.path().join(name));
        std::fs::write(&path, scene).unwrap();
        let output = endowire(&["run", text(&path), "--out", text(&out)]);
        assert!(output.status.success(), "{}", said(&output));
        (std::fs::read(out.join("frames/step_000020_fluoro.png")).unwrap(), out)
    };
    let (each, out) = last("each", "every = 1", true);
    assert!(last("few", "every = 7", true).0 == each);
    let again = endowire(&["render", text(&out), "--from", "20"]);
    assert!(again.status.success(), "{}", said(&again));
    assert!(std::fs::read(out.join("render/step_000020_fluoro.png")).unwrap() == each);
    // The twin: medium from elsewhere is another picture.
    assert!(last("inlet", "every = 1", false).0 != each);
}

#[test]
fn a_run_that_was_resumed_in_another_folder_is_drawn_with_the_numbers_of_its_steps() {
    let folder = tempfile::tempdir().unwrap();
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let line = "[[script]]\nadvance_mm = 12.0\nstep_mm = 4.0\n";
    let scene = |name: &str, lines: usize| {
        let head = scene_text("curved_tube.toml", &[]);
        let head = head.split_once("[[script]]").unwrap().0;
        let path = folder.path().join(name);
        std::fs::write(&path, format!("{head}{}", line.repeat(lines))).unwrap();
        text(&path)
    };
    let [state, first, second, drawn] =
        ["state", "first", "second", "drawn"].map(|name| text(&folder.path().join(name)));
    let good = |args: &[&str]| {
        let output = endowire(args);
        assert!(output.status.success(), "{}", said(&output));
    };
    good(&["run", &scene("one.toml", 1), "--out", &first, "--save-state", &state]);
    good(&["run", &scene("two.toml", 2), "--out", &second, "--resume", &state]);
    good(&["render", &second, "--size", "32", "--view", "3d", "--every", "2", "--out", &drawn]);
    for step in [4, 6] {
        assert!(Path::new(&drawn).join(format!("step_{step:06}_3d.png")).is_file(), "{step}");
    }
    let refused = endowire(&["render", &second, "--from", "2", "--to", "3", "--out", &drawn]);
    assert!(said(&refused).contains("has steps 4 to 6"), "{}", said(&refused));
    // The first one that was recorded is not step 1, which can be asked for and is not there.
    let refused = endowire(&["render", &second, "--from", "1", "--out", &drawn]);
    assert!(said(&refused).contains("--from 1 --to 6: ") && said(&refused).contains("has steps 4 to 6"));
}

#[test]
fn frames_leave_the_files_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let (_, run) = recorded(folder.path());
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let draw = || {
        let few = ["--from", "106", "--view", "3d", "--size", "24x16", "--out", text(&out)];
        endowire(&[&["render", text(&run)], &few[..]].concat())
    };
    let frame = out.join("step_000106_3d.png");
    std::fs::write(&frame, "theirs").unwrap();
    for _ in 0..2 {
        let refused = draw();
        assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
        assert!(said(&refused).contains("step_000106_3d.png"), "{}", said(&refused));
        assert_eq!(std::fs::read(&frame).unwrap(), b"theirs");
    }
    // The twin: its own it replaces.
    std::fs::remove_file(&frame).unwrap();
    for _ in 0..2 {
        assert!(draw().status.success());
    }
    assert_eq!(png_size(&frame), (24, 16));
}

#[test]
fn frames_stay_until_those_that_replace_them_can_be_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let (_, run) = recorded(folder.path());
    let draw = |more: &[&str]| {
        let few = ["--from", "106", "--view", "fluoro", "--size", "24x16"];
        endowire(&[&["render", text(&run)], &few[..], more].concat())
    };
    assert!(draw(&[]).status.success());
    let frame = run.join("render/step_000106_fluoro.png");
    let before = std::fs::read(&frame).unwrap();
    // Blades that leave nothing open are found when all that a picture needs is there.
    let refused = draw(&["--set", "c_arm.collimation_mm=[0.1, 20]"]);
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
    assert!(!said(&refused).contains("replaces"), "{}", said(&refused));
    assert_eq!(std::fs::read(&frame).unwrap(), before);
    // The twin: what can be drawn replaces it.
    let drawn = draw(&["--pose", "LAO 40"]);
    assert!(said(&drawn).contains("replaces 1 files of an earlier endowire render"), "{}", said(&drawn));
    assert_ne!(std::fs::read(&frame).unwrap(), before);
}

#[test]
fn places_of_injections_are_in_the_vessel() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("arch.toml");
    let small = [("size_px = [640, 640]", "size_px = [48, 48]\nbackend = \"cpu\"")];
    std::fs::write(&scene, scene_text("arch_angiography.toml", &small)).unwrap();
    let draw = |at_mm: &str| {
        let (set, out) = (format!("injection[0].at_mm={at_mm}"), folder.path().join("out"));
        endowire(&[
            "fluoro",
            text(&scene),
            "--steps",
            "0",
            "--time",
            "0.4",
            "--set",
            &set,
            "--out",
            text(&out),
        ])
    };
    let refused = draw("[900, 0, 10]");
    let reported = said(&refused);
    assert_eq!(refused.status.code(), Some(2), "{reported}");
    assert!(
        reported.contains("view.injection[0].at_mm = [900, 0, 10]: is ") && reported.contains("mm from"),
        "{reported}"
    );
    // The twins: in the ascending aorta, and a number that is not there.
    let drawn = draw("[-38, -54, 140]");
    assert!(drawn.status.success(), "{}", said(&drawn));
    let set = "injection[1].at_mm=[0, 0, 0]";
    let none =
        endowire(&["fluoro", text(&scene), "--steps", "0", "--set", set, "--out", text(folder.path())]);
    assert!(none.status.code() == Some(2) && said(&none).contains("injection[1]"), "{}", said(&none));
}

#[test]
fn a_single_subtraction_of_nothing_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, _) = recorded(folder.path());
    let draw = |more: &[&str]| {
        let out = folder.path().join("out");
        let output =
            endowire(&[&["fluoro", text(&scene), "--steps", "3", "--out", text(&out)], more].concat());
        assert!(output.status.success(), "{}", said(&output));
        said(&output)
    };
    assert!(draw(&["--mode", "dsa"]).contains("view.xray.mode = dsa: the picture is empty"));
    // The twins: several frames, and another mode.
    assert!(!draw(&["--mode", "dsa", "--count", "2"]).contains("empty"));
    assert!(!draw(&["--mode", "cine"]).contains("empty"));
}
