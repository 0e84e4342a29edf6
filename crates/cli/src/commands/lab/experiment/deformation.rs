//! `endowire experiment deformation`: the paper's experiment 4, Table 2.
//!
//! A wire is pushed into the curved tube of figure 5 by increments h on segments l, and its shape is compared with a
//! reference. The paper's reference is a real catheter in a plastic tube, whose points are not published. Here it is
//! our own solution, shown to be converged, or measured points of the user.

use std::path::{Path, PathBuf};
use std::time::Instant;

use endowire_core::Vec3;
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::shape::Shape;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_viewer::ViewSpec;
use serde::{Deserialize, Serialize};

use super::camera::Camera;
use super::lines::{Line, Lines, PAPER};
use crate::args::DeformationArgs;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, progress};
use endowire_lab::compare::candidate;
use endowire_lab::compare::case::rms_distance;

/// A cell of the paper's Table 2: segment length l in mm, l/h, RMS mm, maximum mm, run time s.
type Cell = (f64, u32, f64, f64, f64);
/// The whole table.
const TABLE_2: [Cell; 15] = [
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
const TRUTH_MM: [f64; 3] = [1.0, 0.5, 0.25];
const TRUTH_STEP_MM: f64 = 1.0;
/// A 0.035″ wire.
const RADIUS_MM: f64 = 0.445;
const STIFFNESS_NMM2: f64 = 10.0;
/// Edge length of the tube's triangles, mm.
const EDGE_MM: f64 = 0.8;

#[derive(Debug, Serialize)]
struct Row {
    method: String,
    l_mm: f64,
    /// l/h.
    l_over_h: u32,
    rms_mm: f64,
    max_mm: f64,
    time_s: f64,
    paper_rms_mm: f64,
    paper_max_mm: f64,
    paper_time_s: f64,
    /// The paper's time divided by ours.
    speedup: f64,
    /// Linear solves, or iterations as the method counts them, of all steps.
    iterations: u64,
    steps: usize,
    /// Number of steps that failed the method's own convergence test.
    unconverged: usize,
    /// Length of the polygon of nodes divided by the inserted length, minus 1.
    length_off: f64,
}

/// Change of the reference from one mesh to the next.
#[derive(Debug, Serialize)]
struct Refinement {
    from_mm: f64,
    to_mm: f64,
    rms_change_mm: f64,
    max_change_mm: f64,
}

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    ground_truth: String,
    convergence: Vec<Refinement>,
    rows: Vec<Row>,
    totals: Vec<Total>,
    frames: Vec<PathBuf>,
}

/// Totals of a method over all requested cells.
#[derive(Debug, Serialize)]
struct Total {
    method: String,
    time_s: f64,
    paper_time_s: f64,
    /// The paper's time divided by ours.
    speedup: f64,
}

/// Vessel, sheath and wire of all cells.
struct Tube {
    made: GeneratedWall,
    sheath: Sheath,
    wire: Device,
}

/// Result of an insertion.
struct Inserted {
    simulation: Simulation,
    time_s: f64,
    iterations: u64,
    steps: usize,
    unconverged: usize,
}

impl Tube {
    /// Carries out the whole insertion.
    fn insert(&self, method: &str, l_mm: f64, h_mm: f64) -> Result<Inserted, Failure> {
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
    fn new(method: &str, cell: Cell, inserted: &Inserted, truth: &Shape) -> Self {
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

/// Runs all cells and prints them beside the paper's.
pub(super) fn deformation(args: &DeformationArgs) -> Result<(), Failure> {
    let cells = cells(args)?;
    let tree = anatomy::tree("curved_tube").ok_or_else(|| Failure::Input("no curved_tube".to_owned()))?;
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(EDGE_MM))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0)?;
    let tube = Tube { made, sheath, wire: Device::uniform(INSERTED_MM + 1.0, RADIUS_MM, STIFFNESS_NMM2)? };
    let bar = progress::bar(cells.len() * args.methods.len() + TRUTH_MM.len(), "cell");

    let mut inputs = vec![
        format!("experiment deformation {:?} {:?} {:?}", args.methods, args.l_mm, args.l_over_h).into_bytes(),
    ];
    let mut convergence = Vec::new();
    let (truth, ground_truth) = if let Some(path) = &args.measured {
        inputs.push(read_input(path)?);
        bar.inc(TRUTH_MM.len() as u64);
        (measured(path)?, format!("measured points of {}", path.display()))
    } else {
        let mut shapes: Vec<Shape> = Vec::new();
        for l_mm in TRUTH_MM {
            bar.set_message(format!("truth, {l_mm} mm"));
            shapes.push(tube.insert("kirchhoff", l_mm, TRUTH_STEP_MM)?.simulation.shape().clone());
            bar.inc(1);
        }
        for (k, pair) in shapes.windows(2).enumerate() {
            let (rms_change_mm, max_change_mm) = rms_distance(&pair[0], &pair[1]);
            let (from_mm, to_mm) = (TRUTH_MM[k], TRUTH_MM[k + 1]);
            convergence.push(Refinement { from_mm, to_mm, rms_change_mm, max_change_mm });
        }
        let finest = TRUTH_MM[TRUTH_MM.len() - 1];
        let text = format!("computed: kirchhoff with elements of {finest} mm, not a real catheter");
        (shapes.swap_remove(TRUTH_MM.len() - 1), text)
    };

    let (mut rows, mut frames, mut totals) = (Vec::new(), Vec::new(), Vec::new());
    for method in &args.methods {
        let begin = rows.len();
        for &cell in &cells {
            let (l_mm, l_over_h, ..) = cell;
            bar.set_message(format!("{method}, l = {l_mm} mm, h = l/{l_over_h}"));
            let inserted = tube.insert(method, l_mm, l_mm / f64::from(l_over_h))?;
            rows.push(Row::new(method, cell, &inserted, &truth));
            bar.inc(1);
            // The last cell of the table is drawn.
            if let Some(folder) = args.out.as_ref().filter(|_| rows.len() == begin + cells.len()) {
                let spec = ViewSpec { size_px: [640, 640], ..ViewSpec::default() };
                let mut camera =
                    Camera::new(folder, &format!("deformation_{method}"), spec, &tube.made.wall)?;
                camera.take(&inserted.simulation)?;
                frames.extend(camera.frames);
            }
        }
        totals.push(Total::new(method, &rows[begin..]));
    }
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        frames.extend(picture(&rows).write(folder, "deformation")?);
    }
    let document =
        Document { provenance: Provenance::new(&inputs, 0), ground_truth, convergence, rows, totals, frames };
    if let Some(folder) = &args.out {
        super::write(folder, "deformation", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(&document))
}

impl Total {
    fn new(method: &str, rows: &[Row]) -> Self {
        let time_s = rows.iter().map(|row| row.time_s).sum();
        let paper_time_s: f64 = rows.iter().map(|row| row.paper_time_s).sum();
        Self { method: method.to_owned(), time_s, paper_time_s, speedup: paper_time_s / time_s }
    }
}

/// Error against increment, one line for each method and segment length.
fn picture(rows: &[Row]) -> Lines {
    let mut lines: Vec<Line> = Vec::new();
    let mut add = |method: &str, l_mm: f64, point: (f64, f64)| {
        let of = format!("l = {l_mm} mm");
        match lines.iter_mut().find(|line| line.method == method && line.of == of) {
            Some(line) => line.points.push(point),
            None => lines.push(Line { method: method.to_owned(), of, points: vec![point] }),
        }
    };
    for (l_mm, l_over_h, rms_mm, ..) in TABLE_2 {
        add(PAPER, l_mm, (l_mm / f64::from(l_over_h), rms_mm));
    }
    for row in rows {
        add(&row.method, row.l_mm, (row.l_mm / f64::from(row.l_over_h), row.rms_mm));
    }
    Lines {
        title: "experiment 4: distance from the truth",
        across: "increment h, mm",
        up: "RMS, mm",
        logarithmic: true,
        lines,
    }
}

/// The requested cells of Table 2.
fn cells(args: &DeformationArgs) -> Result<Vec<Cell>, Failure> {
    if let Some(l) = args.l_mm.iter().find(|l| TABLE_2.iter().all(|cell| cell.0 != **l)) {
        return Err(Failure::Input(format!("--l-mm {l}: the paper has 1, 2 and 3")));
    }
    if let Some(parts) = args.l_over_h.iter().find(|parts| TABLE_2.iter().all(|cell| cell.1 != **parts)) {
        return Err(Failure::Input(format!("--l-over-h {parts}: the paper has 40, 20, 10, 5 and 3")));
    }
    let wanted = |cell: &Cell| {
        (args.l_mm.is_empty() || args.l_mm.contains(&cell.0))
            && (args.l_over_h.is_empty() || args.l_over_h.contains(&cell.1))
    };
    Ok(TABLE_2.into_iter().filter(wanted).collect())
}

/// One measured point, mm, in the tube's coordinates.
#[derive(Debug, Deserialize)]
struct Point {
    x_mm: f64,
    y_mm: f64,
    z_mm: f64,
}

/// Measured points from the sheath to the tip, as a polyline that begins at the mouth of the sheath.
fn measured(path: &Path) -> Result<Shape, Failure> {
    let unusable = |reason: String| Failure::Input(format!("{}: {reason}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(|e| unusable(e.to_string()))?;
    let mut x: Vec<Vec3> = Vec::new();
    for (index, point) in reader.deserialize().enumerate() {
        let point: Point = point.map_err(|e| unusable(e.to_string()))?;
        let p = Vec3::new(point.x_mm, point.y_mm, point.z_mm);
        if !p.iter().all(|c| c.is_finite()) || x.last().is_some_and(|last| *last == p) {
            return Err(unusable(format!(
                "point {}: must be finite and differ from the one before",
                index + 1
            )));
        }
        x.push(p);
    }
    if x.len() < 2 {
        return Err(unusable(
            "give at least two points x_mm,y_mm,z_mm, from the sheath to the tip".to_owned(),
        ));
    }
    let mut shape = Shape { positions_mm: x, ..Shape::default() };
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
    Ok(shape)
}

fn table(document: &Document) -> String {
    let mut lines = vec![format!("ground truth: {}", document.ground_truth)];
    for r in &document.convergence {
        lines.push(format!(
            "  its elements from {} to {} mm change it by {:.1e} mm RMS, {:.1e} mm at most",
            r.from_mm, r.to_mm, r.rms_change_mm, r.max_change_mm
        ));
    }
    lines.push(format!(
        "{:<22} {:>5} {:>5} {:>10} {:>10} {:>9} {:>10} {:>11} {:>9}   {:>9} {:>9} {:>9} {:>9}",
        "method",
        "l mm",
        "h/l",
        "RMS mm",
        "max mm",
        "time s",
        "iterations",
        "unconverged",
        "length %",
        "paper RMS",
        "paper max",
        "paper s",
        "faster"
    ));
    for row in &document.rows {
        lines.push(format!(
            "{:<22} {:>5} {:>5} {:>10.5} {:>10.5} {:>9.3} {:>10} {:>11} {:>9.3}   {:>9.2} {:>9.2} {:>9.1} {:>8.0}×",
            row.method,
            row.l_mm,
            format!("1/{}", row.l_over_h),
            row.rms_mm,
            row.max_mm,
            row.time_s,
            row.iterations,
            format!("{}/{}", row.unconverged, row.steps),
            1e2 * row.length_off,
            row.paper_rms_mm,
            row.paper_max_mm,
            row.paper_time_s,
            row.speedup
        ));
    }
    for total in &document.totals {
        lines.push(format!(
            "{}: {:.2} s, the paper's {:.1} s: {:.0}× faster",
            total.method, total.time_s, total.paper_time_s, total.speedup
        ));
    }
    lines.join("\n")
}
