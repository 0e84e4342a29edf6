//! `endowire` as a user meets it, in one program, which is linked once: `cargo test -p endowire-cli --test cli guide::` runs one file of it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod assess;
mod bad_input;
mod bench;
mod cache;
mod centreline;
mod check;
mod common;
mod compare;
mod course;
mod dataset;
mod device;
mod evidence;
mod experiment;
mod export;
mod from_labels;
mod guide;
mod instruments;
mod killed;
mod methods;
mod numbers;
mod packages;
#[cfg(all(unix, feature = "window"))]
mod pictures;
mod planes;
mod play;
mod recording;
mod render;
mod report;
mod reported;
mod resume;
mod rod;
mod set;
mod subject;
mod surfaces;
mod sweep;
mod terminal;
mod vanished;
mod view_keys;
