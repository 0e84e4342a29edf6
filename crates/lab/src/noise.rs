//! Reproducible random numbers.

/// Uniformly distributed numbers from −1 to 1: the multiplier and increment of Knuth's MMIX.
#[derive(Debug, Clone)]
pub struct Noise(pub u64);

impl Noise {
    /// A different sequence for every small seed: neighbouring states of the generator start similarly.
    pub fn new(seed: u64) -> Self {
        let mut noise = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d);
        for _ in 0..4 {
            noise.next();
        }
        noise
    }

    /// The next number.
    #[allow(clippy::should_implement_trait, reason = "it never ends and is no iterator")]
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64) / (1u64 << 53) as f64 * 2.0 - 1.0
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((0.5 * (self.next() + 1.0) * count as f64) as usize).min(count.saturating_sub(1))
    }

    /// Whether an event of this probability happens.
    pub fn happens(&mut self, probability: f64) -> bool {
        0.5 * (self.next() + 1.0) < probability
    }
}
