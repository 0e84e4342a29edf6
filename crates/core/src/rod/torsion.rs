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
//!
//! A cross-section that is stiffer in one plane has ½(κ − κ⁰)ᵀB(κ − κ⁰) with κ = (κ₁, κ₂), κᵢ = t′·dᵢ, and a symmetric B
//! (Antman, Nonlinear Problems of Elasticity, 2005, ch. VIII; Bergou et al., Discrete Elastic Rods, 2008, sec. 4). With
//! B = EI + (p c; c q), EI the stiffness in the plane in which it bends most easily, the isotropic part is as above, the moment of
//! the rest curvature is Bκ⁰ in place of EI κ⁰, and what is left, never negative, is
//!
//! ```text
//! N = ½pκ₁² + ½qκ₂² + cκ₁κ₂ = ½(n₁κ₁ + n₂κ₂),  n₁ = pκ₁ + cκ₂,  n₂ = cκ₁ + qκ₂
//! ∇N = n₁∇κ₁ + n₂∇κ₂,   ∇²N = n₁∇²κ₁ + n₂∇²κ₂ + p∇κ₁∇κ₁ᵀ + q∇κ₂∇κ₂ᵀ + c(∇κ₁∇κ₂ᵀ + ∇κ₂∇κ₁ᵀ)
//! ```
//!
//! in y and z. Turning d₁ and d₂ by φ has ∂κ₁ = κ₂, ∂κ₂ = −κ₁: hence ∂N = n₁κ₂ − n₂κ₁, ∂²N = pκ₂² + qκ₁² − 2cκ₁κ₂ − 2N, and
//! ∂∇N = (pκ₂ − qκ₂ − 2cκ₁)∇κ₁ + (pκ₁ − qκ₁ + 2cκ₂)∇κ₂: it is this that couples bending to twist even where nothing is bent at
//! rest. N takes κ per length of the rod and not of the curve, as the rest curvature's term does, and without the arc factor: that
//! changes the element's error at order 4, and not its order.

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
/// squares of the twist and of skew curvatures are added in chord and far tangent.
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

    /// The energy of its skew stiffness, times this weight.
    #[inline(always)]
    pub(super) fn skew_energy(&self, phi: Lanes<S>, [p, q, c]: [Lanes<S>; 3]) -> Lanes<S> {
        let Self { y, z, a, g, .. } = *self;
        let (sin, cos) = phi.sin_cos();
        let lift = g * (z.x + y.dot(z) / a);
        let along = |v: Lanes<S>, w: Lanes<S>| (z.y * v + z.z * w) / a - (y.y * v + y.z * w) * lift;
        let (first, second) = (along(cos, sin), along(-sin, cos));
        (p * first * first + q * second * second + c * (first * 2.0 * second)) * 0.5
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
    fn curvature(&self, w: Vector<S>, of: &Lift<S>) -> Curvature<S> {
        let Self { y, z, ia, g, .. } = *self;
        let Lift { q, gq, lift, .. } = *of;
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
        let zero = self.ia.like(0.0);
        let (sin, cos) = phi.sin_cos();
        let w = Vector::new(zero, moment[0] * cos - moment[1] * sin, moment[0] * sin + moment[1] * cos);
        let wp = Vector::new(zero, -w.z, w.y);
        let lift = self.lift();
        let along = self.curvature(w, &lift);
        let turned = self.curvature(wp, &lift);
        self.take(w, &along, &lift, to);
        let (along_y, along_z) = (-turned.along_y, -turned.along_z);
        (-along.value, AngleDensity { first: -turned.value, second: along.value, along_y, along_z })
    }

    /// Adds the derivatives of the energy N of a skew stiffness, with its weight, but for the products of the gradients of
    /// κ₁ and κ₂, which it returns; and returns N with its derivatives in φ.
    #[inline(always)]
    pub(super) fn add_skew(
        &self,
        phi: Lanes<S>,
        [p, q, c]: [Lanes<S>; 3],
        to: &mut PointDerivatives<S>,
    ) -> (Lanes<S>, AngleDensity<S>, [Slope<S>; 2]) {
        let zero = self.ia.like(0.0);
        let (sin, cos) = phi.sin_cos();
        let (d1, d2) = (Vector::new(zero, cos, sin), Vector::new(zero, -sin, cos));
        let lift = self.lift();
        let (one, two) = (self.curvature(d1, &lift), self.curvature(d2, &lift));
        let (k1, k2) = (one.value, two.value);
        let (n1, n2) = (p * k1 + c * k2, c * k1 + q * k2);
        let w = -(d1 * n1 + d2 * n2);
        let along = self.curvature(w, &lift);
        self.take(w, &along, &lift, to);
        let value = (n1 * k1 + n2 * k2) * 0.5;
        let (by1, by2) = ((p - q) * k2 - c * 2.0 * k1, (p - q) * k1 + c * 2.0 * k2);
        let angle = AngleDensity {
            first: n1 * k2 - n2 * k1,
            second: p * k2 * k2 + q * k1 * k1 - c * 2.0 * k1 * k2 - value * 2.0,
            along_y: one.along_y * by1 + two.along_y * by2,
            along_z: one.along_z * by1 + two.along_z * by2,
        };
        let slopes = [Slope { y: one.along_y, z: one.along_z }, Slope { y: two.along_y, z: two.along_z }];
        (value, angle, slopes)
    }

    /// What the curvatures along all w have in common.
    #[inline(always)]
    fn lift(&self) -> Lift<S> {
        let Self { y, z, ia, b, g, dg, .. } = *self;
        let ia3 = ia * ia * ia;
        let q = z.x + b * ia;
        let dq = z * ia - y * (ia3 * b);
        let mut lift = y * ia;
        lift.x += ia.like(1.0);
        let gq = dg * q + dq * g;
        Lift { q, dq, gq, lift }
    }

    /// Subtracts P along a w with its derivatives.
    #[inline(always)]
    fn take(&self, w: Vector<S>, along: &Curvature<S>, of: &Lift<S>, to: &mut PointDerivatives<S>) {
        let Self { y, z, ia, b, g, dg, hg, .. } = *self;
        let (Curvature { m, n, .. }, Lift { q, dq, gq, lift }) = (*along, *of);
        let ia3 = ia * ia * ia;
        let yy = y.outer(y);
        to.gy -= along.along_y;
        to.gz -= along.along_z;
        let hq = y.outer(z).with_transpose().with_diagonal(b) * (-ia3) + yy * (ia3 * 3.0 * ia * ia * b);
        to.hyy += (yy * (ia3 * -3.0 * ia * ia)).with_diagonal(ia3) * m
            + w.outer(gq).with_transpose()
            + (hg * q + dg.outer(dq).with_transpose() + hq * g) * n;
        // Rows y, columns z.
        to.hyz += y.outer(w) * ia3 + (w * g + dg * n).outer(lift) + (yy * (-ia3)).with_diagonal(ia) * (n * g);
    }
}

/// q = z₁ + y·z/a with its gradient, the gradient of G q, and t₀ + t, of which all curvatures are made.
#[derive(Clone, Copy)]
struct Lift<S: Simd> {
    q: Lanes<S>,
    dq: Vector<S>,
    gq: Vector<S>,
    lift: Vector<S>,
}

/// Gradient of a curvature in y and z.
#[derive(Clone, Copy)]
pub(super) struct Slope<S: Simd> {
    pub(super) y: Vector<S>,
    pub(super) z: Vector<S>,
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
