//! Catheters and guidewires in blood vessels.
//!
//! Units everywhere: millimetre, newton, second, radian; energy in N·mm = mJ.

pub mod error;
pub mod reference;
pub mod rod;
pub mod shape;
pub mod solve;
pub mod statics;
pub mod vessel;

pub use error::{Error, Result};
pub use nalgebra;

/// A point or direction in space, millimetres or unit length as its name says.
pub type Vec3 = nalgebra::Vector3<f64>;
