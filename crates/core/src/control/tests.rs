//! Controllers arrive, keep their team together, and are reproducible.

use super::*;
use crate::device::{Device, Instrument, Section, Stack};
use crate::insertion::{Command, Sheath};
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::vessel::{CentrelinePath, GeneratedWall, Resolution, anatomy};

/// A bent wire in a catheter at the mouth of the arch or of the tube, and the path to a row.
fn scene(name: &str, row: usize) -> (Simulation, CentrelinePath) {
    let tree = anatomy::tree(name).unwrap();
    let made = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0)).unwrap();
    let sheath = Sheath::at_opening(&made.wall, made.inlet, 2.0).unwrap();
    let tip = Section { rest_curvature_per_mm: [0.05, 0.0], ..Section::straight(15.0, 0.3, 4.0) };
    let tube = Section { inner_radius_mm: Some(0.5), ..Section::straight(300.0, 0.8, 30.0) };
    let one = |name: &str, sections| Instrument {
        name: name.to_owned(),
        device: Device::new(sections).unwrap(),
        may_lead: true,
    };
    let stack = Stack::new(vec![
        one("wire", vec![tip, Section::straight(600.0, 0.3, 10.0)]),
        one("catheter", vec![tube]),
    ]);
    let options = KirchhoffOptions { element_mm: 5.0, ..KirchhoffOptions::default() };
    let simulation = Simulation::builder(made.wall, stack.unwrap(), sheath).method(&options).build().unwrap();
    (simulation, tree.path_to(row).unwrap())
}

fn wire_first() -> Team {
    Team { lead: 0, followers: vec![Follower { instrument: 1, behind_mm: 25.0 }] }
}

/// Drives to the end; returns the inserted lengths after every step.
fn driven(simulation: &mut Simulation, hand: &mut dyn Controller) -> (Outcome, Vec<Vec<f64>>) {
    let mut lengths_mm = Vec::new();
    let outcome = drive::<Error>(simulation, hand, 300, |simulation, _| {
        lengths_mm.push(simulation.report().lengths_mm());
        Ok(())
    });
    (outcome.unwrap(), lengths_mm)
}

#[test]
fn a_team_goes_around_the_bend_and_the_catheter_stays_behind_the_wire() {
    let (start, path) = scene("curved_tube", 60);
    let hands: [Box<dyn Controller>; 2] = [
        Box::new(FollowPath::new(path.clone(), wire_first(), 6.0)),
        Box::new(SearchAhead::new(path.clone(), wire_first(), vec![0], 6.0)),
    ];
    for mut hand in hands {
        let mut simulation = start.clone();
        let (outcome, lengths_mm) = driven(&mut simulation, &mut *hand);
        assert!(matches!(outcome, Outcome::Arrived), "{outcome:?}");
        assert!(lengths_mm.iter().all(|mm| mm[1] <= (mm[0] - 25.0).max(0.0) + 1e-9), "{lengths_mm:?}");
        assert!(lengths_mm.last().unwrap()[1] > 80.0);
        let on = path.nearest(&simulation.shape().tip_mm().unwrap());
        assert!(on.arc_mm > path.length_mm() - 6.0 && on.distance_mm < on.radius_mm);
    }
}

#[test]
fn the_same_hand_makes_the_same_moves_again() {
    let (start, path) = scene("curved_tube", 45);
    let run = || {
        let mut simulation = start.clone();
        let mut hand = SearchAhead::new(path.clone(), wire_first(), vec![0, 1], 6.0);
        driven(&mut simulation, &mut hand);
        (simulation.shape().clone(), simulation.report().clone())
    };
    assert_eq!(run(), run());
}

#[test]
fn followers_go_to_their_places_by_no_more_than_the_one_that_leads() {
    let (mut simulation, _) = scene("curved_tube", 45);
    let team = wire_first();
    let lengths = |simulation: &Simulation| simulation.report().lengths_mm();
    for _ in 0..20 {
        simulation.step_together(&team.moves(&simulation, Command::advance(2.0))).unwrap();
    }
    assert_eq!(lengths(&simulation), [40.0, 15.0]);
    simulation.step_together(&team.moves(&simulation, Command::retract(2.0))).unwrap();
    assert_eq!(lengths(&simulation), [38.0, 13.0]);
    assert_eq!(team.moves(&simulation, Command::rotate(0.1)).len(), 1);
    // The catheter leads: the wire, too far ahead, is drawn into it.
    let back = Team { lead: 1, followers: vec![Follower { instrument: 0, behind_mm: 5.0 }] };
    let moves = back.moves(&simulation, Command::advance(2.0));
    assert_eq!(moves[1].command.advance_mm, -2.0);
}

#[test]
fn a_team_of_instruments_that_are_not_there_is_refused() {
    let (simulation, path) = scene("curved_tube", 45);
    for team in [Team { lead: 2, ..Team::default() }, Team { lead: 1, ..wire_first() }] {
        let reported = FollowPath::new(path.clone(), team, 6.0).next(&simulation).unwrap_err().to_string();
        assert!(reported.contains("there are 2, the innermost is 0"), "{reported}");
    }
}

#[test]
fn instruments_that_are_absent_are_refused_and_not_given_up_on() {
    let (simulation, path) = scene("curved_tube", 45);
    let next = |lead: usize, turned: Vec<usize>| {
        SearchAhead::new(path.clone(), Team { lead, followers: Vec::new() }, turned, 6.0).next(&simulation)
    };
    assert!(matches!(next(0, vec![1]), Ok(Action::Move(_))));
    for refused in [next(0, vec![1, 2]), next(2, vec![0])] {
        let text = refused.unwrap_err().to_string();
        assert!(text.contains('2') && text.contains("there are 2"), "{text}");
    }
}
