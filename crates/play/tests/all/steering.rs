//! Sections that are steered by hand: how far and how fast, what is recorded of it, and that it is repeated to the bit.

use std::path::Path;

use endowire_core::insertion::{Simulation, Step};
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_play::{EventKind, Input, Inputs, Keys, Limits, Modifiers, Session, TICK_SOLVES};
use endowire_viewer::ViewSpec;

fn scene() -> (Scene, ViewSpec) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes/arch_steered.toml");
    let scene = Scene::read(&path).unwrap();
    let view = ViewSpec::of_scene(&scene, &path).unwrap();
    (scene, view)
}

fn session() -> Session {
    let (scene, view) = scene();
    let simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    Session::new(simulation, view, 64, Limits::default()).unwrap().with_script(script)
}

fn steer(to: Option<f64>, per_s: Option<f64>) -> Input {
    Input::Steer { instrument: None, to, per_s }
}

fn push(mm_per_s: f64) -> Input {
    Input::Move { instrument: None, mm_per_s, deg_per_s: 0.0 }
}

fn value(session: &Session) -> f64 {
    session.readout().instruments[0].steer.unwrap()
}

fn ticks(session: &mut Session, count: usize) {
    (0..count).for_each(|_| session.tick());
}

/// What `endowire run` does with the session's script.
fn repeated(session: &Session) -> Simulation {
    let (mut scene, _) = scene();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), session.script()).unwrap();
    scene.take_script(file.path()).unwrap();
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let mut run = scene.steps(simulation.stack(), &NoStore).unwrap().into_run();
    while let Some(step) = run.next(&simulation).unwrap() {
        let step = step.into_owned();
        Step { time_s: None, ..step }.carry_out(&mut simulation).unwrap();
        run.carried_out();
    }
    simulation
}

#[test]
fn a_hand_steers_at_a_rate_to_a_value_and_holds_it() {
    let mut session = session();
    session.apply(&push(60.0)).unwrap();
    ticks(&mut session, 60);
    session.apply(&Input::Stop {}).unwrap();
    let straight_mm = session.simulation().shape().tip_mm().unwrap();
    // At the usual rate, half a second is a quarter.
    session.apply(&steer(Some(1.0), None)).unwrap();
    ticks(&mut session, 30);
    assert!((value(&session) - 0.25).abs() < 1e-9, "{}", value(&session));
    let bent_mm = session.simulation().shape().tip_mm().unwrap();
    assert!((bent_mm - straight_mm).norm() > 5.0, "{bent_mm} {straight_mm}");
    // Held, it stays; and a tick without motion is no step.
    session.apply(&steer(None, None)).unwrap();
    let steps = session.steps();
    ticks(&mut session, 10);
    assert_eq!((session.steps(), session.simulation().shape().tip_mm().unwrap()), (steps, bent_mm));
    // To a value of its own, faster, and then nothing more moves.
    session.apply(&steer(Some(-0.3), Some(2.0))).unwrap();
    ticks(&mut session, 40);
    assert!((value(&session) + 0.3).abs() < 1e-11, "{}", value(&session));
    assert_eq!(session.steps(), steps + 17, "0.55 at a thirtieth a tick");
    // Straight again is where it began.
    session.apply(&steer(Some(0.0), Some(2.0))).unwrap();
    ticks(&mut session, 20);
    assert_eq!(value(&session), 0.0);
    assert!((session.simulation().shape().tip_mm().unwrap() - straight_mm).norm() < 0.2);
    // Undone: bent as it was.
    session.apply(&Input::Undo {}).unwrap();
    assert!((value(&session) + 0.3).abs() < 1e-11, "{}", value(&session));
    ticks(&mut session, 30);
    assert!((value(&session) + 0.3).abs() < 1e-11, "an undone hand rests");
}

#[test]
fn what_is_steered_has_the_same_bits_as_its_script() {
    for solves in [None, Some(6), Some(TICK_SOLVES)] {
        let mut session = session();
        if let Some(solves) = solves {
            session = session.with_ticks(solves).unwrap();
        }
        session.apply(&push(90.0)).unwrap();
        ticks(&mut session, 100);
        // Together with a push, at rates that no fraction of two is, beyond the end, and back.
        for (to, per_s, mm_per_s, count) in [
            (Some(1.0), Some(0.7), 20.0, 50),
            (Some(-0.123), None, 0.0, 40),
            (Some(1.0), Some(7.7), 5.0, 20),
            (None, None, 30.0, 20),
            (Some(0.0), Some(0.9), -30.0, 90),
            (Some(-1.0), Some(1e-7), 0.0, 5),
        ] {
            session.apply(&steer(to, per_s)).unwrap();
            session.apply(&push(mm_per_s)).unwrap();
            ticks(&mut session, count);
        }
        let script = session.script();
        assert!(script.contains("steer = 1.0\n") && script.contains("speed_steer_per_s = "), "{script}");
        let simulation = repeated(&session);
        assert_eq!(simulation.shape(), session.simulation().shape(), "{solves:?}");
        assert_eq!(simulation.report(), session.simulation().report());
        // Its inputs repeat it as well.
        let inputs = serde_json::to_string(&session.inputs()).unwrap();
        let inputs: Inputs = serde_json::from_str(&inputs).unwrap();
        let again = inputs.repeat_in(self::session()).unwrap();
        assert_eq!(again.record(), session.record());
        // The twin: a last bit of a value that the script names is seen.
        let last = script.rfind("\nsteer = ").unwrap();
        assert!(script[last..].starts_with("\nsteer = -"), "{}", &script[last..]);
    }
}

#[test]
fn a_script_that_steers_is_shown_and_its_steps_are_recorded() {
    let mut session = session();
    session.apply(&Input::Script {}).unwrap();
    while session.demonstrates() {
        session.tick();
    }
    assert!((value(&session) - 0.5).abs() < 1e-9, "{}", value(&session));
    let simulation = repeated(&session);
    assert_eq!(simulation.shape(), session.simulation().shape());
    let samples = &session.record().samples;
    let by: f64 = samples.iter().map(|sample| sample.hands[0].steer_by).sum();
    assert!((by - 0.5).abs() < 1e-9, "{by}");
    // A hand takes over.
    session.apply(&Input::GoTo { step: 0 }).unwrap();
    session.apply(&Input::Script {}).unwrap();
    session.tick();
    session.apply(&steer(Some(0.2), None)).unwrap();
    assert!(!session.demonstrates());
}

#[test]
fn what_cannot_be_steered_so_is_refused_and_changes_nothing() {
    let mut session = session();
    for (to, per_s, name) in [
        (Some(1.1), None, "to = 1.1"),
        (Some(f64::NAN), None, "to = NaN"),
        (Some(0.5), Some(-1.0), "per_s = -1"),
        (Some(0.5), Some(61.0), "per_s = 61"),
    ] {
        let text = session.apply(&steer(to, per_s)).unwrap_err().to_string();
        assert!(text.starts_with(name), "{text}");
    }
    ticks(&mut session, 3);
    assert_eq!((session.steps(), session.readout().event.unwrap().kind), (0, EventKind::Refused));
    // A wire that is not steered says so, and has no value.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes/curved_tube_exact.toml");
    let scene = Scene::read(&path).unwrap();
    let view = ViewSpec::of_scene(&scene, &path).unwrap();
    let mut plain = Session::new(scene.simulation(&NoStore).unwrap(), view, 64, Limits::default()).unwrap();
    let text = plain.apply(&steer(Some(0.5), None)).unwrap_err().to_string();
    assert!(text.starts_with("steer = 0.5: \"device\" is not steered"), "{text}");
    assert!(plain.apply(&steer(None, None)).is_ok(), "it holds nothing");
    assert_eq!(plain.readout().instruments[0].steer, None);
    let readout = serde_json::to_string(&plain.readout().instruments).unwrap();
    assert!(!readout.contains("steer"), "{readout}");
}

#[test]
fn keys_bend_what_is_chosen_as_long_as_they_are_down() {
    let mut session = session();
    let mut keys = Keys::of(session.simulation().stack());
    let mut press = |session: &mut Session, code: &str, down: bool| {
        for input in keys.key(code, down, false) {
            session.apply(&input).unwrap();
        }
    };
    press(&mut session, "KeyS", true);
    ticks(&mut session, 24);
    press(&mut session, "KeyS", false);
    ticks(&mut session, 12);
    assert!((value(&session) - 0.2).abs() < 1e-9, "{}", value(&session));
    press(&mut session, "KeyA", true);
    ticks(&mut session, 36);
    press(&mut session, "KeyA", false);
    assert!((value(&session) + 0.1).abs() < 1e-9, "{}", value(&session));
    press(&mut session, "KeyW", true);
    press(&mut session, "KeyW", false);
    ticks(&mut session, 30);
    assert_eq!(value(&session), 0.0);
    for input in keys.modify(Modifiers { shift: true, control: false }) {
        session.apply(&input).unwrap();
    }
    for input in keys.key("KeyS", true, false) {
        session.apply(&input).unwrap();
    }
    ticks(&mut session, 6);
    assert!((value(&session) - 0.2).abs() < 1e-9, "four times as fast");
    for input in keys.let_go() {
        session.apply(&input).unwrap();
    }
    ticks(&mut session, 6);
    assert!((value(&session) - 0.2).abs() < 1e-9);
}
