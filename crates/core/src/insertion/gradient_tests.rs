//! Gradients against central differences of whole commands, from the same state.

use std::sync::Arc;
use std::time::Instant;

use super::{Command, Move, Sheath, Simulation, WallProperties};
use crate::Vec3;
use crate::device::{Device, Instrument, Section, Stack};
use crate::field::{Field, Magnet, Weight};
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::methods::{Gradient, Parameter};
use crate::random::{splitmix64, unit};
use crate::vessel::motion::{Around, MotionMode, VesselMotion, Waveform};
use crate::vessel::{Lumen, Resolution, SweptVessel, anatomy};

/// Tolerance of equilibria, so small that differences of them have six digits.
const TOLERANCE: f64 = 1e-11;

fn wire(sections: [Section; 2]) -> Device {
    Device::new(sections.to_vec()).unwrap()
}

/// A hooked wire, or that in a bent catheter.
fn stack(several: bool) -> Stack {
    let bent = |section: Section, length_mm: f64, curvature: f64| Section {
        length_mm,
        rest_curvature_per_mm: [curvature, 0.3 * curvature],
        ..section
    };
    let inner = Section::straight(330.0, 0.2, 5.0);
    let hooked = wire([bent(inner, 15.0, 0.06), Section { bending_stiffness_nmm2: 12.0, ..inner }]);
    if !several {
        return hooked.into();
    }
    let outer = Section { inner_radius_mm: Some(0.5), ..Section::straight(250.0, 0.8, 40.0) };
    let catheter = wire([bent(outer, 30.0, 0.02), outer]);
    let named = |name: &str, device: Device| Instrument { name: name.to_owned(), device, may_lead: true };
    Stack::new(vec![named("wire", hooked), named("catheter", catheter)]).unwrap()
}

/// A vessel with instruments.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene {
    tree: &'static str,
    several: bool,
    pub(super) friction: f64,
    /// Whether the vessel moves, by a step in a tenth of a second.
    moves: bool,
}

const TUBE: Scene = Scene { tree: "curved_tube", several: false, friction: 0.0, moves: false };

/// 6 mm aside and back in 4 s, but still at the sheath.
fn breathing(sheath: &Sheath) -> MotionMode {
    MotionMode {
        waveform: Waveform::Breathing,
        period_s: Some(4.0),
        phase: 0.0,
        displacement_mm: [-3.0, 4.0, 3.0],
        turn: None,
        still: Some(Around { centre_mm: sheath.position_mm.into(), radius_mm: 20.0, fade_mm: 60.0 }),
        within: None,
    }
}

pub(super) fn simulation(scene: Scene) -> Simulation {
    let Scene { tree, several, friction, moves } = scene;
    let tree = anatomy::tree(tree).unwrap();
    let vessel = SweptVessel::new(tree, Resolution::EdgeMm(1.0)).unwrap();
    let inlet = vessel.inlet();
    let lumen = Lumen::from(vessel);
    let sheath = Sheath::at_opening(&lumen, inlet, 1.0).unwrap();
    let properties = WallProperties { friction, ..WallProperties::default() };
    let mut options =
        KirchhoffOptions { tolerance: TOLERANCE, element_mm: 4.0, ..KirchhoffOptions::default() };
    // As exact and as smooth as differences need it: usually friction is settled to thousandths, and sticks within thousandths of the motion.
    (options.tuning.friction.settled, options.tuning.friction.stick) = (1e-10, 0.05);
    let modes: Vec<MotionMode> = moves.then(|| breathing(&sheath)).into_iter().collect();
    let mut simulation = Simulation::builder(lumen, stack(several), sheath)
        .properties(properties)
        .motion(VesselMotion::new(&modes).unwrap())
        .method(&options)
        .build()
        .unwrap();
    // A tip that weighs something, in a magnet.
    let magnet = Magnet::new(0, 0.0..6.0, 2e-4, Vec3::new(0.03, -0.02, 0.01)).unwrap();
    let weight = Weight::new(0, Vec3::new(1e-5, 0.0, -2e-5)).unwrap();
    let fields: [Arc<dyn Field>; 2] = [Arc::new(magnet), Arc::new(weight)];
    simulation.set_fields(fields).unwrap();
    simulation
}

/// The time after the next command.
pub(super) fn then_s(simulation: &Simulation) -> f64 {
    if simulation.displacement().is_some() { simulation.time_s() + 0.1 } else { simulation.time_s() }
}

/// What a command leads to where a parameter is larger.
fn led_to(simulation: &Simulation, moves: &[Move], parameter: Parameter, by: f64) -> (Vec<f64>, Vec<usize>) {
    let mut moves = moves.to_vec();
    for one in &mut moves {
        let Command { advance_mm, rotate_rad, .. } = &mut one.command;
        match parameter {
            Parameter::Advance { instrument } if instrument == one.instrument => *advance_mm += by,
            Parameter::Rotation { instrument } if instrument == one.instrument => *rotate_rad += by,
            _ => {}
        }
    }
    let mut there = match simulation.value(&parameter).unwrap() {
        Some(value) => simulation.changed(&[(parameter, value + by)]).unwrap(),
        None => simulation.clone(),
    };
    let time_s = then_s(&there);
    let report = there.step_until(&moves, Some(time_s)).unwrap().clone();
    assert!(report.converged && !report.jumped);
    let mut values: Vec<f64> = there.shape().tip_mm().unwrap().iter().copied().collect();
    values.extend(
        report.instruments.iter().flat_map(|hand| [hand.push_force_n.unwrap_or(0.0), hand.torque_nmm]),
    );
    values.extend([report.energy.total()]);
    (values, vec![report.contacts.len(), report.substeps as usize])
}

/// The same of a gradient.
fn slopes(gradient: &Gradient, k: usize) -> Vec<f64> {
    let slope = &gradient.slopes[k];
    let mut values: Vec<f64> = slope.tip_mm.iter().copied().collect();
    let forces = slope.push_force_n.iter().zip(&slope.torque_nmm);
    values.extend(forces.flat_map(|(push_n, torque_nmm)| [push_n.unwrap_or(0.0), *torque_nmm]));
    values.extend([slope.energy_mj]);
    values
}

/// All parameters of instruments with two sections each.
pub(super) fn parameters(instruments: usize, friction: f64) -> Vec<Parameter> {
    let mut by = vec![Parameter::WallModulus];
    for axis in 0..3 {
        by.extend([Parameter::EntryPosition { axis }, Parameter::EntryDirection { axis }]);
        by.extend([0, 1].map(|field| Parameter::Field { field, axis }));
    }
    if friction > 0.0 {
        by.push(Parameter::WallFriction);
    }
    for instrument in 0..instruments {
        by.extend([Parameter::Advance { instrument }, Parameter::Rotation { instrument }]);
        for section in 0..2 {
            by.extend([
                Parameter::BendingStiffness { instrument, section },
                Parameter::TorsionalStiffness { instrument, section },
                Parameter::RestCurvature { instrument, section, direction: 0 },
                Parameter::RestCurvature { instrument, section, direction: 1 },
                Parameter::Radius { instrument, section },
            ]);
        }
    }
    by
}

/// Half of the difference that is taken of whole commands.
pub(super) fn half(parameter: Parameter) -> f64 {
    match parameter {
        Parameter::RestCurvature { .. } => 5e-7,
        Parameter::BendingStiffness { .. } => 1e-3,
        Parameter::TorsionalStiffness { .. } => 5e-3,
        Parameter::Advance { .. } | Parameter::EntryPosition { .. } => 2e-5,
        Parameter::Radius { .. } => 5e-6,
        Parameter::EntryDirection { .. } => 1e-6,
        Parameter::Field { field: 1, .. } => 1e-6,
        _ => 5e-5,
    }
}

/// Numbers that look random.
pub(super) struct Numbers(pub(super) u64);

/// Gradients against differences.
#[derive(Default)]
struct Compared {
    /// Ascending.
    errors: Vec<f64>,
    /// Those that were not compared, since contacts or parts of whole commands change within the difference.
    others: usize,
    states: usize,
    /// Time of the gradients and of steps without them, s, and how many derivatives there were.
    gradients_s: f64,
    steps_s: f64,
    count: usize,
}

impl Compared {
    /// The error that this part of all does not exceed.
    fn at(&self, part: f64) -> f64 {
        self.errors[(part * (self.errors.len() - 1) as f64) as usize]
    }

    fn sort(&mut self) {
        self.errors.sort_by(f64::total_cmp);
    }
}

impl std::fmt::Display for Compared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [half, most, nearly_all, all] = [0.5, 0.9, 0.99, 1.0].map(|part| self.at(part));
        let (count, others, states) = (self.errors.len(), self.others, self.states);
        let cost = self.gradients_s / self.steps_s / (self.count as f64 / states as f64);
        write!(
            f,
            "{count} derivatives in {states} states, {others} not compared: errors 50 % {half:.1e}, 90 % {most:.1e}, 99 % \
             {nearly_all:.1e}, largest {all:.1e}; a derivative costs {cost:.2} steps"
        )
    }
}

impl Numbers {
    /// The next one, between these two.
    pub(super) fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        self.0 += 1;
        low + (high - low) * unit(splitmix64(7, self.0))
    }

    pub(super) fn moves(&mut self, hands: usize) -> Vec<Move> {
        let each = (0..hands).map(|instrument| {
            let advance_mm = self.between([1.0, 3.0]) - 0.3 * instrument as f64;
            let rotate_rad = self.between([-0.2, 0.2]);
            Move { instrument, command: Command { advance_mm, rotate_rad, ..Command::default() } }
        });
        each.collect()
    }
}

/// Carries out commands.
fn run(simulation: &mut Simulation, commands: &[Vec<Move>]) {
    for moves in commands {
        simulation.step_together(moves).unwrap();
    }
}

/// Adds errors of gradients after random commands, relative to how results change if a parameter doubles.
fn compare(mut now: Simulation, (steps, friction, seed): (usize, f64, u64), compared: &mut Compared) {
    let hands = now.stack().instruments().len();
    let mut by = parameters(hands, friction);
    // What is changed along the sheath is not changed at all.
    let along = now.sheath().direction;
    by.retain(
        |parameter| !matches!(*parameter, Parameter::EntryDirection { axis } if along[axis].abs() > 0.9),
    );
    let mut numbers = Numbers(seed);
    for k in 0..steps {
        let moves = numbers.moves(hands);
        if k > 8 && k % 3 == 0 {
            let time_s = then_s(&now);
            let began = Instant::now();
            let gradient =
                now.gradients_until(std::slice::from_ref(&moves), &[time_s], &by).unwrap().remove(0);
            compared.gradients_s += began.elapsed().as_secs_f64();
            let mut alone = now.clone();
            let began = Instant::now();
            alone.step_until(&moves, Some(time_s)).unwrap();
            compared.steps_s += began.elapsed().as_secs_f64();
            (compared.count, compared.states) = (compared.count + by.len(), compared.states + 1);
            let counts = [gradient.report.contacts.len(), gradient.report.substeps as usize];
            for (k, parameter) in by.iter().enumerate() {
                let h = half(*parameter);
                // Two central differences, and what both lead to without their errors of the second order.
                let led = [-h, -0.5 * h, 0.5 * h, h].map(|by| led_to(&now, &moves, *parameter, by));
                if led.iter().any(|(_, there)| *there != counts) || gradient.slopes[k].one_sided {
                    compared.others += 1;
                    continue;
                }
                let value = now.value(parameter).unwrap().map_or(1.0, |value| value.abs().max(1e-3));
                let differences = (0..led[0].0.len()).map(|i| {
                    let [far, near] =
                        [(0, 3, 2.0 * h), (1, 2, h)].map(|(a, b, by)| (led[b].0[i] - led[a].0[i]) / by);
                    (4.0 * near - far) / 3.0
                });
                let size =
                    |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>().sqrt() * value;
                let whole = size(&mut differences.clone());
                let off = size(&mut differences.clone().zip(slopes(&gradient, k)).map(|(a, b)| a - b));
                compared.errors.push(off / whole.max(1e-2));
            }
        }
        let time_s = then_s(&now);
        now.step_until(&moves, Some(time_s)).unwrap();
    }
    compared.sort();
}

/// Largest error of nine of ten derivatives, and of all, where nothing rubs; and with friction, where the way of Newton's steps turns the
/// triads from which spin is measured (`held_tests` has them as they are).
const SMOOTH: [f64; 2] = [2e-6, 2e-5];
const RUBBED: [f64; 2] = [1e-4, 5e-4];

/// Scenes without friction, with it, with two instruments, and in a vessel that moves.
pub(super) const SCENES: [Scene; 5] = [
    TUBE,
    Scene { tree: "aortic_arch", several: true, ..TUBE },
    Scene { friction: 0.2, ..TUBE },
    Scene { several: true, friction: 0.2, ..TUBE },
    Scene { moves: true, friction: 0.2, ..TUBE },
];

#[test]
fn gradients_are_limits_of_differences() {
    for scene in SCENES {
        let mut compared = Compared::default();
        compare(simulation(scene), (18, scene.friction, 0), &mut compared);
        println!("{scene:?}: {compared}");
        let most = if scene.friction > 0.0 { RUBBED } else { SMOOTH };
        assert!(compared.at(0.9) < most[0] && compared.at(1.0) < most[1], "{scene:?}: {compared}");
        assert!(compared.others < compared.errors.len() / 4, "{scene:?}: {compared}");
    }
}

/// `cargo test -p endowire-core --lib two_hundred_states -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes: measures"]
fn gradients_in_two_hundred_states() {
    let mut all = Compared::default();
    for scene in SCENES {
        let mut compared = Compared::default();
        for seed in 0..10 {
            compare(simulation(scene), (21, scene.friction, 1000 * seed), &mut compared);
        }
        println!("{scene:?}: {compared}");
        all.errors.extend(&compared.errors);
        (all.others, all.states) = (all.others + compared.others, all.states + compared.states);
        (all.gradients_s, all.steps_s) =
            (all.gradients_s + compared.gradients_s, all.steps_s + compared.steps_s);
        all.count += compared.count;
    }
    all.sort();
    println!("all: {all}");
    assert!(all.states >= 200 && all.at(0.9) < RUBBED[0], "{all}");
}

#[test]
fn in_a_vessel_that_moves_derivatives_are_those_of_its_motion() {
    let mut now = simulation(SCENES[4]);
    let mut numbers = Numbers(7);
    for _ in 0..14 {
        let time_s = then_s(&now);
        now.step_until(&numbers.moves(1), Some(time_s)).unwrap();
    }
    let commands: Vec<Vec<Move>> = (0..3).map(|_| numbers.moves(1)).collect();
    let times_s: Vec<f64> = (1..4).map(|k| now.time_s() + 0.1 * f64::from(k)).collect();
    let parameter = Parameter::BendingStiffness { instrument: 0, section: 0 };
    let value = now.value(&parameter).unwrap().unwrap();
    let tip = |by: f64| {
        let mut there = now.changed(&[(parameter, value + by)]).unwrap();
        for (moves, time_s) in commands.iter().zip(&times_s) {
            there.step_until(moves, Some(*time_s)).unwrap();
        }
        there.shape().tip_mm().unwrap()
    };
    let h = half(parameter);
    let difference = (tip(h) - tip(-h)) / (2.0 * h);
    let last = |gradients: Vec<Gradient>| gradients[2].slopes[0].tip_mm;
    let off = |slope: Vec3| (slope - difference).norm() / difference.norm();
    let moving = off(last(now.gradients_until(&commands, &times_s, &[parameter]).unwrap()));
    // In one that stands still they are other ones.
    let still = off(last(now.gradients(&commands, &[parameter]).unwrap()));
    println!("{moving:.1e} {still:.1e}");
    assert!(moving < RUBBED[0] && still > 0.02, "{moving} {still}");
    let refused =
        |times_s: &[f64]| now.gradients_until(&commands, times_s, &[parameter]).unwrap_err().to_string();
    assert!(refused(&times_s[..2]).contains("3 commands"));
    assert!(refused(&[times_s[0], times_s[2], times_s[1]]).contains("in their order"));
}

#[test]
fn a_change_of_several_parameters_has_the_sum_of_their_derivatives() {
    let mut now = simulation(SCENES[2]);
    let mut numbers = Numbers(50);
    for _ in 0..12 {
        now.step_together(&numbers.moves(1)).unwrap();
    }
    let commands: Vec<Vec<Move>> = (0..2).map(|_| numbers.moves(1)).collect();
    let along = [
        (Parameter::RestCurvature { instrument: 0, section: 0, direction: 0 }, -2e-3),
        (Parameter::BendingStiffness { instrument: 0, section: 1 }, 0.5),
        (Parameter::Radius { instrument: 0, section: 0 }, 0.01),
        (Parameter::Rotation { instrument: 0 }, 0.1),
    ];
    let by = along.map(|(parameter, _)| parameter);
    let each = &now.gradients(&commands, &by).unwrap()[1];
    let slopes = each.slopes.iter().map(|slope| slope.tip_mm);
    let sum: Vec3 = slopes.zip(&along).map(|(slope, (_, weight))| slope * *weight).sum();
    let still = [now.time_s(); 2];
    let together = now.jvp(&commands, &still, &along).unwrap()[1].slopes[0].tip_mm;
    assert!((together - sum).norm() < 1e-6 * sum.norm(), "{together:?} {sum:?}");
    // Without one of them it is another one.
    let fewer = now.jvp(&commands, &still, &along[..3]).unwrap()[1].slopes[0].tip_mm;
    assert!((fewer - sum).norm() > 1e-3 * sum.norm(), "{fewer:?}");
    let none = now.jvp(&commands, &still, &[(by[0], 0.0)]).unwrap_err().to_string();
    assert!(none.contains("not all zero"), "{none}");
}

#[test]
fn friction_remembers_over_commands() {
    let mut now = simulation(Scene { friction: 0.2, ..TUBE });
    let mut numbers = Numbers(100);
    for _ in 0..14 {
        now.step_together(&numbers.moves(1)).unwrap();
    }
    let commands: Vec<Vec<Move>> = (0..4).map(|_| numbers.moves(1)).collect();
    let by = [
        Parameter::Rotation { instrument: 0 },
        Parameter::BendingStiffness { instrument: 0, section: 0 },
        Parameter::WallFriction,
    ];
    let gradients = now.gradients(&commands, &by).unwrap();
    assert_eq!(gradients.len(), 4);
    for (k, parameter) in by.iter().enumerate() {
        let h = half(*parameter);
        let tip = |by: f64| {
            let mut there = match now.value(parameter).unwrap() {
                Some(value) => now.changed(&[(*parameter, value + by)]).unwrap(),
                None => now.clone(),
            };
            let mut first = commands[0].clone();
            if let Parameter::Rotation { .. } = parameter {
                first[0].command.rotate_rad += by;
            }
            there.step_together(&first).unwrap();
            run(&mut there, &commands[1..]);
            there.shape().tip_mm().unwrap()
        };
        let difference = (tip(h) - tip(-h)) / (2.0 * h);
        let off = (gradients[3].slopes[k].tip_mm - difference).norm() / difference.norm();
        assert!(off < 1e-3, "{parameter:?}: {off} {difference:?}");
        // From where the last command begins, without what was before, it is another one.
        if *parameter == Parameter::WallFriction {
            let mut last = now.clone();
            run(&mut last, &commands[..3]);
            let alone = last.gradients(&commands[3..], &by).unwrap()[0].slopes[k].tip_mm;
            println!("{parameter:?}: {:.1e} {:.1e}", off, (alone - difference).norm() / difference.norm());
            assert!((alone - difference).norm() > 0.02 * difference.norm(), "{alone:?} {difference:?}");
        }
    }
    // The report is that of the commands.
    run(&mut now, &commands);
    assert_eq!(&gradients[3].report, now.report());
    assert_eq!(gradients[3].shape.positions_mm, now.shape().positions_mm);
}

#[test]
fn what_has_no_gradient_is_refused() {
    let mut now = simulation(TUBE);
    let advance = |advance_mm: f64| vec![Move { instrument: 0, command: Command::advance(advance_mm) }];
    let by = [Parameter::Advance { instrument: 0 }];
    let refused = |now: &Simulation, commands: &[Vec<Move>], by: &[Parameter]| {
        now.gradients(commands, by).unwrap_err().to_string()
    };
    // From outside the body too.
    assert!(now.gradients(&[advance(10.0)], &by).unwrap()[0].slopes[0].tip_mm.norm() > 0.9);
    now.step_together(&advance(30.0)).unwrap();
    assert!(refused(&now, &[advance(0.0)], &by).contains("moves"));
    assert!(refused(&now, &[advance(-30.0)], &by).contains("nothing is in"));
    assert!(refused(&now, &[advance(2.0), advance(900.0)], &by).contains("device"));
    let none = [Parameter::BendingStiffness { instrument: 0, section: 9 }];
    assert!(refused(&now, &[advance(2.0)], &none).contains("2 sections"));
    assert!(refused(&now, &[advance(2.0)], &[Parameter::WallFriction]).contains("friction above 0"));
    assert!(refused(&now, &[advance(2.0)], &[Parameter::Steering { instrument: 0 }]).contains("steered"));
    assert!(refused(&now, &[advance(2.0)], &[Parameter::Field { field: 2, axis: 0 }]).contains("2 fields"));
    assert!(refused(&now, &[advance(2.0)], &[Parameter::EntryPosition { axis: 3 }]).contains("axis"));
    let changed =
        |parameter: Parameter, value: f64| now.changed(&[(parameter, value)]).err().unwrap().to_string();
    assert!(changed(by[0], 1.0).contains("command"));
    assert!(changed(Parameter::WallModulus, -1.0).contains("modulus"));
    assert!(changed(Parameter::BendingStiffness { instrument: 0, section: 0 }, f64::NAN).contains("bending"));
    assert!(changed(Parameter::Radius { instrument: 0, section: 0 }, 0.3).contains("thicker"));
    assert!(changed(Parameter::EntryPosition { axis: 0 }, 1e3).contains("outside the vessel"));
    assert!(changed(Parameter::EntryDirection { axis: 2 }, -5.0).contains("backwards"));
    // Whatever their order, components of a direction are those of one vector.
    let turned = [(Parameter::EntryDirection { axis: 0 }, 0.1), (Parameter::EntryDirection { axis: 1 }, 0.2)];
    let both =
        [turned, [turned[1], turned[0]]].map(|turned| now.changed(&turned).unwrap().sheath().direction);
    let mut along = now.sheath().direction;
    (along.x, along.y) = (0.1, 0.2);
    assert!(both[0] == both[1] && (both[0] - along.normalize()).norm() < 1e-15, "{both:?}");
    let there = now.changed(&[(Parameter::EntryDirection { axis: 0 }, 0.1)]).unwrap();
    assert!((there.sheath().direction.norm() - 1.0).abs() < 1e-15 && there.sheath().direction.x > 0.09);
    assert_eq!(there.shape().positions_mm, now.shape().positions_mm);
}
