//! The times of frames.

/// Relative deviation of intervals from their mean below which they count as equal.
const EVEN: f64 = 1e-3;

/// Times between frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    mean_s: f64,
    /// Intervals between frames, if they differ.
    intervals_s: Vec<f64>,
}

impl Pace {
    /// A constant number of frames per second.
    pub fn even(frames_per_s: f64) -> Self {
        Self { mean_s: 1.0 / frames_per_s, intervals_s: vec![] }
    }

    /// From the times of frames; for a single frame, this many frames per second.
    pub fn of(times_s: &[f64], frames_per_s: f64) -> Self {
        let intervals_s: Vec<f64> = times_s.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0)).collect();
        let mean_s = intervals_s.iter().sum::<f64>() / intervals_s.len() as f64;
        if mean_s.is_nan() || mean_s <= 0.0 {
            return Self::even(frames_per_s);
        }
        let even = intervals_s.iter().all(|interval| (interval - mean_s).abs() <= EVEN * mean_s);
        Self { mean_s, intervals_s: if even { vec![] } else { intervals_s } }
    }

    /// Mean time from one frame to the next.
    pub(super) fn mean_s(&self) -> f64 {
        self.mean_s
    }

    /// Intervals between frames; empty if they are equal.
    pub(super) fn intervals_s(&self) -> &[f64] {
        &self.intervals_s
    }

    /// Duration of a frame: that of the last one is the mean.
    pub(super) fn stays_s(&self, frame: usize) -> f64 {
        self.intervals_s.get(frame).copied().unwrap_or(self.mean_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_tell_the_pace_where_there_are_several() {
        let even = Pace::of(&[0.2, 1.4, 2.6], 15.0);
        assert!((even.mean_s() - 1.2).abs() < 1e-12 && even.intervals_s().is_empty());
        let uneven = Pace::of(&[0.0, 1.0, 3.0], 15.0);
        assert_eq!((uneven.mean_s(), uneven.intervals_s()), (1.5, &[1.0, 2.0][..]));
        assert_eq!([0, 1, 2].map(|frame| uneven.stays_s(frame)), [1.0, 2.0, 1.5]);
        for reported in [&[][..], &[3.0], &[3.0, 3.0]] {
            assert_eq!(Pace::of(reported, 4.0), Pace::even(4.0));
        }
    }
}
