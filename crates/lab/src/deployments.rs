//! Random deployments of coils: two coils are pushed, pulled and rotated out of a catheter that moves too, and
//! detached. Run by `endowire verify --stress` in addition to random commands.
//!
//! The check is independent of the simulation: it uses only the reported centre lines. No two pieces outside the
//! catheter may be nearer to each other than their surfaces allow, whether of one coil, of two, or of an inserted
//! device; none may be behind the wall, and none may change its length.

use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::shape::Shape;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Wall};
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;

use crate::crossing::{CrossingTest, chords_mm, curve_in};
use crate::sequences::Random;

/// Number of deployments of the whole stress test.
pub const DEPLOYMENTS: u64 = 300;
/// Number of commands per deployment.
const COMMANDS: usize = 80;
/// Instruments of the stack: two coils, and the catheter.
const CATHETER: usize = 2;
/// Number of chords per element: its curve is met within a thousandth of a radius.
const CHORDS: usize = 12;
/// Distance of axes, relative to the touching distance, below which the penetration is too deep.
const DEEP: f64 = 0.97;
/// Distance below which they have crossed.
const CROSSED: f64 = 0.5;
/// Largest relative change of a coil's length.
const STRETCHED: f64 = 2e-3;

/// Result of a deployment.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct DeploymentRow {
    /// Its number.
    pub seed: u64,
    /// Sac, coils and friction.
    pub what: String,
    /// Commands carried out.
    pub commands: usize,
    /// Newton iterations of them.
    pub iterations: u64,
    /// Commands with a jump.
    pub jumps: usize,
    /// Commands that ended without an equilibrium, and reported it.
    pub unconverged: usize,
    /// Commands that were rejected, with a reason, without side effects.
    pub refused: usize,
    /// Coils detached.
    pub detached: usize,
    /// Smallest distance of two axes, relative to that at which their surfaces touch.
    pub least_distance: f64,
    /// States with too deep penetration.
    pub deep: usize,
    /// States in which axes have crossed.
    pub crossed: usize,
    /// States in which one is behind the wall.
    pub behind: usize,
    /// States in which the length of one has changed.
    pub stretched: usize,
    /// The first error.
    pub first: String,
    /// Whether there was no error.
    pub pass: bool,
}

impl DeploymentRow {
    /// Column heads of a row.
    pub const HEAD: &str =
        "seed  cmds  iter. jumps  unb refused out least deep crossed behind length  what, and what was first";
}

impl std::fmt::Display for DeploymentRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { seed, commands, iterations, jumps, unconverged, refused, detached, .. } = self;
        let Self { least_distance, deep, crossed, behind, stretched, what, first, .. } = self;
        write!(
            f,
            "{seed:>4} {commands:>5} {iterations:>6} {jumps:>5} {unconverged:>4} {refused:>7} {detached:>3} {least_distance:>5.3} {deep:>4} {crossed:>7} \
             {behind:>6} {stretched:>6}  {what} {first}"
        )
    }
}

/// A catheter whose tip is in a sac, and two coils in it.
struct Scene {
    simulation: Simulation,
    wall: Wall,
    radius_mm: f64,
    what: String,
}

impl Scene {
    fn new(random: &mut Random) -> Result<Self> {
        let sac_mm = random.between(1.5, 4.0);
        let node = |i: usize| CentrelineNode {
            position_mm: Vec3::z() * (3.0 * sac_mm * i as f64),
            radius_mm: sac_mm,
            parent: i.checked_sub(1),
        };
        let tree = CentrelineTree::new((0..4).map(node).collect())?;
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(0.3 * sac_mm))?;
        let radius_mm = random.between(0.12, 0.2);
        let stiffness_nmm2 = 10f64.powf(random.between(-2.7, -1.7));
        let coil = |random: &mut Random| -> Result<Device> {
            let length_mm = random.between(8.0, 25.0);
            let curl = 1.0 / random.between(0.5 * sac_mm, 1.2 * sac_mm);
            let wound = Section {
                rest_curvature_per_mm: [curl, random.between(0.0, 0.3) * curl],
                torsional_stiffness_nmm2: Some(0.8 * stiffness_nmm2),
                ..Section::straight(length_mm, radius_mm, stiffness_nmm2)
            };
            Device::new(vec![wound, Section::straight(100.0, radius_mm, 0.3)])?.with_coil(length_mm)
        };
        let coils = [coil(random)?, coil(random)?];
        let catheter = Section {
            inner_radius_mm: Some(radius_mm + 0.03),
            ..Section::straight(60.0, radius_mm + 0.12, random.between(0.3, 2.0))
        };
        let one = |name: &str, device: Device| Instrument { name: name.to_owned(), device, may_lead: true };
        let [first, second] = coils;
        let stack = Stack::new(vec![
            one("first", first),
            one("second", second),
            one("catheter", Device::new(vec![catheter])?),
        ])?;
        let friction = random.one_of(&[0.0, 0.1, 0.3]);
        let modulus_n_per_mm2 = random.one_of(&[1.0, 100.0]);
        let self_friction = random.one_of(&[0.0, 0.2, 0.4]);
        let element_mm = random.one_of(&[0.5, 0.75]);
        let options =
            KirchhoffOptions { element_mm, self_contact: true, self_friction, ..KirchhoffOptions::default() };
        let position_mm = Vec3::new(-0.6 * sac_mm, 0.0, 4.5 * sac_mm);
        let direction = Vec3::new(1.0, random.between(-0.4, 0.4), random.between(-0.4, 0.4));
        let sheath = Sheath::new(position_mm, direction)?;
        let properties = WallProperties { modulus_n_per_mm2, friction, ..WallProperties::default() };
        let mut simulation = Simulation::builder(made.wall.clone(), stack, sheath)
            .properties(properties)
            .method(&options)
            .build()?;
        // In the catheter a coil touches nothing.
        simulation.step_together(&[advance(CATHETER, 0.3 * sac_mm), advance(0, 0.3 * sac_mm)])?;
        let what = format!(
            "sac {sac_mm:.1} mm, coils {radius_mm:.2} mm of {stiffness_nmm2:.4} N·mm², wall {modulus_n_per_mm2}, μ {friction} and {self_friction}, \
             elements {element_mm}"
        );
        Ok(Self { simulation, wall: made.wall, radius_mm, what })
    }
}

fn advance(instrument: usize, mm: f64) -> Move {
    Move { instrument, command: Command::advance(mm) }
}

/// The part of a coil, or of the inserted devices, that is out: points of its axis in order, and the corresponding
/// length of device, mm.
fn axes(simulation: &Simulation) -> Vec<(Vec<Vec3>, f64)> {
    let of = |shape: &Shape| {
        let length_mm = shape.from_tip_mm.first().copied().unwrap_or(0.0);
        (curve_in(shape, CHORDS), length_mm)
    };
    let mut all = vec![of(simulation.shape())];
    all.extend(simulation.coils().iter().map(|coil| of(&coil.shape)));
    all
}

/// Smallest distance of two points of axes, except those of one axis less than a turn of the radius apart along it,
/// mm, and the indices of the axes.
fn nearest(axes: &[(Vec<Vec3>, f64)], radius_mm: f64) -> (f64, [usize; 2]) {
    let apart_mm = std::f64::consts::TAU * radius_mm;
    let mut least = (f64::INFINITY, [0; 2]);
    for (k, (one, _)) in axes.iter().enumerate() {
        let mut arc_mm = vec![0.0; one.len()];
        for i in 1..one.len() {
            arc_mm[i] = arc_mm[i - 1] + (one[i] - one[i - 1]).norm();
        }
        for (i, a) in one.iter().enumerate() {
            let own = one.iter().zip(&arc_mm).skip(i + 1).filter(|(_, mm)| *mm - arc_mm[i] > apart_mm);
            let others = axes.iter().enumerate().skip(k + 1);
            let others = others.flat_map(|(l, (other, _))| other.iter().map(move |b| (b, l)));
            for (b, l) in own.map(|(b, _)| (b, k)).chain(others) {
                let square = (a - b).norm_squared();
                if square < least.0 {
                    least = (square, [k, l]);
                }
            }
        }
    }
    (least.0.sqrt(), least.1)
}

/// A random command: mostly pushes the next coil.
fn command(random: &mut Random, coil: usize) -> Move {
    let advance_mm = random.one_of(&[0.3, 0.5, 1.0, 1.0, 2.0, 3.0]);
    match random.between(0.0, 1.0) {
        kind if kind < 0.1 => advance(coil, -2.0 * advance_mm),
        kind if kind < 0.2 => {
            let command =
                Command { advance_mm: 0.0, rotate_rad: random.between(-1.0, 1.0), ..Command::default() };
            Move { instrument: coil, command }
        }
        kind if kind < 0.25 => advance(CATHETER, random.between(-0.3, 0.3)),
        _ => advance(coil, advance_mm),
    }
}

/// Runs a deployment.
///
/// # Errors
/// None that depends on the seed.
pub fn run(seed: u64) -> Result<DeploymentRow> {
    let mut random = Random(seed, 1 << 32);
    let Scene { mut simulation, wall, radius_mm, what } = Scene::new(&mut random)?;
    let crossing = CrossingTest::new(wall.mesh());
    let mut row = DeploymentRow { seed, what, least_distance: f64::INFINITY, ..DeploymentRow::default() };
    for number in 0..COMMANDS {
        let coil = row.detached.min(1);
        let inserted_mm = simulation.report().lengths_mm();
        let out_mm = inserted_mm[coil] - inserted_mm[CATHETER];
        let coil_mm = simulation.stack().instruments()[coil].device.coil_mm();
        let done = if row.detached < 2 && out_mm > coil_mm + 3.0 * radius_mm {
            simulation.detach(coil).cloned()
        } else if row.detached < 2 {
            simulation.step_together(&[command(&mut random, coil)]).cloned()
        } else {
            let mm = random.between(-1.0, 1.0);
            simulation.step_together(&[advance(CATHETER, mm)]).cloned()
        };
        let report = match done {
            Ok(report) => report,
            Err(error) => {
                row.refused += 1;
                let explained = matches!(error, Error::End(_)) || error.is_input();
                if !explained && row.first.is_empty() {
                    row.first = format!("command {number}: {error}");
                }
                continue;
            }
        };
        row.commands += 1;
        row.detached = simulation.coils().len();
        row.iterations += u64::from(report.iterations);
        row.jumps += usize::from(report.jumped);
        row.unconverged += usize::from(!report.converged);
        let axes = axes(&simulation);
        let (distance_mm, [one, other]) = nearest(&axes, radius_mm);
        let distance = distance_mm / (2.0 * radius_mm);
        row.least_distance = row.least_distance.min(distance);
        let mut wrong = |count: &mut usize, is_wrong: bool, what: String| {
            *count += usize::from(is_wrong);
            if is_wrong && row.first.is_empty() {
                row.first = format!("command {number}: {what}");
            }
        };
        let near = format!("axes {one} and {other} are {distance:.3} distances of touch apart");
        wrong(&mut row.deep, distance < DEEP, near.clone());
        wrong(&mut row.crossed, distance < CROSSED, near);
        let behind = axes.iter().skip(1).any(|(axis, _)| crossing.crosses(axis))
            || crossing.is_crossed_by(&simulation);
        wrong(&mut row.behind, behind, "an axis passes through the wall".to_owned());
        for (axis, reported_mm) in &axes {
            let length_mm = chords_mm(axis);
            let stretched = report.converged && (length_mm - reported_mm).abs() > STRETCHED * reported_mm;
            wrong(&mut row.stretched, stretched, format!("{length_mm:.3} mm of {reported_mm:.3}"));
        }
    }
    row.pass = row.deep + row.crossed + row.behind + row.stretched == 0;
    Ok(row)
}
