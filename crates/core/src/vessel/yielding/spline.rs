//! Quintic B-splines on equal spans, clamped: the first and the last coefficient are the values at the ends.
//!
//! A beam on a support, loaded where it may be, is smooth on the length (4 B/k)^¼; splines with spans of that size
//! describe it with few unknowns. Forces on the wall depend on the third derivative, which is why it has to be continuous.

use super::curve::Piece;
use crate::Vec3;

/// Degree of the splines.
pub(super) const DEGREE: usize = 5;
/// Number of splines that are not zero at a place.
pub(super) const FELT: usize = DEGREE + 1;

/// The splines that are not zero at a place: the coefficient of the first, and of each the value and its derivatives in
/// arc length, up to the third.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Basis {
    pub(super) first: usize,
    pub(super) derivatives: [[f64; FELT]; 4],
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
        self.spans + DEGREE
    }

    /// Number of spans.
    pub(super) fn spans(&self) -> usize {
        self.spans
    }

    /// Length of a span, mm.
    pub(super) fn span_mm(&self) -> f64 {
        self.length_mm / self.spans as f64
    }

    fn knot(&self, i: usize) -> f64 {
        i.saturating_sub(DEGREE).min(self.spans) as f64 * self.span_mm()
    }

    /// Bound of the slope of the sum of splines with these coefficients: slopes are means of their differences.
    pub(super) fn steepest(&self, coefficients: &[Vec3]) -> f64 {
        let slope = |k: usize| {
            let support_mm = self.knot(k + DEGREE + 1) - self.knot(k + 1);
            DEGREE as f64 * (coefficients[k + 1] - coefficients[k]).norm() / support_mm
        };
        (0..coefficients.len() - 1).map(slope).fold(0.0, f64::max)
    }

    /// The number of the polynomial at an arc length: one for each span, between two for what is beyond the ends.
    #[inline]
    pub(super) fn piece(&self, s_mm: f64) -> usize {
        if s_mm < 0.0 { 0 } else { 1 + ((s_mm / self.span_mm()) as usize).min(self.spans) }
    }

    /// The polynomials of the sum of splines with these coefficients, in the order of [`Self::piece`].
    pub(super) fn pieces(&self, coefficients: &[Vec3], into: &mut Vec<Piece>) {
        let h = self.span_mm();
        let sum = |basis: &Basis, order: usize| -> Vec3 {
            (0..FELT).map(|k| coefficients[basis.first + k] * basis.derivatives[order][k]).sum()
        };
        let straight = |s_mm: f64| {
            let basis = self.inside(s_mm);
            let mut powers = [Vec3::zeros(); 6];
            (powers[0], powers[1]) = (sum(&basis, 0), sum(&basis, 1));
            Piece { from_mm: s_mm, powers }
        };
        into.push(straight(0.0));
        for span in 0..self.spans {
            // About the middle, so that rounding chooses no other span; the third derivative is a parabola.
            let middle_mm = (span as f64 + 0.5) * h;
            let [less, here, more] = [-0.25, 0.0, 0.25].map(|part| self.inside(middle_mm + part * h));
            let [less3, here3, more3] = [&less, &here, &more].map(|basis| sum(basis, 3));
            let fourth = (more3 - less3) / (0.5 * h);
            let fifth = (more3 - here3 * 2.0 + less3) / (0.0625 * h * h);
            let powers = [
                sum(&here, 0),
                sum(&here, 1),
                sum(&here, 2) / 2.0,
                here3 / 6.0,
                fourth / 24.0,
                fifth / 120.0,
            ];
            into.push(Piece { from_mm: middle_mm, powers });
        }
        into.push(straight(self.length_mm));
    }

    /// The splines at an arc length, mm; beyond the ends they go on straight.
    pub(super) fn at(&self, s_mm: f64) -> Basis {
        let inside_mm = s_mm.clamp(0.0, self.length_mm);
        let mut basis = self.inside(inside_mm);
        if s_mm != inside_mm {
            let [values, slopes, ..] = &mut basis.derivatives;
            values.iter_mut().zip(slopes).for_each(|(value, slope)| *value += *slope * (s_mm - inside_mm));
            (basis.derivatives[2], basis.derivatives[3]) = ([0.0; FELT], [0.0; FELT]);
        }
        basis
    }

    fn inside(&self, s_mm: f64) -> Basis {
        let first = ((s_mm / self.span_mm()) as usize).min(self.spans - 1);
        // Splines of all degrees that are not zero in the span (Cox and de Boor); number k begins at knot `first + k`.
        let mut by_degree = [[0.0; FELT + 1]; FELT];
        by_degree[0][DEGREE] = 1.0;
        for degree in 1..FELT {
            for k in DEGREE - degree..FELT {
                let i = first + k;
                let share =
                    |from: f64, to: f64, below: f64| if to > from { below / (to - from) } else { 0.0 };
                let (rising, falling) = (by_degree[degree - 1][k], by_degree[degree - 1][k + 1]);
                by_degree[degree][k] = (s_mm - self.knot(i))
                    * share(self.knot(i), self.knot(i + degree), rising)
                    + (self.knot(i + degree + 1) - s_mm)
                        * share(self.knot(i + 1), self.knot(i + degree + 1), falling);
            }
        }
        // The derivative of a spline of degree d is d times the difference of two of degree d − 1 over their supports.
        let over = |i: usize, degree: usize| {
            let width = self.knot(i + degree) - self.knot(i);
            if width > 0.0 { 1.0 / width } else { 0.0 }
        };
        let differentiated = |below: &[f64; FELT + 1], degree: usize| {
            let mut of = [0.0; FELT + 1];
            for (k, of) in of.iter_mut().enumerate().take(FELT) {
                let i = first + k;
                *of = degree as f64 * (below[k] * over(i, degree) - below[k + 1] * over(i + 1, degree));
            }
            of
        };
        let mut derivatives = [[0.0; FELT]; 4];
        for (order, to) in derivatives.iter_mut().enumerate() {
            let mut of = by_degree[DEGREE - order];
            for degree in DEGREE - order + 1..=DEGREE {
                of = differentiated(&of, degree);
            }
            to.copy_from_slice(&of[..FELT]);
        }
        Basis { first, derivatives }
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
                assert!((at.derivatives[0].iter().sum::<f64>() - 1.0).abs() < 1e-13);
                assert!(at.derivatives[1].iter().sum::<f64>().abs() < 1e-13);
                assert!(at.first + FELT <= spline.count());
                // Within a span.
                let e = 1e-5;
                let (low, high) = (spline.at(s - e), spline.at(s + e));
                if low.first == high.first && s > e && s + e < 21.0 {
                    for (order, of) in at.derivatives.iter().enumerate().skip(1) {
                        for j in 0..FELT {
                            let [a, b] = [&low, &high].map(|basis| basis.derivatives[order - 1][j]);
                            assert!(((b - a) / (2.0 * e) - of[j]).abs() < 1e-8, "{spans} {s} {order} {j}");
                        }
                    }
                }
            }
            let (begin, end) = (spline.at(0.0), spline.at(21.0));
            assert!((begin.derivatives[0][0] - 1.0).abs() < 1e-14);
            assert!((end.derivatives[0][DEGREE] - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn polynomials_are_the_sums_of_the_splines_with_continuous_third_derivatives() {
        let spline = Spline::new(21.0, 4.0);
        let of: Vec<Vec3> = (0..spline.count()).map(|k| Vec3::new(k as f64, (k as f64).sin(), 1.0)).collect();
        let mut pieces = Vec::new();
        spline.pieces(&of, &mut pieces);
        assert_eq!(pieces.len(), spline.spans() + 2);
        for k in -10..70 {
            let s = 0.37 * f64::from(k);
            let basis = spline.at(s);
            let at = pieces[spline.piece(s)].at(s);
            for (order, own) in at.iter().enumerate() {
                let sum: Vec3 = (0..FELT).map(|k| of[basis.first + k] * basis.derivatives[order][k]).sum();
                assert!((own - sum).norm() < 1e-10, "{s} {order}");
            }
        }
        for span in 1..spline.spans() {
            let knot = span as f64 * spline.span_mm();
            let [before, after] = [-1e-9, 1e-9].map(|off| pieces[spline.piece(knot + off)].at(knot + off)[3]);
            assert!((before - after).norm() < 1e-7);
        }
    }
}
