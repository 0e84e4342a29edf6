//! Devices with round cross-sections keep their bits, whatever other cross-sections there are: each number was computed
//! before there were others.

use endowire_core::device::{Device, Instrument, Section, Stack, Steer};
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

/// A number that changes with any bit of the shapes, forces and energies of a run.
fn number(mut simulation: Simulation, moves: impl Fn(usize) -> Vec<Move>) -> u64 {
    let mut number = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |value: f64| number = (number ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for k in 0..60 {
        let report = simulation.step_together(&moves(k)).unwrap();
        [report.push_force_n, report.torque_nmm, report.energy.bend, report.energy.twist]
            .into_iter()
            .for_each(&mut take);
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

#[test]
fn round_devices_have_the_bits_that_they_had() {
    let shaft = Section::straight(380.0, 0.445, 10.0);
    let hook = Section { rest_curvature_per_mm: [0.03, 0.01], ..Section::straight(21.0, 0.445, 5.0) };
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
    let numbers = [
        number(start(Device::uniform(400.0, 0.445, 10.0).unwrap(), 0.0), turns),
        number(start(hooked(), 0.0), turns),
        number(start(hooked(), 0.15), turns),
        number(start(steered, 0.0), bends),
        number(start(Stack::new(both).unwrap(), 0.0), together),
    ];
    let had = [
        0xd291_c9c9_cb9f_497d,
        0xc132_8ade_4b4b_37c4,
        0xa466_0e23_1c63_0774,
        0x026e_abf4_a643_b665,
        0x9ae8_92d6_c3cd_04c0,
    ];
    assert_eq!(
        numbers.map(|number| format!("{number:016x}")),
        had.map(|number: u64| format!("{number:016x}"))
    );
    // The twin: a last bit of one stiffness is seen.
    let other = Section { bending_stiffness_nmm2: shaft.bending_stiffness_nmm2.next_up(), ..shaft };
    let almost = Device::new(vec![hook, other]).unwrap();
    assert_ne!(number(start(almost, 0.0), turns), numbers[1]);
}
