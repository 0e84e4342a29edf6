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
pub use distance::{Distance, Nearness, SmoothWall};
pub(crate) use drag::Drag;
pub(crate) use friction::{Between, CarriedSlopes, InnerFriction, Place, stick_mm};
pub use friction::{Friction, HandMotion, NormalForce};
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
pub(crate) use wall::{FrictionSlopes, PressingSlopes, Reaction, least_force_n};

/// Rounding error of a distance, in units of a coordinate's rounding.
const ROUNDING: f64 = 4.0;
