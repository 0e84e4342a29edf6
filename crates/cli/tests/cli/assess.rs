//! `endowire assess`: sessions and runs in, measures out.

use std::io::Write;
use std::path::Path;

use serde_json::{Value, json};

use crate::common::{document, endowire, play, reported, said, scene, text};

fn assessed(args: &[&str]) -> Value {
    reported(&endowire().arg("assess").args(args).arg("--json").output().unwrap())
}

fn value(document: &Value, name: &str) -> Option<f64> {
    let metrics = document["metrics"].as_array().unwrap();
    metrics.iter().find(|metric| metric["name"] == name).unwrap()["value"].as_f64()
}

/// Two seconds with the beam on, of which the first is spent pushing 20 mm, and another in which 10 mm are pulled back unseen.
fn session(folder: &Path) -> std::path::PathBuf {
    let record = folder.join("played.toml");
    let lines = [
        json!({"do": "pedal", "down": true}),
        json!({"do": "move", "instrument": "catheter", "mm_per_s": 20}),
        json!({"do": "wait", "ticks": 60}),
        json!({"do": "stop"}),
        json!({"do": "wait", "ticks": 60}),
        json!({"do": "pedal", "down": false}),
        json!({"do": "move", "instrument": "catheter", "mm_per_s": -10}),
        json!({"do": "wait", "ticks": 60}),
        json!({"do": "quit"}),
    ];
    let mut child = play("arch_vertebral.toml", &record, &["--headless", "--size", "96"]).spawn().unwrap();
    let lines: String = lines.iter().map(|line| format!("{line}\n")).collect();
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    folder.join("played.session.json")
}

#[test]
fn a_session_is_measured_with_its_rests_and_its_beam_and_its_script_without() {
    let folder = tempfile::tempdir().unwrap();
    let session = session(folder.path());
    let measured = assessed(&[text(&session)]);
    let of = |name: &str| value(&measured, name).unwrap();
    for (name, expected) in [
        ("total_s", 3.0),
        ("idle_s", 1.0),
        ("beam_on_s", 2.0),
        ("beam_on_idle_s", 1.0),
        ("moving_without_beam_s", 1.0),
        ("runs", 1.0),
        ("frames", 60.0),
        ("c_arm_moves", 0.0),
        ("contrast_ml", 0.0),
        ("reversals", 1.0),
        ("retracted_mm", 10.0),
    ] {
        assert!((of(name) - expected).abs() < 1e-6 * expected.max(1.0), "{name}: {} {expected}", of(name));
    }
    for metric in measured["metrics"].as_array().unwrap() {
        for key in ["name", "group", "value", "unit", "better", "definition", "study"] {
            assert!(metric.get(key).is_some(), "{key} {metric}");
        }
    }
    // Carried out again as a script: the same way, and neither rests nor beam.
    let out = folder.path().join("out");
    let script = folder.path().join("played.toml");
    let args = ["--script", text(&script), "--json", "--out", text(&out)];
    reported(&endowire().arg("run").arg(scene("arch_vertebral.toml")).args(args).output().unwrap());
    let again = assessed(&[text(&out), "--target", "opening 4"]);
    assert!((value(&again, "tip_path_mm").unwrap() - of("tip_path_mm")).abs() < 1e-6);
    assert_eq!((value(&again, "beam_on_s"), value(&again, "arrived")), (None, Some(0.0)));
    // Both beside each other, and as a table.
    let both = assessed(&[text(&session), text(&out)]);
    assert_eq!(both["sessions"].as_array().unwrap().len(), 2);
    assert_eq!(both["sessions"][0]["metrics"], measured["metrics"]);
    let table = endowire().arg("assess").args([&session, &out]).output().unwrap();
    let table = String::from_utf8(table.stdout).unwrap();
    assert!(table.contains("safety") && table.contains("wall_force_95_n"), "{table}");
    // A session tells its scene.
    assert!(document(&session)["scene_file"].as_str().unwrap().ends_with("arch_vertebral.toml"));
}

#[test]
fn a_record_of_other_instruments_than_its_scene_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let session = session(folder.path());
    let out = folder.path().join("out");
    let script = folder.path().join("played.toml");
    let args = ["--script", text(&script), "--json", "--out", text(&out)];
    reported(&endowire().arg("run").arg(scene("arch_vertebral.toml")).args(args).output().unwrap());
    let goal = |instrument: &str| {
        let file = folder.path().join("goal.toml");
        let head =
            format!("name = \"a\"\nlevel = 1\ntext = \"b\"\nscene = {:?}\n", scene("arch_vertebral.toml"));
        let goal = "[goal]\ntarget = \"opening 4\"\ntip_within_mm = 5.0\n";
        std::fs::write(&file, format!("{head}{goal}instrument = \"{instrument}\"\n")).unwrap();
        file
    };
    let subject = goal("catheter");
    let assess = |record: &Path, more: &[&str]| {
        let output = endowire().arg("assess").arg(record).args(more).output().unwrap();
        (output.status.code(), said(&output))
    };
    let with_subject = ["--subject", text(&subject)];
    for record in [&session, &out] {
        for more in [&[][..], &with_subject] {
            let (code, said) = assess(record, more);
            assert_eq!(code, Some(0), "the twin: {said}");
        }
    }
    std::fs::remove_file(out.join("instruments.csv")).unwrap();
    let mut renamed = document(&session);
    renamed["record"]["instruments"][1] = json!("sheath");
    std::fs::write(&session, renamed.to_string()).unwrap();
    let renamed =
        format!("{}: instruments = [wire, sheath]: the scene has [wire, catheter]", session.display());
    let missing = "instruments.csv: is missing, and steps.csv needs it".to_owned();
    for (record, reported) in [(&session, renamed), (&out, missing)] {
        for more in [&[][..], &with_subject] {
            let (code, said) = assess(record, more);
            assert!(code == Some(2) && said.contains(&reported), "{said}");
        }
    }
}

#[test]
fn what_cannot_be_assessed_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let nothing = folder.path().join("nothing.session.json");
    std::fs::write(&nothing, "{}").unwrap();
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    for (args, named) in [
        (vec![text(&empty)], "empty: holds neither a run (steps.csv) nor sessions (*.session.json): give"),
        // A folder that holds sessions stands for them.
        (vec![text(folder.path())], "nothing.session.json"),
        (vec![text(&nothing)], "nothing.session.json"),
        (vec![text(&nothing), "--within-mm", "-1"], "--within-mm -1"),
    ] {
        let output = endowire().arg("assess").args(&args).output().unwrap();
        assert!(output.status.code() == Some(2) && said(&output).contains(named), "{}", said(&output));
    }
}
