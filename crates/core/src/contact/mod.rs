//! Contact of a device with the wall and with itself: distance, energy, friction.
//!
//! What is public is for methods of one's own: the wall as devices feel it ([`ContactSurface`], [`WallReader`]), its
//! [properties](WallProperties), and where a line has left the vessel ([`extension`]).

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

pub use distance::Nearness;
pub(crate) use moved::MovedWall;
pub use pairs::Touching;
pub use point::{Contact, Counters, Touch};
pub use properties::{WallProperties, WallRegion};
pub use reader::WallReader;
pub use surface::{ContactMesh, ContactSurface};

pub(crate) use cache::{ContactCache, KnownPoints};
pub(crate) use distance::{Distance, SmoothWall};
pub(crate) use drag::Drag;
pub(crate) use friction::{
    Between, CarriedSlopes, Friction, HandMotion, InnerFriction, NormalForce, Place, stick_mm,
};
pub(crate) use pairs::{Capsule, FrictionLaw, PairForce, Pressing, RodPlace, SelfContact};
pub(crate) use point::ContactPoint;
pub(crate) use potential::WallPotential;
pub(crate) use properties::{check_friction, check_valve};
pub(crate) use wall::{FrictionSlopes, PressingSlopes, Reaction, WallContact, least_force_n};

/// Rounding error of a distance, in units of a coordinate's rounding.
const ROUNDING: f64 = 4.0;
