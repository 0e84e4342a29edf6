//! Orthonormal triads of the nodes, their transport, and the reference twist between two of them.

use crate::Vec3;

/// A triad: unit tangent `t` and two directions `u`, `v = t × u` across it.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        let angle = a.hypot(b);
        if angle == 0.0 {
            return *self;
        }
        let (sin, cos) = angle.sin_cos();
        let (a, b) = (a / angle, b / angle);
        // w is the direction of travel; it and t turn, the direction across both stays.
        let w = self.u * a + self.v * b;
        let t = self.t * cos + w * sin;
        let turned = w * cos - self.t * sin;
        let n = self.v * a - self.u * b;
        // Orthonormalising here keeps rounding from adding up over millions of steps.
        Self::new(t, Some(turned * a - n * b))
    }

    /// The smallest rotation that takes this triad's tangent to `t`, applied to it.
    pub fn transported_to(&self, t: &Vec3) -> Self {
        let c = 1.0 + self.t.dot(t);
        let u = self.u - (self.t + t) * (self.u.dot(t) / c);
        Self::new(*t, Some(u))
    }

    /// Components of `w` along (t, u, v).
    #[inline]
    pub fn local(&self, w: &Vec3) -> Vec3 {
        Vec3::new(self.t.dot(w), self.u.dot(w), self.v.dot(w))
    }

    /// The triad turned about its tangent by `angle`.
    pub fn turned(&self, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        Self { t: self.t, u: self.u * c + self.v * s, v: self.v * c - self.u * s }
    }

    /// The tangent moved by `−log`: (a, b) such that `self.transported(a, b).t == t`.
    pub fn log(&self, t: &Vec3) -> (f64, f64) {
        let (a, b) = (self.u.dot(t), self.v.dot(t));
        let s = a.hypot(b);
        let angle = s.atan2(self.t.dot(t));
        if s < 1e-300 {
            return (angle, 0.0);
        }
        (a * angle / s, b * angle / s)
    }
}

/// Angle by which `second` is turned about its tangent against `first` carried to it by the smallest rotation.
///
/// With Q the components of `second` in `first`: atan2(Q₃₂ − Q₂₃, Q₂₂ + Q₃₃), the twist of the swing–twist
/// decomposition; the reference twist of Bergou et al. 2010, sec. 6.
pub fn reference_twist(first: &Frame, second: &Frame) -> f64 {
    let (u, v) = (first.local(&second.u), first.local(&second.v));
    (u.z - v.y).atan2(u.y + v.z)
}
