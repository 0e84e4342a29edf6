//! Play between instruments, compared with two beams and with differences of the energy.

use std::path::Path;

use super::{StaticCase, StaticSolution};

/// A wire in a catheter of 60 mm, 10 mm beyond it: with a rest curvature, and pushed aside by a force at its tip.
fn case(clearance: f64, [curvature, force]: [f64; 2], elements: usize) -> StaticCase {
    let text = format!(
        r#"
        [rod]
        elements = {elements}
        [[rod.instrument]]
        name = "wire"
        inserted = 70.0
        clearance = {clearance:?}
        section = [{{ until = 100.0, EI = 5.0, GJ = 4.0, rest_curvature = [{curvature:?}, 0.0] }}]
        [[rod.instrument]]
        name = "catheter"
        inserted = 60.0
        section = [{{ until = 100.0, EI = 60.0 }}]
        [start]
        type = "clamped"
        [[load]]
        kind = "force"
        value = [0.0, {force:?}, 0.0]
        [solver]
        tolerance = 1e-11
        "#
    );
    StaticCase::from_toml(&text, Path::new("play.toml")).unwrap()
}

fn solved(case: &StaticCase) -> StaticSolution {
    let solution = case.solve().unwrap().checked().unwrap();
    assert!(solution.stable && solution.monotone);
    solution
}

fn tip_mm(solution: &StaticSolution, without: &StaticSolution) -> f64 {
    let each = solution.tip.iter().zip(without.tip);
    each.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[test]
fn a_wire_tilts_at_the_end_of_a_catheter_as_two_beams_do_at_any_length_of_elements() {
    // The difference of the curvatures beyond the end; the force is small, so that the wire bends by little.
    for (bends, difference) in [([0.04, 0.0], 0.04), ([0.0, 0.005], 0.005 * 10.0 / 5.0)] {
        for clearance in [0.05, 0.2] {
            let expected = f64::sqrt(3.0 * clearance * difference);
            let mut tips_mm = Vec::new();
            for elements in [18, 35, 70, 280] {
                let solution = solved(&case(clearance, bends, elements));
                let tilt = solution.instruments[1].tilt;
                assert!((tilt / expected - 1.0).abs() < 0.025, "{clearance} {elements}: {tilt} {expected}");
                assert_eq!(solution.instruments[0].tilt, 0.0);
                tips_mm.push(tip_mm(&solution, &solved(&case(0.0, bends, elements))));
            }
            // What goes on is 10 mm, of which the catheter takes a thirteenth.
            let off_mm = expected * 60.0 / 65.0 * 10.0;
            // Pushed aside, the line there is inclined by 0.2 rad against the force, and takes a smaller moment.
            let within = if bends[1] > 0.0 { 0.09 } else { 0.05 };
            assert!((tips_mm[3] / off_mm - 1.0).abs() < within, "{tips_mm:?} {off_mm}");
            for (k, within) in [3e-2, 1e-2, 3e-3].into_iter().enumerate() {
                assert!((tips_mm[k] / tips_mm[3] - 1.0).abs() < within, "{clearance}: {tips_mm:?}");
            }
        }
    }
    // The twin: other stiffness, other clearance.
    let tilt = solved(&case(0.1, [0.04, 0.0], 70)).instruments[1].tilt;
    assert!((tilt / (3.0f64 * 0.2 * 0.04).sqrt() - 1.0).abs() > 0.2);
}

#[test]
fn no_play_changes_nothing_and_little_play_changes_little() {
    let mut with = case(0.0, [0.04, 0.01], 70);
    let without = solved(&with);
    let text = serde_json::to_string(&with).unwrap();
    assert!(!text.contains("clearance"), "{text}");
    with.rod.instrument[0].clearance = 1e-7;
    let solution = solved(&with);
    assert!(tip_mm(&solution, &without) < 2e-3, "{:?}", solution.tip);
    assert!(solution.iterations <= without.iterations + 6, "{}", solution.iterations);
}

#[test]
fn a_straight_wire_in_a_straight_catheter_stays_straight() {
    let solution = solved(&case(0.2, [0.0, 0.0], 35));
    assert!(solution.tip[1].abs() + solution.tip[2].abs() < 1e-9 && solution.instruments[1].tilt < 1e-9);
}

#[test]
fn push_forces_are_slopes_of_the_energy_with_play() {
    let bends = [0.04, 0.02];
    let at = |wire: f64, catheter: f64| {
        let mut case = case(0.1, bends, 140);
        (case.rod.instrument[0].inserted, case.rod.instrument[1].inserted) = (wire, catheter);
        case.rod.instrument[1].section[0].rest_curvature = [-0.003, 0.004];
        case.rod.instrument[1].section[0].gj = Some(50.0);
        case.rod.instrument[1].hand = 0.7;
        solved(&case)
    };
    let energy = |wire: f64, catheter: f64| {
        let energy = at(wire, catheter).energy;
        let released = 0.5 * 5.0 * 0.04 * 0.04 * wire + 0.5 * 60.0 * 25e-6 * catheter;
        energy.total + energy.load - released
    };
    let here = at(70.0, 60.0);
    let h = 0.02;
    for (index, [wire, catheter]) in [[h, 0.0], [0.0, h]].into_iter().enumerate() {
        let side = |k: f64| energy(70.0 + k * wire, 60.0 + k * catheter);
        let slope = (8.0 * (side(1.0) - side(-1.0)) - side(2.0) + side(-2.0)) / (12.0 * h);
        let force = here.instruments[index].push_force.unwrap();
        assert!((force - slope).abs() < 1e-5 * slope.abs().max(0.01), "{index}: {force} {slope}");
    }
}

#[test]
fn play_of_the_last_and_negative_play_are_refused() {
    let refused = |index: usize, clearance: f64| {
        let mut case = case(0.0, [0.04, 0.0], 35);
        case.rod.instrument[index].clearance = clearance;
        case.solve().unwrap_err().to_string()
    };
    let error = refused(1, 0.1);
    assert!(
        error.starts_with("rod.instrument[1].clearance = 0.1: the last instrument lies in none"),
        "{error}"
    );
    let error = refused(0, -0.1);
    assert!(error.contains("rod.instrument[0].clearance = -0.1"), "{error}");
}
