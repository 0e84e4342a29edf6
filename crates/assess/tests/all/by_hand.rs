//! Measures of a small record against values computed by hand.

use crate::fork;

use endowire_assess::{BeamState, Group, Hand, Injection, Outlet, Record, Sample, Way, assess};
use endowire_core::Vec3;
use fork::tree;

fn sample(time_s: f64, [x, y]: [f64; 2], advance_mm: f64, wall_force_n: f64) -> Sample {
    let hand = Hand { advance_mm, push_force_n: Some(-wall_force_n), ..Hand::default() };
    Sample {
        time_s,
        tip_mm: Some(Vec3::new(x, y, 0.0)),
        hands: vec![hand],
        wall_force_n,
        tip_force_n: 0.5 * wall_force_n,
        jumped: wall_force_n > 0.25,
        ..Sample::default()
    }
}

/// Ten seconds: into the trunk, into the wrong branch, back, a rest, into the right one.
fn record() -> Record {
    let on = |time_s: f64, on: bool, primary_deg: f64| BeamState {
        time_s,
        on,
        frames_per_s: 10.0,
        dose_ngy: 30.0,
        field_mm2: 10_000.0,
        primary_deg,
        secondary_deg: 0.0,
        ..BeamState::default()
    };
    Record {
        samples: vec![
            sample(1.0, [10.0, 0.0], 10.0, 0.0),
            sample(3.0, [100.0, 0.0], 90.0, 0.1),
            sample(4.0, [100.0, -20.0], 20.0, 0.3),
            sample(5.0, [100.0, 0.0], -20.0, 0.1),
            sample(7.0, [100.0, 0.0], 0.0, 0.1),
            sample(10.0, [100.0, 48.0], 48.0, 0.2),
        ],
        injections: vec![
            Injection { time_s: 0.5, volume_ml: 4.0, rate_ml_per_s: 2.0, outlet: None },
            Injection { time_s: 4.5, volume_ml: 6.0, rate_ml_per_s: 3.0, outlet: None },
        ],
        beam: Some(vec![on(0.0, true, 0.0), on(2.0, false, 0.0), on(6.0, true, 30.0), on(8.0, false, 30.0)]),
        ..Record::default()
    }
}

#[test]
fn each_measure_is_what_it_says() {
    let way = Way::to_target(&tree(), "left", 5.0).unwrap().unwrap();
    let metrics = assess(&record(), Some(&way));
    let value = |name: &str| metrics.iter().find(|metric| metric.name == name).unwrap().value;
    // The tip goes 90 + 20 + 20 + 48 mm; the centre line between its ends is 90 + 48 mm long.
    let by_hand = [
        ("total_s", 10.0),
        ("idle_s", 2.0),
        ("beam_on_s", 4.0),
        ("beam_on_idle_s", 1.0),
        ("kerma_ugy", 40.0 * 0.03),
        ("kerma_area_ugycm2", 40.0 * 0.03 * 100.0),
        ("runs", 2.0),
        ("frames", 40.0),
        ("field_cm2", 100.0),
        ("c_arm_moves", 1.0),
        ("contrast_ml", 10.0),
        ("injections", 2.0),
        ("largest_rate_ml_per_s", 3.0),
        ("against_wall_ml", 6.0),
        ("tip_path_mm", 178.0),
        ("path_ratio", 178.0 / 138.0),
        // From 1 s on, but for 2 s of rest.
        ("tip_speed_mm_per_s", 178.0 / 7.0),
        // From 1 s to 5 s, in which the hand turns back once, and from 7 s on.
        ("submovements", 3.0),
        ("submovement_s", 7.0 / 3.0),
        ("reversals", 2.0),
        ("turns", 0.0),
        ("needless_turns", 0.0),
        ("retracted_mm", 20.0),
        ("wall_force_n", 0.3),
        ("wall_force_95_n", 0.3),
        ("tip_force_n", 0.15),
        ("wall_impulse_ns", 0.1 * 2.0 + 0.3 + 0.1 + 0.1 * 2.0 + 0.2 * 3.0),
        ("hand_force_n", 0.3),
        ("hand_torque_nmm", 0.0),
        ("jumps", 1.0),
        ("moving_without_beam_s", 5.0),
        ("unseen_share", 5.0 / 8.0),
        // 90 mm in two seconds.
        ("push_speed_mm_per_s", 45.0),
        ("wrong_branches", 1.0),
        ("time_in_trunk_s", 10.0),
        ("arrived", 1.0),
        ("placement_error_mm", 2.0),
    ];
    for (name, expected) in by_hand {
        let value = value(name).unwrap();
        assert!((value - expected).abs() < 1e-9, "{name}: {value}, by hand {expected}");
    }
    assert!(value("spectral_arc_length").unwrap() < -1.0);
    assert_eq!(value("catheter_ahead_s"), None, "of one instrument");
    assert_eq!((value("packing_density"), value("coil_outside_mm")), (None, None), "without a sac");
    let reported: Vec<&str> = metrics.iter().map(|metric| metric.name).collect();
    for name in ["entrance_ugy", "entrance_area_ugycm2", "acquisition_s", "moving_in_acquisition_s"] {
        assert_eq!(value(name), None, "{name} was not recorded");
    }
    assert_eq!(reported.len(), by_hand.len() + 8);
    assert!(Group::ALL.iter().all(|group| metrics.iter().any(|metric| metric.group == *group)));
}

#[test]
fn medium_is_measured_as_it_has_flowed_and_at_the_tip_that_it_leaves() {
    let value = |record: &Record, name: &str| {
        assess(record, None).iter().find(|metric| metric.name == name).unwrap().value
    };
    // 2 ml/s from 8 s on, of which two seconds are left.
    let mut late = record();
    late.injections[1] = Injection { time_s: 8.0, volume_ml: 6.0, rate_ml_per_s: 2.0, outlet: None };
    assert_eq!(value(&late, "contrast_ml"), Some(4.0 + 4.0));
    assert_eq!((value(&late, "injections"), value(&late, "against_wall_ml")), (Some(2.0), Some(4.0)));
    // The foremost tip is held by the wall, and the one that injects is not: medium goes by its own.
    let leaves = |instrument: &str, tip_force_n: f64| {
        Some(Outlet {
            instrument: Some(instrument.to_owned()),
            at_mm: Vec3::zeros(),
            tip_force_n: Some(tip_force_n),
        })
    };
    let mut two = record();
    two.samples.iter_mut().for_each(|sample| sample.hands.push(Hand::default()));
    two.injections[0].outlet = leaves("catheter", 0.05);
    two.injections[1].outlet = leaves("catheter", 0.0);
    assert_eq!(value(&two, "against_wall_ml"), Some(4.0));
    // Of two instruments it must be recorded.
    two.injections[0].outlet = None;
    assert_eq!(value(&two, "against_wall_ml"), None);
}

#[test]
fn way_and_speed_do_not_depend_on_how_long_steps_are() {
    // 60 mm in 6 s, after 2 s of rest.
    let of = |steps: u32, start_mm: Option<Vec3>| {
        let step = |k: u32| {
            let part = f64::from(k) / f64::from(steps);
            sample(2.0 + 6.0 * part, [60.0 * part, 0.0], 60.0 / f64::from(steps), 0.0)
        };
        let rest = Sample { tip_mm: start_mm, ..sample(2.0, [0.0, 0.0], 0.0, 0.0) };
        let samples = std::iter::once(rest).chain((1..=steps).map(step)).collect();
        let metrics = assess(&Record { samples, start_mm, ..Record::default() }, None);
        ["tip_path_mm", "tip_speed_mm_per_s", "submovement_s"].map(|name| {
            let value = metrics.iter().find(|metric| metric.name == name).unwrap().value;
            value.map(|value| (value * 1e9).round() / 1e9)
        })
    };
    for steps in [1, 6, 60] {
        assert_eq!(of(steps, Some(Vec3::zeros())), [Some(60.0), Some(10.0), Some(6.0)], "{steps} steps");
    }
    // Where the tip was before the first step is not known: way and speed are of the time from its end on.
    assert_eq!(of(1, None), [Some(0.0), None, None]);
    assert_eq!(of(6, None), [Some(50.0), Some(10.0), Some(5.0)]);
    assert_eq!(of(60, None), [Some(59.0), Some(10.0), Some(5.9)]);
}

#[test]
fn undo_is_no_motion_of_the_tip() {
    // Pushed to 30 mm, taken back to 10 mm, and pushed again to 40 mm: 30 and 30 mm.
    let mut samples = vec![
        sample(1.0, [0.0, 0.0], 0.0, 0.0),
        sample(2.0, [30.0, 0.0], 30.0, 0.0),
        sample(3.0, [10.0, 0.0], 0.0, 0.0),
        sample(4.0, [40.0, 0.0], 30.0, 0.0),
    ];
    let value = |samples: &[Sample], name: &str| {
        let record = Record { samples: samples.to_vec(), ..Record::default() };
        let way = Way::to_target(&tree(), "left", 5.0).unwrap().unwrap();
        assess(&record, Some(&way)).iter().find(|metric| metric.name == name).unwrap().value
    };
    assert_eq!(value(&samples, "tip_path_mm"), Some(80.0), "the twin: pulled back by the wall");
    samples[2].undone = true;
    for (name, by_hand) in [
        ("tip_path_mm", 60.0),
        ("path_ratio", 60.0 / 40.0),
        ("tip_speed_mm_per_s", 30.0),
        ("submovements", 2.0),
        ("retracted_mm", 0.0),
    ] {
        assert_eq!(value(&samples, name), Some(by_hand), "{name}");
    }
    // Taken back into the wrong branch that was left: entered once.
    let mut branch = vec![
        sample(1.0, [100.0, -20.0], 20.0, 0.0),
        sample(2.0, [100.0, 0.0], -20.0, 0.0),
        sample(3.0, [100.0, -20.0], 0.0, 0.0),
    ];
    assert_eq!(value(&branch, "wrong_branches"), Some(2.0), "the twin: gone there");
    branch[2].undone = true;
    assert_eq!(value(&branch, "wrong_branches"), Some(1.0));
}

#[test]
fn what_was_not_recorded_has_no_value() {
    let bare = Record { beam: None, ..record() };
    let metrics = assess(&bare, None);
    let none: Vec<&str> =
        metrics.iter().filter(|metric| metric.value.is_none()).map(|metric| metric.name).collect();
    for name in
        ["beam_on_s", "kerma_ugy", "runs", "moving_without_beam_s", "path_ratio", "wrong_branches", "arrived"]
    {
        assert!(none.contains(&name), "{name} {none:?}");
    }
    assert!(!none.contains(&"total_s") && !none.contains(&"wall_force_n"));
    // A beam that was never on was on for 0, which has no sign.
    let dark = assess(&Record { beam: Some(Vec::new()), ..record() }, None);
    for name in ["beam_on_s", "kerma_ugy"] {
        let value = dark.iter().find(|metric| metric.name == name).unwrap().value.unwrap();
        assert!(value == 0.0 && value.is_sign_positive(), "{name} {value}");
    }
    assert!(Way::to_target(&tree(), "middle", 5.0).unwrap_err().to_string().contains("middle"));
}
