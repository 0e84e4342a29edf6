//! What `endowire vessel passable` says against what a simulation does, in random vessels with random devices.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin passages              # the hundred of seeds 0 to 99
//! cargo run --release -p endowire-benches --bin passages -- 40 60     # those of seeds 40 to 59
//! ```
//!
//! Ends with 1 where fewer than 95 of 100 agree.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::collections::BTreeMap;
use std::process::ExitCode;

use endowire_core::{Error, Result};
use endowire_tests::passages::{HEAD, Row};

/// Seeds, unless set.
const SEEDS: [u64; 2] = [0, 100];
/// Part of the questions in which both must agree.
const AGREE: f64 = 0.95;

fn main() -> Result<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = |index: usize| match arguments.get(index) {
        Some(text) => {
            text.parse().map_err(|_| Error::parameter("seed", text, "give the first and the last but one"))
        }
        None => Ok(SEEDS[index]),
    };
    let (first, end) = (seed(0)?, seed(1)?);
    println!("{HEAD}");
    let mut ends: BTreeMap<String, usize> = BTreeMap::new();
    let mut agree = 0;
    for number in first..end {
        match Row::new(number) {
            Ok(row) => {
                agree += u64::from(row.against.is_none());
                *ends.entry(format!("{:?} and {:?}", row.reported.passage, row.pushed.ended)).or_default() +=
                    1;
                println!("{row}");
            }
            Err(error) => println!("{number:>4}  AGAINST: {error}"),
        }
    }
    for (what, count) in ends {
        println!("{count:>4} {what}");
    }
    println!("{agree} of {} agree", end.saturating_sub(first));
    Ok(ExitCode::from(u8::from((agree as f64) < AGREE * end.saturating_sub(first) as f64)))
}
