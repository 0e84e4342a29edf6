//! Amplitude spectra with the same bits on every machine. FFT libraries do not give these: they choose their
//! algorithm by the processor and use the sines of the system.

use std::f64::consts::TAU;

/// Amplitudes of the discrete Fourier transform of real values, from the mean to half the sampling rate (Cooley and
/// Tukey, Mathematics of Computation 19, 1965). The number of values must be a power of two and at least two.
pub(crate) fn amplitudes(values: &[f64]) -> Vec<f64> {
    let count = values.len();
    debug_assert!(count.is_power_of_two() && count > 1);
    let turns: Vec<[f64; 2]> = (0..count / 2)
        .map(|k| {
            let (sin, cos) = libm::sincos(-TAU * k as f64 / count as f64);
            [cos, sin]
        })
        .collect();
    // Each half holds the even or the odd indices, at all levels: values start in bit-reversed order.
    let beyond = usize::BITS - count.trailing_zeros();
    let mut spectrum: Vec<[f64; 2]> =
        (0..count).map(|place| [values[place.reverse_bits() >> beyond], 0.0]).collect();
    let mut half = 1;
    while half < count {
        let stride = count / (2 * half);
        for whole in spectrum.chunks_exact_mut(2 * half) {
            let (even, odd) = whole.split_at_mut(half);
            for (k, (even, odd)) in even.iter_mut().zip(odd).enumerate() {
                let [cos, sin] = turns[k * stride];
                let turned = [odd[0] * cos - odd[1] * sin, odd[0] * sin + odd[1] * cos];
                *odd = [even[0] - turned[0], even[1] - turned[1]];
                *even = [even[0] + turned[0], even[1] + turned[1]];
            }
        }
        half *= 2;
    }
    spectrum[..=count / 2].iter().map(|[re, im]| (re * re + im * im).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spectrum_is_the_sum_that_defines_it() {
        let values: Vec<f64> = (0..64).map(|k| (0.3 * f64::from(k * k)).sin() + 0.1 * f64::from(k)).collect();
        let amplitudes = amplitudes(&values);
        assert_eq!(amplitudes.len(), 33);
        for (k, amplitude) in amplitudes.iter().enumerate() {
            let of = |turn: fn(f64) -> f64| -> f64 {
                values.iter().enumerate().map(|(n, v)| v * turn(TAU * (k * n) as f64 / 64.0)).sum()
            };
            let expected = of(f64::cos).hypot(of(f64::sin));
            assert!((amplitude - expected).abs() < 1e-11, "{k}: {amplitude}, {expected}");
        }
        // The twin: a different value gives a different spectrum.
        let mut other = values;
        other[5] += 1e-6;
        assert!((super::amplitudes(&other)[3] - amplitudes[3]).abs() > 1e-9);
    }
}
