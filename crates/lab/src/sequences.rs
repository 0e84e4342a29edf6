//! Random commands of up to 40 mm in random vessels, each compared with the same motion in fractions of a millimetre:
//! run by `endowire verify --stress` in addition to the stress test of insertions.
//!
//! However much the hand does at once, the device must end where it would in small steps: no state may have much more
//! energy than that of the small steps, none may be beyond the wall by more than reported, none may differ in length
//! from what is inserted.

use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::random::{splitmix64, unit};
use endowire_core::vessel::{GeneratedWall, Resolution, Wall, anatomy};
use endowire_core::{Error, Result};
use serde::Serialize;

use crate::crossing::{CrossingTest, chords_mm, curve_in};

/// Number of sequences of the whole stress test.
pub const SEQUENCES: u64 = 300;
/// Number of commands per sequence.
const COMMANDS: usize = 60;
/// Vessels to choose from: those that there were when the seeds of the tests were chosen.
const VESSELS: usize = 8;
/// Ratio of the energy to that of the small steps above which the equilibrium is another one.
const MORE: f64 = 1.5;
/// Smallest excess of energy, mJ, for which that ratio counts.
const MORE_MJ: f64 = 1e-3;
/// Largest difference of a device's length from what is inserted, as a fraction.
const STRETCHED: f64 = 1e-3;
/// Largest distance of tips, mm: without friction, and with it, which lets a device rest anywhere within its cones.
pub const APART_MM: [f64; 2] = [0.05, 0.5];
/// Number of chords of an element whose lengths are summed: for one that turns by a radian they are 4·10⁻⁵ shorter.
const CHORDS: usize = 32;
/// Excess of the depth behind the triangles over the reported one, mm, above which a device has gone through them:
/// more than the error of the contact surface.
const CROSSED_MM: f64 = 0.3;

/// Result of a sequence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequenceRow {
    /// Its number.
    pub seed: u64,
    /// Vessel, wall and device.
    pub what: String,
    /// Commands carried out.
    pub commands: usize,
    /// Newton iterations of the commands.
    pub iterations: u64,
    /// Newton iterations of the small steps.
    pub iterations_of_parts: u64,
    /// Sub-steps with relaxation to where the device came to rest.
    pub flights: u64,
    /// Commands that ended without an equilibrium, and reported it.
    pub unconverged: usize,
    /// Accepted states of more than 1.5 times the energy of the small steps.
    pub stored_more: usize,
    /// States with numbers that are not finite.
    pub not_finite: usize,
    /// States of a length other than the inserted one.
    pub stretched: usize,
    /// States beyond the wall by more than reported.
    pub crossed: usize,
    /// Commands that failed though their small steps did not, or vice versa.
    pub failed: usize,
    /// Commands that end elsewhere than their small steps without a jump in both. Where friction holds a device
    /// loosely, this is only informative.
    pub apart: usize,
    /// The first error.
    pub first: String,
    /// Whether there was no error.
    pub pass: bool,
}

impl SequenceRow {
    /// Column heads of a row.
    pub const HEAD: &str = "seed  cmds  iter.  parts' fly  unb  energy nan length crossed failed apart  what, and what was first";
}

impl std::fmt::Display for SequenceRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { seed, commands, iterations, iterations_of_parts, flights, unconverged, .. } = self;
        let Self { stored_more, not_finite, stretched, crossed, failed, apart, what, first, .. } = self;
        write!(
            f,
            "{seed:>4} {commands:>5} {iterations:>6} {iterations_of_parts:>7} {flights:>3} {unconverged:>4} {stored_more:>7} {not_finite:>3} \
             {stretched:>6} {crossed:>7} {failed:>6} {apart:>5}  {what} {first}"
        )
    }
}

/// Random numbers of a seed, and how many have been drawn.
pub(crate) struct Random(pub(crate) u64, pub(crate) u64);

impl Random {
    /// A number between two.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.1 += 1;
        low + (high - low) * unit(splitmix64(self.0, self.1))
    }

    /// A random element of a list.
    pub(crate) fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.between(0.0, list.len() as f64) as usize]
    }
}

/// A random wire, sometimes in a catheter, in a random anatomy.
struct Scene {
    start: Simulation,
    wall: Wall,
    hands: usize,
    friction: f64,
    what: String,
}

impl Scene {
    fn new(random: &mut Random) -> Result<Self> {
        let name = random.one_of(&anatomy::NAMES[..VESSELS]);
        let tree = anatomy::tree(name).ok_or_else(|| Error::parameter("vessel", name, "is not built in"))?;
        let edge_mm = random.one_of(&[0.8, 1.2, 2.0]);
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm))?;
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
        let radius_mm = random.between(0.15, 0.45);
        let bending_nmm2 = 10f64.powf(random.between(0.0, 1.5));
        let hook = [random.one_of(&[0.0, 1.0, 1.0]) * random.between(0.0, 0.12), 0.0];
        let tip = Section::straight(random.between(8.0, 50.0), radius_mm, bending_nmm2);
        let tip = Section { rest_curvature_per_mm: hook, ..tip };
        let shaft = Section::straight(400.0, radius_mm, bending_nmm2 * random.between(1.0, 8.0));
        let wire = Device::new(vec![tip, shaft])?;
        let several = random.between(0.0, 1.0) < 0.3;
        let stack = if several { within_catheter(wire, radius_mm, random)? } else { Stack::from(wire) };
        let friction = random.one_of(&[0.0, 0.0, 0.1, 0.3]);
        let modulus_n_per_mm2 = random.one_of(&[0.05, 1.0, 30.0, 1e3, 1e6]);
        let element_mm = random.one_of(&[1.0, 2.0, 4.0, 6.0]);
        let options = KirchhoffOptions { element_mm, ..KirchhoffOptions::default() };
        let hands = stack.instruments().len();
        let start = Simulation::builder(made.wall.clone(), stack, sheath)
            .properties(WallProperties { modulus_n_per_mm2, friction, ..WallProperties::default() })
            .method(&options)
            .build()?;
        let what = format!(
            "{name}, edges {edge_mm}, wall {modulus_n_per_mm2}, μ {friction}, wire {radius_mm:.2} mm of {bending_nmm2:.1} N·mm², elements \
             {element_mm}{}",
            if several { ", in a catheter" } else { "" }
        );
        Ok(Self { start, wall: made.wall, hands, friction, what })
    }
}

/// The wire in a catheter that fits it.
fn within_catheter(wire: Device, radius_mm: f64, random: &mut Random) -> Result<Stack> {
    let bending_nmm2 = 10f64.powf(random.between(0.0, 1.5));
    let bend = random.one_of(&[0.0, 1.0]) * random.between(0.0, 0.06);
    let straight = |length_mm: f64, bending_nmm2: f64| Section {
        inner_radius_mm: Some(1.15 * radius_mm),
        ..Section::straight(length_mm, 1.6 * radius_mm, bending_nmm2)
    };
    let tip = straight(random.between(8.0, 30.0), bending_nmm2);
    let tip = Section { rest_curvature_per_mm: [bend, 0.0], ..tip };
    let catheter = Device::new(vec![tip, straight(350.0, 2.0 * bending_nmm2)])?;
    let instrument =
        |name: &str, device: Device| Instrument { name: name.to_owned(), device, may_lead: true };
    Stack::new(vec![instrument("wire", wire), instrument("catheter", catheter)])
}

/// The result of a motion.
#[derive(Default)]
struct Done {
    iterations: u64,
    flights: u64,
    jumped: bool,
    unconverged: bool,
    failed: Option<Error>,
}

/// One of this many equal parts of moves.
pub fn part_of(moves: &[Move], parts: usize) -> Vec<Move> {
    let share = |Command { advance_mm, rotate_rad, steer }| Command {
        advance_mm: advance_mm / parts as f64,
        rotate_rad: rotate_rad / parts as f64,
        steer: steer / parts as f64,
    };
    moves.iter().map(|one| Move { command: share(one.command), ..*one }).collect()
}

/// Moves in equal parts.
fn go(simulation: &mut Simulation, moves: &[Move], parts: usize) -> Done {
    let mut done = Done::default();
    let part = part_of(moves, parts);
    for _ in 0..parts {
        match simulation.step_together(&part) {
            Ok(report) => {
                done.iterations += u64::from(report.iterations);
                done.flights += u64::from(report.relaxations);
                done.jumped |= report.jumped;
                done.unconverged |= !report.converged;
            }
            Err(error) => {
                done.failed = Some(error);
                break;
            }
        }
    }
    done
}

/// Runs a sequence.
///
/// # Errors
/// None that depends on the seed.
pub fn run(seed: u64) -> Result<SequenceRow> {
    let mut random = Random(seed, 0);
    let scene = Scene::new(&mut random)?;
    let crossing = CrossingTest::new(scene.wall.mesh());
    let mut row = SequenceRow {
        seed,
        what: scene.what.clone(),
        commands: 0,
        iterations: 0,
        iterations_of_parts: 0,
        flights: 0,
        unconverged: 0,
        stored_more: 0,
        not_finite: 0,
        stretched: 0,
        crossed: 0,
        failed: 0,
        apart: 0,
        first: String::new(),
        pass: true,
    };
    let mut simulation = scene.start.clone();
    for number in 0..COMMANDS {
        let moves: Vec<Move> = (0..scene.hands)
            .map(|instrument| {
                let advance_mm = random.one_of(&[0.0, 1.0, 1.0, 1.0, 1.0]) * random.between(-25.0, 40.0);
                let rotate_rad = random.one_of(&[0.0, 1.0]) * random.between(-3.0, 3.0);
                Move { instrument, command: Command { advance_mm, rotate_rad, ..Command::default() } }
            })
            .collect();
        let millimetres =
            moves.iter().map(|one| one.command.advance_mm.abs().max(10.0 * one.command.rotate_rad.abs()));
        let parts = millimetres.fold(1.0, f64::max).ceil() as usize;
        let (mut one, mut many) = (simulation.clone(), simulation.clone());
        let (by_one, by_many) = (go(&mut one, &moves, 1), go(&mut many, &moves, parts));
        row.iterations += by_one.iterations;
        row.iterations_of_parts += by_many.iterations;
        row.flights += by_one.flights;
        row.unconverged += usize::from(by_one.unconverged);
        let mut wrong = |count: &mut usize, what: String| {
            *count += 1;
            if row.first.is_empty() {
                row.first = format!("command {number}: {what}");
            }
        };
        match (&by_one.failed, &by_many.failed) {
            (None, None) => {}
            // Something that ends the command in the vessel may not be reached by the small steps.
            (Some(error), _) | (None, Some(error)) => {
                let explained = |error: &Error| matches!(error, Error::End(_)) || error.is_input();
                if !explained(error) {
                    wrong(&mut row.failed, error.to_string());
                }
                continue;
            }
        }
        row.commands += 1;
        let [energy_mj, of_parts_mj] = [&one, &many].map(|s| s.report().energy.total());
        let (inserted_mm, length_mm) = (one.report().inserted_mm, chords_mm(&curve_in(one.shape(), CHORDS)));
        let accepted = !by_one.unconverged;
        if accepted && energy_mj > MORE * of_parts_mj + MORE_MJ {
            wrong(&mut row.stored_more, format!("{energy_mj:.4} mJ, and its parts {of_parts_mj:.4}"));
        }
        if !energy_mj.is_finite() || !length_mm.is_finite() {
            wrong(&mut row.not_finite, "a number that is not finite".to_owned());
        }
        if accepted && (length_mm - inserted_mm).abs() > STRETCHED * inserted_mm {
            wrong(&mut row.stretched, format!("{length_mm:.3} mm of {inserted_mm:.3} inserted"));
        }
        if let Some(missing_mm) = crossing.missing_mm(&scene.wall, &one).filter(|mm| *mm > CROSSED_MM) {
            wrong(&mut row.crossed, format!("{missing_mm:.3} mm deeper in the wall than told"));
        }
        let tips = one.shape().tip_mm().zip(many.shape().tip_mm());
        let apart_mm = tips.map_or(0.0, |(a, b)| (a - b).norm());
        let reported = by_one.jumped && by_many.jumped;
        row.apart += usize::from(apart_mm > APART_MM[usize::from(scene.friction > 0.0)] && !reported);
        simulation = many;
    }
    row.pass = row.stored_more + row.not_finite + row.stretched + row.crossed + row.failed == 0;
    Ok(row)
}
