//! Pushing, pulling and turning a device through a sheath into a vessel.

mod batch;
mod builder;
mod command;
mod nodes;
mod report;
mod script;
mod sheath;
mod simulation;

pub use crate::contact::{Contact, WallProperties, WallRegion};
pub use crate::methods::State;
pub use batch::Batch;
pub use builder::SimulationBuilder;
pub use command::{Command, Move};
pub use nodes::nodes_from_tip;
pub use report::{Energy, InstrumentReport, LateralForce, StepReport};
pub use script::{
    LineCourse, Met, Script, ScriptCourse, ScriptLine, ScriptRun, Step, Until, script_commands,
};
pub use sheath::Sheath;
pub use simulation::{Simulation, Surroundings};
