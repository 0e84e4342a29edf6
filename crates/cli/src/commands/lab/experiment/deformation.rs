//! `endowire experiment deformation`: what [`endowire_lab::experiment::deformation`] measures, drawn and written.

use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::shape::Shape;
use endowire_lab::experiment::deformation::{
    Cell, Refinement, Row, TABLE_2, TRUTH_MM, Total, Tube, polyline,
};
use endowire_viewer::ViewSpec;
use serde::{Deserialize, Serialize};

use super::camera::Camera;
use super::lines::{Line, Lines, PAPER};
use crate::args::DeformationArgs;
use crate::failure::Failure;
use crate::output::provenance::{Provenance, read_input};
use crate::output::{answer, progress};

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

/// Runs all cells and prints them beside the paper's.
pub(super) fn deformation(args: &DeformationArgs) -> Result<(), Failure> {
    let cells = cells(args)?;
    let tube = Tube::new()?;
    let bar = progress::bar(cells.len() * args.methods.len() + TRUTH_MM.len(), "cell");

    let mut inputs = vec![
        format!("experiment deformation {:?} {:?} {:?}", args.methods, args.l_mm, args.l_over_h).into_bytes(),
    ];
    let (truth, convergence, ground_truth) = if let Some(path) = &args.measured {
        inputs.push(read_input(path)?);
        bar.inc(TRUTH_MM.len() as u64);
        (measured(path)?, Vec::new(), format!("measured points of {}", path.display()))
    } else {
        let (truth, convergence) = tube.truth(|l_mm| {
            bar.set_message(format!("truth, {l_mm} mm"));
            bar.inc(1);
        })?;
        let finest = TRUTH_MM[TRUTH_MM.len() - 1];
        let text = format!("computed: kirchhoff with elements of {finest} mm, not a real catheter");
        (truth, convergence, text)
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
    Ok(polyline(x))
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
