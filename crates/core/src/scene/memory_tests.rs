//! A scene is the same from files in memory as from the file system.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Scene;
use crate::file::InMemory;
use crate::vessel::NoStore;

const SCENE: &str = "[vessel]\ntree = \"../vessels/tube.csv\"\nedge_mm = 2.0\n[device]\nfile = \"../devices/wire.toml\"\n[sheath]\nopening = 0\n";
const TREE: &str = "0 0 0 3 -1\n0 0 20 3 0\n0 0 40 3 1\n";
const WIRE: &str = "[[section]]\nlength_mm = 60.0\nradius_mm = 0.4\nbending_stiffness_nmm2 = 10.0\n";

fn files() -> BTreeMap<PathBuf, Vec<u8>> {
    [("scenes/a.toml", SCENE), ("scenes/../vessels/tube.csv", TREE), ("scenes/../devices/wire.toml", WIRE)]
        .map(|(path, text)| (path.into(), text.as_bytes().to_vec()))
        .into()
}

fn tip_mm(scene: &Scene) -> crate::Result<Option<crate::Vec3>> {
    let mut simulation = scene.simulation(&NoStore)?;
    simulation.step(crate::insertion::Command::advance(5.0))?;
    Ok(simulation.shape().tip_mm())
}

#[test]
fn files_in_memory_do_for_those_of_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    for (path, bytes) in files() {
        let path = folder.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let on_disk = Scene::read(&folder.path().join("scenes/a.toml")).unwrap();
    let in_memory = Scene::read_of(Arc::new(InMemory(files())), Path::new("scenes/a.toml")).unwrap();
    assert!(tip_mm(&in_memory).unwrap().is_some());
    assert_eq!(tip_mm(&in_memory).unwrap(), tip_mm(&on_disk).unwrap());
}

#[test]
fn a_file_that_was_not_given_is_named_with_its_key() {
    for (path, key) in
        [("scenes/../vessels/tube.csv", "vessel.tree"), ("scenes/../devices/wire.toml", "device.file")]
    {
        let mut files = files();
        files.remove(Path::new(path));
        let scene = Scene::read_of(Arc::new(InMemory(files)), Path::new("scenes/a.toml")).unwrap();
        let reported = tip_mm(&scene).unwrap_err().to_string();
        assert!(
            reported.contains(key) && reported.contains(path) && reported.contains("was not given"),
            "{reported}"
        );
    }
}
