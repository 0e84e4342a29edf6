//! Several coaxial instruments, compared with differences of their energy; and invalid cases.

use std::path::Path;

use super::{StaticCase, StaticSolution};

/// A shaft with a soft tip, in it a catheter with a curved tip, and a wire that is curved everywhere and more so at
/// its tip, under a load at the end and one on the way.
fn instruments(lengths: [f64; 3], hands: [f64; 2]) -> StaticCase {
    let [shaft, catheter, wire] = lengths;
    let [first, second] = hands;
    let text = format!(
        r#"
        [rod]
        elements = 200
        [[rod.instrument]]
        name = "shaft"
        inserted = {shaft:?}
        section = [{{ until = 0.2, EI = 0.6 }}, {{ until = 2.0, EI = 2.0, EI_end = 5.0 }}]
        [[rod.instrument]]
        name = "catheter"
        inserted = {catheter:?}
        hand = {first:?}
        section = [
            {{ until = 0.3, EI = 0.5, GJ = 0.4, rest_curvature = [1.5, 0.4] }},
            {{ until = 2.0, EI = 0.8, GJ = 0.6 }},
        ]
        [[rod.instrument]]
        name = "wire"
        inserted = {wire:?}
        hand = {second:?}
        section = [
            {{ until = 0.25, EI = 0.2, GJ = 0.15, rest_curvature = [3.0, 0.0], rest_curvature_end = [1.0, 0.0] }},
            {{ until = 2.0, EI = 0.3, GJ = 0.2, rest_curvature = [0.7, -0.3], rest_twist = 0.4 }},
        ]
        [start]
        type = "clamped"
        [[load]]
        kind = "force"
        value = [0.1, -0.3, 0.2]
        [[load]]
        kind = "force"
        at = 0.35
        value = [0.0, 0.0, -0.4]
        [solver]
        tolerance = 1e-12
        "#
    );
    StaticCase::from_toml(&text, Path::new("stack.toml")).unwrap()
}

const LENGTHS: [f64; 3] = [0.65, 0.9, 1.1];
const HANDS: [f64; 2] = [0.8, -0.5];

fn solved(lengths: [f64; 3], hands: [f64; 2]) -> StaticSolution {
    instruments(lengths, hands).solve().unwrap().checked().unwrap()
}

/// Energy of the line and its loads, minus the energy released by the sheath from the wire, the only one curved
/// there.
fn energy(lengths: [f64; 3], hands: [f64; 2]) -> f64 {
    let energy = solved(lengths, hands).energy;
    energy.total + energy.load - 0.5 * 0.3 * (0.7 * 0.7 + 0.3 * 0.3) * lengths[2]
}

#[test]
fn push_forces_are_the_slopes_of_the_energy() {
    let solution = solved(LENGTHS, HANDS);
    for (index, instrument) in solution.instruments.iter().enumerate() {
        let at = |by: f64| {
            let mut lengths = LENGTHS;
            lengths[index] += by;
            energy(lengths, HANDS)
        };
        let slope = |h: f64| (at(h) - at(-h)) / (2.0 * h);
        let expected = (4.0 * slope(1e-3) - slope(2e-3)) / 3.0;
        let found = instrument.push_force.unwrap();
        assert!((found - expected).abs() < 1e-7, "{}: {found} and {expected}", instrument.name);
        assert!(expected.abs() > 1e-3, "{}: a force that tells nothing", instrument.name);
    }
}

#[test]
fn torques_are_the_slopes_of_the_energy() {
    let solution = solved(LENGTHS, HANDS);
    assert_eq!(solution.instruments[0].torque, 0.0);
    for (index, instrument) in solution.instruments[1..].iter().enumerate() {
        let at = |by: f64| {
            let mut hands = HANDS;
            hands[index] += by;
            energy(LENGTHS, hands)
        };
        let slope = |h: f64| (at(h) - at(-h)) / (2.0 * h);
        let expected = (4.0 * slope(1e-2) - slope(2e-2)) / 3.0;
        let error = (instrument.torque - expected).abs();
        assert!(
            error < 1e-7 && expected.abs() > 1e-3,
            "{}: {} and {expected}",
            instrument.name,
            instrument.torque
        );
        assert!(instrument.twist.abs() > 1e-3);
    }
    // The clamp turns all of them.
    let sum: f64 = solution.instruments.iter().map(|i| i.torque).sum();
    assert!((solution.reactions.start.torque - sum).abs() < 1e-12);
}

#[test]
fn an_end_passes_others_and_nothing_jumps() {
    // The shaft's tip passes the start of the catheter's curve at 0.6, the load at 0.35 and the end of the catheter.
    for at in [0.6, 0.35, 0.9] {
        let [before, there, after] =
            [-1e-7, 0.0, 1e-7].map(|by| solved([at + by, LENGTHS[1], LENGTHS[2]], HANDS));
        assert!(there.instruments[0].push_force.is_none());
        for other in [&before, &after] {
            assert!((other.energy.total - there.energy.total).abs() < 2e-6, "energy at {at}");
            let moved = (0..3).map(|a| (other.tip[a] - there.tip[a]).abs()).fold(0.0, f64::max);
            assert!(moved < 2e-6, "tip at {at}: {moved:e}");
            let push = |s: &StaticSolution| s.instruments[2].push_force.unwrap();
            assert!((push(other) - push(&there)).abs() < 2e-6, "force of the wire at {at}");
        }
    }
}

#[test]
fn order_does_not_matter() {
    let case = instruments(LENGTHS, HANDS);
    let mut turned = case.clone();
    turned.rod.instrument.rotate_left(1);
    let (a, b) = (case.solve().unwrap(), turned.solve().unwrap());
    for k in 0..3 {
        let (first, second) = (&a.instruments[k], &b.instruments[(k + 2) % 3]);
        assert_eq!(first.name, second.name);
        assert!((first.push_force.unwrap() - second.push_force.unwrap()).abs() < 1e-9);
        assert!((first.twist - second.twist).abs() < 1e-9);
    }
}

#[test]
fn a_single_instrument_is_a_rod() {
    let text = |body: &str| {
        format!(
            "[rod]\nelements = 20\n{body}[start]\ntype = \"clamped\"\n[[load]]\nkind = \"force\"\nvalue = [0.3, -0.5, 0.2]\n"
        )
    };
    let section = "EI = 1.0, GJ = 0.7, rest_curvature = [1.2, 0.0]";
    let rod = text(&format!("length = 1.0\nsection = [{{ until = 1.0, {section} }}]\n"));
    let one = text(&format!(
        "[[rod.instrument]]\nname = \"one\"\ninserted = 1.0\nsection = [{{ until = 3.0, {section} }}]\n"
    ));
    let [rod, one] = [rod, one].map(|t| StaticCase::from_toml(&t, Path::new("a")).unwrap().solve().unwrap());
    assert_eq!(rod.tip, one.tip);
    assert_eq!(rod.twist, one.instruments[0].twist);
    // The single rod computes EI|t′ − κ⁰|² at the clamp from its moment; this push force is the slope of the energy.
    let push = one.instruments[0].push_force.unwrap();
    assert!((push - rod.push_force.unwrap()).abs() < 1e-3 * push.abs(), "{push} and {:?}", rod.push_force);
    assert!((one.instruments[0].torque - rod.reactions.start.torque).abs() < 1e-12);
}

/// `count` instruments with EI 1.2 and GJ 0.9 in total, under a load that bends and twists.
fn parts(count: usize) -> StaticSolution {
    let share = |value: f64| value / count as f64;
    let part = format!(
        "[[rod.instrument]]\nname = \"part\"\ninserted = 1.0\nhand = 0.3\nsection = [{{ until = 3.0, EI = {:?}, GJ = {:?}, rest_curvature = [1.5, 0.3], rest_twist = 0.2 }}]\n",
        share(1.2),
        share(0.9)
    );
    let text = format!(
        "[rod]\nelements = 24\n{}[start]\ntype = \"clamped\"\n[[load]]\nkind = \"force\"\nvalue = [0.5, -2.0, 1.5]\n",
        part.repeat(count)
    );
    StaticCase::from_toml(&text, Path::new("parts.toml")).unwrap().solve().unwrap().checked().unwrap()
}

#[test]
fn parts_that_turn_alike_are_the_whole() {
    let whole = parts(1);
    for count in [2, 3] {
        let split = parts(count);
        for a in 0..3 {
            assert!(
                (split.tip[a] - whole.tip[a]).abs() < 1e-10,
                "{count} parts: {:?} {:?}",
                split.tip,
                whole.tip
            );
        }
        let torque: f64 = split.instruments.iter().map(|i| i.torque).sum();
        assert!((torque - whole.instruments[0].torque).abs() < 1e-9);
        assert!((split.energy.total - whole.energy.total).abs() < 1e-10);
        for part in &split.instruments {
            assert!((part.twist - whole.instruments[0].twist).abs() < 1e-9);
        }
    }
}

#[test]
fn what_is_no_case_of_several_instruments_is_reported_by_key_and_remedy() {
    type Spoil = fn(&mut StaticCase);
    let cases: [(Spoil, &str); 11] = [
        (|c| c.rod.length = 1.0, "rod.length = given: instruments have lengths"),
        (
            |c| c.rod.instrument[1].inserted = 2.5,
            "rod.instrument[1].inserted = 2.5: the instrument is 2 long",
        ),
        (|c| c.rod.instrument[0].inserted = 0.0, "rod.instrument[0].inserted = 0: must be a positive"),
        (|c| c.rod.instrument[2].hand = f64::NAN, "rod.instrument[2].hand = NaN"),
        (|c| c.rod.instrument[0].section[1].ea = Some(1.0), "rod.instrument[0].section[1].EA = given"),
        (|c| c.rod.instrument[1].section.clear(), "rod.instrument[1].section = none"),
        (
            |c| c.rod.instrument[0].section[0].until = 3.0,
            "rod.instrument[0].section[1].until = 2: sections come in order",
        ),
        (
            |c| c.rod.instrument[1].section.iter_mut().for_each(|s| s.gj = None),
            "rod.instrument[1].section[0].GJ = missing: an instrument with rest curvature",
        ),
        (|c| c.load[0].kind = super::LoadKind::Moment, "load[0].kind = moment: of several instruments"),
        (
            |c| c.end.kind = super::EndKind::Clamped,
            "end.type = clamped: several instruments end where they end",
        ),
        (
            |c| c.start.kind = super::StartKind::Pinned,
            "start.type = pinned: instruments come out of a sheath",
        ),
    ];
    for (spoil, words) in cases {
        let mut case = instruments(LENGTHS, HANDS);
        spoil(&mut case);
        let error = case.solve().unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    let mut many = instruments(LENGTHS, HANDS);
    many.rod.instrument.extend([many.rod.instrument[1].clone(), many.rod.instrument[2].clone()]);
    let error = many.solve().unwrap_err().to_string();
    assert!(error.contains("4 with rest curvature or twist: at most 3"), "{error}");
}
