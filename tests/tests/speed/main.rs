//! Speed bars. Timing: run by hand, alone, with `--release -- --ignored --nocapture`.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod insertion;
