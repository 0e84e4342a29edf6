//! Insertions of four scenes, the hand first turned: whether where a device ends depends on the size of steps.

use std::path::Path;

use endowire_core::Result;
use endowire_core::insertion::{Command, Move, Simulation};
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;

use super::course::Course;
use crate::sequences::APART_MM;

/// Scenes and how much of them is inserted, mm.
const SCENES: [(&str, f64); 4] =
    [("hepatic", 116.0), ("arch_innominate", 250.0), ("arch_carotid", 250.0), ("aortic_arch", 270.0)];
/// Steps that are held against small ones, mm.
const STEPS_MM: [f64; 5] = [1.0, 2.0, 4.67, 10.0, 25.0];
/// The small ones, mm.
const SMALL_MM: f64 = 0.25;

/// What all insertions by one step took.
#[derive(Default)]
struct Sum {
    commands: usize,
    iterations: u64,
    flights: u64,
    unconverged: usize,
    seconds: f64,
}

impl Sum {
    fn add(&mut self, course: &Course) {
        self.commands += course.commands;
        self.iterations += course.iterations;
        self.flights += course.flights;
        self.unconverged += course.unconverged;
        self.seconds += course.seconds;
    }

    fn print(&self, what: &str, say: &mut dyn FnMut(String)) {
        let Self { commands, iterations, flights, unconverged, seconds } = self;
        say(format!(
            "{what}: {commands} commands, {iterations} iterations, {flights} flights, {unconverged} without an equilibrium, {seconds:.1} s"
        ));
    }
}

/// The start of a scene of the assets with this coefficient of friction.
fn scene(repository: &Path, name: &str, friction: f64) -> Result<Simulation> {
    let path = repository.join(format!("assets/scenes/{name}.toml"));
    let mut scene = Scene::read(&path)?;
    scene.vessel.wall.friction = friction;
    scene.simulation(&NoStore)
}

/// Pushes in all of `total_mm`, the hand turned first, by steps of `step_mm`.
fn insert(start: &Simulation, turn_rad: f64, total_mm: f64, step_mm: f64) -> Course {
    let mut course = Course::new(start.clone());
    let mut go = |advance_mm: f64, rotate_rad: f64, parts: usize| {
        let command = Command { advance_mm, rotate_rad, ..Command::default() };
        course.go(&[Move { instrument: 0, command }], None, parts);
    };
    go(0.0, turn_rad, 1);
    let whole = (total_mm / step_mm).floor();
    go(step_mm * whole, 0.0, whole as usize);
    let rest_mm = total_mm - step_mm * whole;
    if rest_mm > 0.0 {
        go(rest_mm, 0.0, 1);
    }
    course
}

/// Insertions that end elsewhere in silence.
pub(super) fn turned(repository: &Path, only: Option<&str>, say: &mut dyn FnMut(String)) -> Result<usize> {
    let mut silent = 0;
    let mut sums: [Sum; STEPS_MM.len() + 1] = Default::default();
    for (name, total_mm) in SCENES.iter().filter(|(name, _)| only.is_none_or(|only| only == *name)) {
        for (friction, most_mm) in [0.0, 0.1].into_iter().zip(APART_MM) {
            let start = scene(repository, name, friction)?;
            for degrees in (0..360).step_by(30) {
                let turn_rad = f64::from(degrees).to_radians();
                let small = insert(&start, turn_rad, *total_mm, SMALL_MM);
                sums[0].add(&small);
                for (step_mm, all) in STEPS_MM.into_iter().zip(&mut sums[1..]) {
                    let course = insert(&start, turn_rad, *total_mm, step_mm);
                    all.add(&course);
                    let apart_mm = course.apart_mm(&small);
                    if apart_mm <= most_mm && course.end.is_some() == small.end.is_some() {
                        continue;
                    }
                    let reported = course.jumps > 0 && small.jumps > 0;
                    silent += usize::from(!reported);
                    let how = if reported { "both tell a jump" } else { "in silence" };
                    let failed = course.end.or(small.end.clone()).unwrap_or_default();
                    say(format!(
                        "{name}, μ {friction}, {degrees}°, {step_mm} mm: {apart_mm:.3} mm apart, {how} {failed}"
                    ));
                }
            }
        }
    }
    for (step_mm, sum) in [SMALL_MM].into_iter().chain(STEPS_MM).zip(&sums) {
        sum.print(&format!("{step_mm} mm"), say);
    }
    Ok(silent)
}
