//! Subjects and exams by hand: a file is refused by its key, and a record is scored until its end.

use crate::beam;

use std::path::Path;

use beam::beam;
use endowire_assess::{
    Band, EndedBy, Exam, Hand, Injection, Outlet, Record, SCHEMA, Sample, Score, Site, Subject,
};
use endowire_core::Vec3;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, Target};

const FILE: &str = r#"
name = "To the end"
level = 2
text = "Push on."
scene = "scene.toml"

[goal]
target = "end"
tip_within_mm = 5.0

[limits]
time_s = 30.0
beam_s = 12.0
contrast_ml = 10.0
wall_force_n = 2.0

[[threshold]]
metric = "wall_force_n"
at_most = 1.0
points = 3

[[threshold]]
metric = "total_s"
at_most = 20.0

[[threshold]]
metric = "spectral_arc_length"
at_least = -100.0
points = 0
"#;

fn subject(changes: &[(&str, &str)]) -> Result<Subject, String> {
    let text = changes.iter().fold(FILE.to_owned(), |text, (piece, other)| {
        assert!(text.contains(piece), "{piece}");
        text.replacen(piece, other, 1)
    });
    Subject::from_toml(&text, Path::new("subjects/end.toml")).map_err(|error| error.to_string())
}

/// A straight line of 100 mm.
fn tree() -> CentrelineTree {
    let node =
        |x: f64, parent| CentrelineNode { position_mm: Vec3::new(x, 0.0, 0.0), radius_mm: 5.0, parent };
    let nodes = vec![node(0.0, None), node(100.0, Some(0))];
    let target = |name: &str, row| Target { name: name.to_owned(), row };
    CentrelineTree::new(nodes).unwrap().with_targets(vec![target("start", 0), target("end", 1)]).unwrap()
}

/// Pushes by 10 mm a second, up to 97 mm, with a force at each second.
fn pushed(force_n: impl Fn(usize) -> f64) -> Record {
    let sample = |k: usize| Sample {
        time_s: k as f64,
        tip_mm: Some(Vec3::new((10.0 * k as f64).min(97.0), 0.0, 0.0)),
        hands: vec![Hand { advance_mm: 10.0, ..Hand::default() }],
        wall_force_n: force_n(k),
        ..Sample::default()
    };
    let beam = Some(vec![beam(0.0, true)]);
    Record { samples: (1..=10).map(sample).collect(), beam, ..Record::default() }
}

/// The same without any record of a beam.
fn unseen(force_n: impl Fn(usize) -> f64) -> Record {
    Record { beam: None, ..pushed(force_n) }
}

/// The subject on the line, with a wire in a catheter and no sac.
fn at_site(subject: Subject) -> Result<Exam, String> {
    let (tree, instruments) = (tree(), ["wire", "catheter"].map(str::to_owned));
    let site = Site { tree: Some(&tree), instruments: &instruments, ..Site::default() };
    Exam::new(subject, &site).map_err(|error| error.to_string())
}

/// An injection of 5 ml/s that leaves the catheter's tip at this length of the line.
fn injection(time_s: f64, volume_ml: f64, at_mm: f64) -> Injection {
    let outlet = Outlet {
        instrument: Some("catheter".to_owned()),
        at_mm: Vec3::new(at_mm, 0.0, 0.0),
        tip_force_n: Some(0.0),
    };
    Injection { time_s, volume_ml, rate_ml_per_s: 5.0, outlet: Some(outlet) }
}

fn exam(subject: Subject) -> Exam {
    at_site(subject).unwrap()
}

fn score(record: &Record) -> Score {
    (*exam(subject(&[]).unwrap()).score(record)).clone()
}

fn end(score: &Score) -> Option<(EndedBy, f64)> {
    score.verdict.ended.map(|ended| (ended.by, ended.time_s))
}

#[test]
fn a_record_is_scored_by_its_thresholds_until_its_goal() {
    let clean = score(&pushed(|_| 0.5));
    assert_eq!(end(&clean), Some((EndedBy::Goal, 10.0)));
    assert_eq!((clean.verdict.passed, clean.verdict.score, clean.subject.as_str()), (true, 100.0, "end"));
    let total = clean.metrics.iter().find(|one| one.metric.name == "total_s").unwrap();
    assert_eq!((total.metric.value, total.passed), (Some(10.0), Some(true)));
    assert_eq!((clean.asked().count(), clean.schema, clean.verdict.band), (9, SCHEMA, Band::Passed));

    // Who pushes too hard does not pass, and keeps a quarter of the three points of eleven; who pushes much too hard is
    // stopped.
    let hard = score(&pushed(|k| if k == 4 { 1.5 } else { 0.5 }));
    assert_eq!((hard.verdict.band, end(&hard).unwrap().0), (Band::Missed, EndedBy::Goal));
    assert!((hard.verdict.score - (40.0 + 40.0 * 8.75 / 11.0)).abs() < 1e-9, "{:?}", hard.verdict);
    let rough = score(&pushed(|k| if k == 4 { 2.5 } else { 0.5 }));
    assert_eq!((rough.verdict.passed, rough.verdict.band), (false, Band::NotReached));
    assert!((rough.verdict.score - 20.0 * 30.0 / 90.0).abs() < 1e-9, "{:?}", rough.verdict);
    assert_eq!(end(&rough), Some((EndedBy::WallForce, 4.0)));

    // What is reported alone need not be kept, and what was not measured is not kept.
    let reported = subject(&[("at_least = -100.0", "at_least = -0.5")]).unwrap();
    assert!(exam(reported).score(&pushed(|_| 0.5)).verdict.passed);
    let of_beam = [("\"total_s\"", "\"beam_on_s\""), ("at_most = 20.0", "at_most = 12.0")];
    let of_beam = subject(&of_beam).unwrap();
    let unseen = exam(of_beam.clone()).score(&unseen(|_| 0.5));
    assert_eq!((unseen.verdict.passed, unseen.verdict.band), (false, Band::Missed));
    // It is not missed either, and the reason is reported: the limit of the beam has the same.
    let threshold = unseen.metrics.iter().find(|one| one.metric.name == "beam_on_s").unwrap();
    assert_eq!((threshold.passed, threshold.kept_words()), (None, "not judged"));
    let unjudged: Vec<&str> = unseen.unjudged.iter().map(|one| one.what.as_str()).collect();
    assert_eq!(
        unjudged,
        ["beam_on_s", "beam_on_idle_s", "moving_in_acquisition_s", "unseen_share", "limits.beam_s"]
    );
    let [words] = unseen.unjudged_words().try_into().unwrap();
    assert!(
        words.starts_with("not judged: beam_on_s, ") && words.contains("no beam was recorded"),
        "{words}"
    );
    assert!(exam(of_beam).score(&pushed(|_| 0.5)).unjudged.is_empty());
    // Where nothing was done, that is the reason, and not that instruments or a sac are missing.
    let of_two =
        [("\"spectral_arc_length\"", "\"catheter_ahead_s\""), ("at_least = -100.0", "at_most = 1.0")];
    let of_two = subject(&of_two).unwrap();
    let nothing = exam(of_two).score(&Record { beam: Some(vec![]), ..Record::default() });
    assert!(nothing.unjudged.iter().any(|one| one.what == "catheter_ahead_s"), "{:?}", nothing.unjudged);
    assert!(nothing.unjudged.iter().all(|one| one.why == "nothing was done in the session"));

    // What comes after the end does not count.
    let mut longer = pushed(|_| 0.5);
    longer.samples.push(Sample { time_s: 40.0, wall_force_n: 9.0, ..longer.samples[9].clone() });
    assert_eq!(score(&longer), clean);
}

#[test]
fn who_stops_on_the_way_gets_the_part_of_it_that_was_covered() {
    let until = |mm: usize, change: &dyn Fn(&mut Record)| {
        let mut record = pushed(|_| 0.5);
        record.samples.truncate(mm / 10);
        change(&mut record);
        let verdict = score(&record).verdict;
        assert_eq!((verdict.passed, verdict.band, verdict.ended), (false, Band::NotReached, None), "{mm}");
        verdict.score
    };
    // From 10 mm to 100 mm. Going back takes nothing off.
    let near = |score: f64, expected: f64| assert!((score - expected).abs() < 1e-9, "{score} {expected}");
    near(until(80, &|_| ()), 40.0 * 70.0 / 90.0);
    near(until(80, &|record| record.samples[7].tip_mm = record.samples[3].tip_mm), 40.0 * 60.0 / 90.0);
    near(until(10, &|_| ()), 0.0);
    // Unseen, and too fast as well.
    near(until(80, &|record| record.beam = Some(vec![])), 5.0 * 70.0 / 90.0);
    let fast = |record: &mut Record| record.samples.iter_mut().for_each(|one| one.time_s /= 8.0);
    near(until(80, &fast), 20.0 * 70.0 / 90.0);
    near(
        until(80, &|record| {
            fast(record);
            record.beam = Some(vec![]);
        }),
        0.0,
    );
}

#[test]
fn limits_end_it_when_they_are_passed() {
    // The tip rests at 50 mm until 40 s.
    let mut slow = unseen(|_| 0.5);
    slow.samples.truncate(5);
    slow.samples.push(Sample { time_s: 40.0, hands: vec![Hand::default()], ..slow.samples[4].clone() });
    assert_eq!(end(&score(&slow)), Some((EndedBy::Time, 30.0)));
    slow.beam = Some(vec![beam(0.0, true), beam(4.0, false), beam(6.0, true)]);
    assert_eq!(end(&score(&slow)), Some((EndedBy::Beam, 14.0)));
    let ml = |time_s, volume_ml| injection(time_s, volume_ml, 0.0);
    slow.injections = vec![ml(2.0, 8.0), ml(9.0, 2.0), ml(11.0, 1.0)];
    assert_eq!(end(&score(&slow)), Some((EndedBy::Contrast, 11.0)));
    let contrast = |record: &Record| {
        let score = score(record);
        score.metrics.iter().find(|one| one.metric.name == "contrast_ml").unwrap().metric.value.unwrap()
    };
    assert!((contrast(&slow) - 10.0).abs() < 1e-9);
    // The limit is passed when medium flows beyond it, not when the injector is started.
    slow.injections = vec![ml(1.0, 20.0)];
    assert_eq!(end(&score(&slow)), Some((EndedBy::Contrast, 3.0)));
    assert!((contrast(&slow) - 10.0).abs() < 1e-9);
}

#[test]
fn what_is_used_stands_still_once_it_has_ended() {
    let mut record = pushed(|_| 0.5);
    record.beam = Some(vec![beam(0.0, true)]);
    let mut followed = exam(subject(&[]).unwrap());
    assert!(followed.follow(&record).is_some());
    let used =
        |record: &Record| followed.standing(record).used.iter().map(|one| one.value).collect::<Vec<_>>();
    let at_the_end = used(&record);
    assert_eq!(at_the_end, [10.0, 10.0, 0.0, 0.5]);
    record.samples.push(Sample { time_s: 25.0, hands: vec![Hand::default()], ..record.samples[9].clone() });
    record.injections.push(injection(12.0, 5.0, 97.0));
    assert_eq!(used(&record), at_the_end);
}

/// The score of a subject with more thresholds, of a record that reaches its goal.
fn score_of(record: &Record, more: &str) -> Score {
    let text = format!("{FILE}\n{more}");
    let subject = Subject::from_toml(&text, Path::new("subjects/end.toml")).unwrap();
    (*exam(subject).score(record)).clone()
}

#[test]
fn a_grave_fault_and_blindness_cannot_be_made_good_by_anything_else() {
    let mut record = pushed(|_| 0.5);
    record.samples[3].hands[0].push_force_n = Some(0.5);
    let missed = "[[threshold]]\nmetric = \"hand_force_n\"\nat_most = 0.1\npoints = 0.01";
    let of = |record: &Record, more: &str| {
        let verdict = score_of(record, more).verdict;
        (verdict.band, verdict.score)
    };
    let (band, score) = of(&record, missed);
    assert!(band == Band::Missed && (79.0..80.0).contains(&score), "{score}");
    let grave = format!("{missed}\ngrave = true");
    let (band, score) = of(&record, &grave);
    assert!(band == Band::Reckless && (39.0..40.0).contains(&score), "{score}");
    // Moved unseen: with the beam off, or beside its picture.
    let dark = Record { beam: Some(vec![beam(0.0, false)]), ..record.clone() };
    let mut beside = record.clone();
    beside.samples.iter_mut().for_each(|sample| sample.out_of_picture = true);
    for blind in [dark, beside] {
        let (band, score) = of(&blind, missed);
        assert!(band == Band::Blind && (5.0..10.0).contains(&score), "{score}");
        let (band, score) = of(&blind, &grave);
        assert!(band == Band::Blind && score < 5.0, "{score}");
    }
    // Too fast for the instrument: as of its thickness, or as the subject asks.
    let fast = pushed(|_| 0.5);
    let slow = "[[threshold]]\nmetric = \"push_speed_mm_per_s\"\nat_most = 5.0";
    assert_eq!((of(&fast, "").0, of(&fast, slow).0), (Band::Passed, Band::Reckless));
}

#[test]
fn credit_falls_from_the_good_value_to_half_at_the_threshold() {
    let with = |good: &str| {
        let changed = subject(&[("at_most = 20.0", &format!("at_most = 20.0\n{good}"))]).unwrap();
        let score = exam(changed).score(&pushed(|_| 0.5));
        let total = score.metrics.iter().find(|one| one.metric.name == "total_s").unwrap();
        (total.credit.unwrap(), score.verdict.passed)
    };
    // Ten seconds.
    assert_eq!((with(""), with("good = 15.0")), ((1.0, true), (1.0, true)));
    assert_eq!(with("good = 0.0"), (0.75, true));
    let error = subject(&[("at_most = 20.0", "at_most = 20.0\ngood = 30.0")]).unwrap_err();
    assert!(error.contains("threshold[1].good = 30: the whole credit is given up to there"), "{error}");
}

#[test]
fn no_subject_can_do_without_the_beam() {
    for (asked, refused) in
        [("at_most = 0.5", true), ("at_most = 0.1\npoints = 0", true), ("at_most = 0.05", false)]
    {
        let more = format!("[[threshold]]\nmetric = \"unseen_share\"\n{asked}");
        let text = format!("{FILE}\n{more}");
        let read = Subject::from_toml(&text, Path::new("subjects/end.toml"));
        assert_eq!(read.is_err(), refused, "{asked}");
    }
    // An exam asks for more: a second of ten without the beam.
    let late = Record { beam: Some(vec![beam(0.4, true)]), ..pushed(|_| 0.5) };
    let of = |exams: &str| {
        let changed = subject(&[("level = 2", &format!("level = 2\n{exams}"))]).unwrap();
        let score = exam(changed).score(&late);
        (score.verdict.band, score.exam)
    };
    assert_eq!(of(""), (Band::Passed, false));
    assert_eq!(of("exam = true"), (Band::Blind, true));
}

#[test]
fn contrast_medium_counts_where_the_tip_is_at_its_target() {
    let asked = subject(&[("tip_within_mm = 5.0", "tip_within_mm = 5.0\ninject_ml = 4.0")]).unwrap();
    let ml = |time_s, volume_ml| injection(time_s, volume_ml, 97.0);
    let mut record = unseen(|_| 0.5);
    record.samples.push(Sample { time_s: 20.0, hands: vec![Hand::default()], ..record.samples[9].clone() });
    // The goal is reached once all of it has flowed, 4 ml at 5 ml/s.
    for (injections, expected) in [
        (vec![ml(3.0, 4.0)], None),
        (vec![ml(12.0, 4.0)], Some((EndedBy::Goal, 12.8))),
        (vec![ml(12.0, 3.0), ml(15.0, 1.0)], Some((EndedBy::Goal, 15.2))),
        (vec![ml(19.5, 4.0)], None),
    ] {
        record.injections = injections;
        assert_eq!(end(&exam(asked.clone()).score(&record)), expected);
    }
}

#[test]
fn contrast_medium_counts_where_it_leaves_and_not_where_the_foremost_tip_is() {
    let asked = subject(&[("tip_within_mm = 5.0", "tip_within_mm = 5.0\ninject_ml = 4.0")]).unwrap();
    let mut record = unseen(|_| 0.5);
    record.samples.push(Sample { time_s: 20.0, hands: vec![Hand::default()], ..record.samples[9].clone() });
    let scored = |record: &Record| {
        let mut followed = exam(asked.clone());
        let ended = followed.follow(record).and_then(|score| end(score));
        (ended, followed.standing(record).injected_there_ml)
    };
    record.injections = vec![injection(12.0, 4.0, 96.0)];
    assert_eq!(scored(&record), (Some((EndedBy::Goal, 12.8)), 4.0), "the twin");
    // The wire is there, and the catheter 50 mm behind it; or all goes through the sheath.
    record.injections = vec![injection(12.0, 4.0, 50.0)];
    assert_eq!(scored(&record), (None, 0.0));
    let sheath = Outlet { instrument: None, at_mm: Vec3::zeros(), tip_force_n: Some(0.0) };
    record.injections[0].outlet = Some(sheath);
    assert_eq!(scored(&record), (None, 0.0));
    assert!(exam(asked.clone()).check(&record).is_ok());
    // A record of an earlier version does not say where.
    record.injections[0].outlet = None;
    let error = exam(asked.clone()).check(&record).unwrap_err().to_string();
    assert!(
        error.contains("goal.inject_ml = 4: the record does not tell where medium was injected"),
        "{error}"
    );
    // Where all instruments are solid it cannot be done.
    let (tree, instruments) = (tree(), ["wire".to_owned()]);
    let site = Site { tree: Some(&tree), instruments: &instruments, all_solid: true, ..Site::default() };
    let error = Exam::new(asked, &site).unwrap_err().to_string();
    assert!(error.contains("end.toml: goal.inject_ml = 4: no instrument has a lumen"), "{error}");
    assert!(Exam::new(subject(&[]).unwrap(), &site).is_ok(), "nothing is injected");
}

#[test]
fn an_exam_ends_alike_tick_by_tick_and_whole() {
    // Ticks of a tenth of a second; the tip comes to its target by itself, and rests are one sample.
    let mut record = Record { beam: Some(vec![beam(0.0, true)]), ..Record::default() };
    let mut followed = exam(subject(&[]).unwrap());
    let mut at_the_end = None;
    for tick in 1..=120 {
        let time_s = f64::from(tick) * 0.1;
        let x = if tick < 60 { 0.5 * f64::from(tick) } else { 98.0 };
        let advance_mm = if tick < 60 { 0.5 } else { 0.0 };
        let tip_mm = Some(Vec3::new(x, 0.0, 0.0));
        let hands = vec![Hand { advance_mm, ..Hand::default() }];
        let sample = Sample { time_s, tip_mm, hands, ..Sample::default() };
        match record.samples.last_mut() {
            Some(last) if (Sample { time_s: last.time_s, ..sample.clone() }) == *last && tick > 60 => {
                last.time_s = time_s;
            }
            _ => record.samples.push(sample),
        }
        let ended = followed.follow(&record).cloned();
        assert!(ended.is_none() || at_the_end.is_none(), "it ends once");
        at_the_end = at_the_end.or(ended);
    }
    let whole = exam(subject(&[]).unwrap()).score(&record);
    assert_eq!(at_the_end, Some(whole.clone()));
    assert_eq!(end(&whole).unwrap().0, EndedBy::Goal);
    assert_eq!(followed.standing(&record).verdict, Some(whole.verdict));
}

#[test]
fn a_vessel_that_moves_takes_its_target_along() {
    let mut record = pushed(|_| 0.5);
    let lateral = Vec3::new(0.0, 12.0, 0.0);
    for sample in &mut record.samples {
        sample.tip_at_rest_mm = sample.tip_mm;
        sample.tip_mm = sample.tip_mm.map(|tip| tip + lateral);
    }
    assert!(score(&record).verdict.passed);
    record.samples.iter_mut().for_each(|sample| sample.tip_at_rest_mm = None);
    assert!(!score(&record).verdict.passed, "12 mm beside it");
}

#[test]
fn a_file_that_does_not_fit_is_refused_by_key_and_value() {
    let file = "subjects/end.toml: ";
    for (from, to, reported) in [
        (
            "\"wall_force_n\"\n",
            "\"wall_force\"\n",
            "threshold[0].metric = \"wall_force\": is no measure; did you mean \"wall_force_n\"",
        ),
        (
            "at_most = 1.0",
            "at_least = 1.0",
            "threshold[0].at_least = 1: of wall_force_n less is better: give at_most",
        ),
        (
            "at_least = -100.0",
            "at_most = -1.0",
            "threshold[2].at_most = -1: of spectral_arc_length more is better: give at_least",
        ),
        ("at_most = 1.0", "", "threshold[0].at_most = none: which value of wall_force_n"),
        ("at_most = 1.0", "at_most = nan", "threshold[0].at_most = NaN"),
        ("at_most = 1.0", "at_most = -1.0", "threshold[0].at_most = -1: wall_force_n is never below 0"),
        (
            "at_most = 20.0",
            "at_most = 300.0",
            "threshold[1].at_most = 300: is never missed, since limits.time_s = 30 ends the subject before",
        ),
        (
            "at_most = 1.0",
            "at_most = 2.5",
            "threshold[0].at_most = 2.5: is never missed, since limits.wall_force_n = 2",
        ),
        (
            "\"spectral_arc_length\"\nat_least = -100.0",
            "\"arrived\"\nat_least = 2.0",
            "threshold[2].at_least = 2: arrived is never above 1, and no session would pass",
        ),
        ("points = 3", "points = -1.0", "threshold[0].points = -1: must be a number from 0"),
        (
            "\"total_s\"",
            "\"wall_force_n\"",
            "threshold[1].metric = \"wall_force_n\": has a threshold already",
        ),
        ("level = 2", "level = 5", "level = 5: must be from 1 to 4"),
        ("level = 2", "level = \"hard\"", "line 3: level: must be a whole number"),
        ("text = \"Push on.\"", "text = \" \"", "text = \"\": must not be empty"),
        ("tip_within_mm = 5.0", "tip_within_mm = 0.0", "goal.tip_within_mm = 0: must be a number above 0"),
        ("time_s = 30.0", "time_s = -1.0", "limits.time_s = -1: must be a number above 0"),
        (
            "tip_within_mm = 5.0",
            "tip_within_mm = 5.0\ninject_ml = 11.0",
            "goal.inject_ml = 11: more than limits.contrast_ml = 10",
        ),
        ("wall_force_n = 2.0", "wal_force_n = 2.0", "did you mean `wall_force_n`?"),
        ("points = 3", "weight = 3", "unknown field `weight`"),
    ] {
        let error = subject(&[(from, to)]).unwrap_err();
        assert!(error.starts_with(file) && error.contains(reported), "{error}\n{reported}");
    }
    for (target, reported) in
        [("ende", "goal.target = \"ende\": did you mean \"end\"?"), ("start", "where the centre line begins")]
    {
        let wrong = subject(&[("target = \"end\"", &format!("target = \"{target}\""))]).unwrap();
        let error = at_site(wrong).unwrap_err();
        assert!(error.starts_with(file) && error.contains(reported), "{error}");
    }
    assert!(
        Subject::is_meant(FILE)
            && !Subject::is_meant("[vessel]\nfile = \"a.stl\"")
            && !Subject::is_meant("scene")
    );
}

#[test]
fn a_scene_or_a_reference_that_is_not_there_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("end.toml");
    std::fs::write(&path, FILE).unwrap();
    let error = Subject::read(&path).unwrap_err().to_string();
    assert!(error.contains("end.toml: scene = \"scene.toml\": there is no such file"), "{error}");
    std::fs::write(folder.path().join("scene.toml"), "").unwrap();
    assert_eq!(Subject::read(&path).unwrap().stem(), "end");
    std::fs::write(&path, FILE.replace("scene = ", "reference = \"hand.toml\"\nscene = ")).unwrap();
    let error = Subject::read(&path).unwrap_err().to_string();
    assert!(error.contains("reference = \"hand.toml\""), "{error}");
}
