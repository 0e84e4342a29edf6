//! Scripts: invalid ones, and their division into steps.

use super::*;
use crate::device::{Instrument, Section};
use crate::insertion::Move;

fn advance(mm: f64, step: f64) -> ScriptLine {
    ScriptLine { advance_mm: Some(mm), step_mm: Some(step), ..Default::default() }
}

/// The commands of a device of 100 mm.
fn commands(script: &[ScriptLine]) -> Result<Vec<Command>> {
    script_commands(script, &Device::uniform(100.0, 0.4, 10.0)?)
}

#[test]
fn a_line_is_cut_into_equal_increments_no_larger_than_its_step() {
    let list = commands(&[advance(0.3, 0.1)]).unwrap();
    assert_eq!(list.len(), 3);
    assert!((list.iter().map(|c| c.advance_mm).sum::<f64>() - 0.3).abs() < 1e-15);
    assert_eq!(commands(&[advance(1.05, 0.5)]).unwrap().len(), 3);
}

#[test]
fn turning_and_pushing_in_one_line_happen_together() {
    let line = ScriptLine {
        retract_mm: Some(4.0),
        rotate_deg: Some(90.0),
        step_mm: Some(1.0),
        step_deg: Some(10.0),
        ..Default::default()
    };
    let list = commands(&[advance(4.0, 4.0), line]).unwrap();
    assert_eq!(list.len(), 10);
    assert!(list[1..].iter().all(|c| c.advance_mm < 0.0 && c.rotate_rad > 0.0));
}

#[test]
fn a_bad_line_is_named_with_its_key() {
    for (line, key) in [
        (advance(-1.0, 1.0), "script[1].advance_mm = -1"),
        (advance(f64::NAN, 1.0), "script[1].advance_mm = NaN"),
        (advance(1.0, 0.0), "script[1].step_mm = 0"),
        (advance(1e9, 1e-9), "script[1]"),
        (ScriptLine::default(), "script[1]"),
        (ScriptLine { retract_mm: Some(1.0), ..advance(1.0, 1.0) }, "script[1].advance_mm = 1"),
    ] {
        let message = commands(&[advance(1.0, 1.0), line]).unwrap_err().to_string();
        assert!(message.starts_with(key), "{message}");
    }
}

/// The moves of every step if no condition is met.
fn steps(script: &Script) -> Vec<Vec<Move>> {
    let (mut run, mut steps) = (script.begin(), Vec::new());
    while let Some(step) = run.next_where(|_| None).unwrap() {
        steps.push(step.moves.to_vec());
        run.carried_out();
    }
    steps
}

/// Two wires that take turns in a catheter.
fn stack() -> Stack {
    let one = |name: &str, section: Section| Instrument {
        name: name.to_owned(),
        device: Device::new(vec![section]).unwrap(),
        may_lead: true,
    };
    let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(100.0, 0.8, 60.0) };
    Stack::new(vec![
        one("wire", Section::straight(200.0, 0.3, 20.0)),
        one("stiff wire", Section::straight(200.0, 0.4, 90.0)),
        one("catheter", catheter),
    ])
    .unwrap()
}

fn line(instrument: &str) -> ScriptLine {
    ScriptLine { instrument: Some(instrument.to_owned()), ..Default::default() }
}

#[test]
fn instruments_move_together_and_a_wire_is_exchanged() {
    let script = [
        ScriptLine {
            advance_mm: Some(30.0),
            with: vec![ScriptLine { advance_mm: Some(60.0), step_mm: Some(20.0), ..line("catheter") }],
            ..line("wire")
        },
        ScriptLine { withdraw: true, step_mm: Some(20.0), ..line("wire") },
        ScriptLine { advance_mm: Some(70.0), step_mm: Some(70.0), ..line("stiff wire") },
    ];
    let script = Script::new(&script, &stack(), &[10.0, 0.0, 0.0], None).unwrap();
    let steps = steps(&script);
    assert_eq!((script.len(), steps.len()), (33, 33));
    let reported = |step: usize| -> Vec<(usize, f64)> {
        steps[step].iter().map(|one| (one.instrument, one.command.advance_mm)).collect()
    };
    assert_eq!(reported(0), [(0, 1.0), (2, 2.0)]);
    assert_eq!((reported(30), reported(32)), (vec![(0, -20.0)], vec![(1, 70.0)]));
}

#[test]
fn a_script_says_which_instrument_moves_and_what_does_not_go_is_reported_before_it_begins() {
    let advance = |name: &str, mm| ScriptLine { advance_mm: Some(mm), ..line(name) };
    let both = ScriptLine { with: vec![advance("wire", 1.0)], ..advance("wire", 1.0) };
    let deep = ScriptLine { with: vec![both.clone()], ..advance("catheter", 1.0) };
    for (script, reported) in [
        (vec![advance("cathter", 1.0)], "script[0].instrument = \"cathter\": did you mean \"catheter\"?"),
        (vec![self::advance(1.0, 1.0)], "script[0].instrument = none: say which one moves: wire, stiff wire"),
        (vec![both], "script[0].with[0].instrument = \"wire\": moves in this line already"),
        (vec![deep], "script[0].with[0].with = 1: is with another line already"),
        (
            vec![ScriptLine { withdraw: true, ..advance("wire", 1.0) }],
            "script[0].withdraw = true: pulls back all",
        ),
        (
            vec![ScriptLine { rotate_deg: Some(-720_000.0), step_deg: Some(720_000.0), ..line("wire") }],
            "script[0].rotate_deg = -720000: in its step 1, is more than 1000 turns in one command",
        ),
        (vec![advance("wire", 201.0)], "script[0].advance_mm = 201: in its step 201, the device is 200 mm"),
        (
            vec![advance("wire", 5.0), advance("stiff wire", 5.0)],
            "script[1]: in its step 1, wire.radius_mm = 0.3: \"stiff wire\" has no lumen",
        ),
        (
            vec![advance("catheter", 20.0), advance("wire", 130.0)],
            "script[1]: in its step 121, wire.inserted_mm = 121: 80.000 mm of \"catheter\" are outside",
        ),
    ] {
        let error = Script::new(&script, &stack(), &[0.0; 3], None).unwrap_err().to_string();
        assert!(error.starts_with(reported), "{error}");
    }
}

#[test]
fn a_wire_is_exchanged_in_one_line_as_far_as_the_one_before() {
    let exchange = |advance_mm| ScriptLine {
        exchange: Some("stiff wire".to_owned()),
        advance_mm,
        step_mm: Some(10.0),
        ..line("wire")
    };
    let script =
        |advance_mm| Script::new(&[exchange(advance_mm)], &stack(), &[30.0, 0.0, 40.0], None).unwrap();
    let reported = |advance_mm| -> Vec<(usize, f64)> {
        let steps = steps(&script(advance_mm));
        steps.iter().map(|moves| (moves[0].instrument, moves[0].command.advance_mm)).collect()
    };
    assert_eq!(reported(None), [(0, -10.0), (0, -10.0), (0, -10.0), (1, 10.0), (1, 10.0), (1, 10.0)]);
    assert_eq!(reported(Some(10.0)), [(0, -10.0), (0, -10.0), (0, -10.0), (1, 10.0)]);
    for (line, reported) in [
        (
            ScriptLine { retract_mm: Some(1.0), ..exchange(None) },
            "script[0].retract_mm = 1: exchange withdraws",
        ),
        (
            ScriptLine { exchange: Some("wire".into()), ..exchange(None) },
            "script[0].exchange = \"wire\": one",
        ),
        (
            ScriptLine { exchange: Some("stif wire".into()), ..exchange(None) },
            "script[0].exchange = \"stif wire\": did",
        ),
    ] {
        let error = Script::new(&[line], &stack(), &[0.0; 3], None).unwrap_err().to_string();
        assert!(error.starts_with(reported), "{error}");
    }
}

#[test]
fn a_wire_is_exchanged_for_one_that_is_out() {
    let exchange = ScriptLine { exchange: Some("catheter".to_owned()), ..line("wire") };
    let reported = "script[0].exchange = \"catheter\": 10.000 mm of it are in already: withdraw it before";
    let error = Script::new(std::slice::from_ref(&exchange), &stack(), &[30.0, 0.0, 10.0], None).unwrap_err();
    assert!(error.to_string().starts_with(reported), "{error}");
    // Pulled back to the level of rounding.
    let back = ScriptLine { retract_mm: Some(0.3), step_mm: Some(0.1), ..line("catheter") };
    let lines = [back.clone(), back.clone(), back, exchange.clone()];
    assert!(Script::new(&lines, &stack(), &[30.0, 0.0, 0.9], None).is_ok());
    // After a condition this is reported when the line starts.
    let until = Some(Until { push_force_n: Some(0.5), ..Until::default() });
    let first = ScriptLine { advance_mm: Some(10.0), until, ..line("catheter") };
    let script = Script::new(&[first, exchange], &stack(), &[30.0, 0.0, 0.0], None).unwrap();
    let mut run = script.begin();
    for _ in 0..10 {
        run.next_where(|_| None).unwrap();
        run.carried_out();
    }
    let error = run.next_where(|_| None).unwrap_err().to_string();
    assert!(error.starts_with(&reported.replace("[0]", "[1]")), "{error}");
    assert!(script.begin().next_where(|_| Some(Met::PushForceN)).is_ok());
}

#[test]
fn conditions_that_have_decided_are_reported() {
    let until = |force| Some(Until { push_force_n: Some(force), ..Until::default() });
    let lines = [1.0, 2.0].map(|force| ScriptLine { until: until(force), ..advance(2.0, 1.0) });
    let script = Script::new(&lines, &Stack::from(Device::uniform(9.0, 0.4, 1.0).unwrap()), &[0.0], None);
    let script = script.unwrap();
    let mut run = script.begin();
    for decided in [vec![], vec![1.0], vec![1.0], vec![1.0, 2.0]] {
        run.next_where(|_| None).unwrap();
        let reported: Vec<f64> = run.decided().filter_map(|(_, condition)| condition.push_force_n).collect();
        assert_eq!(reported, decided);
        run.carried_out();
    }
}

#[test]
fn a_script_with_speeds_has_times_and_all_of_its_lines_have_one() {
    let timed = |mm: f64, speed| ScriptLine { speed_mm_per_s: speed, step_mm: Some(5.0), ..advance(mm, 5.0) };
    let turn = ScriptLine { speed_deg_per_s: Some(10.0), rotate_deg: Some(20.0), ..Default::default() };
    let stack = Stack::from(Device::uniform(100.0, 0.4, 10.0).unwrap());
    let lines = [timed(10.0, Some(2.0)), turn];
    let script = Script::new(&lines, &stack, &[0.0], None).unwrap();
    let (mut run, mut times) = (script.begin(), Vec::new());
    while let Some(step) = run.next_where(|_| None).unwrap() {
        times.push(step.time_s.unwrap());
        run.carried_out();
    }
    assert_eq!(times, [2.5, 5.0, 5.5, 6.0, 6.5, 7.0]);
    let reported = |lines: &[ScriptLine]| Script::new(lines, &stack, &[0.0], None).unwrap_err().to_string();
    assert!(reported(&[timed(1.0, Some(2.0)), timed(1.0, None)]).starts_with("script[1] = no speed"));
    assert!(reported(&[timed(1.0, Some(0.0))]).starts_with("script[0].speed_mm_per_s = 0: must be"));
}

#[test]
fn a_speed_of_a_motion_that_a_line_does_not_make_is_refused() {
    let stack = Stack::from(Device::uniform(100.0, 0.4, 10.0).unwrap());
    let script = |line: ScriptLine| Script::new(&[line], &stack, &[20.0], None);
    let turning = Some(5.0);
    let turn = |rotate_deg| ScriptLine { rotate_deg: Some(rotate_deg), ..Default::default() };
    let pushed = ScriptLine { speed_mm_per_s: Some(5.0), ..Default::default() };
    for (line, words) in [
        (
            ScriptLine { speed_deg_per_s: turning, ..advance(5.0, 1.0) },
            "script[0].speed_deg_per_s = 5: nothing",
        ),
        (
            ScriptLine { speed_deg_per_s: turning, withdraw: true, ..Default::default() },
            "script[0].speed_deg_per_s",
        ),
        (
            ScriptLine { rotate_deg: Some(90.0), ..pushed.clone() },
            "script[0].speed_mm_per_s = 5: the line only turns",
        ),
        (
            ScriptLine { rotate_deg: Some(0.0), speed_deg_per_s: turning, ..advance(5.0, 1.0) },
            "script[0].speed_deg_per_s",
        ),
    ] {
        let reported = script(line).unwrap_err().to_string();
        assert!(reported.starts_with(words), "{reported}");
    }
    // One speed of two motions, both speeds of one, and a line that a sweep has set to no length are as before.
    for line in [
        ScriptLine { rotate_deg: Some(90.0), speed_deg_per_s: turning, ..advance(5.0, 1.0) },
        ScriptLine { speed_deg_per_s: turning, speed_mm_per_s: Some(5.0), ..advance(5.0, 1.0) },
        ScriptLine { speed_deg_per_s: turning, ..turn(90.0) },
        ScriptLine { speed_deg_per_s: turning, ..turn(0.0) },
        ScriptLine { advance_mm: Some(0.0), ..pushed },
    ] {
        assert!(script(line).unwrap().is_timed());
    }
}

#[test]
fn hands_that_rest_take_steps_of_time_and_move_nothing() {
    let stack = Stack::from(Device::uniform(100.0, 0.4, 10.0).unwrap());
    let go = ScriptLine { speed_mm_per_s: Some(5.0), ..advance(10.0, 5.0) };
    let wait = |wait_s, step_s| ScriptLine { wait_s: Some(wait_s), step_s, ..Default::default() };
    let script = |lines: &[ScriptLine]| Script::new(lines, &stack, &[0.0], None);
    let resting = script(&[go.clone(), wait(1.0, Some(0.3)), go.clone()]).unwrap();
    assert!(resting.is_timed());
    assert_eq!(resting.len(), 2 + 4 + 2);
    let (mut run, mut seen) = (resting.begin(), Vec::new());
    while let Some(step) = run.next_where(|_| None).unwrap() {
        seen.push((step.moves.len(), step.time_s.unwrap()));
        run.carried_out();
    }
    assert_eq!(seen, [(1, 1.0), (1, 2.0), (0, 2.25), (0, 2.5), (0, 2.75), (0, 3.0), (1, 4.0), (1, 5.0)]);
    let mut seen = Vec::new();
    resting.go_on(run.course(), |step| seen.push(step.time_s)).unwrap();
    assert_eq!(seen.len(), 8);
    assert_eq!(script(&[wait(1.0, None)]).unwrap().len(), 10);
    let reported = |lines: &[ScriptLine]| script(lines).unwrap_err().to_string();
    for (line, words) in [
        (wait(0.0, None), "script[0].wait_s = 0: must be"),
        (wait(f64::NAN, None), "script[0].wait_s = NaN: must be"),
        (wait(1.0, Some(-1.0)), "script[0].step_s = -1: must be"),
        (wait(1e6, Some(1e-9)), "script[0] = 1e15 steps"),
        (ScriptLine { wait_s: Some(1.0), ..advance(1.0, 1.0) }, "script[0].wait_s = 1: hands rest"),
        (ScriptLine { step_s: Some(1.0), ..advance(1.0, 1.0) }, "script[0].step_s = 1: cuts the time"),
        (
            ScriptLine { wait_s: Some(1.0), instrument: Some("wir".to_owned()), ..Default::default() },
            "script[0].instrument",
        ),
    ] {
        assert!(reported(&[line]).starts_with(words), "{words}");
    }
    assert!(reported(&[wait(1.0, None), advance(1.0, 1.0)]).starts_with("script[1] = no speed"));
    let with = ScriptLine { with: vec![wait(1.0, None)], ..go };
    assert!(reported(&[with]).starts_with("script[0].with[0].wait_s = given"));
}

#[test]
fn a_line_with_solves_has_ticks_for_steps() {
    let stack = Stack::from(Device::uniform(100.0, 0.4, 10.0).unwrap());
    let script = |line: ScriptLine| Script::new(&[line], &stack, &[0.0], None);
    let solves = |solves: usize, line: ScriptLine| ScriptLine { solves: Some(solves), ..line };
    let wait = ScriptLine { wait_s: Some(1.0), ..Default::default() };
    for (line, count) in [(advance(2.0, 1.0), 2), (wait, 10)] {
        let ticks = script(solves(6, line.clone())).unwrap();
        let (mut run, mut seen) = (ticks.begin(), 0);
        while let Some(step) = run.next_where(|_| None).unwrap() {
            assert_eq!(step.solves, Some(6));
            seen += 1;
            run.carried_out();
        }
        assert_eq!(seen, count);
        assert!(ticks.moves().unwrap_err().to_string().starts_with("script[0].solves = 6: moves alone"));
        assert!(script(line).unwrap().moves().is_ok());
    }
    let inject = ScriptLine { inject: inject(1.0, 1.0, None), ..Default::default() };
    let with = ScriptLine { with: vec![solves(6, advance(1.0, 1.0))], ..advance(1.0, 1.0) };
    for (line, words) in [
        (solves(0, advance(1.0, 1.0)), "script[0].solves = 0: allow at least one"),
        (solves(6, inject), "script[0].solves = 6: a line that only injects"),
        (with, "script[0].with[0].solves = given"),
    ] {
        let reported = script(line).unwrap_err().to_string();
        assert!(reported.starts_with(words), "{reported}");
    }
}

#[test]
fn what_ends_a_line_is_checked_and_lengths_after_it_are_known_within_bounds() {
    let tree = crate::vessel::anatomy::tree("aortic_arch").unwrap();
    let until = |until: Until, mm| ScriptLine { until: Some(until), ..advance(mm, 1.0) };
    let near = |target: &str| Until {
        tip_within_mm: Some(2.0),
        target: Some(target.to_owned()),
        ..Until::default()
    };
    let force = Until { push_force_n: Some(0.5), ..Until::default() };
    let stack = Stack::from(Device::uniform(100.0, 0.4, 10.0).unwrap());
    let script = |lines: &[ScriptLine]| Script::new(lines, &stack, &[0.0], Some(&tree));
    let reported = |lines: &[ScriptLine]| script(lines).unwrap_err().to_string();
    let unknown = reported(&[until(near("left carotd"), 5.0)]);
    assert_eq!(unknown, "script[0].until.target = \"left carotd\": did you mean \"left carotid\"?");
    assert!(reported(&[until(Until::default(), 5.0)]).starts_with("script[0].until = {}: give"));
    let half = Until { target: None, ..near("left carotid") };
    assert!(reported(&[until(half, 5.0)]).starts_with("script[0].until.tip_within_mm = 2: of which target"));
    // After at most 40 mm, 60 may be too many and 101 are.
    assert!(script(&[until(force.clone(), 40.0), advance(70.0, 1.0)]).is_ok());
    assert!(
        reported(&[until(force.clone(), 40.0), advance(101.0, 1.0)])
            .starts_with("script[1].advance_mm = 101")
    );
    assert!(
        reported(&[until(force.clone(), 101.0)]).starts_with("script[0].advance_mm = 101: in its step 101")
    );
    let back = ScriptLine { withdraw: true, ..Default::default() };
    let lines = [until(force, 40.0), back, advance(100.0, 1.0)];
    assert_eq!(script(&lines).unwrap().len(), 40 + 40 + 100);
    assert!(script_commands(&lines, stack.first()).unwrap_err().to_string().starts_with("script[0].until"));
}

#[test]
fn a_script_goes_on_from_its_course_in_the_middle_of_a_line_with_a_condition() {
    let force = Until { push_force_n: Some(0.5), ..Until::default() };
    let back = ScriptLine { withdraw: true, step_mm: Some(0.7), ..Default::default() };
    let lines = [ScriptLine { until: Some(force), ..advance(40.0, 0.3) }, back, advance(10.0, 0.7)];
    let stack = Stack::from(Device::uniform(100.0, 0.4, 10.0).unwrap());
    let script = Script::new(&lines, &stack, &[0.0], None).unwrap();
    // The condition is met after this number of steps.
    for met_after in [0, 1, 50, 134] {
        let (mut run, mut seen, mut k) = (script.begin(), Vec::new(), 0);
        while let Some(step) = run.next_where(|_| (k >= met_after).then_some(Met::PushForceN)).unwrap() {
            let step = (step.moves.to_vec(), step.time_s);
            let mut before = Vec::new();
            let mut again = script.go_on(run.course(), |step| before.push(step.moves.to_vec())).unwrap();
            let reported =
                again.next_where(|_| (k >= met_after).then_some(Met::PushForceN)).unwrap().unwrap();
            assert_eq!((reported.moves.to_vec(), reported.time_s), step, "{met_after} {k}");
            assert!(!again.has_ended(), "{met_after} {k}");
            assert!(before.iter().eq(seen.iter()), "{met_after} {k}");
            run.carried_out();
            seen.push(step.0);
            k += 1;
        }
        assert!(run.has_ended());
        let reported: Vec<LineCourse> = run.conditions().map(|(_, line, _)| line).collect();
        assert!(run.conditions().all(|(_, _, after_step)| after_step == met_after));
        let met = (met_after <= 134).then_some(Met::PushForceN);
        assert_eq!(reported, [LineCourse { steps: met_after, met }]);
        let wrong = ScriptCourse { motions: vec![LineCourse { steps: 1000, met: None }] };
        assert!(script.go_on(&wrong, |_| ()).is_err());
    }
}

fn inject(ml: f64, ml_per_s: f64, through: Option<&str>) -> Option<Inject> {
    Some(Inject { ml, ml_per_s, through: through.map(str::to_owned) })
}

#[test]
fn injections_begin_with_their_lines_and_are_had_again_from_the_course_of_the_script() {
    let speed = |line: ScriptLine| ScriptLine { speed_mm_per_s: Some(2.0), step_mm: Some(5.0), ..line };
    let go = |mm| speed(ScriptLine { advance_mm: Some(mm), ..line("wire") });
    let lines = [
        ScriptLine { inject: inject(2.0, 1.0, Some("catheter")), ..go(20.0) },
        ScriptLine { inject: inject(8.0, 4.0, None), ..line("catheter") },
        ScriptLine { inject: inject(5.0, 5.0, Some("catheter")), ..Default::default() },
        go(10.0),
        ScriptLine { inject: inject(1.0, 1.0, None), ..line("catheter") },
    ];
    let script = Script::new(&lines, &stack(), &[50.0, 0.0, 40.0], None).unwrap();
    assert!(script.injects() && script.is_timed());
    let before =
        |lines| Script::new(lines, &stack(), &[50.0, 0.0, 40.0], None).unwrap().steps_before_injection();
    assert_eq!(
        [&lines[..], &lines[1..], &lines[3..], &lines[3..4]].map(before),
        [Some(0), Some(0), Some(2), None]
    );
    let mut run = script.begin();
    let mut seen = Vec::new();
    loop {
        let goes_on = run.next_where(|_| None).unwrap().is_some();
        seen.push((run.injections().to_vec(), run.course().clone()));
        if !goes_on {
            break;
        }
        run.carried_out();
    }
    let reported = |one: &Injection| (one.instrument, one.ml, one.after_step, one.time_s.unwrap());
    let all: Vec<_> = run.injections().iter().map(reported).collect();
    assert_eq!(all, [(2, 2.0, 0, 0.0), (2, 8.0, 4, 10.0), (2, 5.0, 4, 10.0), (2, 1.0, 6, 15.0)]);
    assert_eq!(seen.iter().map(|(begun, _)| begun.len()).collect::<Vec<_>>(), [1, 1, 1, 1, 3, 3, 4]);
    for (begun, course) in seen {
        assert_eq!(script.go_on(&course, |_| ()).unwrap().injections(), begun);
    }
}

#[test]
fn an_injection_that_cannot_be_is_reported_before_the_script_begins_or_where_its_line_does() {
    let go = |inject| ScriptLine { inject, ..ScriptLine { advance_mm: Some(5.0), ..line("wire") } };
    let with = ScriptLine {
        with: vec![ScriptLine { inject: inject(1.0, 1.0, None), retract_mm: Some(1.0), ..line("catheter") }],
        ..go(None)
    };
    let unmoved =
        ScriptLine { until: Some(Until::default()), inject: inject(1.0, 1.0, None), ..line("catheter") };
    for (line, reported) in [
        (go(inject(0.0, 1.0, Some("catheter"))), "script[0].inject.ml = 0: must be a number from 0.1 to 100"),
        (go(inject(-1.0, 1.0, Some("catheter"))), "script[0].inject.ml = -1: must"),
        (go(inject(1.0, f64::NAN, Some("catheter"))), "script[0].inject.ml_per_s = NaN: must"),
        (
            go(inject(100.0, 0.01, Some("catheter"))),
            "script[0].inject.ml_per_s = 0.01: takes 10000 s with 100 ml",
        ),
        (
            go(inject(1.0, 1.0, Some("cathter"))),
            "script[0].inject.through = \"cathter\": did you mean \"catheter\"?",
        ),
        (go(inject(1.0, 1.0, None)), "script[0].inject.through = \"wire\": has no lumen"),
        (with, "script[0].with[0].inject = given: belongs to the line itself"),
        (unmoved, "script[0] = {}: give advance_mm"),
    ] {
        let error = Script::new(&[line], &stack(), &[9.0, 0.0, 9.0], None).unwrap_err().to_string();
        assert!(error.starts_with(reported), "{error}");
    }
    let lines = [go(inject(1.0, 1.0, Some("catheter")))];
    let out = Script::new(&lines, &stack(), &[9.0, 0.0, 0.0], None).unwrap_err().to_string();
    assert!(out.starts_with("script[0].inject = 1 ml: the instrument is not in"), "{out}");
    // Whether it is inserted depends on where the previous line ends.
    let force = Until { push_force_n: Some(0.5), ..Until::default() };
    let first = ScriptLine { advance_mm: Some(4.0), until: Some(force), ..line("catheter") };
    let lines = [first, lines[0].clone()];
    let script = Script::new(&lines, &stack(), &[9.0, 0.0, 0.0], None).unwrap();
    let outcome = script.begin().next_where(|_| Some(Met::PushForceN)).map(|_| ()).unwrap_err().to_string();
    assert!(outcome.starts_with("script[1].inject = 1 ml: the instrument is not in"), "{outcome}");
    assert!(script.begin().next_where(|_| None).is_ok(), "the twin: it is in then");
}

/// Two coils of 20 mm, and a catheter.
fn coils() -> Stack {
    let coil = || {
        let sections = vec![Section::straight(20.0, 0.1, 1e-3), Section::straight(80.0, 0.1, 1.0)];
        Device::new(sections).unwrap().with_coil(20.0).unwrap()
    };
    let catheter = Section { inner_radius_mm: Some(0.2), ..Section::straight(50.0, 0.3, 5.0) };
    let one = |name: &str, device| Instrument { name: name.to_owned(), device, may_lead: true };
    Stack::new(vec![
        one("framing", coil()),
        one("filling", coil()),
        one("catheter", Device::new(vec![catheter]).unwrap()),
    ])
    .unwrap()
}

#[test]
fn a_coil_is_detached_by_a_line_of_its_own_and_the_next_one_follows() {
    let by = |instrument: &str, mm: f64| ScriptLine { advance_mm: Some(mm), ..line(instrument) };
    let detach = |instrument: &str| ScriptLine { detach: true, ..line(instrument) };
    let made = |lines: &[ScriptLine]| Script::new(lines, &coils(), &[0.0, 0.0, 5.0], None);
    let lines = [by("framing", 26.0), detach("framing"), by("filling", 26.0)];
    let script = made(&lines).unwrap();
    assert_eq!(script.len(), 53);
    let (mut run, mut detached) = (script.begin(), Vec::new());
    while let Some(step) = run.next_where(|_| None).unwrap() {
        detached.push(step.detach);
        run.carried_out();
    }
    assert!(detached[26] == Some(0) && detached.iter().flatten().count() == 1);
    assert!(script.moves().unwrap_err().to_string().starts_with("script[1].detach"));
    let reported = |lines: &[ScriptLine]| made(lines).unwrap_err().to_string();
    for (lines, expected) in [
        (&[by("framing", 26.0), detach("framing"), detach("framing")][..], "script[2].detach = \"framing\""),
        (&[by("framing", 26.0), detach("framing"), by("framing", 1.0)], "script[2].instrument = \"framing\""),
        (&[by("framing", 10.0), detach("framing")], "is not out by then: advance it by 15.400 mm more"),
        (&[detach("catheter")], "is no coil"),
        (&[by("framing", 26.0), by("filling", 1.0)], "has no lumen"),
        (&[ScriptLine { detach: true, ..by("framing", 26.0) }], "stands alone"),
    ] {
        assert!(reported(lines).contains(expected), "{}", reported(lines));
    }
}
