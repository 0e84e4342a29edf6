//! Many simulations at once on all cores, or `RAYON_NUM_THREADS`. Each gives the bits that it would give alone.
//! `cargo run -p endowire-core --example many_on_all_cores`

use std::f64::consts::TAU;

use endowire_core::{
    Batch, Command, Device, GeneratedWall, Resolution, Section, Sheath, Simulation, anatomy,
};

pub(crate) fn main() -> endowire_core::Result<()> {
    let tree = anatomy::tree("aortic_arch").expect("a built-in anatomy");
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(3.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 2.0)?;
    let tip = Section { rest_curvature_per_mm: [0.06, 0.0], ..Section::straight(25.0, 0.445, 4.0) };
    let wire = Device::new(vec![tip, Section::straight(600.0, 0.445, 15.0)])?;
    let start = Simulation::builder(vessel.wall, wire, sheath).build()?;
    let mut batch = Batch::new(vec![start; 16]); // clones share the vessel

    // Each begins with another turn of the bent tip.
    let turns: Vec<f64> = (0..16).map(|k| TAU * f64::from(k) / 16.0).collect();
    let first: Vec<Command> =
        turns.iter().map(|&rotate_rad| Command { rotate_rad, ..Command::default() }).collect();
    batch.step(&first)?;
    for _ in 0..65 {
        for (turn, outcome) in turns.iter().zip(batch.step(&[Command::advance(4.0); 16])?) {
            if let Err(error) = outcome {
                println!("turned by {turn:.2} rad: {error}"); // it stays where it was, the others go on
            }
        }
    }
    for (turn, simulation) in turns.iter().zip(batch.simulations()) {
        let push_n = simulation.report().push_force_n;
        println!("turned by {turn:.2} rad: {push_n:.4} N, tip at {:?} mm", simulation.shape().tip_mm());
    }
    Ok(())
}
