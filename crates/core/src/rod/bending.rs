//! Bending of an initially straight, isotropic rod: the energy density |r′ × r″|²/|r′|⁵.
//!
//! With A = y·y, B = y·z, C = z·z the density is (AC − B²)/A^(5/2): the squared curvature of the interpolated curve per its own
//! arc length. Meier, Popp and Wall (2014, eq. 24) divide by |r′|⁴: per reference length. Both are the same for an exact
//! curve of unit speed, but a cubic's speed varies inside the element, by 3κκ′ times the bubble of its
//! interpolation error, and with |r′|⁴ that variation costs ½EI·6κ²κ′²h⁴/720 per length: the largest error of the
//! element where curvature varies. With |r′|⁵ it is gone at this order. The element multiplies by its mean |r′|, so that
//! stretch as a whole changes nothing and the axial unknown is the axial force (see [`super::element`]).

use super::lanes::{Lanes, Vector};
use pulp::Simd;

/// ½(AC − B²)/A^(5/2) with its gradient in (y, z) and its derivatives in (A, B, C).
#[derive(Clone, Copy)]
pub(super) struct BendingDensity<S: Simd> {
    /// Value.
    pub(super) value: Lanes<S>,
    /// Gradient in y.
    pub(super) gy: Vector<S>,
    /// Gradient in z.
    pub(super) gz: Vector<S>,
    /// Derivatives in (A, B, C).
    pub(super) partials: Partials<S>,
}

/// First and second derivatives of the density in A = y·y, B = y·z, C = z·z; those in (B, C) and (C, C) are zero.
#[derive(Clone, Copy)]
pub(super) struct Partials<S: Simd> {
    pub(super) a: Lanes<S>,
    pub(super) b: Lanes<S>,
    pub(super) c: Lanes<S>,
    pub(super) aa: Lanes<S>,
    pub(super) ab: Lanes<S>,
    pub(super) ac: Lanes<S>,
    pub(super) bb: Lanes<S>,
}

/// The density alone.
#[inline(always)]
pub(super) fn bending_value<S: Simd>(y: Vector<S>, z: Vector<S>) -> Lanes<S> {
    let a = y.dot(y).inverse();
    // The cross product keeps digits where z is nearly along y; AC − B² would lose them.
    let cross = y.cross(z);
    cross.dot(cross) * 0.5 * a * a * a.sqrt()
}

/// The density with its derivatives. Without a Hessian the compiler removes that half.
#[inline(always)]
pub(super) fn bending<S: Simd>(y: Vector<S>, z: Vector<S>) -> BendingDensity<S> {
    let a = y.dot(y).inverse();
    let b = y.dot(z);
    let c = z.dot(z);
    // a3 = A^(−3/2) and so on.
    let root = a.sqrt();
    let a3 = a * root;
    let a5 = a3 * a;
    let a7 = a5 * a;
    let bb = b * b * a;
    let partials = Partials {
        a: a5 * (bb * 1.25 - c * 0.75),
        b: -b * a5,
        c: a3 * 0.5,
        aa: a7 * (c * 1.875 - bb * 4.375),
        ab: b * 2.5 * a7,
        ac: a5 * -0.75,
        bb: -a5,
    };
    let gy = y * (partials.a * 2.0) + z * partials.b;
    let gz = y * partials.b + z * a3;
    BendingDensity { value: bending_value(y, z), gy, gz, partials }
}
