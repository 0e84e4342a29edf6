//! What stands out of a record whose faults are known.

use crate::beam;

use beam::beam;
use endowire_assess::{Hand, Injection, NoticedKind, Outlet, Record, Sample, Way, noticed};
use endowire_core::Vec3;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, Target};

/// A trunk of 100 mm along x with branches of 50 mm towards +y and −y.
fn way() -> Way {
    let node =
        |x: f64, y: f64, parent| CentrelineNode { position_mm: Vec3::new(x, y, 0.0), radius_mm: 4.0, parent };
    let nodes = vec![
        node(0.0, 0.0, None),
        node(100.0, 0.0, Some(0)),
        node(100.0, 50.0, Some(1)),
        node(100.0, -50.0, Some(1)),
    ];
    let left = Target { name: "left".to_owned(), row: 2 };
    let tree = CentrelineTree::new(nodes).unwrap().with_targets(vec![left]).unwrap();
    Way::to_target(&tree, "left", 5.0).unwrap().unwrap()
}

/// Through the catheter, whose tip the wall holds with this force.
fn injection(time_s: f64, volume_ml: f64, tip_force_n: f64) -> Injection {
    let instrument = Some("catheter".to_owned());
    let outlet = Outlet { instrument, at_mm: Vec3::zeros(), tip_force_n: Some(tip_force_n) };
    Injection { time_s, volume_ml, rate_ml_per_s: 2.0, outlet: Some(outlet) }
}

/// One sample a second, at the ends of these stretches of the tip, with what the wire's hand pushed.
fn record() -> Record {
    let course: [([f64; 2], f64, f64); 10] = [
        ([50.0, 0.0], 50.0, 0.0),
        ([100.0, 0.0], 50.0, 0.0),
        ([100.0, -25.0], 25.0, 0.3),
        ([100.0, -25.0], 0.0, 0.1),
        ([100.0, -25.0], 0.0, 0.1),
        ([100.0, -25.0], 0.0, 0.1),
        ([100.0, -5.0], -20.0, 0.1),
        ([95.0, 0.0], -6.0, 0.0),
        ([100.0, 20.0], 25.0, 0.0),
        ([100.0, 48.0], 28.0, 0.2),
    ];
    let mut inserted_mm = 0.0;
    let samples = course.iter().enumerate().map(|(k, ([x, y], advance_mm, force_n))| {
        inserted_mm += advance_mm;
        let wire = Hand { advance_mm: *advance_mm, inserted_mm, ..Hand::default() };
        // The catheter leads in the last second.
        let catheter = Hand { inserted_mm: if k == 9 { inserted_mm + 3.0 } else { 0.0 }, ..Hand::default() };
        Sample {
            time_s: (k + 1) as f64,
            tip_mm: Some(Vec3::new(*x, *y, 0.0)),
            hands: vec![wire, catheter],
            wall_force_n: *force_n,
            tip_force_n: 0.1 * force_n,
            jumped: k == 8,
            ..Sample::default()
        }
    });
    Record {
        instruments: ["wire", "catheter"].map(str::to_owned).to_vec(),
        samples: samples.collect(),
        injections: vec![injection(0.5, 4.0, 0.0), injection(3.5, 6.0, 0.01)],
        beam: Some(vec![beam(0.0, true), beam(7.5, false)]),
        ..Record::default()
    }
}

#[test]
fn each_fault_is_noticed_once_with_its_time() {
    let reported = noticed(&record(), Some(&way()));
    let found: Vec<(NoticedKind, f64, f64)> =
        reported.iter().map(|one| (one.what, one.from_s, one.to_s)).collect();
    assert_eq!(
        found,
        [
            (NoticedKind::WrongBranch, 2.0, 6.0),
            (NoticedKind::WallForce, 3.0, 3.0),
            (NoticedKind::TipForce, 3.0, 3.0),
            (NoticedKind::IdleBeam, 3.0, 6.0),
            (NoticedKind::AgainstWall, 3.5, 3.5),
            (NoticedKind::PulledBack, 6.0, 8.0),
            (NoticedKind::Unseen, 7.5, 10.0),
            (NoticedKind::Jumped, 9.0, 9.0),
            (NoticedKind::CatheterAhead, 9.0, 10.0),
        ],
        "{reported:#?}"
    );
    assert_eq!(reported[5].text, "26 mm of wire pulled back in 2.0 s");
    assert_eq!(reported[4].text, "6 ml injected with the tip held by a wall");
}

#[test]
fn what_was_done_well_or_not_recorded_is_not_noticed() {
    let mut clean = record();
    clean.samples.truncate(2);
    clean.injections.truncate(1);
    assert_eq!(noticed(&clean, Some(&way())), []);
    assert_eq!(noticed(&Record::default(), None), []);
    // Without a beam and a way the rest is still reported.
    let reported = noticed(&Record { beam: None, ..record() }, None);
    assert!(reported.iter().all(|one| {
        !matches!(one.what, NoticedKind::WrongBranch | NoticedKind::IdleBeam | NoticedKind::Unseen)
    }));
    assert_eq!(reported.len(), 6);
}

#[test]
fn of_many_jumps_the_first_are_reported_and_the_rest_counted() {
    let mut record = record();
    record.samples.iter_mut().for_each(|sample| sample.jumped = true);
    let jumps: Vec<_> =
        noticed(&record, None).into_iter().filter(|one| one.what == NoticedKind::Jumped).collect();
    assert_eq!(jumps.len(), 3);
    assert!(jumps[2].text.ends_with("and 7 more times later"), "{}", jumps[2].text);
}
