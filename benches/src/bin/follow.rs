//! How many named ends of vessels a hand reaches that follows the centre line found in their surfaces.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin follow                                   # the built-in anatomies
//! cargo run --release -p endowire-benches --bin follow -- SURFACE [SURFACE@UNIT_MM ...]  # your own
//! ```
//! A shaped wire goes from the inlet (of a surface [`Wall::inlet`]) to every other opening. Ends with 1 where fewer than nine of ten are reached.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::path::Path;
use std::process::ExitCode;

use endowire_core::control::{Controller, FollowPath, Outcome, Team, drive};
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{
    CentrelineEnd, ExtractedCentreline, GeneratedWall, Resolution, SurfaceFrame, SurfaceMesh, Wall, anatomy,
};
use endowire_core::{Error, Result};

/// Built-in anatomies, and the length of their triangles' edges, mm.
const BUILT_IN: [(&str, f64); 4] =
    [("aortic_arch", 3.0), ("aortic_arch_ii", 3.0), ("aortic_arch_iii", 3.0), ("hepatic", 1.1)];
/// Wires by the least radius of the vessel: from so much on, mm, radius, mm, stiffness of tip and shaft, N·mm², and elements, mm. A wide vessel
/// takes one of 0.035 inch.
const WIRES: [Wire; 2] = [
    Wire { from_mm: 3.5, radius_mm: 0.445, stiffness_nmm2: [0.5, 5.0], element_mm: 5.0 },
    Wire { from_mm: 0.0, radius_mm: 0.2, stiffness_nmm2: [0.3, 1.0], element_mm: 3.0 },
];
/// Angle of the tip, rad, and its length over the radius of the vessel where it comes in, within limits, mm: it reaches from the axis to the wall.
const TIP_RAD: f64 = 1.5;
const TIP_RADII: f64 = 2.0;
const TIP_MM: [f64; 2] = [12.0, 25.0];
/// Length of the wires, mm, depth of the sheath, mm, and friction of the wall.
const LENGTH_MM: f64 = 1500.0;
const DEPTH_MM: f64 = 2.0;
const FRICTION: f64 = 0.05;
/// The tip has arrived so far before the end, mm; steps that are made at most.
const ARRIVED_MM: f64 = 6.0;
const MOST_STEPS: usize = 1500;
/// Part of the ends that are to be reached.
const LEAST: f64 = 0.9;

struct Wire {
    from_mm: f64,
    radius_mm: f64,
    stiffness_nmm2: [f64; 2],
    element_mm: f64,
}

impl Wire {
    /// The wire for a vessel of this radius where it comes in.
    fn device(&self, inlet_mm: f64) -> Result<Device> {
        let [tip, shaft] = self.stiffness_nmm2;
        let tip_mm = (TIP_RADII * inlet_mm).clamp(TIP_MM[0], TIP_MM[1]);
        let tip = Section {
            rest_curvature_per_mm: [TIP_RAD / tip_mm, 0.0],
            ..Section::straight(tip_mm, self.radius_mm, tip)
        };
        Device::new(vec![tip, Section::straight(LENGTH_MM - tip_mm, self.radius_mm, shaft)])
    }
}

/// A surface file, `FILE` or `FILE@UNIT_MM`.
fn read(reported: &str) -> Result<Wall> {
    let (file, unit) = reported.rsplit_once('@').unwrap_or((reported, "1"));
    let unit_mm = unit.parse().map_err(|_| Error::parameter("UNIT_MM", unit, "must be a number"))?;
    Wall::from_surface(&SurfaceMesh::read(Path::new(file), SurfaceFrame { unit_mm, axes: None })?)
}

/// Goes to all ends of a wall; how many are reached, of how many.
fn follow(name: &str, wall: &Wall, inlet: usize) -> Result<[usize; 2]> {
    let tree = ExtractedCentreline::of(wall, Some(CentrelineEnd::Opening(inlet)), &[])?.tree;
    let least_mm = tree.nodes().iter().map(|node| node.radius_mm).fold(f64::INFINITY, f64::min);
    let wire = WIRES.iter().find(|wire| least_mm >= wire.from_mm).unwrap_or(&WIRES[1]);
    let sheath = Sheath::at_opening(wall, inlet, DEPTH_MM)?;
    let options = KirchhoffOptions { element_mm: wire.element_mm, ..KirchhoffOptions::default() };
    let start = Simulation::builder(wall.clone(), wire.device(tree.nodes()[0].radius_mm)?, sheath)
        .properties(WallProperties { friction: FRICTION, ..WallProperties::default() })
        .method(&options)
        .build()?;
    let mut reached = 0;
    for target in tree.targets() {
        let Some(way) = tree.path_to(target.row) else { continue };
        let (length_mm, narrow_mm) = (way.length_mm(), way.least_radius_mm());
        let (mut simulation, mut hand) = (start.clone(), FollowPath::new(way, Team::default(), ARRIVED_MM));
        let mut steps = 0;
        let outcome = drive::<Error>(&mut simulation, &mut hand, MOST_STEPS, |_, _| {
            steps += 1;
            Ok(())
        })?;
        reached += usize::from(matches!(outcome, Outcome::Arrived));
        let reported = match outcome {
            Outcome::Failed(error) => format!("failed: {error}"),
            other => format!("{other:?}").to_lowercase(),
        };
        println!(
            "{name:<24} {:<12} {length_mm:>8.0} mm {narrow_mm:>7.2} mm {steps:>6} {:>8}  {reported}",
            target.name,
            hand.retries()
        );
    }
    Ok([reached, tree.targets().len()])
}

fn main() -> Result<ExitCode> {
    let surfaces: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "{:<24} {:<12} {:>11} {:>10} {:>6} {:>8}",
        "vessel", "to", "way", "narrowest", "steps", "retries"
    );
    let mut sum = [0, 0];
    let mut count = |[reached, ends]: [usize; 2]| sum = [sum[0] + reached, sum[1] + ends];
    for surface in &surfaces {
        let wall = read(surface)?;
        let inlet = wall.inlet().map_or(0, |opening| opening.index);
        count(follow(surface.rsplit('/').next().unwrap_or(surface), &wall, inlet)?);
    }
    for (name, edge_mm) in BUILT_IN.iter().filter(|_| surfaces.is_empty()) {
        let Some(tree) = anatomy::tree(name) else { continue };
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(*edge_mm))?;
        count(follow(name, &made.wall, made.inlet)?);
    }
    println!("{} of {} ends are reached", sum[0], sum[1]);
    Ok(ExitCode::from(u8::from((sum[0] as f64) < LEAST * sum[1] as f64)))
}
