//! `endowire experiment timing`: what [`endowire_lab::experiment::timing`] measures, drawn and written.

use std::path::PathBuf;

use endowire_lab::experiment::timing::{MOST_NODES, MOST_REPEATS, PAPER_MS, Row, Timing, check_agreement};
use endowire_lab::studies::CANDIDATES;
use serde::Serialize;

use super::lines::{Line, Lines, PAPER};
use crate::args::TimingArgs;
use crate::commands::lab::check_limit_s;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};

/// The paper's frames per second with 300 nodes.
const PAPER_FPS: f64 = 17.0;

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    rows: Vec<Row>,
    /// The picture of the table.
    frames: Vec<PathBuf>,
}

/// Times every number of nodes and prints the table.
pub(crate) fn timing(args: &TimingArgs) -> Result<(), Failure> {
    if !(1..=MOST_REPEATS).contains(&args.repeats) {
        return Err(Failure::Input(format!(
            "--repeats {}: time 1 to {MOST_REPEATS} calculations",
            args.repeats
        )));
    }
    check_limit_s(args.limit_s)?;
    if args.nodes.is_empty() {
        return Err(Failure::Input("--nodes: give at least one number of nodes".to_owned()));
    }
    if let Some(nodes) = args.nodes.iter().find(|nodes| !(2..=MOST_NODES).contains(*nodes)) {
        return Err(Failure::Input(format!("--nodes {nodes}: give 2 to {MOST_NODES}")));
    }
    let timing = Timing::new(args.repeats, args.limit_s)?;

    let methods = methods(&args.methods);
    let (paper, others): (Vec<&str>, Vec<&str>) =
        methods.iter().partition(|m| ["li2011-dense", "li2011-banded"].contains(m));
    let bar = progress::bar(args.nodes.len() * (usize::from(!paper.is_empty()) + others.len()), "row");
    let mut rows: Vec<Row> = Vec::new();
    for &nodes in &args.nodes {
        if !paper.is_empty() {
            bar.set_message(format!("{nodes} nodes, li2011"));
            let dense = paper.contains(&"li2011-dense");
            let timed = timing.paper(nodes, dense)?;
            rows.extend(timed.into_iter().filter(|row| paper.contains(&row.method)));
            bar.inc(1);
        }
        for method in &others {
            bar.set_message(format!("{nodes} nodes, {method}"));
            let stopped = |row: &&Row| row.method == *method && row.median_ms.is_none() && row.nodes <= nodes;
            rows.push(match rows.iter().find(stopped) {
                Some(row) => Row::untimed(method, nodes, format!("not begun: see {} nodes", row.nodes)),
                None => timing.other(method, nodes),
            });
            bar.inc(1);
        }
    }
    bar.finish_and_clear();

    let arguments = format!("experiment timing {:?} {} {methods:?}", args.nodes, args.repeats);
    let frames = match &args.out {
        Some(folder) => picture(&rows).write(folder, "timing")?,
        None => Vec::new(),
    };
    let document = Document { provenance: Provenance::of_program(&arguments), rows, frames };
    if let Some(folder) = &args.out {
        super::write(folder, "timing", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(&document.rows))?;
    Ok(check_agreement(&document.rows)?)
}

/// The requested methods, in the order of the table.
fn methods(asked: &[String]) -> Vec<&'static str> {
    let is_asked = |name: &&str| asked.iter().any(|wanted| wanted == "all" || wanted == name);
    CANDIDATES.into_iter().filter(is_asked).collect()
}

/// Draws the time of a whole calculation against the number of nodes.
fn picture(rows: &[Row]) -> Lines {
    let mut lines = vec![Line {
        method: PAPER.to_owned(),
        of: String::new(),
        points: PAPER_MS.map(|(nodes, ms)| (nodes as f64, ms)).to_vec(),
    }];
    for method in CANDIDATES {
        let own = rows.iter().filter(|row| row.method == method);
        let points: Vec<_> =
            own.filter_map(|row| Some((row.nodes as f64, row.step_ms.or(row.median_ms)?))).collect();
        if !points.is_empty() {
            lines.push(Line { method: method.to_owned(), of: String::new(), points });
        }
    }
    Lines {
        title: "experiment 1: time of one calculation",
        across: "nodes",
        up: "ms",
        logarithmic: true,
        lines,
    }
}

/// The table as text.
fn table(rows: &[Row]) -> String {
    let mut lines = vec![format!(
        "{:>5}  {:<15} {:>12} {:>12} {:>10} {:>16}",
        "nodes", "method", "solve ms", "step ms", "paper ms", "difference mm"
    )];
    let number = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
    };
    for row in rows {
        let difference = row.max_difference_mm.map_or_else(|| "–".to_owned(), |mm| format!("{mm:.1e}"));
        lines.push(
            format!(
                "{:>5}  {:<15} {:>12} {:>12} {:>10} {:>16}  {}",
                row.nodes,
                row.method,
                number(row.median_ms, 4),
                number(row.step_ms, 4),
                number(row.paper_ms, 1),
                difference,
                row.note
            )
            .trim_end()
            .to_owned(),
        );
    }
    for row in rows.iter().filter(|row| row.nodes == 300 && row.method != "li2011-dense") {
        if let Some(step_ms) = row.step_ms {
            let fps = 1e3 / step_ms;
            lines.push(format!(
                "300 nodes, {}: {fps:.0} calculations a second, {:.0} times the paper's {PAPER_FPS}",
                row.method,
                fps / PAPER_FPS
            ));
        }
    }
    lines.join("\n")
}
