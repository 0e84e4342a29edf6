//! Cubic Hermite interpolation of the centre line and the three-point Gauss rule.
//!
//! On an element of length h with end tangents t₀, t₁ and chord e = (x₁ − x₀)/h,
//!
//!   y = r′   = 6ξ(1−ξ) e + (1−4ξ+3ξ²) t₀ + (3ξ²−2ξ) t₁,
//!   z = h r″ = 6(1−2ξ) e + (6ξ−4) t₀ + (6ξ−2) t₁,
//!
//! both independent of the unit of length: energies of an element depend on h only through EI/h and GJ/h.

use std::ops::{Add, Mul};

/// Weights of (e, t₀, t₁) in y and z, and of (θ₀, θ₁, b) in the angle, at one point of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    /// Position in the element, 0 to 1.
    pub(crate) xi: f64,
    /// Quadrature weight; the weights sum to 1.
    pub(crate) weight: f64,
    /// Weights in y = r′.
    pub(crate) y: [f64; 3],
    /// Weights in z = h r″.
    pub(crate) z: [f64; 3],
    /// Weights of (θ₀, θ₁, b) in the angle φ.
    pub(crate) phi: [f64; 3],
    /// Weights of (θ₀, θ₁, b) in h φ′.
    pub(crate) dphi: [f64; 3],
}

impl Point {
    /// The weights at `xi`.
    #[inline]
    pub(crate) const fn at(xi: f64, weight: f64) -> Self {
        Self {
            xi,
            weight,
            y: [6.0 * xi * (1.0 - xi), 1.0 - 4.0 * xi + 3.0 * xi * xi, 3.0 * xi * xi - 2.0 * xi],
            z: [6.0 * (1.0 - 2.0 * xi), 6.0 * xi - 4.0, 6.0 * xi - 2.0],
            phi: [1.0 - xi, xi, 4.0 * xi * (1.0 - xi)],
            dphi: [-1.0, 1.0, 4.0 * (1.0 - 2.0 * xi)],
        }
    }

    /// y and z for the given chord and tangents.
    #[inline(always)]
    pub(crate) fn derivatives<V>(&self, e: V, t0: V, t1: V) -> (V, V)
    where
        V: Copy + Add<Output = V> + Mul<f64, Output = V>,
    {
        (e * self.y[0] + t0 * self.y[1] + t1 * self.y[2], e * self.z[0] + t0 * self.z[1] + t1 * self.z[2])
    }
}

/// Distance of the outer Gauss points from the middle, ½√(3/5).
const OUTER: f64 = 0.387_298_334_620_741_7;

/// The three-point Gauss rule on [0, 1], exact for polynomials of degree 5: one more than the squared curvature of an
/// initially straight element needs, and enough for order 4 where the element is strongly bent.
pub(crate) const GAUSS: [Point; 3] =
    [Point::at(0.5 - OUTER, 5.0 / 18.0), Point::at(0.5, 8.0 / 18.0), Point::at(0.5 + OUTER, 5.0 / 18.0)];

/// Weights of (x₀, h t₀, x₁, h t₁) in the centre line at ξ.
#[inline]
pub(crate) fn hermite(xi: f64) -> [f64; 4] {
    let (a, b) = (xi, 1.0 - xi);
    [b * b * (1.0 + 2.0 * a), a * b * b, a * a * (1.0 + 2.0 * b), -a * a * b]
}

/// The largest of ξ (1 − ξ)².
const BULGE: f64 = 4.0 / 27.0;

/// Upper bound of the motion, mm, of any point of an element of length h whose nodes move by |Δx| and whose tangents
/// change by |Δt|. By [`hermite`] a point is a mean of the nodes plus a part of the tangents, so it moves by at most
///
/// ```text
/// max |Δxₖ| + 4/27 h (|Δt₀| + |Δt₁|),    ξ (1 − ξ)² ≤ 4/27
/// ```
pub(crate) fn largest_motion(length_mm: f64, [(x0, t0), (x1, t1)]: [(f64, f64); 2]) -> f64 {
    x0.max(x1) + BULGE * length_mm * (t0 + t1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_point_moves_by_more_than_is_said_and_one_moves_by_as_much() {
        let h = 2.0;
        let moved = |xi: f64, [(x0, t0), (x1, t1)]: [(f64, f64); 2]| {
            let [a, b, c, d] = hermite(xi);
            (a * x0 + b * h * t0 + c * x1 + d * h * t1).abs()
        };
        let largest = |by| (0..=300).map(|k| moved(f64::from(k) / 300.0, by)).fold(0.0, f64::max);
        for by in [[(0.3, 0.5), (0.1, -0.2)], [(0.0, 1.0), (0.0, -1.0)], [(-0.4, 0.0), (0.2, 0.3)]] {
            let sizes = by.map(|(x, t): (f64, f64)| (x.abs(), t.abs()));
            assert!(largest(by) <= largest_motion(h, sizes), "{by:?}");
        }
        let alone = [(0.0, 1.0), (0.0, 0.0)];
        assert!((largest(alone) / largest_motion(h, alone) - 1.0).abs() < 1e-4);
    }
}
