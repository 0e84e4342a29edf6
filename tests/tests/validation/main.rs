//! What has an exact or independently computed answer.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod curved_tube;
mod found_centreline;
mod insertion;
mod path;
mod rod;
mod soft_plane;
mod spoiled_surfaces;
mod steered;
mod tails;
mod wall_regions;
