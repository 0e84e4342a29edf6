//! Three instruments that lie in one another, moved at random: every step is an equilibrium in the vessel and can be taken again from its
//! state, and what cannot be done changes nothing. All of it to the bit.

use endowire_core::Error;
use endowire_core::device::{Device, Instrument, Section, Stack};
use endowire_core::insertion::{Command, Move, Sheath, Simulation, State};
use endowire_core::methods::kirchhoff::KirchhoffOptions;
use endowire_core::vessel::{GeneratedWall, anatomy};
use endowire_tests::crossing::CrossingTest;
use endowire_tests::noise::Noise;
use endowire_tests::sweep::crosses;

/// A hooked wire, a straight microcatheter, a bent catheter; the innermost must be the longest.
fn stack() -> Stack {
    let one = |name: &str, sections: Vec<Section>| Instrument {
        name: name.to_owned(),
        device: Device::new(sections).unwrap(),
        may_lead: true,
    };
    let bent = |section: Section, length_mm, curvature| Section {
        length_mm,
        rest_curvature_per_mm: [curvature, 0.0],
        ..section
    };
    let tube = |length_mm, radius_mm, inner_mm, stiffness| Section {
        inner_radius_mm: Some(inner_mm),
        ..Section::straight(length_mm, radius_mm, stiffness)
    };
    let wire = Section::straight(500.0, 0.2, 6.0);
    let catheter = tube(300.0, 0.8, 0.5, 60.0);
    Stack::new(vec![
        one("wire", vec![bent(wire, 12.0, 0.08), wire]),
        one("microcatheter", vec![tube(400.0, 0.45, 0.3, 8.0)]),
        one("catheter", vec![bent(catheter, 25.0, 0.025), catheter]),
    ])
    .unwrap()
}

/// All of them in the arch, the thinner farther in.
fn in_the_arch() -> (Simulation, CrossingTest) {
    let made =
        GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), anatomy::asset_resolution("aortic_arch"))
            .unwrap();
    let crossing = CrossingTest::new(made.wall.mesh());
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let options = KirchhoffOptions { element_mm: 4.0, ..KirchhoffOptions::default() };
    let mut simulation = Simulation::builder(made.wall, stack(), sheath).method(&options).build().unwrap();
    let push = |lengths: [f64; 3]| {
        let each = lengths.into_iter().enumerate();
        each.map(|(instrument, mm)| Move { instrument, command: Command::advance(mm) }).collect::<Vec<_>>()
    };
    simulation.step_together(&push([30.0, 15.0, 5.0])).unwrap();
    for _ in 0..80 {
        simulation.step_together(&push([2.0; 3])).unwrap();
    }
    (simulation, crossing)
}

/// Moves of hands that push on the whole, one or several at a time, and often repeat themselves.
fn moves(noise: &mut Noise, last: &[Move]) -> Vec<Move> {
    if !last.is_empty() && noise.happens(0.5) {
        return last.to_vec();
    }
    let mut moves = Vec::new();
    for instrument in 0..3 {
        if noise.happens(0.5) {
            let advance_mm = if noise.happens(0.2) { 0.0 } else { 0.2 + 1.5 * noise.next() };
            let rotate_rad = if noise.happens(0.4) { 0.3 * noise.next() } else { 0.0 };
            moves.push(Move { instrument, command: Command { advance_mm, rotate_rad } });
        }
    }
    moves
}

fn bytes(simulation: &Simulation) -> Vec<u8> {
    postcard::to_allocvec(&simulation.state()).unwrap()
}

/// Commands carried out and refused.
fn drive(seed: u64, count: usize) -> (usize, usize) {
    let (mut simulation, crossing) = in_the_arch();
    let mut again = simulation.clone();
    let mut noise = Noise::new(seed);
    let (mut last, mut refused) = (Vec::new(), 0);
    for k in 0..count {
        last = moves(&mut noise, &last);
        let before = bytes(&simulation);
        let done = simulation.step_together(&last).map(|report| report.converged);
        match &done {
            Ok(converged) => {
                assert!(*converged, "seed {seed}, step {k}: {last:?} is no equilibrium");
                assert!(!crosses(&crossing, &simulation), "seed {seed}, step {k}: {last:?} crosses the wall");
            }
            Err(error) => {
                assert!(
                    matches!(error, Error::Parameter { .. } | Error::End(_)),
                    "seed {seed}, step {k}: {error}"
                );
                assert!(bytes(&simulation) == before, "seed {seed}, step {k}: refused, and another state");
                refused += 1;
                last.clear();
            }
        }
        if k % 7 == 0 {
            let state: State = postcard::from_bytes(&before).unwrap();
            again.restore(&state).unwrap();
            assert!(bytes(&again) == before, "seed {seed}, step {k}: another state");
            assert_eq!(
                again.step_together(&last).is_ok() || last.is_empty(),
                done.is_ok() || last.is_empty()
            );
            if done.is_ok() {
                assert!(bytes(&again) == bytes(&simulation), "seed {seed}, step {k}: another result");
                assert_eq!(again.shape(), simulation.shape(), "seed {seed}, step {k}");
            }
        }
    }
    (count - refused, refused)
}

#[test]
fn random_commands_end_in_equilibria_that_can_be_had_again() {
    let (done, refused) = drive(1, 1_000);
    assert!(done > 500 && refused > 0, "{done} {refused}");
}

#[test]
#[ignore = "half an hour"]
fn a_hundred_thousand_random_commands_end_in_equilibria() {
    for seed in 0..100 {
        drive(seed, 1_000);
    }
}

#[test]
fn steps_keep_no_memory() {
    let (mut simulation, _) = in_the_arch();
    let mut there_and_back = |count: usize| {
        for k in 0..count {
            let command = Command { advance_mm: if k % 2 == 0 { 0.7 } else { -0.7 }, rotate_rad: 0.01 };
            simulation.step_together(&[Move { instrument: k / 2 % 3, command }]).unwrap();
        }
    };
    there_and_back(60);
    let counted = allocation_counter::measure(|| there_and_back(120));
    assert_eq!(counted.count_current, 0, "{counted:?}");
}
