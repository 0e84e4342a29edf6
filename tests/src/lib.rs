//! Shared helpers of the workspace tests.

pub mod bent_rod;
pub mod noise;
pub mod spoiled;
pub mod sweep;
pub mod twin;

pub use endowire_core::reference::crossing;
