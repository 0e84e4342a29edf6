//! `endowire evidence`: studies of the model.

use std::fmt::Write;
use std::process::{Command, Output};

use endowire_lab::evidence::{STUDIES, three_tubes};
use serde_json::Value;

use crate::common::{said, workspace};

fn evidence(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_endowire"));
    command.current_dir(workspace()).arg("evidence").args(arguments).output().unwrap()
}

#[test]
fn tubes_are_fitted_to_every_eighth_row_and_judged_on_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tips.txt");
    let mut text = String::new();
    for (index, row) in three_tubes::invented(40, 0.04).unwrap().iter().enumerate() {
        let numbers = row.turns_rad.iter().chain(&row.bases_mm).chain(row.tip_mm.iter());
        let numbers: Vec<String> = numbers.map(f64::to_string).collect();
        writeln!(text, "{index} {} 1 0 0 0 1 0 0 0 1", numbers.join(" ")).unwrap();
    }
    std::fs::write(&file, text).unwrap();
    let output = evidence(&["three-tubes", file.to_str().unwrap(), "--json"]);
    assert!(output.status.success(), "{}", said(&output));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let fitted = &found["fitted"];
    assert_eq!((fitted["rows_fitted"].as_u64(), fitted["rows_tested"].as_u64()), (Some(5), Some(35)));
    let mean = |of: &Value| of["mean_mm"].as_f64().unwrap();
    assert!(mean(fitted) < 0.1 * mean(&found["nominal"]), "{found}");
    assert!(fitted["mean_percent_of_length"].as_f64().unwrap() < 1.0 && fitted["p95_mm"].is_number());
}

#[test]
fn studies_say_what_they_do_not_show_and_have_a_figure() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("figure.svg");
    let output = evidence(&["reversal", "--json", "--out", picture.to_str().unwrap()]);
    assert!(output.status.success(), "{}", said(&output));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((found["failed"].as_u64(), found["passed"].as_u64()), (Some(0), Some(9)));
    assert!(found["not_shown"].as_str().unwrap().contains("measured points"));
    assert!(std::fs::read_to_string(picture).unwrap().contains("force of the hand"));
}

#[test]
fn every_study_is_listed_and_has_a_page_in_the_documents() {
    let listed = String::from_utf8(evidence(&[]).stdout).unwrap();
    for study in STUDIES {
        assert!(listed.contains(study.name), "{listed}");
        let page = workspace().join(format!("docs/evidence/{}.md", study.name));
        assert!(page.is_file(), "{}", page.display());
    }
}

#[test]
fn a_missing_file_and_an_unknown_study_are_named() {
    for (arguments, expected) in [
        (&["three-tubes"][..], "give the file of the measurements"),
        (&["three-tubs"], "those there are: three-tubes, "),
        (&["whip", "tips.txt"], "takes no file"),
    ] {
        let output = evidence(arguments);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(expected), "{}", said(&output));
    }
}
