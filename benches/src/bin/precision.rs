//! Work and precision: what a step takes and how far it is off, over lengths of elements, distances of contact points and tolerances.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin precision [SCENE] > precision.tsv
//! ```
//!
//! A row for each scene and setting: time a command, the median of three runs; how far the device's line is off that of the finest setting at the same
//! place of the device, at nine of ten commands and at most; and how far the push force is, over the largest. Rows that another one beats in both
//! are not on the front. At a snap lines may be apart by as much as they snap: the 90th percentile tells what a setting is worth, the largest where it snaps elsewhere.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a table is what it is for")]

use std::path::Path;
use std::time::Instant;

use endowire_core::insertion::Simulation;
use endowire_core::methods::OwnMethod;
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;
use endowire_core::{Error, Result, Vec3};

/// Tubes, arteries of the arch and the liver, friction, two instruments, a spoiled surface.
const SCENES: [&str; 9] = [
    "assets/scenes/curved_tube_exact",
    "assets/scenes/curved_tube",
    "assets/scenes/curved_tube_friction",
    "assets/scenes/arch_innominate",
    "assets/scenes/arch_carotid",
    "assets/scenes/hepatic",
    "assets/scenes/arch_vertebral",
    "benches/hard/pair_mu0.1",
    "benches/hard/noisy_arch_iii",
];
/// Lengths of elements, mm, …
const ELEMENTS_MM: [f64; 5] = [2.0, 3.0, 4.0, 5.0, 6.0];
/// … distances of contact points, radii, …
const SPACINGS: [f64; 5] = [0.5, 0.75, 1.0, 1.5, 3.0];
/// … and tolerances.
const TOLERANCES: [f64; 3] = [1e-9, 1e-6, 1e-4];
/// What the others are held against.
const FINEST: [f64; 3] = [1.0, 0.25, 1e-10];
/// Places of a line that are compared, mm apart.
const PLACES_MM: f64 = 2.0;
/// Runs of which the median is taken.
const RUNS: usize = 3;

/// What a run tells of a command.
struct Told {
    line_mm: Vec<Vec3>,
    push_force_n: f64,
}

/// A scene's script from its start: what each command told, and time, s, and iterations of one in the mean.
fn run(scene: &Scene, start: &Simulation) -> Result<(Vec<Told>, f64, f64)> {
    let mut simulation = start.clone();
    let script = scene.steps(simulation.stack(), &NoStore)?;
    let mut run = script.begin();
    let (mut told, mut seconds, mut iterations) = (Vec::new(), 0.0, 0u64);
    while let Some(step) = run.next(&simulation)? {
        let (moves, time_s) = (step.moves.to_vec(), step.time_s);
        run.carried_out();
        let begun = Instant::now();
        let done =
            simulation.step_until(&moves, time_s).map(|report| (report.push_force_n, report.iterations));
        seconds += begun.elapsed().as_secs_f64();
        let Ok((push_force_n, its)) = done else { break };
        iterations += u64::from(its);
        let line = simulation.shape();
        let count = (simulation.report().inserted_mm / PLACES_MM) as usize;
        let line_mm = (0..count).filter_map(|k| line.position_at(PLACES_MM * k as f64)).collect();
        told.push(Told { line_mm, push_force_n });
    }
    let commands = told.len().max(1) as f64;
    Ok((told, seconds / commands, iterations as f64 / commands))
}

/// A percentile of values in ascending order.
fn percentile(sorted: &[f64], part: f64) -> f64 {
    sorted.get(((sorted.len().saturating_sub(1)) as f64 * part) as usize).copied().unwrap_or(f64::NAN)
}

/// How far a run is off another: lines, mm, at nine of ten commands and at most, and push forces at nine of ten, over the largest.
fn off(run: &[Told], exact: &[Told]) -> [f64; 3] {
    let line = |(a, b): (&Told, &Told)| {
        a.line_mm.iter().zip(&b.line_mm).map(|(x, y)| (x - y).norm()).fold(0.0, f64::max)
    };
    let mut lines: Vec<f64> = run.iter().zip(exact).map(line).collect();
    let largest_n = exact.iter().map(|told| told.push_force_n.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let push = |(a, b): (&Told, &Told)| (a.push_force_n - b.push_force_n).abs() / largest_n;
    let mut pushes: Vec<f64> = run.iter().zip(exact).map(push).collect();
    lines.sort_by(f64::total_cmp);
    pushes.sort_by(f64::total_cmp);
    [percentile(&lines, 0.9), percentile(&lines, 1.0), percentile(&pushes, 0.9)]
}

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let only = std::env::args().nth(1);
    let chosen: Vec<&str> =
        SCENES.into_iter().filter(|name| only.as_deref().is_none_or(|only| name.contains(only))).collect();
    if chosen.is_empty() {
        let mend = format!("is in none of {}", SCENES.join(", "));
        return Err(Error::parameter("SCENE", only.unwrap_or_default(), mend));
    }
    println!(
        "scene\telement_mm\tspacing_radii\ttolerance\tms\titerations\toff_90_mm\toff_most_mm\tpush_90\tcommands\tfront"
    );
    for name in chosen {
        let path = root.join(format!("{name}.toml"));
        let mut scene = Scene::read(&path)?;
        let mut simulated = |[element_mm, contact_spacing_radii, tolerance]: [f64; 3]| {
            let options = KirchhoffOptions {
                element_mm,
                contact_spacing_radii,
                tolerance,
                ..KirchhoffOptions::default()
            };
            scene.method = OwnMethod::Kirchhoff(options);
            let start = scene.simulation(&NoStore)?;
            let mut runs: Vec<_> = (0..RUNS).map(|_| run(&scene, &start)).collect::<Result<_>>()?;
            runs.sort_by(|a, b| a.1.total_cmp(&b.1));
            Ok::<_, Error>(runs.swap_remove(RUNS / 2))
        };
        let (exact, ..) = simulated(FINEST)?;
        let mut rows = Vec::new();
        for element_mm in ELEMENTS_MM {
            for spacing in SPACINGS {
                for tolerance in TOLERANCES {
                    let (told, seconds, iterations) = simulated([element_mm, spacing, tolerance])?;
                    rows.push((
                        [element_mm, spacing, tolerance],
                        seconds,
                        iterations,
                        off(&told, &exact),
                        told.len(),
                    ));
                }
            }
        }
        for ([element_mm, spacing, tolerance], seconds, iterations, [near, most, push], commands) in &rows {
            let beaten = rows.iter().any(|other| other.1 < *seconds && other.3[0] < *near);
            println!(
                "{}\t{element_mm}\t{spacing}\t{tolerance:e}\t{:.4}\t{iterations:.2}\t{near:.5}\t{most:.4}\t{push:.5}\t{commands}/{}\t{}",
                name.rsplit('/').next().unwrap_or(name),
                1e3 * seconds,
                exact.len(),
                if beaten { "" } else { "*" },
            );
        }
    }
    Ok(())
}
