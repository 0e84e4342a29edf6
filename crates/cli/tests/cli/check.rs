//! `endowire vessel check` with a choice of what is repaired, and what it calls sound.

use std::path::Path;
use std::process::Output;

use endowire_core::Vec3;
use endowire_core::vessel::{GeneratedWall, Resolution, SurfaceMesh, anatomy};
use serde_json::Value;

use crate::common::{endowire, reported, said, text};

fn check(file: &Path, arguments: &[&str]) -> Output {
    endowire().args(["vessel", "check", text(file)]).args(arguments).output().unwrap()
}

/// A straight tube in a file, without the triangles whose middles are within a distance of a place on its wall.
fn tube(folder: &Path, name: &str, hole_mm: f64, more: Option<SurfaceMesh>) -> (std::path::PathBuf, Vec3) {
    let tree = anatomy::tree("straight_tube").unwrap();
    let mut mesh = GeneratedWall::new(&tree, Resolution::fitting(&tree)).unwrap().wall.mesh().clone();
    let (low, high) = mesh.bounds_mm().unwrap();
    let middle = (low + high) / 2.0;
    let distance = |x: &Vec3| (x - middle).norm();
    let place = mesh.vertices_mm.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).copied().unwrap();
    let old = std::mem::take(&mut mesh.triangles);
    let centre = |t: &[u32; 3]| t.iter().map(|v| mesh.vertices_mm[*v as usize]).sum::<Vec3>() / 3.0;
    mesh.triangles = old.into_iter().filter(|t| (centre(t) - place).norm() > hole_mm).collect();
    if let Some(more) = more {
        let first = mesh.vertices_mm.len() as u32;
        mesh.vertices_mm.extend(more.vertices_mm);
        mesh.triangles.extend(more.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let path = folder.join(name);
    mesh.write(&path).unwrap();
    (path, place)
}

fn openings(report: &Value) -> usize {
    report["openings"].as_array().unwrap().len()
}

#[test]
fn holes_are_closed_unless_they_are_meant_or_nothing_is_repaired() {
    let folder = tempfile::tempdir().unwrap();
    let (file, place) = tube(folder.path(), "hole.stl", 0.6, None);
    let at = format!("{},{},{}", place.x, place.y, place.z);
    assert_eq!(openings(&reported(&check(&file, &["--json"]))), 2);
    let told = String::from_utf8(check(&file, &[]).stdout).unwrap();
    assert!(told.contains("\nrepaired on loading:\n") && told.contains("1 holes and tears closed"), "{told}");
    assert!(!told.contains("needs you"), "{told}");
    assert_eq!(openings(&reported(&check(&file, &["--json", "--keep-open", &at]))), 3);
    assert_eq!(openings(&reported(&check(&file, &["--json", "--repair", "none"]))), 3);
    let (whole, _) = tube(folder.path(), "whole.stl", 0.0, None);
    for (arguments, words) in [
        (["--repair", "some"], "must be \"all\" or \"none\""),
        (["--keep-open", "1,2"], "expected a place"),
        (["--keep-open", "1,2,3"], "--keep-open"),
    ] {
        let refused = check(&whole, &arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        assert!(said(&refused).contains(words), "{}", said(&refused));
    }
}

#[test]
fn pieces_are_listed_with_a_place_that_names_them() {
    let folder = tempfile::tempdir().unwrap();
    let (file, place) = tube(folder.path(), "alone.stl", 0.0, None);
    assert_eq!(reported(&check(&file, &["--json"]))["pieces"].as_array().unwrap().len(), 0);
    assert!(!String::from_utf8(check(&file, &[]).stdout).unwrap().contains("piece_at_mm"));
    // A clot in the middle of the lumen, beside the place on the wall.
    let middle = Vec3::new(0.0, 0.0, place.z);
    let clot = SurfaceMesh::cuboid(middle - Vec3::repeat(1.0), middle + Vec3::repeat(1.0), 1.0);
    let (file, _) = tube(folder.path(), "clot.stl", 0.0, Some(clot));
    let pieces = reported(&check(&file, &["--json"]))["pieces"].clone();
    let size = |k: usize| pieces[k]["size_mm"][2].as_f64().unwrap();
    assert!(pieces.as_array().unwrap().len() == 2 && size(0) > 50.0, "{pieces}");
    assert!((size(1) - 2.0).abs() < 1e-3, "{pieces}");
    let at: Vec<f64> = (0..3).map(|k| pieces[1]["at_mm"][k].as_f64().unwrap()).collect();
    let off_mm = (Vec3::new(at[0], at[1], at[2]) - middle).amax();
    assert!((off_mm - 1.0).abs() < 1e-3, "{at:?}");
    let told = String::from_utf8(check(&file, &[]).stdout).unwrap();
    assert!(told.contains("2.0 × 2.0 × 2.0 mm, 48 triangles; piece_at_mm = ["), "{told}");
}

#[test]
fn a_sac_that_is_not_joined_is_no_sound_vessel() {
    let folder = tempfile::tempdir().unwrap();
    let beside = SurfaceMesh::cuboid(Vec3::new(50.0, 0.0, 0.0), Vec3::new(65.0, 15.0, 15.0), 2.0);
    let (file, _) = tube(folder.path(), "apart.stl", 0.0, Some(beside));
    let report = reported(&check(&file, &["--json"]));
    assert_eq!(report["sound"], false);
    assert!(report["faults"].to_string().contains("not joined to the vessel"), "{}", report["faults"]);
    let told = String::from_utf8(check(&file, &[]).stdout).unwrap();
    assert!(
        told.lines()
            .next()
            .is_some_and(|line| line.ends_with("loading does not mend all of it: see \"needs you\" below"))
    );
    assert!(told.contains("\nneeds you:\n  1 closed pieces that are not joined to the vessel"), "{told}");
    let (alone, _) = tube(folder.path(), "alone.stl", 0.0, None);
    assert_eq!(reported(&check(&alone, &["--json"]))["sound"], true, "the twin");
}
