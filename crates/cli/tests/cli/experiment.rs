//! `endowire experiment` as a user meets it: the four experiments of the paper, as small as their options make them.

use std::path::Path;
use std::process::Output;

use crate::common::{endowire, reported, said};
use serde_json::Value;

fn experiment(args: &[&str]) -> Output {
    endowire().arg("experiment").args(args).output().unwrap()
}

fn rows(document: &Value) -> &[Value] {
    document["rows"].as_array().unwrap()
}

/// The two files that every experiment writes.
fn assert_written(folder: &Path, name: &str, found: &Value) {
    let kept = std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap();
    let kept: Value = serde_json::from_str(&kept).unwrap();
    assert_eq!(kept["rows"], found["rows"]);
    let table = std::fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap();
    assert_eq!(table.lines().count(), rows(found).len() + 1, "{table}");
}

#[test]
fn timing_has_a_row_for_every_method_and_the_papers_column() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let args = ["timing", "--nodes", "20,50", "--repeats", "3", "--out", out, "--json"];
    let found = reported(&experiment(&args));
    assert_written(folder.path(), "timing", &found);
    let methods: Vec<&str> = rows(&found).iter().map(|row| row["method"].as_str().unwrap()).collect();
    let three = ["li2011-dense", "li2011-banded", "kirchhoff"];
    assert_eq!(methods, [three, three].concat());
    for row in rows(&found) {
        assert!(row["median_ms"].as_f64().unwrap() > 0.0, "{row}");
        let paper = if row["nodes"] == 50 { Some(9.2) } else { None };
        assert_eq!(row["paper_ms"].as_f64(), paper, "{row}");
        let difference = row["max_difference_mm"].as_f64();
        if row["method"] == "kirchhoff" {
            assert_eq!(difference, None);
        } else {
            assert!(difference.unwrap() <= 1e-8, "{row}");
        }
    }
    assert!(
        rows(&found)[0]["max_difference_mm"].as_f64().unwrap() > 0.0,
        "two solves are never the same bits"
    );
}

#[test]
fn timing_says_who_is_too_slow_and_does_not_begin_larger_ones() {
    let args = ["timing", "--method", "mass-spring", "--nodes", "40,80", "--limit-s", "0.001", "--json"];
    let found = reported(&experiment(&args));
    let note = |k: usize| rows(&found)[k]["note"].as_str().unwrap();
    assert!(rows(&found).iter().all(|row| row["median_ms"].is_null()));
    assert!(note(0).starts_with("stopped at the limit of 0.001 s"), "{}", note(0));
    assert_eq!(note(1), "not begun: see 40 nodes");
}

#[test]
fn a_target_is_reached_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let found = reported(&experiment(&["navigation", "--target", "aorta", "--out", out, "--json"]));
    assert_written(folder.path(), "navigation", &found);
    let [paper, exact, row] = rows(&found) else { panic!("one target was asked for, of two wires") };
    assert_eq!((&row["target"], &row["success"]), (&"aorta".into(), &true.into()));
    assert_eq!((&paper["method"], &exact["method"]), (&"li2011-banded".into(), &"kirchhoff".into()));
    // Both straight wires go where the aorta goes on, with the same hand.
    for straight in [paper, exact] {
        assert_eq!(straight["success"], true, "{straight}");
        assert!(straight["tip_apart_mm"].as_f64().unwrap() < 3.0, "{straight}");
    }
    assert!(row["tip_apart_mm"].is_null());
    assert!(row["from_target_mm"].as_f64().unwrap() < row["path_mm"].as_f64().unwrap() / 4.0, "{row}");
    assert!(row["largest_wall_force_n"].as_f64().unwrap() > 0.0, "{row}");
    let frames = found["frames"].as_array().unwrap();
    assert!(frames.len() >= 2 && frames.len().is_multiple_of(2), "both views: {frames:?}");
    for frame in frames {
        let png = std::fs::read(frame.as_str().unwrap()).unwrap();
        assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    }
}

#[test]
fn the_loop_grows_with_the_advance() {
    let folder = tempfile::tempdir().unwrap();
    let found = reported(&experiment(&["loop", "--out", folder.path().to_str().unwrap(), "--json"]));
    assert_written(folder.path(), "loop", &found);
    // The paper's four pictures in two views by two methods, and the chart as SVG and PNG.
    let frames = found["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 2 * 4 * 2 + 2, "{frames:?}");
    assert!(frames.iter().all(|frame| Path::new(frame.as_str().unwrap()).exists()), "{frames:?}");
    assert!(found["failure"].is_null(), "{}", found["failure"]);
    let value = |row: &Value, key: &str| row[key].as_f64().unwrap();
    for method in ["li2011-banded", "kirchhoff"] {
        let own = rows(&found).iter().filter(|row| row["method"] == method);
        let stopped: Vec<&Value> = own.filter(|row| value(row, "advance_mm") > 0.0).collect();
        assert!(stopped.len() > 90, "{method}: the tip is stopped long before the end");
        let at = |advance: f64| stopped.iter().find(|row| value(row, "advance_mm") >= advance).unwrap();
        assert!(value(at(60.0), "loop_depth_mm") > value(at(20.0), "loop_depth_mm") + 10.0, "{method}");
        assert!(value(at(90.0), "loop_depth_mm") > value(at(60.0), "loop_depth_mm") + 10.0, "{method}");
        assert!(value(at(90.0), "turned_deg") > 150.0, "{method}: the tip points back");
        assert!(
            stopped.iter().all(|row| value(row, "loop_width_mm") < 30.1),
            "{method}: no wider than the tube"
        );
    }
}

#[test]
fn measured_points_stand_in_for_the_computed_truth() {
    let folder = tempfile::tempdir().unwrap();
    let points = folder.path().join("points.csv");
    // A wire that stays in the straight part, far from where it really is.
    std::fs::write(&points, "x_mm,y_mm,z_mm\n0,0,1\n0,0,101\n0,0,201\n").unwrap();
    let out = folder.path().to_str().unwrap();
    let measured = ["--measured", points.to_str().unwrap()];
    let cell = ["deformation", "--l-mm", "3", "--l-over-h", "3", "--out", out, "--json"];
    let found = reported(&experiment(&[&cell[..], &measured[..]].concat()));
    assert_written(folder.path(), "deformation", &found);
    assert!(found["ground_truth"].as_str().unwrap().starts_with("measured points of"), "{found}");
    assert!(found["convergence"].as_array().unwrap().is_empty());
    let methods: Vec<&Value> = rows(&found).iter().map(|row| &row["method"]).collect();
    assert_eq!(methods, ["li2011-banded", "li2011-banded-printed", "kirchhoff"]);
    for row in rows(&found) {
        assert_eq!((&row["l_mm"], &row["l_over_h"]), (&3.0.into(), &3.into()));
        assert_eq!(row["paper_rms_mm"], 1.62);
        let (rms, max) = (row["rms_mm"].as_f64().unwrap(), row["max_mm"].as_f64().unwrap());
        assert!(rms > 10.0 && max > rms, "a straight wire is not in the bend: {rms}, {max}");
        assert!((row["speedup"].as_f64().unwrap() * row["time_s"].as_f64().unwrap() - 2.1).abs() < 1e-9);
    }
    let off = |row: &Value| row["length_off"].as_f64().unwrap().abs();
    assert!(off(&rows(&found)[0]) < 1e-3 && off(&rows(&found)[1]) > 0.1, "as printed the wire shortens");
    assert_eq!(rows(&found)[0]["unconverged"], 0);
    // Two views of each, and the chart as SVG and PNG.
    let frames = found["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 3 * 2 + 2, "{frames:?}");
    assert!(frames.iter().all(|frame| Path::new(frame.as_str().unwrap()).exists()), "{frames:?}");
}

#[test]
fn wrong_names_and_points_are_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let points = folder.path().join("points.csv");
    let path = points.to_str().unwrap();
    let refused = |args: &[&str], says: &str| {
        let output = experiment(args);
        let text = said(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
        assert!(text.contains(says), "{args:?}: {text}");
    };
    refused(&["timing", "--method", "masspring"], "'mass-spring'");
    refused(&["navigation", "--target", "left carotd"], "'left carotid'");
    refused(&["deformation", "--method", "kirchoff"], "'kirchhoff'");
    refused(&["deformation", "--l-mm", "4"], "--l-mm 4: the paper has 1, 2 and 3");
    refused(&["deformation", "--l-over-h", "7"], "--l-over-h 7: the paper has 40, 20, 10, 5 and 3");
    refused(&["deformation", "--measured", "absent.csv"], "absent.csv");
    for (text, says) in [
        ("x_mm,y_mm,z_mm\n0,0,1\n", "at least two points"),
        ("x_mm,y_mm,z_mm\n0,0,1\n0,0,1\n", "point 2"),
        ("x_mm,y_mm,z_mm\n0,0,1\n0,0,NaN\n", "point 2"),
        ("x,y,z\n0,0,1\n0,0,2\n", "x_mm"),
    ] {
        std::fs::write(&points, text).unwrap();
        refused(&["deformation", "--measured", path], says);
    }
}

#[test]
fn coils_follow_each_other_into_a_sac_and_what_it_cannot_hold_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let small =
        ["coil", "--coils", "filling,finishing", "--length-mm", "8", "--step-mm", "1", "--element-mm", "1"];
    let found = reported(&experiment(&[&small[..], &["--out", out, "--json"]].concat()));
    assert_written(folder.path(), "coil", &found);
    let packing: Vec<f64> = rows(&found).iter().map(|row| row["packing"].as_f64().unwrap()).collect();
    assert!(packing.windows(2).all(|pair| pair[0] <= pair[1] + 1e-9), "{packing:?}");
    let whole_mm3 = 2.0 * 8.0 * std::f64::consts::FRAC_PI_4 * 0.254 * 0.254;
    let expected = whole_mm3 / found["sac"]["volume_mm3"].as_f64().unwrap();
    assert!((packing[packing.len() - 1] / expected - 1.0).abs() < 1e-6, "{packing:?} {expected}");
    assert!(rows(&found).iter().all(|row| row["crossings"] == 0 && row["herniated"] == false));
    for (flags, word) in [
        (["--length-mm", "900"], "holds no more than 50 %"),
        (["--volume-mm3", "1"], "--volume-mm3 1: give a number from 5 to 2000"),
        (["--tip-height", "1.5"], "--tip-height 1.5: give a number from 0.1 to 0.8"),
    ] {
        let refused = experiment(&[&small[..1], &flags[..]].concat());
        assert_eq!(refused.status.code(), Some(2));
        assert!(said(&refused).contains(word), "{}", said(&refused));
    }
    let file = folder.path().join("coil.csv");
    let refused = experiment(&["coil", "--out", file.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(2), "before it computes for minutes");
    assert!(said(&refused).contains("is a file: give a folder"), "{}", said(&refused));
}

/// Lamano et al. (2014): push forces are largest with framing coils, and with the catheter's tip at the top of the sac.
#[test]
fn coils_are_harder_to_push_if_they_are_stiff_and_if_the_catheter_is_near_the_dome() {
    let largest_n = |kind: &str, height: &str| {
        let coil = ["coil", "--coils", kind, "--volume-mm3", "30", "--length-mm", "12", "--step-mm", "1"];
        let found = reported(&experiment(&[&coil[..], &["--tip-height", height, "--json"]].concat()));
        let forces = rows(&found).iter().map(|row| row["push_force_n"].as_f64().unwrap());
        forces.fold(f64::MIN, f64::max)
    };
    let framing_n = ["0.15", "0.45", "0.75"].map(|height| largest_n("framing", height));
    assert!(framing_n.is_sorted() && framing_n[2] > 10.0 * framing_n[0], "{framing_n:?}");
    for (height, framing_n) in ["0.15", "0.45"].into_iter().zip(framing_n) {
        let finishing_n = largest_n("finishing", height);
        assert!(finishing_n < 0.1 * framing_n, "{finishing_n} {framing_n}");
    }
}
