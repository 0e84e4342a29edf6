//! Shared helpers of the workspace tests.

pub mod bent_rod;
pub mod sweep;

pub use endowire_core::reference::crossing;
