//! Scenes that are hard to simulate, each as its script has it and again in small steps.

use std::path::{Path, PathBuf};

use endowire_core::Result;
use endowire_core::insertion::Move;
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;

use super::course::Course;
use crate::sequences::APART_MM;

/// Small steps, mm and rad.
const SMALL_MM: f64 = 0.1;
const SMALL_RAD: f64 = 0.02;
/// How many small steps moves are.
fn parts(moves: &[Move]) -> usize {
    let each = moves
        .iter()
        .map(|one| (one.command.advance_mm.abs() / SMALL_MM).max(one.command.rotate_rad.abs() / SMALL_RAD));
    each.fold(1.0, f64::max).ceil() as usize
}

/// One case. Returns whether the path was kept, or both ways tell jumps.
fn case(path: &Path, say: &mut dyn FnMut(String)) -> Result<bool> {
    let scene = Scene::read(path)?;
    let start = scene.simulation(&NoStore)?;
    let script = scene.steps(start.stack(), &NoStore)?;
    let most_mm = APART_MM[usize::from(scene.vessel.wall.friction > 0.0)];
    let (mut given, mut small) = (Course::new(start.clone()), Course::new(start));
    let mut run = script.begin();
    let mut now_s = 0.0;
    let mut apart: (f64, usize) = (0.0, 0);
    let mut left: Option<usize> = None;
    while let Some(step) = run.next(&given.simulation)? {
        let step = step.into_owned();
        let moves = &step.moves;
        let times_s = step.time_s.map(|to| (std::mem::replace(&mut now_s, to), to));
        run.carried_out();
        given.carry_out(&step);
        if step.detach.is_some() {
            small.carry_out(&step);
        } else {
            small.go(moves, times_s, parts(moves).max(if times_s.is_some() { 5 } else { 1 }));
        }
        if given.end.is_some() || small.end.is_some() {
            break;
        }
        // Ticks are compared where they have followed the hands.
        if given.simulation.report().is_under_way() {
            continue;
        }
        let apart_mm = given.apart_mm(&small);
        if apart_mm > apart.0 {
            apart = (apart_mm, given.commands);
        }
        if apart_mm > most_mm && left.is_none() {
            left = Some(given.commands);
        }
    }
    let reported = given.jumps > 0 && small.jumps > 0;
    let ends = [&given, &small].map(|one| one.end.is_some());
    let kept = match (left, ends[0] == ends[1]) {
        (None, true) => "kept",
        _ if reported => "told",
        _ => "LEFT",
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    say(format!(
        "{name:<28} {kept:<5} {:>8.3} {:>5} {:>8.1} {:>5} {:>7} {:>7} {:>8.0} {:>8.0} {:>4} {:>4} {:>5} {:>5} {:>3}  {}",
        apart.0,
        left.map_or_else(|| "–".to_owned(), |k| k.to_string()),
        given.simulation.report().inserted_mm,
        given.commands,
        given.iterations,
        small.iterations,
        1e3 * given.seconds,
        1e3 * given.slowest_s,
        given.jumps,
        small.jumps,
        given.flights,
        small.flights,
        given.unconverged,
        given.end.or(small.end).map(|end| end.chars().take(60).collect::<String>()).unwrap_or_default()
    ));
    Ok(kept != "LEFT")
}

/// Carries a scene's script out as it is, and prints a line of what it took, in the columns of `insertions`.
fn line(path: &Path, say: &mut dyn FnMut(String)) -> Result<()> {
    let scene = Scene::read(path)?;
    let start = scene.simulation(&NoStore)?;
    let script = scene.steps(start.stack(), &NoStore)?;
    let (mut course, mut times_ms) = (Course::new(start), Vec::new());
    let mut run = script.begin();
    while let Some(step) = run.next(&course.simulation)? {
        let step = step.into_owned();
        run.carried_out();
        let before_s = course.seconds;
        course.carry_out(&step);
        if course.end.is_some() {
            break;
        }
        times_ms.push(1e3 * (course.seconds - before_s));
    }
    times_ms.sort_by(f64::total_cmp);
    say(format!(
        "{}\t{}\t{}\t{}\t{}\t{:.4}\t{:.1}",
        path.file_stem().unwrap_or_default().to_string_lossy(),
        course.commands - course.unconverged,
        course.iterations,
        course.flights,
        course.simulation.counters().queries,
        times_ms.get(times_ms.len() / 2).copied().unwrap_or(0.0),
        1e3 * course.seconds
    ));
    Ok(())
}

/// Prints what the scenes take.
pub(super) fn lines(repository: &Path, only: Option<&str>, say: &mut dyn FnMut(String)) -> Result<()> {
    scenes(repository, only)?.iter().try_for_each(|path| line(path, say))
}

/// Scenes of `benches/hard`.
fn scenes(repository: &Path, only: Option<&str>) -> Result<Vec<PathBuf>> {
    let mut paths = super::scenes(repository)?;
    paths.retain(|path| only.is_none_or(|only| path.to_string_lossy().contains(only)));
    Ok(paths)
}

/// Cases of which the path was left in silence.
pub(super) fn cases(repository: &Path, only: Option<&str>, say: &mut dyn FnMut(String)) -> Result<usize> {
    let paths = scenes(repository, only)?;
    say(format!(
        "{:<28} {:<5} {:>8} {:>5} {:>8} {:>5} {:>7} {:>7} {:>8} {:>8} {:>4} {:>4} {:>5} {:>5} {:>3}  ends",
        "case",
        "path",
        "apart mm",
        "from",
        "in mm",
        "cmds",
        "iter.",
        "small",
        "ms",
        "slowest",
        "jump",
        "sm.",
        "fly",
        "sm.",
        "unb"
    ));
    let mut wrong = 0;
    for path in &paths {
        wrong += usize::from(!case(path, say)?);
    }
    say(format!("{} cases", paths.len()));
    Ok(wrong)
}
