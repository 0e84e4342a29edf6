//! Scenes on other meshes and in other increments: every cell arrives where the scene does, and nothing is crossed.
//!
//! The long tables are ignored by default:
//! `cargo test --release -p endowire-tests --test regression arrival:: -- --ignored --nocapture --test-threads 1`.

#![allow(clippy::print_stdout, reason = "tables are printed")]

use std::path::{Path, PathBuf};

use endowire_core::Vec3;
use endowire_core::device::{Device, DeviceFile, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Simulation};
use endowire_core::scene::Scene;
use endowire_core::vessel::{NoStore, Wall};
use endowire_tests::crossing::CrossingTest;
use endowire_tests::sweep::Tally;

/// A file of the folder `assets`.
pub(super) fn asset(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(name)
}

/// A scene on a mesh of another size, with the wall to share between its runs.
pub(super) fn scene(name: &str, triangles: usize) -> (Scene, Wall) {
    let mut scene = Scene::read(&asset(&format!("scenes/{name}.toml"))).unwrap();
    if let Some(file) = scene.vessel.file.take() {
        scene.vessel.tree = Some(file.with_extension("csv"));
    }
    scene.vessel.edge_mm = None;
    scene.vessel.triangles = Some(triangles);
    let wall = scene.wall(&NoStore).unwrap();
    (scene, wall)
}

/// The commands of a scene's script in other increments.
fn commands(scene: &mut Scene, step_mm: f64) -> Vec<Command> {
    for line in &mut scene.script {
        line.step_mm = Some(step_mm);
    }
    scene.commands(&scene.device().unwrap()).unwrap()
}

/// These instruments at the sheath of a scene.
fn start(scene: &Scene, wall: &Wall, instruments: impl Into<Stack>) -> Simulation {
    Simulation::builder(wall.clone(), instruments, scene.sheath(wall).unwrap())
        .properties(scene.vessel.wall.clone())
        .method(&scene.method)
        .build()
        .unwrap()
}

/// Runs a scene in other increments, up to the first command that fails.
pub(super) fn run_scene(
    (scene, wall): &mut (Scene, Wall),
    crossing: &CrossingTest,
    step_mm: f64,
) -> (Simulation, Tally) {
    let commands = commands(scene, step_mm);
    let mut simulation = start(scene, wall, scene.device().unwrap());
    let mut tally = Tally::default();
    tally.drive(&mut simulation, crossing, &commands);
    (simulation, tally)
}

/// Scenes, and where their tips come to lie: a point and how near, mm.
const NAVIGATION: [(&str, [f64; 3], f64); 7] = [
    ("curved_tube_exact", [81.2, 0.0, 127.4], 1.0),
    ("arch_subclavian", [13.0, -9.5, 267.5], 5.0),
    ("arch_carotid", [-11.0, -26.5, 280.7], 5.0),
    ("arch_innominate", [-44.5, -42.5, 267.5], 5.0),
    // Into the left or the right hepatic artery, from the artery of both.
    ("hepatic", [-54.5, -37.5, 87.0], 8.0),
    // A loop that has slipped out of the narrow end lies anywhere along the tube, at nearly the same energy: only that it comes there
    // cleanly is asked.
    ("loop", [0.0, 0.0, 60.0], 65.0),
    ("arch_plaque", [-11.0, -26.5, 280.7], 5.0),
];

/// Triangles of the mesh that nothing may cross, where a scene's own has fewer: facets of a few thousand cut through the vessel's own
/// surface, by more than a wire's radius at a fork, and the smooth wall through them does not.
const FINE: usize = 40_000;

/// Drives a scene on a mesh in increments.
type Run = fn(&mut (Scene, Wall), &CrossingTest, f64) -> (Simulation, Tally);

fn navigate(run: Run, which: usize, triangles: &[usize], steps_mm: &[f64]) {
    let (name, target, near_mm) = NAVIGATION[which];
    let mut bad = Vec::new();
    let fine = CrossingTest::new(scene(name, FINE).1.mesh());
    for &triangles in triangles {
        let mut scene = scene(name, triangles);
        let own = (triangles > FINE).then(|| CrossingTest::new(scene.1.mesh()));
        let crossing = own.as_ref().unwrap_or(&fine);
        for &step_mm in steps_mm {
            let (simulation, tally) = run(&mut scene, crossing, step_mm);
            let tip = simulation.shape().tip_mm().unwrap();
            let arrived = (tip - Vec3::from(target)).norm() < near_mm;
            println!(
                "{name:<18} {triangles:>7} triangles {step_mm:>4} mm: tip [{:>6.1} {:>6.1} {:>6.1}] {} {tally}",
                tip.x,
                tip.y,
                tip.z,
                if arrived { "arrived" } else { "ELSEWHERE" }
            );
            if !tally.is_clean() || !arrived {
                bad.push(format!("{name}, {triangles} triangles, {step_mm} mm: {tally}"));
            }
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}

/// How far behind the tip of the wire the catheter follows, mm.
const BEHIND_MM: f64 = 100.0;
/// How far before it the catheter ends that has been pushed over it, mm.
const BEFORE_TIP_MM: f64 = 20.0;

/// As [`run_scene`], with a 4F catheter behind the scene's wire, which at the end is pushed over it while it is held.
fn run_in_a_catheter(
    (scene, wall): &mut (Scene, Wall),
    crossing: &CrossingTest,
    step_mm: f64,
) -> (Simulation, Tally) {
    let commands = commands(scene, step_mm);
    // Of exchange length: its tail must not slip into the catheter's. What is added does not twist, so that the turns of the scene
    // arrive as with its own wire.
    let mut sections = scene.device().unwrap().sections().to_vec();
    let last = *sections.last().unwrap();
    sections.push(Section { length_mm: 1500.0, torsional_stiffness_nmm2: Some(1e8), ..last });
    let wire = Device::new(sections).unwrap();
    let catheter = DeviceFile::read(&asset("devices/catheter_4f_vertebral.toml")).unwrap().device;
    let one = |name: &str, device| Instrument { name: name.to_owned(), device, may_lead: true };
    let stack = Stack::new(vec![one("wire", wire), one("catheter", catheter)]).unwrap();
    let mut simulation = start(scene, wall, stack);
    let behind_mm = |simulation: &Simulation| {
        let [wire, catheter] = [0, 1]
            .map(|k| simulation.report().instruments.get(k).map_or(0.0, |instrument| instrument.inserted_mm));
        wire - catheter
    };
    let mut tally = Tally::default();
    for command in commands {
        let follow_mm = (behind_mm(&simulation) + command.advance_mm - BEHIND_MM).max(0.0);
        let both = [command, Command::advance(follow_mm)];
        let moves = [0, 1].map(|instrument| Move { instrument, command: both[instrument] });
        if !tally.step_together(&mut simulation, crossing, &moves) {
            return (simulation, tally);
        }
    }
    let way_mm = behind_mm(&simulation) - BEFORE_TIP_MM;
    let count = (way_mm / step_mm).ceil();
    for _ in 0..count as usize {
        let over = Move { instrument: 1, command: Command::advance(way_mm / count) };
        tally.step_together(&mut simulation, crossing, &[over]);
    }
    (simulation, tally)
}

#[test]
#[ignore = "minutes"]
fn table_of_a_wire_in_a_catheter_into_three_branches() {
    (1..4).for_each(|which| table(run_in_a_catheter, which));
}

#[test]
fn a_wire_in_a_catheter_arrives_on_a_coarse_mesh_in_large_steps() {
    (1..4).for_each(|which| navigate(run_in_a_catheter, which, &[5_000], &[5.0]));
}

#[test]
fn every_scene_arrives_on_a_coarse_mesh_in_large_steps() {
    (0..NAVIGATION.len()).for_each(|which| navigate(run_scene, which, &[5_000], &[5.0]));
}

/// The table of a scene: every mesh, every increment.
fn table(run: Run, which: usize) {
    navigate(run, which, &[5_000, 40_000, 200_000], &[0.1, 1.0, 5.0]);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_curved_tube() {
    table(run_scene, 0);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_arch_into_the_subclavian_artery() {
    table(run_scene, 1);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_arch_into_the_carotid_artery() {
    table(run_scene, 2);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_arch_into_the_innominate_artery() {
    table(run_scene, 3);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_liver() {
    table(run_scene, 4);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_loop() {
    table(run_scene, 5);
}

#[test]
#[ignore = "a minute"]
fn table_of_the_arch_with_plaque() {
    table(run_scene, 6);
}
