//! Three instruments that lie in one another, moved at random: every step is an equilibrium in the vessel and can be taken again from its
//! state, and what cannot be done changes nothing. All of it to the bit.

use endowire_core::insertion::{Command, Move, Simulation, State};
use endowire_lab::instrument_stress::{self, InstrumentCase, InstrumentStress, RandomHands, bytes};

/// The cases of the stress table, or those of one vessel.
fn cases(vessel: Option<&str>) -> Vec<InstrumentCase> {
    let all = instrument_stress::cases().into_iter();
    all.filter(|case| vessel.is_none_or(|vessel| case.vessel == vessel)).collect()
}

/// All of them in the arch, nothing rubbing.
fn in_the_arch() -> Simulation {
    InstrumentStress::new(&cases(Some("aortic_arch"))[0]).unwrap().start
}

#[test]
fn random_commands_end_in_equilibria_and_refused_ones_change_nothing() {
    for case in cases(None) {
        let row = InstrumentStress::run(&case, 150);
        assert!(row.pass && row.commands > 100, "{row:#?}");
    }
}

#[test]
fn steps_can_be_had_again_from_saved_states() {
    let mut simulation = in_the_arch();
    let mut again = simulation.clone();
    let mut hands = RandomHands::new(1);
    let mut refused = 0;
    for k in 0..600 {
        let moves = hands.next(&simulation);
        let before = bytes(&simulation);
        let done = simulation.step_together(&moves).is_ok();
        if !done {
            refused += 1;
            hands.refused();
        }
        if k % 7 == 0 || !done {
            let state: State = postcard::from_bytes(&before).unwrap();
            again.restore(&state).unwrap();
            assert!(bytes(&again) == before, "step {k}: another state");
            assert_eq!(again.step_together(&moves).is_ok(), done, "step {k}");
            assert!(bytes(&again) == bytes(&simulation), "step {k}: another result");
            assert_eq!(again.shape(), simulation.shape(), "step {k}");
        }
    }
    assert!((1..300).contains(&refused), "{refused}");
}

#[test]
fn steps_keep_no_memory() {
    let mut simulation = in_the_arch();
    let mut there_and_back = |count: usize| {
        for k in 0..count {
            let command = Command {
                advance_mm: if k % 2 == 0 { 0.7 } else { -0.7 },
                rotate_rad: 0.01,
                ..Command::default()
            };
            simulation.step_together(&[Move { instrument: [0, 2, 3][k / 2 % 3], command }]).unwrap();
        }
    };
    there_and_back(60);
    let counted = allocation_counter::measure(|| there_and_back(120));
    assert_eq!(counted.count_current, 0, "{counted:?}");
}
