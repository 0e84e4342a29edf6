//! The circle that fits the wall around a section.
//!
//! About a place c of an axis with direction t, vertices of the wall are at heights z along it, directions u across
//! it and distances ρ from it. With e = ρ − r
//!
//! ```text
//! e ≈ a₀ + a₁z + a₂z² + (b₀ + b₁z + b₂z²)·u + A : uuᵀ
//! ```
//!
//! by least squares: a₀ corrects the radius, b₀ the place, b₁ the direction; 2 b₂ is the axis's curvature. The
//! traceless A is an elliptic section, which must not be taken for one that is off centre where vertices are uneven.

use std::f64::consts::FRAC_PI_4;

use nalgebra::{SMatrix, SVector};

use crate::Vec3;
use crate::vessel::any_perpendicular;

/// Number of coefficients.
const TERMS: usize = 11;
/// Regularisation, relative to the diagonal.
const REGULAR: f64 = 1e-12;

/// A vertex of the wall seen from a section.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    /// Height along the axis, in radii.
    pub(super) height: f64,
    /// Cosine and sine of its direction.
    pub(super) towards: [f64; 2],
    /// Distance from the axis less the radius, in radii.
    pub(super) excess: f64,
}

/// What a section is off, in radii.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub(super) wider: f64,
    /// Along the directions of cosine and sine: shift, slope and half the curvature of the axis.
    pub(super) shift: [f64; 2],
    pub(super) slope: [f64; 2],
    pub(super) bend: [f64; 2],
}

/// The fit of spots within a height, in radii; `None` unless they are all around on both sides of the section.
pub(super) fn fitted(spots: impl Iterator<Item = Spot>, highest: f64) -> Option<Fit> {
    let mut matrix = SMatrix::<f64, TERMS, TERMS>::zeros();
    let mut right = SVector::<f64, TERMS>::zeros();
    let mut seen = 0_u32;
    for spot in spots {
        let (z, [c, s]) = (spot.height, spot.towards);
        let part = z / highest;
        if part.abs() >= 1.0 {
            continue;
        }
        let octant = ((libm::atan2(s, c) / FRAC_PI_4).floor() as i32).rem_euclid(8);
        seen |= 1 << (octant + if z > 0.0 { 8 } else { 0 });
        let g = 1.0 - part * part;
        let (zz, weight) = (z * z, g * g * g);
        let row: [f64; TERMS] = [1.0, z, zz, c, z * c, zz * c, s, z * s, zz * s, c * c - s * s, 2.0 * c * s];
        for (k, term) in row.iter().enumerate() {
            let part = term * weight;
            right[k] += part * spot.excess;
            // The factorisation reads the lower triangle.
            row[..=k].iter().enumerate().for_each(|(l, other)| matrix[(k, l)] += part * other);
        }
    }
    if seen != 0xffff {
        return None;
    }
    for k in 0..TERMS {
        matrix[(k, k)] *= 1.0 + REGULAR;
    }
    let found = matrix.cholesky()?.solve(&right);
    let pair = |k: usize| [found[k], found[k + 3]];
    found.iter().all(|x| x.is_finite()).then(|| Fit {
        wider: found[0],
        shift: pair(3),
        slope: pair(4),
        bend: pair(5),
    })
}

/// Two directions across a third.
pub(super) fn across(along: &Vec3) -> [Vec3; 2] {
    let e = any_perpendicular(along);
    [e, along.cross(&e)]
}

/// Σ of two directions with these parts.
pub(super) fn combined(directions: &[Vec3; 2], parts: [f64; 2]) -> Vec3 {
    directions[0] * parts[0] + directions[1] * parts[1]
}
