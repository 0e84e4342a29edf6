//! Pushing, pulling and rotating a device through a sheath into a vessel.

mod batch;
mod builder;
mod changed;
#[cfg(test)]
mod gradient_tests;
#[cfg(test)]
mod held_tests;
mod mark;
mod nodes;
mod packing;
mod recorded;
#[cfg(test)]
mod reverse_tests;
mod script;
mod simulation;
mod tally;

pub use crate::contact::{Contact, WallProperties, WallRegion};
pub use crate::methods::{
    Command, DetachedCoil, InstrumentReport, LateralForce, Move, Sheath, State, StepReport, Surroundings,
    WallForce,
};
pub use crate::methods::{Energy, Jump};
pub use batch::Batch;
pub use builder::SimulationBuilder;
pub use nodes::nodes_from_tip;
pub use packing::Packing;
pub use recorded::Recorded;
pub use script::{
    Condition, Inject, Injection, LineCourse, Met, Script, ScriptCourse, ScriptLine, ScriptRun, Step, Until,
    script_commands,
};
pub use simulation::Simulation;
pub use tally::Tally;
