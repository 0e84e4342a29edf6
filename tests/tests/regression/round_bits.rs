//! Cross-sections that are as stiff in a soft plane as across it have the bits of round ones: what makes others different is left out
//! where there is nothing of it.

use endowire_core::device::{Device, Instrument, Section, SoftPlane, Stack, Steer};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

fn start(stack: impl Into<Stack>, friction: f64) -> Simulation {
    let made = GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.6)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
    let options = KirchhoffOptions { element_mm: 4.0, ..KirchhoffOptions::default() };
    let properties = WallProperties { friction, ..WallProperties::default() };
    Simulation::builder(made.wall, stack, sheath).properties(properties).method(&options).build().unwrap()
}

/// A number that changes with any bit of the shapes and energies of a run.
fn number(mut simulation: Simulation, moves: impl Fn(usize) -> Vec<Move>) -> u64 {
    let mut number = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |value: f64| number = (number ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for k in 0..60 {
        let report = simulation.step_together(&moves(k)).unwrap();
        [report.torque_nmm, report.energy.bend, report.energy.twist].into_iter().for_each(&mut take);
        for position in &simulation.shape().positions_mm {
            [position.x, position.y, position.z].into_iter().for_each(&mut take);
        }
    }
    number
}

/// Pushed, now and then pulled, turned and steered.
fn command(k: usize) -> Command {
    let rotate_rad = if k % 3 == 1 { 0.21 } else { 0.0 };
    Command { advance_mm: if k % 11 == 7 { -1.5 } else { 2.5 }, rotate_rad, steer: 0.0 }
}

fn alone(command: Command) -> Vec<Move> {
    vec![Move { instrument: 0, command }]
}

/// The numbers of a hooked wire, without and with friction, of a steered one, and of one in a catheter, of these sections.
fn numbers(section: impl Fn(Section) -> Section) -> [u64; 4] {
    let shaft = section(Section::straight(380.0, 0.445, 10.0));
    let hook =
        section(Section { rest_curvature_per_mm: [0.03, 0.01], ..Section::straight(21.0, 0.445, 5.0) });
    let hooked = || Device::new(vec![hook, shaft]).unwrap();
    let tip = Section { steer: Some(Steer { plane_deg: 30.0, curvature_per_mm_at_1: 0.02 }), ..hook };
    let steered = Device::new(vec![tip, shaft]).unwrap();
    let tube = |sections: &[Section]| {
        let inner = |one: &Section| Section { radius_mm: 0.9, inner_radius_mm: Some(0.5), ..*one };
        Device::new(sections.iter().map(inner).collect()).unwrap()
    };
    let instrument = |name: &str, device: Device| Instrument { name: name.into(), device, may_lead: true };
    let both = vec![
        instrument("wire", hooked()),
        instrument("catheter", tube(&[hook, Section { length_mm: 200.0, ..shaft }])),
    ];
    let together = |k: usize| {
        let behind = Command { advance_mm: 1.5, rotate_rad: -0.1, steer: 0.0 };
        vec![Move { instrument: 0, command: command(k) }, Move { instrument: 1, command: behind }]
    };
    let bends = |k: usize| alone(Command { steer: if k > 40 { -0.04 } else { 0.02 }, ..command(k) });
    let turns = |k: usize| alone(command(k));
    [
        number(start(hooked(), 0.0), turns),
        number(start(hooked(), 0.15), turns),
        number(start(steered, 0.0), bends),
        number(start(Stack::new(both).unwrap(), 0.0), together),
    ]
}

#[test]
fn as_stiff_in_a_soft_plane_as_across_it_is_round_to_the_bit() {
    let flat = |by: f64| {
        numbers(|section| {
            let bending_stiffness_nmm2 = by * section.bending_stiffness_nmm2;
            Section { soft_plane: Some(SoftPlane { plane_deg: 30.0, bending_stiffness_nmm2 }), ..section }
        })
    };
    let round = numbers(|section| section);
    assert_eq!(flat(1.0), round);
    // The twin: softer by its last bits, it is seen.
    let other = flat(1.0 - 1e-14);
    assert!((0..4).all(|k| other[k] != round[k]), "{other:?} {round:?}");
}
