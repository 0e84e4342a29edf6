//! Surfaces that come from elsewhere: other formats, axes, units, and vessels that are cut through.

use std::path::Path;

use serde_json::Value;

use crate::common::{assets, endowire, said, text};

/// The corners of the curved tube's triangles, x y z each.
fn corners() -> Vec<[f32; 3]> {
    let stl = std::fs::read(assets().join("vessels/curved_tube.stl")).unwrap();
    let number = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let corner = |bytes: &[u8]| [0, 4, 8].map(|at| number(&bytes[at..]));
    stl[84..]
        .chunks_exact(50)
        .flat_map(|record| record[12..48].chunks_exact(12).map(corner).collect::<Vec<_>>())
        .collect()
}

/// A legacy VTK file of triangles.
fn vtk(path: &Path, title: &str, corners: &[[f32; 3]]) {
    let count = corners.len() / 3;
    let mut file = format!(
        "# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET POLYDATA\nPOINTS {} float\n",
        corners.len()
    );
    corners.iter().for_each(|[x, y, z]| file += &format!("{x} {y} {z}\n"));
    file += &format!("POLYGONS {count} {}\n", 4 * count);
    (0..count).for_each(|k| file += &format!("3 {} {} {}\n", 3 * k, 3 * k + 1, 3 * k + 2));
    std::fs::write(path, file).unwrap();
}

/// The report on a file, read so.
fn check(path: &Path, options: &[&str]) -> Value {
    let output = endowire().args(["vessel", "check", text(path), "--json"]).args(options).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn axes_are_obeyed_and_can_be_said() {
    let folder = tempfile::tempdir().unwrap();
    let [ras, plain] = ["ras.vtk", "plain.vtk"].map(|name| folder.path().join(name));
    let turned: Vec<[f32; 3]> = corners().into_iter().map(|[x, y, z]| [-x, -y, z]).collect();
    vtk(&ras, "3D Slicer output. SPACE=RAS", &turned);
    vtk(&plain, "turned", &turned);
    let right = check(&assets().join("vessels/curved_tube.stl"), &[]);
    for (path, options, same) in [
        (&ras, &[][..], true),
        (&plain, &[], false),
        (&plain, &["--axes", "ras"], true),
        (&ras, &["--axes", "LPS"], false),
    ] {
        let reported = check(path, options);
        assert_eq!(reported["sound"], true, "{reported}");
        // Text and bytes are rounded in their own ways.
        let high =
            |report: &Value| (0..3).map(|k| report["high_mm"][k].as_f64().unwrap()).collect::<Vec<_>>();
        let off = high(&reported).iter().zip(high(&right)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert_eq!(off < 1e-4, same, "{options:?} {reported}");
    }
    let refused = endowire().args(["vessel", "check", text(&plain), "--axes", "LAS"]).output().unwrap();
    assert!(refused.status.code() == Some(2) && said(&refused).contains("LPS"), "{}", said(&refused));
}

#[test]
fn a_unit_that_may_be_another_is_reported_and_never_taken() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cm.vtk");
    let small: Vec<[f32; 3]> = corners().into_iter().map(|corner| corner.map(|c| c / 10.0)).collect();
    vtk(&path, "centimetres", &small);
    let hint = "if the file is in centimetres";
    let reported = check(&path, &[]);
    assert!(reported["hints"][0].as_str().is_some_and(|said| said.contains(hint)), "{reported}");
    assert!(reported["high_mm"][2].as_f64().is_some_and(|mm| mm < 20.0), "{reported}");
    assert_eq!(check(&path, &["--unit-mm", "10"])["hints"], serde_json::json!([]));
    let new = |name: &str, options: &[&str]| {
        let made = folder.path().join(name);
        let output =
            endowire().arg("new").arg(&made).args(["--vessel", text(&path)]).args(options).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        (made.join("scene.toml"), said(&output))
    };
    let (scene, said_new) = new("doubtful", &[]);
    assert!(said_new.contains(hint), "{said_new}");
    // Its wire is one that fits the tube as it is read, and a run names the doubt too.
    let run =
        endowire().args(["run", text(&scene), "--out", text(&folder.path().join("there"))]).output().unwrap();
    assert!(run.status.code() == Some(0) && said(&run).contains(hint), "{}", said(&run));
    let (scene, said_new) = new("right", &["--unit-mm", "10", "--axes", "LPS"]);
    assert!(!said_new.contains(hint), "{said_new}");
    let written = std::fs::read_to_string(&scene).unwrap();
    assert!(written.contains("unit_mm = 10.0\naxes = \"LPS\"\n"), "{written}");
    let out = folder.path().join("out");
    let short = ["--set", "script[0].advance_mm=4", "--set", "view.views=[]", "--out", text(&out)];
    let run = endowire().args(["run", text(&scene)]).args(short).output().unwrap();
    assert!(run.status.code() == Some(0) && !said(&run).contains(hint), "{}", said(&run));
}

#[test]
fn a_faulty_surface_is_reported_why_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("one.obj");
    for (text, verdict) in [
        (
            "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n",
            "faulty: it encloses no volume, as a sheet: no device can be in it",
        ),
        (
            "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
            "faulty: 1 flipped triangle; it is repaired on loading, as told below",
        ),
    ] {
        std::fs::write(&file, text).unwrap();
        let output = endowire().args(["vessel", "check"]).arg(&file).output().unwrap();
        let reported = String::from_utf8(output.stdout).unwrap();
        assert!(reported.lines().next().is_some_and(|line| line.ends_with(verdict)), "{reported}");
    }
}

#[test]
fn a_vessel_that_is_cut_through_is_never_sound() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.vtk");
    let all = corners();
    // What is left without the triangles that reach across 10 mm.
    let [low, high] = [9.0, 11.0];
    let apart: Vec<[f32; 3]> = all
        .chunks_exact(3)
        .filter(|corners| {
            corners.iter().any(|c| c[0] > 8.0) || !corners.iter().any(|c| (low..high).contains(&c[2]))
        })
        .flatten()
        .copied()
        .collect();
    assert!(apart.len() < all.len());
    vtk(&path, "cut", &apart);
    let reported = check(&path, &[]);
    assert_eq!(
        (&reported["sound"], reported["facing_openings"].as_array().map(Vec::len)),
        (&false.into(), Some(1)),
        "{reported}"
    );
    assert!(reported["hints"].to_string().contains("face each other"), "{reported}");
    let whole = check(&assets().join("vessels/curved_tube.stl"), &[]);
    assert_eq!((&whole["sound"], &whole["facing_openings"]), (&true.into(), &serde_json::json!([])));
}
