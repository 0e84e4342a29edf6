//! The element's Hessian from its four rotation invariants.
//!
//! The energy of an element does not change when the element is rotated, so with unit tangents bending and stretch
//! depend on chord e and end tangents t₀, t₁ through g = (e·e, e·t₀, e·t₁, t₀·t₁) alone. At a Gauss point y·y, y·z
//! and z·z are linear in g with constant weights ([`GRAMS`]), and so is |r′(½)|² ([`MIDDLE`]). With V(g) the
//! Lagrangian of the element the Hessian is
//!
//!   Σ V_ij ∇gᵢ ∇gⱼᵀ + Σ V_i ∇²gᵢ,
//!
//! so Gauss points add to ten scalars V_ij and four V_i, and vectors enter once. (Terms beyond the straight element's
//! cancel to rounding of EI/h, the size of the entries. The gradient is not computed this way, because its forces
//! must not lose digits to cancellation.)
//!
//! V = f S + N c + ½γ(c − c₀)²: S is the bending energy at unit speed, f = arc · mean the factors explained in
//! [`super::element`], c the elongation with its axial force, and the last term the augmentation of
//! [`super::assembly`], of which only γ∇c∇cᵀ counts.

use super::bending::Partials;
use super::lanes::Lanes;
use super::quadrature::{GAUSS, Point};
use pulp::Simd;

/// Weights of g in y·y, y·z and z·z at one point. (Tangents have length 1: their squares are constant.)
#[derive(Debug, Clone, Copy)]
struct Gram {
    yy: [f64; 4],
    yz: [f64; 4],
    zz: [f64; 4],
}

impl Gram {
    const fn at(point: &Point) -> Self {
        Self {
            yy: Self::product(&point.y, &point.y),
            yz: Self::product(&point.y, &point.z),
            zz: Self::product(&point.z, &point.z),
        }
    }

    const fn product(a: &[f64; 3], b: &[f64; 3]) -> [f64; 4] {
        [a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[0] * b[2] + a[2] * b[0], a[1] * b[2] + a[2] * b[1]]
    }
}

const GRAMS: [Gram; 3] = [Gram::at(&GAUSS[0]), Gram::at(&GAUSS[1]), Gram::at(&GAUSS[2])];

/// Weights of g in |r′(½)|² = |3/2 e − ¼(t₀ + t₁)|².
const MIDDLE: [f64; 4] = [2.25, -0.75, -0.75, 0.125];

/// First derivatives of a function of g, and the upper triangle of its second derivatives.
#[derive(Clone, Copy)]
pub(super) struct Derivatives<S: Simd> {
    /// By gᵢ.
    pub(super) first: [Lanes<S>; 4],
    /// By gᵢ and gⱼ, i ≤ j; the other entries are unused.
    pub(super) second: [[Lanes<S>; 4]; 4],
}

/// Factors of the bending energy at unit speed, and the terms added to it.
#[derive(Clone, Copy)]
pub(super) struct Factors<S: Simd> {
    /// Bending energy at unit speed.
    pub(super) stored: Lanes<S>,
    /// Arc factor with its first and second derivative in t₀·t₁.
    pub(super) arc: (Lanes<S>, Lanes<S>, f64),
    /// Mean of |r′|.
    pub(super) mean: Lanes<S>,
    /// 1/|r′(½)|.
    pub(super) slow: Lanes<S>,
    /// Length h.
    pub(super) length: Lanes<S>,
    /// Axial force.
    pub(super) tension: Lanes<S>,
    /// γ of the augmentation.
    pub(super) gamma: Lanes<S>,
}

impl<S: Simd> Derivatives<S> {
    /// All zero.
    #[inline(always)]
    pub(super) fn zeros(simd: S) -> Self {
        let zero = Lanes::splat(simd, 0.0);
        Self { first: [zero; 4], second: [[zero; 4]; 4] }
    }

    /// Adds the bending density of Gauss point `k` times `scale`.
    #[inline(always)]
    pub(super) fn add_point(&mut self, k: usize, scale: Lanes<S>, f: &Partials<S>) {
        let w = &GRAMS[k];
        let (a, b, c) = (f.a * scale, f.b * scale, f.c * scale);
        let (aa, ab, ac, bb) = (f.aa * scale, f.ab * scale, f.ac * scale, f.bb * scale);
        for i in 0..4 {
            self.first[i] += a * w.yy[i] + b * w.yz[i] + c * w.zz[i];
            let by_yy = aa * w.yy[i] + ab * w.yz[i] + ac * w.zz[i];
            let by_yz = ab * w.yy[i] + bb * w.yz[i];
            let by_zz = ac * w.yy[i];
            for j in i..4 {
                self.second[i][j] += by_yy * w.yy[j] + by_yz * w.yz[j] + by_zz * w.zz[j];
            }
        }
    }

    /// Turns derivatives of the bending energy at unit speed into those of the whole Lagrangian.
    #[inline(always)]
    pub(super) fn complete(&self, f: &Factors<S>) -> Self {
        let (arc, slope, curve) = f.arc;
        // d|r′(½)| / d|r′(½)|² times ⅔, which mean speed (⅓ + ⅔|r′(½)|) and elongation (⅔h(|r′(½)| − 1)) share.
        let rate = f.slow * (1.0 / 3.0);
        let force = arc * f.stored + f.length * f.tension;
        let bend = rate * -0.5 * (f.slow * f.slow) * force + f.gamma * (f.length * rate) * (f.length * rate);
        let along = slope * rate * f.stored;
        let factor = arc * f.mean;
        let stretched = arc * rate;
        let mut by = [stretched; 4];
        for i in 0..4 {
            by[i] = stretched * MIDDLE[i];
        }
        by[3] += slope * f.mean;
        let mut out = *self;
        for i in 0..4 {
            out.first[i] = self.first[i] * factor + force * rate * MIDDLE[i];
            for j in i..4 {
                out.second[i][j] = self.second[i][j] * factor
                    + self.first[i] * by[j]
                    + by[i] * self.first[j]
                    + bend * (MIDDLE[i] * MIDDLE[j]);
            }
            out.second[i][3] += along * MIDDLE[i];
        }
        out.first[3] += slope * f.mean * f.stored;
        out.second[3][3] += along * MIDDLE[3] + f.mean * curve * f.stored;
        out
    }
}
