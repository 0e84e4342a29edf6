//! Numbers drawn from a seed and a place: whatever order and number of threads, the same.

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) enum What {
    Primary,
    Secondary,
    Voltage,
    Dose,
    Noise,
    Progress,
    Time,
}

/// Random words of a place in a dataset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draw {
    seed: u64,
}

impl Draw {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed: mixed(seed) }
    }

    /// Those of one thing in a row of them.
    pub(super) fn of(self, index: usize) -> Self {
        Self { seed: mixed(self.seed ^ mixed(index as u64 + 1)) }
    }

    /// A word.
    pub(super) fn word(self, what: What) -> u64 {
        mixed(self.seed.wrapping_add(mixed(what as u64 + 1)))
    }

    /// A number in [0, 1).
    pub(super) fn unit(self, what: What) -> f64 {
        (self.word(what) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number between two.
    pub(super) fn within(self, what: What, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.unit(what)
    }
}

/// A step of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
fn mixed(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_gives_the_published_words_and_numbers_are_even() {
        // The first outputs of the authors' generator from the seed 0.
        assert_eq!(mixed(0), 0xE220_A839_7B1D_CDAF);
        assert_eq!(mixed(0x9E37_79B9_7F4A_7C15), 0x6E78_9E6A_A1B9_65F4);
        let draw = Draw::new(7);
        let numbers: Vec<f64> = (0..10_000).map(|i| draw.of(i).unit(What::Dose)).collect();
        let mean = numbers.iter().sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert_ne!(draw.of(1).word(What::Dose), draw.of(1).word(What::Time));
    }
}
