//! Bending of an initially straight, isotropic rod: the energy density |r′ × r″|²/|r′|⁴.
//!
//! With A = y·y, B = y·z, C = z·z the density is (AC − B²)/A² = C/A − B²/A² (Meier, Popp and Wall 2014, eq. 24: the
//! squared curvature of the centre line per reference length). It is blind to stretch along the tangent, as it
//! should be.

use crate::Vec3;
use nalgebra::Matrix3;

/// ½(C/A − B²/A²) with gradient and Hessian in (y, z).
#[derive(Debug, Clone, Copy)]
pub struct BendingDensity {
    /// Value.
    pub value: f64,
    /// Gradient in y.
    pub gy: Vec3,
    /// Gradient in z.
    pub gz: Vec3,
    /// Second derivative in y, y.
    pub hyy: Matrix3<f64>,
    /// Second derivative in y (rows), z (columns).
    pub hyz: Matrix3<f64>,
    /// Second derivative in z, z.
    pub hzz: Matrix3<f64>,
}

/// The density alone.
#[inline]
pub fn bending_value(y: &Vec3, z: &Vec3) -> f64 {
    let a = 1.0 / y.dot(y);
    // The cross product keeps digits where z is nearly along y; C/A − B²/A² would lose them.
    0.5 * y.cross(z).norm_squared() * a * a
}

/// The density with its derivatives.
#[inline]
pub fn bending(y: &Vec3, z: &Vec3) -> BendingDensity {
    let a = 1.0 / y.dot(y);
    let b = y.dot(z);
    let c = z.dot(z);
    let (a2, ba) = (a * a, b * a);
    // Partial derivatives in (A, B, C); f_CC = f_BC = 0.
    let fa = a2 * (ba * b - 0.5 * c);
    let fb = -ba * a;
    let fc = 0.5 * a;
    let faa = a2 * a * (c - 3.0 * ba * b);
    let fab = 2.0 * ba * a2;
    let fac = -0.5 * a2;
    let fbb = -a2;
    let gy = y * (2.0 * fa) + z * fb;
    let gz = y * fb + z * (2.0 * fc);
    // yyᵀ, yzᵀ and zzᵀ carry all outer products.
    let hyy = combine(y, z, 2.0 * fa, 4.0 * faa, 2.0 * fab, 2.0 * fab, fbb);
    let hyz = combine(y, z, fb, 2.0 * fab, 4.0 * fac, fbb, 0.0);
    let hzz = combine(y, z, 2.0 * fc, fbb, 0.0, 0.0, 0.0);
    BendingDensity { value: bending_value(y, z), gy, gz, hyy, hyz, hzz }
}

/// `i·I + yy·yyᵀ + yz·yzᵀ + zy·zyᵀ + zz·zzᵀ`.
#[inline]
fn combine(y: &Vec3, z: &Vec3, i: f64, yy: f64, yz: f64, zy: f64, zz: f64) -> Matrix3<f64> {
    let left = y * yy + z * zy;
    let right = y * yz + z * zz;
    let mut m = Matrix3::zeros();
    for col in 0..3 {
        for row in 0..3 {
            m[(row, col)] = left[row] * y[col] + right[row] * z[col];
        }
        m[(col, col)] += i;
    }
    m
}
