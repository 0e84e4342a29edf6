//! A run of a centre line as a smooth curve, and the cross-section of it in which a point lies.
//!
//! The curve c(s) is a quintic B-spline whose control points are points of the polyline at equal arc lengths: it goes
//! near the line, not through it, which matters little, since it says which sections move together, not where the wall
//! is. The place s of a point X is where the curve's normal plane contains it,
//!
//! ```text
//! g(s) = c′(s)·(X − c(s)) = 0,    D = |c′|² − c″·(X − c),    ∇s = c′/D
//! ∇∇s = (c″ c′ᵀ + c′ c″ᵀ)/D² − (3 c′·c″ − c‴·(X − c)) c′ c′ᵀ/D³
//! ```
//!
//! which has one solution near the curve, within its radius of curvature. Forces on the wall depend on ∇∇s, which is why
//! c‴ has to be continuous.
//!
//! Sections move by w(s) and turn with the curve, to first order: with ρ = X − c(s),
//!
//! ```text
//! x = X + U,    U = w − c′ q,    q = w′·ρ
//! ```
//!
//! The section of a point x in space is where ρ = v + c′ q is in the normal plane, with v = x − c − w:
//!
//! ```text
//! g(s) = c′·v + |c′|² q = 0,    q = w′·v/(1 − w′·c′)
//! ```

use nalgebra::Matrix3;

use crate::Vec3;
use crate::products::outer;

/// A polynomial about a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) from_mm: f64,
    /// Of powers 0 to 5 of the distance from there.
    pub(super) powers: [Vec3; 6],
}

impl Piece {
    /// Value and derivatives, the third included.
    #[inline]
    pub(super) fn at(&self, s_mm: f64) -> [Vec3; 4] {
        polynomial(&self.powers, s_mm - self.from_mm)
    }
}

/// Value and first three derivatives of a polynomial.
#[inline]
fn polynomial([p0, p1, p2, p3, p4, p5]: &[Vec3; 6], t: f64) -> [Vec3; 4] {
    [
        p0 + (p1 + (p2 + (p3 + (p4 + p5 * t) * t) * t) * t) * t,
        p1 + (p2 * 2.0 + (p3 * 3.0 + (p4 * 4.0 + p5 * (5.0 * t)) * t) * t) * t,
        p2 * 2.0 + (p3 * 6.0 + (p4 * 12.0 + p5 * (20.0 * t)) * t) * t,
        p3 * 6.0 + (p4 * 24.0 + p5 * (60.0 * t)) * t,
    ]
}

/// A smooth curve; beyond its ends it goes on straight.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    from_mm: f64,
    knot_mm: f64,
    /// Of each piece the powers 0 to 5 of the distance from its beginning, in knots.
    pieces: Vec<[Vec3; 6]>,
}

/// Longest distance of knots, radii.
const KNOT_RADII: f64 = 1.5;
/// Control points beyond each end, on its straight continuation: the outermost pieces are straight.
const BEYOND: usize = 8;
/// Powers 0 to 5 of the six quintic B-splines that are not zero on a piece, times 120.
const QUINTIC: [[f64; 6]; 6] = [
    [1.0, -5.0, 10.0, -10.0, 5.0, -1.0],
    [26.0, -50.0, 20.0, 20.0, -20.0, 5.0],
    [66.0, 0.0, -60.0, 0.0, 30.0, -10.0],
    [26.0, 50.0, 20.0, -20.0, -20.0, 10.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, -5.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
];
/// Most steps of Newton's method on a place.
const MOST: usize = 20;
/// What is left after a step of Newton's method is its square over a radius of curvature: after one below this, mm, rounding.
const LAST_MM: f64 = 1e-7;
/// The least of D: farther inside a bend than its centre sections have crossed.
const LEAST_D: f64 = 0.1;

impl Curve {
    /// The curve near these points at these arc lengths.
    pub(super) fn new(points: &[Vec3], arcs_mm: &[f64], radii_mm: &[f64]) -> Self {
        let length_mm = arcs_mm[arcs_mm.len() - 1];
        let least_mm = radii_mm.iter().copied().fold(f64::INFINITY, f64::min);
        let count = (length_mm / (KNOT_RADII * least_mm)).ceil().max(1.0);
        let knot_mm = length_mm / count;
        let last = points.len() - 1;
        let on_line = |s_mm: f64| {
            let after = arcs_mm.partition_point(|arc| *arc < s_mm).clamp(1, last);
            let (from, to) = (points[after - 1], points[after]);
            from + (to - from) * ((s_mm - arcs_mm[after - 1]) / (arcs_mm[after] - arcs_mm[after - 1]))
        };
        let controls: Vec<Vec3> = (0..=count as usize + 2 * BEYOND)
            .map(|k| on_line((k as f64 - BEYOND as f64) * knot_mm))
            .collect();
        let piece = |six: &[Vec3]| {
            let power = |p: usize| (0..6).map(|k| six[k] * (QUINTIC[k][p] / 120.0)).sum::<Vec3>();
            [power(0), power(1), power(2), power(3), power(4), power(5)]
        };
        // The piece between the third and the fourth of six control points.
        let from_mm = (2.0 - BEYOND as f64) * knot_mm;
        Self { from_mm, knot_mm, pieces: controls.windows(6).map(piece).collect() }
    }

    /// c and its derivatives, the third included.
    #[inline]
    pub(super) fn at(&self, s_mm: f64) -> [Vec3; 4] {
        let h = 1.0 / self.knot_mm;
        let along = (s_mm - self.from_mm) * h;
        // What is negative becomes zero.
        let k = (along as usize).min(self.pieces.len() - 1);
        let t = along - k as f64;
        let [value, first, second, third] = polynomial(&self.pieces[k], t);
        [value, first * h, second * (h * h), third * (h * h * h)]
    }

    /// s of a point X, from a guess, and the curve there as by [`Self::at`].
    #[inline]
    pub(super) fn place(&self, x: &Vec3, guess_mm: f64) -> (f64, [Vec3; 4]) {
        let mut s = guess_mm;
        let mut there = self.at(s);
        for _ in 0..MOST {
            let step = there[1].dot(&(x - there[0])) / d(x, &there);
            s += step;
            there = self.at(s);
            if step.abs() <= LAST_MM {
                break;
            }
        }
        (s, there)
    }

    /// The material point at a point x in space, from a guess of its s, where sections are displaced by `w`, given with its
    /// derivatives.
    #[inline]
    pub(super) fn material(&self, x: &Vec3, guess_mm: f64, w: impl Fn(f64) -> [Vec3; 4]) -> Vec3 {
        let mut s = guess_mm;
        for _ in 0..MOST {
            let ([c, c1, c2, _], [by, w1, w2, _]) = (self.at(s), w(s));
            let v = x - by - c;
            let size = c1.norm_squared();
            let (turned, left) = (w1.dot(&v), 1.0 - w1.dot(&c1));
            let q = turned / left;
            let q1 = (w2.dot(&v) - w1.dot(&(c1 + w1)) + q * (w2.dot(&c1) + w1.dot(&c2))) / left;
            let g = c1.dot(&v) + size * q;
            let g1 = c2.dot(&v) - c1.dot(&(c1 + w1)) + 2.0 * c1.dot(&c2) * q + size * q1;
            let step = g / (-g1).max(LEAST_D);
            s += step;
            if step.abs() <= LAST_MM {
                break;
            }
        }
        let ([c, c1, ..], [by, w1, ..]) = (self.at(s), w(s));
        let v = x - by - c;
        c + v + c1 * (w1.dot(&v) / (1.0 - w1.dot(&c1)))
    }
}

/// D of a point, not below its least, with the curve at a place.
#[inline]
fn d(x: &Vec3, [c, c1, c2, _]: &[Vec3; 4]) -> f64 {
    (c1.norm_squared() - c2.dot(&(x - c))).max(LEAST_D)
}

/// ∇s at a point, with the curve at its place.
#[inline]
pub(super) fn slope(x: &Vec3, there: &[Vec3; 4]) -> Vec3 {
    there[1] / d(x, there)
}

/// ∇∇s at a point, with the curve at its place.
#[inline]
pub(super) fn bend(x: &Vec3, there: &[Vec3; 4]) -> Matrix3<f64> {
    let [c, c1, c2, c3] = there;
    let d = d(x, there);
    let mixed = outer(c2, c1);
    let third = 3.0 * c1.dot(c2) - c3.dot(&(x - c));
    (mixed + mixed.transpose()) / (d * d) - outer(c1, c1) * (third / (d * d * d))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn helix() -> Curve {
        let points: Vec<Vec3> = (0..=40)
            .map(|k| {
                let t = 0.15 * f64::from(k);
                Vec3::new(20.0 * t.cos(), 20.0 * t.sin(), 4.0 * t)
            })
            .collect();
        let mut arcs = vec![0.0];
        points.windows(2).for_each(|pair| arcs.push(arcs[arcs.len() - 1] + (pair[1] - pair[0]).norm()));
        Curve::new(&points, &arcs, &[2.0; 41])
    }

    #[test]
    fn a_place_has_its_own_derivatives_and_is_in_the_normal_plane() {
        let curve = helix();
        let h = 1e-5;
        for k in 0..30 {
            let s = 10.0 + 3.1 * f64::from(k);
            let [c, c1, ..] = curve.at(s);
            assert!((c.xy().norm() - 20.0).abs() < 0.3, "{c}");
            let across = c1.cross(&Vec3::new(0.3, f64::from(k).sin(), 1.0)).normalize();
            let x = c + across * 3.0;
            assert!((curve.place(&x, s + 2.0).0 - s).abs() < 1e-10);
            let (own, bends) = (slope(&x, &curve.at(s)), bend(&x, &curve.at(s)));
            for axis in 0..3 {
                let [more, less] = [h, -h].map(|h| {
                    let there = x + Vec3::ith(axis, h);
                    let (s, here) = curve.place(&there, s);
                    (s, slope(&there, &here))
                });
                assert!(((more.0 - less.0) / (2.0 * h) - own[axis]).abs() < 1e-8);
                let differs = (more.1 - less.1) / (2.0 * h) - bends.column(axis);
                assert!(differs.norm() < 1e-6, "{differs}");
            }
        }
        // The third derivative is continuous, at knots too.
        for k in 1..30 {
            let knot = curve.from_mm + f64::from(k) * curve.knot_mm;
            let [before, after] = [-1e-9, 1e-9].map(|off| curve.at(knot + off));
            for (a, b) in before.iter().zip(&after) {
                assert!((a - b).norm() < 1e-7, "{k}");
            }
        }
    }

    #[test]
    fn beyond_its_ends_it_is_straight_and_sections_may_be_displaced() {
        let curve = helix();
        let [end, along, bend, _] = curve.at(-40.0);
        let [begin, straight, ..] = curve.at(-20.0);
        assert!((end - begin + straight * 20.0).norm() < 1e-8);
        assert!((along - straight).norm() < 1e-9 && bend.norm() < 1e-9);
        let moved = |s: f64| {
            let [a, b] = [Vec3::new(0.02, 0.0, 0.1), Vec3::new(0.001, -0.002, 0.0)];
            [a * s + b * (s * s), a + b * (2.0 * s), b * 2.0, Vec3::zeros()]
        };
        let s = 40.0;
        let [c, c1, ..] = curve.at(s);
        let rho = c1.cross(&Vec3::z()).normalize() * 2.0;
        let [w, w1, ..] = moved(s);
        let x = c + rho + w - c1 * w1.dot(&rho);
        assert!((curve.material(&x, 43.0, moved) - c - rho).norm() < 1e-9);
    }
}
