//! A scene file as a simulation and a renderer, a recording beside it, and a picture at the end:
//! `cargo run -p endowire-tests --example scene_recorded_and_drawn`.

use std::path::Path;

use endowire_core::insertion::{Command, Move};
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_recording::{Program, Provenance, Recorder, Recording};
use endowire_viewer::{Pushed, Renderer, ViewSpec};

pub(crate) fn main() -> endowire_core::Result<()> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/scenes/curved_tube.toml"));
    let out = Path::new("out/scene");

    let scene = Scene::read(path)?;
    let mut simulation = scene.simulation(&NoStore)?;
    let spec = ViewSpec { size_px: [256, 256], ..ViewSpec::of_scene(&scene, path)? };
    let mut renderer = Renderer::of_wall(&spec, simulation.lumen().wall(&NoStore)?)?;

    let mut recorder = Recorder::new(out, &simulation)?;
    for step in 1..=20 {
        let moves = [Move { instrument: 0, command: Command::advance(4.0) }];
        simulation.step_together(&moves)?;
        recorder.record(&moves, 0.1 * f64::from(step), &simulation)?;
    }
    let program = Program { version: env!("CARGO_PKG_VERSION"), git_revision: "" };
    let mut summary = recorder.summary(&Provenance::of_scene(program, &scene)?, &simulation);
    (summary.scene, summary.scene_file) = (scene.name.clone(), Some(path.to_path_buf()));
    recorder.finish(&mut summary)?;

    let devices = Pushed::new(&scene, &spec)?.views(simulation.shape(), &simulation.report().lengths_mm());
    if let Some(picture) = renderer.render(&devices)?.fluoro {
        picture.write_png(out.join("fluoro.png"))?;
    }
    println!("{} steps and fluoro.png in {}", Recording::read(out)?.steps(), out.display());
    Ok(())
}
