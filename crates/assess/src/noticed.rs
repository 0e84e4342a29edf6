//! Remarkable moments and stretches of a procedure, which a teacher would point out.

use serde::Serialize;

use crate::record::{AGAINST_WALL_N, Record, Sample};
use crate::stretch::{Stretch, common, joined, longest};
use crate::way::Way;

/// Largest number of events of one kind: the longest, or the first ones.
const MOST: usize = 3;
/// Shortest duration, s, that is reported: of rests with the beam on; and of motions without it, or with an
/// instrument ahead of the one inside it.
const IDLE_S: f64 = 2.0;
const UNSEEN_S: f64 = 0.5;
/// Motions at most this far apart count as one, s: a hand pauses between two pushes.
const APART_S: f64 = 0.5;
/// Shortest pull-back that is reported, mm.
const PULLED_MM: f64 = 10.0;

/// Kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoticedKind {
    /// The largest sum of wall forces.
    WallForce,
    /// The largest wall force at the tip.
    TipForce,
    /// The device snapped to another equilibrium.
    Jumped,
    /// The tip was in a branch off the way.
    WrongBranch,
    /// An outer instrument was inserted farther than the one inside it.
    CatheterAhead,
    /// The beam was on while no instrument moved.
    IdleBeam,
    /// An instrument moved while the beam was off.
    Unseen,
    /// Medium was injected with the tip pressed against a wall.
    AgainstWall,
    /// An instrument was pulled back.
    PulledBack,
}

/// A remarkable moment or stretch of time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Noticed {
    /// Its kind.
    pub what: NoticedKind,
    /// Begin, s.
    pub from_s: f64,
    /// End, s; the same as the begin for a moment.
    pub to_s: f64,
    /// Description for people.
    pub text: String,
}

impl Noticed {
    fn at(what: NoticedKind, time_s: f64, text: String) -> Self {
        Self { what, from_s: time_s, to_s: time_s, text }
    }

    fn during(what: NoticedKind, (from_s, to_s): Stretch, reported: &str) -> Self {
        Self { what, from_s, to_s, text: format!("{reported} for {:.1} s", to_s - from_s) }
    }
}

/// Remarkable events of a procedure in order of time; `way` is the way to the target, if known.
pub fn noticed(record: &Record, way: Option<&Way>) -> Vec<Noticed> {
    let mut all: Vec<Noticed> = largest(record).collect();
    all.extend(jumps(record));
    all.extend(way.into_iter().flat_map(|way| wrong_branches(record, way)));
    all.extend(ahead(record));
    all.extend(beam(record));
    all.extend(against_wall(record));
    all.extend(pulls(record));
    all.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    all
}

/// The largest forces, if they exceed the threshold of contact.
fn largest(record: &Record) -> impl Iterator<Item = Noticed> {
    let most = |of: fn(&Sample) -> f64| {
        // The first of several equal ones.
        record
            .samples
            .iter()
            .reduce(|a, b| if of(b) > of(a) { b } else { a })
            .map(|one| (one.time_s, of(one)))
    };
    let reported = [
        (NoticedKind::WallForce, "the largest sum of wall forces", most(|sample| sample.wall_force_n)),
        (NoticedKind::TipForce, "the largest wall force at the tip", most(|sample| sample.tip_force_n)),
    ];
    reported.into_iter().filter_map(|(what, reported, most)| {
        let (time_s, force_n) = most.filter(|(_, force_n)| *force_n > AGAINST_WALL_N)?;
        Some(Noticed::at(what, time_s, format!("{reported}: {force_n:.3} N")))
    })
}

/// The first jumps, with the number of further ones.
fn jumps(record: &Record) -> Vec<Noticed> {
    let at: Vec<f64> = record.samples.iter().filter(|one| one.jumped).map(|one| one.time_s).collect();
    let more = |number: usize| match at.len().saturating_sub(MOST) {
        rest if rest > 0 && number + 1 == MOST => format!(", and {rest} more times later"),
        _ => String::new(),
    };
    let reported = at.iter().take(MOST).enumerate();
    reported
        .map(|(number, time_s)| {
            let text = format!("the device snapped to another equilibrium{}", more(number));
            Noticed::at(NoticedKind::Jumped, *time_s, text)
        })
        .collect()
}

/// The stretches of the samples that satisfy a condition.
fn while_samples<'a>(
    record: &'a Record,
    is: impl Fn(&Sample) -> bool + 'a,
) -> impl Iterator<Item = Stretch> + 'a {
    let such = record.timed().filter(move |(_, sample)| is(sample));
    such.map(|(took_s, sample)| (sample.time_s - took_s, sample.time_s))
}

fn wrong_branches(record: &Record, way: &Way) -> Vec<Noticed> {
    let wrong =
        |sample: &Sample| sample.on_centreline_mm().is_some_and(|tip| way.wrong_branch(&tip).is_some());
    let stretches = longest(joined(while_samples(record, wrong), 0.0), 0.0, MOST);
    let reported = |stretch| Noticed::during(NoticedKind::WrongBranch, stretch, "in a wrong branch");
    stretches.into_iter().map(reported).collect()
}

fn ahead(record: &Record) -> Vec<Noticed> {
    let stretches = longest(joined(while_samples(record, Sample::is_ahead), 0.0), UNSEEN_S, MOST);
    let reported = |stretch| {
        Noticed::during(NoticedKind::CatheterAhead, stretch, "an instrument ahead of the one in it")
    };
    stretches.into_iter().map(reported).collect()
}

/// Stretches of beam without motion, and of motion without beam; none if the beam was not recorded.
fn beam(record: &Record) -> Vec<Noticed> {
    let Some(stretches) = record.beam_stretches() else { return vec![] };
    let all: Vec<_> = stretches.map(|(state, end_s)| (state.on, (state.time_s, end_s))).collect();
    let of = |on: bool| joined(all.iter().filter(|one| one.0 == on).map(|one| one.1), 0.0);
    // The beam is off before its first recorded state.
    let dark = all.first().map_or(record.end_s(), |first| first.1.0);
    let off = joined([(0.0, dark)].into_iter().chain(of(false)), 0.0);
    let moves = joined(while_samples(record, |sample| !sample.rests()), APART_S);
    let rests = joined(while_samples(record, Sample::rests), 0.0);
    let reported = |what, reported: &'static str, stretches: Vec<Stretch>| {
        stretches.into_iter().map(move |stretch| Noticed::during(what, stretch, reported))
    };
    let idle = longest(common(&rests, &of(true)), IDLE_S, MOST);
    let unseen = longest(common(&moves, &off), UNSEEN_S, MOST);
    reported(NoticedKind::IdleBeam, "the beam on and no hand moving", idle)
        .chain(reported(NoticedKind::Unseen, "a hand moving and the beam off", unseen))
        .collect()
}

fn against_wall(record: &Record) -> Vec<Noticed> {
    let held = record.injections.iter().filter(|one| record.is_against_wall(one) == Some(true)).take(MOST);
    let reported = held.map(|one| {
        let text = format!("{} ml injected with the tip held by a wall", one.volume_ml);
        Noticed::at(NoticedKind::AgainstWall, one.time_s, text)
    });
    reported.collect()
}

/// The longest pull-backs without a push in between.
fn pulls(record: &Record) -> Vec<Noticed> {
    let most = record.hand_count();
    let mut all: Vec<(f64, Stretch, usize)> = Vec::new();
    for hand in 0..most {
        let mut now: Option<(f64, Stretch, usize)> = None;
        for (took_s, sample) in record.timed() {
            let advance_mm = sample.hands.get(hand).map_or(0.0, |hand| hand.advance_mm);
            if advance_mm < 0.0 {
                let (mm, stretch, _) =
                    now.get_or_insert((0.0, (sample.time_s - took_s, sample.time_s), hand));
                *mm -= advance_mm;
                stretch.1 = sample.time_s;
            } else if advance_mm > 0.0 {
                all.extend(now.take());
            }
        }
        all.extend(now);
    }
    all.retain(|(mm, ..)| *mm >= PULLED_MM);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.truncate(MOST);
    let reported = |(mm, (from_s, to_s), hand): (f64, Stretch, usize)| {
        let of = record.instruments.get(hand).map_or_else(String::new, |name| format!(" of {name}"));
        let text = format!("{mm:.0} mm{of} pulled back in {:.1} s", to_s - from_s);
        Noticed { what: NoticedKind::PulledBack, from_s, to_s, text }
    };
    all.into_iter().map(reported).collect()
}
