//! `endowire compare`: run time against error, method by method, in the same scenes.
//!
//! Every case runs with every method at several resolutions. Rows are written as soon as they are computed; those
//! that already exist in the folder are not repeated, and neither is the reference of a case that is complete.

mod picture;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use endowire_lab::compare::case::{Case, TruthNote};
use endowire_lab::compare::{Front, Row, front};
use endowire_lab::studies::{CANDIDATES, CASES};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::args::CompareArgs;
use crate::commands::lab::check_limit_s;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress, to_json, whole};

#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    truths: Vec<TruthNote>,
    rows: Vec<Row>,
    fronts: Vec<Front>,
    files: Vec<PathBuf>,
}

/// Smallest total time of the repetitions of a fast measurement, s, and the range of their number.
const REPEAT_FOR_S: f64 = 0.2;
const REPEATS: std::ops::RangeInclusive<usize> = 3..=101;
/// Largest time of the repetitions including untimed preparation, s.
const REPEAT_WITHIN_S: f64 = 1.0;
/// A measurement that takes longer than this fraction of the limit is not repeated.
const ONCE: f64 = 0.1;
/// Assumed growth of time for doubled resolution: a measurement that would exceed the limit is skipped.
const GROWTH: f64 = 8.0;
/// Marks notes about an exceeded time limit.
const LIMIT: &str = "limit of";
/// Largest number of elements.
const MOST_ELEMENTS: usize = 1000;

/// Runs missing measurements, and writes tables and picture.
pub(crate) fn compare(args: &CompareArgs) -> Result<(), Failure> {
    check_limit_s(args.limit_s)?;
    if let Some(elements) = args.elements.iter().find(|n| !(2..=MOST_ELEMENTS).contains(*n)) {
        return Err(Failure::Input(format!("--elements {elements}: give 2 to {MOST_ELEMENTS}")));
    }
    std::fs::create_dir_all(&args.out).map_err(|e| Failure::write(&args.out, &e))?;
    let wanted = |list: &[String], name: &str| list.is_empty() || list.iter().any(|w| w == name);
    let methods: Vec<&str> = CANDIDATES.into_iter().filter(|name| wanted(&args.methods, name)).collect();
    let cases: Vec<_> = CASES.into_iter().filter(|case| wanted(&args.cases, case.0)).collect();
    let cells: Vec<(&str, &str, usize)> = cases
        .iter()
        .flat_map(|case| methods.iter().map(|method| (case.0, *method)))
        .flat_map(|(case, method)| {
            resolutions(case, method, &args.elements).into_iter().map(move |n| (case, method, n))
        })
        .collect();
    let mut found = Found::read(&args.out)?;
    let bar = progress::bar(cells.len(), "cell");
    for (name, ..) in &cases {
        let own: Vec<_> = cells.iter().filter(|cell| cell.0 == *name).collect();
        let missing = own.iter().any(|(case, method, n)| found.row(case, method, *n).is_none());
        if missing || found.truth(name).is_none() {
            bar.set_message(format!("{name}: truth"));
            let (case, note) = Case::new(name)?;
            found.add_truth(note)?;
            for (_, method, n) in own {
                bar.set_message(format!("{name}, {method}, {n}"));
                if found.row(name, method, *n).is_none() {
                    let row = measure(&case, name, method, *n, found.coarser(name, method, *n), args.limit_s);
                    found.add(row)?;
                }
                bar.inc(1);
            }
        } else {
            bar.inc(own.len() as u64);
        }
    }
    bar.finish_and_clear();
    finish(args, &cases, found)
}

/// Writes fronts, picture and document.
fn finish(
    args: &CompareArgs,
    cases: &[(&'static str, &'static str, f64)],
    found: Found,
) -> Result<(), Failure> {
    let Found { mut rows, truths, table, .. } = found;
    let order = |names: &[&str], name: &str| names.iter().position(|known| *known == name);
    let (case_names, methods) = (CASES.map(|case| case.0), CANDIDATES);
    rows.sort_by_key(|row| (order(&case_names, &row.case), order(&methods, &row.method), row.resolution));
    let fronts: Vec<Front> = cases
        .iter()
        .map(|(name, _, at_error)| {
            let own: Vec<&Row> = rows.iter().filter(|row| row.case == *name).collect();
            front(name, &own, *at_error)
        })
        .collect();
    let mut files = vec![table, args.out.join("compare.json")];
    files.extend(picture::write(&args.out, &rows, cases)?);
    let arguments =
        format!("compare {:?} {:?} {:?} {}", args.cases, args.methods, args.elements, args.limit_s);
    let document = Document { provenance: Provenance::of_program(&arguments), truths, rows, fronts, files };
    let path = args.out.join("compare.json");
    whole::write_bytes(&path, (to_json(&document)? + "\n").as_bytes())
        .map_err(|e| Failure::write(&path, &e))?;
    answer(&document, args.json, || text(&document, cases))
}

/// Numbers of elements for a method in a case: those requested, in increasing order, or its defaults.
fn resolutions(case: &str, method: &str, asked: &[usize]) -> Vec<usize> {
    if !asked.is_empty() {
        let mut asked = asked.to_vec();
        asked.sort_unstable();
        asked.dedup();
        return asked;
    }
    let is_static = case.starts_with("cantilever");
    match (is_static, method) {
        (true, "kirchhoff") => vec![2, 3, 4, 5, 6, 8, 12, 16, 32, 64],
        (true, "li2011-dense") => vec![8, 16, 32, 64, 128],
        (true, _) => vec![8, 16, 32, 64, 128, 256],
        (false, "kirchhoff") => vec![5, 10, 20, 40, 80, 160],
        (false, _) => vec![10, 20, 40, 80, 160],
    }
}

/// Measures one cell, repeated as often as time allows. Failures are reported in the row.
fn measure(
    case: &Case,
    name: &str,
    method: &str,
    resolution: usize,
    coarser: Option<&Row>,
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
    if let Some(coarser) = coarser {
        let n = coarser.resolution;
        if coarser.note.contains(LIMIT) {
            row.note = format!("not begun: {n} elements already passed the {LIMIT} {limit_s} s");
            return row;
        }
        let doublings = (resolution as f64 / n as f64).log2();
        if let Some(time_s) = coarser.time_s.filter(|t| t * GROWTH.powf(doublings) > limit_s) {
            row.note = format!("not begun: {n} elements took {time_s:.1} s, the {LIMIT} {limit_s} s");
            return row;
        }
    }
    let mut times = Vec::new();
    let begun = Instant::now();
    loop {
        match case.run(method, resolution, Duration::from_secs_f64(limit_s)) {
            Err(error) => {
                row.note = error.to_string();
                return row;
            }
            Ok(None) => {
                row.note = format!("stopped: passed the {LIMIT} {limit_s} s");
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
        let enough = times.len() >= *REPEATS.start()
            && (spent > REPEAT_FOR_S || begun.elapsed().as_secs_f64() > REPEAT_WITHIN_S);
        if enough || times.len() == *REPEATS.end() || spent > ONCE * limit_s {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    row.time_s = Some(times[times.len() / 2]);
    row
}

/// The rows in the folder.
struct Found {
    table: PathBuf,
    rows: Vec<Row>,
    truth_table: PathBuf,
    truths: Vec<TruthNote>,
}

impl Found {
    fn read(folder: &Path) -> Result<Self, Failure> {
        let (table, truth_table) = (folder.join("compare.csv"), folder.join("truths.csv"));
        Ok(Self { rows: read(&table)?, truths: read(&truth_table)?, table, truth_table })
    }

    fn row(&self, case: &str, method: &str, resolution: usize) -> Option<&Row> {
        self.of(case, method).find(|row| row.resolution == resolution)
    }

    fn of(&self, case: &str, method: &str) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(move |row| row.case == case && row.method == method)
    }

    /// The row at the next coarser resolution.
    fn coarser(&self, case: &str, method: &str, resolution: usize) -> Option<&Row> {
        self.of(case, method).filter(|row| row.resolution < resolution).max_by_key(|row| row.resolution)
    }

    fn truth(&self, case: &str) -> Option<&TruthNote> {
        self.truths.iter().find(|truth| truth.case == case)
    }

    fn add(&mut self, row: Row) -> Result<(), Failure> {
        self.rows.push(row);
        write(&self.table, &self.rows)
    }

    fn add_truth(&mut self, truth: TruthNote) -> Result<(), Failure> {
        self.truths.retain(|known| known.case != truth.case);
        self.truths.push(truth);
        write(&self.truth_table, &self.truths)
    }
}

fn read<T: DeserializeOwned>(table: &Path) -> Result<Vec<T>, Failure> {
    if !table.exists() {
        return Ok(Vec::new());
    }
    let unusable = |e: csv::Error| {
        Failure::Input(format!("{}: {e}: mend it, or choose another folder", table.display()))
    };
    csv::Reader::from_path(table).map_err(unusable)?.deserialize().map(|row| row.map_err(unusable)).collect()
}

fn write<T: Serialize>(table: &Path, rows: &[T]) -> Result<(), Failure> {
    let save = || -> std::io::Result<()> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in rows {
            writer.serialize(row)?;
        }
        whole::write_bytes(table, &writer.into_inner().map_err(csv::IntoInnerError::into_error)?)
    };
    save().map_err(|e| Failure::write(table, &e))
}

/// The tables as text.
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
                (None, _) => "Pareto front: nobody".to_owned(),
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
