//! The exact rod in a vessel, against independent values and its own conservation laws.

use endowire_core::contact::Counters;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, NoStore, Resolution, Wall, anatomy};
use endowire_tests::crossing::CrossingTest;

fn kirchhoff(element_mm: f64) -> KirchhoffOptions {
    KirchhoffOptions { element_mm, ..Default::default() }
}

fn curved_tube() -> (Wall, Sheath) {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    (made.wall, sheath)
}

fn in_curved_tube(modulus_n_per_mm2: f64) -> Simulation {
    let (wall, sheath) = curved_tube();
    let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
    Simulation::builder(wall, wire, sheath)
        .properties(WallProperties { modulus_n_per_mm2, ..Default::default() })
        .method(&kirchhoff(2.0))
        .build()
        .unwrap()
}

#[test]
fn the_result_does_not_depend_on_the_increment() {
    let run = |step_mm: f64| {
        let mut simulation = in_curved_tube(1.0);
        for _ in 0..(200.0 / step_mm).round() as usize {
            simulation.step(Command::advance(step_mm)).unwrap();
        }
        assert!(
            !CrossingTest::new(simulation.lumen().wall(&NoStore).unwrap().mesh()).is_crossed_by(&simulation)
        );
        (simulation.shape().tip_mm().unwrap(), simulation.report().push_force_n)
    };
    let (tip, force) = run(1.0);
    for step_mm in [0.5, 4.0] {
        let (other_tip, other_force) = run(step_mm);
        assert!((other_tip - tip).norm() < 0.02, "{step_mm} mm: {}", (other_tip - tip).norm());
        assert!((other_force / force - 1.0).abs() < 1e-4, "{step_mm} mm: {other_force} and {force}");
    }
}

#[test]
fn a_tolerance_saves_iterations_and_costs_little() {
    let run = |tolerance: f64| {
        let (wall, sheath) = curved_tube();
        let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
        let options = KirchhoffOptions { element_mm: 4.0, tolerance, ..Default::default() };
        let method = options;
        let mut simulation = Simulation::builder(wall, wire, sheath).method(&method).build().unwrap();
        let mut iterations = 0;
        for _ in 0..100 {
            iterations += simulation.step(Command::advance(2.0)).unwrap().iterations;
        }
        (simulation.shape().tip_mm().unwrap(), iterations)
    };
    let (exact, many) = run(1e-9);
    let (loose, few) = run(1e-4);
    assert!(10 * few < 9 * many, "{few} and {many} iterations");
    let off = (loose - exact).norm();
    assert!(off > 0.0 && off < 1e-3, "{off:e}");
    let (wall, sheath) = curved_tube();
    let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
    let method = KirchhoffOptions { tolerance: 0.1, ..Default::default() };
    let refused = Simulation::builder(wall, wire, sheath).method(&method).build().err().unwrap().to_string();
    assert!(refused.contains("method.tolerance"), "{refused}");
}

#[test]
fn contact_points_farther_apart_save_time_and_cost_little_where_no_crest_is() {
    let run = |contact_spacing_radii: f64| {
        let (wall, sheath) = curved_tube();
        let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
        let method =
            KirchhoffOptions { element_mm: 7.5, contact_spacing_radii, ..KirchhoffOptions::default() };
        let mut simulation = Simulation::builder(wall, wire, sheath).method(&method).build()?;
        for _ in 0..100 {
            simulation.step(Command::advance(2.0))?;
        }
        Ok::<_, endowire_core::Error>(simulation.shape().tip_mm().unwrap())
    };
    let off = (run(4.0).unwrap() - run(1.5).unwrap()).norm();
    assert!(off > 0.0 && off < 0.02, "{off:e}");
    for wrong in [0.0, -1.5, 10.1, f64::NAN, f64::INFINITY] {
        let refused = run(wrong).unwrap_err().to_string();
        assert!(refused.contains("method.contact_spacing_radii"), "{refused}");
    }
}

/// On 40 mm long elements the slid device comes off the wall by hundredths of a millimetre. Where its contacts are not held,
/// Newton's method looks for them one by one: 306 iterations.
#[test]
fn coarse_elements_keep_their_contacts() {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(0.8)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let wire = Device::uniform(250.0, 0.445, 10.0).unwrap();
    let mut simulation =
        Simulation::builder(made.wall, wire, sheath).method(&kirchhoff(40.0)).build().unwrap();
    let mut iterations = 0;
    for _ in 0..100 {
        iterations += simulation.step(Command::advance(2.0)).unwrap().iterations;
    }
    assert!(iterations < 270, "{iterations}");
}

#[test]
fn the_push_force_is_the_slope_of_the_energy() {
    let mut simulation = in_curved_tube(1.0);
    for _ in 0..160 {
        simulation.step(Command::advance(1.0)).unwrap();
    }
    for _ in 0..3 {
        simulation.step(Command::advance(7.3)).unwrap();
        let here = simulation.report().push_force_n;
        let step = 0.02;
        let before = simulation.step(Command::retract(step)).unwrap().energy.total();
        let after = simulation.step(Command::advance(2.0 * step)).unwrap().energy.total();
        let slope = (after - before) / (2.0 * step);
        simulation.step(Command::retract(step)).unwrap();
        assert!((here / slope - 1.0).abs() < 1e-3, "push force {here}, slope {slope}");
    }
}

#[test]
fn in_and_out_returns_to_the_same_energy() {
    let mut simulation = in_curved_tube(1.0);
    for _ in 0..150 {
        simulation.step(Command::advance(1.0)).unwrap();
    }
    let before = simulation.report().clone();
    for _ in 0..40 {
        assert!(!simulation.step(Command::advance(1.0)).unwrap().jumped);
    }
    for _ in 0..40 {
        assert!(!simulation.step(Command::retract(1.0)).unwrap().jumped);
    }
    let after = simulation.report();
    let change = (after.energy.total() / before.energy.total() - 1.0).abs();
    assert!(change < 1e-8, "{change:e}");
    assert!((after.energy.bend - simulation.step(Command::advance(1.0)).unwrap().energy.bend).abs() > 1e-6);
}

#[test]
fn walls_of_any_stiffness_are_met_and_never_passed_through() {
    for modulus in [1e-3, 1e-1, 1e2, 1e4] {
        let mut simulation = in_curved_tube(modulus);
        let crossing = CrossingTest::new(simulation.lumen().wall(&NoStore).unwrap().mesh());
        for _ in 0..50 {
            simulation.step(Command::advance(4.0)).unwrap_or_else(|e| panic!("{modulus} N/mm²: {e}"));
            assert!(!crossing.is_crossed_by(&simulation), "{modulus} N/mm²");
        }
        // Only into the softest the axis itself sinks.
        let deepest = simulation.report().max_penetration_mm;
        assert_eq!(deepest < 0.445, modulus > 0.05, "{modulus} N/mm²: {deepest} mm");
    }
}

#[test]
fn most_questions_about_the_wall_are_answered_from_memory() {
    let (wall, sheath) = curved_tube();
    let wire = Device::uniform(400.0, 0.445, 10.0).unwrap();
    let mut simulation = Simulation::builder(wall, wire, sheath).build().unwrap();
    let mut skipped = 0;
    for _ in 0..80 {
        skipped += usize::from(simulation.step(Command::advance(2.0)).unwrap().iterations == 0);
    }
    let Counters { queries, avoided, near, .. } = simulation.counters();
    assert!(avoided > 0 && near > 0 && queries * 4 < avoided + near, "{:?}", simulation.counters());
    assert!(simulation.report().nodes_solved > 0 && skipped > 0, "{skipped}");
}

#[test]
fn a_shaped_tip_turns_with_the_tail_and_finds_its_way_through_the_arch() {
    let arch =
        GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), Resolution::Triangles(5_000)).unwrap();
    let sheath = Sheath::at_opening(&arch.wall, arch.inlet, 2.0).unwrap();
    let tip = Section { rest_curvature_per_mm: [0.05, 0.0], ..Section::straight(30.0, 0.445, 5.0) };
    let wire = Device::new(vec![tip, Section::straight(400.0, 0.445, 15.0)]).unwrap();
    let mut simulation =
        Simulation::builder(arch.wall, wire, sheath).method(&kirchhoff(4.0)).build().unwrap();
    let crossing = CrossingTest::new(simulation.lumen().wall(&NoStore).unwrap().mesh());
    for _ in 0..50 {
        let report =
            simulation.step(Command { advance_mm: 5.0, rotate_rad: 0.1, ..Command::default() }).unwrap();
        assert!(report.converged);
        assert!(!crossing.is_crossed_by(&simulation));
    }
    // The free tip of a wire in air would have turned with the hand: the torque is the wall's doing.
    assert!(simulation.report().torque_nmm.abs() > 1e-6);
}

#[test]
fn the_same_commands_give_the_same_bits() {
    let run = || {
        let mut simulation = in_curved_tube(1.0);
        for _ in 0..45 {
            simulation.step(Command::advance(4.0)).unwrap();
        }
        simulation.shape().clone()
    };
    assert_eq!(run(), run());
}
