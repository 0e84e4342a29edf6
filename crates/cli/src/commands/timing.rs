//! `endowire experiment timing`: the paper's experiment 1, Table 1.
//!
//! A wire of n nodes is advanced through the curved tube by both solves at once. Two times are taken at the full
//! length, each the median over the timed increments: building and solving the linear system (steps 4 and 5 of
//! Algorithm 1), which is where dense and banded differ, and one whole calculation (steps 2 to 6, with collision
//! detection and read-outs), which is what the paper's column counts.

use std::path::Path;
use std::time::Instant;

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Surroundings, WallProperties};
use endowire_core::methods::Method;
use endowire_core::methods::li2011::{Chain, Li2011, Li2011Options, LinearSolver, banded, dense};
use endowire_core::vessel::{GeneratedWall, Resolution, WallQuery, anatomy};
use serde::Serialize;

use crate::args::TimingArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{print, print_json, progress, to_json};

/// The paper's Table 1: nodes, milliseconds, on an Intel Core2 6700 with a GeForce 8800.
const PAPER_MS: [(usize, f64); 5] = [(50, 9.2), (100, 15.4), (150, 24.8), (200, 36.7), (300, 58.4)];
/// Length at which the calculations are timed, mm: past the bend of the curved tube.
const INSERTED_MM: f64 = 220.0;
/// Increment of the approach, mm, and of the timed calculations.
const APPROACH_MM: f64 = 2.0;
const TIMED_MM: f64 = 0.2;
/// A 0.035″ wire of medium stiffness.
const RADIUS_MM: f64 = 0.445;
const STIFFNESS_NMM2: f64 = 20.0;
/// Largest distance between the nodes of the two solves, mm.
const AGREEMENT_MM: f64 = 1e-8;
/// Most nodes: dense, a calculation with 1,000 takes seconds and half a gigabyte.
const MOST_NODES: usize = 1_000;
/// Most timed calculations: those that the tube has room for.
const MOST_REPEATS: usize = 100;

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    method: &'static str,
    nodes: usize,
    /// Median time to build and solve the linear system, ms.
    median_ms: f64,
    /// Median time of one whole calculation, collision detection and read-outs included, ms.
    step_ms: f64,
    /// The paper's time of one calculation, ms, where it has one.
    paper_ms: Option<f64>,
    /// Largest distance, over the whole insertion, between a node here and the same node of li2011-banded, mm.
    max_difference_mm: f64,
}

/// Times every number of nodes and prints the table.
pub(crate) fn timing(args: &TimingArgs) -> Result<(), Failure> {
    if !(1..=MOST_REPEATS).contains(&args.repeats) {
        return Err(Failure::Input(format!(
            "--repeats {}: time 1 to {MOST_REPEATS} calculations",
            args.repeats
        )));
    }
    if args.nodes.is_empty() {
        return Err(Failure::Input("--nodes: give at least one number of nodes".to_owned()));
    }
    if let Some(nodes) = args.nodes.iter().find(|nodes| !(2..=MOST_NODES).contains(*nodes)) {
        return Err(Failure::Input(format!("--nodes {nodes}: give 2 to {MOST_NODES}")));
    }
    let tree = anatomy::tree("curved_tube").ok_or_else(|| Failure::Input("no curved_tube".to_owned()))?;
    let generated = GeneratedWall::new(&tree, Resolution::fitting(&tree))?;
    let query = WallQuery::new(&generated.wall)?;
    let sheath = Sheath::at_opening(&generated.wall, generated.inlet, 1.0)?;
    let device = Device::uniform(INSERTED_MM + TIMED_MM * args.repeats as f64, RADIUS_MM, STIFFNESS_NMM2)?;
    let surroundings = Surroundings {
        wall: &generated.wall,
        properties: &WallProperties::default(),
        query: &query,
        sheath: &sheath,
        device: &device,
    };

    let bar = progress::bar(args.nodes.len(), "row");
    let mut rows = Vec::new();
    for &nodes in &args.nodes {
        bar.set_message(format!("{nodes} nodes"));
        rows.extend(time_nodes(nodes, args.repeats, &surroundings)?);
        bar.inc(1);
    }
    bar.finish_and_clear();

    let arguments = format!("experiment timing {:?} {}", args.nodes, args.repeats);
    let document = Document { provenance: Provenance::of_program(&arguments), rows };
    if let Some(folder) = &args.out {
        write(folder, &document)?;
    }
    if args.json {
        print_json(&document)?;
    } else {
        print(table(&document.rows))?;
    }
    check_agreement(&document.rows)
}

/// Both solves over the same insertion, timed at its end.
fn time_nodes(nodes: usize, repeats: usize, surroundings: &Surroundings<'_>) -> Result<[Row; 2], Failure> {
    // `nodes` counts the sheath's node too; the timed increments stay within the last element.
    let options = Li2011Options {
        element_mm: (INSERTED_MM + 0.5 * TIMED_MM * repeats as f64) / (nodes - 1) as f64,
        ..Default::default()
    };
    let mut dense_method = Li2011::new(options, LinearSolver::Dense, surroundings)?;
    let mut banded_method = Li2011::new(options, LinearSolver::Banded, surroundings)?;
    let mut max_difference_mm: f64 = 0.0;
    let mut step_both = |command: Command| -> Result<[f64; 2], Failure> {
        let clock = Instant::now();
        dense_method.step(surroundings, command)?;
        let dense_ms = milliseconds(clock);
        let clock = Instant::now();
        banded_method.step(surroundings, command)?;
        let banded_ms = milliseconds(clock);
        let (a, b) = (dense_method.shape(), banded_method.shape());
        for (a, b) in a.positions_mm.iter().zip(&b.positions_mm) {
            max_difference_mm = max_difference_mm.max((a - b).norm());
        }
        Ok([dense_ms, banded_ms])
    };
    for _ in 0..(INSERTED_MM / APPROACH_MM).round() as usize {
        step_both(Command::advance(APPROACH_MM))?;
    }
    let mut steps = [Vec::new(), Vec::new()];
    for _ in 0..repeats {
        let times = step_both(Command::advance(TIMED_MM))?;
        steps[0].push(times[0]);
        steps[1].push(times[1]);
    }
    let solves = time_solves(banded_method.chain(), repeats);
    let paper_ms = PAPER_MS.iter().find(|(n, _)| *n == nodes).map(|(_, ms)| *ms);
    let [dense_steps, banded_steps] = steps;
    let [dense_solves, banded_solves] = solves;
    Ok([
        Row {
            method: "li2011-dense",
            nodes,
            median_ms: median(dense_solves),
            step_ms: median(dense_steps),
            paper_ms,
            max_difference_mm,
        },
        Row {
            method: "li2011-banded",
            nodes,
            median_ms: median(banded_solves),
            step_ms: median(banded_steps),
            paper_ms,
            max_difference_mm: 0.0,
        },
    ])
}

/// Times of the linear system alone, both solves of the same chain.
fn time_solves(chain: &Chain, repeats: usize) -> [Vec<f64>; 2] {
    let (mut x, mut t) = (Vec::new(), Vec::new());
    let mut workspace = banded::Workspace::default();
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..repeats {
        let clock = Instant::now();
        dense::solve(chain, &mut x, &mut t);
        times[0].push(milliseconds(clock));
        let clock = Instant::now();
        banded::solve(chain, &mut workspace, &mut x, &mut t);
        times[1].push(milliseconds(clock));
    }
    times
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Median; `values` is not empty.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

/// The table for a person.
fn table(rows: &[Row]) -> String {
    let mut lines = vec![format!(
        "{:>5}  {:<14} {:>12} {:>12} {:>10} {:>16}",
        "nodes", "method", "solve ms", "step ms", "paper ms", "difference mm"
    )];
    for row in rows {
        let paper = row.paper_ms.map_or("–".to_owned(), |ms| format!("{ms:.1}"));
        lines.push(format!(
            "{:>5}  {:<14} {:>12.4} {:>12.4} {:>10} {:>16.1e}",
            row.nodes, row.method, row.median_ms, row.step_ms, paper, row.max_difference_mm
        ));
    }
    lines.join("\n")
}

/// Both solves are one method: their nodes must agree.
fn check_agreement(rows: &[Row]) -> Result<(), Failure> {
    match rows.iter().find(|row| row.max_difference_mm.is_nan() || row.max_difference_mm > AGREEMENT_MM) {
        None => Ok(()),
        Some(row) => Err(Failure::Computation(format!(
            "with {} nodes {} is {:.1e} mm from li2011-banded: the two solves of the same equations must agree within \
             {AGREEMENT_MM:e} mm",
            row.nodes, row.method, row.max_difference_mm
        ))),
    }
}

fn write(folder: &Path, document: &Document) -> Result<(), Failure> {
    let save = || -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut table = csv::Writer::from_path(folder.join("timing.csv"))?;
        for row in &document.rows {
            table.serialize(row)?;
        }
        table.flush()
    };
    save().map_err(|e| Failure::write(folder, &e))?;
    let path = folder.join("timing.json");
    std::fs::write(&path, to_json(document)? + "\n").map_err(|e| Failure::write(&path, &e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_that_differ_fail_the_experiment() {
        let row = |max_difference_mm| Row {
            method: "li2011-dense",
            nodes: 50,
            median_ms: 1.0,
            step_ms: 1.0,
            paper_ms: None,
            max_difference_mm,
        };
        assert!(check_agreement(&[row(0.0), row(9e-9)]).is_ok());
        for difference in [2e-8, f64::NAN] {
            let failure = check_agreement(&[row(0.0), row(difference)]).unwrap_err();
            assert!(matches!(&failure, Failure::Computation(text) if text.contains("50 nodes")), "{failure}");
        }
    }
}
