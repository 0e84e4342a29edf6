//! Work and precision: what a command takes and how far it is off, over length of elements, distance of contact points, tolerance, the wall's mesh and length of steps.
//!
//! ```sh
//! cargo run --release -p endowire-benches --bin precision [SCENE] > precision.tsv
//! ```
//!
//! A row for each scene and setting: time a command, the median of three runs; how far the device's line is off that of the finest setting with the
//! hands at the same place, at nine of ten commands and at most; and how far the push force is, over the largest. Settings are the accuracies of
//! `method.accuracy`, and the defaults with one thing varied at a time. Steps are held against the finest setting in steps of a quarter. At a snap
//! lines may be apart by as much as they snap: the 90th percentile tells what a setting is worth, the largest where it snaps elsewhere.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a table is what it is for")]

use std::path::Path;
use std::time::Instant;

use endowire_core::insertion::Simulation;
use endowire_core::methods::OwnMethod;
use endowire_core::methods::kirchhoff::{Accuracy, KirchhoffOptions};
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
/// What is varied: lengths of elements, mm, …
const ELEMENTS_MM: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
/// … distances of contact points, radii, …
const SPACINGS: [f64; 5] = [0.5, 0.75, 1.0, 1.5, 3.0];
/// … tolerances, …
const TOLERANCES: [f64; 5] = [1e-9, 1e-7, 1e-6, 1e-5, 1e-4];
/// … triangles of the wall, where the vessel's centre line is felt itself otherwise, …
const TRIANGLES: [usize; 3] = [5_000, 20_000, 80_000];
/// … and lengths of steps, over those of the script.
const STEPS: [f64; 3] = [0.5, 2.0, 4.0];
/// Steps that they are held against.
const FINEST_STEPS: f64 = 0.25;
/// Places of a line that are compared, mm apart.
const PLACES_MM: f64 = 2.0;
/// Runs of which the median is taken.
const RUNS: usize = 3;

/// How a scene is simulated.
#[derive(Clone, Copy)]
struct Setting {
    options: KirchhoffOptions,
    triangles: Option<usize>,
    steps: f64,
}

impl Setting {
    fn of(options: KirchhoffOptions) -> Self {
        Self { options, triangles: None, steps: 1.0 }
    }

    /// What everything is held against.
    fn finest(steps: f64) -> Self {
        let options = KirchhoffOptions {
            element_mm: 1.0,
            contact_spacing_radii: 0.25,
            tolerance: 1e-10,
            ..KirchhoffOptions::default()
        };
        Self { steps, ..Self::of(options) }
    }

    /// All that a scene is run in, with their names.
    fn all(has_tree: bool) -> Vec<(String, Self)> {
        let usual = KirchhoffOptions::default();
        let of = |name: String, options| (name, Self::of(options));
        let mut all = vec![of("defaults".into(), usual)];
        for accuracy in [Accuracy::Fast, Accuracy::Balanced, Accuracy::Fine] {
            let name = format!("{accuracy:?}").to_lowercase();
            all.push(of(name, KirchhoffOptions::of(accuracy)));
        }
        for element_mm in ELEMENTS_MM {
            all.push(of(format!("element_mm {element_mm}"), KirchhoffOptions { element_mm, ..usual }));
        }
        for contact_spacing_radii in SPACINGS {
            let name = format!("contact_spacing_radii {contact_spacing_radii}");
            all.push(of(name, KirchhoffOptions { contact_spacing_radii, ..usual }));
        }
        for tolerance in TOLERANCES {
            all.push(of(format!("tolerance {tolerance:e}"), KirchhoffOptions { tolerance, ..usual }));
        }
        for triangles in TRIANGLES.into_iter().filter(|_| has_tree) {
            all.push((
                format!("triangles {triangles}"),
                Self { triangles: Some(triangles), ..Self::of(usual) },
            ));
        }
        for steps in STEPS {
            all.push((format!("steps {steps}"), Self { steps, ..Self::of(usual) }));
        }
        all
    }

    /// The script of the scene of a file in this setting, the median of so many runs in time.
    fn run(self, path: &Path, runs: usize) -> Result<Run> {
        let mut scene = Scene::read(path)?;
        scene.method = OwnMethod::Kirchhoff(self.options);
        for line in &mut scene.script {
            line.step_mm = Some(self.steps * line.step_mm.unwrap_or(1.0));
            line.step_deg = Some(self.steps * line.step_deg.unwrap_or(5.0));
            for other in &mut line.with {
                other.step_mm = Some(self.steps * other.step_mm.unwrap_or(1.0));
            }
        }
        let lumen = match self.triangles {
            None => scene.lumen(&NoStore)?,
            Some(_) => {
                (scene.vessel.edge_mm, scene.vessel.triangles) = (None, self.triangles);
                scene.wall(&NoStore)?.into()
            }
        };
        let start = scene.simulation_in(lumen, &NoStore)?;
        let mut runs: Vec<_> = (0..runs).map(|_| Run::of(&scene, start.clone())).collect::<Result<_>>()?;
        runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        Ok(runs.swap_remove(runs.len() / 2))
    }
}

/// What a run reported of each command, and the time, s, and iterations of all.
struct Run {
    reported: Vec<Told>,
    seconds: f64,
    iterations: u64,
}

/// What a run tells of a command.
struct Told {
    /// Where each hand is: length that is in, mm, and turn, rad.
    hands: Vec<[f64; 2]>,
    line_mm: Vec<Vec3>,
    push_force_n: f64,
}

impl Told {
    fn same_hands(&self, other: &Self) -> bool {
        self.hands.iter().flatten().zip(other.hands.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-6)
    }
}

impl Run {
    /// A scene's script from its start.
    fn of(scene: &Scene, mut simulation: Simulation) -> Result<Self> {
        let script = scene.steps(simulation.stack(), &NoStore)?;
        let mut script = script.begin();
        let mut run = Self { reported: Vec::new(), seconds: 0.0, iterations: 0 };
        while let Some(step) = script.next(&simulation)? {
            let begun = Instant::now();
            let done = step.carry_out(&mut simulation).map(|report| (report.push_force_n, report.iterations));
            run.seconds += begun.elapsed().as_secs_f64();
            script.carried_out();
            let Ok((push_force_n, iterations)) = done else { break };
            run.iterations += u64::from(iterations);
            let report = simulation.report();
            let mut hands = vec![[report.inserted_mm, report.rotation_rad]];
            hands.extend(report.instruments.iter().map(|i| [i.inserted_mm, i.rotation_rad]));
            let line = simulation.shape();
            let count = (report.inserted_mm / PLACES_MM) as usize;
            let line_mm = (0..count).filter_map(|k| line.position_at(PLACES_MM * k as f64)).collect();
            run.reported.push(Told { hands, line_mm, push_force_n });
        }
        Ok(run)
    }

    /// How far it is off another: lines, mm, at nine of ten commands and at most, and push forces at nine of ten, over the largest.
    fn off(&self, exact: &Self) -> [f64; 3] {
        let largest_n = exact
            .reported
            .iter()
            .map(|reported| reported.push_force_n.abs())
            .fold(f64::MIN_POSITIVE, f64::max);
        let (mut lines, mut pushes) = (Vec::new(), Vec::new());
        // Hands go to and fro: of commands with the same place, the next.
        let mut rest = exact.reported.iter();
        for reported in &self.reported {
            let ahead = rest.clone();
            let Some(same) = rest.find(|other| reported.same_hands(other)) else {
                rest = ahead;
                continue;
            };
            let apart = reported.line_mm.iter().zip(&same.line_mm).map(|(a, b)| (a - b).norm());
            lines.push(apart.fold(0.0, f64::max));
            pushes.push((reported.push_force_n - same.push_force_n).abs() / largest_n);
        }
        lines.sort_by(f64::total_cmp);
        pushes.sort_by(f64::total_cmp);
        [percentile(&lines, 0.9), percentile(&lines, 1.0), percentile(&pushes, 0.9)]
    }
}

/// A percentile of values in ascending order.
fn percentile(sorted: &[f64], part: f64) -> f64 {
    sorted.get(((sorted.len().saturating_sub(1)) as f64 * part) as usize).copied().unwrap_or(f64::NAN)
}

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let only = std::env::args().nth(1);
    let chosen: Vec<&str> =
        SCENES.into_iter().filter(|name| only.as_deref().is_none_or(|only| name.contains(only))).collect();
    if chosen.is_empty() {
        let remedy = format!("is in none of {}", SCENES.join(", "));
        return Err(Error::parameter("SCENE", only.unwrap_or_default(), remedy));
    }
    println!("scene\tsetting\tms\titerations\toff_90_mm\toff_most_mm\tpush_90\tcommands");
    for path in chosen {
        let name = path.rsplit('/').next().unwrap_or(path);
        let path = root.join(format!("{path}.toml"));
        let exact = Setting::finest(1.0).run(&path, 1)?;
        let exact_steps = Setting::finest(FINEST_STEPS).run(&path, 1)?;
        for (of, setting) in Setting::all(Scene::read(&path)?.vessel.tree.is_some()) {
            let run = setting.run(&path, RUNS)?;
            let stepped = (setting.steps - 1.0).abs() > f64::EPSILON;
            let [near, most, push] = run.off(if stepped { &exact_steps } else { &exact });
            let commands = run.reported.len().max(1) as f64;
            println!(
                "{name}\t{of}\t{:.4}\t{:.2}\t{near:.5}\t{most:.4}\t{push:.5}\t{}",
                1e3 * run.seconds / commands,
                run.iterations as f64 / commands,
                run.reported.len(),
            );
        }
    }
    Ok(())
}
