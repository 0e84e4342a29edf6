//! The interface as programs see it: as functions, as a header, and from C and C++.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod border;
mod generate;
// Programs are compiled as on Unix.
#[cfg(unix)]
mod from_c;
mod header;
