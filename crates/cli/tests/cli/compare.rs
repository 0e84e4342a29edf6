//! `endowire compare` as a user meets it: tables, documents, pictures, resumption, wrong names.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::{document, endowire, reported, said};
use serde_json::Value;

fn compare(out: &Path, args: &[&str]) -> Output {
    command(out, args).output().unwrap()
}

fn command(out: &Path, args: &[&str]) -> Command {
    let mut command = endowire();
    command.arg("compare").arg("--out").arg(out).args(args);
    command
}

fn rows(document: &Value) -> &[Value] {
    document["rows"].as_array().unwrap()
}

const SMALL: [&str; 7] = [
    "--case",
    "cantilever-1",
    "--method",
    "kirchhoff,mass-spring,li2011-banded,li2011-banded-printed",
    "--elements",
    "16,8",
    "--json",
];

#[test]
fn rows_pictures_and_the_front_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let found = reported(&compare(out, &SMALL));
    for key in ["version", "git_revision", "scene_hash", "seed"] {
        assert!(!found[key].is_null(), "{key}");
    }
    let cells: Vec<(&str, &str, u64)> = rows(&found)
        .iter()
        .map(|row| {
            let text = |key: &str| row[key].as_str().unwrap();
            (text("case"), text("method"), row["resolution"].as_u64().unwrap())
        })
        .collect();
    let case = "cantilever-1";
    let expected = ["kirchhoff", "li2011-banded", "li2011-banded-printed", "mass-spring"]
        .map(|method| [(case, method, 8), (case, method, 16)]);
    assert_eq!(cells, expected.concat());
    for row in rows(&found) {
        assert!(row["time_s"].as_f64().unwrap() > 0.0, "{row}");
        assert!(row["iterations"].as_u64().unwrap() > 0, "{row}");
        assert!(row["error"].as_f64().unwrap() > 0.0, "{row}");
    }
    let error = |k: usize| rows(&found)[k]["error"].as_f64().unwrap();
    assert!(error(1) < 1e-6 && error(1) < error(0), "the exact rod converges: {}, {}", error(0), error(1));
    assert!(error(3) < 0.3 * error(2), "with unit tangents the paper's does: {}, {}", error(2), error(3));
    assert!(error(4) > 0.02 && error(5) > 0.02, "as printed it does not");
    let front = &found["fronts"][0];
    assert_eq!(front["methods"][0], "kirchhoff");
    assert_eq!(front["time_s"][0][0], "kirchhoff", "the fastest at {}", front["at_error"]);
    assert!(found["truths"][0]["truth"].as_str().unwrap().starts_with("exact"));

    let table = std::fs::read_to_string(out.join("compare.csv")).unwrap();
    assert!(table.starts_with("case,method,resolution,error,time_s,iterations"), "{table}");
    assert_eq!(document(out.join("compare.json"))["rows"], found["rows"]);
    let svg = std::fs::read_to_string(out.join("compare.svg")).unwrap();
    assert!(svg.contains("<svg") && svg.contains("cantilever"), "the panel has its title");
    let png = std::fs::read(out.join("compare.png")).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    for file in found["files"].as_array().unwrap() {
        assert!(Path::new(file.as_str().unwrap()).exists(), "{file}");
    }

    // For a person.
    let text = compare(out, &SMALL[..6]);
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.contains("Pareto front: kirchhoff"), "{text}");
}

#[test]
fn compare_goes_on_from_kept_rows() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let first = reported(&compare(out, &SMALL));
    let again = reported(&compare(out, &SMALL));
    // Times are measured: rows that were run again would differ.
    assert_eq!(first["rows"], again["rows"]);

    let mut more = SMALL;
    more[3] = "kirchhoff,beam-fem-damped";
    let more = reported(&compare(out, &more));
    assert_eq!(rows(&more).len(), rows(&first).len() + 2);
    for row in rows(&first) {
        assert!(rows(&more).contains(row), "{row}");
    }
}

#[test]
fn an_interrupted_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let args = ["--case", "cantilever-1,cantilever-10", "--elements", "8,16", "--json"];
    let mut run = command(out, &args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let table = out.join("compare.csv");
    let begun = Instant::now();
    while !table.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    run.kill().unwrap();
    run.wait().unwrap();
    let saved = std::fs::read_to_string(&table).unwrap();
    assert!(!out.join("compare.json").exists(), "it was interrupted");
    let count = saved.lines().count() - 1;
    assert!(count > 0);

    let found = reported(&compare(out, &args));
    assert_eq!(rows(&found).len(), 2 * 11 * 2);
    let table = std::fs::read_to_string(&table).unwrap();
    assert!(table.starts_with(&saved), "{count} rows must be kept as they were");
}

#[test]
fn a_method_that_cannot_says_so_in_its_row() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--case", "cantilever-10", "--method", "beam-fem,kirchhoff", "--elements", "16", "--json"];
    let found = reported(&compare(folder.path(), &args));
    let row = rows(&found).iter().find(|row| row["method"] == "beam-fem").unwrap();
    assert!(row["error"].is_null() && row["time_s"].is_null());
    assert!(row["note"].as_str().unwrap().contains("beam-fem"), "{row}");
}

#[test]
fn an_insertion_is_compared_and_stops_at_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--case", "soft-tube", "--method", "kirchhoff,rigid-links", "--elements", "10,20", "--json"];
    let found = reported(&compare(folder.path(), &[&args[..], &["--limit-s", "1e-6"]].concat()));
    for row in rows(&found) {
        assert!(row["error"].is_null() && row["note"].as_str().unwrap().contains("limit of"), "{row}");
    }
    let notes: Vec<&str> = rows(&found).iter().map(|row| row["note"].as_str().unwrap()).collect();
    assert!(notes[0].starts_with("stopped") && notes[1].starts_with("not begun: 10 elements"), "{notes:?}");

    let other = tempfile::tempdir().unwrap();
    let found = reported(&compare(other.path(), &args));
    let tip_error = rows(&found)[1]["error"].as_f64().unwrap();
    assert!(tip_error < 0.01, "case C5 on 20 elements: {tip_error} mm");
}

#[test]
fn wrong_names_are_answered_with_the_nearest_right_one() {
    let folder = tempfile::tempdir().unwrap();
    for (args, says) in [
        (["--case", "cantilever-l"], "'cantilever-1'"),
        (["--method", "rigid-link"], "'rigid-links'"),
        (["--elements", "1"], "--elements 1: give 2 to"),
        (["--limit-s", "0"], "--limit-s 0: give a time above 0"),
        (["--limit-s", "-1"], "--limit-s -1: give a time above 0"),
        (["--limit-s", "nan"], "--limit-s NaN: give a time above 0"),
        (["--limit-s", "1e30"], "--limit-s 1e30: give a time above 0, and at most 1000000 s"),
    ] {
        let output = compare(folder.path(), &args);
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        assert!(text.contains(says), "{args:?}: {text}");
    }
    std::fs::write(folder.path().join("compare.csv"), "case,method\nx,y\n").unwrap();
    let output = compare(folder.path(), &SMALL);
    assert_eq!(output.status.code(), Some(2), "a table that is not one of its own");
}
