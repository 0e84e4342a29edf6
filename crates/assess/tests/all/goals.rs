//! Goals other than the foremost tip: the tip of a named instrument, and a sac that coils fill.

use std::path::Path;

use endowire_assess::{EndedBy, Exam, Goal, Hand, Packed, Record, Sample, Score, Site, Subject};
use endowire_core::Vec3;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, Target};

fn subject(goal: &str) -> Result<Subject, String> {
    let text = format!("name = \"a\"\nlevel = 3\ntext = \"b\"\nscene = \"c.toml\"\n\n[goal]\n{goal}\n");
    Subject::from_toml(&text, Path::new("subjects/goal.toml")).map_err(|error| error.to_string())
}

const CATHETER: &str = "target = \"end\"\ntip_within_mm = 5.0\ninstrument = \"catheter\"";

/// A straight line of 100 mm.
fn tree() -> CentrelineTree {
    let node =
        |x: f64, parent| CentrelineNode { position_mm: Vec3::new(x, 0.0, 0.0), radius_mm: 5.0, parent };
    let end = Target { name: "end".to_owned(), row: 1 };
    CentrelineTree::new(vec![node(0.0, None), node(100.0, Some(0))]).unwrap().with_targets(vec![end]).unwrap()
}

fn exam(goal: &str, has_sac: bool) -> Result<Exam, String> {
    let (tree, instruments) = (tree(), ["wire", "catheter"].map(str::to_owned));
    let site = Site { tree: Some(&tree), instruments: &instruments, has_sac, ..Site::default() };
    Exam::new(subject(goal)?, &site).map_err(|error| error.to_string())
}

/// The wire is there after 4 s, and the catheter follows it by 3 s.
fn record() -> Record {
    let sample = |second: usize| {
        let hand = |behind_s: f64| {
            let inserted_mm = (25.0 * (second as f64 - behind_s)).clamp(0.0, 98.0);
            let tip_mm = (inserted_mm > 0.0).then(|| Vec3::new(inserted_mm, 0.0, 0.0));
            Hand { advance_mm: 1.0, inserted_mm, tip_mm, ..Hand::default() }
        };
        let hands = vec![hand(0.0), hand(3.0)];
        Sample { time_s: second as f64, tip_mm: hands[0].tip_mm, hands, ..Sample::default() }
    };
    let instruments = ["wire", "catheter"].map(str::to_owned).to_vec();
    Record { instruments, samples: (1..=8).map(sample).collect(), ..Record::default() }
}

fn end(score: &Score) -> Option<(EndedBy, f64)> {
    score.verdict.ended.map(|ended| (ended.by, ended.time_s))
}

fn measured(score: &Score, name: &str) -> Option<f64> {
    score.metrics.iter().find(|one| one.metric.name == name).unwrap().metric.value
}

#[test]
fn the_tip_of_a_named_instrument_is_waited_for() {
    let foremost = exam("target = \"end\"\ntip_within_mm = 5.0", false).unwrap().score(&record());
    assert_eq!(end(&foremost), Some((EndedBy::Goal, 4.0)));
    let wire = exam(&CATHETER.replace("catheter", "wire"), false).unwrap().score(&record());
    assert_eq!(end(&wire), Some((EndedBy::Goal, 4.0)));
    let catheter = exam(CATHETER, false).unwrap();
    let score = catheter.clone().score(&record());
    assert_eq!(end(&score), Some((EndedBy::Goal, 7.0)));
    assert_eq!((measured(&score, "arrived"), measured(&score, "placement_error_mm")), (Some(1.0), Some(2.0)));
    // It stands where the catheter is, and says so.
    let mut early = record();
    early.samples.truncate(5);
    let mut followed = catheter.clone();
    assert!(followed.follow(&early).is_none());
    let standing = followed.standing(&early);
    assert_eq!(standing.distance_mm, Some(50.0));
    assert_eq!(standing.to_go, ["catheter to end: 50.0 mm, there at 5 mm"]);
    early.samples.truncate(2);
    assert_eq!(catheter.standing(&early).to_go, ["catheter to end: not in yet, there at 5 mm"]);
    assert_eq!(catheter.subject().goal.words(), "tip of catheter within 5 mm of end");
}

#[test]
fn in_a_vessel_that_moves_the_place_at_rest_counts() {
    let mut moved = record();
    let lateral = Vec3::new(0.0, 12.0, 0.0);
    for hand in moved.samples.iter_mut().flat_map(|sample| &mut sample.hands) {
        hand.tip_at_rest_mm = hand.tip_mm;
        hand.tip_mm = hand.tip_mm.map(|tip| tip + lateral);
    }
    let exam = exam(CATHETER, false).unwrap();
    assert_eq!(end(&exam.clone().score(&moved)), Some((EndedBy::Goal, 7.0)));
    moved.samples.iter_mut().flat_map(|sample| &mut sample.hands).for_each(|hand| hand.tip_at_rest_mm = None);
    assert_eq!(end(&exam.score(&moved)), None, "12 mm beside it");
}

#[test]
fn a_sac_is_packed_when_coils_fill_what_was_asked() {
    let packing = exam("packing_density = 0.1", true).unwrap();
    let mut packed = record();
    for (sample, density) in packed.samples.iter_mut().zip([0.0, 0.02, 0.05, 0.09, 0.099, 0.1, 0.2, 0.2]) {
        sample.packing = Some(Packed { density, outside_mm: 3.0 });
    }
    assert!(packing.check(&packed).is_ok());
    let score = packing.clone().score(&packed);
    assert_eq!(end(&score), Some((EndedBy::Goal, 6.0)));
    // Measured until then, not until what came later.
    assert_eq!(
        (measured(&score, "packing_density"), measured(&score, "coil_outside_mm")),
        (Some(0.1), Some(3.0))
    );
    assert_eq!(measured(&score, "arrived"), None);
    packed.samples.truncate(4);
    let standing = packing.standing(&packed);
    assert_eq!((standing.distance_mm, standing.packing_density), (None, Some(0.09)));
    assert_eq!(standing.to_go, ["packed: 9.0 of 10 %"]);
    assert_eq!(packing.subject().goal.words(), "10 % of the sac filled by coils");
}

#[test]
fn a_record_that_does_not_tell_is_refused() {
    let reported = |exam: &Exam, record: &Record| exam.check(record).unwrap_err().to_string();
    let catheter = exam(CATHETER, false).unwrap();
    assert!(catheter.check(&record()).is_ok());
    let mut old = record();
    old.samples.iter_mut().flat_map(|sample| &mut sample.hands).for_each(|hand| hand.tip_mm = None);
    let error = reported(&catheter, &old);
    assert!(error.contains("goal.toml: goal.instrument = \"catheter\": the record does not tell"), "{error}");
    // The foremost tip does not stand in for the one that is named.
    let mut alone = record();
    alone.instruments.clear();
    alone.samples.iter_mut().for_each(|sample| sample.hands.truncate(1));
    let error = reported(&catheter, &alone);
    assert!(error.contains("goal.instrument = \"catheter\": the record names no instruments"), "{error}");
    assert_eq!(end(&catheter.clone().score(&alone)), None);
    let mut other = record();
    other.instruments[1] = "sheath".to_owned();
    let error = reported(&catheter, &other);
    assert!(error.contains("goal.instrument = \"catheter\": the record is of wire, sheath"), "{error}");
    let error = reported(&exam("packing_density = 0.1", true).unwrap(), &record());
    assert!(error.contains("goal.packing_density = 0.1: the record does not tell"), "{error}");
    // What asks for the foremost tip is judged by any record.
    assert!(exam("target = \"end\"\ntip_within_mm = 5.0", false).unwrap().check(&old).is_ok());
}

#[test]
fn a_goal_that_does_not_fit_is_refused_by_key_and_value() {
    for (goal, reported) in [
        (
            CATHETER.replace("catheter", "cathter"),
            "goal.instrument = \"cathter\": is no instrument of the scene: name one of wire, catheter; did you mean \"catheter\"?",
        ),
        (
            "packing_density = 0.1".to_owned(),
            "goal.packing_density = 0.1: there is no sac that coils fill: give [vessel.sac]",
        ),
        (
            "packing_density = 1.5".to_owned(),
            "goal.packing_density = 1.5: must be a number above 0 and at most 1",
        ),
        ("tip_within_mm = 5.0".to_owned(), "target is missing: of which point must the tip be within 5 mm?"),
        ("target = \"end\"".to_owned(), "tip_within_mm is missing: how near must the tip come to \"end\"?"),
        (String::new(), "what is to be reached? give target with tip_within_mm, or packing_density"),
        (
            "packing_density = 0.1\ninject_ml = 2.0".to_owned(),
            "inject_ml does not go with packing_density = 0.1",
        ),
        ("packing_densty = 0.1".to_owned(), "did you mean `packing_density`?"),
    ] {
        let error = exam(&goal, false).unwrap_err();
        assert!(error.starts_with("subjects/goal.toml: ") && error.contains(reported), "{error}\n{reported}");
    }
    // Thresholds of measures that have no value there.
    for (goal, metric, has_sac, reported) in [
        (CATHETER, "packing_density", false, Some("there is no sac that coils fill")),
        (CATHETER, "coil_outside_mm", false, Some("there is no sac that coils fill")),
        (CATHETER, "packing_density", true, None),
        ("packing_density = 0.1", "wrong_branches", true, Some("to a sac that is packed no way is known")),
        ("packing_density = 0.1", "catheter_ahead_s", true, None),
    ] {
        let limit = if metric == "packing_density" { "at_least = 0.1" } else { "at_most = 1.0" };
        let made = exam(&format!("{goal}\n[[threshold]]\nmetric = \"{metric}\"\n{limit}"), has_sac);
        let error = made.err();
        assert_eq!(error.is_some(), reported.is_some(), "{metric}: {error:?}");
        let whole =
            format!("goal.toml: threshold[0].metric = \"{metric}\": {}", reported.unwrap_or_default());
        assert!(error.is_none_or(|error| error.contains(&whole)), "{whole}");
    }
    let alone = Exam::new(subject(CATHETER).unwrap(), &Site { tree: Some(&tree()), ..Site::default() });
    let error = alone.unwrap_err().to_string();
    assert!(error.contains("goal.instrument = \"catheter\": the record names no instruments"), "{error}");
    let serialised = serde_json::to_value(&subject("packing_density = 0.1").unwrap().goal).unwrap();
    assert_eq!(serialised, serde_json::json!({"packing_density": 0.1}));
    let Goal::Place(place) = subject(CATHETER).unwrap().goal else { panic!("a place") };
    assert_eq!((place.target.as_str(), place.instrument.as_deref()), ("end", Some("catheter")));
}
