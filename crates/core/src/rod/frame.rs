//! Orthonormal triads of the nodes, their transport, and the reference twist between two of them.

use serde::{Deserialize, Serialize};

use crate::Vec3;

/// A triad: unit tangent `t` and two directions `u`, `v = t × u` across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Tangent.
    pub t: Vec3,
    /// First direction across.
    pub u: Vec3,
    /// Second direction across, `t × u`.
    pub v: Vec3,
}

impl Frame {
    /// A triad with the given tangent and first direction; both are normalised, `u` is made orthogonal to `t`.
    ///
    /// Where `u` is missing or along `t`, the coordinate axis farthest from `t` takes its place.
    pub fn new(t: Vec3, u: Option<Vec3>) -> Self {
        let t = t / t.norm();
        let across = |v: Vec3| v - t * t.dot(&v);
        let mut u = u.map_or_else(Vec3::zeros, across);
        if u.norm().is_nan() || u.norm() < 1e-9 {
            u = across(Vec3::ith(t.iamin(), 1.0));
        }
        let u = across(u / u.norm());
        let u = u / u.norm();
        Self { t, u, v: t.cross(&u) }
    }

    /// Turns the triad along the geodesic of the sphere with initial velocity `a u + b v`: by the smallest rotation.
    pub fn transported(&self, a: f64, b: f64) -> Self {
        let square = a * a + b * b;
        if square == 0.0 {
            return *self;
        }
        let (first, second) = turn_parts(square);
        // ω = t × w turns x by ω × x and ω × (ω × x); for u that is −a t and −a w.
        let w = self.u * a + self.v * b;
        let t = normalised(&(self.t * (1.0 - square * second) + w * first));
        let u = self.u - self.t * (a * first) - w * (a * second);
        let u = normalised(&(u - t * t.dot(&u)));
        Self { t, u, v: t.cross(&u) }
    }

    /// The smallest rotation that takes this triad's tangent to `t`, applied to it.
    pub(crate) fn transported_to(&self, t: &Vec3) -> Self {
        let c = 1.0 + self.t.dot(t);
        let u = self.u - (self.t + t) * (self.u.dot(t) / c);
        Self::new(*t, Some(u))
    }

    /// Components of `w` along (t, u, v).
    #[inline]
    pub(crate) fn local(&self, w: &Vec3) -> Vec3 {
        Vec3::new(self.t.dot(w), self.u.dot(w), self.v.dot(w))
    }

    /// The triad turned about its tangent by `angle`.
    pub(crate) fn turned(&self, angle: f64) -> Self {
        let (s, c) = libm::sincos(angle);
        Self { t: self.t, u: self.u * c + self.v * s, v: self.v * c - self.u * s }
    }

    /// The tangent moved by `−log`: (a, b) such that `self.transported(a, b).t == t`.
    pub(crate) fn log(&self, t: &Vec3) -> (f64, f64) {
        let (a, b) = (self.u.dot(t), self.v.dot(t));
        let s = libm::hypot(a, b);
        let angle = libm::atan2(s, self.t.dot(t));
        if s < 1e-300 {
            return (angle, 0.0);
        }
        (a * angle / s, b * angle / s)
    }
}

/// sin(φ)/φ and (1 − cos φ)/φ² from φ².
#[inline]
pub(super) fn turn_parts(square: f64) -> (f64, f64) {
    // Up to half a radian the first neglected term is below 10⁻¹⁶.
    if square < 0.25 {
        let x = square;
        let first = 1.0 / 39_916_800.0 - x / 6_227_020_800.0;
        let first = 1.0 / 120.0 - x * (1.0 / 5040.0 - x * (1.0 / 362_880.0 - x * first));
        let second = 1.0 / 479_001_600.0 - x / 87_178_291_200.0;
        let second = 1.0 / 720.0 - x * (1.0 / 40_320.0 - x * (1.0 / 3_628_800.0 - x * second));
        return (1.0 - x * (1.0 / 6.0 - x * first), 0.5 - x * (1.0 / 24.0 - x * second));
    }
    let angle = square.sqrt();
    let (sin, cos) = libm::sincos(angle);
    (sin / angle, (1.0 - cos) / square)
}

/// Renormalises a vector whose length differs from 1 by rounding, which would add up over millions of steps.
#[inline]
pub(super) fn normalised(w: &Vec3) -> Vec3 {
    w * (1.5 - 0.5 * w.norm_squared())
}

/// Angle by which `second` is turned about its tangent against `first` transported to it by the smallest rotation.
///
/// With Q the components of `second` in `first`: atan2(Q₃₂ − Q₂₃, Q₂₂ + Q₃₃), the twist of the swing–twist
/// decomposition; the reference twist of Bergou et al. 2010, sec. 6.
pub(crate) fn reference_twist(first: &Frame, second: &Frame) -> f64 {
    let (u, v) = (first.local(&second.u), first.local(&second.v));
    libm::atan2(u.z - v.y, u.y + v.z)
}
