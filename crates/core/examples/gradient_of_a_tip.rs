//! How a tip moves with the bending stiffness EI of a section, with friction and with the hand.
//! `cargo run -p endowire-core --example gradient_of_a_tip`

use endowire_core::methods::Parameter;
use endowire_core::{
    Command, Device, GeneratedWall, KirchhoffOptions, Move, Resolution, Section, Sheath, Simulation,
    WallProperties, anatomy,
};

pub(crate) fn main() -> endowire_core::Result<()> {
    let vessel =
        GeneratedWall::new(&anatomy::tree("curved_tube").expect("built in"), Resolution::EdgeMm(2.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let tip = Section { rest_curvature_per_mm: [0.06, 0.0], ..Section::straight(15.0, 0.2, 6.0) };
    let wire = Device::new(vec![tip, Section::straight(300.0, 0.2, 14.0)])?;
    let wall = WallProperties { friction: 0.1, ..WallProperties::default() };
    // Derivatives are as exact as the equilibrium.
    let method = KirchhoffOptions { tolerance: 1e-9, ..KirchhoffOptions::default() };
    let mut simulation =
        Simulation::builder(vessel.wall, wire, sheath).properties(wall).method(&method).build()?;
    for _ in 0..20 {
        simulation.step(Command::advance(2.0))?;
    }
    let by = [
        Parameter::BendingStiffness { instrument: 0, section: 0 },
        Parameter::WallFriction,
        Parameter::Advance { instrument: 0 },
    ];
    // What this command would lead to. The simulation does not move.
    let moves = vec![Move { instrument: 0, command: Command::advance(1.5) }];
    for (parameter, slope) in by.iter().zip(&simulation.gradients(&[moves], &by)?[0].slopes) {
        println!("d tip / d {parameter:?}: {:?} mm per unit, one-sided: {}", slope.tip_mm, slope.one_sided);
    }
    Ok(())
}
