//! The numbers of the solver, of contact and of friction that are choices.
//!
//! Each field is a number that could be another one, or a switch of a mechanism; its default is what the method is
//! tested with. Units, limits on what a user may ask for, rounding bounds, amounts of memory and mathematical constants
//! are constants where they are used. So are the numbers that shape the contact surface (`contact/surface/`, `quadric`,
//! `quadric_fit`, `distance`, `extension`, and `vessel/conditioning`): they are part of the recipe by which walls are
//! made and stored ([`WallRecipe`](crate::vessel::WallRecipe)).
//!
//! Scene files cannot set these numbers. `cargo run --release -p endowire-benches --bin ablation` changes them one by
//! one and measures what becomes of hard insertions.

mod contact;
mod course;
mod friction;
mod mesh;
mod newton;
mod pairs;
mod passage;
mod steps;

pub use contact::ContactTuning;
pub use course::CourseTuning;
pub use friction::FrictionTuning;
pub use mesh::MeshTuning;
pub use newton::NewtonTuning;
pub use pairs::PairTuning;
pub use passage::PassageTuning;
pub use steps::StepTuning;

/// All of them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tuning {
    /// Parts of a command and of a tick, and what is accepted as the next equilibrium.
    pub steps: StepTuning,
    /// The course of a vessel that yields.
    pub course: CourseTuning,
    /// Newton's method.
    pub newton: NewtonTuning,
    /// Elements and contact points.
    pub mesh: MeshTuning,
    /// Contact with the wall.
    pub contact: ContactTuning,
    /// Contact of a device with itself and with detached coils.
    pub pairs: PairTuning,
    /// Friction, on the wall and between rods.
    pub friction: FrictionTuning,
    /// The search for a way ahead of a device that found no equilibrium.
    pub passage: PassageTuning,
}
