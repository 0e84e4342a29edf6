//! Pushing, pulling and turning a device through a sheath into a vessel.

mod command;
mod report;
mod sheath;
mod simulation;

pub use command::{Command, ScriptLine, commands};
pub use report::{Contact, Energy, StepReport};
pub use sheath::Sheath;
pub use simulation::{Simulation, Surroundings, check_commands, script_commands};
