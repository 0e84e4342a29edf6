//! Sessions by hand. One program: each further one is linked for itself.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod demonstration;
mod detach;
mod idle;
mod session;
mod steering;
mod trainees;
