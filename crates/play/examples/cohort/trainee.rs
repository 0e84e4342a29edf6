//! Kinds of trainees. All know the way, and differ in how they go it: a score must tell them apart.

use std::sync::Arc;

use endowire_assess::Score;
use endowire_play::{Input, Session, TICKS_PER_S};
use endowire_viewer::Mode;

use super::plan::{Act, Place};

/// What a teacher says of a kind, from the best.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Class {
    Good,
    Slow,
    Wasteful,
    Reckless,
    Blind,
}

impl Class {
    /// All classes, the best first.
    pub(crate) const ALL: [Self; 5] = [Self::Good, Self::Slow, Self::Wasteful, Self::Reckless, Self::Blind];

    /// Whether a teacher lets them pass.
    pub(crate) fn passes(self) -> bool {
        matches!(self, Self::Good | Self::Slow)
    }
}

/// When the pedal is down.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Beam {
    Throughout(Mode),
    /// While hands move.
    WithMotion,
    /// For a part of a second every so many seconds.
    Taps(f64, f64),
    Never,
}

/// A kind of trainee.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) class: Class,
    mm_per_s: f64,
    deg_per_s: f64,
    beam: Beam,
    /// Changes the plan.
    habit: fn(Vec<Act>) -> Vec<Act>,
}

const FLUORO: Beam = Beam::Throughout(Mode::Fluoro);

/// All kinds.
pub(crate) const KINDS: [Kind; 17] = [
    kind("good", Class::Good, [10.0, 90.0], Beam::WithMotion, same),
    kind("brisk", Class::Good, [15.0, 120.0], Beam::WithMotion, same),
    kind("good, pedal down", Class::Good, [10.0, 90.0], FLUORO, same),
    kind("slow", Class::Slow, [3.0, 45.0], Beam::WithMotion, same),
    kind("slow, pedal down", Class::Slow, [3.0, 45.0], FLUORO, same),
    kind("slow with pauses", Class::Slow, [4.0, 45.0], Beam::WithMotion, pauses),
    kind("cine", Class::Wasteful, [10.0, 90.0], Beam::Throughout(Mode::Cine), same),
    kind("idle beam", Class::Wasteful, [10.0, 90.0], FLUORO, long_rests),
    kind("twirl", Class::Wasteful, [10.0, 360.0], FLUORO, twirl),
    kind("drill", Class::Wasteful, [10.0, 360.0], FLUORO, drill),
    kind("jab", Class::Wasteful, [15.0, 90.0], FLUORO, jab),
    kind("reverse", Class::Wasteful, [10.0, 90.0], FLUORO, reverse),
    kind("reckless", Class::Reckless, [48.0, 360.0], FLUORO, same),
    kind("bursts", Class::Reckless, [80.0, 360.0], FLUORO, pauses),
    kind("blind", Class::Blind, [10.0, 90.0], Beam::Never, same),
    kind("blind and fast", Class::Blind, [48.0, 360.0], Beam::Never, same),
    kind("taps", Class::Blind, [10.0, 90.0], Beam::Taps(0.2, 2.0), same),
];

const fn kind(
    name: &'static str,
    class: Class,
    [mm_per_s, deg_per_s]: [f64; 2],
    beam: Beam,
    habit: fn(Vec<Act>) -> Vec<Act>,
) -> Kind {
    Kind { name, class, mm_per_s, deg_per_s, beam, habit }
}

fn same(plan: Vec<Act>) -> Vec<Act> {
    plan
}

/// Looks before each motion, with the pedal up.
fn pauses(plan: Vec<Act>) -> Vec<Act> {
    plan.into_iter().flat_map(|act| [Act::Rest(2.0), act]).collect()
}

/// Rests four times for a quarter of a minute.
fn long_rests(plan: Vec<Act>) -> Vec<Act> {
    let mut all = vec![Act::Rest(15.0), Act::Rest(15.0)];
    all.extend(plan.into_iter().enumerate().flat_map(|(number, act)| {
        let rest = if number == 0 { vec![Act::Rest(15.0), Act::Rest(15.0)] } else { vec![] };
        rest.into_iter().chain([act])
    }));
    all
}

/// Turns the first instrument ten times before the first motion.
fn twirl(plan: Vec<Act>) -> Vec<Act> {
    let first = plan.iter().find_map(|act| match act {
        Act::Move(moves) => Some(moves[0].0),
        _ => None,
    });
    first.map(|instrument| Act::Move(vec![(instrument, 0.0, 3600.0)])).into_iter().chain(plan).collect()
}

/// Turns once round after each 10 mm of a push.
fn drill(plan: Vec<Act>) -> Vec<Act> {
    cut(plan, 10.0, |piece| {
        let turn = piece.iter().map(|(instrument, ..)| (*instrument, 0.0, 360.0)).collect();
        vec![Act::Move(piece), Act::Move(turn)]
    })
}

/// Pushes as far again as it then pulls back, each 3 mm.
fn jab(plan: Vec<Act>) -> Vec<Act> {
    cut(plan, 3.0, |piece| back_and_forth(&piece, 0.7))
}

/// The same each 8 mm, by the half.
fn reverse(plan: Vec<Act>) -> Vec<Act> {
    cut(plan, 8.0, |piece| back_and_forth(&piece, 0.5))
}

fn back_and_forth(piece: &[(usize, f64, f64)], part: f64) -> Vec<Act> {
    let of = |by: f64| {
        Act::Move(
            piece
                .iter()
                .map(|(instrument, mm, deg)| (*instrument, mm * by, deg * by.abs() / (1.0 + 2.0 * part)))
                .collect(),
        )
    };
    vec![of(1.0 + part), of(-part)]
}

/// Cuts pushes into pieces of this length and changes each.
fn cut(plan: Vec<Act>, each_mm: f64, change: impl Fn(Vec<(usize, f64, f64)>) -> Vec<Act>) -> Vec<Act> {
    let mut all = vec![];
    for act in plan {
        match act {
            Act::Move(moves) if moves.iter().any(|one| one.1 > each_mm) => {
                let most_mm = moves.iter().map(|one| one.1).fold(0.0, f64::max);
                let pieces = (most_mm / each_mm).ceil();
                let piece: Vec<_> =
                    moves.iter().map(|(i, mm, deg)| (*i, mm / pieces, deg / pieces)).collect();
                (0..pieces as usize).for_each(|_| all.extend(change(piece.clone())));
            }
            other => all.push(other),
        }
    }
    all
}

/// A session under the hands of one kind.
struct Hands<'a> {
    session: Session,
    names: Vec<String>,
    kind: &'a Kind,
}

impl Kind {
    /// The score of this kind in a subject, by a plan that leads to its goal.
    pub(crate) fn score(&self, place: &Place, plan: &[Act]) -> Arc<Score> {
        let mut hands = Hands { session: place.begun(), names: place.instruments(), kind: self };
        if let Beam::Throughout(mode) = self.beam {
            hands.pedal(true, mode);
        }
        let plan = (self.habit)(plan.to_vec());
        plan.iter().for_each(|act| hands.carry_out(act));
        // Who is not quite there goes on pushing what was pushed last.
        let last = plan.iter().rev().find_map(|act| match act {
            Act::Move(moves) => moves.iter().find(|one| one.1 > 0.0).map(|one| one.0),
            _ => None,
        });
        for _ in 0..15 {
            let injects = plan.iter().any(|act| matches!(act, Act::Inject(..)));
            if let Some(instrument) = last.filter(|_| !injects) {
                hands.carry_out(&Act::Move(vec![(instrument, 1.0, 0.0)]));
            }
        }
        hands.session.score().unwrap()
    }
}

impl Hands<'_> {
    fn has_ended(&self) -> bool {
        self.session.standing().is_some_and(|standing| standing.verdict.is_some())
    }

    fn pedal(&mut self, down: bool, mode: Mode) {
        self.session.apply(&Input::Pedal { down, mode: Some(mode) }).unwrap();
    }

    fn ticks(&mut self, seconds: f64, moves: bool) {
        for _ in 0..(seconds * TICKS_PER_S).round() as usize {
            if self.has_ended() {
                return;
            }
            if let (Beam::Taps(on_s, every_s), true) = (self.kind.beam, moves) {
                let down = self.session.time_s() % every_s < on_s;
                self.pedal(down, Mode::Fluoro);
            }
            self.session.tick();
        }
    }

    fn carry_out(&mut self, act: &Act) {
        if self.has_ended() {
            return;
        }
        match act {
            Act::Rest(seconds) => self.ticks(*seconds, false),
            Act::Inject(ml, ml_per_s) => {
                if self.kind.beam == Beam::WithMotion {
                    self.pedal(true, Mode::Fluoro);
                }
                // Refused where no instrument is in yet, which is then seen by its score.
                let _ = self.session.apply(&Input::Inject { ml: *ml, ml_per_s: *ml_per_s });
                self.ticks(ml / ml_per_s + 0.5, false);
                if self.kind.beam == Beam::WithMotion {
                    self.pedal(false, Mode::Fluoro);
                }
            }
            Act::Move(moves) => self.go(moves),
        }
    }

    fn go(&mut self, moves: &[(usize, f64, f64)]) {
        let takes = moves
            .iter()
            .map(|(_, mm, deg)| (mm.abs() / self.kind.mm_per_s).max(deg.abs() / self.kind.deg_per_s));
        let ticks = (takes.fold(0.0, f64::max) * TICKS_PER_S).round().max(1.0);
        if self.kind.beam == Beam::WithMotion {
            self.pedal(true, Mode::Fluoro);
        }
        for (instrument, mm, deg) in moves {
            let [mm_per_s, deg_per_s] = [mm, deg].map(|by| by * TICKS_PER_S / ticks);
            let instrument = Some(self.names[*instrument].clone());
            self.session.apply(&Input::Move { instrument, mm_per_s, deg_per_s }).unwrap();
        }
        self.ticks(ticks / TICKS_PER_S, true);
        self.session.apply(&Input::Stop {}).unwrap();
        if self.kind.beam == Beam::WithMotion {
            self.pedal(false, Mode::Fluoro);
        }
    }
}
