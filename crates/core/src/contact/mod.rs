//! Contact of a device with the wall and with itself: distance, energy, friction.

mod cache;
pub mod distance;
mod drag;
pub mod extension;
pub mod friction;
mod moved;
mod narrow;
pub mod pairs;
pub(crate) mod passage;
pub mod point;
pub mod potential;
mod properties;
mod proximity;
mod quadric;
mod quadric_fit;
mod reader;
pub mod regions;
#[cfg(test)]
mod ridge_tests;
#[cfg(test)]
mod rim_tests;
mod set;
pub mod surface;
pub mod wall;

pub use cache::{ContactCache, KnownPoints};
pub use distance::{Distance, Nearness, SmoothWall};
pub use drag::Drag;
pub(crate) use friction::CarriedSlopes;
pub(crate) use friction::stick_mm;
pub use friction::{Between, Friction, HandMotion, InnerFriction, NormalForce, Place};
pub use moved::MovedWall;
pub use pairs::{Capsule, SelfContact, Touching};
pub(crate) use pairs::{FrictionLaw, PairForce, Pressing, RodPlace};
pub use point::{Contact, ContactPoint, Counters, Touch};
pub use potential::WallPotential;
pub use properties::{WallProperties, WallRegion};
pub(crate) use properties::{check_friction, check_valve};
pub use reader::WallReader;
pub use regions::RegionMap;
pub use surface::{ContactMesh, ContactSurface, Deviation, Hint};
pub use wall::WallContact;
pub(crate) use wall::least_force_n;
pub(crate) use wall::{FrictionSlopes, PressingSlopes, Reaction};

/// Rounding error of a distance, in units of a coordinate's rounding.
const ROUNDING: f64 = 4.0;
