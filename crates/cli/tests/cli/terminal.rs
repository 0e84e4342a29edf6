//! What helps at a terminal: new scenes, the machine's state, completions, manuals, silence.

use std::path::Path;
use std::process::Output;

use crate::common::{assets, endowire, said};
use serde_json::Value;

fn reported(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn a_new_scene_runs_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let surface = assets().join("vessels/curved_tube.stl");
    let device = assets().join("devices/wire_035_soft.toml");
    let own = ["--vessel".as_ref(), surface.as_os_str(), "--device".as_ref(), device.as_os_str()];
    for (name, more) in [("built_in", &[][..]), ("own", &own[..])] {
        let made = folder.path().join(name);
        let output = endowire().arg("new").arg(&made).args(more).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let scene = made.join("scene.toml");
        let run = endowire()
            .arg("run")
            .arg(&scene)
            .arg("--out")
            .arg(made.join("out"))
            .arg("--json")
            .output()
            .unwrap();
        let summary: Value = serde_json::from_str(&reported(&run)).unwrap();
        assert_eq!((run.status.code(), &summary["scene"]), (Some(0), &name.into()), "{run:?}");
        assert_eq!(summary["inserted_mm"], 90.0);
        assert!(summary["frames"].as_array().is_some_and(|frames| frames.len() > 4));
        // What is there is not overwritten.
        let again = endowire().arg("new").arg(&made).output().unwrap();
        assert_eq!(again.status.code(), Some(2), "{again:?}");
    }
    let wrong =
        endowire().arg("new").arg(folder.path().join("x")).args(["--vessel", "aortic_arc"]).output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
    assert!(said(&wrong).contains("aortic_arch_ii"));
}

#[test]
fn the_wire_of_new_scenes_is_that_of_the_catalogue() {
    let template = Path::new(env!("CARGO_MANIFEST_DIR")).join("templates/wire.toml");
    let read = |path: &Path| std::fs::read_to_string(path).unwrap();
    assert_eq!(read(&template), read(&assets().join("devices/wire_035_hydrophilic_angled.toml")));
    let template = template.with_file_name("microwire.toml");
    assert_eq!(read(&template), read(&assets().join("devices/microwire_014_shaped.toml")));
}

/// A box of this size along z, closed or without its two ends.
fn box_of(wide: f64, long: f64, is_closed: bool) -> String {
    let corner = |k: usize| {
        let side = |bit: usize| if k >> bit & 1 == 1 { wide / 2.0 } else { -wide / 2.0 };
        format!("v {} {} {}\n", side(0), side(1), if k > 3 { long } else { 0.0 })
    };
    let sides = ["1 2 6 5", "2 4 8 6", "4 3 7 8", "3 1 5 7"];
    let ends = ["1 3 4 2", "5 6 8 7"];
    let faces = sides.iter().chain(ends.iter().filter(|_| is_closed));
    (0..8).map(corner).chain(faces.map(|face| format!("f {face}\n"))).collect()
}

#[test]
fn a_new_scene_of_an_unusual_vessel_runs_or_it_is_said_why_there_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let vessel = folder.path().join("box.obj");
    for (name, text, expected) in [
        ("closed", box_of(8.0, 60.0, true), Ok(())),
        ("thin", box_of(0.7, 30.0, false), Ok(())),
        ("short", box_of(3.0, 5.0, false), Ok(())),
        ("hair", box_of(0.2, 5.0, false), Err("the thinnest wire that a new scene can have")),
    ] {
        std::fs::write(&vessel, text).unwrap();
        let made = folder.path().join(name);
        let output = endowire().arg("new").arg(&made).arg("--vessel").arg(&vessel).output().unwrap();
        if let Err(reason) = expected {
            assert!(output.status.code() == Some(2) && said(&output).contains(reason), "{output:?}");
            continue;
        }
        assert_eq!(output.status.code(), Some(0), "{name}: {output:?}");
        let mut run = endowire();
        run.arg("run").arg(made.join("scene.toml")).arg("--out").arg(made.join("out"));
        let run = run.args(["--set", "view.views=[]", "--json"]).output().unwrap();
        assert_eq!(run.status.code(), Some(0), "{name}: {run:?}");
        let summary: Value = serde_json::from_str(&reported(&run)).unwrap();
        assert!(summary["failure"].is_null() && summary["inserted_mm"].as_f64() > Some(0.0), "{summary}");
    }
}

#[test]
fn doctor_reports_what_is_used() {
    let with = |variable: &str, value: &str| {
        let mut command = endowire();
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env(variable, value);
        let output = command.args(["doctor", "--json"]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        serde_json::from_str::<Value>(&reported(&output)).unwrap()
    };
    let found = with("ENDOWIRE_CACHE", "/somewhere");
    assert!(found["renderer"].as_str().is_some_and(|name| !name.is_empty()));
    assert!(found["threads"].as_u64().is_some_and(|threads| threads >= 1));
    assert_eq!(found["cache"], Path::new("/somewhere").join("walls").to_str().unwrap());
    if cfg!(all(target_os = "linux", feature = "window")) {
        assert_eq!(found["display"], Value::Null);
        assert_eq!(with("DISPLAY", ":5")["display"], "DISPLAY=:5");
    }
}

#[test]
fn completions_and_manuals_know_all_commands() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = endowire().args(["completions", shell]).output().unwrap();
        let script = reported(&output);
        assert!(script.contains("experiment") && script.contains("warn-nmm"), "{shell}");
    }
    let page = |arguments: &[&str]| endowire().arg("man").args(arguments).output().unwrap();
    assert!(reported(&page(&[])).contains("endowire\\-play"));
    assert!(reported(&page(&["run"])).contains("resume"));
    assert_eq!(page(&["rum"]).status.code(), Some(2));
}

#[test]
fn moving_pictures_are_named_for_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let draw = |name: &str| {
        let scene = assets().join("scenes/curved_tube.toml");
        let mut command = endowire();
        command.arg("fluoro").arg(scene).args(["--steps", "3", "--count", "2", "--size", "48"]);
        command
            .arg("--out")
            .arg(folder.path())
            .arg("--animate")
            .arg(folder.path().join(name))
            .output()
            .unwrap()
    };
    let output = draw("x.mpg");
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains(".gif"));
    assert!(!folder.path().join("x.mpg").exists());
    assert_eq!(draw("x.gif").status.code(), Some(0));
    assert!(std::fs::read(folder.path().join("x.gif")).unwrap().starts_with(b"GIF89a"));
}
