//! An energy of one's own along the device: here one that pulls the last 10 mm towards the plane x = 1 mm.
//! `cargo run -p endowire-core --example my_own_field`

use std::{ops::Range, sync::Arc};

use endowire_core::field::{EnergyDensity, Field, MaterialPoint};
use endowire_core::{Command, Device, GeneratedWall, Resolution, Result, Sheath, Simulation, Vec3, anatomy};

#[derive(Debug)]
struct Pulled(f64); // N/mm²

impl Field for Pulled {
    fn acts_on(&self, _instrument: usize) -> Range<f64> {
        0.0..10.0 // mm from the tip
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        let (k, x_mm, normal) = (self.0, point.position_mm.x - 1.0, Vec3::x());
        EnergyDensity {
            value: 0.5 * k * x_mm * x_mm, // mJ per mm
            by_position: normal * (k * x_mm),
            by_positions: normal * normal.transpose() * k,
            ..EnergyDensity::default()
        }
    }
}

pub(crate) fn main() -> Result<()> {
    let tree = anatomy::tree("straight_tube").expect("a built-in anatomy");
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let wire = Device::uniform(200.0, 0.45, 10.0)?;
    let mut simulation = Simulation::builder(vessel.wall, wire, sheath).build()?;
    simulation.step(Command::advance(40.0))?;
    simulation.set_fields([Arc::new(Pulled(1e-4)) as Arc<dyn Field>])?;
    simulation.step(Command::default())?; // hands still: the wire follows the field
    println!("tip at {:?} mm, {:?}", simulation.shape().tip_mm(), simulation.report().energy);
    Ok(())
}
