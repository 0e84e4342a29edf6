//! Steps an insertion from a program: a curved tube, a wire, a millimetre a step.
//!
//! `cargo run -p endowire-core --example step_a_simulation`

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation};
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

pub(crate) fn main() -> endowire_core::Result<()> {
    let tree = anatomy::tree("curved_tube").expect("a built-in anatomy");
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(1.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let wire = Device::uniform(400.0, 0.45, 10.0)?;
    let mut simulation = Simulation::builder(vessel.wall, wire, sheath).build()?;
    for _ in 0..150 {
        let report = simulation.step(Command::advance(1.0))?;
        println!("{:.0} mm in, push force {:.4} N", report.inserted_mm, report.push_force_n);
    }
    Ok(())
}
