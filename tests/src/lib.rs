//! Shared helpers of the workspace tests.

pub mod crossing;
pub mod sweep;
