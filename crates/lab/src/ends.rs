//! D6: a wire is pushed on in a catheter, and its end slides along the line with its nodes.

use super::Row;
use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation};
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, anatomy};
use endowire_core::{Error, Result, Vec3};

pub(super) const WIRE: usize = 0;
pub(super) const CATHETER: usize = 1;
/// Advance per step, mm, and number of steps: the wire passes through twenty elements of 2 mm.
const STEP_MM: f64 = 0.1;
const STEPS: usize = 400;
/// Number of steps between comparisons of forces with differences of the energy: marks change at whole millimetres,
/// which an odd number of steps avoids.
const COMPARED: usize = 8;
/// Step of these differences, mm.
const DIFFERENCE_MM: f64 = 0.01;
/// Shortest part of the motion over which the unexplained energy is examined, mm.
const LEAST_MM: f64 = 1e-4;
/// A jump of the energy, relative to its total.
const JUMP: f64 = 1e-6;

/// A wire with a hook of this length and curvature in a bent catheter.
fn instruments((hook_mm, hook_per_mm): (f64, f64)) -> Result<Stack> {
    let one = |name: &str, section: Section, length_mm: f64, curvature: f64| -> Result<Instrument> {
        let tip = Section { length_mm, rest_curvature_per_mm: [curvature, 0.0], ..section };
        let device = Device::new(vec![tip, section])?;
        Ok(Instrument { name: name.to_owned(), device, may_lead: true })
    };
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(250.0, 0.8, 60.0) };
    Stack::new(vec![
        one("wire", Section::straight(330.0, 0.2, 20.0), hook_mm, hook_per_mm)?,
        one("catheter", catheter, 30.0, 0.02)?,
    ])
}

pub(super) fn push(simulation: &mut Simulation, moves: &[(usize, f64)]) -> Result<()> {
    let each =
        moves.iter().map(|(instrument, mm)| Move { instrument: *instrument, command: Command::advance(*mm) });
    let report = simulation.step_together(&each.collect::<Vec<_>>())?;
    if report.converged {
        Ok(())
    } else {
        Err(Error::Computation("several instruments: no equilibrium".to_owned()))
    }
}

fn energy(simulation: &Simulation) -> f64 {
    simulation.report().energy.total()
}

pub(super) fn force(simulation: &Simulation, instrument: usize) -> f64 {
    simulation.report().instruments[instrument].push_force_n.unwrap_or(f64::NAN)
}

/// Largest change of the energy along the wire's motion that its force does not explain, mJ. If that exceeds `bar_mj`
/// the motion is subdivided: smooth parts decrease quadratically, a jump remains.
fn unaccounted(simulation: &mut Simulation, way_mm: f64, bar_mj: f64) -> Result<f64> {
    let start = simulation.clone();
    let (before, pushed) = (energy(simulation), force(simulation, WIRE));
    push(simulation, &[(WIRE, way_mm)])?;
    let work = 0.5 * way_mm * (pushed + force(simulation, WIRE));
    let off = (energy(simulation) - before - work).abs();
    if off <= bar_mj || way_mm < LEAST_MM {
        return Ok(off);
    }
    *simulation = start;
    let first = unaccounted(simulation, 0.5 * way_mm, bar_mj)?;
    Ok(first.max(unaccounted(simulation, 0.5 * way_mm, bar_mj)?))
}

/// Slope of the energy in an instrument's insertion, by finite differences, N.
fn slope(simulation: &Simulation, instrument: usize) -> Result<f64> {
    let at = |k: i32| {
        let mut moved = simulation.clone();
        push(&mut moved, &[(instrument, DIFFERENCE_MM * f64::from(k))])?;
        Ok(energy(&moved))
    };
    let near = at(1)? - at(-1)?;
    let far: f64 = at(2)? - at(-2)?;
    Ok((8.0 * near - far) / (12.0 * DIFFERENCE_MM))
}

/// A motion of the wire that avoids the place where its hook leaves the catheter and the force jumps.
struct Way {
    place: &'static str,
    wall: GeneratedWall,
    depth_mm: f64,
    /// Length and curvature of the wire's hook, mm and 1/mm.
    hook: (f64, f64),
    /// Inserted length of the catheter, and by how much the wire's exceeds it, mm.
    inserted_mm: f64,
    ahead_mm: f64,
}

/// Pushes both in, and then the wire on.
fn pushed_on(way: Way) -> Result<Vec<Row>> {
    let sheath = Sheath::at_opening(&way.wall.wall, way.wall.inlet, way.depth_mm)?;
    let mut simulation = Simulation::builder(way.wall.wall, instruments(way.hook)?, sheath).build()?;
    push(&mut simulation, &[(WIRE, way.ahead_mm)])?;
    for _ in 0..(way.inserted_mm / 4.0) as usize {
        push(&mut simulation, &[(WIRE, 4.0), (CATHETER, 4.0)])?;
    }
    let (mut jump, mut worst) = (0.0f64, [(0.0, 0.0, -1.0); 2]);
    for k in 0..STEPS {
        let total = energy(&simulation);
        jump = jump.max(unaccounted(&mut simulation, STEP_MM, JUMP * total)? / total);
        for instrument in [WIRE, CATHETER].into_iter().filter(|_| k % COMPARED == 0) {
            let (reported, found) = (force(&simulation, instrument), slope(&simulation, instrument)?);
            let error = ((reported - found) / found).abs();
            if error > worst[instrument].2 || error.is_nan() {
                worst[instrument] = (reported, found, error);
            }
        }
    }
    let name = format!("D6 {}, 400 steps of 0.1 mm", way.place);
    let quantity = "change of the energy that no force accounts for";
    let mut rows = vec![Row::with_error(&name, quantity, jump, 0.0, jump, JUMP)];
    for (instrument, (reported, found, error)) in ["wire", "catheter"].into_iter().zip(worst) {
        let quantity = format!("push force of the {instrument}");
        rows.push(Row::with_error(&name, &quantity, reported, found, error, 1e-3));
    }
    Ok(rows)
}

/// A tube so wide that nothing touches it.
pub(super) fn free_space() -> Result<GeneratedWall> {
    let node = |i: usize| CentrelineNode {
        position_mm: Vec3::z() * (20.0 * i as f64),
        radius_mm: 120.0,
        parent: i.checked_sub(1),
    };
    let tree = CentrelineTree::new((0..16).map(node).collect())?;
    GeneratedWall::new(&tree, Resolution::EdgeMm(48.0))
}

/// In free space and in the arch.
pub(super) fn pass() -> Result<Vec<Row>> {
    let mut rows = pushed_on(Way {
        place: "in free space",
        wall: free_space()?,
        depth_mm: 1.0,
        hook: (80.0, 0.02),
        inserted_mm: 80.0,
        ahead_mm: 1.0,
    })?;
    let name = "aortic_arch";
    let arch = anatomy::tree(name).ok_or_else(|| Error::parameter("anatomy", name, "is not built in"))?;
    rows.extend(pushed_on(Way {
        place: "in the arch",
        wall: GeneratedWall::new(&arch, anatomy::asset_resolution(name))?,
        depth_mm: 2.0,
        hook: (15.0, 0.06),
        inserted_mm: 176.0,
        ahead_mm: 20.0,
    })?);
    Ok(rows)
}
