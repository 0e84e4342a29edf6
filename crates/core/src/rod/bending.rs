//! Bending of an initially straight, isotropic rod: the energy density |r′ × r″|²/|r′|⁵.
//!
//! With A = y·y, B = y·z, C = z·z the density is (AC − B²)/A^(5/2): the squared curvature of the interpolated curve per its own
//! arc length. Meier, Popp and Wall (2014, eq. 24) divide by |r′|⁴: per reference length. Both are the same for an exact
//! curve of unit speed, but a cubic's speed varies inside the element, by 3κκ′ times the bubble of its
//! interpolation error, and with |r′|⁴ that variation costs ½EI·6κ²κ′²h⁴/720 per length: the largest error of the
//! element where curvature varies. With |r′|⁵ it is gone at this order. The element multiplies by its mean |r′|, so that
//! stretch as a whole changes nothing and the axial unknown is the axial force (see [`super::element`]).

use crate::Vec3;
use nalgebra::Matrix3;

/// ½(AC − B²)/A^(5/2) with gradient and Hessian in (y, z).
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
    // The cross product keeps digits where z is nearly along y; AC − B² would lose them.
    0.5 * y.cross(z).norm_squared() * a * a * a.sqrt()
}

/// The density with its derivatives.
// Always inlined: where no Hessian is wanted the compiler leaves its half out.
#[inline(always)]
pub fn bending(y: &Vec3, z: &Vec3) -> BendingDensity {
    let a = 1.0 / y.dot(y);
    let b = y.dot(z);
    let c = z.dot(z);
    // a3 = A^(−3/2) and so on.
    let a3 = a * a.sqrt();
    let a5 = a3 * a;
    let a7 = a5 * a;
    let bb = b * b * a;
    // Partial derivatives in (A, B, C); f_CC = f_BC = 0.
    let fa = a5 * (1.25 * bb - 0.75 * c);
    let fb = -b * a5;
    let fc = 0.5 * a3;
    let faa = a7 * (1.875 * c - 4.375 * bb);
    let fab = 2.5 * b * a7;
    let fac = -0.75 * a5;
    let fbb = -a5;
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
