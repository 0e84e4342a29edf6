//! `endowire vessel from-labels`: from a segmentation to a vessel in which a wire is pushed, in front of its tomogram.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::common::{assets, endowire, reported, said, text};

fn vessel(arguments: &[&str]) -> Output {
    endowire().arg("vessel").args(arguments).output().unwrap()
}

fn labels() -> String {
    text(&assets().join("ct/abdomen_labels.nii.gz")).to_owned()
}

/// The vessel of aorta and iliac arteries in a folder, and what is said of it.
fn made(folder: &Path) -> (String, Value) {
    let out = text(&folder.join("aorta.stl")).to_owned();
    let labels = labels();
    let arguments =
        ["from-labels", &labels, "--label", "52", "--label", "65", "--label", "66", "--out", &out, "--json"];
    let document = reported(&vessel(&arguments));
    (out, document)
}

#[test]
fn a_segmentation_becomes_a_sound_vessel_with_its_radii_and_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (out, document) = made(folder.path());
    let kinds: Vec<&str> =
        document["ends"].as_array().unwrap().iter().map(|end| end["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == "border").count(), 3, "{document}");
    assert_eq!(kinds.iter().filter(|kind| **kind == "blunt").count(), 1, "{document}");
    let check = &document["check"];
    assert_eq!(check["sound"], true, "{check}");
    let openings = check["openings"].as_array().unwrap();
    let radii: Vec<f64> = openings.iter().map(|opening| opening["radius_mm"].as_f64().unwrap()).collect();
    // The renal artery is three voxels wide and two slices high.
    for (radius, (drawn, bound)) in radii.iter().zip([(9.0, 0.02), (5.0, 0.08), (5.0, 0.08), (3.3, 0.15)]) {
        assert!((radius / drawn - 1.0).abs() < bound, "{radii:?}");
    }
    assert_eq!(openings.len(), 4);
    // The same label map gives the same file.
    let before = std::fs::read(&out).unwrap();
    made(folder.path());
    assert_eq!(std::fs::read(&out).unwrap(), before);
    // One label alone is another vessel: the twin.
    let one = text(&folder.path().join("one.stl")).to_owned();
    let alone = reported(&vessel(&["from-labels", &labels(), "--label", "65", "--out", &one, "--json"]));
    assert_eq!(alone["check"]["openings"].as_array().unwrap().len(), 2, "{alone}");
}

#[test]
fn the_vessel_has_a_centre_line_lets_a_wire_pass_and_lies_in_its_tomogram() {
    let folder = tempfile::tempdir().unwrap();
    let (out, _) = made(folder.path());
    let line = reported(&vessel(&["centreline", &out, "--json"]));
    assert_eq!(line["targets"].as_array().unwrap().len(), 3, "{line}");
    let wire = text(&assets().join("devices/wire_035_hydrophilic_angled.toml")).to_owned();
    let passes = vessel(&["passable", &out, "--device", &wire, "--to", "0"]);
    assert!(passes.status.success(), "{}", said(&passes));
    let scene = folder.path().join("abdomen.toml");
    let of = |ct: &str, offset: &str| {
        format!(
            "name = \"abdomen\"\n[vessel]\nfile = \"aorta.stl\"\n[device]\nfile = {wire:?}\n[sheath]\nopening = 1\n[[script]]\nadvance_mm = 20.0\n\
             step_mm = 5.0\n[view]\nviews = [\"fluoro\"]\nsize_px = [64, 64]\n[view.patient.ct]\nfile = {ct:?}\n{offset}"
        )
    };
    let run = |content: String| {
        std::fs::write(&scene, content).unwrap();
        let out = folder.path().join("out");
        endowire().args(["run", text(&scene), "--out", text(&out), "--force"]).output().unwrap()
    };
    let ct = text(&assets().join("ct/abdomen.nii.gz")).to_owned();
    let good = run(of(&ct, ""));
    assert!(good.status.success(), "{}", said(&good));
    assert!(folder.path().join("out/frames").read_dir().unwrap().count() > 0);
    let beside = run(of(&ct, "offset_mm = [900.0, 0.0, 0.0]\n"));
    assert!(said(&beside).contains("holds nothing of the vessel"), "{}", said(&beside));
    // A tomogram is no label map.
    let wrong = vessel(&["from-labels", &ct, "--label", "1", "--out", &out]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        said(&wrong).contains("is no label map") && said(&wrong).contains("abdomen.nii.gz"),
        "{}",
        said(&wrong)
    );
}

#[test]
fn wrong_labels_are_refused_with_those_that_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(&folder.path().join("a.stl")).to_owned();
    let refused = |label: &[&str]| {
        let labels = labels();
        let mut arguments = vec!["from-labels", labels.as_str(), "--out", &out];
        arguments.extend(label);
        let output = vessel(&arguments);
        assert_eq!(output.status.code(), Some(2));
        assert!(!Path::new(&out).exists());
        said(&output)
    };
    let message = refused(&["--label", "51"]);
    assert!(message.contains("--label = 51: has no voxel: it has the labels 52 ("), "{message}");
    assert!(
        message.contains("65 (") && message.contains("66 (") && message.contains("abdomen_labels.nii.gz")
    );
    assert!(refused(&["--label", "0"]).contains("background"));
    assert!(refused(&["--label", "aorta"]).contains("--label"));
    assert!(refused(&[]).contains("--label"));
}
