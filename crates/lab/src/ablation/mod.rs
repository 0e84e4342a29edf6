//! What each mechanism of the solver, and each of its numbers, brings: hard scenes without it, or with another value, over
//! those with all of them as they are.
//!
//! A row (`rows.rs`) changes one number of [`Tuning`](endowire_core::tuning::Tuning). A scene of `benches/hard` is run in
//! turn with all numbers as they are and with the row's. The table is written at the end of BENCHMARKS.md.
//!
//! Results are kept in `target/ablation`, in a folder for each commit, a file for each row, a line for each scene: a run
//! that was killed goes on where it was. With uncommitted changes it begins anew.

mod results;
mod rows;
mod scenes;
mod table;

use std::path::Path;

use endowire_core::{Error, Result};

use results::{Measured, Results};
use rows::Row;
use scenes::{Hard, Outcome};

/// What was asked for.
#[derive(Default)]
struct Arguments {
    rows: Option<String>,
    scenes: Option<String>,
    prints: bool,
    is_measured: bool,
    lists: bool,
    repeats: usize,
}

impl Arguments {
    fn read(arguments: &[String]) -> Result<Self> {
        let mut reported = Self { repeats: 1, ..Self::default() };
        let mut words = arguments.iter().cloned();
        while let Some(word) = words.next() {
            let mut value = || {
                let remedy = "say which after it";
                words.next().ok_or_else(|| Error::parameter(word.as_str(), "nothing", remedy))
            };
            match word.as_str() {
                "--print" => reported.prints = true,
                "--measured" => reported.is_measured = true,
                "--rows" => reported.lists = true,
                "--scenes" => reported.scenes = Some(value()?),
                "--repeats" => {
                    let count = value()?;
                    let remedy = "say how many times, at least once";
                    reported.repeats = count
                        .parse()
                        .ok()
                        .filter(|repeats| *repeats > 0)
                        .ok_or_else(|| Error::parameter("--repeats", count.as_str(), remedy))?;
                }
                option if option.starts_with("--") => {
                    let remedy = "say --print, --measured, --rows, --scenes PATTERN or --repeats N";
                    return Err(Error::parameter("option", option, remedy));
                }
                pattern => reported.rows = Some(pattern.to_owned()),
            }
        }
        Ok(reported)
    }

    /// Whether the table is of all rows, and is to be written.
    fn writes(&self) -> bool {
        self.rows.is_none() && !self.prints && !self.is_measured
    }
}

/// Where lines go: those of the table, and how far it is.
pub struct Told<'a> {
    /// Lines of what was asked for.
    pub say: &'a mut dyn FnMut(String),
    /// What is being run.
    pub note: &'a mut dyn FnMut(String),
}

/// Whether a name has a pattern in it, or one of several with commas between.
fn has(name: &str, patterns: Option<&str>) -> bool {
    patterns.is_none_or(|patterns| patterns.split(',').any(|pattern| name.contains(pattern)))
}

/// Runs a scene with all numbers as they are and with those of a row, in turn; of each the fastest run.
fn pair(scene: &Hard, row: &Row, repeats: usize, note: &mut dyn FnMut(String)) -> Result<Measured> {
    let mut measured: Option<Measured> = None;
    for _ in 0..repeats {
        let whole = scene.run(None, None)?;
        if let Some(end) = &whole.end {
            note(format!("{} ends as it is: {end}", scene.name));
        }
        let limit_s = SLOWER * whole.seconds + GRACE_S;
        let changed = scene.run(Some(row), Some(limit_s))?;
        let before = measured.take();
        let fastest = |now: Outcome, before: Option<Outcome>| match before {
            Some(before) if before.seconds < now.seconds => before,
            _ => now,
        };
        let (first, second) = before.map_or((None, None), |pair| (Some(pair.whole), Some(pair.changed)));
        measured = Some(Measured { whole: fastest(whole, first), changed: fastest(changed, second) });
    }
    measured.ok_or_else(|| Error::parameter("--repeats", 0, "say how many times, at least once"))
}

/// A scene that takes this many times as long as the whole, and some seconds more, is stopped.
const SLOWER: f64 = 20.0;
/// See [`SLOWER`].
const GRACE_S: f64 = 10.0;

/// Runs what `arguments` ask for, with the scenes of the repository, and prints or writes the table.
///
/// # Errors
/// Arguments that are not known, and files that cannot be read or written.
pub fn run(arguments: &[String], repository: &Path, told: Told<'_>) -> Result<()> {
    let Told { say, note } = told;
    let reported = Arguments::read(arguments)?;
    let mut rows = rows::all()?;
    rows.retain(|row| has(&row.name, reported.rows.as_deref()));
    if reported.lists {
        rows.iter().for_each(|row| say(format!("{}: {}", row.group, row.name)));
        return Ok(());
    }
    let mut hard = scenes::all(repository)?;
    let all = hard.len();
    hard.retain(|scene| has(&scene.name, reported.scenes.as_deref()));
    let results = Results::of_this_commit(repository, reported.is_measured)?;
    if !reported.is_measured {
        for (k, row) in rows.iter().enumerate() {
            let known = results.of(row)?;
            for scene in &mut hard {
                if known.contains_key(&scene.name) {
                    continue;
                }
                note(format!("{}/{} {}: {}", k + 1, rows.len(), row.name, scene.name));
                scene.prepare()?;
                results.keep(row, &scene.name, &pair(scene, row, reported.repeats, note)?)?;
            }
        }
    }
    let lines = rows.iter().map(|row| Ok((row, results.of(row)?))).collect::<Result<Vec<_>>>()?;
    let table = table::table(&lines, &hard);
    if reported.writes() {
        table::write(&repository.join("BENCHMARKS.md"), &results.commit, (hard.len(), all), &table)?;
    } else {
        say(table);
    }
    Ok(())
}
