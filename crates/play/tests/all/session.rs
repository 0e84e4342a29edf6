//! Sessions of thousands of inputs: what is recorded has the same bits, nothing panics, nothing is lost.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use endowire_core::Vec3;
use endowire_core::insertion::{Injection, Simulation, Step};
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_play::{EventKind, Input, Inputs, Limits, Pictures, Session, TICK_SOLVES};
use endowire_viewer::{ExposureSpec, Image, Mode, ViewSpec};

fn scene(name: &str) -> (PathBuf, Scene) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes").join(name);
    let scene = Scene::read(&path).unwrap();
    (path, scene)
}

fn session(name: &str) -> (Scene, Session) {
    let (path, scene) = scene(name);
    let view = ViewSpec::of_scene(&scene, &path).unwrap();
    let simulation = scene.simulation(&NoStore).unwrap();
    let session = Session::new(simulation, view, 64, Limits::default()).unwrap();
    (scene, session)
}

/// Numbers that look random, the same every time.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }

    /// An input as hands and protocols give it; `wild` ones have values that are none.
    fn input(&mut self, instruments: &[&str], wild: bool) -> Input {
        let odd = [f64::NAN, f64::INFINITY, -1e308, 1e-308, 1e9, 0.0, -0.0];
        let mut number =
            |usual: &[f64]| if wild && self.below(4) == 0 { self.one(&odd) } else { self.one(usual) };
        let (speed, turn) =
            (number(&[-40.0, -20.0, 2.0, 20.0, 20.0, 40.0]), number(&[-90.0, 0.0, 0.0, 36.0]));
        let (step, share) = (number(&[-3.0, -0.5, 0.25, 0.7, 5.0]), number(&[0.2, 0.5, 1.0]));
        let instrument = (self.below(3) > 0).then(|| self.one(instruments).to_owned());
        match self.below(16) {
            0..=4 => Input::Move { instrument, mm_per_s: speed, deg_per_s: turn },
            5 => Input::Nudge { instrument, mm: step, deg: turn },
            6 => Input::Stop {},
            7 => Input::Select { instrument: instrument.unwrap_or_else(|| "nobody".to_owned()) },
            8 => {
                let mode = self.one(&[
                    None,
                    Some(Mode::Fluoro),
                    Some(Mode::Cine),
                    Some(Mode::Dsa),
                    Some(Mode::Roadmap),
                ]);
                Input::Pedal { down: self.below(2) == 0, mode }
            }
            9 => Input::Inject { ml: 5.0 * share, ml_per_s: 10.0 * share },
            10 => Input::TurnCArm { lao_deg: step, cra_deg: turn },
            11 => Input::Table { right_mm: 10.0 * step, down_mm: 5.0 * step, second: share > 0.4 },
            12 => Input::Zoom { factor: 1.0 + share },
            13 => Input::Collimate { width: share, height: share },
            14 => Input::TurnCamera { azimuth_deg: step, elevation_deg: turn },
            _ if self.below(8) == 0 => Input::Undo {},
            _ if self.below(8) == 0 => Input::Redo {},
            _ if wild && self.below(8) == 0 => Input::GoTo { step: self.below(1000) as usize },
            _ => Input::Stop {},
        }
    }
}

/// The motions of a session, carried out by the scene as its script.
fn replayed(scene: Scene, session: &Session) -> Simulation {
    replayed_with_injections(scene, session).0
}

/// The same, with what was injected.
fn replayed_with_injections(mut scene: Scene, session: &Session) -> (Simulation, Vec<Injection>) {
    // Tests run side by side, several of them with the same scene.
    static FILES: AtomicUsize = AtomicUsize::new(0);
    let number = FILES.fetch_add(1, Ordering::Relaxed);
    let file = std::env::temp_dir().join(format!("endowire-played-{}-{number}.toml", std::process::id()));
    std::fs::write(&file, session.script()).unwrap();
    scene.take_script(&file).unwrap();
    std::fs::remove_file(&file).unwrap();
    let mut simulation = scene.simulation(&NoStore).unwrap();
    let script = scene.steps(simulation.stack(), &NoStore).unwrap();
    assert_eq!(script.len(), session.steps());
    let mut run = script.begin();
    let moves = simulation.motion().is_some();
    while let Some(step) = run.next(&simulation).unwrap() {
        let step = step.into_owned();
        Step { time_s: step.time_s.filter(|_| moves), ..step }.carry_out(&mut simulation).unwrap();
        run.carried_out();
    }
    let injections = run.injections().to_vec();
    (simulation, injections)
}

#[test]
fn two_thousand_inputs_replay_with_the_same_bits() {
    let (scene, session) = session("arch_vertebral.toml");
    two_thousand_inputs_replay(scene, session);
}

#[test]
fn two_thousand_inputs_in_ticks_replay_with_the_same_bits() {
    let (scene, session) = session("arch_vertebral.toml");
    two_thousand_inputs_replay(scene, session.with_ticks(6).unwrap());
}

fn two_thousand_inputs_replay(scene: Scene, mut session: Session) {
    let mut dice = Dice(1);
    for _ in 0..2000 {
        let _ = session.apply(&dice.input(&["wire", "catheter"], false));
        for _ in 0..=dice.below(3) {
            session.tick();
        }
    }
    assert!(session.steps() > 500, "{} steps", session.steps());
    let simulation = replayed(scene, &session);
    assert_eq!(simulation.shape(), session.simulation().shape());
    assert_eq!(simulation.report(), session.simulation().report());
}

#[test]
fn what_ticks_leave_over_is_followed_while_hands_rest() {
    // Largest lag of the device, with its tip still.
    let pushed = |solves: Option<usize>| {
        let (_, mut session) = session("arch_innominate.toml");
        if let Some(solves) = solves {
            session = session.with_ticks(solves).unwrap();
        }
        session.apply(&Input::Move { instrument: None, mm_per_s: 40.0, deg_per_s: 0.0 }).unwrap();
        let mut most_mm: f64 = 0.0;
        for _ in 0..240 {
            session.tick();
            let readout = session.readout();
            let one = &readout.instruments[0];
            let hand_mm = 40.0 * readout.time_s;
            assert!((one.inserted_mm + one.behind_mm - hand_mm).abs() < 1e-9, "{one:?}");
            most_mm = most_mm.max(one.behind_mm);
        }
        session.apply(&Input::Stop {}).unwrap();
        let moved = (0..2000).take_while(|_| {
            session.tick();
            session.simulation().report().is_under_way()
        });
        assert!(moved.count() < 2000);
        assert_eq!(session.went().unconverged_steps, 0);
        (most_mm, session.simulation().shape().tip_mm().unwrap())
    };
    let ((none_mm, whole), (few_mm, few)) = (pushed(None), pushed(Some(2)));
    assert!(none_mm == 0.0 && few_mm > 0.5, "{none_mm} {few_mm}");
    assert!((whole - few).norm() < 0.05, "{} mm apart", (whole - few).norm());
}

#[test]
fn a_tick_has_solves() {
    let (_, session) = session("curved_tube.toml");
    assert!(session.with_ticks(0).unwrap_err().to_string().contains("solves"));
}

#[test]
fn ten_thousand_wild_inputs_do_no_harm() {
    let (scene, mut session) = session("curved_tube.toml");
    let mut dice = Dice(7);
    let mut refused = 0;
    for _ in 0..10_000 {
        let before = session.steps();
        let input = dice.input(&["device", "nothing"], true);
        refused += usize::from(session.apply(&input).is_err());
        assert!(session.steps() <= before || input == Input::Redo {});
        if dice.below(4) == 0 {
            session.tick();
        }
    }
    assert!(refused > 500, "{refused} refused");
    assert!(session.simulation().shape().tip_mm().is_none_or(|tip| tip.iter().all(|x| x.is_finite())));
    assert_eq!(replayed(scene, &session).shape(), session.simulation().shape());
}

#[test]
fn any_earlier_moment_can_be_had_again() {
    let (_, mut session) = session("curved_tube.toml");
    let mut shapes = vec![session.simulation().shape().clone()];
    session.apply(&Input::Move { instrument: None, mm_per_s: 20.0, deg_per_s: 45.0 }).unwrap();
    for _ in 0..150 {
        session.tick();
        shapes.push(session.simulation().shape().clone());
    }
    for step in [149, 130, 128, 64, 3, 0] {
        session.apply(&Input::GoTo { step }).unwrap();
        assert_eq!((session.steps(), session.simulation().shape()), (step, &shapes[step]));
    }
    let reported = session.apply(&Input::GoTo { step: 1 }).unwrap_err().to_string();
    assert_eq!(reported, "step = 1: 0 steps were carried out");
    // Undo takes one motion back: what was done between two rests.
    for mm_per_s in [10.0, 0.0, 30.0, 0.0] {
        session.apply(&Input::Move { instrument: None, mm_per_s, deg_per_s: 0.0 }).unwrap();
        (0..6).for_each(|_| session.tick());
    }
    assert_eq!(session.steps(), 12);
    for steps in [6, 0, 0] {
        session.apply(&Input::Undo {}).unwrap();
        assert_eq!(session.steps(), steps);
    }
}

fn go(session: &mut Session, instrument: &str, mm_per_s: f64, ticks: usize) {
    session
        .apply(&Input::Move { instrument: Some(instrument.to_owned()), mm_per_s, deg_per_s: 0.0 })
        .unwrap();
    (0..ticks).for_each(|_| session.tick());
    session.apply(&Input::Stop {}).unwrap();
    session.tick();
}

/// Hands push and rest while the liver breathes; time goes by in ticks, and the script has it to the bit.
#[test]
fn a_vessel_breathes_while_hands_rest_and_what_is_recorded_has_the_same_bits() {
    let (scene, mut session) = session("hepatic_breathing.toml");
    let ticks = |session: &mut Session, count: usize| (0..count).for_each(|_| session.tick());
    let hold = |session: &mut Session, mm_per_s: f64, deg_per_s: f64| {
        session.apply(&Input::Move { instrument: None, mm_per_s, deg_per_s }).unwrap();
    };
    hold(&mut session, 13.7, 0.0);
    ticks(&mut session, 75);
    hold(&mut session, 3.1, 47.0);
    ticks(&mut session, 40);
    hold(&mut session, 0.0, 0.0);
    ticks(&mut session, 77);
    let at_s = session.simulation().time_s();
    assert!(session.steps() == 192 && (at_s - 192.0 / 60.0).abs() < 1e-9, "{} {at_s}", session.steps());
    let moved_mm =
        |session: &Session| session.snapshot().displacement.unwrap().place(&Vec3::new(-90.0, -35.0, 100.0));
    let before_mm = moved_mm(&session);
    ticks(&mut session, 30);
    assert!((moved_mm(&session) - before_mm).norm() > 0.1);
    // Pushed, with a nudge: the steps of one second.
    session.apply(&Input::Nudge { instrument: None, mm: 0.7, deg: 11.0 }).unwrap();
    ticks(&mut session, 60);
    let again = replayed(scene, &session);
    assert_eq!(again.time_s().to_bits(), session.simulation().time_s().to_bits());
    assert_eq!(again.shape(), session.simulation().shape());
    assert_eq!(again.report(), session.simulation().report());
    // Rests are few lines.
    assert!(session.script().matches("wait_s").count() < 30, "{}", session.script());

    // What was undone is there until a hand moves: the vessel holds still meanwhile.
    let (steps, tip) = (session.steps(), session.simulation().shape().tip_mm());
    session.apply(&Input::Undo {}).unwrap();
    let (undone, held_mm) = (session.steps(), moved_mm(&session));
    assert!(undone < steps);
    ticks(&mut session, 20);
    assert_eq!((session.steps(), moved_mm(&session)), (undone, held_mm));
    session.apply(&Input::Redo {}).unwrap();
    assert_eq!((session.steps(), session.simulation().shape().tip_mm()), (steps, tip));
    hold(&mut session, -5.0, 0.0);
    ticks(&mut session, 5);
    hold(&mut session, 0.0, 0.0);
    ticks(&mut session, 5);
    assert_eq!(session.steps(), steps + 10);
}

#[test]
fn pictures_show_where_the_vessel_is() {
    let (scene, mut session) = session("hepatic_breathing.toml");
    let wall = session.simulation().lumen().wall(&NoStore).unwrap().clone();
    let mut pictures = Pictures::new(&scene, &session.snapshot(), wall).unwrap();
    let rest = pictures.three_d(&session.snapshot()).unwrap();
    (0..120).for_each(|_| session.tick());
    let inhaled = pictures.three_d(&session.snapshot()).unwrap();
    // A breath takes four seconds.
    (0..120).for_each(|_| session.tick());
    let exhaled = pictures.three_d(&session.snapshot()).unwrap();
    let differ =
        |a: &Image, b: &Image| a.data().iter().zip(b.data()).filter(|(a, b)| a.abs_diff(**b) > 8).count();
    let all = rest.data().len();
    assert!(differ(&rest, &inhaled) > all / 100, "{} of {all}", differ(&rest, &inhaled));
    assert!(differ(&rest, &exhaled) < all / 10_000, "{} of {all}", differ(&rest, &exhaled));
}

#[test]
fn what_hands_inject_is_a_line_of_the_script_at_its_step_and_time() {
    let (path, scene) = scene("arch_vertebral.toml");
    let mut view = ViewSpec::of_scene(&scene, &path).unwrap();
    view.flow.tree = Some(path.with_file_name("../vessels/aortic_arch.csv"));
    let mut session = Session::new(scene.simulation(&NoStore).unwrap(), view, 64, Limits::default()).unwrap();
    let inject = |ml: f64| Input::Inject { ml, ml_per_s: 4.0 };
    // The catheter is out, and the wire has no lumen; then through the catheter twice, between alike steps.
    go(&mut session, "catheter", -60.0, 60);
    session.apply(&inject(2.0)).unwrap();
    let out = session.steps();
    go(&mut session, "catheter", 30.0, 30);
    session.apply(&inject(3.0)).unwrap();
    go(&mut session, "catheter", 30.0, 6);
    session.apply(&inject(4.5)).unwrap();
    assert!(session.script().contains("# 2.0 ml"), "{}", session.script());
    let tip_mm = session.simulation().tip_of_mm(1).unwrap();
    let last = session.snapshot().lab.fluoro().injection.last().cloned().unwrap();
    assert_eq!(last.at_mm.map(endowire_core::Vec3::from), Some(tip_mm));

    let (simulation, injections) = replayed_with_injections(scene, &session);
    assert_eq!(simulation.shape(), session.simulation().shape());
    let reported: Vec<_> =
        injections.iter().map(|one| (one.instrument, one.ml, one.ml_per_s, one.after_step)).collect();
    assert_eq!(reported, [(1, 3.0, 4.0, out + 30), (1, 4.5, 4.0, out + 36)]);
    // A step is a tick; rests are none.
    for one in injections {
        assert!((one.time_s.unwrap() - one.after_step as f64 / 60.0).abs() < 1e-9, "{one:?}");
    }
}

#[test]
fn redo_has_the_same_bits_until_something_else_is_done() {
    let (_, mut session) = session("arch_angiography.toml");
    let flowing = |session: &Session| session.snapshot().lab.fluoro().injection.len();
    let mut shapes = vec![session.simulation().shape().clone()];
    for (mm_per_s, ticks) in [(60.0, 70), (-20.0, 10), (45.0, 80)] {
        go(&mut session, "device", mm_per_s, ticks);
        shapes.push(session.simulation().shape().clone());
    }
    session.apply(&Input::Inject { ml: 5.0, ml_per_s: 5.0 }).unwrap();
    let (script, all) = (session.script(), flowing(&session));
    for (input, steps, shape) in [
        (Input::Undo {}, 80, 2),
        (Input::Undo {}, 70, 1),
        (Input::Redo {}, 80, 2),
        (Input::Undo {}, 70, 1),
        (Input::Undo {}, 0, 0),
        (Input::Redo {}, 70, 1),
        (Input::Redo {}, 80, 2),
        (Input::Redo {}, 160, 3),
        (Input::Redo {}, 160, 3),
    ] {
        session.apply(&input).unwrap();
        assert_eq!((session.steps(), session.simulation().shape()), (steps, &shapes[shape]), "{input:?}");
        // What was injected after the last motion comes and goes with it.
        assert_eq!(flowing(&session) == all, steps == 160, "{input:?}");
    }
    assert_eq!(session.script(), script);
    // A hand that moves, or an injection, takes what was undone away.
    session.apply(&Input::Undo {}).unwrap();
    go(&mut session, "device", 30.0, 3);
    session.apply(&Input::Redo {}).unwrap();
    assert_eq!(session.steps(), 83);
    session.apply(&Input::Undo {}).unwrap();
    session.apply(&Input::Inject { ml: 5.0, ml_per_s: 5.0 }).unwrap();
    session.apply(&Input::Redo {}).unwrap();
    assert_eq!((session.steps(), flowing(&session)), (80, all));
}

/// Where the last injection leaves: in the pictures, and in the record with the name of the instrument.
fn leaves(session: &Session) -> (Vec3, Option<String>, Vec3) {
    let flow = session.snapshot().lab.fluoro().injection.last().cloned().unwrap();
    let outlet = session.record().injections.last().unwrap().outlet.clone().unwrap();
    (flow.at_mm.unwrap().into(), outlet.instrument, outlet.at_mm)
}

#[test]
fn pictures_and_record_know_where_medium_leaves() {
    let (_, mut session) = session("arch_vertebral.toml");
    let inject = Input::Inject { ml: 1.0, ml_per_s: 5.0 };
    go(&mut session, "catheter", -100.0, 60);
    session.apply(&inject).unwrap();
    // Without an instrument that has a lumen it is the sheath, whose mouth is far from the root of the aorta.
    let mouth_mm = session.simulation().sheath().position_mm;
    assert_eq!(leaves(&session), (mouth_mm, None, mouth_mm));
    go(&mut session, "catheter", 60.0, 60);
    go(&mut session, "wire", 60.0, 120);
    session.apply(&inject).unwrap();
    let tip_mm = session.simulation().tip_of_mm(1).unwrap();
    assert_eq!(leaves(&session), (tip_mm, Some("catheter".to_owned()), tip_mm));
    assert!((session.simulation().shape().tip_mm().unwrap() - tip_mm).norm() > 50.0, "the wire is ahead");
}

#[test]
fn a_tip_held_by_the_wall_is_that_which_medium_leaves() {
    // The wire is pushed against the wall far ahead of its catheter, which lies in the lumen.
    let (_, mut session) = session("arch_vertebral.toml");
    let held = |session: &mut Session| {
        session.apply(&Input::Inject { ml: 1.0, ml_per_s: 5.0 }).unwrap();
        session.record().injections.last().unwrap().outlet.clone().unwrap().tip_force_n.unwrap()
    };
    let pushed = (0..400).any(|_| {
        go(&mut session, "wire", 60.0, 1);
        session.simulation().wall_force().tip_n > 1e-3
    });
    assert!(pushed && held(&mut session) < 1e-3, "{:?}", session.simulation().wall_force());
    // The twin: the force at a tip that is the foremost one is that of the record of the steps.
    let outlet = endowire_assess::Outlet::of(session.simulation(), Some(0));
    assert_eq!(outlet.tip_force_n, Some(session.simulation().wall_force().tip_n));
}

#[test]
fn the_readout_has_the_wall_force_that_is_limited() {
    let (_, mut session) = session("arch_innominate.toml");
    let several = (0..600).any(|_| {
        go(&mut session, "device", 60.0, 1);
        session.simulation().wall_force().largest_n < 0.9 * session.simulation().wall_force().sum_n
    });
    assert!(several, "more than one contact");
    let last = session.record().samples.last().unwrap().wall_force_n;
    assert_eq!(session.readout().wall_force_n, last);
}

#[test]
fn what_is_taken_back_is_no_motion_of_the_tip() {
    let (_, mut session) = session("curved_tube.toml");
    let path_mm = |session: &Session| {
        let measured = endowire_assess::assess(session.record(), None);
        measured.iter().find(|one| one.name == "tip_path_mm").unwrap().value.unwrap()
    };
    go(&mut session, "device", 60.0, 60);
    let pushed_mm = path_mm(&session);
    session.apply(&Input::Stop {}).unwrap();
    session.tick();
    go(&mut session, "device", 60.0, 60);
    let twice_mm = path_mm(&session);
    assert!(twice_mm > 1.5 * pushed_mm, "the twin: what hands do is");
    session.apply(&Input::Undo {}).unwrap();
    (0..30).for_each(|_| session.tick());
    assert_eq!(path_mm(&session), twice_mm);
    assert_eq!(session.record().samples.iter().filter(|sample| sample.undone).count(), 1);
    // Where nothing is taken back, nothing is marked.
    session.apply(&Input::GoTo { step: session.steps() }).unwrap();
    session.tick();
    assert_eq!(session.record().samples.iter().filter(|sample| sample.undone).count(), 1);
}

#[test]
fn the_room_refuses_what_it_cannot_do() {
    let (_, mut session) = session("curved_tube.toml");
    let mut refused = |input: Input| session.apply(&input).unwrap_err().to_string();
    let table = |right_mm: f64, second: bool| Input::Table { right_mm, down_mm: 0.0, second };
    for (input, reported) in [
        (
            Input::CArm { pose: "LAO 130".parse().unwrap() },
            "pose = LAO 130 CRA 0: is out of reach: give at most 120°",
        ),
        (Input::CArm { pose: "CAU 70".parse().unwrap() }, "60° CRA or CAU"),
        (table(1e9, false), "right_mm = 1e9: must be a number from -10000 to 10000"),
        (table(1.0, true), "second = true: there is one plane alone"),
    ] {
        let error = refused(input);
        assert!(error.contains(reported), "{error}\n{reported}");
    }
    // A key that is held goes as far as the C-arm does.
    (0..20).for_each(|_| session.apply(&Input::TurnCArm { lao_deg: 20.0, cra_deg: 0.0 }).unwrap());
    assert_eq!(session.readout().lab.lao_deg, 120.0);
    assert_eq!(session.readout().lab.cra_deg, 0.0);
    session.apply(&table(500.0, false)).unwrap();
}

#[test]
fn a_session_without_a_tick_knows_its_beam() {
    let (_, session) = session("curved_tube.toml");
    let measured = endowire_assess::assess(session.record(), None);
    assert_eq!(measured.iter().find(|one| one.name == "beam_on_s").unwrap().value, Some(0.0));
}

#[test]
fn hands_stop_at_the_ends_and_limits_warn() {
    let (path, scene) = scene("curved_tube.toml");
    let view = ViewSpec::of_scene(&scene, &path).unwrap();
    let limits = Limits { push_n: 1e-6, torque_nmm: 1.0 };
    let mut session = Session::new(scene.simulation(&NoStore).unwrap(), view, 64, limits).unwrap();
    session.apply(&Input::Nudge { instrument: None, mm: 30.5, deg: 0.0 }).unwrap();
    (0..40).for_each(|_| session.tick());
    assert_eq!((session.steps(), session.readout().instruments[0].inserted_mm), (31, 30.5));
    session.apply(&Input::Move { instrument: None, mm_per_s: 180.0, deg_per_s: 0.0 }).unwrap();
    (0..40).for_each(|_| session.tick());
    assert!(session.readout().instruments[0].warns);
    assert!(session.events().iter().any(|event| event.kind == EventKind::Limit));
    session.apply(&Input::Move { instrument: None, mm_per_s: -300.0, deg_per_s: 0.0 }).unwrap();
    (0..60).for_each(|_| session.tick());
    assert_eq!(session.readout().instruments[0].inserted_mm, 0.0);
    assert!(
        Session::new(
            scene.simulation(&NoStore).unwrap(),
            ViewSpec::default(),
            64,
            Limits { push_n: 0.0, ..limits }
        )
        .is_err()
    );
}

#[test]
fn pictures_follow_the_pedal() {
    let (scene, mut session) = session("arch_angiography.toml");
    let mut pictures = Pictures::new(
        &scene,
        &session.snapshot(),
        session.simulation().lumen().wall(&NoStore).unwrap().clone(),
    )
    .unwrap();
    assert!(pictures.fluoro(&session.snapshot()).unwrap().is_empty());
    let show = |session: &mut Session, pictures: &mut Pictures, input: Input| {
        session.apply(&input).unwrap();
        session.tick();
        session.tick();
        pictures.fluoro(&session.snapshot()).unwrap()[0].clone()
    };
    let fluoro = Input::Pedal { down: true, mode: Some(Mode::Fluoro) };
    let first = show(&mut session, &mut pictures, fluoro.clone());
    assert_eq!((first.width(), first.height()), (64, 64));
    let turned = show(&mut session, &mut pictures, Input::TurnCArm { lao_deg: -30.0, cra_deg: 10.0 });
    assert_ne!(first, turned);
    let held = show(&mut session, &mut pictures, Input::Pedal { down: false, mode: None });
    assert_eq!(held, turned);
    assert_eq!(session.readout().lab.beam_s, 4.0 / 60.0);
    assert!((session.readout().lab.dose_ugy - 2.0 * 0.03).abs() < 1e-12);
    assert_ne!(show(&mut session, &mut pictures, fluoro), turned);
    let three_d = pictures.three_d(&session.snapshot()).unwrap();
    session.apply(&Input::TurnCamera { azimuth_deg: 40.0, elevation_deg: 0.0 }).unwrap();
    assert_ne!(pictures.three_d(&session.snapshot()).unwrap(), three_d);
    // Contrast medium is seen, and then leaves.
    go(&mut session, "device", 60.0, 240);
    show(&mut session, &mut pictures, Input::Pedal { down: true, mode: Some(Mode::Dsa) });
    show(&mut session, &mut pictures, Input::Inject { ml: 15.0, ml_per_s: 15.0 });
    (0..60).for_each(|_| session.tick());
    let dark = |pictures: &mut Pictures, session: &Session| {
        let image = &pictures.fluoro(&session.snapshot()).unwrap()[0];
        image.data().iter().filter(|pixel| **pixel < 100).count()
    };
    let filled = dark(&mut pictures, &session);
    (0..1200).for_each(|_| session.tick());
    let empty = dark(&mut pictures, &session);
    assert!(filled > 4 * empty + 20, "{filled} {empty}");
}

#[test]
fn two_planes_are_live_together_and_a_room_that_changes_is_coarse_until_it_is_sharp() {
    let (path, scene) = scene("curved_tube.toml");
    let mut view = ViewSpec::of_scene(&scene, &path).unwrap();
    view.biplane_deg = Some(90.0);
    // Pictures of one place are compared, and not what is left of the exposure of another.
    view.xray.brightness_s = 0.0;
    let mut session = Session::new(scene.simulation(&NoStore).unwrap(), view, 64, Limits::default()).unwrap();
    let wall = session.simulation().lumen().wall(&NoStore).unwrap().clone();
    let mut pictures = Pictures::new(&scene, &session.snapshot(), wall.clone()).unwrap();
    session.apply(&Input::Pedal { down: true, mode: Some(Mode::Fluoro) }).unwrap();
    session.tick();
    let before = session.readout().lab.lao_deg;
    assert_eq!(session.readout().lab.second_deg.map(|[lao, _]| lao), Some(before + 90.0));
    let [a, b] = <[_; 2]>::try_from(pictures.fluoro(&session.snapshot()).unwrap().to_vec()).unwrap();
    assert_ne!(a, b);
    session.apply(&Input::TurnCArm { lao_deg: -90.0, cra_deg: 0.0 }).unwrap();
    let turned = pictures.fluoro(&session.snapshot()).unwrap().to_vec();
    assert_eq!(turned[1].data(), a.data(), "the second stands where the first stood");
    // Dose is that of both, a tick of 30 nGy frames at 30 a second.
    assert!((session.readout().lab.dose_ugy - 2.0 * 0.03 / 2.0).abs() < 1e-12);
    // The table goes along the picture that was dragged.
    let isocentre = |session: &Session| session.snapshot().lab.fluoro().c_arm.isocentre_mm.unwrap();
    let at = isocentre(&session);
    session.apply(&Input::Table { right_mm: 2.0, down_mm: 0.0, second: false }).unwrap();
    let first = isocentre(&session);
    session.apply(&Input::Table { right_mm: 2.0, down_mm: 0.0, second: true }).unwrap();
    let second = isocentre(&session);
    let way = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| b[k] - a[k]);
    let dot: f64 = way(at, first).into_iter().zip(way(first, second)).map(|(a, b)| a * b).sum();
    assert!(dot.abs() < 1e-9 && at != first && first != second, "{dot}");

    // On a clock the first frames of a new room are coarse, the last ones those of who waits.
    let mut sharp = Pictures::new(&scene, &session.snapshot(), wall).unwrap();
    let widths = |images: &[endowire_viewer::Image]| images.iter().map(|i| i.width()).collect::<Vec<_>>();
    let mut under_way = Vec::new();
    let mut frames = 0;
    while under_way.is_empty() {
        assert_eq!(widths(pictures.soon(&session.snapshot()).unwrap()), [16, 16]);
        under_way = pictures.sharpenings(&session.snapshot()).unwrap();
        frames += 1;
        session.tick();
    }
    assert_eq!((frames, under_way.len()), (4, 2), "three frames of rest");
    assert!(pictures.sharpenings(&session.snapshot()).unwrap().is_empty(), "each is under way once");
    for one in under_way {
        pictures.sharpened(one.carry_out()).unwrap();
    }
    assert_eq!(pictures.soon(&session.snapshot()).unwrap(), sharp.fluoro(&session.snapshot()).unwrap());
    session.apply(&Input::Collimate { width: 0.5, height: 0.5 }).unwrap();
    assert_eq!(widths(pictures.soon(&session.snapshot()).unwrap()), [16, 16]);
}

#[test]
fn entrance_kerma_and_kerma_area_are_those_of_the_open_field() {
    let (path, scene) = scene("curved_tube.toml");
    let view = ViewSpec::of_scene(&scene, &path).unwrap();
    let simulation = scene.simulation(&NoStore).unwrap();
    let mut session = Session::new(simulation, view, 64, Limits::default()).unwrap();
    session.apply(&Input::Pedal { down: true, mode: Some(Mode::Fluoro) }).unwrap();
    assert_eq!(session.readout().lab.entrance_ugy, None, "it depends on a patient who was not seen");
    (0..60).for_each(|_| session.tick());
    let whole = session.readout().lab;
    // A second of 30 frames of 30 nGy at the detector, the tissue, and distances of 1100 and 600 mm.
    let (entrance, area) = (whole.entrance_ugy.unwrap(), whole.kerma_area_ugym2.unwrap());
    assert!((whole.dose_ugy - 0.9).abs() < 1e-9);
    assert!((10.0..1000.0).contains(&(entrance / whole.dose_ugy)), "{entrance}");
    let side_m = whole.field_mm * 1e-3 * 600.0 / 750.0;
    assert!((area / (entrance * side_m * side_m) - 1.0).abs() < 1e-9, "{area} {entrance}");
    assert_eq!((whole.kvp, whole.current_ma, whole.sid_mm), (80.0, None, 1100.0));
    // Half of the width for another second: as much at the entrance, half as much on the area.
    session.apply(&Input::Collimate { width: 0.5, height: 1.0 }).unwrap();
    (0..60).for_each(|_| session.tick());
    let narrow = session.readout().lab;
    assert!((narrow.entrance_ugy.unwrap() / entrance - 2.0).abs() < 0.05, "{:?}", narrow.entrance_ugy);
    let more = narrow.kerma_area_ugym2.unwrap() / area - 1.0;
    assert!((more - 0.5).abs() < 0.03, "{more}");
}

#[test]
fn dose_is_what_exposure_control_brings_whether_or_not_pictures_are_drawn() {
    let (path, scene) = scene("curved_tube.toml");
    let dose = |most_ma: f64| {
        let mut view = ViewSpec::of_scene(&scene, &path).unwrap();
        view.xray.pulse_ms = 8.0;
        let control = ExposureSpec { current_ma: [0.01, most_ma], curve: vec![[100.0, 125.0]] };
        view.exposure = Some(control);
        let simulation = scene.simulation(&NoStore).unwrap();
        let mut session = Session::new(simulation, view, 64, Limits::default()).unwrap();
        session.apply(&Input::Pedal { down: true, mode: Some(Mode::Fluoro) }).unwrap();
        (0..60).for_each(|_| session.tick());
        (session.readout().lab.dose_ugy, session.record().beam.clone().unwrap())
    };
    // A second of 30 frames of 30 nGy, if the tube can.
    let wanted = 30.0 * 0.03;
    let (strong, _) = dose(1000.0);
    assert!((strong - wanted).abs() < 1e-9);
    let (weak, beam) = dose(0.02);
    assert!(weak < 0.5 * wanted && weak > 0.0, "{weak}");
    // The record has the same from the first tick on, and what it is at the entrance.
    let [state] = beam.as_slice() else { panic!("{beam:?}") };
    assert!((state.dose_ngy * 30.0 / 1000.0 - weak).abs() < 1e-9);
    assert!(state.entrance_ngy.unwrap() > 10.0 * state.dose_ngy, "{state:?}");
}

#[test]
fn a_session_is_repeated_by_its_inputs_and_a_tip_beside_the_picture_is_not_seen() {
    let (path, scene) = scene("curved_tube.toml");
    let begun = || {
        let view = ViewSpec::of_scene(&scene, &path).unwrap();
        let simulation = scene.simulation(&NoStore).unwrap();
        Session::new(simulation, view, 64, Limits::default()).unwrap()
    };
    let mut session = begun().with_ticks(TICK_SOLVES).unwrap();
    let push = |session: &mut Session, ticks: usize| {
        session.apply(&Input::Move { instrument: None, mm_per_s: 20.0, deg_per_s: 45.0 }).unwrap();
        (0..ticks).for_each(|_| session.tick());
        session.apply(&Input::Stop {}).unwrap();
    };
    session.apply(&Input::Pedal { down: true, mode: Some(Mode::Fluoro) }).unwrap();
    push(&mut session, 60);
    assert!(session.record().samples.iter().all(|sample| !sample.out_of_picture));
    session.apply(&Input::Undo {}).unwrap();
    session.apply(&Input::Table { right_mm: 500.0, down_mm: 0.0, second: false }).unwrap();
    session.apply(&Input::Zoom { factor: 10.0 }).unwrap();
    push(&mut session, 30);
    assert!(session.record().samples.iter().any(|sample| sample.out_of_picture));
    let inputs = serde_json::to_string(&session.inputs()).unwrap();
    let inputs: Inputs = serde_json::from_str(&inputs).unwrap();
    let again = inputs.repeat_in(begun()).unwrap();
    assert_eq!(again.record(), session.record());
    // A script is not the work of hands, and a session has an end.
    for wrong in [
        r#"{"ticks": 3, "inputs": [[0, {"do": "script"}]]}"#,
        r#"{"ticks": 3, "inputs": [[4, {"do": "stop"}]]}"#,
        r#"{"ticks": 1000000000000, "inputs": []}"#,
    ] {
        let wrong: Inputs = serde_json::from_str(wrong).unwrap();
        assert!(wrong.repeat_in(begun()).unwrap_err().is_input());
    }
}

#[test]
fn inputs_are_read_as_they_are_documented() {
    let read = |text: &str| serde_json::from_str::<Input>(text);
    assert_eq!(
        read(r#"{"do": "move", "instrument": "wire", "mm_per_s": 20}"#).unwrap(),
        Input::Move { instrument: Some("wire".to_owned()), mm_per_s: 20.0, deg_per_s: 0.0 }
    );
    assert_eq!(
        read(r#"{"do": "pedal", "down": true, "mode": "cine"}"#).unwrap(),
        Input::Pedal { down: true, mode: Some(Mode::Cine) }
    );
    assert_eq!(read(r#"{"do": "script"}"#).unwrap(), Input::Script {});
    assert!(matches!(read(r#"{"do": "c_arm", "pose": "LAO 40"}"#), Ok(Input::CArm { .. })));
    assert_eq!(
        read(r#"{"do": "turn_c_arm", "lao_deg": 5}"#).unwrap(),
        Input::TurnCArm { lao_deg: 5.0, cra_deg: 0.0 }
    );
    for wrong in [r#"{"do": "mve"}"#, r#"{"do": "stop", "now": 1}"#, r#"{"do": "zoom"}"#, "[]", "{"] {
        read(wrong).unwrap_err();
    }
}
