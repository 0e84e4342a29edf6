//! Random numbers that depend only on a seed and a place in the dataset, not on order or number of threads.

use endowire_core::random::{self, splitmix64};

/// Kinds of drawn quantities.
#[derive(Debug, Clone, Copy)]
pub(super) enum What {
    Primary,
    Secondary,
    Voltage,
    Dose,
    Noise,
    Progress,
    Time,
    Magnification,
    Width,
    Scatter,
    Contrast,
    Split,
}

/// Random numbers for a place in a dataset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draw {
    seed: u64,
}

impl Draw {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed: splitmix64(seed, 0) }
    }

    /// The random numbers of the item with this index.
    pub(super) fn of(self, index: usize) -> Self {
        Self { seed: splitmix64(self.seed ^ splitmix64(index as u64 + 1, 0), 0) }
    }

    /// A random word.
    pub(super) fn word(self, what: What) -> u64 {
        splitmix64(self.seed.wrapping_add(splitmix64(what as u64 + 1, 0)), 0)
    }

    /// A number in [0, 1).
    pub(super) fn unit(self, what: What) -> f64 {
        random::unit(self.word(what))
    }

    /// A number between two limits.
    pub(super) fn within(self, what: What, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.unit(what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_even_and_things_differ() {
        let draw = Draw::new(7);
        let numbers: Vec<f64> = (0..10_000).map(|i| draw.of(i).unit(What::Dose)).collect();
        let mean = numbers.iter().sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert_ne!(draw.of(1).word(What::Dose), draw.of(1).word(What::Time));
    }
}
