//! Trainees who work in the simulator itself: what the physics answers to their hands tells them apart.

#[path = "../../examples/cohort/plan.rs"]
pub(crate) mod plan;
#[path = "../../examples/cohort/trainee.rs"]
mod trainee;

use std::path::Path;

use plan::Place;
use trainee::{Class, KINDS};

use endowire_assess::{Exam, Score, Site, Subject, auc};
use endowire_core::vessel::NoStore;
use endowire_methods::Scene;
use endowire_play::{Input, Limits, Session, TICK_SOLVES};
use endowire_viewer::{Mode, ViewSpec};

/// What hands do one after another: advance, mm, and rotation, degrees.
type Plan = [[f64; 2]; 4];

/// How fast trainees of a kind are, relative to each other.
const PACES: [f64; 3] = [0.85, 1.0, 1.15];
/// How fast hands turn.
const DEG_PER_S: f64 = 90.0;

/// A session of a subject, as a window has it.
fn begun(subject: &str) -> Session {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/subjects").join(subject);
    let subject = Subject::read(&path).unwrap();
    let scene_path = subject.resolve(&subject.scene);
    let scene = Scene::read(&scene_path).unwrap();
    let view = ViewSpec::of_scene(&scene, &scene_path).unwrap();
    let simulation = scene.simulation(&NoStore).unwrap();
    let site = Site { tree: Some(scene.centreline(&NoStore).unwrap()), ..Site::default() };
    let exam = Exam::new(subject, &site).unwrap();
    let session = Session::new(simulation, view, 64, Limits::default()).unwrap();
    session.with_ticks(TICK_SOLVES).unwrap().with_exam(exam)
}

/// The score of somebody who carries out a plan at this speed, with the beam on, and looks for a third of a second
/// after each motion.
fn score(subject: &str, plan: Plan, mm_per_s: f64, pace: f64) -> Score {
    let mut session = begun(subject);
    session.apply(&Input::Pedal { down: true, mode: Some(Mode::Fluoro) }).unwrap();
    for [advance_mm, rotate_deg] in plan {
        let takes_s = (advance_mm.abs() / mm_per_s).max(rotate_deg.abs() / DEG_PER_S) / pace;
        let ticks = (takes_s * 60.0).round().max(1.0);
        let [mm_per_s, deg_per_s] = [advance_mm, rotate_deg].map(|by| by * 60.0 / ticks);
        session.apply(&Input::Move { instrument: None, mm_per_s, deg_per_s }).unwrap();
        (0..ticks as usize).for_each(|_| session.tick());
        session.apply(&Input::Stop {}).unwrap();
        (0..20).for_each(|_| session.tick());
    }
    (*session.score().unwrap()).clone()
}

#[test]
fn scores_separate_pushing_a_hook_against_the_wall_from_turning_it_first() {
    // The hook is turned away from the branches before, then into the one that is meant. Who pushes too fast and too
    // far meanwhile has to come back, has been elsewhere or presses on the arch.
    for (subject, clean, pushing) in [
        (
            "left_carotid.toml",
            [[0.0, 200.0], [240.0, 0.0], [0.0, 150.0], [45.0, 0.0]],
            [[0.0, 200.0], [270.0, 0.0], [-30.0, 150.0], [75.0, 0.0]],
        ),
        (
            "innominate.toml",
            [[0.0, 200.0], [250.0, 0.0], [0.0, 150.0], [35.0, 0.0]],
            [[0.0, 200.0], [280.0, 0.0], [-30.0, 150.0], [65.0, 0.0]],
        ),
    ] {
        for pace in PACES {
            let clean = score(subject, clean, 9.0, pace);
            assert!(clean.verdict.passed && clean.verdict.score == 100.0, "{subject} {pace}: {clean:?}");
            let pushing = score(subject, pushing, 65.0, pace);
            assert!(!pushing.verdict.passed && pushing.verdict.score < 90.0, "{subject} {pace}: {pushing:?}");
        }
    }
}

/// Scores of all kinds in a subject, with their classes.
fn cohort(subject: &str) -> Vec<(Class, &'static str, Score)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/subjects").join(subject);
    let place = Place::of(&path);
    let plan = place.plan();
    KINDS.iter().map(|kind| (kind.class, kind.name, (*kind.score(&place, &plan)).clone())).collect()
}

#[test]
fn a_cohort_is_ordered_as_a_teacher_would() {
    // `cargo run --example cohort` has all subjects.
    let subject = "first_loops.toml";
    let all = cohort(subject);
    let of = |class: Class| all.iter().filter(move |one| one.0 == class).map(|one| one.2.verdict.score);
    let ends = |class: Class| (of(class).fold(f64::MAX, f64::min), of(class).fold(f64::MIN, f64::max));
    for pair in Class::ALL.windows(2) {
        let (better, worse) = (ends(pair[0]), ends(pair[1]));
        assert!(better.0 > worse.1, "{subject}: {pair:?} {better:?} {worse:?}");
    }
    for (class, name, score) in &all {
        assert_eq!(score.verdict.passed, class.passes(), "{subject}: {name} {:?}", score.verdict);
    }
    assert!(ends(Class::Good).0 >= 90.0 && ends(Class::Reckless).1 <= 40.0, "{subject}");
    let of = |passes: bool| -> Vec<f64> {
        all.iter().filter(|one| one.0.passes() == passes).map(|one| one.2.verdict.score).collect()
    };
    assert_eq!(auc(&of(false), &of(true)), 1.0, "{subject}");
    // Counter-check: a score that is the time alone takes the slow for novices.
    let times = |passes: bool| -> Vec<f64> {
        let of = all.iter().filter(|one| one.0.passes() == passes);
        of.map(|one| {
            -one.2.metrics.iter().find(|one| one.metric.name == "total_s").unwrap().metric.value.unwrap()
        })
        .collect()
    };
    assert!(auc(&times(false), &times(true)) < 0.8, "{subject}");
}
