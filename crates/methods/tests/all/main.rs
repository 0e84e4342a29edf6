//! Every method. One program: each further one is linked for itself.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod cases_they_must_get_right;
mod shaped_tips;
mod state;
