//! Catheters and guidewires in blood vessels.
//!
//! Units everywhere: millimetre, newton, second, radian; energy in N·mm = mJ.
//!
//! A scene file becomes a [`scene::Scene`], that builds an [`insertion::Simulation`], which is stepped by
//! [`insertion::Command`]s and always has its [`shape::Shape`] and an [`insertion::StepReport`].
//!
//! The exact rod stands on its own: a [`statics::StaticCase`] (a file or a value) is solved into a
//! [`statics::StaticSolution`] by [`solve::Newton`] on the elements of [`rod`].

// Results are bit-identical on every machine: functions whose rounding depends on the platform are disallowed.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod banded;
pub mod contact;
pub mod control;
pub(crate) mod coupled;
pub mod device;
pub mod error;
pub mod field;
pub mod file;
pub mod flow;
pub mod input;
pub mod insertion;
pub mod methods;
mod parallel;
pub mod passable;
mod products;
pub mod random;
pub mod rod;
pub mod scene;
pub mod shape;
pub mod solve;
pub mod statics;
pub mod vessel;

pub use error::{Error, PhysicalEnd, Result};
pub use nalgebra;

/// A point or direction in space, millimetres or unit length as its name says.
pub type Vec3 = nalgebra::Vector3<f64>;

/// The README's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
