//! A run of a centre line as a smooth curve, and the cross-section of it in which a point lies.
//!
//! Through the rows, no closer than a radius, goes the natural cubic spline c(s) over the polyline's arc length. The
//! place s of a point X is where the curve's normal plane contains it,
//!
//! ```text
//! g(s) = c′(s)·(X − c(s)) = 0,    D = |c′|² − c″·(X − c),    ∇s = c′/D
//! ∇∇s = (c″ c′ᵀ + c′ c″ᵀ)/D² − (3 c′·c″ − c‴·(X − c)) c′ c′ᵀ/D³
//! ```
//!
//! which has one solution near the curve, within its radius of curvature. Where sections are displaced by w(s), that
//! of a point x in space is at g(s) = c′·(x − w(s) − c(s)) = 0.

use nalgebra::Matrix3;

use crate::Vec3;
use crate::products::outer;

/// A cubic polynomial from a place on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) from_mm: f64,
    /// Of powers 0 to 3 of the distance from there.
    pub(super) powers: [Vec3; 4],
}

impl Piece {
    /// Value and derivatives, the third included.
    #[inline]
    pub(super) fn at(&self, s_mm: f64) -> [Vec3; 4] {
        let t = s_mm - self.from_mm;
        let [a, b, c, d] = &self.powers;
        [
            a + (b + (c + d * t) * t) * t,
            b + (c * 2.0 + d * (3.0 * t)) * t,
            c * 2.0 + d * (6.0 * t),
            d * 6.0,
        ]
    }
}

/// A smooth curve; beyond its ends it goes on straight.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    pieces: Vec<Piece>,
}

/// Most steps of Newton's method on a place.
const MOST: usize = 20;
/// Steps below this, mm, are rounding.
const ROUNDING_MM: f64 = 1e-12;
/// The least of D: farther inside a bend than its centre sections have crossed.
const LEAST_D: f64 = 0.1;

impl Curve {
    /// The curve through these points at these arc lengths, those closer than their radius left out.
    pub(super) fn new(points: &[Vec3], arcs_mm: &[f64], radii_mm: &[f64]) -> Self {
        let last = points.len() - 1;
        let mut kept = vec![0];
        for k in 1..last {
            let before = kept[kept.len() - 1];
            if arcs_mm[k] - arcs_mm[before] >= radii_mm[k] && arcs_mm[last] - arcs_mm[k] >= radii_mm[k] {
                kept.push(k);
            }
        }
        kept.push(last);
        let at: Vec<(f64, Vec3)> = kept.iter().map(|k| (arcs_mm[*k], points[*k])).collect();
        let bends = natural(&at);
        let mut pieces = Vec::with_capacity(at.len() + 1);
        for (k, pair) in at.windows(2).enumerate() {
            let h = pair[1].0 - pair[0].0;
            let slope = (pair[1].1 - pair[0].1) / h - (bends[k] * 2.0 + bends[k + 1]) * (h / 6.0);
            let powers = [pair[0].1, slope, bends[k] * 0.5, (bends[k + 1] - bends[k]) / (6.0 * h)];
            pieces.push(Piece { from_mm: pair[0].0, powers });
        }
        // Straight on at both ends.
        let first = pieces[0];
        let (end_mm, end) = at[at.len() - 1];
        let along = pieces[pieces.len() - 1].at(end_mm)[1];
        let straight = |from_mm: f64, place: Vec3, along: Vec3| Piece {
            from_mm,
            powers: [place, along, Vec3::zeros(), Vec3::zeros()],
        };
        pieces.push(straight(end_mm, end, along));
        pieces.insert(0, straight(first.from_mm, first.powers[0], first.powers[1]));
        Self { pieces }
    }

    /// The number of the piece at a place.
    pub(super) fn piece(&self, s_mm: f64) -> u32 {
        self.pieces[1..].partition_point(|piece| piece.from_mm <= s_mm) as u32
    }

    /// c and its derivatives, searched from a piece on, which then is that of the place.
    #[inline]
    pub(super) fn at(&self, s_mm: f64, piece: &mut u32) -> [Vec3; 4] {
        let mut k = *piece as usize;
        while k + 1 < self.pieces.len() && self.pieces[k + 1].from_mm <= s_mm {
            k += 1;
        }
        while k > 0 && self.pieces[k].from_mm > s_mm {
            k -= 1;
        }
        *piece = k as u32;
        self.pieces[k].at(s_mm)
    }

    /// s of a point x in space, from a guess with its piece, where sections are displaced by `w`, given with its slope.
    #[inline]
    pub(super) fn place(&self, x: &Vec3, guess: (f64, &mut u32), w: impl Fn(f64) -> (Vec3, Vec3)) -> f64 {
        let (mut s, piece) = guess;
        for _ in 0..MOST {
            let [c, c1, c2, _] = self.at(s, piece);
            let (by, slope) = w(s);
            let off = x - by - c;
            let d = (c1.dot(&(c1 + slope)) - c2.dot(&off)).max(LEAST_D);
            let step = c1.dot(&off) / d;
            s += step;
            if step.abs() <= ROUNDING_MM {
                break;
            }
        }
        s
    }

    /// ∇s and ∇∇s at a point whose place is s.
    #[inline]
    pub(super) fn derivatives(&self, x: &Vec3, s_mm: f64, mut piece: u32) -> (Vec3, Matrix3<f64>) {
        let [c, c1, c2, c3] = self.at(s_mm, &mut piece);
        let off = x - c;
        let own = c1.norm_squared() - c2.dot(&off);
        let d = own.max(LEAST_D);
        let mixed = outer(&c2, &c1);
        let third = 3.0 * c1.dot(&c2) - c3.dot(&off);
        (c1 / d, (mixed + mixed.transpose()) / (d * d) - outer(&c1, &c1) * (third / (d * d * d)))
    }
}

/// Second derivatives of the natural cubic spline through points at these places.
fn natural(at: &[(f64, Vec3)]) -> Vec<Vec3> {
    let n = at.len();
    let mut bends = vec![Vec3::zeros(); n];
    // Thomas's algorithm.
    let mut upper = vec![0.0; n];
    for k in 1..n - 1 {
        let (before, after) = (at[k].0 - at[k - 1].0, at[k + 1].0 - at[k].0);
        let right = ((at[k + 1].1 - at[k].1) / after - (at[k].1 - at[k - 1].1) / before) * 6.0;
        let pivot = 2.0 * (before + after) - before * upper[k - 1];
        upper[k] = after / pivot;
        bends[k] = (right - bends[k - 1] * before) / pivot;
    }
    for k in (1..n - 1).rev() {
        let next = bends[k + 1];
        bends[k] -= next * upper[k];
    }
    bends
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
        let still = |_: f64| (Vec3::zeros(), Vec3::zeros());
        let h = 1e-5;
        for k in 0..30 {
            let s = 10.0 + 3.1 * f64::from(k);
            let [c, c1, ..] = curve.at(s, &mut 0);
            let across = c1.cross(&Vec3::new(0.3, f64::from(k).sin(), 1.0)).normalize();
            let x = c + across * 3.0;
            assert!((curve.place(&x, (s + 2.0, &mut 0), still) - s).abs() < 1e-10);
            let (slope, bend) = curve.derivatives(&x, s, 0);
            for axis in 0..3 {
                let [more, less] = [h, -h].map(|h| {
                    let there = x + Vec3::ith(axis, h);
                    let s = curve.place(&there, (s, &mut 3), still);
                    (s, curve.derivatives(&there, s, 9).0)
                });
                assert!(((more.0 - less.0) / (2.0 * h) - slope[axis]).abs() < 1e-8);
                let differs = (more.1 - less.1) / (2.0 * h) - bend.column(axis);
                assert!(differs.norm() < 1e-6, "{differs}");
            }
        }
    }

    #[test]
    fn beyond_its_ends_it_is_straight_and_sections_may_be_displaced() {
        let curve = helix();
        let [end, along, ..] = curve.at(-5.0, &mut 7);
        let [begin, slope, bend, _] = curve.at(-1e-9, &mut 1);
        assert!((end - begin + slope * 5.0).norm() < 1e-6 && (along - slope).norm() < 1e-12 && bend.norm() == 0.0);
        let moved = |s: f64| (Vec3::new(0.02 * s, 0.0, 0.1 * s), Vec3::new(0.02, 0.0, 0.1));
        let s = 40.0;
        let [c, c1, ..] = curve.at(s, &mut 0);
        let x = c + c1.cross(&Vec3::z()).normalize() + moved(s).0;
        assert!((curve.place(&x, (43.0, &mut 0), moved) - s).abs() < 1e-9);
    }
}
