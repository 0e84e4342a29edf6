//! Where a device ends does not depend on how the hand's motion is cut into commands: commands against the same motion in small parts.
//!
//! `cargo run --release -p endowire-benches --bin hard` has many more.

use std::path::Path;

use endowire_core::Vec3;
use endowire_core::insertion::{Command, Simulation};
use endowire_core::scene::Scene;
use endowire_core::vessel::NoStore;

/// The hepatic scene with this friction, its hand turned.
fn turned(friction: f64, degrees: f64) -> Simulation {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/scenes/hepatic.toml");
    let mut scene = Scene::read(&path).unwrap();
    scene.vessel.wall.friction = friction;
    let mut simulation = scene.simulation(&NoStore).unwrap();
    simulation
        .step(Command { advance_mm: 0.0, rotate_rad: degrees.to_radians(), ..Command::default() })
        .unwrap();
    simulation
}

/// Pushes on by steps; returns the tip, and whether all found an equilibrium.
fn push(simulation: &mut Simulation, step_mm: f64, steps: usize) -> (Vec3, bool) {
    let mut converged = true;
    for _ in 0..steps {
        converged &= simulation.step(Command::advance(step_mm)).unwrap().converged;
    }
    (*simulation.shape().positions_mm.last().unwrap(), converged)
}

#[test]
fn large_steps_end_where_small_ones_do() {
    // At 300° and 4.67 mm a step the tip ended 38 mm off once, and no jump was reported.
    for (friction, degrees, most_mm) in [(0.0, 300.0, 0.05), (0.0, 90.0, 0.05), (0.1, 300.0, 0.5)] {
        let begun = turned(friction, degrees);
        let (small, small_converged) = push(&mut begun.clone(), 0.5, 200);
        for (step_mm, steps) in [(4.0, 25), (10.0, 10), (25.0, 4)] {
            let (tip, converged) = push(&mut begun.clone(), step_mm, steps);
            let apart_mm = (tip - small).norm();
            assert!(
                apart_mm < most_mm && converged && small_converged,
                "{step_mm} mm, {degrees}°: {apart_mm}"
            );
        }
        // The twin: the tip goes by more than that in a tenth of the last step.
        assert!((push(&mut begun.clone(), 0.5, 195).0 - small).norm() > most_mm);
    }
}

#[test]
fn one_command_stores_what_its_parts_do() {
    let mut simulation = turned(0.0, 60.0);
    push(&mut simulation, 2.0, 20);
    for (advance_mm, rotate_rad) in [(38.0, 2.5), (-24.0, -3.0), (40.0, 0.0), (-30.0, 1.0), (35.0, -2.0)] {
        let (mut one, mut many) = (simulation.clone(), simulation.clone());
        one.step(Command { advance_mm, rotate_rad, ..Command::default() }).unwrap();
        for _ in 0..40 {
            let part = Command {
                advance_mm: advance_mm / 40.0,
                rotate_rad: rotate_rad / 40.0,
                ..Command::default()
            };
            many.step(part).unwrap();
        }
        let [energy, of_parts] = [&one, &many].map(|s| s.report().energy.total());
        assert!(
            (energy - of_parts).abs() < 1e-3 * of_parts + 1e-6,
            "{advance_mm} mm: {energy} and {of_parts} mJ"
        );
        let [tip, of_parts] = [&one, &many].map(|s| *s.shape().positions_mm.last().unwrap());
        assert!((tip - of_parts).norm() < 0.05, "{advance_mm} mm: {tip} and {of_parts}");
        simulation = many;
    }
}
