//! Counter-based random numbers: independent of the order of calls and the number of threads.
//!
//! SplitMix64 (Steele, Lea and Flood, OOPSLA 2014) is a counter and a function that mixes its bits, so the n-th word
//! of a seed does not need the words before it.

/// Increment of the counter.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The `index`-th word of the generator with this seed.
pub const fn splitmix64(seed: u64, index: u64) -> u64 {
    let counter = seed.wrapping_add(GOLDEN.wrapping_mul(index.wrapping_add(1)));
    let z = (counter ^ (counter >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Converts a word to a number in [0, 1).
pub fn unit(word: u64) -> f64 {
    const UNIT: f64 = 1.0 / (1u64 << 53) as f64;
    (word >> 11) as f64 * UNIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_the_published_ones_and_numbers_even() {
        // The first outputs of the authors' generator for the seed 0.
        assert_eq!([0, 1].map(|k| splitmix64(0, k)), [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4]);
        assert_eq!((unit(0), unit(1 << 63)), (0.0, 0.5));
        assert!(unit(u64::MAX) < 1.0);
        let mean = (0..10_000).map(|k| unit(splitmix64(7, k))).sum::<f64>() / 1e4;
        // Three standard deviations of a mean of ten thousand.
        assert!((mean - 0.5).abs() < 3.0 * (1.0 / 12.0f64 / 1e4).sqrt(), "{mean}");
    }
}
