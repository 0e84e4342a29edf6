//! What counts in every subject, whatever its file says: the beam, hands that know what they want, and their speed. A
//! subject may ask for more by a threshold of its own; only the beam cannot be asked for less.

use crate::subject::Threshold;

/// The measure of what hands do unseen: who misses its threshold works blind.
pub(crate) const BLIND: &str = "unseen_share";
/// Its largest value: a hand may move before the pedal is down, and for a moment after it is up.
pub(crate) const MOST_UNSEEN: f64 = 0.1;
/// The same in an exam: a tenth of a second in five.
const MOST_UNSEEN_IN_EXAM: f64 = 0.02;

/// Radius, mm, below which an instrument is made for small arteries and sacs: microwires and coils. A wire of 0.035 inches
/// has 0.44 mm.
const SMALL_MM: f64 = 0.35;
/// Fastest push of such an instrument, and of the others, mm/s.
const MOST_SMALL_MM_PER_S: f64 = 20.0;
const MOST_MM_PER_S: f64 = 35.0;
/// Speed up to which the whole credit is given, in parts of the largest.
const CALM: f64 = 0.75;

const OF_BEAM: &str =
    "rule: instruments are moved under fluoroscopy (SIR and ESC curricula); a tenth allows for the foot";
const OF_COHORT: &str =
    "simulated cohort: the reference hands stay far below it, each kind that wastes it is above";
const OF_SPEED: &str = "a choice: 0.4 s go by until an eye and a hand have reacted to a picture; the tip then goes less than twice the width of the vessels for which the device is made";

/// A threshold of a measure of which less is better.
fn most(metric: &str, [good, at_most]: [f64; 2], points: f64, source: &str) -> Threshold {
    Threshold {
        metric: metric.to_owned(),
        at_most: Some(at_most),
        at_least: None,
        good: Some(good),
        points,
        grave: false,
        source: Some(source.to_owned()),
    }
}

/// The thresholds of every subject. `radius_mm` is that of the thinnest instrument, if it is known.
pub(crate) fn common(radius_mm: Option<f64>, exam: bool) -> Vec<Threshold> {
    let unseen = if exam { MOST_UNSEEN_IN_EXAM } else { MOST_UNSEEN };
    let small = radius_mm.is_some_and(|radius| radius < SMALL_MM);
    let fastest = if small { MOST_SMALL_MM_PER_S } else { MOST_MM_PER_S };
    vec![
        Threshold { grave: true, ..most(BLIND, [0.25 * unseen, unseen], 2.0, OF_BEAM) },
        Threshold { grave: true, ..most("push_speed_mm_per_s", [CALM * fastest, fastest], 1.0, OF_SPEED) },
        most("reversals", [4.0, 12.0], 1.0, OF_COHORT),
        most("needless_turns", [0.5, 1.0], 1.0, OF_COHORT),
        most("beam_on_idle_s", [5.0, 25.0], 1.0, OF_COHORT),
        most("moving_in_acquisition_s", [0.25, 1.0], 1.0, OF_COHORT),
    ]
}
