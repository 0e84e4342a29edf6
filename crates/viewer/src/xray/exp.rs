//! e^x and ln x for many numbers at once, in a form that compilers vectorise.

/// Numbers per lane group.
pub(crate) const LANES: usize = 8;

/// e^x within 2e-7 of its value for |x| ≤ 87, saturating beyond.
///
/// e^x = 2ⁿ e^r with n = ⌊x log₂e + ½⌋ and |r| ≤ ln 2/2, and the Taylor series to r⁷/7!, whose next term is below 6e-9.
#[inline(always)]
pub(crate) fn exp_lanes(x: [f32; LANES]) -> [f32; LANES] {
    // Adding this to a small number leaves its nearest integer in the low bits.
    const ROUND: f32 = 12_582_912.0;
    // ln 2 in two parts, so that n times the first is exact.
    const LN2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let mut y = [0.0; LANES];
    for i in 0..LANES {
        let x = x[i].clamp(-87.0, 87.0);
        let shifted = x * std::f32::consts::LOG2_E + ROUND;
        let n = shifted - ROUND;
        let r = (x - n * LN2[0]) - n * LN2[1];
        let mut series = 1.0 / 5040.0;
        for c in [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
            series = series * r + c;
        }
        let scale = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
        y[i] = series * scale;
    }
    y
}

/// Replaces positive normal numbers by their natural logarithms, within 2e-7 absolute or relative.
///
/// x = 2ⁿ m with √½ ≤ m < √2, and ln m = 2 artanh t with t = (m − 1)/(m + 1), |t| < 0.172; the series' first omitted term,
/// 2t¹¹/11, is below 7e-10.
pub(crate) fn ln_lanes(values: &mut [f32]) {
    const SQRT_HALF: u32 = 0x3f35_04f3;
    for x in values {
        let bits = x.to_bits().wrapping_sub(SQRT_HALF);
        let n = (bits as i32 >> 23) as f32;
        let m = f32::from_bits((bits & 0x007f_ffff) + SQRT_HALF);
        let t = (m - 1.0) / (m + 1.0);
        let t2 = t * t;
        let series = 2.0 + t2 * (2.0 / 3.0 + t2 * (2.0 / 5.0 + t2 * (2.0 / 7.0 + t2 * (2.0 / 9.0))));
        *x = n * std::f32::consts::LN_2 + t * series;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_lanes_is_the_exponential() {
        for k in -8700..=8700 {
            let x = k as f32 / 100.0;
            let exact = f64::from(x).exp();
            let relative = f64::from(exp_lanes([x; LANES])[3]) / exact - 1.0;
            assert!(relative.abs() < 2e-7, "{x}: {relative}");
        }
        assert!(exp_lanes([-1000.0; LANES])[0] < 1e-37);
    }

    #[test]
    fn ln_lanes_is_the_logarithm() {
        for k in -600..=600 {
            let x = 10.0_f64.powf(f64::from(k) / 100.0) as f32;
            let mut y = [x];
            ln_lanes(&mut y);
            let exact = f64::from(x).ln();
            assert!((f64::from(y[0]) - exact).abs() < 2e-7 * exact.abs().max(1.0) + 3e-7, "{x}: {}", y[0]);
        }
    }
}
