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

/// Value, gradient and Hessian in (y, z, φ, hφ′).
#[derive(Debug, Clone, Copy)]
pub struct TorsionDensity {
    /// Part of the energy that belongs to bending: −EI κ⁰·t′ (without the constant).
    pub bend: f64,
    /// Twist energy.
    pub twist: f64,
    /// Gradient in y.
    pub gy: Vec3,
    /// Gradient in z.
    pub gz: Vec3,
    /// Derivatives in φ and hφ′.
    pub gp: [f64; 2],
    /// y, y.
    pub hyy: Matrix3<f64>,
    /// y (rows), z (columns).
    pub hyz: Matrix3<f64>,
    /// z, z.
    pub hzz: Matrix3<f64>,
    /// y with φ and with hφ′.
    pub hyp: [Vec3; 2],
    /// z with φ and with hφ′.
    pub hzp: [Vec3; 2],
    /// (φ, φ) and (hφ′, hφ′); the mixed one is zero.
    pub hpp: [f64; 2],
}

/// The two energies alone: (bend, twist).
#[inline]
pub(crate) fn torsion_value(y: &Vec3, z: &Vec3, phi: f64, dphi: f64, p: &TorsionInput) -> (f64, f64) {
    let a = y.norm();
    let g = 1.0 / (a * (a + y.x));
    let (sin, cos) = phi.sin_cos();
    let w2 = p.moment[0] * cos - p.moment[1] * sin;
    let w3 = p.moment[0] * sin + p.moment[1] * cos;
    let m = z.y * w2 + z.z * w3;
    let n = y.y * w2 + y.z * w3;
    let tau = dphi - (y.y * z.z - y.z * z.y) * g - p.rest_twist;
    (n * g * (z.x + y.dot(z) / a) - m / a, 0.5 * p.stiffness * tau * tau)
}

/// The energies with their derivatives.
// Always inlined: where no Hessian is wanted the compiler leaves its half out.
#[inline(always)]
pub fn torsion(y: &Vec3, z: &Vec3, phi: f64, dphi: f64, p: &TorsionInput) -> TorsionDensity {
    let a = y.norm();
    let ia = 1.0 / a;
    let ia3 = ia * ia * ia;
    let g = ia / (a + y.x);
    let b = y.dot(z);
    let e1 = Vec3::x();
    let eye = Matrix3::identity();
    let yy = y * y.transpose();

    // G: 1/G = A + a y₁, its gradient is `slope`.
    let slope = y * (2.0 + y.x * ia) + e1 * a;
    let ey = e1 * y.transpose();
    let bend_slope = eye * (2.0 + y.x * ia) + (ey + ey.transpose()) * ia - yy * (y.x * ia3);
    let dg = slope * (-g * g);
    let hg = slope * slope.transpose() * (2.0 * g * g * g) - bend_slope * (g * g);

    // Twist.
    let d = y.y * z.z - y.z * z.y;
    let dy = Vec3::new(0.0, z.z, -z.y);
    let dz = Vec3::new(0.0, -y.z, y.y);
    let tau = dphi - d * g - p.rest_twist;
    let torque = p.stiffness * tau;
    let ty = -(dy * g + dg * d);
    let tz = -dz * g;
    let dyg = dy * dg.transpose();
    let mut tyz = -(dg * dz.transpose());
    tyz[(1, 2)] -= g;
    tyz[(2, 1)] += g;
    let mut hyy = ty * ty.transpose() * p.stiffness - (dyg + dyg.transpose() + hg * d) * torque;
    let mut hyz = ty * tz.transpose() * p.stiffness + tyz * torque;
    let hzz = tz * tz.transpose() * p.stiffness;
    let mut gy = ty * torque;
    let mut gz = tz * torque;

    // Rest curvature: P = (z·w)/a − (y·w) G q with q = z₁ + b/a; the energy is −P.
    let mut bend = 0.0;
    let (mut gphi, mut hphi) = (0.0, 0.0);
    let (mut hyphi, mut hzphi) = (Vec3::zeros(), Vec3::zeros());
    if p.moment != [0.0; 2] {
        let (sin, cos) = phi.sin_cos();
        let w = Vec3::new(0.0, p.moment[0] * cos - p.moment[1] * sin, p.moment[0] * sin + p.moment[1] * cos);
        let wp = Vec3::new(0.0, -w.z, w.y);
        let q = z.x + b * ia;
        let dq = z * ia - y * (ia3 * b);
        let lift = e1 + y * ia;
        let gq = dg * q + dq * g;
        let first = |w: &Vec3| {
            let (m, n) = (z.dot(w), y.dot(w));
            let value = m * ia - n * g * q;
            let pz = w * ia - lift * (n * g);
            let py = -y * (ia3 * m) - w * (g * q) - gq * n;
            (m, n, value, py, pz)
        };
        let (m, n, value, py, pz) = first(&w);
        let (_, _, value_p, py_p, pz_p) = first(&wp);
        bend = -value;
        gphi = -value_p;
        hphi = value;
        gy -= py;
        gz -= pz;
        hyphi = -py_p;
        hzphi = -pz_p;
        let yz = y * z.transpose();
        let hq = (yz + yz.transpose() + eye * b) * (-ia3) + yy * (3.0 * ia3 * ia * ia * b);
        let wgq = w * gq.transpose();
        let gd = dg * dq.transpose();
        hyy += (eye * ia3 - yy * (3.0 * ia3 * ia * ia)) * m
            + wgq
            + wgq.transpose()
            + (hg * q + gd + gd.transpose() + hq * g) * n;
        // Rows y, columns z.
        hyz +=
            y * w.transpose() * ia3 + (w * g + dg * n) * lift.transpose() + (eye * ia - yy * ia3) * (n * g);
    }
    TorsionDensity {
        bend,
        twist: 0.5 * torque * tau,
        gy,
        gz,
        gp: [gphi, torque],
        hyy,
        hyz,
        hzz,
        hyp: [hyphi, ty * p.stiffness],
        hzp: [hzphi, tz * p.stiffness],
        hpp: [hphi, p.stiffness],
    }
}
