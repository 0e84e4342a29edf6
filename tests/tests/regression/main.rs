//! What the libraries do and must go on doing.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod arrival;
mod catalogue;
mod damaged_files;
mod deployments;
mod examples;
mod hard_scenes;
mod instruments;
mod passages;
mod phantom;
mod robust_insertion;
mod round_bits;
mod sequences;
mod state;
mod wedged;
