//! Hard insertions: whether where a device ends depends on how the hand's motion is cut into commands.
//!
//! Scenes that are hard, each against steps of 0.1 mm (`cases`), insertions of a turned hand against steps of 0.25 mm
//! (`turned`), steps, ticks and small steps of one motion (`ticks`), and random commands ([`sequences`], [`deployments`]).

mod cases;
mod course;
mod ticks;
mod turned;

use std::ops::Range;
use std::path::{Path, PathBuf};

use endowire_core::{Error, Result};

use crate::{deployments, sequences};

/// Rows of so many seeds in which something is wrong.
fn seeded<R: std::fmt::Display>(
    seeds: Range<u64>,
    head: &str,
    run: impl Fn(u64) -> Result<R>,
    passes: impl Fn(&R) -> bool,
    say: &mut dyn FnMut(String),
) -> Result<usize> {
    say(head.to_owned());
    let mut wrong = 0;
    for seed in seeds {
        match run(seed) {
            Ok(row) => {
                wrong += usize::from(!passes(&row));
                say(row.to_string());
            }
            Err(error) => {
                wrong += 1;
                say(format!("{seed:>4} {error}"));
            }
        }
    }
    Ok(wrong)
}

/// The scenes of `benches/hard` of the repository, in the order of their names.
///
/// # Errors
/// A folder that cannot be read.
pub(crate) fn scenes(repository: &Path) -> Result<Vec<PathBuf>> {
    let folder = repository.join("benches/hard");
    let entries = std::fs::read_dir(&folder).map_err(|error| Error::file(&folder, error))?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    Ok(paths)
}

/// Runs a study: its name and what follows it in `arguments`, with the scenes of the repository. `say` gets the lines of its table.
///
/// Returns how many are wrong; `None` for a study that judges nothing.
///
/// # Errors
/// Arguments that name no study, and scenes that cannot be read.
pub fn run(arguments: &[String], repository: &Path, say: &mut dyn FnMut(String)) -> Result<Option<usize>> {
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
        Some("cases") => cases::cases(repository, second, say)?,
        Some("lines") => {
            cases::lines(repository, second, say)?;
            return Ok(None);
        }
        Some("ticks") => ticks::ticks(repository, second, say)?,
        Some("turned") => turned::turned(repository, second, say)?,
        Some("sequences") => {
            let head = sequences::SequenceRow::HEAD;
            seeded(seeds(sequences::SEQUENCES)?, head, sequences::run, |row| row.pass, say)?
        }
        Some("deployments") => {
            let head = deployments::DeploymentRow::HEAD;
            seeded(seeds(deployments::DEPLOYMENTS)?, head, deployments::run, |row| row.pass, say)?
        }
        other => return Err(Error::parameter("study", other.unwrap_or("none"), remedy)),
    };
    say(format!("{wrong} are wrong"));
    Ok(Some(wrong))
}
