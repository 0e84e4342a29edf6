//! Insertions of four scenes, the hand first turned: whether where a device ends depends on the size of steps.

use std::path::Path;
use std::time::Instant;

use endowire_core::Result;
use endowire_core::insertion::{Command, Simulation};
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;

/// Scenes and how much of them is inserted, mm.
const SCENES: [(&str, f64); 4] =
    [("hepatic", 116.0), ("arch_innominate", 250.0), ("arch_carotid", 250.0), ("aortic_arch", 270.0)];
/// Steps that are held against small ones, mm.
const STEPS_MM: [f64; 5] = [1.0, 2.0, 4.67, 10.0, 25.0];
/// The small ones, mm.
const SMALL_MM: f64 = 0.25;
/// How far apart tips may be, mm: without friction and with it, which leaves a device anywhere within its cones.
const APART_MM: [f64; 2] = [0.05, 0.5];
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
pub(crate) fn turned(only: Option<&str>) -> Result<usize> {
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
