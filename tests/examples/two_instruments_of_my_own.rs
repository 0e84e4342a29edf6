//! A wire in a catheter, pulled by an energy of one's own, recorded and drawn:
//! `cargo run -p endowire-tests --example two_instruments_of_my_own`.

use std::{ops::Range, path::Path, sync::Arc};

use endowire_core::{
    Command, Device, EnergyDensity, Field, GeneratedWall, Instrument, MaterialPoint, Move, Resolution,
    Section, Sheath, Simulation, Stack, anatomy,
};
use endowire_recording::{Program, Provenance, Recorder, Recording};
use endowire_viewer::{Pushed, Renderer, ViewSpec, section_parts};

/// A force of so many N per mm along y on the last 20 mm of the wire.
#[derive(Debug)]
struct Pulled(f64);

impl Field for Pulled {
    fn acts_on(&self, instrument: usize) -> Range<f64> {
        if instrument == 0 { 0.0..20.0 } else { 0.0..0.0 } // mm from its tip
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        let by_position = endowire_core::Vec3::y() * -self.0;
        EnergyDensity { value: by_position.dot(&point.position_mm), by_position, ..EnergyDensity::default() }
    }
}

pub(crate) fn main() -> endowire_core::Result<()> {
    let tree = anatomy::tree("curved_tube").expect("a built-in anatomy");
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let tube = Section { inner_radius_mm: Some(0.5), ..Section::straight(300.0, 0.85, 40.0) };
    let instrument = |name: &str, device| Instrument { name: name.to_owned(), device, may_lead: true };
    let stack = Stack::new(vec![
        instrument("wire", Device::uniform(400.0, 0.4, 10.0)?), // the innermost first
        instrument("catheter", Device::new(vec![tube])?),
    ])?;
    let mut simulation = Simulation::builder(vessel.wall.clone(), stack.clone(), sheath).build()?;
    simulation.set_fields([Arc::new(Pulled(1e-4)) as Arc<dyn Field>])?;

    let out = Path::new("out/two_instruments");
    let mut recorder = Recorder::new(out, &simulation)?;
    for step in 1..=30 {
        let advance = |instrument, mm| Move { instrument, command: Command::advance(mm) };
        let moves = [advance(0, 4.0), advance(1, 2.5)];
        simulation.step_together(&moves)?;
        recorder.record(&moves, 0.1 * f64::from(step), &simulation)?;
    }
    let program = Program { version: env!("CARGO_PKG_VERSION"), git_revision: "" };
    let mut summary = recorder.summary(&Provenance::new(program, &[""; 0], 0), &simulation);
    recorder.finish(&mut summary)?;

    let parts = stack.instruments().iter().map(|one| section_parts(&one.device)).collect();
    let views = Pushed::of_parts(stack, parts).views(simulation.shape(), &simulation.report().lengths_mm());
    let mut renderer =
        Renderer::of_wall(&ViewSpec { size_px: [256, 256], ..ViewSpec::default() }, &vessel.wall)?;
    if let Some(picture) = renderer.render(&views)?.fluoro {
        picture.write_png(out.join("fluoro.png"))?;
    }
    println!("{} steps and fluoro.png in {}", Recording::read(out)?.steps(), out.display());
    Ok(())
}
