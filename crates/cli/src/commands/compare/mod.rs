//! `endowire compare`: run time against error, method by method, on the same scenes.
//!
//! Every case runs with every method at several resolutions. Rows are written as they are found, and those already in the folder
//! are not run again.

pub(crate) mod case;
pub(crate) mod contender;
mod front;
mod picture;

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::args::CompareArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{print, print_json, progress, to_json};
use case::{CASES, Case, TruthNote};
use front::Front;

/// One measured cell.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    /// The case.
    pub(crate) case: String,
    /// The method.
    pub(crate) method: String,
    /// Elements of the whole device inserted.
    pub(crate) resolution: usize,
    /// Error in the case's unit: of the tip over the length, or root mean square in mm. None where there is no result.
    pub(crate) error: Option<f64>,
    /// Median time of one solve or one whole insertion, s.
    pub(crate) time_s: Option<f64>,
    /// Iterations as the method counts them.
    pub(crate) iterations: Option<u64>,
    /// Why there is no result, or what is to be known of it.
    #[serde(default)]
    pub(crate) note: String,
}

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    truths: Vec<TruthNote>,
    rows: Vec<Row>,
    fronts: Vec<Front>,
    files: Vec<PathBuf>,
}

/// Least time spent on the repeats of a fast cell, s, and their most.
const REPEAT_FOR_S: f64 = 0.2;
const REPEATS: std::ops::RangeInclusive<usize> = 3..=101;
/// A cell that takes longer than this part of the limit is not repeated.
const ONCE: f64 = 0.1;
/// Growth of time with a doubled resolution that is taken for granted: a cell that would pass the limit is not begun.
const GROWTH: f64 = 8.0;

/// Runs what is missing and writes tables and picture.
pub(crate) fn compare(args: &CompareArgs) -> Result<(), Failure> {
    let known: Vec<&str> = CASES.iter().map(|case| case.0).collect();
    check_names("--cases", &args.cases, &known)?;
    check_names("--methods", &args.methods, &contender::names())?;
    if !(args.limit_s.is_finite() && args.limit_s > 0.0) {
        return Err(Failure::Input(format!("--limit-s {}: give a time above 0", args.limit_s)));
    }
    std::fs::create_dir_all(&args.out).map_err(|e| Failure::write(&args.out, &e))?;
    let table = args.out.join("compare.csv");
    let mut rows = read_rows(&table)?;
    let wanted = |list: &[String], name: &str| list.is_empty() || list.iter().any(|w| w == name);
    let methods: Vec<&str> =
        contender::names().into_iter().filter(|name| wanted(&args.methods, name)).collect();
    let cases: Vec<_> = CASES.into_iter().filter(|case| wanted(&args.cases, case.0)).collect();
    let cells = |case: &str| methods.iter().map(|m| resolutions(case, m).len()).sum::<usize>();
    let bar = progress::bar(cases.iter().map(|case| cells(case.0)).sum(), "cell");
    let mut truths = Vec::new();
    for (name, ..) in &cases {
        bar.set_message(format!("{name}: truth"));
        let (case, note) = Case::new(name)?;
        truths.push(note);
        for method in &methods {
            let mut last: Option<(usize, f64)> = None;
            for resolution in resolutions(name, method) {
                bar.set_message(format!("{name}, {method}, {resolution}"));
                let found = rows
                    .iter()
                    .find(|row| row.case == *name && row.method == *method && row.resolution == resolution);
                let time_s = if let Some(row) = found {
                    row.time_s
                } else {
                    let row = measure(&case, name, method, resolution, last, args.limit_s);
                    let time_s = row.time_s;
                    rows.push(row);
                    write_rows(&table, &rows)?;
                    time_s
                };
                if let Some(time_s) = time_s {
                    last = Some((resolution, time_s));
                }
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();
    finish(args, &cases, truths, rows, table)
}

/// Fronts, picture and document.
fn finish(
    args: &CompareArgs,
    cases: &[(&'static str, &'static str, f64)],
    truths: Vec<TruthNote>,
    rows: Vec<Row>,
    table: PathBuf,
) -> Result<(), Failure> {
    let fronts: Vec<Front> = cases
        .iter()
        .map(|(name, _, at_error)| {
            let own: Vec<&Row> = rows.iter().filter(|row| row.case == *name).collect();
            front::front(name, &own, *at_error)
        })
        .collect();
    let mut files = vec![table, args.out.join("compare.json")];
    files.extend(picture::write(&args.out, &rows, cases)?);
    let arguments = format!("compare {:?} {:?} {}", args.cases, args.methods, args.limit_s);
    let document = Document { provenance: Provenance::of_program(&arguments), truths, rows, fronts, files };
    let path = args.out.join("compare.json");
    std::fs::write(&path, to_json(&document)? + "\n").map_err(|e| Failure::write(&path, &e))?;
    if args.json { print_json(&document) } else { print(text(&document, cases)) }
}

fn check_names(flag: &str, given: &[String], known: &[&str]) -> Result<(), Failure> {
    match given.iter().find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(name) => Err(Failure::Input(format!("{flag} {name}: choose from {}", known.join(", ")))),
    }
}

/// Numbers of elements at which a method runs a case.
fn resolutions(case: &str, method: &str) -> Vec<usize> {
    let is_static = case.starts_with("cantilever");
    match (is_static, method) {
        (true, "kirchhoff") => vec![2, 3, 4, 5, 6, 8, 12, 16, 32, 64],
        (true, "li2011-dense") => vec![8, 16, 32, 64, 128],
        (true, _) => vec![8, 16, 32, 64, 128, 256],
        (false, "kirchhoff") => vec![5, 10, 20, 40, 80, 160],
        (false, _) => vec![10, 20, 40, 80, 160],
    }
}

/// Runs one cell, as often as its time allows. What goes wrong is told in the row.
fn measure(
    case: &Case,
    name: &str,
    method: &str,
    resolution: usize,
    last: Option<(usize, f64)>,
    limit_s: f64,
) -> Row {
    let mut row = Row {
        case: name.to_owned(),
        method: method.to_owned(),
        resolution,
        error: None,
        time_s: None,
        iterations: None,
        note: String::new(),
    };
    if let Some((coarser, time_s)) = last {
        let doublings = (resolution as f64 / coarser as f64).log2();
        if time_s * GROWTH.powf(doublings) > limit_s {
            row.note = format!("not begun: {coarser} elements took {time_s:.1} s, the limit is {limit_s} s");
            return row;
        }
    }
    let mut times = Vec::new();
    loop {
        match case.run(method, resolution, Duration::from_secs_f64(limit_s)) {
            Err(error) => {
                row.note = error.to_string();
                return row;
            }
            Ok(None) => {
                row.note = format!("stopped at the limit of {limit_s} s");
                return row;
            }
            Ok(Some(run)) => {
                times.push(run.time_s);
                (row.error, row.iterations) = (Some(run.error), Some(run.iterations));
                if run.unconverged > 0 {
                    row.note = format!("{} steps unconverged", run.unconverged);
                }
            }
        }
        let spent: f64 = times.iter().sum();
        let enough = times.len() >= *REPEATS.start() && spent > REPEAT_FOR_S;
        if enough || times.len() == *REPEATS.end() || spent > ONCE * limit_s {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    row.time_s = Some(times[times.len() / 2]);
    row
}

fn read_rows(table: &Path) -> Result<Vec<Row>, Failure> {
    if !table.exists() {
        return Ok(Vec::new());
    }
    let unusable = |e: csv::Error| {
        Failure::Input(format!("{}: {e}: mend it, or choose another folder", table.display()))
    };
    csv::Reader::from_path(table).map_err(unusable)?.deserialize().map(|row| row.map_err(unusable)).collect()
}

fn write_rows(table: &Path, rows: &[Row]) -> Result<(), Failure> {
    let save = || -> std::io::Result<()> {
        // Whole or not at all, so that an interrupt leaves a table to go on from.
        let part = table.with_extension("part");
        let mut writer = csv::Writer::from_path(&part)?;
        for row in rows {
            writer.serialize(row)?;
        }
        writer.flush()?;
        std::fs::rename(&part, table)
    };
    save().map_err(|e| Failure::write(table, &e))
}

/// The tables for a person.
fn text(document: &Document, cases: &[(&'static str, &'static str, f64)]) -> String {
    let mut lines = Vec::new();
    for (name, unit, _) in cases {
        lines.push(format!(
            "{:<16} {:>10} {:>10} {:>12} {:>11}  note",
            name,
            "elements",
            format!("error {unit}"),
            "time ms",
            "iterations"
        ));
        for row in document.rows.iter().filter(|row| row.case == *name) {
            let dash = || "–".to_owned();
            lines.push(
                format!(
                    "{:<16} {:>10} {:>10} {:>12} {:>11}  {}",
                    row.method,
                    row.resolution,
                    row.error.map_or_else(dash, |e| format!("{e:.1e}")),
                    row.time_s.map_or_else(dash, |t| format!("{:.3}", 1e3 * t)),
                    row.iterations.map_or_else(dash, |i| i.to_string()),
                    row.note
                )
                .trim_end()
                .to_owned(),
            );
        }
        if let Some(front) = document.fronts.iter().find(|front| front.case == *name) {
            lines.push(match (front.methods.split_first(), front.alone_below) {
                (Some((first, others)), Some(error)) => format!(
                    "Pareto front: {first}, alone below {error:.1e} {unit}; above also {}",
                    others.join(", ")
                ),
                _ => format!("Pareto front: {}", front.methods.join(", ")),
            });
            let fastest = front.time_s.first().map_or(1.0, |f| f.1);
            let times: Vec<String> = front
                .time_s
                .iter()
                .map(|(method, t)| format!("{method} {:.3} ms ({:.1}×)", 1e3 * t, t / fastest))
                .collect();
            lines.push(format!(
                "at {:e} {unit}: {}",
                front.at_error,
                if times.is_empty() { "nobody".to_owned() } else { times.join(", ") }
            ));
        }
        lines.push(String::new());
    }
    for truth in &document.truths {
        let change = truth.last_change_mm.map_or(String::new(), |c| {
            format!("; halving its elements the last time changed it by {c:.1e} mm")
        });
        lines.push(format!("truth of {}: {}{change}", truth.case, truth.truth));
    }
    lines.join("\n")
}
