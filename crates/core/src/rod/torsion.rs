//! Twist and rest curvature at one Gauss point, in the frame of the element's first node.
//!
//! Components of y and z are taken along the first node's triad (t₀, u₀, v₀), so t₀ = (1, 0, 0). The
//! reference triad at the point is the first node's, carried by the smallest rotation to the tangent y/|y| (Meier,
//! Popp and Wall 2015, sec. 3.4); the material triad is turned against it by the angle φ. Then, with A = y·y, a = √A,
//! G = 1/(A + a y₁) and D = y₂z₃ − y₃z₂,
//!
//!   twist                  h τ = h φ′ − D G,
//!   curvature along w      h κ_w = t′·w, w carried = (z·w)/a − (y·w) G (z₁ + y·z/a)   for w = (0, w₂, w₃).
//!
//! The energy of the isotropic cross-section, ½EI|t′ − κ⁰|² + ½GJ(τ − τ⁰)², is the bending energy of the straight rod
//! plus −EI κ⁰·t′ + ½EI|κ⁰|² + ½GJ(τ − τ⁰)², κ⁰ = k₁d₁ + k₂d₂; this file computes the addition.

use super::lanes::{Lanes, Matrix, Vector};
use pulp::Simd;

/// Stiffness and rest state of an instrument at one Gauss point, in the element's units.
#[derive(Clone, Copy)]
pub(super) struct TorsionInput<S: Simd> {
    /// Quadrature weight × EI, times the rest curvature components along d₁ and d₂.
    pub(super) moment: [Lanes<S>; 2],
    /// Quadrature weight × GJ/h.
    pub(super) stiffness: Lanes<S>,
    /// h τ⁰.
    pub(super) rest_twist: Lanes<S>,
}

/// The part common to all instruments at a Gauss point: the twist −DG of the reference triad with its derivatives in
/// y and z.
#[derive(Clone, Copy)]
pub(super) struct ReferenceTwist<S: Simd> {
    y: Vector<S>,
    z: Vector<S>,
    /// 1/a and y·z.
    ia: Lanes<S>,
    b: Lanes<S>,
    /// G with its derivatives in y.
    g: Lanes<S>,
    dg: Vector<S>,
    hg: Matrix<S>,
    /// −DG.
    value: Lanes<S>,
    /// Gradient of −DG in y.
    pub(super) along_y: Vector<S>,
    /// Gradient of −DG in z.
    pub(super) along_z: Vector<S>,
    /// Its second derivatives in y, y.
    yy: Matrix<S>,
    /// Its second derivatives in y (rows), z (columns).
    yz: Matrix<S>,
}

/// Derivatives in y and z. The second derivative in z vanishes: both twist and curvature are linear in z, and the
/// square of the twist is added in chord and far tangent.
#[derive(Clone, Copy)]
pub(super) struct PointDerivatives<S: Simd> {
    /// Gradient in y.
    pub(super) gy: Vector<S>,
    /// Gradient in z.
    pub(super) gz: Vector<S>,
    /// y, y.
    pub(super) hyy: Matrix<S>,
    /// y (rows), z (columns).
    pub(super) hyz: Matrix<S>,
}

/// Derivatives of an instrument's energy in φ, alone and mixed with y and z; those in hφ′ are the torque, GJ, and GJ times the gradients of
/// the [`ReferenceTwist`].
#[derive(Clone, Copy)]
pub(super) struct AngleDensity<S: Simd> {
    /// In φ.
    pub(super) first: Lanes<S>,
    /// In φ twice.
    pub(super) second: Lanes<S>,
    /// In y and φ.
    pub(super) along_y: Vector<S>,
    /// In z and φ.
    pub(super) along_z: Vector<S>,
}

/// The part common to all instruments at a Gauss point, for energies without derivatives.
#[derive(Clone, Copy)]
pub(super) struct TwistValue<S: Simd> {
    y: Vector<S>,
    z: Vector<S>,
    /// a and G.
    a: Lanes<S>,
    g: Lanes<S>,
    /// DG.
    twist: Lanes<S>,
}

impl<S: Simd> TwistValue<S> {
    /// Evaluated at y and z.
    #[inline(always)]
    pub(super) fn new(y: Vector<S>, z: Vector<S>) -> Self {
        let a = y.norm();
        let g = (a * (a + y.x)).inverse();
        Self { y, z, a, g, twist: (y.y * z.z - y.z * z.y) * g }
    }

    /// The twist energy of an instrument.
    #[inline(always)]
    pub(super) fn twist_energy(&self, dphi: Lanes<S>, p: &TorsionInput<S>) -> Lanes<S> {
        let tau = dphi - self.twist - p.rest_twist;
        p.stiffness * 0.5 * tau * tau
    }

    /// The energy of its rest curvature.
    #[inline(always)]
    pub(super) fn rest_curvature_energy(&self, phi: Lanes<S>, p: &TorsionInput<S>) -> Lanes<S> {
        let Self { y, z, a, g, .. } = *self;
        let (sin, cos) = phi.sin_cos();
        let w2 = p.moment[0] * cos - p.moment[1] * sin;
        let w3 = p.moment[0] * sin + p.moment[1] * cos;
        let m = z.y * w2 + z.z * w3;
        let n = y.y * w2 + y.z * w3;
        n * g * (z.x + y.dot(z) / a) - m / a
    }
}

impl<S: Simd> PointDerivatives<S> {
    /// All zero.
    #[inline(always)]
    pub(super) fn zeros(simd: S) -> Self {
        let (vector, matrix) = (Vector::splat(simd, [0.0; 3]), Matrix::zeros(simd));
        Self { gy: vector, gz: vector, hyy: matrix, hyz: matrix }
    }
}

impl<S: Simd> ReferenceTwist<S> {
    /// Evaluated at y and z. Without a Hessian the compiler removes that half.
    #[inline(always)]
    pub(super) fn new(y: Vector<S>, z: Vector<S>) -> Self {
        let a = y.norm();
        let zero = a.like(0.0);
        let ia = a.inverse();
        let ia3 = ia * ia * ia;
        let g = ia / (a + y.x);
        let e1 = Vector::new(a.like(1.0), zero, zero);

        // G: 1/G = A + a y₁, its gradient is `slope`.
        let mut slope = y * (y.x * ia + 2.0);
        slope.x += a;
        let bend_slope =
            (e1.outer(y).with_transpose() * ia).with_diagonal(y.x * ia + 2.0) - y.outer(y) * (y.x * ia3);
        let dg = slope * (-g * g);
        let hg = slope.outer(slope) * (g * 2.0 * g * g) - bend_slope * (g * g);

        let d = y.y * z.z - y.z * z.y;
        let dy = Vector::new(zero, z.z, -z.y);
        let dz = Vector::new(zero, -y.z, y.y);
        let mut yz = -dg.outer(dz);
        yz.y.z -= g;
        yz.z.y += g;
        Self {
            y,
            z,
            ia,
            b: y.dot(z),
            g,
            dg,
            hg,
            value: -(d * g),
            along_y: -(dy * g + dg * d),
            along_z: -dz * g,
            yy: -(dy.outer(dg).with_transpose() + hg * d),
            yz,
        }
    }

    /// The torque of an instrument at the point.
    #[inline(always)]
    pub(super) fn torque(&self, dphi: Lanes<S>, p: &TorsionInput<S>) -> Lanes<S> {
        p.stiffness * self.tau(dphi, p)
    }

    /// The twist energy of an instrument.
    #[inline(always)]
    pub(super) fn energy(&self, dphi: Lanes<S>, p: &TorsionInput<S>) -> Lanes<S> {
        self.torque(dphi, p) * 0.5 * self.tau(dphi, p)
    }

    #[inline(always)]
    fn tau(&self, dphi: Lanes<S>, p: &TorsionInput<S>) -> Lanes<S> {
        dphi + self.value - p.rest_twist
    }

    /// Adds the torque times the derivatives of the twist.
    #[inline(always)]
    pub(super) fn add_twist(&self, torque: Lanes<S>, to: &mut PointDerivatives<S>) {
        to.gy += self.along_y * torque;
        to.gz += self.along_z * torque;
        to.hyy += self.yy * torque;
        to.hyz += self.yz * torque;
    }

    /// P = (z·w)/a − (y·w) G q with q = z₁ + b/a: (z·w, y·w, P) and its gradients in y and z.
    #[inline(always)]
    fn curvature(&self, w: Vector<S>, q: Lanes<S>, gq: Vector<S>, lift: Vector<S>) -> Curvature<S> {
        let Self { y, z, ia, g, .. } = *self;
        let ia3 = ia * ia * ia;
        let (m, n) = (z.dot(w), y.dot(w));
        let value = m * ia - n * g * q;
        let along_z = w * ia - lift * (n * g);
        let along_y = -y * (ia3 * m) - w * (g * q) - gq * n;
        Curvature { m, n, value, along_y, along_z }
    }

    /// Adds the derivatives of an instrument's rest curvature energy, −P, and returns −P with its derivatives in φ.
    #[inline(always)]
    pub(super) fn add_rest_curvature(
        &self,
        phi: Lanes<S>,
        moment: [Lanes<S>; 2],
        to: &mut PointDerivatives<S>,
    ) -> (Lanes<S>, AngleDensity<S>) {
        let Self { y, z, ia, b, g, dg, hg, .. } = *self;
        let ia3 = ia * ia * ia;
        let zero = ia.like(0.0);
        let yy = y.outer(y);
        let (sin, cos) = phi.sin_cos();
        let w = Vector::new(zero, moment[0] * cos - moment[1] * sin, moment[0] * sin + moment[1] * cos);
        let wp = Vector::new(zero, -w.z, w.y);
        let q = z.x + b * ia;
        let dq = z * ia - y * (ia3 * b);
        let mut lift = y * ia;
        lift.x += ia.like(1.0);
        let gq = dg * q + dq * g;
        let Curvature { m, n, value, along_y, along_z } = self.curvature(w, q, gq, lift);
        let turned = self.curvature(wp, q, gq, lift);
        to.gy -= along_y;
        to.gz -= along_z;
        let hq = y.outer(z).with_transpose().with_diagonal(b) * (-ia3) + yy * (ia3 * 3.0 * ia * ia * b);
        to.hyy += (yy * (ia3 * -3.0 * ia * ia)).with_diagonal(ia3) * m
            + w.outer(gq).with_transpose()
            + (hg * q + dg.outer(dq).with_transpose() + hq * g) * n;
        // Rows y, columns z.
        to.hyz += y.outer(w) * ia3 + (w * g + dg * n).outer(lift) + (yy * (-ia3)).with_diagonal(ia) * (n * g);
        let (along_y, along_z) = (-turned.along_y, -turned.along_z);
        (-value, AngleDensity { first: -turned.value, second: value, along_y, along_z })
    }
}

/// P along a w, with z·w and y·w, and its gradients.
#[derive(Clone, Copy)]
struct Curvature<S: Simd> {
    m: Lanes<S>,
    n: Lanes<S>,
    value: Lanes<S>,
    along_y: Vector<S>,
    along_z: Vector<S>,
}
