//! What each mechanism of the solver, and each of its numbers, brings: hard scenes without it, or with another value, over
//! those with all of them as they are.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin ablation                     # all rows in all scenes; writes the table
//! cargo run --release -p endowire-benches --bin ablation -- PATTERN          # rows with this in their name; prints it
//! cargo run --release -p endowire-benches --bin ablation -- --scenes A,B    # scenes with one of these in their name; writes it
//! cargo run --release -p endowire-benches --bin ablation -- --print          # prints it in place of writing it
//! cargo run --release -p endowire-benches --bin ablation -- --measured       # prints what is measured so far
//! cargo run --release -p endowire-benches --bin ablation -- --repeats N      # times are the smallest of N runs
//! cargo run --release -p endowire-benches --bin ablation -- --rows           # prints the rows
//! ```
//!
//! A row (`crates/lab/src/ablation/rows.rs`) changes one number of [`Tuning`](endowire_core::tuning::Tuning). A scene of `benches/hard` is run in
//! turn with all numbers as they are and with the row's. The table is written at the end of BENCHMARKS.md.
//!
//! Results are kept in `target/ablation`, in a folder for each commit, a file for each row, a line for each scene: a run
//! that was killed goes on where it was. With uncommitted changes it begins anew.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a table is what it is for")]

use std::path::Path;

use endowire_core::Result;
use endowire_lab::ablation::{self, Told};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let told = Told { say: &mut |line| println!("{line}"), note: &mut |line| eprintln!("{line}") };
    ablation::run(&arguments, &repository, told)
}
