//! What a build without a feature says where that is needed, and that a build with it does not say so.
//!
//! `cargo test -p endowire-core --no-default-features --test features` takes the other side of each comparison.

use std::path::Path;

use endowire_core::{
    CentrelineTree, Device, Error, GeneratedWall, KirchhoffOptions, Resolution, Result, Scene, Sheath,
    Simulation, SurfaceMesh, Vec3, Wall, anatomy,
};

/// Fails with [`Error::Feature`] exactly where `feature` is off, and names it and what needed it.
fn needs<T>(feature: &str, is_on: bool, what: &str, result: Result<T>) {
    let missing = match result {
        Err(Error::Feature { what, feature }) => Some((what, feature)),
        _ => None,
    };
    match missing {
        Some((named, missing)) => {
            assert!(!is_on, "{feature} is on, and {named} needs it");
            assert_eq!(missing, feature);
            assert!(named.contains(what), "{named}: names no {what}");
        }
        None => assert!(is_on, "{feature} is off, and nothing said so"),
    }
}

#[test]
fn scenes_need_toml() {
    let text = "[vessel]\nanatomy = \"curved_tube\"\n";
    needs(
        "scene-files",
        cfg!(feature = "scene-files"),
        "a.toml",
        Scene::from_toml(text, Path::new("a.toml")),
    );
}

#[test]
fn surfaces_and_lines_of_vtk_need_xml() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("line.vtp");
    std::fs::write(&file, "<VTKFile/>").unwrap();
    needs("vtp", cfg!(feature = "vtp"), "line.vtp", SurfaceMesh::read(&file, 1.0));
    needs("vtp", cfg!(feature = "vtp"), "line.vtp", CentrelineTree::read(&file));
}

#[test]
fn markups_need_json() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("line.mrk.json");
    std::fs::write(&file, "{}").unwrap();
    needs("markups", cfg!(feature = "markups"), "line.mrk.json", CentrelineTree::read(&file));
}

#[test]
fn parts_that_overlap_need_a_union() {
    let mut surface = SurfaceMesh::cuboid(Vec3::zeros(), Vec3::repeat(10.0), 2.0);
    let other = SurfaceMesh::cuboid(Vec3::new(5.0, 3.0, 3.0), Vec3::new(20.0, 7.0, 7.0), 1.0);
    let first = surface.vertices_mm.len() as u32;
    surface.vertices_mm.extend(other.vertices_mm);
    surface.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|corner| corner + first)));
    needs("union", cfg!(feature = "union"), "2 parts", Wall::from_surface(&surface));
}

#[test]
fn loops_that_touch_need_a_sparse_solver() {
    let vessel = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(3.0)).unwrap();
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0).unwrap();
    let wire = Device::uniform(100.0, 0.45, 10.0).unwrap();
    let options = KirchhoffOptions { self_contact: true, ..KirchhoffOptions::default() };
    let simulation = Simulation::builder(vessel.wall, wire, sheath).method(&options).build();
    needs("self-contact", cfg!(feature = "self-contact"), "method.self_contact", simulation);
}
