//! The implicit surface of a tree with the derivatives that contact needs.
//!
//! f is that of the generator (`generate/field.rs`): for one branch f = |x − c(s)| − r(s), s the foot of x on its
//! axis, for several their smooth minimum. With the offset o = x − c ⊥ c′, u = o/|o| and σ = 1/(c′·c′ − o·c″),
//!
//! ```text
//! ∇s = σ c′,    ∇∇s = σ² (c′c″ᵀ + c″c′ᵀ − σ (3 c′·c″ − o·c‴) c′c′ᵀ)
//! ∇f = u − r′ ∇s,    ∇∇f = (I − uuᵀ − σ c′c′ᵀ)/|o| − r″ ∇s∇sᵀ − r′ ∇∇s
//! ```
//!
//! Two of them, f ≤ g, are joined over a width w, which has a slope of its own: with h = 1 − (g − f)/w and k = ½ h²
//!
//! ```text
//! F = f − w h³/6,    ∇F = (1 − k) ∇f + k ∇g + (h³/3 − h²/2) ∇w
//! ```
//!
//! ∇w needs the Hessians of both. ∇∇w would need their third derivatives: the Hessian of a joint is computed by
//! differences of its gradient.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::axis::{Axis, End, NearKnot, stretch};
use super::blocks::{Blocks, Part};
use crate::Vec3;
use crate::products::outer;
use crate::vessel::generate::{BLEND, BLEND_COSINES, HIDDEN, any_perpendicular};

/// Step of finite differences relative to the radius: with rounding and the third derivative, a Hessian has ten
/// digits.
const DIFFERENCE: f64 = 1e-4;
/// Assumed bound of the ratio of radii of a branch joined with the nearest one, for a third that is joined with both.
const WIDER: f64 = 2.0;
/// Largest number of branches joined at one position; of more, the first count.
const MOST_JOINED: usize = 16;

/// The field of one or more branches at a position.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Value {
    /// f, mm: negative in the lumen.
    pub(super) f: f64,
    /// ∇f.
    pub(super) gradient: Vec3,
    /// The gradient used for the width of a joint, without that of earlier widths.
    towards: Vec3,
    /// Its derivative, approximately ∇∇f: exact for a single branch.
    pub(super) turning: Matrix3<f64>,
    /// Radius of the vessel, mm, and its gradient.
    pub(super) radius: f64,
    radius_slope: Vec3,
    /// Degree of joining: 0 at a round end, 1 away from it; and its gradient.
    exposure: f64,
    exposure_slope: Vec3,
    /// Whether branches are joined here.
    pub(super) is_joint: bool,
    /// Whether f is the distance: a single branch without taper.
    pub(super) is_distance: bool,
    /// The branch it mostly belongs to, and the arc length of the foot.
    pub(super) branch: u32,
    pub(super) foot: f64,
}

/// The branches that may be relevant at a position, in order, each with an arc length near the foot.
#[derive(Debug, Clone)]
pub(super) struct Feet {
    all: [(u32, f64); MOST_JOINED],
    count: usize,
    /// Distance from the position up to which no other branch is relevant, mm.
    within_mm: f64,
}

impl Feet {
    /// Distance from the position up to which no other branch is relevant, mm.
    pub(super) fn within_mm(&self) -> f64 {
        self.within_mm
    }
}

/// A tree as an implicit surface.
#[derive(Debug)]
pub(crate) struct SweptField {
    pub(super) axes: Arc<[Axis]>,
    pub(super) blocks: Blocks,
}

/// 3t² − 2t³ between 0 and 1, and its derivative.
fn smooth_step(t: f64) -> (f64, f64) {
    let t = t.clamp(0.0, 1.0);
    (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t))
}

/// The field of a single branch at a position, without derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Depth {
    /// f, mm: negative in the lumen.
    pub(super) f: f64,
    /// Lower bound of the distance to the wall, mm: in the lumen of a branch that to its own wall, since that lumen
    /// is part of the whole.
    pub(super) room: f64,
    /// Radius of the vessel, mm.
    pub(super) radius: f64,
    /// The position, from the axis, mm.
    pub(super) from_axis: Vec3,
    /// Whether f is the distance: a branch without taper.
    pub(super) is_distance: bool,
    /// The branch, and the arc length of the foot.
    pub(super) branch: u32,
    pub(super) foot: f64,
}

impl SweptField {
    /// Depth of a position in a single branch, whose foot is near an arc length.
    pub(super) fn depth(&self, branch: usize, x: &Vec3, near: f64) -> Depth {
        let (foot, place) = self.axes[branch].foot(x, near);
        let [radius, taper, flare] = place.radius;
        let from_axis = x - place.position;
        let f = from_axis.norm() - radius;
        let is_distance = taper == 0.0 && flare == 0.0;
        let room = -f / self.blocks.steepness(branch);
        Depth { f, room, radius, from_axis, is_distance, branch: branch as u32, foot }
    }

    /// Lower bound of the distance to the wall of a position with these feet, mm: the lumen of each branch is part of
    /// the whole. With the depth if there is one branch alone.
    pub(super) fn room(&self, feet: &mut Feet, x: &Vec3) -> (f64, Option<Depth>) {
        let mut room = f64::NEG_INFINITY;
        let mut last = None;
        for (branch, near) in &mut feet.all[..feet.count] {
            let depth = self.depth(*branch as usize, x, *near);
            *near = depth.foot;
            room = room.max(depth.room);
            last = Some(depth);
        }
        (room, last.filter(|_| feet.count == 1))
    }

    /// The parts of branches, of those given, in order, that may be relevant within `way` mm of a position.
    pub(super) fn feet(&self, parts: &[Part], x: &Vec3, way: f64) -> Feet {
        let nearest =
            |part: &Part| self.axes[part.branch as usize].nearest(x, part.from as usize, part.to as usize);
        let mut known = [NearKnot::default(); MOST_JOINED];
        let mut low = (f64::INFINITY, 0.0, 1.0);
        for (index, part) in parts.iter().enumerate() {
            let found = nearest(part);
            let radius = self.axes[part.branch as usize].radius(found.knot);
            if found.away - radius < low.0 {
                low = (found.away - radius, radius, self.blocks.steepness(part.branch as usize));
            }
            if let Some(known) = known.get_mut(index) {
                *known = found;
            }
        }
        let mut feet = Feet { all: [(0, 0.0); MOST_JOINED], count: 0, within_mm: f64::INFINITY };
        for (index, part) in parts.iter().enumerate() {
            let axis = &self.axes[part.branch as usize];
            let NearKnot { away, knot, near } = known.get(index).copied().unwrap_or_else(|| nearest(part));
            let radius = axis.radius(knot);
            // Along a step, and on the way, the fields of two branches approach each other by at most the sum of
            // their slopes; on extensions excepted. A branch higher than another by the largest width of a joint has
            // no effect; a joint is at most between a thin branch and the mean of others.
            let approach = self.blocks.steepness(part.branch as usize) + low.2;
            let within_mm =
                (away - radius - low.0 - BLEND * radius.min(WIDER * low.1)) / approach - axis.step();
            if axis.is_inner(knot) && within_mm > way {
                feet.within_mm = feet.within_mm.min(within_mm);
                continue;
            }
            if let Some(foot) = feet.all.get_mut(feet.count) {
                *foot = (part.branch, near);
                feet.count += 1;
            }
        }
        feet
    }

    /// The field at a position, and its feet there. `None` if no branch is relevant.
    pub(super) fn value(&self, feet: &mut Feet, x: &Vec3) -> Option<Value> {
        let mut joined: Option<Value> = None;
        let mut last: Option<Value> = None;
        for (branch, near) in &mut feet.all[..feet.count] {
            let value = of_branch(&self.axes[*branch as usize], *branch, x, *near);
            *near = value.foot;
            match &mut last {
                // A branch that returns counts where it is nearest.
                Some(other) if other.branch == *branch => {
                    if value.f < other.f {
                        *other = value;
                    }
                }
                _ => {
                    if let Some(done) = last.replace(value) {
                        joined = Some(joined.map_or(done, |before| join(&before, &done)));
                    }
                }
            }
        }
        let done = last?;
        Some(joined.map_or(done, |before| join(&before, &done)))
    }

    /// ∇∇f at a position with this field, except for its component along the normal on both sides, which is not
    /// needed.
    pub(super) fn hessian(&self, feet: &Feet, x: &Vec3, value: &Value) -> Matrix3<f64> {
        if !value.is_joint {
            return value.turning;
        }
        let step = DIFFERENCE * value.radius;
        Self::tangential(value, |way| {
            (self.gradient_at(feet, &(x + way * step), value)
                - self.gradient_at(feet, &(x - way * step), value))
                / (2.0 * step)
        })
    }

    /// An approximate Hessian, sufficient for the next step to the wall.
    pub(super) fn rough_hessian(&self, feet: &Feet, x: &Vec3, value: &Value) -> Matrix3<f64> {
        let step = DIFFERENCE * value.radius;
        Self::tangential(value, |way| {
            (self.gradient_at(feet, &(x + way * step), value) - value.gradient) / step
        })
    }

    /// ∇f at a position near that of a value.
    fn gradient_at(&self, feet: &Feet, x: &Vec3, value: &Value) -> Vec3 {
        self.value(&mut feet.clone(), x).map_or(value.gradient, |value| value.gradient)
    }

    /// A symmetric matrix from its action on the two directions along the wall.
    fn tangential(value: &Value, of: impl Fn(Vec3) -> Vec3) -> Matrix3<f64> {
        let n = value.gradient.normalize();
        let u = any_perpendicular(&n);
        let v = n.cross(&u);
        let [of_u, of_v] = [of(u), of(v)];
        let across = 0.5 * (u.dot(&of_v) + v.dot(&of_u));
        let [along_u, along_v] = [n.dot(&of_u), n.dot(&of_v)];
        let sum = outer(&u, &u) * (0.5 * u.dot(&of_u))
            + outer(&v, &v) * (0.5 * v.dot(&of_v))
            + outer(&u, &v) * across
            + outer(&n, &(u * along_u + v * along_v));
        sum + sum.transpose()
    }
}

/// The field of a single branch, of this number, whose foot is near an arc length.
pub(super) fn of_branch(axis: &Axis, branch: u32, x: &Vec3, near: f64) -> Value {
    let (s, place) = axis.foot(x, near);
    let offset = x - place.position;
    let distance = offset.norm().max(f64::MIN_POSITIVE);
    let u = offset / distance;
    let [radius, taper, flare] = place.radius;
    let [low, high] = axis.range();
    let is_free = s > low && s < high;
    let sigma = if is_free { 1.0 / stretch(&place, &offset) } else { 0.0 };
    let along = place.first * sigma;
    let mut gradient = u;
    let mut hessian = (Matrix3::identity() - outer(&u, &u) - outer(&place.first, &along)) / distance;
    if taper != 0.0 || flare != 0.0 {
        let mixed = outer(&place.first, &place.second) * (sigma * sigma);
        let turn = sigma * (3.0 * place.first.dot(&place.second) - offset.dot(&place.third));
        gradient -= along * taper;
        hessian -= outer(&along, &along) * (flare - taper * turn) + (mixed + mixed.transpose()) * taper;
    }
    let (mut exposure, mut exposure_slope) = (1.0, Vec3::zeros());
    let [from_low, from_high] = [s, axis.length() - s];
    for (end, from_end, outwards) in [(axis.ends[0], from_low, 1.0), (axis.ends[1], from_high, -1.0)] {
        if end != End::Round {
            continue;
        }
        let part = from_end / (HIDDEN * radius);
        let (share, rate) = smooth_step(part);
        // Only the nearer end hides a branch.
        if share < exposure {
            exposure = share;
            exposure_slope = along * (rate * (outwards / (HIDDEN * radius) - part * taper / radius));
        }
    }
    let f = distance - radius;
    Value {
        f,
        gradient,
        towards: gradient,
        turning: hessian,
        radius,
        radius_slope: along * taper,
        exposure,
        exposure_slope,
        is_joint: false,
        is_distance: taper == 0.0 && flare == 0.0,
        branch,
        foot: s,
    }
}

/// The smooth minimum of two values: a cubic polynomial over a width that depends on the angle between the gradients.
fn join(a: &Value, b: &Value) -> Value {
    let (low, high) = if a.f <= b.f { (a, b) } else { (b, a) };
    let thin = if a.radius <= b.radius { a } else { b };
    if high.f - low.f >= BLEND * thin.radius {
        return *low;
    }
    let (sizes, cosine) = {
        let sizes = [low, high].map(|v| v.towards.norm().max(f64::MIN_POSITIVE));
        (sizes, low.towards.dot(&high.towards) / (sizes[0] * sizes[1]))
    };
    let span = BLEND_COSINES[0] - BLEND_COSINES[1];
    let (opposed, rate) = smooth_step((BLEND_COSINES[0] - cosine) / span);
    let full = BLEND * thin.radius;
    let exposure = low.exposure * high.exposure;
    let width = full * opposed * exposure;
    let gap = width - (high.f - low.f);
    if gap <= 0.0 {
        return *low;
    }
    let [l, m] = [low.towards / sizes[0], high.towards / sizes[1]];
    let cosine_slope =
        low.turning.tr_mul(&(m - l * cosine)) / sizes[0] + high.turning.tr_mul(&(l - m * cosine)) / sizes[1];
    let width_slope = thin.radius_slope * (BLEND * opposed * exposure)
        - cosine_slope * (full * exposure * rate / span)
        + (low.exposure_slope * high.exposure + high.exposure_slope * low.exposure) * (full * opposed);
    let h = gap / width;
    let k = 0.5 * h * h;
    let h_slope = (low.gradient - high.gradient + width_slope * (1.0 - h)) / width;
    let k_slope = h_slope * h;
    Value {
        f: low.f - h * h * h * width / 6.0,
        gradient: low.gradient * (1.0 - k) + high.gradient * k + width_slope * (h * h * (h / 3.0 - 0.5)),
        towards: low.towards * (1.0 - k) + high.towards * k,
        turning: low.turning * (1.0 - k) + high.turning * k + outer(&(high.towards - low.towards), &k_slope),
        radius: low.radius * (1.0 - k) + high.radius * k,
        radius_slope: low.radius_slope * (1.0 - k)
            + high.radius_slope * k
            + k_slope * (high.radius - low.radius),
        exposure: low.exposure * (1.0 - k) + high.exposure * k,
        exposure_slope: low.exposure_slope * (1.0 - k)
            + high.exposure_slope * k
            + k_slope * (high.exposure - low.exposure),
        is_joint: true,
        is_distance: false,
        branch: low.branch,
        foot: low.foot,
    }
}
