//! The numbers of the solver that are choices.
//!
//! Each field is a number that could be another one, or a switch of a mechanism; its default is what the method is
//! tested with. Units, limits on what a user may ask for, rounding bounds and mathematical constants are constants
//! where they are used. So are the numbers of contacts and of friction (`contact/`), and those that shape the felt
//! wall: they are part of the recipe by which walls are stored ([`WallRecipe`](crate::vessel::WallRecipe)).
//!
//! Scene files cannot set these numbers. `cargo run --release -p endowire-benches --bin ablation` changes them one by
//! one and measures what becomes of hard insertions.

mod mesh;
mod newton;
mod passage;
mod steps;

pub use mesh::MeshTuning;
pub use newton::NewtonTuning;
pub use passage::PassageTuning;
pub use steps::StepTuning;

/// All of them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tuning {
    /// Parts of a command and of a tick, and what is accepted as the next equilibrium.
    pub steps: StepTuning,
    /// Newton's method.
    pub newton: NewtonTuning,
    /// Elements and contact points.
    pub mesh: MeshTuning,
    /// The search for a way ahead of a device that found no equilibrium.
    pub passage: PassageTuning,
}
