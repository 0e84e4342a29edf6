//! What the wall does to a device: distance, energy, friction.

pub mod distance;
mod drag;
pub mod extension;
pub mod felt;
mod fit;
pub mod friction;
pub mod grading;
mod memory;
mod moved;
mod places;
pub mod point;
pub mod potential;
mod properties;
mod quadric;
#[cfg(test)]
mod ridge_tests;
#[cfg(test)]
mod rim_tests;
pub mod wall;

pub use distance::{Distance, Nearness, SmoothWall};
pub use drag::Drag;
pub use felt::{Deviation, FeltWall};
pub use friction::{Between, Friction, HandMotion, NormalForce, Place, Rub, SETTLED};
pub use grading::Grading;
pub use memory::{KnownPoints, WallMemory};
pub use moved::MovedWall;
pub use point::{Contact, ContactPoint, Counters, Touch};
pub use potential::WallPotential;
pub use properties::{WallProperties, WallRegion};
pub(crate) use properties::{check_friction, check_valve};
pub use wall::WallContact;
