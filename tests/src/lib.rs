//! Shared helpers of the workspace tests.

pub mod bent_rod;
pub mod crossing;
pub mod sweep;
