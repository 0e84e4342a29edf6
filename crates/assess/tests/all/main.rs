//! Scores and what stands out. One program: each further one is linked for itself.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod beam;
mod by_hand;
mod fork;
mod goals;
mod noticed;
mod recorded_by_hand;
mod subjects;
mod trainees;
