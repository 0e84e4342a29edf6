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
//! plus −EI κ⁰·t′ + ½EI|κ⁰|² + ½GJ(τ − τ⁰)², κ⁰ = k₁d₁ + k₂d₂; this file holds the addition.

use crate::Vec3;
use crate::products::outer;
use nalgebra::Matrix3;

/// Stiffness and rest state at one Gauss point, in the element's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorsionInput {
    /// Quadrature weight × EI, times the rest curvature components along d₁ and d₂.
    pub moment: [f64; 2],
    /// Quadrature weight × GJ/h.
    pub stiffness: f64,
    /// h τ⁰.
    pub rest_twist: f64,
}

/// What all instruments have in common at a Gauss point: the twist −DG of the reference triad with its derivatives in y and z.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceTwist {
    y: Vec3,
    z: Vec3,
    /// 1/a and y·z.
    ia: f64,
    b: f64,
    /// G with its derivatives in y.
    g: f64,
    dg: Vec3,
    hg: Matrix3<f64>,
    /// −DG.
    value: f64,
    /// Gradients of −DG in y …
    pub along_y: Vec3,
    /// … and z.
    pub along_z: Vec3,
    /// Its second derivatives: y, y, …
    yy: Matrix3<f64>,
    /// … y (rows), z (columns).
    yz: Matrix3<f64>,
}

/// Derivatives in y and z. There are none in z twice: both twist and curvature are linear in it, and the twist's square is added in
/// chord and far tangent.
#[derive(Debug, Clone, Copy, Default)]
pub struct PointDerivatives {
    /// Gradient in y.
    pub gy: Vec3,
    /// Gradient in z.
    pub gz: Vec3,
    /// y, y.
    pub hyy: Matrix3<f64>,
    /// y (rows), z (columns).
    pub hyz: Matrix3<f64>,
}

/// Derivatives of an instrument's energy in φ, alone and mixed with y and z; those in hφ′ are the torque, GJ, and GJ times the gradients of
/// the [`ReferenceTwist`].
#[derive(Debug, Clone, Copy, Default)]
pub struct AngleDensity {
    /// In φ.
    pub first: f64,
    /// In φ twice.
    pub second: f64,
    /// In y and φ.
    pub along_y: Vec3,
    /// In z and φ.
    pub along_z: Vec3,
}

/// What all instruments have in common at a Gauss point where energies alone are asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwistValue {
    y: Vec3,
    z: Vec3,
    /// a and G.
    a: f64,
    g: f64,
    /// DG.
    twist: f64,
}

impl TwistValue {
    /// That of y and z.
    #[inline]
    pub(crate) fn new(y: &Vec3, z: &Vec3) -> Self {
        let a = y.norm();
        let g = 1.0 / (a * (a + y.x));
        Self { y: *y, z: *z, a, g, twist: (y.y * z.z - y.z * z.y) * g }
    }

    /// The two energies of an instrument: (bend, twist).
    #[inline]
    pub(crate) fn energies(&self, phi: f64, dphi: f64, p: &TorsionInput) -> (f64, f64) {
        let Self { y, z, a, g, twist } = self;
        let tau = dphi - twist - p.rest_twist;
        let twisted = 0.5 * p.stiffness * tau * tau;
        if p.moment == [0.0; 2] {
            return (0.0, twisted);
        }
        let (sin, cos) = phi.sin_cos();
        let w2 = p.moment[0] * cos - p.moment[1] * sin;
        let w3 = p.moment[0] * sin + p.moment[1] * cos;
        let m = z.y * w2 + z.z * w3;
        let n = y.y * w2 + y.z * w3;
        (n * g * (z.x + y.dot(z) / a) - m / a, twisted)
    }
}

impl ReferenceTwist {
    /// That of y and z.
    // Always inlined: where no Hessian is wanted the compiler leaves its half out.
    #[inline(always)]
    pub fn new(y: &Vec3, z: &Vec3) -> Self {
        let a = y.norm();
        let ia = 1.0 / a;
        let ia3 = ia * ia * ia;
        let g = ia / (a + y.x);
        let e1 = Vec3::x();
        let eye = Matrix3::identity();
        let yy = outer(y, y);

        // G: 1/G = A + a y₁, its gradient is `slope`.
        let slope = y * (2.0 + y.x * ia) + e1 * a;
        let ey = outer(&e1, y);
        let bend_slope = eye * (2.0 + y.x * ia) + (ey + ey.transpose()) * ia - yy * (y.x * ia3);
        let dg = slope * (-g * g);
        let hg = outer(&slope, &slope) * (2.0 * g * g * g) - bend_slope * (g * g);

        let d = y.y * z.z - y.z * z.y;
        let dy = Vec3::new(0.0, z.z, -z.y);
        let dz = Vec3::new(0.0, -y.z, y.y);
        let dyg = outer(&dy, &dg);
        let mut yz = -outer(&dg, &dz);
        yz[(1, 2)] -= g;
        yz[(2, 1)] += g;
        Self {
            y: *y,
            z: *z,
            ia,
            b: y.dot(z),
            g,
            dg,
            hg,
            value: -(d * g),
            along_y: -(dy * g + dg * d),
            along_z: -dz * g,
            yy: -(dyg + dyg.transpose() + hg * d),
            yz,
        }
    }

    /// The torque of an instrument.
    #[inline(always)]
    pub fn torque(&self, dphi: f64, p: &TorsionInput) -> f64 {
        p.stiffness * self.tau(dphi, p)
    }

    /// Its twist energy.
    #[inline(always)]
    pub fn energy(&self, dphi: f64, p: &TorsionInput) -> f64 {
        0.5 * self.torque(dphi, p) * self.tau(dphi, p)
    }

    #[inline(always)]
    fn tau(&self, dphi: f64, p: &TorsionInput) -> f64 {
        dphi + self.value - p.rest_twist
    }

    /// Adds the torque times the derivatives of the twist.
    #[inline(always)]
    pub fn add_twist(&self, torque: f64, to: &mut PointDerivatives) {
        to.gy += self.along_y * torque;
        to.gz += self.along_z * torque;
        to.hyy += self.yy * torque;
        to.hyz += self.yz * torque;
    }

    /// Adds the derivatives of an instrument's rest curvature, −P with P = (z·w)/a − (y·w) G q and q = z₁ + b/a, and returns −P with those in
    /// φ.
    #[inline(always)]
    pub fn add_rest_curvature(
        &self,
        phi: f64,
        moment: [f64; 2],
        to: &mut PointDerivatives,
    ) -> (f64, AngleDensity) {
        let Self { y, z, ia, b, g, dg, hg, .. } = self;
        let ia3 = ia * ia * ia;
        let e1 = Vec3::x();
        let eye = Matrix3::identity();
        let yy = outer(y, y);
        let (sin, cos) = phi.sin_cos();
        let w = Vec3::new(0.0, moment[0] * cos - moment[1] * sin, moment[0] * sin + moment[1] * cos);
        let wp = Vec3::new(0.0, -w.z, w.y);
        let q = z.x + b * ia;
        let dq = z * *ia - y * (ia3 * b);
        let lift = e1 + y * *ia;
        let gq = dg * q + dq * *g;
        let first = |w: &Vec3| {
            let (m, n) = (z.dot(w), y.dot(w));
            let value = m * ia - n * g * q;
            let pz = w * *ia - lift * (n * g);
            let py = -y * (ia3 * m) - w * (g * q) - gq * n;
            (m, n, value, py, pz)
        };
        let (m, n, value, py, pz) = first(&w);
        let (_, _, value_p, py_p, pz_p) = first(&wp);
        to.gy -= py;
        to.gz -= pz;
        let yz = outer(y, z);
        let hq = (yz + yz.transpose() + eye * *b) * (-ia3) + yy * (3.0 * ia3 * ia * ia * b);
        let wgq = outer(&w, &gq);
        let gd = outer(dg, &dq);
        to.hyy += (eye * ia3 - yy * (3.0 * ia3 * ia * ia)) * m
            + wgq
            + wgq.transpose()
            + (hg * q + gd + gd.transpose() + hq * *g) * n;
        // Rows y, columns z.
        to.hyz += outer(y, &w) * ia3 + outer(&(w * *g + dg * n), &lift) + (eye * *ia - yy * ia3) * (n * g);
        (-value, AngleDensity { first: -value_p, second: value, along_y: -py_p, along_z: -pz_p })
    }
}
