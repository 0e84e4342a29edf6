//! Bending of an initially straight, isotropic rod: the energy density |r′ × r″|²/|r′|⁵.
//!
//! With A = y·y, B = y·z, C = z·z the density is (AC − B²)/A^(5/2): the squared curvature of the interpolated curve per its own
//! arc length. Meier, Popp and Wall (2014, eq. 24) divide by |r′|⁴: per reference length. Both are the same for an exact
//! curve of unit speed, but a cubic's speed varies inside the element, by 3κκ′ times the bubble of its
//! interpolation error, and with |r′|⁴ that variation costs ½EI·6κ²κ′²h⁴/720 per length: the largest error of the
//! element where curvature varies. With |r′|⁵ it is gone at this order. The element multiplies by its mean |r′|, so that
//! stretch as a whole changes nothing and the axial unknown is the axial force (see [`super::element`]).

use crate::Vec3;

/// ½(AC − B²)/A^(5/2) with its gradient in (y, z) and its derivatives in (A, B, C).
#[derive(Debug, Clone, Copy)]
pub struct BendingDensity {
    /// Value.
    pub value: f64,
    /// Gradient in y.
    pub gy: Vec3,
    /// Gradient in z.
    pub gz: Vec3,
    /// Derivatives in (A, B, C).
    pub partials: Partials,
}

/// First and second derivatives of the density in A = y·y, B = y·z, C = z·z; those in (B, C) and (C, C) are zero.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs, reason = "named by what they are derivatives in")]
pub struct Partials {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub aa: f64,
    pub ab: f64,
    pub ac: f64,
    pub bb: f64,
}

/// The density alone.
#[inline]
pub(crate) fn bending_value(y: &Vec3, z: &Vec3) -> f64 {
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
    let root = a.sqrt();
    let a3 = a * root;
    let a5 = a3 * a;
    let a7 = a5 * a;
    let bb = b * b * a;
    let partials = Partials {
        a: a5 * (1.25 * bb - 0.75 * c),
        b: -b * a5,
        c: 0.5 * a3,
        aa: a7 * (1.875 * c - 4.375 * bb),
        ab: 2.5 * b * a7,
        ac: -0.75 * a5,
        bb: -a5,
    };
    let gy = y * (2.0 * partials.a) + z * partials.b;
    let gz = y * partials.b + z * a3;
    BendingDensity { value: 0.5 * y.cross(z).norm_squared() * a * a * root, gy, gz, partials }
}
