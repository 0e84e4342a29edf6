//! A controller of one's own: it pushes to a depth, in shorter steps while the wall presses hard, and turns.
//! `cargo run -p endowire-core --example my_own_controller`

use endowire_core::control::{Action, Controller, drive};
use endowire_core::{Command, Device, Error, GeneratedWall, Move, Resolution, Result, Sheath, Simulation};

struct Gentle {
    depth_mm: f64,
    limit_n: f64,
}

impl Controller for Gentle {
    fn next(&mut self, simulation: &Simulation) -> Result<Action> {
        let report = simulation.report();
        if report.inserted_mm >= self.depth_mm {
            return Ok(Action::Arrived);
        }
        let is_hard = report.contacts.iter().any(|contact| contact.force_n > self.limit_n);
        let (advance_mm, rotate_rad) = if is_hard { (1.0, 0.1) } else { (4.0, 0.0) };
        let command = Command { advance_mm, rotate_rad, ..Command::default() };
        Ok(Action::Move(vec![Move { instrument: 0, command }]))
    }

    fn retries(&self) -> usize {
        0 // it never pulls back
    }
}

pub(crate) fn main() -> Result<()> {
    let tree = endowire_core::anatomy::tree("curved_tube").expect("a built-in anatomy");
    let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0))?;
    let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
    let mut simulation =
        Simulation::builder(vessel.wall, Device::uniform(300.0, 0.45, 10.0)?, sheath).build()?;
    let mut hand = Gentle { depth_mm: 200.0, limit_n: 0.001 };
    let outcome = drive(&mut simulation, &mut hand, 300, |_, _| Ok::<(), Error>(()))?;
    println!("{outcome:?}, push force {:.4} N", simulation.report().push_force_n);
    Ok(())
}
