//! Shared helpers of the workspace tests.

pub mod damage;
pub mod passages;
pub mod phantom;
pub mod readers;
pub mod spoiled;
pub mod sweep;
pub mod twin;

pub use endowire_lab::{crossing, noise};

/// The guide's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/guide/7-library.md")]
struct Guide;
