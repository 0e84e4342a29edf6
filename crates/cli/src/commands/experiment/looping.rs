//! `endowire experiment loop`: the paper's experiment 3, figure 4.
//!
//! A wire with a soft tip is pushed on in a tube after its tip was stopped, so that the soft part turns back and a loop grows. The
//! tube is closed by a half sphere, in which the tip is stopped; the paper does not say what stopped its catheter.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::PathBuf;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_viewer::ViewSpec;
use plotters::coord::Shift;
use plotters::prelude::*;
use serde::Serialize;

use super::camera::Camera;
use crate::args::LoopArgs;
use crate::commands::compare::candidate;
use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{answer, chart, progress};

/// The tube: inner radius and length of its straight part, edge of its triangles; mm.
const TUBE_RADIUS_MM: f64 = 15.0;
const TUBE_MM: f64 = 140.0;
const EDGE_MM: f64 = 2.0;
/// Where the sheath is beside the axis, mm: nothing is ever in the middle.
const OFFSET_MM: f64 = 3.0;
/// Increment, mm, and pushed in all.
const STEP_MM: f64 = 1.0;
const INSERTED_MM: f64 = 260.0;
/// Advances after the tip was stopped at which pictures are taken, mm: four, as in the paper's figure 4.
const PICTURES_MM: [f64; 4] = [15.0, 40.0, 65.0, 90.0];
const ELEMENT_MM: f64 = 3.0;

#[derive(Debug, Serialize)]
struct Row {
    inserted_mm: f64,
    /// Advance since the tip was stopped.
    advance_mm: f64,
    /// How far the tip is behind the farthest point of the wire, along the tube.
    loop_depth_mm: f64,
    /// Extent of the wire across the tube in the part beyond the tip.
    loop_width_mm: f64,
    /// Angle between the tip and the direction of insertion.
    turned_deg: f64,
    push_force_n: f64,
    max_penetration_mm: f64,
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

/// Pushes, measures and draws.
pub(super) fn looping(args: &LoopArgs) -> Result<(), Failure> {
    let wall = Wall::from_surface(&closed_tube())?;
    let sheath = Sheath::new(Vec3::new(OFFSET_MM, 0.0, 2.0), Vec3::z())?;
    let device = Device::new(vec![
        Section::straight(70.0, 0.445, 3.0),
        Section::straight(30.0, 0.445, 15.0),
        Section::straight(INSERTED_MM, 0.445, 60.0),
    ])?;
    let mut simulation =
        candidate::insertion("kirchhoff", ELEMENT_MM, wall, WallProperties::default(), device, sheath)?;
    let mut camera = match &args.out {
        Some(folder) => {
            let spec = ViewSpec { size_px: [480, 720], ..ViewSpec::default() };
            Some(Camera::new(folder, "loop", spec, simulation.wall())?)
        }
        None => None,
    };
    let steps = (INSERTED_MM / STEP_MM) as usize;
    let bar = progress::bar(steps, "step");
    let (mut rows, mut failure) = (Vec::new(), None);
    let mut stopped_at: Option<f64> = None;
    for _ in 0..steps {
        if let Err(error) = simulation.step(Command::advance(STEP_MM)) {
            failure = Some(error.to_string());
            break;
        }
        let row = measure(&simulation, &mut stopped_at);
        let due =
            |camera: &&mut Camera| PICTURES_MM.get(camera.taken()).is_some_and(|mm| row.advance_mm >= *mm);
        if let Some(camera) = camera.as_mut().filter(due) {
            camera.take(&simulation)?;
        }
        rows.push(row);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut frames = camera.map_or_else(Vec::new, |camera| camera.frames);
    if let Some(folder) = &args.out {
        frames.extend(chart::write(folder, "loop", (900, 560), &Growth(&rows))?);
    }
    let provenance = Provenance::of_program("experiment loop");
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

fn measure(simulation: &Simulation, stopped_at: &mut Option<f64>) -> Row {
    let (shape, report) = (simulation.shape(), simulation.report());
    let x = &shape.positions_mm;
    let tip = x[x.len() - 1];
    let farthest = x.iter().map(|x| x.z).fold(0.0, f64::max);
    // The tip is stopped at its first contact in the end of the tube.
    if stopped_at.is_none() && tip.z > TUBE_MM && !report.contacts.is_empty() {
        *stopped_at = Some(report.inserted_mm);
    }
    let beyond: Vec<&Vec3> = x.iter().filter(|x| x.z >= tip.z).collect();
    let across = |a: &Vec3| beyond.iter().map(|b| (a - *b).xy().norm()).fold(0.0, f64::max);
    Row {
        inserted_mm: report.inserted_mm,
        advance_mm: stopped_at.map_or(0.0, |at| report.inserted_mm - at),
        loop_depth_mm: farthest - tip.z,
        loop_width_mm: beyond.iter().map(|a| across(a)).fold(0.0, f64::max),
        turned_deg: shape.tangents[shape.len() - 1].z.clamp(-1.0, 1.0).acos().to_degrees(),
        push_force_n: report.push_force_n,
        max_penetration_mm: report.max_penetration_mm,
    }
}

/// A tube about the z axis from the origin, its far end a half sphere.
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
            // Every other ring is turned by half an edge.
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
struct Growth<'a>(&'a [Row]);

impl chart::Chart for Growth<'_> {
    fn draw<B: DrawingBackend>(&self, root: &DrawingArea<B, Shift>) -> chart::Drawn<B> {
        let rows = self.0;
        let far = rows.last().map_or(1.0, |row| row.advance_mm).max(1.0);
        let high = rows.iter().map(|r| r.loop_depth_mm.max(r.loop_width_mm)).fold(1.0, f64::max);
        let mut plot = ChartBuilder::on(root)
            .caption("growth of the loop after the tip was stopped", chart::font(22))
            .margin(14)
            .x_label_area_size(48)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..far, 0.0..1.15 * high)?;
        plot.configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(225, 225, 225))
            .x_desc("advance, mm")
            .y_desc("mm")
            .label_style(chart::font(15))
            .axis_desc_style(chart::font(17))
            .draw()?;
        type Value = fn(&Row) -> f64;
        let depth: Value = |row| row.loop_depth_mm;
        let width: Value = |row| row.loop_width_mm;
        let series = [("depth", depth, chart::COLOURS[0]), ("width", width, chart::COLOURS[3])];
        for (name, value, colour) in series {
            let line = rows.iter().filter(|r| r.advance_mm > 0.0).map(|r| (r.advance_mm, value(r)));
            plot.draw_series(LineSeries::new(line, colour.stroke_width(3)))?;
            if let Some(last) = rows.last() {
                let at = (0.92 * far, value(last) + 0.08 * high);
                plot.draw_series([Text::new(name, at, chart::font(18).color(&colour))])?;
            }
        }
        Ok(())
    }
}

fn table(document: &Document) -> String {
    let mut lines = vec![format!(
        "{:>11} {:>11} {:>9} {:>9} {:>11} {:>9} {:>15}",
        "inserted mm", "advance mm", "depth mm", "width mm", "turned deg", "push N", "penetration mm"
    )];
    for row in document.rows.iter().filter(|row| row.advance_mm > 0.0 && row.inserted_mm % 10.0 < 1e-6) {
        lines.push(format!(
            "{:>11.1} {:>11.1} {:>9.2} {:>9.2} {:>11.1} {:>9.4} {:>15.4}",
            row.inserted_mm,
            row.advance_mm,
            row.loop_depth_mm,
            row.loop_width_mm,
            row.turned_deg,
            row.push_force_n,
            row.max_penetration_mm
        ));
    }
    lines.join("\n")
}
