//! Hard insertions: whether where a device ends depends on how the hand's motion is cut into commands.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin hard -- turned [SCENE]       # 480 insertions of four scenes against steps of 0.25 mm
//! cargo run --release -p endowire-benches --bin hard -- sequences [SEEDS]    # random commands, each against its parts of 1 mm
//! ```
//!
//! Prints a line for each that ends elsewhere, and at the end what all of them took: iterations, time, flights, steps without an equilibrium.
//! Ends with 1 where one ends elsewhere in silence.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::random::{splitmix64, unit};
use endowire_core::scene::Scene;
use endowire_core::vessel::{GeneratedWall, NoStore, Resolution, anatomy};
use endowire_core::{Error, Result};

/// Scenes and how much of them is inserted, mm.
const SCENES: [(&str, f64); 4] =
    [("hepatic", 116.0), ("arch_innominate", 250.0), ("arch_carotid", 250.0), ("aortic_arch", 270.0)];
/// Steps that are held against small ones, mm.
const STEPS_MM: [f64; 5] = [1.0, 2.0, 4.67, 10.0, 25.0];
/// The small ones, mm.
const SMALL_MM: f64 = 0.25;
/// How far apart tips may be, mm: without friction and with it, which leaves a device anywhere within its cones.
const APART_MM: [f64; 2] = [0.05, 0.5];
/// More energy than this many times that of the parts, and …
const MORE: f64 = 1.5;
/// … this, mJ, beyond that, is another equilibrium.
const MORE_MJ: f64 = 1e-3;
/// Commands of a sequence.
const COMMANDS: usize = 60;

/// What a motion has come to.
#[derive(Default)]
struct Sum {
    commands: usize,
    iterations: u64,
    flights: u64,
    unconverged: usize,
    jumped: bool,
    failed: Option<String>,
    seconds: f64,
}

impl Sum {
    /// Moves by a command in equal parts.
    fn go(&mut self, simulation: &mut Simulation, whole: Command, parts: usize) {
        let begun = Instant::now();
        let part = 1.0 / parts as f64;
        let command = Command { advance_mm: whole.advance_mm * part, rotate_rad: whole.rotate_rad * part };
        for _ in 0..parts {
            match simulation.step(command) {
                Ok(report) => {
                    self.iterations += u64::from(report.iterations);
                    self.flights += u64::from(report.relaxations);
                    self.unconverged += usize::from(!report.converged);
                    self.jumped |= report.jumped;
                }
                Err(error) => {
                    self.failed = Some(error.to_string());
                    break;
                }
            }
        }
        self.commands += parts;
        self.seconds += begun.elapsed().as_secs_f64();
    }

    fn add(&mut self, other: &Self) {
        self.commands += other.commands;
        self.iterations += other.iterations;
        self.flights += other.flights;
        self.unconverged += other.unconverged;
        self.seconds += other.seconds;
    }

    fn print(&self, what: &str) {
        let Self { commands, iterations, flights, unconverged, seconds, .. } = self;
        println!(
            "{what}: {commands} commands, {iterations} iterations, {flights} flights, {unconverged} without an equilibrium, {seconds:.1} s"
        );
    }
}

/// Distance of two tips, mm.
fn apart_mm(a: &Simulation, b: &Simulation) -> f64 {
    let tips = a.shape().positions_mm.last().zip(b.shape().positions_mm.last());
    tips.map_or(0.0, |(a, b)| (a - b).norm())
}

/// The start of a scene of the assets with this coefficient of friction.
fn scene(name: &str, friction: f64) -> Result<Simulation> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../assets/scenes/{name}.toml"));
    let mut scene = Scene::read(&path)?;
    scene.vessel.wall.friction = friction;
    scene.simulation(&NoStore)
}

/// Pushes in all of `total_mm`, the hand turned first, by steps of `step_mm`.
fn insert(start: &Simulation, turn_rad: f64, total_mm: f64, step_mm: f64) -> (Simulation, Sum) {
    let (mut simulation, mut sum) = (start.clone(), Sum::default());
    sum.go(&mut simulation, Command { advance_mm: 0.0, rotate_rad: turn_rad }, 1);
    let whole = (total_mm / step_mm).floor();
    sum.go(&mut simulation, Command::advance(step_mm * whole), whole as usize);
    let rest_mm = total_mm - step_mm * whole;
    if rest_mm > 0.0 && sum.failed.is_none() {
        sum.go(&mut simulation, Command::advance(rest_mm), 1);
    }
    (simulation, sum)
}

/// Insertions that end elsewhere in silence.
fn turned(only: Option<&str>) -> Result<usize> {
    let mut silent = 0;
    let mut sums: [Sum; STEPS_MM.len() + 1] = Default::default();
    for (name, total_mm) in SCENES.iter().filter(|(name, _)| only.is_none_or(|only| only == *name)) {
        for (friction, most_mm) in [0.0, 0.1].into_iter().zip(APART_MM) {
            let start = scene(name, friction)?;
            for degrees in (0..360).step_by(30) {
                let turn_rad = f64::from(degrees).to_radians();
                let (small, by_small) = insert(&start, turn_rad, *total_mm, SMALL_MM);
                sums[0].add(&by_small);
                for (step_mm, all) in STEPS_MM.into_iter().zip(&mut sums[1..]) {
                    let (end, sum) = insert(&start, turn_rad, *total_mm, step_mm);
                    all.add(&sum);
                    let apart_mm = apart_mm(&small, &end);
                    if apart_mm <= most_mm && sum.failed.is_some() == by_small.failed.is_some() {
                        continue;
                    }
                    let told = sum.jumped && by_small.jumped;
                    silent += usize::from(!told);
                    let how = if told { "both tell a jump" } else { "in silence" };
                    let failed = sum.failed.or(by_small.failed.clone()).unwrap_or_default();
                    println!(
                        "{name}, μ {friction}, {degrees}°, {step_mm} mm: {apart_mm:.3} mm apart, {how} {failed}"
                    );
                }
            }
        }
    }
    for (step_mm, sum) in [SMALL_MM].into_iter().chain(STEPS_MM).zip(&sums) {
        sum.print(&format!("{step_mm} mm"));
    }
    Ok(silent)
}

/// Random numbers of a seed.
struct Random(u64, u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.1 += 1;
        low + (high - low) * unit(splitmix64(self.0, self.1))
    }

    fn one_of<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.between(0.0, list.len() as f64) as usize]
    }
}

/// A random wire in a random anatomy.
fn any(random: &mut Random) -> Result<(Simulation, f64)> {
    let name = random.one_of(&anatomy::NAMES);
    let tree = anatomy::tree(name).ok_or_else(|| Error::parameter("vessel", name, "is not built in"))?;
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(random.one_of(&[0.8, 1.2, 2.0])))?;
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0)?;
    let radius_mm = random.between(0.15, 0.45);
    let bending_nmm2 = 10f64.powf(random.between(0.0, 1.5));
    let hook = [random.one_of(&[0.0, 1.0, 1.0]) * random.between(0.0, 0.12), 0.0];
    let tip = Section::straight(random.between(8.0, 50.0), radius_mm, bending_nmm2);
    let tip = Section { rest_curvature_per_mm: hook, ..tip };
    let shaft = Section::straight(400.0, radius_mm, bending_nmm2 * random.between(1.0, 8.0));
    let friction = random.one_of(&[0.0, 0.0, 0.1, 0.3]);
    let modulus_n_per_mm2 = random.one_of(&[0.05, 1.0, 30.0, 1e3, 1e6]);
    let options =
        KirchhoffOptions { element_mm: random.one_of(&[1.0, 2.0, 4.0, 6.0]), ..KirchhoffOptions::default() };
    let simulation = Simulation::builder(made.wall, Device::new(vec![tip, shaft])?, sheath)
        .properties(WallProperties { modulus_n_per_mm2, friction, ..WallProperties::default() })
        .method(&options)
        .build()?;
    Ok((simulation, friction))
}

/// Commands that store more energy than their parts, or end elsewhere in silence.
fn sequences(seeds: u64) -> Result<usize> {
    let mut wrong = 0;
    let (mut ones, mut parts_of) = (Sum::default(), Sum::default());
    for seed in 0..seeds {
        let mut random = Random(seed, 0);
        let (mut simulation, friction) = any(&mut random)?;
        for k in 0..COMMANDS {
            let command = Command {
                advance_mm: random.one_of(&[0.0, 1.0, 1.0, 1.0, 1.0]) * random.between(-25.0, 40.0),
                rotate_rad: random.one_of(&[0.0, 1.0]) * random.between(-3.0, 3.0),
            };
            let parts = command.advance_mm.abs().max(10.0 * command.rotate_rad.abs()).max(1.0).ceil();
            let (mut one, mut many) = (simulation.clone(), simulation.clone());
            let (mut by_one, mut by_many) = (Sum::default(), Sum::default());
            by_one.go(&mut one, command, 1);
            by_many.go(&mut many, command, parts as usize);
            ones.add(&by_one);
            parts_of.add(&by_many);
            if by_one.failed.is_some() || by_many.failed.is_some() {
                continue;
            }
            let [energy, of_parts] = [&one, &many].map(|s| s.report().energy.total());
            let apart_mm = apart_mm(&one, &many);
            let elsewhere = apart_mm > APART_MM[usize::from(friction > 0.0)];
            let told = by_one.jumped && by_many.jumped;
            if energy > MORE * of_parts + MORE_MJ || energy.is_nan() || (elsewhere && !told) {
                wrong += 1;
                println!(
                    "seed {seed}, command {k}, {command:?}: {energy:.5} mJ, its parts {of_parts:.5}; tips {apart_mm:.3} mm apart"
                );
            }
            simulation = many;
        }
    }
    ones.print("single commands");
    parts_of.print("their parts");
    Ok(wrong)
}

fn main() -> Result<ExitCode> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mend = "say `turned [SCENE]` or `sequences [SEEDS]`";
    let wrong = match arguments.first().map(String::as_str) {
        Some("turned") => turned(arguments.get(1).map(String::as_str))?,
        Some("sequences") => {
            let seeds = arguments.get(1).map_or(Ok(300), |seeds| seeds.parse());
            sequences(seeds.map_err(|_| Error::parameter("SEEDS", &arguments[1], mend))?)?
        }
        other => return Err(Error::parameter("study", other.unwrap_or("none"), mend)),
    };
    println!("{wrong} end elsewhere in silence");
    Ok(ExitCode::from(u8::from(wrong > 0)))
}
