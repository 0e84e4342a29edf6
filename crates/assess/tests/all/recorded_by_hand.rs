//! Two recorded sessions, a file of `play` and a folder of `run`, against values worked out by hand. A third one is in `by_hand.rs`.

use crate::fork;

use std::f64::consts::TAU;
use std::path::Path;

use endowire_assess::{Metric, Record, SessionFile, Way, assess};
use endowire_core::device::{Device, Instrument, Section, Stack};
use fork::tree;
use serde_json::{Value, json};

fn way(name: &str) -> Way {
    Way::to_target(&tree(), name, 5.0).unwrap().unwrap()
}

fn value(metrics: &[Metric], name: &str) -> Option<f64> {
    metrics.iter().find(|metric| metric.name == name).unwrap().value
}

/// What these records do not tell of the beam.
const NOT_TOLD: [&str; 4] =
    ["entrance_ugy", "entrance_area_ugycm2", "acquisition_s", "moving_in_acquisition_s"];

/// Holds all measures but the spectral arc length against values by hand; none where there must be none.
fn check(metrics: &[Metric], by_hand: &[(&str, Option<f64>)]) {
    for (name, expected) in by_hand {
        match (value(metrics, name), expected) {
            (Some(value), Some(expected)) => {
                assert!((value - expected).abs() < 1e-9, "{name}: {value}, by hand {expected}");
            }
            (value, expected) => assert_eq!(value, *expected, "{name}"),
        }
    }
    assert_eq!(metrics.len(), by_hand.len() + 1, "all but the spectral arc length");
}

/// Less the arc length of the spectrum of speeds, by the sum that defines it: amplitudes of 16 times as many values as the next power of two,
/// both axes scaled to one, to the last amplitude of 5 % of the largest.
fn arc_length_by_sums(speeds: &[f64]) -> f64 {
    let count = 16 * speeds.len().next_power_of_two();
    let amplitude = |k: usize| {
        let of = |turn: fn(f64) -> f64| -> f64 {
            speeds
                .iter()
                .enumerate()
                .map(|(n, v)| v * turn(TAU * ((k * n) % count) as f64 / count as f64))
                .sum()
        };
        of(f64::cos).hypot(of(f64::sin))
    };
    let amplitudes: Vec<f64> = (0..=count / 2).map(amplitude).collect();
    let largest = amplitudes.iter().copied().fold(0.0, f64::max);
    let last = amplitudes.iter().rposition(|value| *value >= 0.05 * largest).unwrap();
    let pieces = amplitudes[..=last].windows(2);
    -pieces.map(|pair| (1.0 / last as f64).hypot((pair[1] - pair[0]) / largest)).sum::<f64>()
}

/// One sample of a wire and its catheter: time, tip, forces of the wall and at the tip, and of each hand advance, turn, length in, push, torque and tip.
fn sample(time_s: f64, tip: [f64; 2], forces: [f64; 2], hands: [([f64; 5], [f64; 2]); 2]) -> Value {
    let hand = |([advance_mm, rotate_rad, inserted_mm, push_force_n, torque_nmm], [x, y]): (
        [f64; 5],
        [f64; 2],
    )| {
        json!({
            "advance_mm": advance_mm, "rotate_rad": rotate_rad, "inserted_mm": inserted_mm, "push_force_n": push_force_n,
            "torque_nmm": torque_nmm, "tip_mm": [x, y, 0.0],
        })
    };
    json!({
        "time_s": time_s, "tip_mm": [tip[0], tip[1], 0.0], "wall_force_n": forces[0], "tip_force_n": forces[1], "jumped": false,
        "hands": hands.map(hand),
    })
}

/// Six seconds into the right branch: together, a rest, the wire, the catheter past it, the wire again while the catheter is pulled back.
fn session() -> String {
    let beam = |time_s: f64, on: bool, primary_deg: f64| {
        json!({
            "time_s": time_s, "on": on, "frames_per_s": 7.5, "dose_ngy": 40.0, "field_mm2": 20_000.0, "primary_deg": primary_deg,
            "secondary_deg": 0.0,
        })
    };
    let quarter = 0.25 * TAU;
    let samples = [
        sample(
            1.0,
            [20.0, 0.0],
            [0.05, 0.0],
            [([20.0, quarter, 20.0, 0.04, 0.1], [20.0, 0.0]), ([10.0, 0.0, 10.0, 0.02, 0.0], [10.0, 0.0])],
        ),
        sample(
            2.0,
            [20.0, 0.0],
            [0.05, 0.0],
            [([0.0, 0.0, 20.0, 0.04, 0.1], [20.0, 0.0]), ([0.0, 0.0, 10.0, 0.02, 0.0], [10.0, 0.0])],
        ),
        sample(
            4.0,
            [100.0, 0.0],
            [0.2, 0.02],
            [([80.0, 0.0, 100.0, 0.1, 0.1], [100.0, 0.0]), ([0.0, 0.0, 10.0, -0.01, 0.0], [10.0, 0.0])],
        ),
        sample(
            5.0,
            [100.0, 0.0],
            [0.1, 0.002],
            [([0.0, 0.0, 100.0, 0.0, 0.1], [100.0, 0.0]), ([100.0, 0.0, 110.0, 0.3, 0.0], [100.0, 0.0])],
        ),
        sample(
            6.0,
            [100.0, -47.0],
            [0.15, 0.15],
            [([57.0, 0.0, 157.0, 0.2, -0.4], [100.0, -47.0]), ([-20.0, 0.0, 90.0, 0.0, 0.0], [100.0, -10.0])],
        ),
    ];
    let injection = |time_s: f64, volume_ml: f64, rate_ml_per_s: f64, tip_force_n: f64| {
        let outlet = json!({"instrument": "catheter", "at_mm": [10.0, 0.0, 0.0], "tip_force_n": tip_force_n});
        json!({"time_s": time_s, "volume_ml": volume_ml, "rate_ml_per_s": rate_ml_per_s, "outlet": outlet})
    };
    json!({
        "scene_file": "a.toml", "set": [],
        "record": {
            "instruments": ["wire", "catheter"],
            "samples": samples,
            "injections": [injection(1.5, 5.0, 2.5, 0.0), injection(4.2, 3.0, 6.0, 0.002)],
            "beam": [beam(0.0, true, 0.0), beam(3.0, true, 30.0), beam(4.5, false, 30.0)],
        },
    })
    .to_string()
}

#[test]
fn a_session_of_two_instruments_is_measured_as_by_hand() {
    let record = Record::from_session(session().as_bytes(), Path::new("a.session.json")).unwrap();
    let metrics = assess(&record, Some(&way("right")));
    let by_hand = [
        ("total_s", 6.0),
        // The second sample alone.
        ("idle_s", 1.0),
        ("beam_on_s", 4.5),
        ("beam_on_idle_s", 1.0),
        // 4.5 s × 7.5 frames a second × 40 nGy, over 200 cm².
        ("kerma_ugy", 1.35),
        ("kerma_area_ugycm2", 270.0),
        ("runs", 1.0),
        // 4.5 s × 7.5 frames a second, in whole frames.
        ("frames", 34.0),
        ("field_cm2", 200.0),
        ("c_arm_moves", 1.0),
        ("contrast_ml", 8.0),
        ("injections", 2.0),
        ("largest_rate_ml_per_s", 6.0),
        // The second injection begins with 2 mN at the catheter's tip; the first one with none.
        ("against_wall_ml", 3.0),
        // From 20 mm: 80 mm along the trunk, 47 mm into the branch, which is the way itself.
        ("tip_path_mm", 127.0),
        ("path_ratio", 1.0),
        // From 1 s on, but for 1 s of rest.
        ("tip_speed_mm_per_s", 127.0 / 4.0),
        // From 2 to 4 s with 40 mm/s, from 5 to 6 s with 47 mm/s.
        ("submovements", 2.0),
        ("submovement_s", 1.5),
        // The catheter's hand, once.
        ("reversals", 1.0),
        ("turns", 0.25),
        ("needless_turns", 0.0),
        ("retracted_mm", 20.0),
        ("wall_force_n", 0.2),
        // 0.05 N for 2 s, 0.1 for 1 s, 0.15 for 1 s, 0.2 for 2 s: 5.7 s of six are in the last.
        ("wall_force_95_n", 0.2),
        ("tip_force_n", 0.15),
        ("wall_impulse_ns", 0.05 + 0.05 + 0.4 + 0.1 + 0.15),
        ("hand_force_n", 0.3),
        ("hand_torque_nmm", 0.4),
        ("jumps", 0.0),
        // 110 mm over 100 mm in the fourth sample.
        ("catheter_ahead_s", 1.0),
        // From 4.5 s on, of five in which a hand moves.
        ("moving_without_beam_s", 1.5),
        ("unseen_share", 0.3),
        // The catheter: 100 mm in the fourth second.
        ("push_speed_mm_per_s", 100.0),
        ("wrong_branches", 0.0),
        ("time_in_trunk_s", 6.0),
        ("arrived", 1.0),
        ("placement_error_mm", 3.0),
    ];
    let known = by_hand.iter().map(|(name, value)| (*name, Some(*value)));
    let unknown = NOT_TOLD.iter().chain(&["packing_density", "coil_outside_mm"]).map(|name| (*name, None));
    check(&metrics, &known.chain(unknown).collect::<Vec<_>>());
    // Twenty samples a second from 1 s on.
    let speeds = [(20, 0.0), (40, 40.0), (20, 0.0), (20, 47.0)];
    let speeds: Vec<f64> = speeds.iter().flat_map(|(count, speed)| vec![*speed; *count]).collect();
    // The movement after the rest, which ends at 2 s.
    let (reported, expected) = (value(&metrics, "spectral_arc_length"), arc_length_by_sums(&speeds[20..]));
    assert!((reported.unwrap() - expected).abs() < 1e-9, "{reported:?}, by sums {expected}");
    // The catheter's tip ends 10 mm into the branch, 40 mm before the target.
    let metrics = assess(&record, Some(&way("right").for_instrument(1)));
    assert_eq!((value(&metrics, "arrived"), value(&metrics, "placement_error_mm")), (Some(0.0), Some(40.0)));
}

const STEPS: &str = "\
step,advance_mm,rotate_rad,inserted_mm,nodes,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm,jumped,wall_force_sum_n,wall_force_tip_n,time_s
1,10,0,10,3,10,0,0,0.1,0.2,false,0.2,0,2
2,-4,-3.141592653589793,6,3,6,0,0,-0.15,-0.5,true,0.4,0.1,3
3,44,0,50,5,50,0,0,0.3,0.1,false,0.1,0.05,5
";
const INJECTIONS: &str = "\
after_step,time_s,instrument,volume_ml,rate_ml_per_s,inserted_mm,tip_x_mm,tip_y_mm,tip_z_mm
1,2.5,device,2,1,10,10,0,0
";
const PACKING: &str = "\
step,coils_mm3,packing,neck_coverage,outside_mm,herniated,dome_force_n
1,2,0.02,0.1,0,false,0
2,2,0.02,0.1,0,false,0
3,12,0.12,0.3,2.5,true,0.01
";

#[test]
fn a_folder_of_a_run_is_measured_as_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("steps.csv", STEPS), ("injections.csv", INJECTIONS), ("packing.csv", PACKING)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let metrics = assess(&Record::read(folder.path()).unwrap(), Some(&way("left")));
    let by_hand = [
        ("total_s", Some(5.0)),
        ("idle_s", Some(0.0)),
        ("beam_on_s", None),
        ("beam_on_idle_s", None),
        ("kerma_ugy", None),
        ("kerma_area_ugycm2", None),
        ("runs", None),
        ("frames", None),
        ("field_cm2", None),
        ("c_arm_moves", None),
        ("contrast_ml", Some(2.0)),
        ("injections", Some(1.0)),
        ("largest_rate_ml_per_s", Some(1.0)),
        // It begins in the second step, with 0.1 N at the tip.
        ("against_wall_ml", Some(2.0)),
        // 4 mm back and 44 mm on, between places 40 mm apart.
        ("tip_path_mm", Some(48.0)),
        ("path_ratio", Some(1.2)),
        // In the last three seconds.
        ("tip_speed_mm_per_s", Some(16.0)),
        // From 2 to 5 s with 4 and 22 mm/s, and between them the hand turns back.
        ("submovements", Some(2.0)),
        ("submovement_s", Some(1.5)),
        ("reversals", Some(2.0)),
        ("turns", Some(0.5)),
        // Half a turn is the shortest way to where it leads.
        ("needless_turns", Some(0.0)),
        ("retracted_mm", Some(4.0)),
        ("wall_force_n", Some(0.4)),
        // 0.1 N for 2 s, 0.2 for 2 s, 0.4 for 1 s: 4.75 s of five are in the last.
        ("wall_force_95_n", Some(0.4)),
        ("tip_force_n", Some(0.1)),
        ("wall_impulse_ns", Some(0.4 + 0.4 + 0.2)),
        ("hand_force_n", Some(0.3)),
        ("hand_torque_nmm", Some(0.5)),
        ("jumps", Some(1.0)),
        ("catheter_ahead_s", None),
        ("moving_without_beam_s", None),
        ("unseen_share", None),
        // 44 mm in the last two seconds.
        ("push_speed_mm_per_s", Some(22.0)),
        ("wrong_branches", Some(0.0)),
        ("time_in_trunk_s", None),
        ("arrived", Some(0.0)),
        // 50 mm along and 50 mm across.
        ("placement_error_mm", Some(50.0 * 2.0f64.sqrt())),
        ("packing_density", Some(0.12)),
        ("coil_outside_mm", Some(2.5)),
    ];
    let unknown = NOT_TOLD.iter().map(|name| (*name, None));
    check(&metrics, &by_hand.iter().copied().chain(unknown).collect::<Vec<_>>());
    let speeds: Vec<f64> = [vec![4.0; 20], vec![22.0; 40]].concat();
    let (reported, expected) = (value(&metrics, "spectral_arc_length").unwrap(), arc_length_by_sums(&speeds));
    assert!((reported - expected).abs() < 1e-9, "{reported}, by sums {expected}");
}

#[test]
fn a_run_goes_on_until_what_it_has_injected_has_flowed() {
    let folder = tempfile::tempdir().unwrap();
    let late = INJECTIONS.replace("1,2.5,device,2,1", "3,5,device,2,1");
    for (name, text) in [("steps.csv", STEPS), ("injections.csv", &late)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let record = Record::read(folder.path()).unwrap();
    let metrics = assess(&record, Some(&way("left")));
    assert_eq!((value(&metrics, "total_s"), value(&metrics, "idle_s")), (Some(7.0), Some(2.0)));
    assert_eq!((value(&metrics, "contrast_ml"), value(&metrics, "tip_path_mm")), (Some(2.0), Some(48.0)));
    let outlet = record.injections[0].outlet.as_ref().unwrap();
    assert_eq!((outlet.instrument.as_deref(), outlet.at_mm.x), (Some("device"), 10.0));
}

const BEAM: &str = "time_s,on,frames_per_s,dose_ngy,field_mm2,primary_deg,secondary_deg\n0,true,15,30,40000,0,0\n4,false,15,30,40000,0,0\n";

/// Reads the folder of a run with this log of the beam.
fn with_beam(beam: &str) -> Result<Record, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("steps.csv", STEPS), ("beam.csv", beam)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    Record::read(folder.path()).map_err(|error| error.to_string())
}

#[test]
fn a_log_of_the_beam_that_cannot_be_is_refused_by_key_and_value() {
    assert_eq!(with_beam(BEAM).unwrap().beam.unwrap().len(), 2, "the twin");
    let header = BEAM.lines().next().unwrap();
    for (log, reported) in [
        (String::new(), "beam = empty: no state of the beam"),
        (format!("{header}\n"), "beam = empty: no state of the beam"),
        (BEAM.replace(",30,", ",-30,"), "beam[0].dose_ngy = -30: must be a finite number of 0 or more"),
        (BEAM.replace(",30,", ",nan,"), "beam[0].dose_ngy = NaN: must be a finite number"),
        (BEAM.replace("\n0,true", "\n-100,true"), "beam[0].time_s = -100: must be"),
        (
            BEAM.replace("\n0,true", "\n5,true"),
            "beam[1].time_s = 4: comes after 5: put beam in order of time",
        ),
        (BEAM.replace("40000", "-1"), "beam[0].field_mm2 = -1: must be"),
        (BEAM.replace("true", "yes"), "line 2: on: "),
        (BEAM.replace("true", "1"), "a row of this log has time_s, on (true or false), frames_per_s"),
        (BEAM.replace("dose_ngy", "dose"), "unknown field `dose`"),
    ] {
        let error = with_beam(&log).unwrap_err();
        assert!(error.contains("beam.csv: ") && error.contains(reported), "{error}\n{reported}");
        assert!(!error.contains("give the folder of a recorded run"), "{error}");
    }
}

#[test]
fn a_session_that_cannot_be_is_refused_by_key_and_value() {
    let read = |text: &str| Record::from_session(text.as_bytes(), Path::new("a.session.json"));
    let whole: Value = serde_json::from_str(&session()).unwrap();
    assert!(read(&whole.to_string()).is_ok(), "the twin");
    for (pointer, value, reported) in [
        ("/record/start_mm", json!([1e9, 0.0, 0.0]), "record.start_mm = [1e9, 0, 0]: must be three"),
        ("/record/samples/2/time_s", json!(0.0), "record.samples[2].time_s = 0: comes after 2"),
        ("/record/samples/2/wall_force_n", json!(-5.0), "record.samples[2].wall_force_n = -5: must be"),
        ("/record/injections/0/volume_ml", json!(-5.0), "record.injections[0].volume_ml = -5: must be"),
        ("/record/injections/1/rate_ml_per_s", json!(0.0), "record.injections[1].rate_ml_per_s = 0: must be"),
        ("/record/injections/1/outlet/tip_force_n", json!(-1.0), "injections[1].outlet.tip_force_n = -1"),
        ("/record/beam/0/dose_ngy", json!(-1.0), "record.beam[0].dose_ngy = -1: must be"),
        ("/record/beam", json!([]), "record.beam = empty"),
        ("/record/samples", json!([]), "record.samples = []: nothing was done"),
        ("/record/samples/2/hands", json!([]), "record.samples[2].hands = 0 hands: must be one for each"),
        ("/record/instruments", json!(["wire"]), "record.samples[0].hands = 2 hands: must be one for each"),
        ("/record/instruments", json!(["wire", "a", "b"]), "record.samples[0].hands = 2 hands: must be one"),
        (
            "/record/instruments",
            json!([]),
            "2 hands: must be one for each of instruments, which has no names",
        ),
        (
            "/record/instruments",
            json!(["wire", "wire"]),
            "record.instruments[1] = \"wire\": each instrument has",
        ),
        (
            "/record/samples/2/hands/0/inserted_mm",
            json!(-50.0),
            "samples[2].hands[0].inserted_mm = -50: must",
        ),
        ("/record/samples/2/tip_mm", json!([1e300, 0.0, 0.0]), "samples[2].tip_mm = [1e300, 0, 0]: must be"),
        ("/record/beam/0/dose_ngy", json!(1e300), "record.beam[0].dose_ngy = 1e300: must be"),
        (
            "/record/injections/0/outlet/instrument",
            json!("cathter"),
            "injections[0].outlet.instrument = \"cathter\": is no instrument of the record, which has wire, catheter; \
             did you mean \"catheter\"?",
        ),
        ("/recorded", json!(1), "unknown field `recorded`"),
        ("/record/samples/0/hands/0/pushed", json!(1), "unknown field `pushed`"),
        ("/record/injections/0/through", json!("wire"), "unknown field `through`"),
    ] {
        let mut other = whole.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        match other.pointer_mut(pointer) {
            Some(known) => *known = value,
            None => other.pointer_mut(parent).unwrap()[key] = value,
        }
        let error = read(&other.to_string()).unwrap_err().to_string();
        assert!(error.starts_with("a.session.json: ") && error.contains(reported), "{error}\n{reported}");
    }
}

/// A wire and its catheter in three steps, and what the catheter injects.
const HANDS: &str = "\
step,instrument,advance_mm,rotate_rad,inserted_mm,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm
1,wire,10,0,10,10,0,0,0.1,0.2
1,catheter,5,0,5,5,0,0,0.1,0
2,wire,-4,0,6,6,0,0,,0
2,catheter,0,0,5,5,0,0,0.1,0
3,wire,44,0,50,50,0,0,0.1,0
3,catheter,0,0,5,5,0,0,0.1,0
";

#[test]
fn a_run_that_steers_is_a_hand_that_moves() {
    let read = |steered: [f64; 3]| {
        let folder = tempfile::tempdir().unwrap();
        let mut lines = HANDS.lines();
        let mut text = format!("{},steer\n", lines.next().unwrap());
        for (index, line) in lines.enumerate() {
            let value = if index % 2 == 1 { steered[index / 2] } else { 0.0 };
            text += &format!("{line},{value}\n");
        }
        std::fs::write(folder.path().join("steps.csv"), STEPS).unwrap();
        std::fs::write(folder.path().join("instruments.csv"), text).unwrap();
        Record::read(folder.path()).unwrap()
    };
    let by = |record: &Record| -> Vec<f64> {
        record.samples.iter().map(|sample| sample.hands[1].steer_by).collect()
    };
    let steered = read([0.0, 0.25, -0.25]);
    assert_eq!(by(&steered), [0.0, 0.25, -0.5]);
    assert!(steered.samples.iter().all(|sample| sample.hands[0].steer_by == 0.0));
    assert_eq!(by(&read([0.0; 3])), [0.0; 3], "the twin");
    // The same as a session, and what is not steered is not in its file.
    let text = |record: &Record| serde_json::to_string(record).unwrap();
    let again: Record = serde_json::from_str(&text(&steered)).unwrap();
    assert!(again == steered && !text(&read([0.0; 3])).contains("steer"));
}

#[test]
fn tables_of_a_run_that_do_not_fit_each_other_are_refused() {
    let whole = |name: &str| match name {
        "steps.csv" => STEPS.to_owned(),
        "instruments.csv" => HANDS.to_owned(),
        "injections.csv" => INJECTIONS.replace("device", "catheter"),
        "packing.csv" => PACKING.to_owned(),
        _ => r#"{"schema": 1, "steps": 3, "complete": true}"#.to_owned(),
    };
    let files = ["steps.csv", "instruments.csv", "injections.csv", "packing.csv", "summary.json"];
    let read = |changed: &[(&str, String)]| {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|name| std::fs::write(folder.path().join(name), whole(name)).unwrap());
        changed.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
        Record::read(folder.path()).map_err(|error| error.to_string())
    };
    let record = read(&[]).unwrap();
    assert_eq!(
        (record.instruments.as_slice(), record.samples.len()),
        (&["wire", "catheter"].map(str::to_owned)[..], 3)
    );
    let lines = |name: &str, count: usize| {
        whole(name).lines().take(count).map(|line| format!("{line}\n")).collect::<String>()
    };
    let cut = |name: &str, bytes: usize| whole(name)[..whole(name).len() - bytes].to_owned();
    // Killed while it wrote the last rows, of a step that its summary does not count yet.
    let killed = ("summary.json", r#"{"schema": 1, "steps": 2, "complete": false}"#.to_owned());
    let ends_at = |record: Record| record.samples.last().unwrap().tip_mm.unwrap().x;
    assert_eq!(ends_at(record), 50.0);
    assert_eq!(ends_at(read(&[killed.clone(), ("steps.csv", cut("steps.csv", 5))]).unwrap()), 6.0);
    let half = [
        killed.clone(),
        ("steps.csv", lines("steps.csv", 3)),
        ("instruments.csv", cut("instruments.csv", 5)),
    ];
    assert_eq!(ends_at(read(&half).unwrap()), 6.0);
    for (name, text, reported) in [
        ("steps.csv", cut("steps.csv", 5), "step = 2: is the last one, and summary.json counts 3 steps"),
        ("steps.csv", lines("steps.csv", 3), "step = 2: is the last one, and summary.json counts 3 steps"),
        ("steps.csv", lines("steps.csv", 1), "steps = []: it has no step"),
        ("steps.csv", String::new(), "steps = []: it has no step"),
        ("steps.csv", STEPS.replace("\n2,", "\n4,"), "step = 4: comes after step 1"),
        ("steps.csv", STEPS.replace("0.2,0,2\n", "-0.2,0,2\n"), "step[1].wall_force_n = -0.2: must be"),
        (
            "summary.json",
            r#"{"schema": 1, "steps": 2, "complete": true}"#.to_owned(),
            "step = 3: is the last one, and summary",
        ),
        (
            "instruments.csv",
            lines("instruments.csv", 5),
            "step = 3: is missing from line 6 on, and steps.csv has it",
        ),
        (
            "instruments.csv",
            cut("instruments.csv", 5),
            "step[3].instrument = [wire]: those of the run are [wire, catheter]",
        ),
        (
            "instruments.csv",
            lines("instruments.csv", 1),
            "step = 1: is missing from line 2 on, and steps.csv has it",
        ),
        (
            "instruments.csv",
            HANDS.replace("5,5,0,0", "-5,5,0,0"),
            "step[1].catheter.inserted_mm = -5: must be",
        ),
        ("packing.csv", lines("packing.csv", 2), "step = 2: is missing from line 3 on, and steps.csv has it"),
        (
            "injections.csv",
            INJECTIONS.replace("device", "cathter"),
            "injections[0].outlet.instrument = \"cathter\"",
        ),
        (
            "injections.csv",
            whole("injections.csv").replace("\n1,", "\n800,"),
            "after_step = 800: steps.csv ends with step 3",
        ),
    ] {
        let error = read(&[(name, text)]).unwrap_err();
        let file = if name == "summary.json" { "steps.csv" } else { name };
        assert!(error.contains(&format!("{file}: ")) && error.contains(reported), "{error}\n{reported}");
    }
}

/// A device of 200 mm for each of these names.
fn stack(names: &[&str]) -> Stack {
    let one = |name: &&str| {
        let section = Section { inner_radius_mm: Some(0.4), ..Section::straight(200.0, 0.5, 1.0) };
        Instrument { name: (*name).to_owned(), device: Device::new(vec![section]).unwrap(), may_lead: true }
    };
    Stack::new(names.iter().map(one).collect()).unwrap()
}

#[test]
fn a_record_of_other_instruments_than_the_scenes_is_refused() {
    let record = Record::from_session(session().as_bytes(), Path::new("a.session.json")).unwrap();
    let reported = |record: &Record, names: &[&str]| record.check_in(&stack(names)).unwrap_err().to_string();
    assert!(record.check_in(&stack(&["wire", "catheter"])).is_ok());
    for names in [&["wire"][..], &["wire", "sheath"], &["catheter", "wire"], &["wire", "micro", "catheter"]] {
        let error = reported(&record, names);
        assert!(
            error.starts_with(&format!(
                "instruments = [wire, catheter]: the scene has [{}]",
                names.join(", ")
            )),
            "{error}"
        );
    }
    let mut long = record.clone();
    long.samples[2].hands[1].inserted_mm = 5000.0;
    let error = reported(&long, &["wire", "catheter"]);
    assert!(error.contains("samples[2].hands[1].inserted_mm = 5000: catheter is 200 mm long"), "{error}");
    // The folder of a run of several without their table is that of none of them.
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("steps.csv", STEPS), ("injections.csv", INJECTIONS)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let alone = Record::read(folder.path()).unwrap();
    assert!(alone.check_in(&stack(&["device"])).is_ok());
    assert!(
        reported(&alone, &["wire", "catheter"]).contains("instruments = []: the scene has [wire, catheter]")
    );
    let error = reported(&alone, &["wire"]);
    assert!(error.contains("injections[0].outlet.instrument = \"device\": is no instrument"), "{error}");
}

#[test]
fn the_folder_of_a_run_says_where_its_way_began_and_in_which_scene() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("steps.csv", STEPS);
    let error = SessionFile::read(folder.path()).unwrap_err().to_string();
    assert!(error.contains("summary.json: says which scene the run is of"), "{error}");
    let length_mm = |summary: &str| {
        write("summary.json", summary);
        value(&assess(&Record::read(folder.path()).unwrap(), None), "tip_path_mm").unwrap()
    };
    let without = length_mm(r#"{"schema": 1, "scene_file": "a.toml", "steps": 3}"#);
    assert_eq!(without, 48.0);
    let with =
        length_mm(r#"{"schema": 1, "scene_file": "a.toml", "set": ["seed=2"], "start_mm": [7.0, 0.0, 0.0]}"#);
    assert_eq!(with, 48.0 + 3.0, "3 mm in the first step");
    let session = SessionFile::read(folder.path()).unwrap();
    assert_eq!(
        (session.scene_file.as_path(), session.set.as_slice()),
        (Path::new("a.toml"), &["seed=2".to_owned()][..])
    );
}

#[test]
fn a_session_of_another_scene_than_the_subjects_is_refused_unless_pictures_alone_differ() {
    let set = |set: &[&str]| -> Vec<String> { set.iter().map(|&one| one.to_owned()).collect() };
    let mut file = SessionFile::parse(session().as_bytes(), Path::new("a.session.json")).unwrap();
    let checked = |file: &SessionFile, scene: &str, of_subject: &[&str]| {
        let path = Path::new("a.session.json");
        let checked =
            file.check_in((Path::new(scene), &set(of_subject)), &stack(&["wire", "catheter"]), path);
        checked.map_err(|error| error.to_string())
    };
    assert!(checked(&file, "a.toml", &[]).is_ok() && checked(&file, "a.toml", &["view.every=3"]).is_ok());
    let error = checked(&file, "b.toml", &[]).unwrap_err();
    assert!(
        error.starts_with("a.session.json: was recorded in a.toml, and the subject is in b.toml"),
        "{error}"
    );
    file.set = set(&["view.every=1000", "seed=2", "view.camera.orbit_deg=9"]);
    assert!(checked(&file, "a.toml", &["seed=2"]).is_ok());
    // Times are counted in frames, and doses are those of the beam.
    for setting in ["vessel.wall.friction=0.5", "view.frames_per_s=5", "view.detector.dose_ngy=9"] {
        file.set = set(&[setting]);
        assert!(checked(&file, "a.toml", &[]).unwrap_err().contains(setting));
    }
    // More is in than there is.
    file.set = vec![];
    file.record.samples[1].hands[0].inserted_mm = 1e9;
    let error = checked(&file, "a.toml", &[]).unwrap_err();
    assert!(error.contains("a.session.json: samples[1].hands[0].inserted_mm = 1e9: wire is"), "{error}");
}

#[test]
fn a_session_in_which_nothing_was_done_is_read_and_has_no_measures() {
    let mut text: Value = serde_json::from_str(&session()).unwrap();
    for (key, list) in [("samples", json!([])), ("injections", json!([])), ("beam", json!([]))] {
        text["record"][key] = list;
    }
    let path = Path::new("a.session.json");
    let file = SessionFile::parse(text.to_string().as_bytes(), path).unwrap();
    assert!(file.record.is_empty());
    let checked = file.check_in((Path::new("a.toml"), &[]), &stack(&["wire", "catheter"]), path);
    assert!(checked.unwrap_err().to_string().contains("samples = []: nothing was done"));
    let error = Record::from_session(text.to_string().as_bytes(), path).unwrap_err().to_string();
    assert_eq!(
        error,
        "a.session.json: record.samples = []: nothing was done: give a session in which time went by"
    );
}
