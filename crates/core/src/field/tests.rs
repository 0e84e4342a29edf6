//! Fields against exact solutions, differences and the balance of energy.

use std::ops::Range;
use std::sync::Arc;

use super::{EnergyDensity, Field, FieldLoad, Magnet, MaterialPoint, Weight};
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, Move, Sheath, Simulation};
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::rod::{Assembly, ElementData, Layout, PLAIN, RodState};
use crate::solve::External;
use crate::statics::{StaticCase, StaticProblem};
use crate::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution};
use crate::{Result, Vec3};

/// An energy with every derivative: u = (a·r)² (b·r′) + (c·r′)², on a part of the rod.
#[derive(Debug)]
struct Curved;

const A: Vec3 = Vec3::new(0.3, -0.2, 0.5);
const B: Vec3 = Vec3::new(-0.4, 0.7, 0.1);
const C: Vec3 = Vec3::new(0.2, 0.6, -0.3);

impl Field for Curved {
    fn acts_on(&self, _instrument: usize) -> Range<f64> {
        0.7..3.3
    }

    fn density(&self, point: &MaterialPoint) -> EnergyDensity {
        let (r, t) = (A.dot(&point.position_mm), point.tangent);
        let (b, c) = (B.dot(&t), C.dot(&t));
        EnergyDensity {
            value: r * r * b + c * c,
            by_position: A * (2.0 * r * b),
            by_tangent: B * (r * r) + C * (2.0 * c),
            by_positions: A * A.transpose() * (2.0 * b),
            by_position_and_tangent: A * B.transpose() * (2.0 * r),
            by_tangents: C * C.transpose() * 2.0,
        }
    }
}

/// A rod of five elements that is bent out of the plane.
fn bent() -> (Vec<ElementData>, RodState, Vec<f64>) {
    let case = r#"{"rod": {"length": 5.0, "elements": 5, "section": [{"until": 5.0, "EI": 1.0}]},
        "start": {"type": "clamped"}, "end": {"type": "free"}, "initial": {"curvature": [0.2, 0.1]}}"#;
    let case: StaticCase = serde_json::from_str(case).expect("a case");
    let problem = StaticProblem::new(&case).expect("a problem");
    (problem.elements.clone(), problem.initial.clone(), (0..=5).rev().map(f64::from).collect())
}

#[test]
fn derivatives_are_those_of_the_energy() {
    let (elements, base, from_tip) = bent();
    let mut load = FieldLoad::new([(&Curved as &dyn Field, 0.8)], &from_tip, &[]);
    let mut assembly = Assembly::<PLAIN>::new(elements.len());
    load.linearise(&elements, &base, &mut assembly);
    let l = Layout::<PLAIN>;
    let rows: Vec<usize> = (1..=elements.len())
        .flat_map(|i| (0..5).map(move |a| if a < 3 { l.position(i) + a } else { l.tangent(i) + a - 3 }))
        .collect();
    let moved = |way: &[f64], h: f64| {
        let mut to = base.clone();
        for (i, w) in way.chunks_exact(5).enumerate() {
            to.positions[i + 1] += Vec3::new(w[0], w[1], w[2]) * h;
            to.frames[i + 1] = base.frames[i + 1].transported(h * w[3], h * w[4]);
        }
        load.energy_mj(&elements, &to)
    };
    let here = load.energy_mj(&elements, &base);
    assert!(here.abs() > 0.1 && assembly.external_energy == here, "{here}");
    for seed in 0..6 {
        let way: Vec<f64> = (0..rows.len()).map(|k| (1.7 * f64::from(seed) + 2.3 * k as f64).sin()).collect();
        let (plus, minus) = (moved(&way, 1e-4), moved(&way, -1e-4));
        let slope: f64 = rows.iter().zip(&way).map(|(row, w)| assembly.residual[*row] * w).sum();
        let found = (plus - minus) / 2e-4;
        assert!((found - slope).abs() < 1e-6 * (1.0 + slope.abs()), "direction {seed}: {found} and {slope}");
        let each =
            rows.iter().zip(&way).flat_map(|(i, w)| rows.iter().zip(&way).map(move |(j, v)| (*i, *j, w * v)));
        let near =
            each.filter(|(i, j, _)| (i / Layout::<PLAIN>::BLOCK).abs_diff(j / Layout::<PLAIN>::BLOCK) <= 1);
        let curve: f64 = near.map(|(i, j, by)| by * assembly.matrix.get(i, j)).sum();
        let found = (plus + minus - 2.0 * here) / 1e-8;
        assert!((found - curve).abs() < 1e-4 * (1.0 + curve.abs()), "direction {seed}: {found} and {curve}");
    }
}

/// A wide straight tube along z, with room for everything.
fn simulation(stack: impl Into<Stack>, element_mm: f64) -> Simulation {
    let node = |z: f64, parent| CentrelineNode { position_mm: Vec3::z() * z, radius_mm: 60.0, parent };
    let nodes = (0..=8).map(|k: usize| node(25.0 * k as f64, k.checked_sub(1))).collect();
    let tree = CentrelineTree::new(nodes).unwrap();
    let wall = GeneratedWall::new(&tree, Resolution::EdgeMm(20.0)).unwrap().wall;
    let method = KirchhoffOptions { element_mm, tolerance: 1e-10, ..KirchhoffOptions::default() };
    let sheath = Sheath::new(Vec3::z() * 20.0, Vec3::z()).unwrap();
    Simulation::builder(wall, stack, sheath).method(&method).build().unwrap()
}

const STIFFNESS: f64 = 10.0;
const MAGNET_MM: f64 = 5.0;

/// A wire with a magnet of 5 mm at its tip, across a field along x.
fn magnetic(field_t: f64) -> Arc<dyn Field> {
    Arc::new(Magnet::new(0, 0.0..MAGNET_MM, 4.3e-3, Vec3::x() * field_t).unwrap())
}

/// Turn of the tip of a wire of so many mm: EI θ″ = −(m B/l) cos θ along the magnet and 0 behind it, by shooting from the tip.
fn exact_turn(length_mm: f64, field_t: f64) -> f64 {
    let couple = 4.3 * field_t / MAGNET_MM / STIFFNESS;
    let at_the_sheath = |tip: f64| {
        let (mut turn, mut rate) = (tip, 0.0);
        let steps = 2000;
        let h = MAGNET_MM / f64::from(steps);
        for _ in 0..steps {
            // The midpoint rule, towards the sheath.
            let middle = turn - 0.5 * h * rate;
            let middle_rate = rate + 0.5 * h * couple * libm::cos(turn);
            turn -= h * middle_rate;
            rate += h * couple * libm::cos(middle);
        }
        turn - (length_mm - MAGNET_MM) * rate
    };
    let (mut low, mut high) = (0.0, 0.5 * std::f64::consts::PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_the_sheath(middle) > 0.0 { high = middle } else { low = middle }
    }
    low
}

#[test]
fn a_magnet_at_the_tip_bends_a_wire_as_the_elastica() {
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 1.0);
    wire.step(Command::advance(40.0)).unwrap();
    for field_t in [0.02, 0.05, 0.2] {
        wire.set_fields([magnetic(field_t)]).unwrap();
        let report = wire.step(Command::default()).unwrap();
        assert!(report.converged && !report.jumped && report.dissipated_mj == 0.0, "{report:?}");
        // No force acts, and what is bent wants out of the sheath: −½ EI κ².
        let turn = exact_turn(40.0, field_t);
        let tangent = *wire.shape().tangents.last().unwrap();
        let found = libm::atan2(tangent.x, tangent.z);
        assert!((found - turn).abs() < 1e-5 && turn > 0.2, "{field_t}: {found} and {turn}");
    }
    wire.set_fields([]).unwrap();
    wire.step(Command::default()).unwrap();
    assert!(wire.tip_of_mm(0).unwrap().x.abs() < 1e-6 && wire.report().energy.field == 0.0);
}

#[test]
fn weight_bends_a_wire_as_a_cantilever() {
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 2.0);
    wire.step(Command::advance(40.0)).unwrap();
    let weight_n_per_mm = 1e-6;
    wire.set_fields([Arc::new(Weight::new(0, -Vec3::x() * weight_n_per_mm).unwrap()) as Arc<dyn Field>])
        .unwrap();
    wire.step(Command::default()).unwrap();
    let expected = weight_n_per_mm * 40f64.powi(4) / (8.0 * STIFFNESS);
    let sunk = -wire.tip_of_mm(0).unwrap().x;
    assert!((sunk / expected - 1.0).abs() < 1e-4, "{sunk} {expected}");
}

fn energy_mj(simulation: &Simulation) -> f64 {
    simulation.report().energy.total()
}

#[test]
fn the_hand_feels_the_slope_of_all_energy() {
    let fields =
        || [magnetic(0.05), Arc::new(Weight::new(0, Vec3::new(-1e-4, 0.0, 5e-5)).unwrap()) as Arc<dyn Field>];
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 1.0);
    wire.set_fields(fields()).unwrap();
    wire.step(Command::advance(40.0)).unwrap();
    let report = wire.report();
    assert!(report.energy.field < -0.01 && report.push_force_n < -1e-3, "{report:?}");
    let (before, push) = (energy_mj(&wire), report.push_force_n);
    wire.step(Command::advance(0.02)).unwrap();
    let mean = 0.5 * (push + wire.report().push_force_n);
    let slope = (energy_mj(&wire) - before) / 0.02;
    assert!((slope / mean - 1.0).abs() < 2e-4, "{slope} {mean}");
}

#[test]
fn each_of_two_hands_feels_the_slope_of_all_energy() {
    let named = |name: &str, inner: Option<f64>, radius_mm: f64| {
        let length_mm = if inner.is_none() { 150.0 } else { 100.0 };
        let section =
            Section { inner_radius_mm: inner, ..Section::straight(length_mm, radius_mm, STIFFNESS) };
        Instrument { name: name.to_owned(), device: Device::new(vec![section]).unwrap(), may_lead: true }
    };
    let stack = Stack::new(vec![named("wire", None, 0.3), named("catheter", Some(0.4), 0.6)]).unwrap();
    let mut both = simulation(stack, 1.0);
    let on_both: [Arc<dyn Field>; 3] = [
        magnetic(0.05),
        Arc::new(Weight::new(0, Vec3::y() * 1e-4).unwrap()),
        Arc::new(Weight::new(1, Vec3::new(0.0, 3e-4, -1e-4)).unwrap()),
    ];
    both.set_fields(on_both).unwrap();
    let advance = |instrument, mm| Move { instrument, command: Command::advance(mm) };
    both.step_together(&[advance(0, 40.0), advance(1, 25.5)]).unwrap();
    for index in 0..2 {
        let felt = |both: &Simulation| both.report().instruments[index].push_force_n.unwrap();
        let (before, push) = (energy_mj(&both), felt(&both));
        both.step_together(&[advance(index, 0.02)]).unwrap();
        let (slope, mean) = ((energy_mj(&both) - before) / 0.02, 0.5 * (push + felt(&both)));
        assert!((slope - mean).abs() < 2e-3 * mean.abs() && mean.abs() > 1e-3, "{index}: {slope} {mean}");
    }
}

#[test]
fn a_field_that_turns_is_followed_in_steps_and_in_ticks() {
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 2.0);
    wire.step(Command::advance(40.0)).unwrap();
    let (mut ticks, mut whole) = (wire.clone(), wire.clone());
    let turned = |angle: f64| {
        let field_t = Vec3::new(libm::cos(angle), libm::sin(angle), 0.0) * 0.05;
        [Arc::new(Magnet::new(0, 0.0..MAGNET_MM, 4.3e-3, field_t).unwrap()) as Arc<dyn Field>]
    };
    for k in 0..12 {
        let angle = 0.5 * f64::from(k);
        wire.set_fields(turned(angle)).unwrap();
        let report = wire.step(Command::default()).unwrap();
        assert!(report.converged && !report.jumped, "{k}: {report:?}");
        // With enough solves a tick goes through the change in the same parts.
        whole.set_fields(turned(angle)).unwrap();
        let in_one = whole.tick(&[], 500, None).unwrap();
        assert!(in_one.converged && in_one.relaxations == 0, "{k}: {in_one:?}");
        ticks.set_fields(turned(angle)).unwrap();
        ticks.tick(&[], 2, None).unwrap();
        while ticks.report().is_under_way() {
            ticks.tick(&[], 2, None).unwrap();
        }
        let (tip, other) = (wire.tip_of_mm(0).unwrap(), ticks.tip_of_mm(0).unwrap());
        assert!((tip - other).norm() < 1e-5, "{k}: {tip} {other}");
        assert!((tip - whole.tip_of_mm(0).unwrap()).norm() < 1e-5, "{k}");
        let way = libm::atan2(tip.y, tip.x) - libm::atan2(libm::sin(angle), libm::cos(angle));
        assert!(way.abs() < 1e-6 && tip.xy().norm() > 5.0, "{k}: {way}");
    }
    // What has been restored is in the fields that are there, and nothing moves.
    let state = wire.state();
    ticks.restore(&state).unwrap();
    let before = ticks.tip_of_mm(0).unwrap();
    ticks.step(Command::default()).unwrap();
    assert_eq!(before, ticks.tip_of_mm(0).unwrap());
}

#[test]
fn a_field_that_turns_while_the_hand_moves_is_followed_in_ticks_with_enough_solves() {
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 2.0);
    wire.step(Command::advance(40.0)).unwrap();
    let mut ticks = wire.clone();
    let command = Command { advance_mm: 0.2, rotate_rad: 0.02, ..Command::default() };
    for k in 0..20 {
        let angle = 0.9 * f64::from(k);
        let field_t = Vec3::new(libm::cos(angle), libm::sin(angle), 0.0) * 0.01 * f64::from(k);
        let field = [Arc::new(Magnet::new(0, 0.0..MAGNET_MM, 4.3e-3, field_t).unwrap()) as Arc<dyn Field>];
        for each in [&mut wire, &mut ticks] {
            each.set_fields(field.clone()).unwrap();
        }
        let relaxations = wire.step(command).unwrap().relaxations;
        let report = ticks.tick(&[Move { instrument: 0, command }], 2000, None).unwrap();
        assert!(report.converged && report.behind.is_empty(), "{k}: {report:?}");
        assert!(report.relaxations <= relaxations, "{k}: {} for {relaxations}", report.relaxations);
        let (tip, other) = (wire.tip_of_mm(0).unwrap(), ticks.tip_of_mm(0).unwrap());
        assert!((tip - other).norm() < 1e-4, "{k}: {tip} {other}");
    }
}

#[test]
fn what_cannot_be_a_magnet_or_a_weight_is_refused() {
    let refused = |magnet: Result<Magnet>| magnet.unwrap_err().to_string();
    let field = Vec3::x();
    assert!(refused(Magnet::new(0, 3.0..2.0, 1e-3, field)).contains("magnet.start_mm = 3"));
    assert!(refused(Magnet::new(0, 0.0..f64::NAN, 1e-3, field)).contains("magnet.end_mm"));
    assert!(refused(Magnet::new(0, 0.0..2.0, f64::NAN, field)).contains("magnet.moment_am2"));
    assert!(refused(Magnet::new(0, 0.0..2.0, 1e-3, field * 100.0)).contains("magnet.field_t = 100"));
    assert!(
        Weight::new(0, Vec3::x() * f64::INFINITY).unwrap_err().to_string().contains("weight.force_n_per_mm")
    );
}

#[test]
fn fields_are_made_again_from_their_numbers() {
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 2.0);
    let fields = || {
        let magnet = Magnet::new(0, 0.5..MAGNET_MM, 4.3e-3, Vec3::new(0.01, 0.02, -0.03)).unwrap();
        let weight = Weight::new(0, Vec3::new(0.0, 1e-6, -1e-5)).unwrap();
        [Arc::new(magnet) as Arc<dyn Field>, Arc::new(weight)]
    };
    wire.set_fields(fields()).unwrap();
    let [before, now] = wire.fields();
    assert!(before.is_empty() && now.len() == 2);
    let again: Vec<_> = now.iter().map(|field| field.spec().unwrap().field().unwrap()).collect();
    assert_eq!(format!("{again:?}"), format!("{now:?}"));
    wire.step(Command::advance(10.0)).unwrap();
    assert_eq!(wire.fields().map(<[_]>::len), [2, 2]);
    assert!(Curved.spec().is_none());
}

#[test]
fn a_field_beyond_the_instruments_is_refused_by_key() {
    let mut wire = simulation(Device::uniform(100.0, 0.3, STIFFNESS).unwrap(), 2.0);
    let refused =
        |wire: &mut Simulation, field: Arc<dyn Field>| wire.set_fields([field]).unwrap_err().to_string();
    let long = refused(&mut wire, Arc::new(Magnet::new(0, 0.0..100.1, 4.3e-3, Vec3::x()).unwrap()));
    assert_eq!(long, "field[0].end_mm = 100.1: must be within the instrument, 100 mm");
    let other = refused(&mut wire, Arc::new(Weight::new(3, -Vec3::x() * 1e-5).unwrap()));
    assert_eq!(other, "field[0].instrument = 3: there are 1, the innermost is 0");
    wire.set_fields([Arc::new(Magnet::new(0, 0.0..100.0, 4.3e-3, Vec3::x()).unwrap()) as Arc<dyn Field>])
        .unwrap();
}
