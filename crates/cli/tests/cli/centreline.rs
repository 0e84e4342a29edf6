//! `endowire vessel centreline` and `endowire vessel passable`.

use std::path::Path;

use crate::common::{assets, reported, said, text};
use serde_json::Value;

fn vessel(arguments: &[&str]) -> std::process::Output {
    crate::common::endowire().arg("vessel").args(arguments).output().unwrap()
}

fn tube() -> String {
    text(&assets().join("vessels/curved_tube.stl")).to_owned()
}

fn wire() -> String {
    text(&assets().join("devices/wire_035_hydrophilic_angled.toml")).to_owned()
}

/// The centre line of the tube, in a folder.
fn found(folder: &Path) -> (String, Value) {
    let table = text(&folder.join("tree.csv")).to_owned();
    let document = reported(&vessel(&["centreline", &tube(), "--out", &table, "--json"]));
    (table, document)
}

#[test]
fn the_centre_line_of_a_surface_is_a_table_that_makes_the_surface_again() {
    let folder = tempfile::tempdir().unwrap();
    let (table, document) = found(folder.path());
    let branch = &document["branches"][0];
    let length_mm = 95.0 + 45.0 * std::f64::consts::PI + 20.0;
    assert!((branch["length_mm"].as_f64().unwrap() - length_mm).abs() < 1.0, "{document}");
    assert!((branch["least_radius_mm"].as_f64().unwrap() - 4.0).abs() < 0.1, "{document}");
    assert_eq!((&branch["from"], &branch["to"]), (&0.into(), &document["targets"][0]["row"]));
    assert_eq!(document["rows"], branch["to"].as_u64().unwrap() + 1);
    let again = text(&folder.path().join("again.stl")).to_owned();
    let report = reported(&vessel(&["generate", &table, "--out", &again, "--edge-mm", "2", "--json"]));
    assert_eq!((&report["sound"], report["openings"].as_array().unwrap().len()), (&true.into(), 2));
    // It begins where devices come in: in an arch at its narrower end, from the groin.
    let arch = text(&assets().join("vessels/aortic_arch.stl")).to_owned();
    for (file, inlet) in [(tube(), 0), (arch, 1)] {
        let report = reported(&vessel(&["check", &file, "--json"]));
        assert_eq!(report["inlet"], inlet, "{file}");
        assert!(report["openings"][inlet]["centre_mm"][2].as_f64().unwrap().abs() < 1.0, "{file}");
        let lines = String::from_utf8(vessel(&["check", &file]).stdout).unwrap();
        let reported = lines.lines().find(|line| line.contains("devices come in here")).unwrap();
        assert!(reported.contains(&format!("opening {inlet}")), "{reported}");
    }
    let lines = String::from_utf8(vessel(&["centreline", &tube()]).stdout).unwrap();
    assert!(lines.contains("opening 1") && lines.contains("least radius mm"), "{lines}");
}

#[test]
fn a_thin_wire_passes_and_a_thick_one_is_blocked() {
    let folder = tempfile::tempdir().unwrap();
    let (table, _) = found(folder.path());
    let thick = text(&folder.path().join("thick.toml")).to_owned();
    let section = "[[section]]\nlength_mm = 400.0\nradius_mm = 4.5\nbending_stiffness_nmm2 = 10.0\n";
    std::fs::write(&thick, section).unwrap();
    let file = tube();
    let passage = |device: &str, more: &[&str]| {
        let given: Vec<&str> = ["passable", &file, "--device", device, "--json"]
            .into_iter()
            .chain(more.iter().copied())
            .collect();
        reported(&vessel(&given))
    };
    let thin = passage(&wire(), &["--to", "1"]);
    assert!(["passes", "tight"].contains(&thin["passage"].as_str().unwrap()), "{thin}");
    assert!(
        (thin["sharpest"]["bend_radius_mm"].as_f64().unwrap() - 45.0).abs() < 3.0,
        "{}",
        thin["sharpest"]
    );
    let named = passage(&wire(), &["--to", "opening 1", "--centreline", &table]);
    assert_eq!(named["passage"], thin["passage"]);
    let blocked = passage(&thick, &["--to", "0,0,50", "--from", "0"]);
    assert_eq!(blocked["passage"], "blocked");
    assert_eq!((blocked["reaches_mm"].as_f64(), &thin["reaches_mm"]), (Some(0.0), &thin["length_mm"]));
    let lines =
        String::from_utf8(vessel(&["passable", &tube(), "--device", &wire(), "--to", "1"]).stdout).unwrap();
    assert!(lines.contains("narrowest") && lines.contains("sharpest bend"), "{lines}");
    let pictures = [&wire(), &thick].map(|device| {
        let path = folder.path().join("way.png");
        passage(device, &["--to", "1", "--picture", text(&path)]);
        let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels
    });
    // The way of what is blocked has the colour of no room, and that of what passes has it in the mark of its narrowest place alone.
    let red = pictures.map(|pixels| pixels.chunks(3).filter(|rgb| *rgb == [200, 30, 30]).count());
    assert!(red[1] > 5 * red[0] && red[0] > 0, "{red:?}");
}

#[test]
fn where_branches_meet_again_a_way_takes_the_arm_that_via_names() {
    let folder = tempfile::tempdir().unwrap();
    let table = text(&folder.path().join("ring.csv")).to_owned();
    let surface = text(&folder.path().join("ring.stl")).to_owned();
    // Straight along z, and a longer arm beside it from 20 to 100 mm.
    let mut rows: Vec<String> = (0..27).map(|k| format!("0 0 {} 4 {}", 5 * k, k - 1)).collect();
    rows[26] += " end";
    for k in 1..10 {
        let x = 1.6 * f64::from(k * (10 - k));
        let parent = if k == 1 { 4 } else { 25 + k };
        let name = match k {
            5 => " far arm",
            9 => " joins 20",
            _ => "",
        };
        rows.push(format!("{x} 0 {} 3 {parent}{name}", 20 + 8 * k));
    }
    std::fs::write(&table, rows.join("\n")).unwrap();
    reported(&vessel(&["generate", &table, "--out", &surface, "--edge-mm", "1.5", "--json"]));
    let wire = wire();
    let passage = |more: &[&str]| {
        let given =
            ["passable", &surface, "--device", &wire, "--json"].into_iter().chain(more.iter().copied());
        vessel(&given.collect::<Vec<_>>())
    };
    let length_mm = |more: &[&str]| reported(&passage(more))["length_mm"].as_f64().unwrap();
    let in_table = ["--centreline", &table, "--to", "end"];
    let straight_mm = length_mm(&in_table);
    let around_mm = length_mm(&[&in_table[..], &["--via", "far arm"]].concat());
    assert!(
        (straight_mm - 130.0).abs() < 1e-6 && around_mm > straight_mm + 15.0,
        "{straight_mm} {around_mm}"
    );
    // In the surface alone the arm has a name of its own, and a place does as well.
    let ends = reported(&vessel(&["check", &surface, "--json"]));
    assert_eq!(ends["rings"], 1, "{ends}");
    let [from, to] = if ends["inlet"] == 0 { ["0", "1"] } else { ["1", "0"] };
    let found = ["--from", from, "--to", to];
    assert!((length_mm(&found) / straight_mm - 1.0).abs() < 0.03);
    for via in ["arm 1", "40,0,60"] {
        let found_mm = length_mm(&[&found[..], &["--via", via]].concat());
        assert!((found_mm / around_mm - 1.0).abs() < 0.03, "{via}: {found_mm} {around_mm}");
    }
    let refused = passage(&[&in_table[..], &["--via", "nowhere"]].concat());
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("--via = \"nowhere\""), "{}", said(&refused));
}

#[test]
fn ends_that_are_none_are_refused_by_their_flag() {
    let folder = tempfile::tempdir().unwrap();
    let (table, _) = found(folder.path());
    let device = wire();
    for (arguments, words) in [
        (vec!["centreline", "--from", "5"], "--from = opening 5: the surface has 2 openings"),
        (vec!["centreline", "--to", "100,0,0"], "--to = [100, 0, 0]: is not inside"),
        (vec!["centreline", "--to", "1,2"], "a place x,y,z in mm"),
        (vec!["passable", "--to", "nowhere"], "--centreline FILE"),
        (vec!["passable", "--to", "opening 2", "--centreline", &table], "its targets are opening 1"),
        (vec!["passable", "--to", "opening 0"], "--to = opening 0: the way begins there"),
        (vec!["passable", "--to", "1", "--force-n", "0"], "--force-n = 0: must be positive"),
        (vec!["passable", "--to", "1", "--picture", "way.svg"], "--picture way.svg: name a file .png"),
    ] {
        let file = tube();
        let mut given = vec![arguments[0], &file];
        if arguments[0] == "passable" {
            given.extend(["--device", &device]);
        }
        given.extend(&arguments[1..]);
        let output = vessel(&given);
        assert_eq!(output.status.code(), Some(2), "{given:?}");
        assert!(said(&output).contains(words), "{given:?}: {}", said(&output));
    }
}
