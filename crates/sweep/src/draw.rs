//! Random numbers that depend only on the seed, the axis and the sample, not on the order of evaluation.

use endowire_core::random::{splitmix64, unit};

/// Random numbers of one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stream(u64);

impl Stream {
    /// The stream of one axis.
    pub(crate) fn new(seed: u64, axis: usize) -> Self {
        Self(splitmix64(splitmix64(seed, 0), axis as u64))
    }

    /// The number with this index, uniform in [0, 1).
    pub(crate) fn unit(self, index: usize) -> f64 {
        unit(splitmix64(self.0, index as u64))
    }

    /// The numbers from 0 to `count` − 1, shuffled (Fisher and Yates).
    pub(crate) fn shuffled(self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        // A separate stream, seeded with the last index: the low indices of this one are drawn within the strata.
        let places = Self(splitmix64(self.0, u64::MAX));
        for last in (1..count).rev() {
            let place = (places.unit(last) * (last + 1) as f64) as usize;
            order.swap(last, place.min(last));
        }
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_even_and_streams_differ() {
        let mean = |stream: Stream| (0..10_000).map(|k| stream.unit(k)).sum::<f64>() / 1e4;
        let streams = [Stream::new(0, 0), Stream::new(0, 1), Stream::new(1, 0), Stream::new(u64::MAX, 0)];
        for (k, stream) in streams.iter().enumerate() {
            // Three standard deviations of the mean of ten thousand numbers.
            assert!((mean(*stream) - 0.5).abs() < 3.0 * (1.0 / 12.0f64 / 1e4).sqrt(), "{}", mean(*stream));
            assert!(streams[..k].iter().all(|other| other.unit(0) != stream.unit(0)));
        }
        // These values must never change: existing tables refer to their seeds.
        assert_eq!(Stream::new(1, 0).unit(0), 0.6935121390102292);
    }

    #[test]
    fn a_shuffle_has_each_number_once() {
        let order = Stream::new(3, 0).shuffled(1000);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..1000).collect::<Vec<u32>>());
        let still = order.iter().enumerate().filter(|(k, n)| *k as u32 == **n).count();
        assert!(still < 10, "{still} stay where they were");
        assert_eq!(Stream::new(3, 0).shuffled(0), Vec::<u32>::new());
    }
}
