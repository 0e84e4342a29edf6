//! `endowire experiment deformation`: the paper's experiment 4, Table 2.
//!
//! A wire is pushed into the curved tube of figure 5 by increments h on segments l, and its shape is compared with a
//! reference. The paper's reference is a real catheter in a plastic tube, whose points are not published. Here it is
//! our own solution, shown to be converged, or measured points of the user.

use std::time::Instant;

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::shape::Shape;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;

use crate::compare::candidate;
use crate::compare::case::rms_distance;

/// A cell of the paper's Table 2: segment length l in mm, l/h, RMS mm, maximum mm, run time s.
pub type Cell = (f64, u32, f64, f64, f64);
/// The whole table.
pub const TABLE_2: [Cell; 15] = [
    (1.0, 40, 1.38, 2.32, 180.7),
    (2.0, 40, 1.54, 2.42, 49.7),
    (3.0, 40, 1.76, 2.74, 29.5),
    (1.0, 20, 1.16, 2.12, 84.5),
    (2.0, 20, 1.47, 2.24, 23.2),
    (3.0, 20, 1.66, 2.38, 15.4),
    (1.0, 10, 1.12, 2.16, 41.4),
    (2.0, 10, 1.35, 2.36, 11.5),
    (3.0, 10, 1.86, 2.45, 6.9),
    (1.0, 5, 0.96, 1.52, 20.5),
    (2.0, 5, 1.26, 1.88, 5.9),
    (3.0, 5, 1.44, 2.56, 3.9),
    (1.0, 3, 1.05, 1.76, 11.6),
    (2.0, 3, 1.24, 2.13, 3.5),
    (3.0, 3, 1.62, 2.22, 2.1),
];
/// Inserted length, mm: through most of the bend. The paper does not give it.
const INSERTED_MM: f64 = 200.0;
/// Element lengths of the reference, mm, and its increment.
pub const TRUTH_MM: [f64; 3] = [1.0, 0.5, 0.25];
const TRUTH_STEP_MM: f64 = 1.0;
/// A 0.035″ wire.
const RADIUS_MM: f64 = 0.445;
const STIFFNESS_NMM2: f64 = 10.0;
/// Edge length of the tube's triangles, mm.
const EDGE_MM: f64 = 0.8;

/// A cell, beside the paper's.
#[derive(Debug, Serialize)]
pub struct Row {
    /// The method.
    pub method: String,
    /// Length of segments l, mm.
    pub l_mm: f64,
    /// l/h.
    pub l_over_h: u32,
    /// Distance from the reference, root of the mean square, mm.
    pub rms_mm: f64,
    /// Largest distance from the reference, mm.
    pub max_mm: f64,
    /// Run time, s.
    pub time_s: f64,
    /// The paper's distance, mm.
    pub paper_rms_mm: f64,
    /// The paper's largest distance, mm.
    pub paper_max_mm: f64,
    /// The paper's run time, s.
    pub paper_time_s: f64,
    /// The paper's time divided by ours.
    pub speedup: f64,
    /// Linear solves, or iterations as the method counts them, of all steps.
    pub iterations: u64,
    /// Number of steps.
    pub steps: usize,
    /// Number of steps that failed the method's own convergence test.
    pub unconverged: usize,
    /// Length of the polygon of nodes divided by the inserted length, minus 1.
    pub length_off: f64,
}

/// Change of the reference from one mesh to the next.
#[derive(Debug, Serialize)]
pub struct Refinement {
    /// Length of elements before, mm.
    pub from_mm: f64,
    /// Length of elements after, mm.
    pub to_mm: f64,
    /// Root of the mean square, mm.
    pub rms_change_mm: f64,
    /// Largest change, mm.
    pub max_change_mm: f64,
}

/// Totals of a method over all requested cells.
#[derive(Debug, Serialize)]
pub struct Total {
    /// The method.
    pub method: String,
    /// Run time, s.
    pub time_s: f64,
    /// The paper's, s.
    pub paper_time_s: f64,
    /// The paper's time divided by ours.
    pub speedup: f64,
}

/// Vessel, sheath and wire of all cells.
#[derive(Debug)]
pub struct Tube {
    /// The vessel.
    pub made: GeneratedWall,
    sheath: Sheath,
    wire: Device,
}

/// Result of an insertion.
pub struct Inserted {
    /// Where it has come to.
    pub simulation: Simulation,
    time_s: f64,
    iterations: u64,
    steps: usize,
    unconverged: usize,
}

impl Tube {
    /// The paper's curved tube, and the wire.
    ///
    /// # Errors
    /// None with what is built in.
    pub fn new() -> Result<Self> {
        let tree =
            anatomy::tree("curved_tube").ok_or_else(|| Error::Computation("no curved_tube".to_owned()))?;
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(EDGE_MM))?;
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
        Ok(Self { made, sheath, wire: Device::uniform(INSERTED_MM + 1.0, RADIUS_MM, STIFFNESS_NMM2)? })
    }

    /// The reference, and how much its last refinements change it; `begins` hears of each mesh.
    ///
    /// # Errors
    /// A step without an equilibrium.
    pub fn truth(&self, mut begins: impl FnMut(f64)) -> Result<(Shape, Vec<Refinement>)> {
        let mut shapes: Vec<Shape> = Vec::new();
        for l_mm in TRUTH_MM {
            begins(l_mm);
            shapes.push(self.insert("kirchhoff", l_mm, TRUTH_STEP_MM)?.simulation.shape().clone());
        }
        let mut convergence = Vec::new();
        for (k, pair) in shapes.windows(2).enumerate() {
            let (rms_change_mm, max_change_mm) = rms_distance(&pair[0], &pair[1]);
            let (from_mm, to_mm) = (TRUTH_MM[k], TRUTH_MM[k + 1]);
            convergence.push(Refinement { from_mm, to_mm, rms_change_mm, max_change_mm });
        }
        Ok((shapes.swap_remove(TRUTH_MM.len() - 1), convergence))
    }

    /// Carries out the whole insertion.
    ///
    /// # Errors
    /// A step without an equilibrium.
    pub fn insert(&self, method: &str, l_mm: f64, h_mm: f64) -> Result<Inserted> {
        let mut simulation = candidate::insertion(
            method,
            l_mm,
            self.made.wall.clone(),
            WallProperties::default(),
            self.wire.clone(),
            self.sheath,
        )?;
        let steps = (INSERTED_MM / h_mm - 1e-9).ceil() as usize;
        let (mut iterations, mut unconverged) = (0, 0);
        let clock = Instant::now();
        for k in 0..steps {
            let inserted = simulation.report().inserted_mm;
            let target = if k + 1 == steps { INSERTED_MM } else { h_mm * (k + 1) as f64 };
            let report = simulation.step(Command::advance(target - inserted))?;
            iterations += u64::from(report.iterations);
            unconverged += usize::from(!report.converged);
        }
        Ok(Inserted { time_s: clock.elapsed().as_secs_f64(), simulation, iterations, steps, unconverged })
    }
}

impl Row {
    /// Compares an insertion with the reference.
    pub fn new(method: &str, cell: Cell, inserted: &Inserted, truth: &Shape) -> Self {
        let (l_mm, l_over_h, paper_rms_mm, paper_max_mm, paper_time_s) = cell;
        let shape = inserted.simulation.shape();
        let (rms_mm, max_mm) = rms_distance(shape, truth);
        let length_mm: f64 = shape.positions_mm.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
        Self {
            method: method.to_owned(),
            l_mm,
            l_over_h,
            rms_mm,
            max_mm,
            time_s: inserted.time_s,
            paper_rms_mm,
            paper_max_mm,
            paper_time_s,
            speedup: paper_time_s / inserted.time_s,
            iterations: inserted.iterations,
            steps: inserted.steps,
            unconverged: inserted.unconverged,
            length_off: length_mm / INSERTED_MM - 1.0,
        }
    }
}

impl Total {
    /// Sums the rows of a method.
    pub fn new(method: &str, rows: &[Row]) -> Self {
        let time_s = rows.iter().map(|row| row.time_s).sum();
        let paper_time_s: f64 = rows.iter().map(|row| row.paper_time_s).sum();
        Self { method: method.to_owned(), time_s, paper_time_s, speedup: paper_time_s / time_s }
    }
}

/// The shape of a polyline through points that differ, from the sheath to the tip.
pub fn polyline(points_mm: Vec<Vec3>) -> Shape {
    let mut shape = Shape { positions_mm: points_mm, ..Shape::default() };
    let n = shape.len();
    let chord = |i: usize| shape.positions_mm[i + 1] - shape.positions_mm[i];
    let mut from_tip = 0.0;
    let mut from_tip_mm = vec![0.0; n];
    for i in (0..n - 1).rev() {
        from_tip += chord(i).norm();
        from_tip_mm[i] = from_tip;
    }
    // The tangent at a node is the mean direction of its two chords.
    let tangents = (0..n)
        .map(|i| {
            let before = chord(i.max(1) - 1).normalize();
            let after = chord(i.min(n - 2)).normalize();
            (before + after).try_normalize(1e-12).unwrap_or(after)
        })
        .collect();
    (shape.from_tip_mm, shape.tangents) = (from_tip_mm, tangents);
    shape
}
