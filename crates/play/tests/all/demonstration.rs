//! Scripts that are shown: what they do is what they do when run, a hand takes over at any time, and all of it is recorded.

use std::path::Path;

use endowire_assess::{Group, Record, assess};
use endowire_core::insertion::{Injection, Simulation};
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_play::{EventKind, Input, Limits, Session};
use endowire_viewer::ViewSpec;

/// 12 steps of two ticks, a rest of 30, an injection, and 20 steps of one.
const SCRIPT: &str = r#"
[[script]]
instrument = "catheter"
advance_mm = 6.0
step_mm = 0.5
speed_mm_per_s = 15.0

[[script]]
wait_s = 0.5

[[script]]
instrument = "wire"
advance_mm = 5.0
rotate_deg = 37.0
step_mm = 0.25
speed_mm_per_s = 15.0
inject = { ml = 3.0, ml_per_s = 4.0, through = "catheter" }
"#;

/// The scene with another script.
fn scene(script: &str) -> Scene {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes/arch_vertebral.toml");
    let mut scene = Scene::read(&assets).unwrap();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), script).unwrap();
    scene.take_script(file.path()).unwrap();
    scene
}

fn session(script: &str) -> Session {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes/arch_vertebral.toml");
    let scene = scene(script);
    let mut view = ViewSpec::of_scene(&scene, &assets).unwrap();
    view.flow.tree = Some(assets.with_file_name("../vessels/aortic_arch.csv"));
    let simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    Session::new(simulation, view, 64, Limits::default()).unwrap().with_script(script)
}

/// What the program does with a script, and what it injects.
fn run(script: &str) -> (Simulation, Vec<Injection>) {
    let scene = scene(script);
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let mut run = scene.steps(simulation.stack(), &NoStore).unwrap().into_run();
    while let Some(moves) = run.next(&simulation).unwrap().map(|step| step.moves.to_vec()) {
        if !moves.is_empty() {
            simulation.step_together(&moves).unwrap();
        }
        run.carried_out();
    }
    let injections = run.injections().to_vec();
    (simulation, injections)
}

/// Ticks until nothing is shown any more.
fn shown(session: &mut Session) -> usize {
    let mut ticks = 0;
    while session.demonstrates() {
        session.tick();
        ticks += 1;
    }
    ticks
}

fn push(session: &mut Session, ticks: usize) {
    let wire = Some("wire".to_owned());
    session.apply(&Input::Move { instrument: wire, mm_per_s: 20.0, deg_per_s: 0.0 }).unwrap();
    (0..ticks).for_each(|_| session.tick());
    session.apply(&Input::Stop {}).unwrap();
}

#[test]
fn what_is_shown_takes_its_time_and_is_what_is_run() {
    let mut session = session(SCRIPT);
    session.apply(&Input::Script {}).unwrap();
    session.tick();
    assert_eq!((session.steps(), session.readout().demonstrates), (0, true));
    session.tick();
    assert_eq!(session.steps(), 1);
    // The end is seen when the next tick asks what is left.
    let ticks = 2 + shown(&mut session);
    assert!((74..=75).contains(&ticks), "{ticks}");
    assert_eq!((session.steps(), session.events().last().unwrap().kind), (32, EventKind::Script));

    let (simulation, injected) = run(SCRIPT);
    let apart = simulation.shape().tip_mm().unwrap() - session.simulation().shape().tip_mm().unwrap();
    assert!(apart.norm() < 1e-9, "{apart}");
    let snapshot = session.snapshot();
    let flows = &snapshot.lab.fluoro().injection;
    assert_eq!((injected.len(), flows.len()), (1, 1));
    assert!((flows[0].start_s - injected[0].time_s.unwrap()).abs() < 1e-9, "{flows:?}");

    // And what is recorded has the same bits, its times but for the rest too.
    let (again, reported) = run(&session.script());
    assert_eq!(again.shape(), session.simulation().shape());
    assert_eq!(again.report(), session.simulation().report());
    assert_eq!((reported.len(), reported[0].after_step, reported[0].instrument), (1, 12, 1));
    assert!((reported[0].time_s.unwrap() - 0.4).abs() < 1e-9, "{reported:?}");
}

#[test]
fn a_hand_takes_over_at_any_time_and_has_its_own_bits() {
    let mut session = session(SCRIPT);
    session.apply(&Input::Script {}).unwrap();
    (0..60).for_each(|_| session.tick());
    // A key that is let go is no motion.
    session.apply(&Input::Move { instrument: None, mm_per_s: 0.0, deg_per_s: 0.0 }).unwrap();
    assert!(session.demonstrates());
    let steps = session.steps();
    assert!((13..32).contains(&steps), "{steps}");
    push(&mut session, 5);
    assert!(!session.demonstrates());
    assert!(session.events().iter().any(|event| event.kind == EventKind::Script));
    (0..60).for_each(|_| session.tick());
    assert_eq!(session.steps(), steps + 5);
    assert_eq!(run(&session.script()).0.shape(), session.simulation().shape());

    // Undo takes the hand's motion back, then the script line by line; from the start it can be shown again.
    session.apply(&Input::Undo {}).unwrap();
    assert_eq!(session.steps(), steps);
    session.apply(&Input::Undo {}).unwrap();
    assert_eq!(session.steps(), 12);
    let refused = session.apply(&Input::Script {}).unwrap_err().to_string();
    assert!(refused.contains("step 12") && refused.contains("go back"), "{refused}");
    session.apply(&Input::GoTo { step: 0 }).unwrap();
    session.apply(&Input::Script {}).unwrap();
    shown(&mut session);
    let mut other = self::session(SCRIPT);
    other.apply(&Input::Script {}).unwrap();
    shown(&mut other);
    assert_eq!(session.simulation().shape(), other.simulation().shape());
}

#[test]
fn a_script_rests_and_goes_on_with_the_same_bits() {
    let [mut session, mut other] = [SCRIPT; 2].map(session);
    session.apply(&Input::Script {}).unwrap();
    (0..17).for_each(|_| session.tick());
    session.apply(&Input::Stop {}).unwrap();
    let steps = session.steps();
    (0..40).for_each(|_| session.tick());
    assert_eq!((session.steps(), session.demonstrates()), (steps, false));
    session.apply(&Input::Script {}).unwrap();
    shown(&mut session);
    other.apply(&Input::Script {}).unwrap();
    shown(&mut other);
    assert_eq!(session.simulation().shape(), other.simulation().shape());
    assert_eq!(session.script(), other.script());
}

#[test]
fn scripts_without_times_are_shown_at_the_speed_of_keys_and_empty_ones_refused() {
    let mut session =
        self::session("[[script]]\ninstrument = \"catheter\"\nadvance_mm = 4.0\nstep_mm = 2.0\n");
    session.apply(&Input::Script {}).unwrap();
    let ticks = shown(&mut session);
    assert!((24..=25).contains(&ticks) && session.steps() == 2, "{ticks}");
    let refused = self::session("script = []\n").apply(&Input::Script {}).unwrap_err().to_string();
    assert!(refused.contains("none to show"), "{refused}");
}

/// The measures of a record that need no beam, by name.
fn measured(record: &Record) -> Vec<(&'static str, Option<f64>)> {
    let of_beam = |name: &str| name.contains("beam") || ["runs", "frames", "c_arm_moves"].contains(&name);
    let all =
        assess(record, None).into_iter().filter(|one| !of_beam(one.name) && one.group != Group::Radiation);
    all.map(|one| (one.name, one.value)).collect()
}

#[test]
fn what_is_shown_is_measured_as_what_is_run() {
    let mut session = session(SCRIPT);
    session.apply(&Input::Script {}).unwrap();
    shown(&mut session);
    let scene = scene(SCRIPT);
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let mut run = scene.steps(simulation.stack(), &NoStore).unwrap().into_run();
    let (mut record, mut time_s) = (Record::default(), 0.0);
    record.begin(&simulation);
    while let Some(step) = run.next(&simulation).unwrap().map(|step| step.into_owned()) {
        if !step.moves.is_empty() {
            simulation.step_together(&step.moves).unwrap();
        }
        run.carried_out();
        time_s += step.duration_s;
        record.note(time_s, &step.moves, &simulation, None);
    }
    for ((name, value), (_, of_run)) in measured(session.record()).into_iter().zip(measured(&record)) {
        // The script injects; the run here has neither an injector nor a beam.
        if ["contrast_ml", "injections", "largest_rate_ml_per_s", "unseen_share"].contains(&name) {
            continue;
        }
        let (value, of_run) = (value.unwrap_or(-1.0), of_run.unwrap_or(-1.0));
        assert!(
            (value - of_run).abs() < 1e-6 * of_run.abs().max(1.0),
            "{name}: {value}, of the run {of_run}"
        );
    }
    let idle_s = measured(session.record()).iter().find(|one| one.0 == "idle_s").unwrap().1.unwrap();
    assert!((idle_s - 0.5).abs() < 1e-6, "the rest alone: {idle_s}");
}

#[test]
fn a_step_that_a_hand_cuts_short_was_a_rest() {
    // One step of two seconds.
    let slow =
        "[[script]]\ninstrument = \"catheter\"\nadvance_mm = 4.0\nstep_mm = 4.0\nspeed_mm_per_s = 2.0\n";
    let mut session = session(slow);
    session.apply(&Input::Script {}).unwrap();
    (0..60).for_each(|_| session.tick());
    assert!(session.record().samples.is_empty(), "the step is under way");
    push(&mut session, 30);
    let samples = &session.record().samples;
    assert!(
        (samples[0].time_s - 1.0).abs() < 1e-9 && samples[0].hands[0].advance_mm == 0.0,
        "{:?}",
        samples[0]
    );
    assert!((samples[1].time_s - 61.0 / 60.0).abs() < 1e-9 && samples[1].hands[0].advance_mm > 0.0);
    let pace =
        measured(session.record()).iter().find(|one| one.0 == "push_speed_mm_per_s").unwrap().1.unwrap();
    assert!((pace - 20.0).abs() < 1e-6, "{pace}");
}
