//! The table of what was measured.

use std::collections::BTreeMap;
use std::path::Path;

use endowire_core::{Error, Result};

use super::results::Measured;
use super::rows::Row;
use super::scenes::Hard;
use crate::sequences::APART_MM;

/// Heading of the part of BENCHMARKS.md that is written.
const HEADING: &str = "## What each part brings";

/// Names, the first few of them, after how many there are.
fn few(names: &[&str]) -> String {
    const FEW: usize = 3;
    match names.len() {
        0 => "–".to_owned(),
        count => {
            let more = if count > FEW { ", …" } else { "" };
            format!("{count}: {}{more}", names[..count.min(FEW)].join(", "))
        }
    }
}

/// A row's measured scenes, summed up.
#[derive(Default)]
struct Sum<'a> {
    scenes: usize,
    iterations: [u64; 2],
    solves: [u64; 2],
    seconds: [f64; 2],
    /// The largest ratio of iterations, and its scene.
    worst: (f64, &'a str),
    differ: usize,
    elsewhere: Vec<&'a str>,
    unbalanced: Vec<&'a str>,
    fail: Vec<&'a str>,
}

impl<'a> Sum<'a> {
    fn add(&mut self, hard: &'a Hard, Measured { whole, changed }: &Measured) {
        let scene = hard.name.as_str();
        self.scenes += 1;
        let differs = whole.tip_mm != changed.tip_mm
            || (whole.iterations, whole.solves) != (changed.iterations, changed.solves)
            || whole.end != changed.end;
        self.differ += usize::from(differs);
        // One that fails says nothing about what it would have taken.
        if changed.end.is_some() && whole.end.is_none() {
            self.fail.push(scene);
            return;
        }
        for (k, outcome) in [whole, changed].into_iter().enumerate() {
            self.iterations[k] += outcome.iterations;
            self.solves[k] += outcome.solves;
            self.seconds[k] += outcome.seconds;
        }
        let ratio = changed.iterations as f64 / whole.iterations.max(1) as f64;
        if ratio > self.worst.0 {
            self.worst = (ratio, scene);
        }
        if (whole.tip_mm - changed.tip_mm).norm() > hard.apart_mm {
            self.elsewhere.push(scene);
        }
        if changed.unbalanced > whole.unbalanced {
            self.unbalanced.push(scene);
        }
    }

    fn line(&self, name: &str, of: usize) -> String {
        if self.scenes == 0 {
            return format!("| {name} | not measured | | | | | | |");
        }
        let ratio = |[whole, changed]: [f64; 2]| {
            if whole > 0.0 { format!("{:.2}", changed / whole) } else { "–".to_owned() }
        };
        let counts = |both: [u64; 2]| ratio(both.map(|count| count as f64));
        let worst = match self.worst {
            (_, "") => "–".to_owned(),
            (ratio, scene) => format!("{ratio:.2} {scene}"),
        };
        let part =
            if self.scenes < of { format!(" ({} of {of} scenes)", self.scenes) } else { String::new() };
        let same = if self.differ == 0 { " (nothing differs)" } else { "" };
        format!(
            "| {name}{part}{same} | {} | {worst} | {} | {} | {} | {} | {} |",
            counts(self.iterations),
            counts(self.solves),
            ratio(self.seconds),
            few(&self.elsewhere),
            few(&self.unbalanced),
            few(&self.fail)
        )
    }
}

/// The table of rows in these scenes.
pub(super) fn table(rows: &[(&Row, BTreeMap<String, Measured>)], scenes: &[Hard]) -> String {
    let mut lines = Vec::new();
    let mut group = "";
    for (row, measured) in rows {
        if row.group != group {
            group = row.group;
            lines.push(format!("\n### {group}\n"));
            lines.push("| without, or changed | iterations | most in a scene | factorisations | time | ends elsewhere | more without equilibrium | fails |".to_owned());
            lines.push("|---|---|---|---|---|---|---|---|".to_owned());
        }
        let mut sum = Sum::default();
        for scene in scenes {
            if let Some(pair) = measured.get(&scene.name) {
                sum.add(scene, pair);
            }
        }
        lines.push(sum.line(&row.name, scenes.len()));
    }
    lines.join("\n")
}

/// Writes the table of so many of all scenes at the end of the document, in place of the one that is there.
pub(super) fn write(path: &Path, commit: &str, (scenes, all): (usize, usize), table: &str) -> Result<()> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::file(path, error))?;
    let before = text.split(HEADING).next().unwrap_or_default().trim_end();
    let reported = format!(
        "Written by `cargo run --release -p endowire-benches --bin ablation` from commit {commit}: {scenes} of the {all} scenes \
         of `benches/hard` without a mechanism of the solver, or with another number (`crates/lab/src/ablation/rows.rs`), over \
         those with all as they are. Ratios of sums of Newton iterations, of factorisations and of time, each scene run in \
         turn with and without; the scene with the largest ratio of iterations; scenes whose tip ends more than {} mm \
         elsewhere ({} mm with friction), in which more commands end without an equilibrium, and which end in an error \
         (these are in no ratio). Where nothing differs, no scene needs it.",
        APART_MM[0], APART_MM[1]
    );
    std::fs::write(path, format!("{before}\n\n{HEADING}\n{reported}\n{table}\n"))
        .map_err(|error| Error::file(path, error))
}
