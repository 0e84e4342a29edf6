//! Photon noise: Poisson numbers from a counter-based generator.
//!
//! Random words are a function of (key, frame, pixel) alone: they do not depend on the order of computation, number
//! of threads or backend, and a frame can be redrawn without those before it. The generator is Philox4x32-10 (Salmon
//! et al., Parallel Random Numbers: As Easy as 1, 2, 3, SC 2011).
//!
//! A Poisson number is a *quantile*, so that a small change of its mean changes it little. Below [`FEW`] photons it
//! is the exact one. Above, the Cornish–Fisher expansion with skewness λ^−½ and excess kurtosis 1/λ gives λ + √λ·z +
//! (z² − 1)/6 from a normal z (the next term, (z − z³)/(72 √λ), is below 1/20 of a photon for |z| < 3).

use std::sync::LazyLock;

/// Mean below which numbers are drawn exactly.
const FEW: f32 = 12.0;
/// Number of entries of the table of normal quantiles.
const QUANTILES: usize = 1 << 12;

/// Philox4x32-10 of several counters at once: word by word, one counter per lane.
#[inline(always)]
pub(super) fn philox<const N: usize>(counters: [[u32; N]; 4], key: [u32; 2]) -> [[u32; N]; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counters;
    let [mut k0, mut k1] = key;
    for _ in 0..10 {
        for i in 0..N {
            let a = u64::from(c0[i]) * 0xD251_1F53;
            let b = u64::from(c2[i]) * 0xCD9E_8D57;
            c0[i] = (b >> 32) as u32 ^ c1[i] ^ k0;
            c1[i] = b as u32;
            c2[i] = (a >> 32) as u32 ^ c3[i] ^ k1;
            c3[i] = a as u32;
        }
        k0 = k0.wrapping_add(0x9E37_79B9);
        k1 = k1.wrapping_add(0xBB67_AE85);
    }
    [c0, c1, c2, c3]
}

/// Standard normal quantiles at the middles of [`QUANTILES`] equal shares, scaled to a variance of one.
static NORMAL: LazyLock<Vec<f32>> = LazyLock::new(|| {
    // dz/dp = 1/φ(z), integrated by the classical Runge–Kutta method from the median; the table is odd.
    let slope = |z: f64| (std::f64::consts::TAU).sqrt() * libm::exp(z * z / 2.0);
    const STEPS: usize = 64;
    let half = QUANTILES / 2;
    let h = 1.0 / (QUANTILES * STEPS) as f64;
    let (mut z, mut upper) = (0.0, Vec::with_capacity(half));
    for _ in 0..half {
        for step in 0..STEPS {
            if step == STEPS / 2 {
                upper.push(z);
            }
            let k1 = slope(z);
            let k2 = slope(z + h / 2.0 * k1);
            let k3 = slope(z + h / 2.0 * k2);
            let k4 = slope(z + h * k3);
            let next = z + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            // The very last step ends at infinity and is not used.
            z = if next.is_finite() { next } else { z };
        }
    }
    let scale = (upper.iter().map(|z| z * z).sum::<f64>() / half as f64).sqrt().recip();
    let lower = upper.iter().rev().map(|z| -z * scale);
    lower.chain(upper.iter().map(|z| z * scale)).map(|z| z as f32).collect()
});

/// The table for [`normal`] and [`poisson`].
pub(super) fn normal_table() -> &'static [f32; QUANTILES] {
    static ZERO: [f32; QUANTILES] = [0.0; QUANTILES];
    // The length is right by construction.
    NORMAL.as_slice().try_into().unwrap_or(&ZERO)
}

/// A standard normal number from a random word: the sum of two independent quantiles has longer tails than one from
/// so small a table.
#[inline(always)]
pub(super) fn normal(word: u32, table: &[f32; QUANTILES]) -> f32 {
    (table[(word >> 20) as usize] + table[(word & 0xFFF) as usize]) * std::f32::consts::FRAC_1_SQRT_2
}

/// Poisson numbers with given means, each from a random word; not integers for large means.
#[inline(always)]
pub(super) fn poisson<const N: usize>(
    means: [f32; N],
    words: [u32; N],
    table: &[f32; QUANTILES],
) -> [f32; N] {
    let mut counts = [0.0; N];
    // Look-ups separately, so that the rest is vectorised.
    for i in 0..N {
        counts[i] = normal(words[i], table);
    }
    let mut some_are_few = false;
    for i in 0..N {
        let (mean, z) = (means[i], counts[i]);
        counts[i] = mean + mean.sqrt() * z + (z * z - 1.0) * (1.0 / 6.0);
        some_are_few |= mean < FEW;
    }
    if some_are_few {
        for i in 0..N {
            if means[i] < FEW {
                counts[i] = few(means[i], words[i]);
            }
        }
    }
    counts
}

/// The quantile by summing probabilities.
#[cold]
fn few(mean: f32, word: u32) -> f32 {
    let u = (f64::from(word) + 0.5) / 4_294_967_296.0;
    let mean = f64::from(mean.max(0.0));
    let mut probability = libm::exp(-mean);
    let mut sum = probability;
    let mut count = 0.0;
    // A mean of 12 exceeds 60 once in 10²².
    while u > sum && count < 80.0 {
        count += 1.0;
        probability *= mean / count;
        sum += probability;
    }
    count as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn philox_gives_the_published_words() {
        // Known outputs of the authors' library.
        let philox = |counter: [u32; 4], key| philox(counter.map(|word| [word]), key).map(|[word]| word);
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn lanes_do_not_know_of_each_other() {
        let counters: [[u32; 8]; 4] = std::array::from_fn(|k| {
            std::array::from_fn(|i| 0x9E37_79B9_u32.wrapping_mul((8 * k + i) as u32))
        });
        let words = philox(counters, [3, 4]);
        // Few photons in some lanes, many in others.
        let means: [f32; 8] = std::array::from_fn(|i| if i % 3 == 0 { 2.5 } else { 40.0 * i as f32 });
        let table = normal_table();
        let counts = poisson(means, words[0], table);
        for i in 0..8 {
            let alone = philox(counters.map(|word| [word[i]]), [3, 4]);
            assert_eq!(words.map(|word| word[i]), alone.map(|[word]| word));
            assert_eq!(counts[i], poisson([means[i]], alone[0], table)[0]);
        }
        assert_ne!(words[0][1], words[0][2], "the twin: lanes are not all one");
    }

    #[test]
    fn quantiles_are_normal() {
        let table = normal_table();
        let moment = |n| table.iter().map(|z| f64::from(*z).powi(n)).sum::<f64>() / QUANTILES as f64;
        assert!(moment(1).abs() < 1e-6 && (moment(2) - 1.0).abs() < 1e-5 && (moment(4) - 3.0).abs() < 0.03);
        // Φ(1.959964) = 0.975.
        let z = table[(0.975 * QUANTILES as f64) as usize];
        assert!((z - 1.96).abs() < 2e-3, "{z}");
    }

    #[test]
    fn mean_and_variance_are_those_of_poisson_at_few_and_many_quanta() {
        let normal = normal_table();
        for mean in [0.0, 0.3, 3.0, 11.9, 12.1, 40.0, 900.0] {
            let (mut sum, mut squares, mut cubes) = (0.0, 0.0, 0.0);
            let count = 400_000;
            for i in 0..count / 4 {
                for word in philox([[i], [7], [0], [0]], [1, 2]) {
                    let [count] = poisson([mean], word, normal);
                    let n = f64::from(count) - f64::from(mean);
                    sum += n;
                    squares += n * n;
                    cubes += n * n * n;
                }
            }
            let [m, v, s] = [sum, squares, cubes].map(|x| x / f64::from(count));
            let mean = f64::from(mean);
            assert!(m.abs() <= 4.0 * (mean / f64::from(count)).sqrt(), "{mean}: {m}");
            assert!((v - mean).abs() <= 0.012 * mean, "{mean}: variance {v}");
            assert!((s - mean).abs() <= 0.12 * mean + 0.03 * mean.powf(1.5), "{mean}: third moment {s}");
        }
    }
}
