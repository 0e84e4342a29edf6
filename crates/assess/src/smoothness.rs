//! Smoothness of the tip's motion, from its speed at regular times.

use endowire_core::Vec3;

use crate::spectrum::amplitudes;
use crate::stretch::Stretch;

/// Sampling interval, s: hands do not move at more than 10 Hz.
const STEP_S: f64 = 0.05;
/// Spectral arc length: zero padding lengthens the signal by two to the power of `PADDING`; the spectrum ends at the
/// last amplitude of at least this fraction of the largest.
const PADDING: u32 = 4;
const LEAST_AMPLITUDE: f64 = 0.05;
/// Largest number of sampling times: one day.
const MOST: usize = 1_728_000;
/// A submovement is faster than this, mm/s, for at least this long, s.
const MOVING_MM_PER_S: f64 = 2.0;
const SHORTEST_S: f64 = 0.1;
/// Shortest movement whose smoothness counts, s: a shorter one has too few times.
const SHORTEST_MOVEMENT_S: f64 = 0.25;
/// Movements of hands at most this far apart are one, s: a hand that trembles does not rest.
pub(crate) const PAUSE_S: f64 = 0.5;

/// Speed of a tip at regular times, mm/s, from its places in order of time, s; it moves straight between them.
pub(crate) fn speeds(places: &[(f64, Vec3)]) -> Vec<f64> {
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return vec![] };
    let count = (((last.0 - first.0) / STEP_S).floor() as usize).min(MOST);
    let mut next = 0;
    let mut at = |time_s: f64| {
        while next + 1 < places.len() && places[next + 1].0 <= time_s {
            next += 1;
        }
        let (from_s, from) = places[next];
        let Some(&(to_s, to)) = places.get(next + 1) else { return from };
        from + (to - from) * ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
    };
    let mut before = first.1;
    let mut speed = |k: usize| {
        let now = at(first.0 + k as f64 * STEP_S);
        let speed = (now - before).norm() / STEP_S;
        before = now;
        speed
    };
    (1..=count).map(&mut speed).collect()
}

/// Spectral arc length: the negative length of the amplitude spectrum of the speed, with amplitude and frequency
/// scaled to one (Balasubramanian, Melendez-Calderon and Burdet, IEEE Transactions on Biomedical Engineering 59,
/// 2012; with an adaptive cut-off, 2015). Closer to zero is smoother.
pub(crate) fn spectral_arc_length(speeds: &[f64]) -> Option<f64> {
    if speeds.len() < 2 || speeds.iter().all(|speed| *speed == 0.0) {
        return None;
    }
    let length = speeds.len().next_power_of_two() << PADDING;
    let mut padded = speeds.to_vec();
    padded.resize(length, 0.0);
    let amplitudes = amplitudes(&padded);
    let largest = amplitudes.iter().copied().fold(0.0, f64::max);
    let last = amplitudes.iter().rposition(|value| *value >= LEAST_AMPLITUDE * largest)?;
    let step = 1.0 / last.max(1) as f64;
    let pieces = amplitudes[..=last].windows(2);
    // Square roots have the same bits on every machine; `hypot` does not.
    let of_piece = |pair: &[f64]| (step * step + ((pair[1] - pair[0]) / largest).powi(2)).sqrt();
    Some(-pieces.map(of_piece).sum::<f64>())
}

/// The same of each movement between pauses, as a mean weighted by their durations: a pause is long and smooth, and a
/// procedure with its pauses has the spectrum of these. `begins_s` is the time of the first speed.
pub(crate) fn smoothness_of_movements(speeds: &[f64], begins_s: f64, movements: &[Stretch]) -> Option<f64> {
    let place = |time_s: f64| (((time_s - begins_s) / STEP_S).round().max(0.0) as usize).min(speeds.len());
    let (mut sum, mut all_s) = (0.0, 0.0);
    for (from_s, to_s) in movements.iter().filter(|(from_s, to_s)| to_s - from_s >= SHORTEST_MOVEMENT_S) {
        let (from, to) = (place(*from_s), place(*to_s));
        let Some(smooth) = speeds.get(from..to).and_then(spectral_arc_length) else { continue };
        sum += smooth * (to_s - from_s);
        all_s += to_s - from_s;
    }
    (all_s > 0.0).then(|| sum / all_s)
}

/// Number of submovements, and their mean duration, s. A hand that turns back ends one and begins another, however fast
/// the tip is meanwhile; `reversals_s` are the times at which hands did.
pub(crate) fn submovements(speeds: &[f64], begins_s: f64, reversals_s: &[f64]) -> (usize, Option<f64>) {
    let (mut count, mut all_s, mut index) = (0, 0.0, 0);
    for stretch in speeds.chunk_by(|a, b| (*a > MOVING_MM_PER_S) == (*b > MOVING_MM_PER_S)) {
        let length_s = stretch.len() as f64 * STEP_S;
        let from_s = begins_s + index as f64 * STEP_S;
        index += stretch.len();
        if stretch[0] > MOVING_MM_PER_S && length_s >= SHORTEST_S {
            let within = |time_s: &&f64| **time_s > from_s && **time_s < from_s + length_s;
            count += 1 + reversals_s.iter().filter(within).count();
            all_s += length_s;
        }
    }
    (count, (count > 0).then(|| all_s / count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bell_is_smoother_than_two_and_tremor_is_the_least_smooth() {
        let bell = |k: usize| (std::f64::consts::PI * k as f64 / 40.0).sin().powi(2) * 20.0;
        let one: Vec<f64> = (0..40).map(bell).collect();
        let two: Vec<f64> = one.iter().chain(&one).copied().collect();
        let tremor: Vec<f64> =
            one.iter().enumerate().map(|(k, v)| v * (1.0 + 0.8 * (2.5 * k as f64).sin())).collect();
        let [one, two, tremor] = [&one, &two, &tremor].map(|speeds| spectral_arc_length(speeds).unwrap());
        assert!(one > two && one > tremor, "{one} {two} {tremor}");
        // The papers give −1.4 to −1.6 for a bell-shaped speed.
        assert!((-1.9..-1.2).contains(&one), "{one}");
        assert!(spectral_arc_length(&[0.0; 9]).is_none() && spectral_arc_length(&[]).is_none());
    }

    #[test]
    fn submovements_are_counted_and_timed() {
        let speeds = [0.0, 9.0, 9.0, 9.0, 9.0, 1.0, 3.0, 1.0, 5.0, 5.0];
        let (count, mean_s) = submovements(&speeds, 0.0, &[]);
        assert_eq!(count, 2, "one of a twentieth of a second is none");
        assert!((mean_s.unwrap() - 0.15).abs() < 1e-12);
        // A hand that turns back in the first one divides it; while the tip rests it divides nothing.
        let (count, mean_s) = submovements(&speeds, 10.0, &[10.02, 10.15, 10.32]);
        assert_eq!(count, 3);
        assert!((mean_s.unwrap() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn pauses_do_not_change_how_smooth_movements_are() {
        let bell = |k: usize| (std::f64::consts::PI * k as f64 / 40.0).sin().powi(2) * 20.0;
        let one: Vec<f64> = (0..40).map(bell).collect();
        let alone = smoothness_of_movements(&one, 0.0, &[(0.0, 2.0)]).unwrap();
        let paused = [&one[..], &[0.0; 200], &one].concat();
        let of = |movements: &[Stretch]| smoothness_of_movements(&paused, 0.0, movements).unwrap();
        assert!((of(&[(0.0, 2.0), (12.0, 14.0)]) - alone).abs() < 1e-12);
        // The twin: the spectrum of the whole is that of the pause.
        assert!((of(&[(0.0, 14.0)]) - alone).abs() > 0.5, "{} {alone}", of(&[(0.0, 14.0)]));
        assert_eq!(smoothness_of_movements(&paused, 0.0, &[(3.0, 8.0)]), None, "nothing moves");
    }
}
