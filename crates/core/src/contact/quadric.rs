//! The quadric of one vertex of the smooth wall: value, foot and window. See [`super::distance`] for the formulas.

use nalgebra::{Matrix2, Matrix3, Vector2};

use crate::Vec3;

/// Height times curvature is exact up to this value.
const STEEP: f64 = 0.7;
/// Beyond, it saturates within this range, so that feet stay finite at the centre of curvature.
const LEVEL: f64 = 0.4;

/// The quadric of one vertex. Fields are in the order of access: most vertices tested are too far, which the first
/// cache line shows.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Quadric {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) extent: Extent,
    /// Principal directions, across the normal.
    pub(super) axes: [Vec3; 2],
    /// S along them, 1/mm, the larger first; positive where the wall is concave, bending around the lumen.
    pub(super) curvature: [f64; 2],
    /// M in them, 1/mm².
    pub(super) support: Matrix2<f64>,
    /// Heights above and below the surface at which the window begins to fall from 1 and reaches 0, mm.
    pub(super) above_mm: (f64, f64),
    pub(super) below_mm: (f64, f64),
    /// n: reduction of the lower window towards the rim of the support, where it is 1 − n times as wide.
    pub(super) narrowing: f64,
    /// Half axes of the support, shortest and longest, mm.
    pub(super) half_axes_mm: (f64, f64),
    /// c, its weight.
    pub(super) trust: f64,
    /// Largest distance from the normal of a reached point within the window, mm; infinite until the window is set.
    pub(super) farthest_mm: f64,
}

/// A compact bound of the offset that a vertex reaches at a height h: feet |σ| within the longer half axis are those
/// of offsets
///
/// ```text
/// |τ| ≤ max (1 − hκ) |σ|,    1 − hκ ≥ 1 − `STEEP`
/// ```
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// A little more than the longer half axis, mm.
    long_mm: f32,
    curvature: [f32; 2],
}

/// Allowance for single precision in an extent.
const ROUNDED: f64 = 1.0 + 1e-5;

impl Extent {
    /// From the longer half axis of a support, mm, and its curvatures, the larger first.
    pub(super) fn new(long_mm: f64, curvature: [f64; 2]) -> Self {
        Self { long_mm: (long_mm * ROUNDED) as f32, curvature: curvature.map(|c| c as f32) }
    }

    /// Largest offset that may be reached at a height, mm.
    #[inline]
    fn at(&self, height_mm: f64) -> f64 {
        let [larger, smaller] = self.curvature;
        let t = height_mm * f64::from(if height_mm > 0.0 { smaller } else { larger });
        f64::from(self.long_mm) * (1.0 - t.min(STEEP))
    }
}

/// Height of the window, in radii of the device, and in supports of a vertex: the error of a fit on a coarse mesh.
const WINDOW: (f64, f64) = (1.25, 0.3);
/// Window above and below the surface: heights at which it begins to fall from 1 and reaches 0, in heights of the
/// window.
const ABOVE: (f64, f64) = (1.0, 1.8);
const BELOW: (f64, f64) = (-0.3, -0.8);
/// Distance, in heights of the window, by which a wall that is farther than another counts e times less. In a lumen
/// narrower than the device both sides are near, and their mean would hold nothing.
const NEARER: f64 = 0.3;
/// Beyond its centre of curvature a vertex is not the nearest: there, or this far above the surface in radii of the
/// thickest device, its window begins to fall.
const CENTRE: f64 = 1.05;
/// The window is closed at this many times that height.
const BEYOND_CENTRE: f64 = 1.15;

/// Ratios of the device's radius to that of a tube. In a narrow tube the wall behind a device is not another piece:
/// from the first ratio on the window below is narrowed less towards the rim, from the second on not at all.
const NARROW: (f64, f64) = (0.5, 0.8);

/// Z: the weight behind the surface is at most e^Z.
const BOUND: f64 = 8.0;

/// A window and its derivatives: 1 up to `from`, 0 from `to` on, in between 1 − t³(10 − 15t + 6t²).
#[inline]
fn fall(at: f64, from: f64, to: f64) -> [f64; 3] {
    let inverse = 1.0 / (to - from);
    let t = (at - from) * inverse;
    if t <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if t >= 1.0 {
        return [0.0; 3];
    }
    let (s, tt) = (1.0 - t, t * t);
    [
        1.0 - tt * t * (10.0 + t * (6.0 * t - 15.0)),
        -30.0 * tt * s * s * inverse,
        -60.0 * t * s * (s - t) * inverse * inverse,
    ]
}

/// 1/(1 − hκ), the ratio of feet to offsets, with its derivatives in h. It saturates before hκ reaches 1.
#[derive(Debug, Clone, Copy)]
struct Spread {
    value: f64,
    first: f64,
    second: f64,
}

impl Spread {
    /// The value alone, which is all that most vertices need.
    #[inline]
    fn value(height: f64, curvature: f64) -> f64 {
        let t = height * curvature;
        1.0 / (1.0 - if t <= STEEP { t } else { Self::levelled(t).0 })
    }

    /// hκ saturated beyond `STEEP`, and the position in the range of saturation.
    fn levelled(t: f64) -> (f64, f64) {
        let x = ((t - STEEP) / LEVEL).clamp(0.0, 1.0);
        (STEEP + LEVEL * (x - x * x * x + 0.5 * x * x * x * x), x)
    }

    #[inline]
    fn at(height: f64, curvature: f64) -> Self {
        let t = height * curvature;
        let (s, x) = if t <= STEEP { (t, 0.0) } else { Self::levelled(t) };
        // It saturates with the slope 1 − 3x² + 2x³.
        let slope = (1.0 - 3.0 * x * x + 2.0 * x * x * x) * curvature;
        let bend = 6.0 * (x * x - x) / LEVEL * curvature * curvature;
        let value = 1.0 / (1.0 - s);
        let square = value * value;
        Self { value, first: square * slope, second: square * (2.0 * value * slope * slope + bend) }
    }
}

/// A window with its derivatives in Q and u.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Opened {
    pub(super) value: f64,
    pub(super) in_q: f64,
    pub(super) in_qq: f64,
    pub(super) in_u: f64,
    pub(super) in_uu: f64,
    pub(super) in_qu: f64,
}

/// A point relative to a vertex, along its principal directions.
pub(super) struct Local {
    pub(super) tau: Vector2<f64>,
    /// Along the normal, mm.
    rise: f64,
    /// Mσ.
    pub(super) across: Vector2<f64>,
    /// u = σᵀMσ.
    pub(super) u: f64,
    /// Q.
    pub(super) value: f64,
}

impl Quadric {
    /// `x` relative to the vertex; `None` beyond the support.
    #[inline]
    pub(super) fn local(&self, x: &Vec3) -> Option<Local> {
        let y = x - self.position;
        let rise = self.normal.dot(&y);
        let farthest = self.extent.at(rise);
        if y.norm_squared() - rise * rise >= farthest * farthest {
            return None;
        }
        let [k, l] = self.curvature;
        let tau = Vector2::new(self.axes[0].dot(&y), self.axes[1].dot(&y));
        let sigma = Vector2::new(Spread::value(rise, k) * tau.x, Spread::value(rise, l) * tau.y);
        // Written out because it is the innermost product.
        let s = &self.support;
        let across = Vector2::new(
            s[(0, 0)] * sigma.x + s[(0, 1)] * sigma.y,
            s[(1, 0)] * sigma.x + s[(1, 1)] * sigma.y,
        );
        let u = sigma.dot(&across);
        let value = rise - 0.5 * (k * sigma.x * tau.x + l * sigma.y * tau.y);
        (u < 1.0).then_some(Local { tau, rise, across, u, value })
    }

    /// Derivatives of Q and of u along the principal directions and the normal.
    #[inline]
    pub(super) fn derivatives(&self, local: &Local) -> [(Vec3, Matrix3<f64>); 2] {
        let Local { tau, rise, across, .. } = local;
        let spread = self.curvature.map(|curvature| Spread::at(*rise, curvature));
        let (mut f1, mut u1) = (Vec3::z(), Vec3::zeros());
        let (mut f2, mut u2) = (Matrix3::zeros(), Matrix3::zeros());
        for i in 0..2 {
            let (t, k, v, Spread { value, first, second }) =
                (tau[i], self.curvature[i], across[i], spread[i]);
            f1[i] = -k * value * t;
            f1[2] -= 0.5 * k * first * t * t;
            f2[(i, i)] = -k * value;
            f2[(i, 2)] = -k * first * t;
            f2[(2, 2)] -= 0.5 * k * second * t * t;
            u1[i] = 2.0 * value * v;
            u1[2] += 2.0 * first * t * v;
            u2[(i, 2)] = 2.0 * first * v;
            u2[(2, 2)] += 2.0 * second * t * v;
            for j in 0..2 {
                let m = 2.0 * self.support[(i, j)];
                let other = spread[j].first * tau[j];
                u2[(i, j)] = m * value * spread[j].value;
                u2[(i, 2)] += m * value * other;
                u2[(2, 2)] += m * first * t * other;
            }
        }
        for second in [&mut f2, &mut u2] {
            (second[(2, 0)], second[(2, 1)]) = (second[(0, 2)], second[(1, 2)]);
        }
        [(f1, f2), (u1, u2)]
    }

    /// Sets the window for devices up to `thickest_mm` in radius; `around` tells whether the support reaches around
    /// the lumen.
    pub(super) fn open_window(&mut self, thickest_mm: f64, around: bool) {
        let size = (WINDOW.0 * thickest_mm).max(WINDOW.1 * self.half_axes_mm.0);
        // The first curvature is the larger one.
        let centre = if self.curvature[0] > 0.0 {
            (CENTRE * thickest_mm).max(self.curvature[0].recip())
        } else {
            f64::MAX
        };
        self.above_mm = ((ABOVE.0 * size).min(centre), (ABOVE.1 * size).min(BEYOND_CENTRE * centre));
        self.below_mm = (BELOW.0 * size, BELOW.1 * size);
        let narrow = (NARROW.1 - self.curvature[0] * thickest_mm) / (NARROW.1 - NARROW.0);
        self.narrowing = if around { 0.0 } else { narrow.clamp(0.0, 1.0) };
        // Within the window heights differ from Q by at most the sag of the support, and feet are nearer than offsets
        // by height times curvature.
        let (long, [k, l]) = (self.half_axes_mm.1, self.curvature);
        let sag = 0.5 * k.abs().max(l.abs()) * long * long;
        let (highest, lowest) = (self.above_mm.1 + sag, self.below_mm.1 - sag);
        self.farthest_mm = long * (1.0 - (highest * l.min(0.0)).min(lowest * k.max(0.0)));
    }

    /// b(Q, u) and its derivatives; behind the surface unlimited in depth, but bounded: e^{−Z tanh(z/Z)} with z =
    /// Q/0.3w.
    #[inline]
    pub(super) fn opened(&self, local: &Local, behind: bool) -> Opened {
        let (value, rate) = (local.value, BELOW.0 / (NEARER * self.below_mm.0));
        if behind {
            let t = libm::tanh(rate * value / BOUND);
            let (e, slope) = (libm::exp(-BOUND * t), rate * (1.0 - t * t));
            let second = (slope * slope + 2.0 * rate * slope * t / BOUND) * e;
            return Opened { value: e, in_q: -slope * e, in_qq: second, ..Opened::default() };
        }
        // Points behind the surface near the rim of the support are next to another piece of wall.
        let n = if value > 0.0 { 0.0 } else { self.narrowing };
        let (g, (from, to)) = (1.0 - n * local.u, if value > 0.0 { self.above_mm } else { self.below_mm });
        let z = value / g;
        let [b, b1, b2] = fall(z, from, to);
        if b == 0.0 {
            return Opened::default();
        }
        let e = libm::exp(-rate * value);
        let mut opened = Opened {
            value: b * e,
            in_q: (b1 / g - rate * b) * e,
            in_qq: (b2 / (g * g) - 2.0 * rate * b1 / g + rate * rate * b) * e,
            ..Opened::default()
        };
        if n > 0.0 && b1 != 0.0 {
            // ∂z/∂u = nz/g.
            let (z1, z2) = (n * z / g, 2.0 * n * n * z / (g * g));
            opened.in_u = b1 * z1 * e;
            opened.in_uu = (b2 * z1 * z1 + b1 * z2) * e;
            opened.in_qu = ((b2 * z1 + b1 * n / g) / g - rate * b1 * z1) * e;
        }
        opened
    }
}
