//! `endowire device`, the pages made with it, and devices of the catalogue in fluoroscopy.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{said, workspace};
use npyz::NpyFile;
use serde_json::Value;

/// Runs in the workspace, where `assets` is.
fn endowire(args: &[&str]) -> Output {
    crate::common::endowire().args(args).current_dir(workspace()).output().unwrap()
}

fn reported(output: &Output) -> String {
    assert!(output.status.success(), "{}", said(output));
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn table_and_picture_of_the_guide_are_what_the_command_writes() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("devices.svg");
    let table = reported(&endowire(&["device", "list", "--out", picture.to_str().unwrap()]));
    let guide = std::fs::read_to_string(workspace().join("docs/guide/2-device.md")).unwrap();
    assert!(guide.contains(&table), "the guide has another table than:\n{table}");
    let fresh = std::fs::read(picture).unwrap();
    assert!(fresh.len() < 60_000, "{} bytes", fresh.len());
    let kept = std::fs::read(workspace().join("assets/pictures/devices.svg")).unwrap();
    assert!(fresh == kept, "endowire device list --out assets/pictures/devices.svg writes another picture");
}

#[test]
fn a_device_is_shown_part_by_part_with_sizes_in_every_unit() {
    let file = "assets/devices/catheter_5f_cobra_c2.toml";
    let table = reported(&endowire(&["device", "show", file]));
    for word in
        ["cobra curve", "0.042 (110°)", "0.017 (25° to 180°)", "1.667", "5.0", "0.0656", "1.168", "estimate"]
    {
        assert!(table.contains(word), "{word} in:\n{table}");
    }
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("cobra.png");
    let json = reported(&endowire(&["device", "show", file, "--json", "--out", picture.to_str().unwrap()]));
    let shown: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&shown["kind"], &shown["length_mm"]), (&"catheter".into(), &800.0.into()));
    assert_eq!(shown["parts"][1]["part"], "tip curve");
    assert!((shown["parts"][1]["bend_deg"].as_f64().unwrap() - 60.0).abs() < 1e-9);
    assert_eq!(shown["parts"].as_array().unwrap().last().unwrap()["to_mm"], 800.0);
    let png = png::Decoder::new(BufReader::new(File::open(picture).unwrap())).read_info().unwrap();
    assert_eq!(png.info().width, 1000);
}

#[test]
fn device_show_reports_errors_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let wire = "assets/devices/microwire_014.toml";
    let text = std::fs::read_to_string(workspace().join(wire)).unwrap();
    let spoilt = folder.path().join("spoilt.toml");
    std::fs::write(&spoilt, text.replacen("\"platinum\"", "\"platinium\"", 1)).unwrap();
    let spoilt = spoilt.to_str().unwrap();
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    for (args, words) in [
        (vec!["show", "no.toml"], vec!["no.toml"]),
        (vec!["show", wire, "--out", "a.jpg"], vec!["--out a.jpg", ".svg or .png"]),
        (
            vec!["show", spoilt],
            vec!["spoilt.toml", "part \"shaped tip\".coat.material", "did you mean platinum"],
        ),
        (vec!["list", "no/folder"], vec!["no/folder", "name a folder"]),
        (vec!["list", empty.to_str().unwrap()], vec!["no device files"]),
    ] {
        let output = endowire(&[&["device"], &args[..]].concat());
        let error = said(&output);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

/// A microcatheter 30 mm in a straight tube, with what else the scene says.
fn scene(folder: &Path, device: &str, more: &str) -> String {
    let assets = workspace().join("assets");
    let path = folder.join("scene.toml");
    let text = format!(
        "[vessel]\nfile = \"{0}/vessels/straight_tube.stl\"\n[device]\nfile = \"{device}\"\n\
         [sheath]\nposition_mm = [0.0, 0.0, 1.0]\ndirection = [0.0, 0.0, 1.0]\n[[script]]\nadvance_mm = 30.0\nstep_mm = 5.0\n\
         [view]\nsize_px = [200, 200]\nbackend = \"cpu\"\n[view.c_arm]\npixel_mm = 0.3\nisocentre_mm = [0.0, 0.0, 16.0]\n{more}",
        assets.display()
    );
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn fluoroscopy_draws_the_materials_of_the_catalogue() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    // Arrays by the material in their names.
    let draw = |scene: &str| -> Vec<PathBuf> {
        let args = ["fluoro", scene, "--raw", "--json", "--out", out.to_str().unwrap()];
        let written: Value = serde_json::from_str(&reported(&endowire(&args))).unwrap();
        written["files"].as_array().unwrap().iter().map(|f| out.join(f.as_str().unwrap())).collect()
    };
    let of = |files: &[PathBuf], material: &str| {
        let end = format!("{material}_mm.npy");
        files.iter().find(|file| file.to_str().unwrap().ends_with(&end)).cloned()
    };
    let pixels = |path: PathBuf| -> Vec<f32> {
        NpyFile::new(BufReader::new(File::open(path).unwrap())).unwrap().into_vec().unwrap()
    };
    let device = workspace().join("assets/devices/microcatheter_27f.toml");
    let files = draw(&scene(folder.path(), device.to_str().unwrap(), ""));
    let polymer = pixels(of(&files, "pebax_baso4_40").unwrap());
    let platinum = pixels(of(&files, "platinum").unwrap());
    assert!(of(&files, "steel_316l").is_none());
    let longest = |map: &[f32]| map.iter().copied().fold(0.0f32, f32::max);
    let covered = |map: &[f32]| map.iter().filter(|mm| **mm > 0.0).count();
    // A tube of radii R and r shows 2 (R − r) of its wall in the middle and 2 √(R² − r²) at the edge of its lumen; a pixel is a quarter of
    // this one, so that some ray goes between. The wall has R = 0.4 and r = 0.2667 mm, the band R = 0.4 and r = 0.36 mm.
    assert!((0.266..=0.597).contains(&longest(&polymer)), "{}", longest(&polymer));
    assert!((0.079..=0.349).contains(&longest(&platinum)), "{}", longest(&platinum));
    // The band is 1 of 30 mm.
    let share = covered(&platinum) as f64 / covered(&polymer) as f64;
    assert!((0.01..0.1).contains(&share), "{share}");
    // What a scene says of its device comes first.
    let files =
        draw(&scene(folder.path(), device.to_str().unwrap(), "[[view.device]]\nmaterial = \"tungsten\"\n"));
    assert!(of(&files, "tungsten").is_some() && of(&files, "platinum").is_none());
    // An unknown material is reported before anything is drawn.
    let text = std::fs::read_to_string(&device).unwrap().replace("\"platinum\"", "\"platinun\"");
    let spoilt = folder.path().join("spoilt.toml");
    std::fs::write(&spoilt, text).unwrap();
    let output = endowire(&["fluoro", &scene(folder.path(), spoilt.to_str().unwrap(), "")]);
    assert_eq!(output.status.code(), Some(2));
    let error = said(&output);
    assert!(
        error.contains("part \"marker\".coat.material = \"platinun\"") && error.contains("spoilt.toml"),
        "{error}"
    );
}

#[test]
fn medium_comes_through_what_has_a_lumen_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let tree = workspace().join("assets/vessels/curved_tube.csv");
    let scene = |device: &str, more: &str, in_view: &str| {
        let device = workspace().join("assets/devices").join(device);
        let text = format!(
            "name = \"a\"\n[vessel]\nfile = {:?}\n[device]\nfile = {:?}\n[sheath]\nposition_mm = [0.0, 0.0, 1.0]\n\
             direction = [0.0, 0.0, 1.0]\n[method]\nname = \"kirchhoff\"\n[[script]]\nadvance_mm = 4.0\nspeed_mm_per_s = 4.0\n{more}\n\
             [view]\nviews = [\"fluoro\"]\nsize_px = [64, 64]\nflow.tree = {:?}\n{in_view}",
            workspace().join("assets/vessels/curved_tube.stl"),
            device,
            tree
        );
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let by_script = "[[script]]\ninject = { ml = 4.0, ml_per_s = 4.0 }\n";
    let at_tip = "[[view.injection]]\nstart_s = 0.0\nduration_s = 1.0\nrate_ml_per_s = 2.0\nat_tip = true\n";
    let out = folder.path().join("out");
    let drawn = |device: &str, more: &str, in_view: &str| {
        let scene = scene(device, more, in_view);
        endowire(&["fluoro", &scene, "--steps", "2", "--out", out.to_str().unwrap()])
    };
    for (more, in_view, named) in [(by_script, "", "script.inject"), ("", at_tip, "view.injection[0].at_tip")]
    {
        let wire = drawn("wire_035_soft.toml", more, in_view);
        assert!(wire.status.code() == Some(2) && said(&wire).contains(named), "{named}: {}", said(&wire));
        // The twin: a catheter.
        let catheter = drawn("catheter_4f_vertebral.toml", more, in_view);
        assert!(catheter.status.success(), "{}", said(&catheter));
    }
}
