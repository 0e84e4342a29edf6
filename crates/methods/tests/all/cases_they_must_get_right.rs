//! Every method on a case with an exact solution, and its order of convergence.

use std::f64::consts::FRAC_PI_2;

use endowire_core::Vec3;
use endowire_core::device::{Device, Section};
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties, WallRegion};
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};
use endowire_methods::{
    AnyMethod, BeamFem, Chain, ChordEnergy, MODEL_NAMES, RodModel, TipForce, cantilever, li2011, static_model,
};

/// Distance of the tip from `tip` under the load a.
fn tip_error(model: &dyn RodModel, n: usize, a: f64, tip: Vec3) -> f64 {
    let tolerance = 0.1 * a.min(1.0) / (n * n) as f64;
    let solution = cantilever(model, n, Vec3::new(0.0, -a, 0.0), tolerance).unwrap();
    assert!(solution.converged, "{} with {n}", model.name());
    (solution.nodes[n] - tip).norm()
}

#[test]
fn a_small_load_deflects_by_a_third_of_it() {
    for &name in MODEL_NAMES {
        let model = static_model(name).unwrap();
        let a = 0.01;
        let error = tip_error(&*model, 16, a, Vec3::new(1.0, -a / 3.0, 0.0));
        assert!(error < 0.01 * a / 3.0, "{name}: {error:e}");
    }
}

/// Exact tip at PL²/EI = 1.
fn exact() -> Vec3 {
    Vec3::new(1.0 - 0.0564332362834, -0.301720773800, 0.0)
}

#[test]
fn every_method_is_of_second_order() {
    for &name in MODEL_NAMES {
        let model = static_model(name).unwrap();
        let error = |n| tip_error(&*model, n, 1.0, exact());
        let order = (error(8) / error(16)).log2();
        assert!((1.8..2.3).contains(&order), "{name}: {order}");
    }
}

/// Distance of the tip from the exact one after so many inputs of the paper's method, with unit tangents or as printed.
fn error_of_the_papers_method(elements: usize, unit_tangents: bool) -> f64 {
    let mut chain = li2011::Chain::uniform(Vec3::zeros(), Vec3::x(), 1.0, elements, 1.0);
    let (mut nodes, mut tangents) = (Vec::new(), Vec::new());
    chain.forces_n[elements - 1] = -Vec3::y();
    if unit_tangents {
        chain.directions = vec![Vec3::x(); elements];
    }
    for _ in 0..40 {
        li2011::dense::solve(&chain, &mut nodes, &mut tangents);
        if unit_tangents {
            chain.normalise(&mut tangents, &mut nodes);
            chain.directions.clone_from(&tangents);
        }
    }
    (nodes[elements - 1] - exact()).norm()
}

#[test]
fn the_papers_method_is_of_second_order_with_unit_tangents_and_of_none_as_printed() {
    let order = |unit| (error_of_the_papers_method(8, unit) / error_of_the_papers_method(16, unit)).log2();
    assert!((1.8..2.2).contains(&order(true)), "{}", order(true));
    assert!(order(false).abs() < 0.1, "{}", order(false));
}

#[test]
fn a_large_load_is_met_by_all_but_the_undamped_beams() {
    let tip = Vec3::new(1.0 - 0.554995597754, -0.810609024880, 0.0);
    for &name in MODEL_NAMES {
        let model = static_model(name).unwrap();
        if name == "beam-fem" {
            let found = cantilever(&*model, 16, Vec3::new(0.0, -10.0, 0.0), 1e-3);
            assert!(found.map_or(true, |solution| !solution.converged), "its stiffness knows no tension");
        } else {
            let error = tip_error(&*model, 16, 10.0, tip);
            assert!(error < 0.02, "{name}: {error}");
        }
    }
}

#[test]
fn a_shape_of_its_own_is_kept_by_those_who_can() {
    let mut chain = Chain::uniform(1.0, 16, 1.0);
    chain.rest_curvature_per_mm = vec![[FRAC_PI_2, 0.0]; 16];
    let models: [&dyn RodModel; 2] = [&BeamFem::damped(), &ChordEnergy::default()];
    for model in models {
        let mut posture = chain.straight();
        let mut none = TipForce { node: 16, force_n: Vec3::zeros() };
        assert!(model.relax(&chain, &mut none, &mut posture, 1e-4).converged);
        // A quarter of a circle towards y.
        let miss = (posture.positions_mm[16] - Vec3::new(1.0, 1.0, 0.0) / FRAC_PI_2).norm();
        assert!(miss < 3e-3, "{}: {miss}", model.name());
    }
}

struct Tube {
    made: GeneratedWall,
    sheath: Sheath,
}

fn tube() -> Tube {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.5)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    Tube { made, sheath }
}

impl Tube {
    fn start(&self, name: &str, wire: Device, friction: f64) -> endowire_core::Result<Simulation> {
        self.start_on(WallProperties { friction, ..WallProperties::default() }, name, wire)
    }

    fn start_on(
        &self,
        properties: WallProperties,
        name: &str,
        wire: Device,
    ) -> endowire_core::Result<Simulation> {
        let method = match AnyMethod::named(name).unwrap() {
            exact @ AnyMethod::Kirchhoff(_) => exact,
            other => other.with_element_mm(6.0),
        };
        Simulation::builder(self.made.wall.clone(), wire, self.sheath)
            .properties(properties)
            .method(&method)
            .build()
    }
}

#[test]
fn shapes_friction_and_regions_are_refused_by_name() {
    let tube = tube();
    let bent = Section { rest_curvature_per_mm: [0.02, 0.0], ..Section::straight(30.0, 0.445, 10.0) };
    for &name in MODEL_NAMES {
        let shaped = tube.start(name, Device::new(vec![bent]).unwrap(), 0.0);
        let can = matches!(name, "beam-fem" | "beam-fem-damped" | "chord-energy");
        match shaped {
            Ok(_) => assert!(can, "{name}"),
            Err(error) => {
                assert!(!can && error.is_input(), "{name}: {error}");
                assert!(error.to_string().contains("device.section[0].rest_curvature_per_mm"), "{error}");
                assert!(error.to_string().contains(name), "{error}");
            }
        }
        let wire = Device::uniform(30.0, 0.445, 10.0).unwrap();
        let error = tube.start(name, wire.clone(), 0.1).err().unwrap();
        assert!(error.to_string().starts_with("vessel.wall.friction = 0.1"), "{error}");
        let patch = WallRegion {
            centre_mm: Some([0.0, 0.0, 50.0]),
            radius_mm: Some(10.0),
            modulus_n_per_mm2: Some(5.0),
            ..WallRegion::default()
        };
        let patched = WallProperties { region: vec![patch], ..WallProperties::default() };
        let error = tube.start_on(patched, name, wire).err().unwrap().to_string();
        assert!(error.starts_with("vessel.wall.region = 1 given") && error.contains(name), "{error}");
    }
}

#[test]
fn in_a_bend_they_come_to_where_the_exact_rod_does() {
    let tube = tube();
    let push = |name: &str| {
        let wire = Device::uniform(200.0, 0.445, 10.0).unwrap();
        let mut simulation = tube.start(name, wire, 0.0).unwrap();
        for _ in 0..24 {
            simulation.step(Command::advance(6.0)).unwrap();
        }
        (simulation.shape().tip_mm().unwrap(), simulation.report().clone())
    };
    let (exact, _) = push("kirchhoff");
    assert!(exact.x > 10.0, "the wire must have gone round the bend: {exact}");
    for name in ["rigid-links", "mass-spring", "beam-fem-damped", "discrete-rod"] {
        let (tip, report) = push(name);
        assert!(report.converged, "{name} must come to rest where it touches");
        assert!((tip - exact).norm() < 1.0, "{name}: {tip} instead of {exact}");
        assert!(!report.contacts.is_empty() && report.max_penetration_mm < 0.445, "{name}");
    }
}

#[test]
fn a_retracted_wire_is_straight_again_and_can_be_pushed_anew() {
    let tube = tube();
    let mut simulation =
        tube.start("rigid-links", Device::uniform(200.0, 0.445, 10.0).unwrap(), 0.0).unwrap();
    for mm in [60.0, -60.0, 30.0] {
        simulation.step(Command::advance(mm)).unwrap();
    }
    let tip = simulation.shape().tip_mm().unwrap();
    let straight = simulation.sheath().position_mm + simulation.sheath().direction * 30.0;
    assert!((tip - straight).norm() < 1e-9, "{tip}");
}
