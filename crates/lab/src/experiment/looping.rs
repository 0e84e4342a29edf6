//! `endowire experiment loop`: the paper's experiment 3, figure 4.
//!
//! A wire with a soft tip is pushed on in a tube after its tip was stopped, so that the soft part turns back and a
//! loop grows. The tube is closed by a half sphere, which stops the tip; the paper does not say what stopped its
//! catheter.

use std::f64::consts::{FRAC_PI_2, TAU};

use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::vessel::{SurfaceMesh, Wall};
use endowire_core::{Result, Vec3};
use serde::Serialize;

use crate::compare::candidate;

/// Inner radius and length of the tube's straight part, edge length of its triangles; mm.
const TUBE_RADIUS_MM: f64 = 15.0;
const TUBE_MM: f64 = 140.0;
const EDGE_MM: f64 = 2.0;
/// Offset of the sheath from the axis, mm: real devices are never exactly centred.
const OFFSET_MM: f64 = 3.0;
/// Increment and total inserted length, mm.
const STEP_MM: f64 = 1.0;
const INSERTED_MM: f64 = 260.0;
const ELEMENT_MM: f64 = 3.0;

/// What a step has reached.
#[derive(Debug, Serialize)]
pub struct Row {
    /// The method.
    pub method: String,
    /// Inserted length, mm.
    pub inserted_mm: f64,
    /// Advance since the tip was stopped, mm.
    pub advance_mm: f64,
    /// Distance of the tip behind the farthest point of the wire, along the tube, mm.
    pub loop_depth_mm: f64,
    /// Extent across the tube of the part of the wire beyond the tip, mm.
    pub loop_width_mm: f64,
    /// Angle between the tip and the direction of insertion, degrees.
    pub turned_deg: f64,
    /// Force of the hand, N.
    pub push_force_n: f64,
    /// Largest penetration into the wall, mm.
    pub max_penetration_mm: f64,
    /// Whether it is an equilibrium.
    pub converged: bool,
}

/// Number of steps of the whole insertion.
pub const STEPS: usize = (INSERTED_MM / STEP_MM) as usize;

/// The tube.
///
/// # Errors
/// None: its surface is closed.
pub fn wall() -> Result<Wall> {
    Wall::from_surface(&closed_tube())
}

/// The wire at the begin of the tube, by one method.
///
/// # Errors
/// A method that is not known.
pub fn begin(method: &str, wall: &Wall) -> Result<Simulation> {
    let sheath = Sheath::new(Vec3::new(OFFSET_MM, 0.0, 2.0), Vec3::z())?;
    let device = Device::new(vec![
        Section::straight(70.0, 0.445, 3.0),
        Section::straight(30.0, 0.445, 15.0),
        Section::straight(INSERTED_MM, 0.445, 60.0),
    ])?;
    candidate::insertion(method, ELEMENT_MM, wall.clone(), WallProperties::default(), device, sheath)
}

/// Pushes the wire; `seen` gets what each step has reached. The inner error is that of a step.
///
/// # Errors
/// Those of `seen`.
pub fn push<E>(
    method: &str,
    simulation: &mut Simulation,
    mut seen: impl FnMut(&Simulation, Row) -> std::result::Result<(), E>,
) -> std::result::Result<Result<()>, E> {
    let mut stopped_at = None;
    for _ in 0..STEPS {
        if let Err(error) = simulation.step(Command::advance(STEP_MM)) {
            return Ok(Err(error));
        }
        seen(simulation, measure(method, simulation, &mut stopped_at))?;
    }
    Ok(Ok(()))
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
