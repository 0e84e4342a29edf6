//! Hard insertions: whether where a device ends depends on how the hand's motion is cut into commands.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin hard -- cases [NAME]         # scenes of benches/hard, each against steps of 0.1 mm
//! cargo run --release -p endowire-benches --bin hard -- lines [NAME]         # what each of them takes
//! cargo run --release -p endowire-benches --bin hard -- turned [SCENE]       # 480 insertions of four scenes against steps of 0.25 mm
//! cargo run --release -p endowire-benches --bin hard -- sequences [SEEDS]    # random commands, each against its parts of 1 mm
//! cargo run --release -p endowire-benches --bin hard -- ticks [DEVICE]       # steps, ticks and small steps of one motion of the hand
//! cargo run --release -p endowire-benches --bin hard -- deployments [SEEDS]  # two coils out of a catheter and detached, by random commands
//! ```
//!
//! Ends with 1 where one ends elsewhere in silence.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

mod cases;
mod course;
mod ticks;
mod turned;

use std::ops::Range;
use std::process::ExitCode;

use endowire_core::{Error, Result};
use endowire_lab::{deployments, sequences};

/// Rows of so many seeds in which something is wrong.
fn seeded<R: std::fmt::Display>(
    seeds: Range<u64>,
    head: &str,
    run: impl Fn(u64) -> Result<R>,
    passes: impl Fn(&R) -> bool,
) -> Result<usize> {
    println!("{head}");
    let mut wrong = 0;
    for seed in seeds {
        match run(seed) {
            Ok(row) => {
                wrong += usize::from(!passes(&row));
                println!("{row}");
            }
            Err(error) => {
                wrong += 1;
                println!("{seed:>4} {error}");
            }
        }
    }
    Ok(wrong)
}

fn main() -> Result<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let remedy = "say `cases [NAME]`, `lines [NAME]`, `turned [SCENE]`, `ticks [DEVICE]`, `sequences [SEEDS]` or `deployments [SEEDS]`";
    let second = arguments.get(1).map(String::as_str);
    let seeds = |all: u64| {
        let Some(reported) = second else { return Ok(0..all) };
        let (first, end) = reported.split_once("..").unwrap_or(("0", reported));
        match (first.parse(), end.parse()) {
            (Ok(first), Ok(end)) => Ok(first..end),
            _ => {
                Err(Error::parameter("SEEDS", reported, "say how many, or from which up to which: 100..200"))
            }
        }
    };
    let wrong = match arguments.first().map(String::as_str) {
        Some("cases") => cases::cases(second)?,
        Some("lines") => {
            cases::lines(second)?;
            return Ok(ExitCode::SUCCESS);
        }
        Some("ticks") => ticks::ticks(second)?,
        Some("turned") => turned::turned(second)?,
        Some("sequences") => {
            let head = sequences::SequenceRow::HEAD;
            seeded(seeds(sequences::SEQUENCES)?, head, sequences::run, |row| row.pass)?
        }
        Some("deployments") => {
            let head = deployments::DeploymentRow::HEAD;
            seeded(seeds(deployments::DEPLOYMENTS)?, head, deployments::run, |row| row.pass)?
        }
        other => return Err(Error::parameter("study", other.unwrap_or("none"), remedy)),
    };
    println!("{wrong} are wrong");
    Ok(ExitCode::from(u8::from(wrong > 0)))
}
