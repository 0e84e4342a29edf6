//! `endowire experiment timing`: the paper's experiment 1, Table 1.
//!
//! A wire of n nodes is advanced through the curved tube by both solves simultaneously. Two times are measured at the
//! full length, each as the median over the timed increments: building and solving the linear system (steps 4 and 5
//! of Algorithm 1), in which dense and banded differ, and one whole calculation (steps 2 to 6, with collision
//! detection and read-outs), which the paper reports.
//!
//! If a method cannot be brought into position within the time limit, its row says so, and larger numbers of nodes
//! are skipped.

use std::time::Instant;

use endowire_core::device::{Device, Stack};
use endowire_core::insertion::{Command, Sheath, Surroundings, WallProperties};
use endowire_core::methods::Method;
use endowire_core::vessel::{GeneratedWall, Lumen, NoStore, Resolution, Wall, anatomy};
use endowire_core::{Error, Result, Vec3};
use endowire_methods::li2011::{Chain, Li2011, Li2011Options, LinearSolver, banded, dense};
use serde::Serialize;

use crate::compare::candidate;

/// The paper's Table 1: nodes, milliseconds, on an Intel Core2 6700 with a GeForce 8800.
pub const PAPER_MS: [(usize, f64); 5] = [(50, 9.2), (100, 15.4), (150, 24.8), (200, 36.7), (300, 58.4)];
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
pub const MOST_NODES: usize = 10_000;
/// Largest number of nodes for which the dense solve carries out the whole way itself. Bringing 1,000 nodes into
/// position would take minutes; beyond this limit it solves the states of the banded one.
const MOST_FOLLOWED: usize = 500;
/// Largest number of timed calculations: those for which the tube has room.
pub const MOST_REPEATS: usize = 100;

/// Times of a method with a number of nodes.
#[derive(Debug, Serialize)]
pub struct Row {
    /// The method.
    pub method: &'static str,
    /// Nodes.
    pub nodes: usize,
    /// Median time to build and solve the linear system, ms; of the whole calculation if there is no single system.
    /// `None` if the method was not timed, as the note says.
    pub median_ms: Option<f64>,
    /// Median time of one whole calculation, including collision detection and read-outs, ms.
    pub step_ms: Option<f64>,
    /// The paper's time of one calculation, ms, if published.
    pub paper_ms: Option<f64>,
    /// For the two solves of the paper's method: largest distance, over the whole insertion, between a node and the
    /// same node of li2011-banded, mm.
    pub max_difference_mm: Option<f64>,
    /// Why a method was not timed, or a remark.
    pub note: String,
}

/// The curved tube, the wire, and how often calculations are timed.
#[derive(Debug)]
pub struct Timing {
    wall: Wall,
    sheath: Sheath,
    device: Device,
    repeats: usize,
    limit_s: f64,
}

impl Timing {
    /// `repeats` timed calculations, each method within `limit_s`.
    ///
    /// # Errors
    /// None with 1 to [`MOST_REPEATS`].
    pub fn new(repeats: usize, limit_s: f64) -> Result<Self> {
        let tree =
            anatomy::tree("curved_tube").ok_or_else(|| Error::Computation("no curved_tube".to_owned()))?;
        let GeneratedWall { wall, inlet, .. } = GeneratedWall::new(&tree, Resolution::fitting(&tree))?;
        let sheath = Sheath::at_opening(&wall, inlet, 1.0)?;
        let device = Device::uniform(INSERTED_MM + TIMED_MM * repeats as f64, RADIUS_MM, STIFFNESS_NMM2)?;
        Ok(Self { wall, sheath, device, repeats, limit_s })
    }

    /// Times a method without a linear system of its own. Failures are reported in the row.
    pub fn other(&self, method: &'static str, nodes: usize) -> Row {
        let Self { wall, sheath, device, repeats, limit_s } = self;
        let element = element_mm(nodes, *repeats);
        let properties = WallProperties::default();
        let mut simulation =
            match candidate::insertion(method, element, wall.clone(), properties, device.clone(), *sheath) {
                Ok(simulation) => simulation,
                Err(refusal) => return Row::untimed(method, nodes, refusal.to_string()),
            };
        let begun = Instant::now();
        let mut steps = Vec::new();
        let mut unconverged = 0;
        let approach = (INSERTED_MM / APPROACH_MM).round() as usize;
        for step in 0..approach + repeats {
            let timed = step >= approach;
            let clock = Instant::now();
            match simulation.step(Command::advance(if timed { TIMED_MM } else { APPROACH_MM })) {
                Ok(report) => unconverged += usize::from(timed && !report.converged),
                Err(error) => return Row::untimed(method, nodes, error.to_string()),
            }
            if timed {
                steps.push(milliseconds(clock));
            }
            if begun.elapsed().as_secs_f64() > *limit_s && steps.is_empty() {
                let note = format!("stopped at the limit of {limit_s} s, {step} steps in");
                return Row::untimed(method, nodes, note);
            }
            if begun.elapsed().as_secs_f64() > 2.0 * limit_s {
                break;
            }
        }
        let note = if unconverged > 0 { format!("{unconverged} steps unconverged") } else { String::new() };
        let median_ms = Some(median(steps));
        Row { median_ms, step_ms: median_ms, ..Row::untimed(method, nodes, note) }
    }

    /// Both solves of the paper's method over the same insertion, timed at its end; the dense one only if requested.
    ///
    /// # Errors
    /// A step without a solution.
    pub fn paper(&self, nodes: usize, dense: bool) -> Result<Vec<Row>> {
        let repeats = self.repeats;
        let (lumen, stack) = (Lumen::from(self.wall.clone()), Stack::from(self.device.clone()));
        let properties = WallProperties::default();
        let surroundings = &Surroundings::at_rest(&lumen, &properties, &self.sheath, &stack);
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
        let mut step_both = |command: Command| -> Result<[f64; 2]> {
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
        let solves = time_solves(banded_method.chain(), repeats, dense, self.limit_s);
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
}

impl Row {
    /// The row of a method that was not timed.
    pub fn untimed(method: &'static str, nodes: usize, note: String) -> Self {
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

/// Element length with which `nodes` nodes, including that of the sheath, are inserted; the timed increments stay
/// within one element.
fn element_mm(nodes: usize, repeats: usize) -> f64 {
    (INSERTED_MM + 0.5 * TIMED_MM * repeats as f64) / (nodes - 1) as f64
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

/// Checks that both solves agree, since they are the same method.
///
/// # Errors
/// The first row in which they do not.
pub fn check_agreement(rows: &[Row]) -> Result<()> {
    for row in rows {
        let Some(difference) = row.max_difference_mm else { continue };
        if difference.is_nan() || difference > AGREEMENT_MM {
            return Err(Error::Computation(format!(
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
            assert!(matches!(&failure, Error::Computation(text) if text.contains("50 nodes")), "{failure}");
        }
    }
}
