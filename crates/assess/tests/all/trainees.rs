//! Trainees that are made up: one follows the way cleanly, others have a fault each. Every measure tells those apart that it should, and no
//! others.

use endowire_assess::{BeamState, Hand, Injection, Metric, Record, Sample, Way, assess, auc};
use endowire_core::Vec3;
use endowire_core::random::{splitmix64, unit};
use endowire_core::vessel::{CentrelinePath, CentrelineTree, anatomy};

/// Trainees of each kind.
const EACH: u64 = 24;
const TICK_S: f64 = 0.1;

/// What somebody does wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// Hands that tremble.
    Tremor,
    /// Rests while the beam is off.
    Delay,
    /// Pushes harder than there is way.
    Pushing,
    /// Pushes now and then much faster, and rests after it.
    Haste,
    /// The pedal stays down.
    Beam,
    /// Injects again and again.
    Contrast,
    /// Goes into another branch first.
    WrongTurn,
}

/// Numbers from 0 to 1 of one trainee.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = splitmix64(self.0, 0);
        unit(self.0)
    }
}

fn path(tree: &CentrelineTree, name: &str) -> CentrelinePath {
    tree.path_to(tree.target(name).unwrap().row).unwrap()
}

/// The arc lengths that a hand goes to, tick by tick, at about 15 mm/s, from one place to another.
fn course(from_mm: f64, to_mm: f64, dice: &mut Dice) -> Vec<f64> {
    let (mut at, mut all) = (from_mm, vec![]);
    let towards = (to_mm - from_mm).signum();
    while (to_mm - at) * towards > 1e-9 {
        let step = (1.2 + 0.6 * dice.roll()).min((to_mm - at).abs());
        at += towards * step;
        all.push(at);
    }
    all
}

/// The same course in the same time, but the way of the last eight of 32 ticks is gone in the first of them.
fn hasty(arcs: &[f64]) -> Vec<f64> {
    let at = |k: usize| if k % 32 < 24 { k } else { (k / 32 * 32 + 31).min(arcs.len() - 1) };
    (0..arcs.len()).map(|k| arcs[at(k)]).collect()
}

fn trainee(tree: &CentrelineTree, fault: Fault, seed: u64) -> Record {
    let (right, wrong) = (path(tree, "left carotid"), path(tree, "innominate"));
    let mut dice = Dice(splitmix64(seed, 7));
    let end_mm = right.length_mm() - 2.0 * dice.roll();
    // Ways, with the line that they are on: all go up the aorta.
    let mut ways: Vec<(&CentrelinePath, Vec<f64>)> = vec![];
    if fault == Fault::WrongTurn {
        let there = wrong.length_mm() - 10.0;
        let mut own = Dice(splitmix64(seed, 8));
        ways.push((&wrong, course(10.0, there, &mut own)));
        ways.push((&wrong, course(there, 60.0, &mut own)));
        ways.push((&right, course(60.0, end_mm, &mut dice)));
    } else {
        ways.push((&right, course(10.0, end_mm, &mut dice)));
    }
    let mut record = Record::default();
    let (mut ticks, mut before_mm) = (0, 10.0);
    let mut tremble = Dice(splitmix64(seed, 9));
    let mut push = |record: &mut Record, tip: Vec3, advance_mm: f64, more_n: f64| {
        ticks += 1;
        let force = 0.05 + 0.02 * dice.roll() + more_n;
        let hand = Hand { advance_mm, push_force_n: Some(force), ..Hand::default() };
        record.samples.push(Sample {
            time_s: f64::from(ticks) * TICK_S,
            tip_mm: Some(tip),
            hands: vec![hand],
            wall_force_n: force,
            tip_force_n: 0.0,
            ..Sample::default()
        });
    };
    for (line, arcs) in ways {
        let arcs = if fault == Fault::Haste { hasty(&arcs) } else { arcs };
        for (k, arc_mm) in arcs.into_iter().enumerate() {
            let shake = if fault == Fault::Tremor { 2.5 * (tremble.roll() - 0.5) } else { 0.0 };
            let more_n = if fault == Fault::Pushing && k % 10 < 4 { 0.4 + 0.2 * tremble.roll() } else { 0.0 };
            push(&mut record, line.at(arc_mm + shake), arc_mm + shake - before_mm, more_n);
            before_mm = arc_mm + shake;
            if fault == Fault::Delay && k % 50 == 49 {
                (0..30).for_each(|_| push(&mut record, line.at(arc_mm), 0.0, 0.0));
            }
        }
    }
    let end_s = record.samples.last().unwrap().time_s;
    let state = |time_s: f64, on: bool| BeamState {
        time_s,
        on,
        frames_per_s: 7.5,
        dose_ngy: 30.0,
        field_mm2: 40_000.0,
        primary_deg: 40.0,
        secondary_deg: 0.0,
        ..BeamState::default()
    };
    // The first eight seconds are seen, or all and the time after.
    let off_s = if fault == Fault::Beam { end_s } else { 8.0 + unit(splitmix64(seed, 3)) };
    record.beam = Some(vec![state(0.0, true), state(off_s, false)]);
    let boluses = if fault == Fault::Contrast { 4 } else { 1 };
    let bolus = |k: i32| Injection {
        time_s: 2.0 + f64::from(k),
        volume_ml: 6.0 + unit(splitmix64(seed, 4)),
        rate_ml_per_s: 6.0,
        outlet: None,
    };
    record.injections = (0..boluses).map(bolus).collect();
    record
}

/// A fault, and the measures that it makes larger, smaller and leaves alone.
type Expected = (Fault, &'static [&'static str], &'static [&'static str], &'static [&'static str]);

#[test]
fn every_measure_separates_the_trainees_that_it_should_and_no_others() {
    let tree = anatomy::tree("aortic_arch").unwrap();
    let way = Way::to_target(&tree, "left carotid", 5.0).unwrap().unwrap();
    let group = |fault: Fault| -> Vec<Vec<Metric>> {
        (0..EACH).map(|seed| assess(&trainee(&tree, fault, seed), Some(&way))).collect()
    };
    let values = |group: &[Vec<Metric>], name: &str| -> Vec<f64> {
        let of = |metrics: &Vec<Metric>| metrics.iter().find(|metric| metric.name == name).unwrap().value;
        group.iter().map(|metrics| of(metrics).unwrap()).collect()
    };
    let clean = group(Fault::None);
    assert!(values(&clean, "arrived").iter().all(|arrived| *arrived == 1.0));
    let expected: [Expected; 7] = [
        (
            Fault::Tremor,
            &["tip_path_mm", "path_ratio", "reversals", "retracted_mm"],
            &["spectral_arc_length"],
            &["total_s", "idle_s", "contrast_ml", "wall_force_n", "wrong_branches", "kerma_ugy"],
        ),
        (
            Fault::Delay,
            &["total_s", "idle_s", "submovements", "time_in_trunk_s"],
            &["submovement_s"],
            &["tip_path_mm", "reversals", "contrast_ml", "wall_force_n", "wrong_branches", "beam_on_s"],
        ),
        (
            Fault::Pushing,
            &["wall_force_n", "wall_force_95_n", "wall_impulse_ns", "hand_force_n"],
            &[],
            &["total_s", "idle_s", "tip_path_mm", "contrast_ml", "spectral_arc_length", "beam_on_s"],
        ),
        (
            Fault::Haste,
            &["push_speed_mm_per_s"],
            &[],
            &["total_s", "tip_path_mm", "contrast_ml", "wall_force_n", "beam_on_s", "reversals"],
        ),
        (
            Fault::Beam,
            &["beam_on_s", "kerma_ugy", "kerma_area_ugycm2", "frames"],
            &["moving_without_beam_s"],
            &["total_s", "tip_path_mm", "contrast_ml", "wall_force_n", "runs", "c_arm_moves"],
        ),
        (
            Fault::Contrast,
            &["contrast_ml", "injections"],
            &[],
            &["total_s", "tip_path_mm", "largest_rate_ml_per_s", "wall_force_n", "beam_on_s", "reversals"],
        ),
        (
            Fault::WrongTurn,
            &["wrong_branches", "tip_path_mm", "path_ratio", "total_s", "reversals", "retracted_mm"],
            &[],
            &["contrast_ml", "idle_s", "runs", "placement_error_mm"],
        ),
    ];
    for (fault, more, less, alike) in expected {
        let faulty = group(fault);
        let of = |name: &str| auc(&values(&clean, name), &values(&faulty, name));
        for name in more {
            assert!(of(name) >= 0.95, "{fault:?}: {name} {}", of(name));
        }
        for name in less {
            assert!(of(name) <= 0.05, "{fault:?}: {name} {}", of(name));
        }
        for name in alike {
            assert!((0.4..=0.6).contains(&of(name)), "{fault:?}: {name} {}", of(name));
        }
    }
}
