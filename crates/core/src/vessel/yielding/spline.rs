//! Cubic B-splines on equal spans, clamped: the first and the last coefficient are the values at the ends.
//!
//! A beam on a support, loaded where it may be, is smooth on the length (4 B/k)^¼; splines with spans of that size
//! describe it with three times fewer unknowns than values and slopes at nodes would.

use super::curve::Piece;
use crate::Vec3;

/// The four splines that are not zero at a place: the coefficient of the first, and of each the value and its first and
/// second derivative in arc length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Basis {
    pub(super) first: usize,
    pub(super) values: [f64; 4],
    pub(super) slopes: [f64; 4],
    pub(super) bends: [f64; 4],
}

/// Splines over a length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spline {
    length_mm: f64,
    spans: usize,
}

impl Spline {
    /// Splines on spans of at most `span_mm` over a length.
    pub(super) fn new(length_mm: f64, span_mm: f64) -> Self {
        Self { length_mm, spans: ((length_mm / span_mm).ceil() as usize).max(1) }
    }

    /// Number of coefficients.
    pub(super) fn count(&self) -> usize {
        self.spans + 3
    }

    /// Number of spans.
    pub(super) fn spans(&self) -> usize {
        self.spans
    }

    /// Length of a span, mm.
    pub(super) fn span_mm(&self) -> f64 {
        self.length_mm / self.spans as f64
    }

    /// Bound of the slope of the sum of splines with these coefficients: slopes are means of their differences.
    pub(super) fn steepest(&self, coefficients: &[Vec3]) -> f64 {
        let knot = |i: usize| i.saturating_sub(3).min(self.spans) as f64 * self.span_mm();
        let slope = |k: usize| {
            3.0 * (coefficients[k + 1] - coefficients[k]).norm() / (knot(k + 4) - knot(k + 1))
        };
        (0..coefficients.len() - 1).map(slope).fold(0.0, f64::max)
    }

    /// The number of the polynomial at an arc length: one for each span, between two for what is beyond the ends.
    #[inline]
    pub(super) fn piece(&self, s_mm: f64) -> usize {
        // What is negative becomes zero.
        if s_mm < 0.0 { 0 } else { 1 + ((s_mm / self.span_mm()) as usize).min(self.spans) }
    }

    /// The polynomials of the sum of splines with these coefficients, in the order of [`Self::piece`].
    pub(super) fn pieces(&self, coefficients: &[Vec3], into: &mut Vec<Piece>) {
        let h = self.span_mm();
        let sum = |basis: &Basis, shares: &[f64; 4]| -> Vec3 {
            (0..4).map(|k| coefficients[basis.first + k] * shares[k]).sum()
        };
        let straight = |s_mm: f64| {
            let basis = self.inside(s_mm);
            let powers = [sum(&basis, &basis.values), sum(&basis, &basis.slopes), Vec3::zeros(), Vec3::zeros()];
            Piece { from_mm: s_mm, powers }
        };
        into.push(straight(0.0));
        for span in 0..self.spans {
            let from_mm = span as f64 * h;
            // In the middle, so that rounding chooses no other span.
            let middle = self.inside(from_mm + 0.5 * h);
            let bend = sum(&middle, &middle.bends);
            let (value, slope) = (sum(&middle, &middle.values), sum(&middle, &middle.slopes));
            let third = {
                let later = self.inside(from_mm + 0.75 * h);
                (sum(&later, &later.bends) - bend) / (0.25 * h)
            };
            // About the middle.
            into.push(Piece { from_mm: from_mm + 0.5 * h, powers: [value, slope, bend * 0.5, third / 6.0] });
        }
        into.push(straight(self.length_mm));
    }

    /// The splines at an arc length, mm; beyond the ends they go on straight.
    pub(super) fn at(&self, s_mm: f64) -> Basis {
        let inside_mm = s_mm.clamp(0.0, self.length_mm);
        let mut basis = self.inside(inside_mm);
        if s_mm != inside_mm {
            for k in 0..4 {
                basis.values[k] += basis.slopes[k] * (s_mm - inside_mm);
                basis.bends[k] = 0.0;
            }
        }
        basis
    }

    fn inside(&self, s_mm: f64) -> Basis {
        let h = self.span_mm();
        let first = ((s_mm / h) as usize).min(self.spans - 1);
        let knot = |i: usize| i.saturating_sub(3).min(self.spans) as f64 * h;
        // Splines of degree 0, 1, 2 and 3 that are not zero in the span (Cox and de Boor); number k begins at knot
        // `first + k`.
        let mut by_degree = [[0.0; 5]; 4];
        by_degree[0][3] = 1.0;
        for degree in 1..4 {
            for k in 3 - degree..4 {
                let i = first + k;
                let share = |from: f64, to: f64, below: f64| if to > from { below / (to - from) } else { 0.0 };
                let (rising, falling) = (by_degree[degree - 1][k], by_degree[degree - 1][k + 1]);
                by_degree[degree][k] = (s_mm - knot(i)) * share(knot(i), knot(i + degree), rising)
                    + (knot(i + degree + 1) - s_mm) * share(knot(i + 1), knot(i + degree + 1), falling);
            }
        }
        // The derivative of a spline of degree d is d times the difference of two of degree d − 1 over their supports.
        let over = |i: usize, degree: usize| {
            let width = knot(i + degree) - knot(i);
            if width > 0.0 { 1.0 / width } else { 0.0 }
        };
        let slope = |below: &[f64; 5], k: usize, degree: usize| {
            let i = first + k;
            degree as f64 * (below[k] * over(i, degree) - below[k + 1] * over(i + 1, degree))
        };
        let mut of_parabolas = [0.0; 5];
        for (k, of) in of_parabolas.iter_mut().enumerate().take(4) {
            *of = slope(&by_degree[1], k, 2);
        }
        let mut basis = Basis { first, values: [0.0; 4], slopes: [0.0; 4], bends: [0.0; 4] };
        for k in 0..4 {
            basis.values[k] = by_degree[3][k];
            basis.slopes[k] = slope(&by_degree[2], k, 3);
            basis.bends[k] = slope(&of_parabolas, k, 3);
        }
        basis
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_add_up_to_one_and_have_their_own_derivatives() {
        for spans in [1, 2, 3, 7] {
            let spline = Spline { length_mm: 21.0, spans };
            for k in 0..=60 {
                let s = 0.35 * f64::from(k);
                let at = spline.at(s);
                assert!((at.values.iter().sum::<f64>() - 1.0).abs() < 1e-13);
                assert!(at.slopes.iter().sum::<f64>().abs() < 1e-13);
                assert!(at.first + 4 <= spline.count());
                // Within a span.
                let e = 1e-5;
                let (low, high) = (spline.at(s - e), spline.at(s + e));
                if low.first == high.first && s > e && s + e < 21.0 {
                    for j in 0..4 {
                        let slope = (high.values[j] - low.values[j]) / (2.0 * e);
                        let bend = (high.slopes[j] - low.slopes[j]) / (2.0 * e);
                        assert!((slope - at.slopes[j]).abs() < 1e-8, "{spans} {s} {j}");
                        assert!((bend - at.bends[j]).abs() < 1e-8, "{spans} {s} {j}");
                    }
                }
            }
            let (begin, end) = (spline.at(0.0), spline.at(21.0));
            assert!((begin.values[0] - 1.0).abs() < 1e-14 && (end.values[3] - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn polynomials_are_the_sums_of_the_splines() {
        let spline = Spline::new(21.0, 4.0);
        let of: Vec<Vec3> = (0..spline.count()).map(|k| Vec3::new(k as f64, (k as f64).sin(), 1.0)).collect();
        let mut pieces = Vec::new();
        spline.pieces(&of, &mut pieces);
        assert_eq!(pieces.len(), spline.spans() + 2);
        for k in -10..70 {
            let s = 0.37 * f64::from(k);
            let basis = spline.at(s);
            let sum = |shares: &[f64; 4]| -> Vec3 { (0..4).map(|k| of[basis.first + k] * shares[k]).sum() };
            let [w, slope, bend, _] = pieces[spline.piece(s)].at(s);
            assert!((w - sum(&basis.values)).norm() < 1e-12, "{s}");
            assert!((slope - sum(&basis.slopes)).norm() < 1e-12);
            assert!((bend - sum(&basis.bends)).norm() < 1e-11);
        }
    }

    #[test]
    fn beyond_the_ends_they_go_on_straight() {
        let spline = Spline::new(10.0, 2.5);
        assert_eq!(spline.spans(), 4);
        for (end, beyond) in [(0.0, -3.0), (10.0, 13.0)] {
            let (at, out) = (spline.at(end), spline.at(beyond));
            for k in 0..4 {
                assert!((out.values[k] - at.values[k] - at.slopes[k] * (beyond - end)).abs() < 1e-13);
            }
        }
    }
}
