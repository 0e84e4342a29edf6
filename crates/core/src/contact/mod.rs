//! Contact of a device with the wall and with itself: distance, energy, friction.

mod cache;
pub(crate) mod distance;
mod drag;
pub mod extension;
pub(crate) mod friction;
mod moved;
mod narrow;
pub(crate) mod pairs;
pub(crate) mod passage;
pub(crate) mod point;
pub(crate) mod potential;
mod properties;
mod proximity;
mod quadric;
mod quadric_fit;
mod reader;
pub(crate) mod regions;
#[cfg(test)]
mod ridge_tests;
#[cfg(test)]
mod rim_tests;
mod set;
pub(crate) mod surface;
pub(crate) mod wall;

pub use cache::ContactCache;
pub(crate) use cache::KnownPoints;
pub use distance::Distance;
pub use distance::{Nearness, SmoothWall};
pub(crate) use drag::Drag;
pub use friction::NormalForce;
pub(crate) use friction::stick_mm;
pub(crate) use friction::{Between, InnerFriction, Place};
pub use friction::{Friction, HandMotion};
pub use moved::MovedWall;
pub use pairs::Touching;
pub use pairs::{Capsule, SelfContact};
pub(crate) use pairs::{FrictionLaw, PairForce, Pressing, RodPlace};
pub use point::{Contact, ContactPoint, Counters, Touch};
pub use potential::WallPotential;
pub use properties::{WallProperties, WallRegion};
pub(crate) use properties::{check_friction, check_valve};
pub use reader::WallReader;
pub use regions::RegionMap;
pub use surface::{ContactMesh, ContactSurface};
pub use surface::{Deviation, Hint};
pub(crate) use wall::Reaction;
pub use wall::WallContact;
pub(crate) use wall::least_force_n;

/// Rounding error of a distance, in units of a coordinate's rounding.
const ROUNDING: f64 = 4.0;
