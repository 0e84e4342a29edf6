//! Recordings of simulations that a program moves, and what the repository says of their format.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod format;
mod program;
mod tables;
