//! `endowire bench`: bench tests of devices.

use serde_json::Value;

use crate::common::{said, workspace};
use std::process::{Command, Output};

fn bench(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_endowire"));
    command.current_dir(workspace()).arg("bench").args(arguments).output().unwrap()
}

fn document(arguments: &[&str]) -> Value {
    let output = bench(&[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_stiffer_wire_takes_more_push_and_friction_adds_to_it() {
    let found = document(&[
        "push",
        "wire_035_stiff",
        "wire_035_standard",
        "--track",
        "curved_tube",
        "--step-mm",
        "8",
    ]);
    let push = |device: usize, how: &str| found["devices"][device][how]["largest_push_n"].as_f64().unwrap();
    assert_eq!(found["devices"][0]["name"], "0.035 inch guidewire, stiff, straight tip");
    assert!(push(0, "without_friction") > push(1, "without_friction"), "{found}");
    assert!(push(0, "with_friction") > 1.02 * push(0, "without_friction"));
    assert_eq!(found["track"]["bends"].as_array().unwrap().len(), 1);
}

#[test]
fn a_hooked_tip_lags_and_a_straight_wire_without_friction_does_not() {
    let track = ["--track", "curved_tube", "--friction", "0", "--turn-deg", "180", "--step-deg", "30"];
    let found = document(&[&["torque", "wire_035_stiff", "wire_035_hooked"][..], &track].concat());
    let lag = |device: usize| found["devices"][device]["largest_lag_deg"].as_f64().unwrap();
    assert!(lag(0) < 1e-6 && lag(1) > 1.0, "{} {}", lag(0), lag(1));
}

#[test]
fn readings_are_csv_and_results_a_page_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let [page, picture] =
        ["bench.html", "bench.svg"].map(|name| folder.path().join(name).display().to_string());
    let output = bench(&["bend", "wire_035_stiff", "--csv", "--page", &page, "--out", &picture]);
    assert!(output.status.success(), "{}", said(&output));
    let mut readings = csv::Reader::from_reader(output.stdout.as_slice());
    assert_eq!(readings.headers().unwrap().iter().next(), Some("device"));
    assert!(readings.records().map(Result::unwrap).count() > 50);
    let page = std::fs::read_to_string(page).unwrap();
    assert!(
        page.contains("flexural rigidity") || page.contains("Flexural rigidity"),
        "the page says what it shows"
    );
    assert!(std::fs::read_to_string(picture).unwrap().contains("distance from the tip, mm"));
}

#[test]
fn what_is_wrong_is_named_by_its_flag_or_its_name() {
    for (arguments, expected) in [
        (&["push", "wire_035_stif"][..], "did you mean wire_035_stiff?"),
        (&["tip-load", "wire_035_stiff", "--stroke-mm", "9"], "--stroke-mm = 9: "),
        (&["bend", "wire_035_stiff", "--at-mm", "3"], "--at-mm = 3: "),
        (&["torque", "wire_035_stiff", "--friction=-1"], "--friction = -1: "),
        (&["push", "wire_035_stiff", "--track", "no_such.csv"], "built-in anatomies: "),
        (&["bend", "wire_035_stiff", "--page", "bench.txt"], "name a file .html"),
    ] {
        let output = bench(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", said(&output));
        assert!(said(&output).contains(expected), "{arguments:?}: {}", said(&output));
    }
}
