//! Measures of what each hand does to its instrument.

use std::f64::consts::{PI, TAU};

use crate::record::{REST_MM, Record};
use crate::stretch::{Stretch, common, joined};
use crate::total::total;

/// Shortest time, s, over which the speed of a hand is a mean: a single tick of a wheel is no pace.
const PACE_S: f64 = 0.5;
/// An instrument that has gone on by this length, mm, is at another place, where a hook may have to be turned anew.
const PLACE_MM: f64 = 20.0;
/// Turning to look where the hook points, rad: a quarter of a turn to one side and back.
const LOOK_RAD: f64 = PI;

/// Times, s, at which the motion of an instrument changed between pushing and pulling.
fn reversals_of(record: &Record, hand: usize) -> Vec<f64> {
    let mut pushed: Option<bool> = None;
    let mut all = Vec::new();
    for (took_s, sample) in record.timed() {
        let Some(mm) = sample.hands.get(hand).map(|hand| hand.advance_mm).filter(|mm| mm.abs() > REST_MM)
        else {
            continue;
        };
        if pushed.is_some_and(|before| before != (mm > 0.0)) {
            all.push(sample.time_s - took_s);
        }
        pushed = Some(mm > 0.0);
    }
    all
}

/// The same for all instruments, in order of time.
pub(crate) fn reversals(record: &Record) -> Vec<f64> {
    let mut all: Vec<f64> = (0..record.hand_count()).flat_map(|hand| reversals_of(record, hand)).collect();
    all.sort_by(f64::total_cmp);
    all
}

/// Turning of an instrument at one place.
#[derive(Clone, Copy, Default)]
struct Turned {
    /// Advance since it came there.
    gone_mm: f64,
    net_rad: f64,
    sum_rad: f64,
}

impl Turned {
    /// What was turned beyond the shortest way to the same direction, and beyond a look around.
    fn needless_rad(self) -> f64 {
        let direction = self.net_rad.abs() % TAU;
        (self.sum_rad - direction.min(TAU - direction) - LOOK_RAD).max(0.0)
    }
}

/// Turns of all hands that brought no other direction: at each place of an instrument, what it was turned beyond the
/// shortest way to the direction in which it left that place, and beyond a look around.
pub(crate) fn needless_turns(record: &Record) -> f64 {
    let mut all_rad = 0.0;
    for hand in 0..record.hand_count() {
        let mut here = Turned::default();
        for one in record.samples.iter().filter_map(|sample| sample.hands.get(hand)) {
            here.gone_mm += one.advance_mm;
            here.net_rad += one.rotate_rad;
            here.sum_rad += one.rotate_rad.abs();
            if here.gone_mm.abs() >= PLACE_MM {
                all_rad += std::mem::take(&mut here).needless_rad();
            }
        }
        all_rad += here.needless_rad();
    }
    all_rad / TAU
}

/// Fastest push of an instrument, mm/s: the largest of its mean speeds over [`PACE_S`], in which steps are even.
fn push_speed_of(record: &Record, hand: usize) -> f64 {
    // Begin, end and advance of each step.
    let steps: Vec<(f64, f64, f64)> = record
        .timed()
        .map(|(took_s, sample)| {
            let advance_mm = sample.hands.get(hand).map_or(0.0, |hand| hand.advance_mm);
            (sample.time_s - took_s, sample.time_s, advance_mm.max(0.0))
        })
        .collect();
    let (mut first, mut fastest) = (0, 0.0_f64);
    for (index, (_, end_s, _)) in steps.iter().enumerate() {
        let since_s = end_s - PACE_S;
        while steps[first].1 <= since_s {
            first += 1;
        }
        let within = steps[first..=index].iter().map(|(from_s, to_s, mm)| {
            let share = if to_s > from_s { (to_s - from_s.max(since_s)) / (to_s - from_s) } else { 1.0 };
            mm * share
        });
        fastest = fastest.max(total(within) / PACE_S);
    }
    fastest
}

/// Fastest push of all hands, mm/s; `None` if nothing was recorded.
pub(crate) fn push_speed_mm_per_s(record: &Record) -> Option<f64> {
    (0..record.hand_count()).map(|hand| push_speed_of(record, hand)).reduce(f64::max)
}

/// Stretches of time in which a hand moves; those at most `gap_s` apart count as one.
pub(crate) fn moving(record: &Record, gap_s: f64) -> Vec<Stretch> {
    let moves = record.timed().filter(|(_, sample)| !sample.rests());
    joined(moves.map(|(took_s, sample)| (sample.time_s - took_s, sample.time_s)), gap_s)
}

/// Time with a hand moving while pictures are acquired to be stored, s: fluoroscopy shows as much of it, at a tenth of the
/// dose. `None` if it was not recorded what the beam was used for.
pub(crate) fn moving_in_acquisition_s(record: &Record) -> Option<f64> {
    let mut acquired = Vec::new();
    for (state, end_s) in record.beam_stretches()?.filter(|(state, _)| state.on) {
        if state.mode?.acquires() {
            acquired.push((state.time_s, end_s));
        }
    }
    Some(total(
        common(&moving(record, 0.0), &joined(acquired, 0.0)).iter().map(|(from_s, to_s)| to_s - from_s),
    ))
}

/// Share of the time in which a hand moves and nobody can see what it does: the beam is off, or the tip that moves is
/// not in the picture. `None` if the beam was not recorded, or no hand moved.
pub(crate) fn unseen_share(record: &Record) -> Option<f64> {
    let (mut moving_s, mut seen_s) = (0.0, 0.0);
    for (took_s, sample) in record.timed().filter(|(_, sample)| !sample.rests()) {
        let on_s = record.beam_on_s(sample.time_s - took_s, sample.time_s)?;
        moving_s += took_s;
        seen_s += if sample.out_of_picture { 0.0 } else { on_s.min(took_s) };
    }
    record.beam.as_ref().filter(|_| moving_s > 0.0)?;
    Some((1.0 - seen_s / moving_s).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{BeamMode, BeamState, Hand, Sample};

    /// Samples of a tenth of a second with these advances, mm, and rotations, turns.
    fn record(moves: impl IntoIterator<Item = [f64; 2]>) -> Record {
        let sample = |(k, [advance_mm, turns]): (usize, [f64; 2])| Sample {
            time_s: (k + 1) as f64 * 0.1,
            hands: vec![Hand { advance_mm, rotate_rad: turns * TAU, ..Hand::default() }],
            ..Sample::default()
        };
        Record { samples: moves.into_iter().enumerate().map(sample).collect(), ..Record::default() }
    }

    #[test]
    fn a_hook_is_turned_once_for_each_place_and_the_rest_is_needless() {
        let turned = |moves: Vec<[f64; 2]>| needless_turns(&record(moves));
        let push = [1.0, 0.0];
        // To a direction the long way round, and back and forth once to see it.
        assert!(turned(vec![[0.0, 0.1]; 6]) < 1e-9);
        assert!(turned([vec![[0.0, 0.05]; 5], vec![[0.0, -0.05]; 5]].concat()) < 1e-9);
        // At two places as often; ten times round at one; drilling on the way.
        let twice = [vec![[0.0, 0.1]; 5], vec![push; 40], vec![[0.0, 0.1]; 5]].concat();
        assert!(turned(twice) < 1e-9);
        assert!((turned(vec![[0.0, 0.1]; 100]) - 9.5).abs() < 1e-9);
        let drilled = turned(vec![[1.0, 0.1]; 300]);
        assert!((drilled - 15.0 * 1.5).abs() < 1e-6, "{drilled}");
    }

    #[test]
    fn what_cannot_be_seen_is_shared_out_over_the_time_of_motion() {
        let mut moved = record([[1.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]);
        assert_eq!(unseen_share(&moved), None, "no beam was recorded");
        let on = |time_s: f64, on: bool| BeamState { time_s, on, ..BeamState::default() };
        moved.beam = Some(vec![on(0.0, true), on(0.2, false), on(0.35, true)]);
        assert!((unseen_share(&moved).unwrap() - 0.05 / 0.4).abs() < 1e-9);
        moved.samples[0].out_of_picture = true;
        assert!((unseen_share(&moved).unwrap() - 0.15 / 0.4).abs() < 1e-9);
        moved.beam = Some(vec![]);
        assert_eq!(unseen_share(&moved), Some(1.0), "never on");
    }

    #[test]
    fn a_burst_after_a_rest_is_as_fast_as_one_without() {
        let burst = |rest: bool| {
            let mut moved = record([[8.0, 0.0]; 3]);
            if rest {
                moved.samples.iter_mut().for_each(|sample| sample.time_s += 2.0);
                moved
                    .samples
                    .insert(0, Sample { time_s: 2.0, hands: vec![Hand::default()], ..Sample::default() });
            }
            push_speed_mm_per_s(&moved).unwrap()
        };
        // 24 mm in less than half a second.
        assert!((burst(false) - 48.0).abs() < 1e-9 && (burst(true) - 48.0).abs() < 1e-9);
        assert!((push_speed_mm_per_s(&record([[1.0, 0.0]; 30])).unwrap() - 10.0).abs() < 1e-9);
        assert_eq!(push_speed_mm_per_s(&Record::default()), None);
    }

    #[test]
    fn hands_that_move_in_cine_are_timed() {
        let mut moved = record([[1.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]);
        let on = |time_s: f64, mode: Option<BeamMode>| BeamState {
            time_s,
            on: true,
            mode,
            ..BeamState::default()
        };
        moved.beam = Some(vec![on(0.0, Some(BeamMode::Fluoro)), on(0.1, Some(BeamMode::Cine))]);
        assert!((moving_in_acquisition_s(&moved).unwrap() - 0.2).abs() < 1e-9);
        moved.beam = Some(vec![on(0.0, None)]);
        assert_eq!(moving_in_acquisition_s(&moved), None);
    }

    #[test]
    fn reversals_have_times_and_pauses_between_do_not_hide_them() {
        let moved = record([[1.0, 0.0], [-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]);
        let times = reversals(&moved);
        assert_eq!(times.len(), 2);
        assert!((times[0] - 0.1).abs() < 1e-9 && (times[1] - 0.3).abs() < 1e-9, "{times:?}");
        assert_eq!(moving(&moved, 0.0).len(), 2);
        assert_eq!(moving(&moved, 0.2).len(), 1);
    }
}
