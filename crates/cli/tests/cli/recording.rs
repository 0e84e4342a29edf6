//! What `endowire run` leaves on disk, read back by an independent reader.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{SHORT, assets, endowire, said, scene_text};
use npyz::NpyFile;
use serde_json::Value;
use zip::ZipArchive;

fn run(scene: &Path, out: &Path) -> (Option<i32>, Value) {
    let output =
        endowire().args(["run".as_ref(), scene, "--out".as_ref(), out, "--json".as_ref()]).output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    let summary = serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{e}: {stdout}{}", said(&output)));
    (output.status.code(), summary)
}

/// Shape and numbers of an array.
fn array<T: npyz::Deserialize>(path: &Path, name: &str) -> (Vec<u64>, Vec<T>) {
    let mut archive = ZipArchive::new(File::open(path).unwrap()).unwrap();
    let array = NpyFile::new(archive.by_name(&format!("{name}.npy")).unwrap()).unwrap();
    (array.shape().to_vec(), array.into_vec().unwrap())
}

fn floats(path: &Path, name: &str) -> (Vec<u64>, Vec<f64>) {
    array(path, name)
}

fn integers(path: &Path, name: &str) -> Vec<i64> {
    array(path, name).1
}

/// A short run in the curved tube with two frames of each view.
fn short_scene(folder: &Path) -> PathBuf {
    let path = folder.join("short.toml");
    std::fs::write(&path, scene_text("curved_tube.toml", &SHORT)).unwrap();
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
fn a_film_has_all_frames_the_views_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, out) = (folder.path().join("film.toml"), folder.path().join("out"));
    let text = scene_text("curved_tube.toml", &SHORT).replace("[view]", "[view]\nfilm = \"apng\"");
    std::fs::write(&scene, &text).unwrap();
    let (code, summary) = run(&scene, &out);
    assert_eq!((code, &summary["film"]), (Some(0), &"film.apng".into()));
    let decoder = png::Decoder::new(std::io::BufReader::new(File::open(out.join("film.apng")).unwrap()));
    let reader = decoder.read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (2 * 96, 64));
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 3);
    assert!(!out.join("part-film.apng").exists());
    // The recording that takes its place has none.
    let (_, again) = run(&short_scene(folder.path()), &out);
    assert!(again["film"].is_null() && !out.join("film.apng").exists());

    std::fs::write(&scene, text.replace("apng", "avi")).unwrap();
    let refused = endowire().arg("run").arg(&scene).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("view.film = avi"), "{}", said(&refused));
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    let summary = run(&scene, &a).1;
    run(&scene, &b);
    let mut names = ["steps.csv", "instruments.csv", "shapes.npz"].map(str::to_owned).to_vec();
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
    let reported = |more: &[&str]| {
        let output = endowire()
            .args(["run".as_ref(), scene.as_path(), "--out".as_ref(), out.as_path()])
            .args(more)
            .output()
            .unwrap();
        assert!(output.status.success());
        said(&output)
    };
    assert!(!reported(&[]).contains("replaces"));
    let mine = ["notes.txt", "frames/step_by_step.png", "frames/step_000040_3d.png.bak", "frames/best.png"];
    for name in mine {
        std::fs::write(out.join(name), "mine").unwrap();
    }
    std::fs::write(out.join("frames/step_999999_3d.png"), "old").unwrap();
    let said = reported(&[]);
    assert!(said.contains("replaces the earlier recording in ") && said.contains("out: "), "{said}");
    assert!(said.contains("summary.json, steps.csv, instruments.csv, shapes.npz, 7 frames"), "{said}");
    assert!(mine.iter().all(|name| out.join(name).exists()));
    assert!(!out.join("frames/step_999999_3d.png").exists());
}

#[test]
fn a_folder_with_other_files_is_used_only_by_force_and_keeps_them() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let out = folder.path().join("data");
    std::fs::create_dir_all(out.join("frames")).unwrap();
    for name in ["steps.csv", "mine.txt", "frames/step_999999_3d.png"] {
        std::fs::write(out.join(name), "left,right\n1,2\n").unwrap();
    }
    let run = |more: &[&str]| {
        let mut command = endowire();
        command.args(["run".as_ref(), scene.as_path(), "--out".as_ref(), out.as_path()]);
        let output = command.args(more).output().unwrap();
        (output.status.code(), said(&output))
    };
    let (code, said) = run(&[]);
    assert!(code == Some(2) && said.contains("--force"), "{said}");
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 3, "nothing may be left there");
    let (code, said) = run(&["--force"]);
    assert!(
        code == Some(0) && said.contains("replaces files in ") && said.contains("data: steps.csv\n"),
        "{said}"
    );
    assert!(out.join("shapes.npz").exists() && out.join("mine.txt").exists());
    assert!(out.join("frames/step_999999_3d.png").exists());
}

#[test]
fn a_folder_with_other_files_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let out = folder.path().join("data");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("summary.json"), "mine").unwrap();
    std::fs::write(out.join("steps.csv"), "left,right\n1,2\n").unwrap();
    let output =
        endowire().args(["run".as_ref(), scene.as_path(), "--out".as_ref(), out.as_path()]).output().unwrap();
    let reported = said(&output);
    assert_eq!(output.status.code(), Some(2), "{reported}");
    assert!(reported.contains("no earlier recording") && reported.contains("recording"), "{reported}");
    assert_eq!(std::fs::read_to_string(out.join("summary.json")).unwrap(), "mine");
    assert!(std::fs::read_to_string(out.join("steps.csv")).unwrap().starts_with("left"));
}

fn summary(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("summary.json")).unwrap()).unwrap()
}

#[test]
fn a_frame_that_cannot_be_written_ends_the_run_and_keeps_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("frames"), "a file, not a folder").unwrap();
    std::fs::write(out.join("steps.csv"), "").unwrap();
    let (code, reported) = run(&scene, &out);
    assert_eq!(code, Some(1));
    assert_eq!((reported["failure"]["step"].as_u64(), reported["steps"].as_u64()), (Some(40), Some(40)));
    assert!(reported["failure"]["reason"].as_str().unwrap().contains("frames"));
    assert_eq!(summary(&out), reported);
    let offsets = integers(&out.join("shapes.npz"), "offsets");
    assert_eq!(offsets.len(), 41);
    assert_eq!(floats(&out.join("shapes.npz"), "positions_mm").0, [offsets[40] as u64, 3]);
}

#[test]
fn the_hash_of_a_scene_covers_its_device_file() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(short_scene(folder.path())).unwrap();
    let from = text.find("[[device.section]]").unwrap();
    let to = text.find("[sheath]").unwrap();
    let text = format!("{}[device]\nfile = \"wire.toml\"\n{}", &text[..from], &text[to..])
        .replace("\"3d\", \"fluoro\"", "");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, text).unwrap();
    let hash = |stiffness: &str| {
        let wire = format!(
            "[[section]]\nlength_mm = 300.0\nradius_mm = 0.445\nbending_stiffness_nmm2 = {stiffness}\n"
        );
        std::fs::write(folder.path().join("wire.toml"), wire).unwrap();
        run(&scene, &folder.path().join("out")).1["scene_hash"].as_str().unwrap().to_owned()
    };
    assert_eq!(hash("5.0"), hash("5.0"));
    assert_ne!(hash("5.0"), hash("6.0"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_reader_that_leaves_is_no_failure_and_a_full_disk_is() {
    use std::process::Stdio;
    let folder = tempfile::tempdir().unwrap();
    let command = |stdout: Stdio| {
        let mut command = endowire();
        command
            .args(["vessel", "generate", "straight_tube", "--json", "--out"])
            .arg(folder.path().join("a.stl"));
        command.stdout(stdout).stderr(Stdio::piped());
        command
    };
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = command(writer.try_clone().unwrap().into()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let case = assets().join("cases/tip_force.toml");
    let output = endowire().arg("rod").arg(case).stdout(writer).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let full = File::options().write(true).open("/dev/full").unwrap();
    let output = command(full.into()).output().unwrap();
    let text = said(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("standard output") && text.trim_end().lines().count() == 1, "{text}");
    // Nobody hears what is said: the exit code still tells.
    let full = File::options().write(true).open("/dev/full").unwrap();
    let status = endowire().args(["run", "no/such"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_run_after_the_step_under_way_and_keeps_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let scene = short_scene(folder.path());
    let text = std::fs::read_to_string(&scene).unwrap().replace("\"3d\", \"fluoro\"", "");
    std::fs::write(&scene, text.replace("step_mm = 0.5", "step_mm = 0.0001")).unwrap();
    let out = folder.path().join("out");
    let child = endowire()
        .args(["run".as_ref(), scene.as_path(), "--out".as_ref(), out.as_path()])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let rows = || std::fs::read_to_string(out.join("steps.csv")).map_or(0, |text| text.lines().count());
    while rows() < 10 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let text = said(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("interrupted"), "{text}");
    let reported = summary(&out);
    let steps = reported["steps"].as_u64().unwrap() as usize;
    assert!(steps < reported["steps_asked"].as_u64().unwrap() as usize);
    assert_eq!((reported["failure"]["step"].as_u64(), rows()), (Some(steps as u64 + 1), steps + 1));
    assert_eq!(integers(&out.join("shapes.npz"), "offsets").len(), steps + 1);
}

#[test]
fn without_a_desktop_nothing_but_the_summary_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let output = endowire()
        .env_remove("XDG_RUNTIME_DIR")
        .args([
            "run".as_ref(),
            short_scene(folder.path()).as_path(),
            "--out".as_ref(),
            folder.path().join("out").as_path(),
        ])
        .output()
        .unwrap();
    let text = said(&output);
    assert!(text.starts_with("curved_tube: 106 of 106 steps") && !text.contains("XDG"), "{text}");
}
