//! A film of a push, in 3D and fluoroscopy side by side. The file's name decides: `.png`, `.apng`, `.gif`, and `.mp4` with
//! the feature of that name.
//! `cargo run -p endowire-viewer --example film_of_a_push`

use endowire_core::{Command, Device, GeneratedWall, Resolution, Section, Sheath, Simulation, anatomy};
use endowire_viewer::{Animation, CArmSpec, DeviceView, Pace, Renderer, View, ViewSpec};

pub(crate) fn main() -> endowire_core::Result<()> {
    let vessel =
        GeneratedWall::new(&anatomy::tree("curved_tube").expect("built in"), Resolution::EdgeMm(2.0))?;
    let spec = ViewSpec {
        views: vec![View::ThreeD, View::Fluoro],
        size_px: [128, 128],
        c_arm: CArmSpec { pose: Some("RAO 60".parse()?), ..CArmSpec::default() },
        ..ViewSpec::default()
    };
    let mut renderer = Renderer::of_wall(&spec, &vessel.wall)?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let tip = Section { rest_curvature_per_mm: [0.04, 0.0], ..Section::straight(20.0, 0.45, 5.0) };
    let wire = Device::new(vec![tip, Section::straight(280.0, 0.45, 15.0)])?;
    let mut simulation = Simulation::builder(vessel.wall, wire, sheath).build()?;

    let mut pictures = vec![];
    for _ in 0..20 {
        simulation.step(Command::advance(6.0))?;
        let frames = renderer.render(&[DeviceView::from_shape(simulation.shape(), |_from_tip_mm| 0.45)])?;
        pictures.extend(frames.three_d.zip(frames.fluoro).map(|(left, right)| left.beside(&right)));
    }
    let file = std::env::temp_dir().join("endowire-film.gif");
    let mut film = Animation::new(&file, &pictures[0], pictures.len() as u32, Pace::even(10.0))?;
    pictures.iter().try_for_each(|picture| film.push(picture))?;
    film.finish()?;
    println!("{} pictures in {}", pictures.len(), file.display());
    Ok(())
}
