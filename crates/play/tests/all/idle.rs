//! Keys that are told to do nothing do nothing, and those that are not do something.

use std::path::Path;

use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_play::{Input, Keys, Limits, Modifiers, Readout, Session};
use endowire_viewer::ViewSpec;

fn session() -> (Session, Keys) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes/curved_tube_exact.toml");
    let scene = Scene::read(&path).unwrap();
    let mut view = ViewSpec::of_scene(&scene, &path).unwrap();
    view.flow.tree = Some(path.parent().unwrap().join("../vessels/curved_tube.csv"));
    let simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    let keys = Keys::of(simulation.stack());
    (Session::new(simulation, view, 64, Limits::default()).unwrap().with_script(script), keys)
}

/// The readout without what is told of refusals and of keys.
fn seen(session: &Session) -> Readout {
    Readout { event: None, events: 0, idle_keys: vec![], ..session.readout() }
}

/// Whether pressing a key does something.
fn does((mut session, mut keys): (Session, Keys), code: &str, shift: bool) -> bool {
    let before = seen(&session);
    keys.modify(Modifiers { shift, control: false });
    let inputs = keys.key(code, true, false);
    let done = inputs.iter().map(|input| session.apply(input).is_ok()).fold(true, |all, one| all & one);
    // A selection that stays, and hands that hold still, are no effect.
    done && (seen(&session) != before || inputs.iter().any(|input| matches!(input, Input::Script {})))
}

const CODES: [(&str, bool); 13] = [
    ("Tab", false),
    ("KeyS", false),
    ("KeyB", false),
    ("KeyD", false),
    ("KeyP", false),
    ("Backspace", false),
    ("Backspace", true),
    ("KeyE", false),
    ("KeyQ", false),
    ("Equal", false),
    ("Minus", false),
    ("KeyJ", false),
    ("KeyO", false),
];

fn check(of: impl Fn() -> (Session, Keys)) -> Vec<(&'static str, bool)> {
    let idle = of().0.readout().idle_keys;
    let told = |code: &str, shift: bool| idle.iter().any(|key| key.code == code && key.shift == shift);
    for (code, shift) in CODES {
        assert_eq!(does(of(), code, shift), !told(code, shift), "{code} {shift}: {idle:?}");
    }
    CODES.into_iter().filter(|(code, shift)| told(code, *shift)).collect()
}

#[test]
fn keys_are_idle_where_they_do_nothing_and_only_there() {
    let first = check(session);
    assert!(first.contains(&("Backspace", false)) && first.contains(&("KeyB", false)));
    // After a motion there is something to undo, and the script cannot begin.
    let moved = || {
        let (mut session, keys) = session();
        session.apply(&Input::Nudge { instrument: None, mm: 2.0, deg: 0.0 }).unwrap();
        (0..30).for_each(|_| session.tick());
        (session, keys)
    };
    let after = check(moved);
    assert!(!after.contains(&("Backspace", false)) && after.contains(&("KeyP", false)), "{after:?}");
    // At the ends of blades, magnification and C-arm, with medium injected and a motion undone.
    let at_ends = || {
        let (mut session, mut keys) = moved();
        session.apply(&Input::Undo {}).unwrap();
        session.apply(&Input::Inject { ml: 5.0, ml_per_s: 5.0 }).unwrap();
        for input in (0..9).flat_map(|_| keys.key("KeyQ", true, false)).collect::<Vec<_>>() {
            session.apply(&input).unwrap();
        }
        session.apply(&Input::TurnCArm { lao_deg: -200.0, cra_deg: 100.0 }).unwrap();
        (0..4).for_each(|_| session.apply(&Input::Zoom { factor: 10.0 }).unwrap());
        (session, keys)
    };
    let ends = check(at_ends);
    for one in [("KeyQ", false), ("Equal", false), ("KeyJ", false), ("KeyO", false)] {
        assert!(ends.contains(&one) && !after.contains(&one), "{one:?} of {ends:?}");
    }
    assert!(!ends.contains(&("KeyB", false)));
}
