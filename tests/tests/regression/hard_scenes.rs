//! The hard scenes of `benches/hard` can be run: their study takes too long to find out about a wrong key.

use std::path::Path;

use endowire_core::Result;
use endowire_core::insertion::Script;
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;

/// The script of a scene of this text, of a file at `path`.
fn script(text: &str, path: &Path) -> Result<Script> {
    let scene = Scene::from_toml(text, path)?;
    scene.steps(&scene.stack()?, &NoStore)
}

#[test]
fn every_hard_scene_has_a_script_for_its_instruments() {
    let mut scenes = 0;
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../benches/hard")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let script_of = |text: &str| script(text, &path).map(|script| script.len());
        assert!(script_of(&text).unwrap() > 0, "{}", path.display());
        // One that pushes in less than nothing is reported.
        assert!(script_of(&text.replace("step_mm = ", "step_mm = -")).is_err(), "{}", path.display());
        scenes += 1;
    }
    assert!(scenes >= 40, "{scenes}");
}
