//! Insertions that tell what a part of the solver brings: iterations, questions to the hierarchy, and the time of a step.
//!
//! Prints a line a scene: name, commands that ended in an equilibrium, Newton iterations, last resorts, questions, and the
//! median and the whole time of the commands, ms.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::time::Instant;

use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_core::{Error, Result};

/// What is inserted where.
struct Insertion {
    name: &'static str,
    tree: &'static str,
    inserted_mm: f64,
    increment_mm: f64,
    turn_rad: f64,
    modulus_n_per_mm2: f64,
    friction: f64,
    shaped: bool,
}

const INSERTIONS: [Insertion; 7] = [
    insertion("arch", "aortic_arch", 300.0, 1.0, 1.0, 0.0),
    insertion("arch, friction", "aortic_arch", 300.0, 1.0, 1.0, 0.1),
    Insertion {
        shaped: true,
        turn_rad: 0.1,
        ..insertion("arch, shaped tip that turns", "aortic_arch", 300.0, 1.0, 1.0, 0.1)
    },
    Insertion {
        shaped: true,
        turn_rad: 0.1,
        ..insertion(
            "rigid arch III, friction, shaped tip that turns",
            "aortic_arch_iii",
            250.0,
            1.0,
            1e4,
            0.1,
        )
    },
    Insertion {
        shaped: true,
        turn_rad: 0.05,
        ..insertion("hepatic, friction, shaped tip that turns", "hepatic", 250.0, 1.0, 100.0, 0.1)
    },
    insertion("rigid tube", "curved_tube", 150.0, 0.5, 1e4, 0.0),
    insertion("rigid tube, friction", "curved_tube", 150.0, 0.5, 1e4, 0.3),
];

const fn insertion(
    name: &'static str,
    tree: &'static str,
    inserted_mm: f64,
    increment_mm: f64,
    modulus_n_per_mm2: f64,
    friction: f64,
) -> Insertion {
    Insertion {
        name,
        tree,
        inserted_mm,
        increment_mm,
        turn_rad: 0.0,
        modulus_n_per_mm2,
        friction,
        shaped: false,
    }
}

/// A 0.035-inch wire, its tip bent where it is `shaped`.
fn wire(shaped: bool) -> Result<Device> {
    let curvature = if shaped { 0.06 } else { 0.0 };
    let tip = Section { rest_curvature_per_mm: [curvature, 0.0], ..Section::straight(15.0, 0.445, 3.0) };
    Device::new(vec![tip, Section::straight(400.0, 0.445, 20.0)])
}

fn run(of: &Insertion) -> Result<()> {
    let tree =
        anatomy::tree(of.tree).ok_or_else(|| Error::parameter("vessel", of.tree, "is not built in"))?;
    let made = GeneratedWall::new(&tree, Resolution::Triangles(20_000))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
    let method = KirchhoffOptions { element_mm: 2.0, ..KirchhoffOptions::default() };
    let properties = WallProperties {
        modulus_n_per_mm2: of.modulus_n_per_mm2,
        friction: of.friction,
        ..WallProperties::default()
    };
    let mut simulation = Simulation::builder(made.wall, wire(of.shaped)?, sheath)
        .properties(properties)
        .method(&method)
        .build()?;
    let command = Command { advance_mm: of.increment_mm, rotate_rad: of.turn_rad, ..Command::default() };
    let (mut times, mut good, mut iterations, mut resorts) = (Vec::new(), 0, 0, 0);
    for _ in 0..(of.inserted_mm / of.increment_mm) as usize {
        let begun = Instant::now();
        let Ok(report) = simulation.step(command) else { break };
        times.push(1e3 * begun.elapsed().as_secs_f64());
        good += u32::from(report.converged);
        iterations += report.iterations;
        resorts += report.relaxations;
    }
    let whole: f64 = times.iter().sum();
    times.sort_by(f64::total_cmp);
    let median = times.get(times.len() / 2).copied().unwrap_or(0.0);
    let queries = simulation.counters().queries;
    println!("{}\t{good}\t{iterations}\t{resorts}\t{queries}\t{median:.4}\t{whole:.1}", of.name);
    Ok(())
}

fn main() -> Result<()> {
    INSERTIONS.iter().try_for_each(run)
}
