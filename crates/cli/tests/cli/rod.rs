//! `endowire rod` and `endowire verify` as a user meets them: documents, exit codes, errors.

use std::path::PathBuf;
use std::process::Output;

use crate::common::{assets, said};
use serde_json::Value;

fn endowire(args: &[&str]) -> Output {
    crate::common::endowire().args(args).output().unwrap()
}

fn cases() -> PathBuf {
    assets().join("cases")
}

fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}{}", String::from_utf8_lossy(&output.stdout), said(output)))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn has_provenance(document: &Value) {
    for key in ["version", "git_revision", "scene_hash", "seed"] {
        assert!(!document[key].is_null(), "{key}");
    }
}

#[test]
fn every_example_is_solved_and_reported() {
    let mut count = 0;
    for entry in std::fs::read_dir(cases()).unwrap() {
        let path = entry.unwrap().path();
        let output = endowire(&["rod", path.to_str().unwrap(), "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", path.display());
        assert!(output.stderr.is_empty());
        let solution = document(&output);
        has_provenance(&solution);
        assert_eq!(solution["converged"], true);
        assert_eq!(solution["stable"], true);
        assert!(solution["iterations"].as_u64().unwrap() > 0, "{}", path.display());
        assert!(solution["residual"].as_f64().unwrap() < 1e-9, "{}", path.display());
        let nodes = solution["nodes"].as_array().unwrap();
        assert_eq!(nodes.len(), solution["tangents"].as_array().unwrap().len());
        assert_eq!(solution["tip"], nodes[nodes.len() - 1]);
        for tangent in solution["tangents"].as_array().unwrap() {
            let norm = numbers(tangent).iter().map(|c| c * c).sum::<f64>().sqrt();
            assert!((norm - 1.0).abs() < 1e-14);
        }
        let energy = &solution["energy"];
        let part = |key: &str| energy[key].as_f64().unwrap();
        let sum = part("bend") + part("twist") + part("axial");
        assert!(part("total") > 0.0 && (part("total") - sum).abs() <= 1e-15 * sum);
        for end in ["start", "end"] {
            for kind in ["force", "moment"] {
                assert_eq!(numbers(&solution["reactions"][end][kind]).len(), 3);
            }
        }
        let inertia = numbers(&solution["inertia"]);
        assert!(inertia[0] > 0.0 && inertia[1] >= (nodes.len() - 1) as f64);
        count += 1;
    }
    assert!(count >= 14);
}

#[test]
fn the_cantilever_is_that_of_the_literature() {
    let path = cases().join("tip_force.toml");
    let solution = document(&endowire(&["rod", path.to_str().unwrap(), "--json"]));
    let tip = numbers(&solution["tip"]);
    // Bisshopp and Drucker 1945, PL²/EI = 10.
    assert!((tip[0] - 0.445004402246).abs() < 2e-7 && (tip[1] + 0.810609024880).abs() < 2e-7);
    assert!((solution["tip_angle"].as_f64().unwrap() - 1.43028553880).abs() < 1e-6);
    let text = endowire(&["rod", path.to_str().unwrap()]);
    let text = String::from_utf8(text.stdout).unwrap();
    for word in ["stable equilibrium", "tip", "0.44500", "energy", "start exerts"] {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

#[test]
fn a_case_that_does_not_converge_is_reported_with_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.toml");
    let text = std::fs::read_to_string(cases().join("tip_force.toml")).unwrap();
    std::fs::write(&path, text + "[solver]\nmax_iterations = 2\n").unwrap();
    let output = endowire(&["rod", path.to_str().unwrap(), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let solution = document(&output);
    assert_eq!(solution["converged"], false);
    assert_eq!(solution["stop"], "iterations used up");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(message.trim_end().lines().count(), 1);
    assert!(message.contains("short.toml") && message.contains("iterations used up"), "{message}");
}

/// Spoils the example `case` and expects exit code 2, no document, and one line with all of `words`.
fn is_refused(case: &str, from: &str, to: &str, words: &[&str]) {
    let text = std::fs::read_to_string(cases().join(case).with_extension("toml")).unwrap();
    assert!(text.contains(from), "{from} is not in {case}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("spoilt.toml");
    std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    let output = endowire(&["rod", path.to_str().unwrap(), "--json"]);
    let message = said(&output);
    assert_eq!(output.status.code(), Some(2), "{to}: {message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.trim_end().lines().count(), 1, "one line is wanted: {message}");
    for word in words.iter().chain(&["spoilt.toml"]) {
        assert!(message.contains(word), "`{word}` is missing in: {message}");
    }
}

#[test]
fn bad_cases_are_refused_with_one_clear_line() {
    for (from, to, words) in [
        ("EI = 1.0", "EI = -1.0", &["rod.section[0].EI = -1"][..]),
        ("EI = 1.0", "EI = nan", &["rod.section[0].EI = NaN"]),
        ("EI = 1.0", "EI = \"stiff\"", &["line 7", "EI", "stiff"]),
        ("EI = 1.0", "EI = 1.0\nrest_curvatur = [1.0, 0.0]", &["line 8", "did you mean `rest_curvature`?"]),
        ("[start]", "[strat]", &["`strat`", "did you mean `start`?"]),
        ("type = \"free\"", "type = \"fre\"", &["`fre`", "did you mean `free`?"]),
        ("elements = 32", "elements = 0", &["rod.elements = 0"]),
        ("elements = 32", "elements = -3", &["line 4", "elements", "-3"]),
        ("value = [0.0, -10.0, 0.0]", "value = [0.0, inf, 0.0]", &["load[0].value", "inf"]),
        ("at = 1.0", "at = 1.5", &["load[0].at = 1.5"]),
        ("type = \"free\"", "type = \"free\"\nposition = [0.5, 0.0, 0.0]", &["end.position"]),
        ("type = \"free\"", "type = \"pinned\"\nposition = [1.5, 0.0, 0.0]", &["end.position", "1.5"]),
        ("until = 1.0", "until = 0.5", &["rod.section[0].until = 0.5"]),
        ("[load]", "[[load]", &["line "]),
    ] {
        is_refused("tip_force", from, to, words);
    }
    is_refused("bend_45", "GJ = 833333.3333333334\n", "", &["GJ"]);
    is_refused(
        "clamped_turned",
        "position = [0.9, 0.1, 0.0]\ntangent = [1.0, 0.0, 0.0]",
        "position = [1.0, 0.0, 0.0]\ntangent = [0.0, 0.0, 1.0]",
        &["end.tangent", "straight"],
    );
}

#[test]
fn a_missing_case_is_named() {
    let output = endowire(&["rod", "no/such/case.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("no/such/case.toml"));
}

#[test]
fn verify_prints_and_counts_every_row() {
    // The stress tables take minutes; they are run by hand.
    let output = endowire(&["verify", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let table = document(&output);
    has_provenance(&table);
    let rows = table["cases"].as_array().unwrap();
    assert_eq!(table["passed"].as_u64().unwrap() as usize, rows.len());
    assert_eq!(table["failed"], 0);
    for family in
        ["A1", "A2", "A3", "A4", "A5", "A6", "A7", "B1", "B2", "B3", "B4", "B5", "C2", "C3", "C4", "C5", "C6"]
    {
        assert!(rows.iter().any(|row| row["name"].as_str().unwrap().starts_with(family)), "{family}");
    }
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap();
        assert!(number("error") <= number("bound") && row["pass"] == true);
        assert!(number("computed").is_finite() && number("expected").is_finite());
        assert!(row["quantity"].is_string() && row.get("order").is_some() && row.get("iterations").is_some());
    }
}
