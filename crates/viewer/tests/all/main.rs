//! Pictures. One program: each further one is linked for itself.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod accuracy;
mod agreement;
mod common;
mod contrast;
mod everywhere;
mod frames;
mod golden;
mod labels;
mod modes;
mod motion;
mod path_lengths;
mod pulse;
mod wires;
