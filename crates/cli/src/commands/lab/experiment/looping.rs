//! `endowire experiment loop`: the paper's experiment 3, figure 4.
//!
//! A wire with a soft tip is pushed on in a tube after its tip was stopped, so that the soft part turns back and a
//! loop grows. The tube is closed by a half sphere, which stops the tip; the paper does not say what stopped its
//! catheter.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{NoStore, SurfaceMesh, Wall};
use endowire_viewer::ViewSpec;
use indicatif::ProgressBar;
use serde::Serialize;

use super::camera::Camera;
use super::lines::{Line, Lines};
use crate::args::LoopArgs;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, progress};
use endowire_lab::compare::candidate;

/// Inner radius and length of the tube's straight part, edge length of its triangles; mm.
const TUBE_RADIUS_MM: f64 = 15.0;
const TUBE_MM: f64 = 140.0;
const EDGE_MM: f64 = 2.0;
/// Offset of the sheath from the axis, mm: real devices are never exactly centred.
const OFFSET_MM: f64 = 3.0;
/// Increment and total inserted length, mm.
const STEP_MM: f64 = 1.0;
const INSERTED_MM: f64 = 260.0;
/// Advances after the stop of the tip at which pictures are taken, mm: four, as in the paper's figure 4.
const PICTURES_MM: [f64; 4] = [15.0, 40.0, 65.0, 90.0];
const ELEMENT_MM: f64 = 3.0;

#[derive(Debug, Serialize)]
struct Row {
    method: String,
    inserted_mm: f64,
    /// Advance since the tip was stopped.
    advance_mm: f64,
    /// Distance of the tip behind the farthest point of the wire, along the tube.
    loop_depth_mm: f64,
    /// Extent across the tube of the part of the wire beyond the tip.
    loop_width_mm: f64,
    /// Angle between the tip and the direction of insertion.
    turned_deg: f64,
    push_force_n: f64,
    max_penetration_mm: f64,
    converged: bool,
}

#[derive(Debug, Serialize)]
struct Document {
    #[serde(flatten)]
    provenance: Provenance,
    rows: Vec<Row>,
    frames: Vec<PathBuf>,
    /// Why the insertion ended early, if it did.
    failure: Option<String>,
}

/// Pushes, measures and draws, method by method.
pub(super) fn looping(args: &LoopArgs) -> Result<(), Failure> {
    let wall = Wall::from_surface(&closed_tube())?;
    let bar = progress::bar(args.methods.len() * STEPS, "step");
    let (mut rows, mut frames, mut failure) = (Vec::new(), Vec::new(), None);
    for method in &args.methods {
        bar.set_message(method.clone());
        if let Err(error) = push(method, &wall, args.out.as_deref(), (&mut rows, &mut frames), &bar)? {
            failure = failure.or(Some(format!("{method}: {error}")));
        }
    }
    bar.finish_and_clear();
    if let Some(folder) = &args.out {
        frames.extend(growth(&rows).write(folder, "loop")?);
    }
    let provenance = Provenance::of_program(&format!("experiment loop {:?}", args.methods));
    let document = Document { provenance, rows, frames, failure };
    if let Some(folder) = &args.out {
        super::write(folder, "loop", &document.rows, &document)?;
    }
    answer(&document, args.json, || table(&document))?;
    match document.failure {
        Some(reason) => Err(Failure::Computation(reason)),
        None => Ok(()),
    }
}

/// Number of steps of the whole insertion.
const STEPS: usize = (INSERTED_MM / STEP_MM) as usize;

/// Pushes the wire by one method. The inner error is that of a step; results of earlier steps are kept.
fn push(
    method: &str,
    wall: &Wall,
    out: Option<&Path>,
    (rows, frames): (&mut Vec<Row>, &mut Vec<PathBuf>),
    bar: &ProgressBar,
) -> Result<endowire_core::Result<()>, Failure> {
    let sheath = Sheath::new(Vec3::new(OFFSET_MM, 0.0, 2.0), Vec3::z())?;
    let device = Device::new(vec![
        Section::straight(70.0, 0.445, 3.0),
        Section::straight(30.0, 0.445, 15.0),
        Section::straight(INSERTED_MM, 0.445, 60.0),
    ])?;
    let properties = WallProperties::default();
    let mut simulation = candidate::insertion(method, ELEMENT_MM, wall.clone(), properties, device, sheath)?;
    let mut camera = match out {
        Some(folder) => {
            let spec = ViewSpec { size_px: [480, 720], ..ViewSpec::default() };
            Some(Camera::new(folder, &format!("loop_{method}"), spec, simulation.lumen().wall(&NoStore)?)?)
        }
        None => None,
    };
    let (mut stopped_at, mut failed) = (None, Ok(()));
    for _ in 0..STEPS {
        if let Err(error) = simulation.step(Command::advance(STEP_MM)) {
            failed = Err(error);
            break;
        }
        let row = measure(method, &simulation, &mut stopped_at);
        let due =
            |camera: &&mut Camera| PICTURES_MM.get(camera.taken()).is_some_and(|mm| row.advance_mm >= *mm);
        if let Some(camera) = camera.as_mut().filter(due) {
            camera.take(&simulation)?;
        }
        rows.push(row);
        bar.inc(1);
    }
    frames.extend(camera.into_iter().flat_map(|camera| camera.frames));
    Ok(failed)
}

fn measure(method: &str, simulation: &Simulation, stopped_at: &mut Option<f64>) -> Row {
    let (shape, report) = (simulation.shape(), simulation.report());
    let x = &shape.positions_mm;
    let tip = x[x.len() - 1];
    let farthest = x.iter().map(|x| x.z).fold(0.0, f64::max);
    // The tip counts as stopped at its first contact in the end of the tube.
    if stopped_at.is_none() && tip.z > TUBE_MM && !report.contacts.is_empty() {
        *stopped_at = Some(report.inserted_mm);
    }
    let beyond: Vec<&Vec3> = x.iter().filter(|x| x.z >= tip.z).collect();
    let across = |a: &Vec3| beyond.iter().map(|b| (a - *b).xy().norm()).fold(0.0, f64::max);
    Row {
        method: method.to_owned(),
        inserted_mm: report.inserted_mm,
        advance_mm: stopped_at.map_or(0.0, |at| report.inserted_mm - at),
        loop_depth_mm: farthest - tip.z,
        loop_width_mm: beyond.iter().map(|a| across(a)).fold(0.0, f64::max),
        turned_deg: shape.tangents[shape.len() - 1].z.clamp(-1.0, 1.0).acos().to_degrees(),
        push_force_n: report.push_force_n,
        max_penetration_mm: report.max_penetration_mm,
        converged: report.converged,
    }
}

/// A tube along the z axis from the origin, closed at its far end by a half sphere.
fn closed_tube() -> SurfaceMesh {
    let around = (TAU * TUBE_RADIUS_MM / EDGE_MM).round() as u32;
    let mut rings: Vec<(f64, f64)> = Vec::new();
    let along = (TUBE_MM / EDGE_MM).round() as usize;
    rings.extend((0..along).map(|k| (TUBE_RADIUS_MM, TUBE_MM * k as f64 / along as f64)));
    let over = (FRAC_PI_2 * TUBE_RADIUS_MM / EDGE_MM).round() as usize;
    rings.extend((0..over).map(|k| {
        let angle = FRAC_PI_2 * k as f64 / over as f64;
        (TUBE_RADIUS_MM * angle.cos(), TUBE_MM + TUBE_RADIUS_MM * angle.sin())
    }));
    let mut mesh = SurfaceMesh::default();
    for (k, (radius, z)) in rings.iter().enumerate() {
        for j in 0..around {
            // Every other ring is rotated by half an edge.
            let angle = TAU * (f64::from(j) + 0.5 * (k % 2) as f64) / f64::from(around);
            mesh.vertices_mm.push(Vec3::new(radius * angle.cos(), radius * angle.sin(), *z));
        }
    }
    for k in 0..rings.len() as u32 - 1 {
        for j in 0..around {
            let (a, b) = (k * around + j, k * around + (j + 1) % around);
            let (c, d) = (a + around, b + around);
            if k % 2 == 0 {
                mesh.triangles.extend([[a, b, c], [b, d, c]]);
            } else {
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    let pole = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.push(Vec3::new(0.0, 0.0, TUBE_MM + TUBE_RADIUS_MM));
    let last = pole - around;
    mesh.triangles.extend((0..around).map(|j| [last + j, last + (j + 1) % around, pole]));
    mesh
}

/// Loop size against advance.
fn growth(rows: &[Row]) -> Lines {
    type Value = fn(&Row) -> f64;
    let values: [(&str, Value); 2] = [("depth", |row| row.loop_depth_mm), ("width", |row| row.loop_width_mm)];
    let mut methods: Vec<&str> = rows.iter().map(|row| row.method.as_str()).collect();
    methods.dedup();
    let line = |method: &str, (name, value): &(&str, Value)| {
        let own = rows.iter().filter(|row| row.method == method && row.advance_mm > 0.0);
        let points = own.map(|row| (row.advance_mm, value(row))).collect();
        Line { method: method.to_owned(), of: (*name).to_owned(), points }
    };
    Lines {
        title: "experiment 3: growth of the loop after the tip was stopped",
        across: "advance, mm",
        up: "mm",
        logarithmic: false,
        lines: methods.iter().flat_map(|method| values.iter().map(|value| line(method, value))).collect(),
    }
}

fn table(document: &Document) -> String {
    let mut lines = vec![format!(
        "{:<22} {:>11} {:>11} {:>9} {:>9} {:>11} {:>9} {:>15}",
        "method",
        "inserted mm",
        "advance mm",
        "depth mm",
        "width mm",
        "turned deg",
        "push N",
        "penetration mm"
    )];
    for row in document.rows.iter().filter(|row| row.advance_mm > 0.0 && row.inserted_mm % 10.0 < 1e-6) {
        lines.push(format!(
            "{:<22} {:>11.1} {:>11.1} {:>9.2} {:>9.2} {:>11.1} {:>9.4} {:>15.4}",
            row.method,
            row.inserted_mm,
            row.advance_mm,
            row.loop_depth_mm,
            row.loop_width_mm,
            row.turned_deg,
            row.push_force_n,
            row.max_penetration_mm
        ));
    }
    let mut methods: Vec<&str> = document.rows.iter().map(|row| row.method.as_str()).collect();
    methods.dedup();
    for method in methods {
        let own = document.rows.iter().filter(|row| row.method == method);
        let unconverged = own.clone().filter(|row| !row.converged).count();
        lines.push(format!("{method}: {unconverged} of {} steps unconverged", own.count()));
    }
    lines.join("\n")
}
