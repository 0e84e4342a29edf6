//! Gradients against central differences of whole commands, from the same state.

use super::{Command, Move, Sheath, Simulation, WallProperties};
use crate::device::{Device, Instrument, Section, Stack};
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::methods::{Gradient, Parameter};
use crate::random::{splitmix64, unit};
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

fn simulation(tree: &str, several: bool, friction: f64) -> Simulation {
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
    Simulation::builder(lumen, stack(several), sheath)
        .properties(properties)
        .method(&options)
        .build()
        .unwrap()
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
    let report = there.step_together(&moves).unwrap().clone();
    assert!(report.converged && !report.jumped);
    let mut values: Vec<f64> = there.shape().tip_mm().unwrap().iter().copied().collect();
    values.extend(
        report.instruments.iter().flat_map(|hand| [hand.push_force_n.unwrap_or(0.0), hand.torque_nmm]),
    );
    values.extend([report.energy.bend, report.energy.twist, report.energy.wall]);
    (values, vec![report.contacts.len(), report.substeps as usize])
}

/// The same of a gradient.
fn slopes(gradient: &Gradient, k: usize) -> Vec<f64> {
    let slope = &gradient.slopes[k];
    let mut values: Vec<f64> = slope.tip_mm.iter().copied().collect();
    let forces = slope.push_force_n.iter().zip(&slope.torque_nmm);
    values.extend(forces.flat_map(|(push_n, torque_nmm)| [push_n.unwrap_or(0.0), *torque_nmm]));
    values.extend([slope.energy.bend, slope.energy.twist, slope.energy.wall]);
    values
}

/// All parameters of instruments with two sections each.
fn parameters(instruments: usize, friction: f64) -> Vec<Parameter> {
    let mut by = vec![Parameter::WallModulus];
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
            ]);
        }
    }
    by
}

/// Half of the difference that is taken of whole commands.
fn half(parameter: Parameter) -> f64 {
    match parameter {
        Parameter::RestCurvature { .. } => 1e-6,
        Parameter::BendingStiffness { .. } | Parameter::TorsionalStiffness { .. } => 2e-3,
        Parameter::Advance { .. } => 2e-5,
        _ => 1e-4,
    }
}

/// Numbers that look random.
struct Numbers(u64);

impl Numbers {
    /// The next one, between these two.
    fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        self.0 += 1;
        low + (high - low) * unit(splitmix64(7, self.0))
    }

    fn moves(&mut self, hands: usize) -> Vec<Move> {
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

/// Errors of gradients after random commands, ascending, relative to how results change if a parameter doubles, and how many of them were not
/// compared, since contacts or parts of whole commands change within the difference.
fn errors(mut now: Simulation, steps: usize, friction: f64) -> (Vec<f64>, usize) {
    let hands = now.stack().instruments().len();
    let by = parameters(hands, friction);
    let mut numbers = Numbers(0);
    let (mut errors, mut others) = (Vec::new(), 0);
    for k in 0..steps {
        let moves = numbers.moves(hands);
        if k > 8 && k % 3 == 0 {
            let gradient = now.gradients(std::slice::from_ref(&moves), &by).unwrap().remove(0);
            let counts = [gradient.report.contacts.len(), gradient.report.substeps as usize];
            for (k, parameter) in by.iter().enumerate() {
                let h = half(*parameter);
                let [(less, a), (more, b)] = [-h, h].map(|by| led_to(&now, &moves, *parameter, by));
                if a != counts || b != counts || gradient.slopes[k].one_sided {
                    others += 1;
                    continue;
                }
                let value = now.value(parameter).unwrap().map_or(1.0, |value| value.abs().max(1e-3));
                let differences = less.iter().zip(&more).map(|(less, more)| (more - less) / (2.0 * h));
                let size =
                    |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>().sqrt() * value;
                let whole = size(&mut differences.clone());
                let off = size(&mut differences.zip(slopes(&gradient, k)).map(|(a, b)| a - b));
                errors.push(off / whole.max(1e-2));
            }
        }
        now.step_together(&moves).unwrap();
    }
    errors.sort_by(f64::total_cmp);
    (errors, others)
}

#[test]
fn gradients_are_limits_of_differences() {
    // Scene, several instruments, friction; and by how much nine of ten, and all, may be off. With friction they agree
    // to parts in a thousand; why not nearer is open.
    for (tree, several, friction, most) in [
        ("curved_tube", false, 0.0, [1e-5, 1e-4]),
        ("aortic_arch", true, 0.0, [1e-5, 1e-4]),
        ("curved_tube", false, 0.2, [1e-3, 2e-3]),
        ("curved_tube", true, 0.2, [1e-3, 2e-3]),
    ] {
        let (errors, others) = errors(simulation(tree, several, friction), 24, friction);
        let at = |part: f64| errors[(part * (errors.len() - 1) as f64) as usize];
        println!(
            "{tree} {several} {friction}: {} and {others} others: {:.1e} {:.1e} {:.1e} {:.1e}",
            errors.len(),
            at(0.5),
            at(0.9),
            at(0.99),
            at(1.0)
        );
        assert!(
            at(0.9) < most[0] && at(1.0) < most[1],
            "{tree} {several} {friction}: {} {}",
            at(0.9),
            at(1.0)
        );
        assert!(others < errors.len() / 4, "{tree} {several} {friction}: {others}");
    }
}

#[test]
fn friction_remembers_over_commands() {
    let mut now = simulation("curved_tube", false, 0.2);
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
    let mut now = simulation("curved_tube", false, 0.0);
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
    let changed =
        |parameter: Parameter, value: f64| now.changed(&[(parameter, value)]).err().unwrap().to_string();
    assert!(changed(by[0], 1.0).contains("command"));
    assert!(changed(Parameter::WallModulus, -1.0).contains("modulus"));
    assert!(changed(Parameter::BendingStiffness { instrument: 0, section: 0 }, f64::NAN).contains("bending"));
}
