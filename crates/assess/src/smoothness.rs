//! Smoothness of the tip's motion, from its speed at regular times.

use endowire_core::Vec3;

use crate::spectrum::amplitudes;

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

/// Number of submovements, and their mean duration, s.
pub(crate) fn submovements(speeds: &[f64]) -> (usize, Option<f64>) {
    let of = |stretch: &[f64]| stretch[0] > MOVING_MM_PER_S;
    let stretches = speeds.chunk_by(|a, b| (*a > MOVING_MM_PER_S) == (*b > MOVING_MM_PER_S));
    let lengths = stretches.filter(|stretch| of(stretch)).map(|stretch| stretch.len() as f64 * STEP_S);
    let lengths: Vec<f64> = lengths.filter(|length_s| *length_s >= SHORTEST_S).collect();
    let mean_s = lengths.iter().sum::<f64>() / lengths.len() as f64;
    (lengths.len(), (!lengths.is_empty()).then_some(mean_s))
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
        let (count, mean_s) = submovements(&speeds);
        assert_eq!(count, 2, "one of a twentieth of a second is none");
        assert!((mean_s.unwrap() - 0.15).abs() < 1e-12);
    }
}
