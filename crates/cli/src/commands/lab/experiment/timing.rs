//! `endowire experiment timing`: the paper's experiment 1, Table 1.
//!
//! A wire of n nodes is advanced through the curved tube by both solves simultaneously. Two times are measured at the
//! full length, each as the median over the timed increments: building and solving the linear system (steps 4 and 5
//! of Algorithm 1), in which dense and banded differ, and one whole calculation (steps 2 to 6, with collision
//! detection and read-outs), which the paper reports.
//!
//! If a method cannot be brought into position within the time limit, its row says so, and larger numbers of nodes
//! are skipped.

use std::path::PathBuf;
use std::time::Instant;

use endowire_core::Vec3;
use endowire_core::device::{Device, Stack};
use endowire_core::insertion::{Command, Sheath, Surroundings, WallProperties};
use endowire_core::methods::Method;
use endowire_core::vessel::{GeneratedWall, Lumen, NoStore, Resolution, Wall, anatomy};
use endowire_methods::li2011::{Chain, Li2011, Li2011Options, LinearSolver, banded, dense};
use serde::Serialize;

use super::lines::{Line, Lines, PAPER};
use crate::args::TimingArgs;
use crate::commands::lab::check_limit_s;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};
use endowire_lab::compare::candidate;
use endowire_lab::studies::CANDIDATES;

/// The paper's Table 1: nodes, milliseconds, on an Intel Core2 6700 with a GeForce 8800.
const PAPER_MS: [(usize, f64); 5] = [(50, 9.2), (100, 15.4), (150, 24.8), (200, 36.7), (300, 58.4)];
/// Length at which the calculations are timed, mm: past the bend of the curved tube.
const INSERTED_MM: f64 = 220.0;
/// Increments of the approach and of the timed calculations, mm.
const APPROACH_MM: f64 = 2.0;
const TIMED_MM: f64 = 0.2;
/// A 0.035″ wire of medium stiffness.
const RADIUS_MM: f64 = 0.445;
const STIFFNESS_NMM2: f64 = 20.0;
/// Largest distance between the nodes of the two solves, mm.
const AGREEMENT_MM: f64 = 1e-8;
/// Largest number of nodes.
const MOST_NODES: usize = 10_000;
/// Largest number of nodes for which the dense solve carries out the whole way itself. Bringing 1,000 nodes into
/// position would take minutes; beyond this limit it solves the states of the banded one.
const MOST_FOLLOWED: usize = 500;
/// The paper's frames per second with 300 nodes.
const PAPER_FPS: f64 = 17.0;
/// Largest number of timed calculations: those for which the tube has room.
const MOST_REPEATS: usize = 100;

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    rows: Vec<Row>,
    /// The picture of the table.
    frames: Vec<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Row {
    method: &'static str,
    nodes: usize,
    /// Median time to build and solve the linear system, ms; of the whole calculation if there is no single system.
    /// `None` if the method was not timed, as the note says.
    median_ms: Option<f64>,
    /// Median time of one whole calculation, including collision detection and read-outs, ms.
    step_ms: Option<f64>,
    /// The paper's time of one calculation, ms, if published.
    paper_ms: Option<f64>,
    /// For the two solves of the paper's method: largest distance, over the whole insertion, between a node and the
    /// same node of li2011-banded, mm.
    max_difference_mm: Option<f64>,
    /// Why a method was not timed, or a remark.
    note: String,
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
    let tree = anatomy::tree("curved_tube").ok_or_else(|| Failure::Input("no curved_tube".to_owned()))?;
    let generated = GeneratedWall::new(&tree, Resolution::fitting(&tree))?;
    let lumen = Lumen::from(generated.wall.clone());
    let sheath = Sheath::at_opening(&generated.wall, generated.inlet, 1.0)?;
    let device = Device::uniform(INSERTED_MM + TIMED_MM * args.repeats as f64, RADIUS_MM, STIFFNESS_NMM2)?;
    let stack = Stack::from(device.clone());
    let surroundings = Surroundings {
        lumen: &lumen,
        properties: &WallProperties::default(),
        sheath: &sheath,
        device: &device,
        stack: &stack,
        motion: None,
        course: None,
        flow: None,
        fields: [&[], &[]],
        stop: None,
        time_s: [0.0; 2],
    };

    let methods = methods(&args.methods);
    let (paper, others): (Vec<&str>, Vec<&str>) =
        methods.iter().partition(|m| ["li2011-dense", "li2011-banded"].contains(m));
    let bar = progress::bar(args.nodes.len() * (usize::from(!paper.is_empty()) + others.len()), "row");
    let mut rows: Vec<Row> = Vec::new();
    for &nodes in &args.nodes {
        if !paper.is_empty() {
            bar.set_message(format!("{nodes} nodes, li2011"));
            let dense = paper.contains(&"li2011-dense");
            let timed = time_paper(nodes, args, dense, &surroundings)?;
            rows.extend(timed.into_iter().filter(|row| paper.contains(&row.method)));
            bar.inc(1);
        }
        for method in &others {
            bar.set_message(format!("{nodes} nodes, {method}"));
            let stopped = |row: &&Row| row.method == *method && row.median_ms.is_none() && row.nodes <= nodes;
            rows.push(match rows.iter().find(stopped) {
                Some(row) => Row::untimed(method, nodes, format!("not begun: see {} nodes", row.nodes)),
                None => time_other(method, nodes, args, &generated.wall, sheath, &device)?,
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
    check_agreement(&document.rows)
}

impl Row {
    fn untimed(method: &'static str, nodes: usize, note: String) -> Self {
        Self {
            method,
            nodes,
            median_ms: None,
            step_ms: None,
            paper_ms: paper_ms(nodes),
            max_difference_mm: None,
            note,
        }
    }
}

/// The paper's time with this number of nodes, ms.
fn paper_ms(nodes: usize) -> Option<f64> {
    PAPER_MS.iter().find(|(n, _)| *n == nodes).map(|(_, ms)| *ms)
}

/// The requested methods, in the order of the table.
fn methods(asked: &[String]) -> Vec<&'static str> {
    let is_asked = |name: &&str| asked.iter().any(|wanted| wanted == "all" || wanted == name);
    CANDIDATES.into_iter().filter(is_asked).collect()
}

/// Element length with which `nodes` nodes, including that of the sheath, are inserted; the timed increments stay
/// within one element.
fn element_mm(nodes: usize, repeats: usize) -> f64 {
    (INSERTED_MM + 0.5 * TIMED_MM * repeats as f64) / (nodes - 1) as f64
}

/// Times a method without a linear system of its own. Failures are reported in the row.
fn time_other(
    method: &'static str,
    nodes: usize,
    args: &TimingArgs,
    wall: &Wall,
    sheath: Sheath,
    device: &Device,
) -> Result<Row, Failure> {
    let element = element_mm(nodes, args.repeats);
    let properties = WallProperties::default();
    let mut simulation =
        match candidate::insertion(method, element, wall.clone(), properties, device.clone(), sheath) {
            Ok(simulation) => simulation,
            Err(refusal) => return Ok(Row::untimed(method, nodes, refusal.to_string())),
        };
    let begun = Instant::now();
    let mut steps = Vec::new();
    let mut unconverged = 0;
    let approach = (INSERTED_MM / APPROACH_MM).round() as usize;
    for step in 0..approach + args.repeats {
        let timed = step >= approach;
        let clock = Instant::now();
        match simulation.step(Command::advance(if timed { TIMED_MM } else { APPROACH_MM })) {
            Ok(report) => unconverged += usize::from(timed && !report.converged),
            Err(error) => return Ok(Row::untimed(method, nodes, error.to_string())),
        }
        if timed {
            steps.push(milliseconds(clock));
        }
        if begun.elapsed().as_secs_f64() > args.limit_s && steps.is_empty() {
            let note = format!("stopped at the limit of {} s, {step} steps in", args.limit_s);
            return Ok(Row::untimed(method, nodes, note));
        }
        if begun.elapsed().as_secs_f64() > 2.0 * args.limit_s {
            break;
        }
    }
    let note = if unconverged > 0 { format!("{unconverged} steps unconverged") } else { String::new() };
    let median_ms = Some(median(steps));
    Ok(Row { median_ms, step_ms: median_ms, ..Row::untimed(method, nodes, note) })
}

/// Both solves of the paper's method over the same insertion, timed at its end; the dense one only if requested.
fn time_paper(
    nodes: usize,
    args: &TimingArgs,
    dense: bool,
    surroundings: &Surroundings<'_>,
) -> Result<Vec<Row>, Failure> {
    let repeats = args.repeats;
    let options = Li2011Options { element_mm: element_mm(nodes, repeats), ..Default::default() };
    let mut refusal = None;
    let mut dense_method = match Li2011::new(options, LinearSolver::Dense, surroundings, &NoStore) {
        Ok(method) => Some(method).filter(|_| dense),
        Err(reason) => {
            refusal = Some(reason.to_string()).filter(|_| dense);
            None
        }
    };
    let dense = dense_method.is_some();
    let follows = dense && nodes <= MOST_FOLLOWED;
    let mut banded_method = Li2011::new(options, LinearSolver::Banded, surroundings, &NoStore)?;
    let mut max_difference_mm: f64 = 0.0;
    let mut step_both = |command: Command| -> Result<[f64; 2], Failure> {
        let clock = Instant::now();
        if let Some(method) = dense_method.as_mut().filter(|_| follows) {
            method.step(surroundings, command)?;
        }
        let dense_ms = milliseconds(clock);
        let clock = Instant::now();
        banded_method.step(surroundings, command)?;
        let banded_ms = milliseconds(clock);
        if let Some(method) = &dense_method {
            let (a, b) = (method.shape(), banded_method.shape());
            max_difference_mm = max_difference_mm.max(largest_distance(&a.positions_mm, &b.positions_mm));
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
    let solves = time_solves(banded_method.chain(), repeats, dense, args.limit_s);
    let [dense_steps, banded_steps] = steps;
    let mut rows = Vec::new();
    rows.extend(refusal.map(|reason| Row::untimed("li2011-dense", nodes, reason)));
    if dense {
        let note = if follows {
            String::new()
        } else {
            format!("{} solves where li2011-banded has come to", solves.dense_ms.len())
        };
        rows.push(Row {
            median_ms: Some(median(solves.dense_ms)),
            step_ms: follows.then(|| median(dense_steps)),
            max_difference_mm: Some(max_difference_mm.max(solves.difference_mm)),
            ..Row::untimed("li2011-dense", nodes, note)
        });
    }
    rows.push(Row {
        median_ms: Some(median(solves.banded_ms)),
        step_ms: Some(median(banded_steps)),
        max_difference_mm: Some(0.0),
        ..Row::untimed("li2011-banded", nodes, String::new())
    });
    Ok(rows)
}

/// Times of the linear system alone, and the distance between the nodes of the two solves.
#[derive(Default)]
struct Solves {
    dense_ms: Vec<f64>,
    banded_ms: Vec<f64>,
    difference_mm: f64,
}

/// Times both solves of the same chain at least once, within the time limit.
fn time_solves(chain: &Chain, repeats: usize, dense: bool, limit_s: f64) -> Solves {
    let (mut x, mut dense_x, mut t) = (Vec::new(), Vec::new(), Vec::new());
    let mut workspace = banded::Workspace::default();
    let mut solves = Solves::default();
    let begun = Instant::now();
    while solves.banded_ms.len() < repeats
        && (solves.banded_ms.is_empty() || begun.elapsed().as_secs_f64() < limit_s)
    {
        let clock = Instant::now();
        banded::solve(chain, &mut workspace, &mut x, &mut t);
        solves.banded_ms.push(milliseconds(clock));
        if dense {
            let clock = Instant::now();
            dense::solve(chain, &mut dense_x, &mut t);
            solves.dense_ms.push(milliseconds(clock));
        }
    }
    solves.difference_mm = largest_distance(&dense_x, &x);
    solves
}

/// Largest distance between corresponding points of two chains; 0 if one is empty.
fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
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

/// Checks that both solves agree, since they are the same method.
fn check_agreement(rows: &[Row]) -> Result<(), Failure> {
    for row in rows {
        let Some(difference) = row.max_difference_mm else { continue };
        if difference.is_nan() || difference > AGREEMENT_MM {
            return Err(Failure::Computation(format!(
                "with {} nodes {} is {difference:.1e} mm from li2011-banded: the two solves of the same equations must agree \
                 within {AGREEMENT_MM:e} mm",
                row.nodes, row.method
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_that_differ_fail_the_experiment() {
        let row = |difference| Row {
            max_difference_mm: Some(difference),
            ..Row::untimed("li2011-dense", 50, String::new())
        };
        assert!(check_agreement(&[row(0.0), row(9e-9)]).is_ok());
        for difference in [2e-8, f64::NAN] {
            let failure = check_agreement(&[row(0.0), row(difference)]).unwrap_err();
            assert!(matches!(&failure, Failure::Computation(text) if text.contains("50 nodes")), "{failure}");
        }
    }
}
