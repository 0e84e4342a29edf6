//! The closest point of the wall, and the distance with derivatives.
//!
//! For a single branch without taper f is the distance. Elsewhere the closest point y is found by Newton's method:
//! f(y) = 0 and x − y along the normal there, n = ∇f/|∇f|. With δ = (x − y)·n and the curvature A = P ∇∇f P/|∇f| of
//! the wall at y, P = I − nnᵀ, the distance of x has the gradient n and the Hessian
//!
//! ```text
//! A (I + δ A)⁻¹
//! ```
//!
//! For a point that has sunk into the wall the closest point on its own side of the wall is needed: the search starts
//! on the tube into which it has sunk, and finds the nearest from there, whatever other lumen is behind.

use nalgebra::Matrix3;

use super::axis::NearKnot;
use super::field::{Depth, Feet, SweptField, Value};
use crate::Vec3;
use crate::products::outer;

/// Largest number of steps to the closest point.
const STEPS: usize = 40;
/// Largest step, as a fraction of the vessel's radius.
const LONGEST: f64 = 0.5;
/// The last step is shorter than this: a Newton step leaves its square as error.
const LAST: f64 = 1e-5;
/// The same where branches are joined and the Hessian is unknown: convergence is linear.
const LAST_IN_JOINT: f64 = 1e-11;
/// Number of steps between evaluations of the Hessian of a joint.
const PATIENCE: usize = 3;
/// Depth in the lumen, as a fraction of the branch's radius, from which the wall of a branch does not exist, because
/// another branch opens there. At a joint the wall lies in by a sixth of the joint's width, 0.23 radii.
const HOLE: f64 = 0.3;
/// Largest distance of the wall from the end of the first step to it, in radii of the vessel.
const NEARBY: f64 = 0.1;
/// Where the wall bends towards a sunk point, distance from the centre of the bend, as a fraction of its radius,
/// below which the distance is treated as flat.
const FOCUS: f64 = 0.05;
/// Smallest step along a path into the wall, as a fraction of the vessel's radius.
const STRIDE: f64 = 0.01;

/// The wall of a tree near a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// Lower bound of the distance to the wall, mm; negative outside the lumen.
    pub(crate) clearance_mm: f64,
    /// The knot nearest to it.
    pub(crate) piece: u32,
}

/// Where the search for the closest point of the wall starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum From {
    /// Through space, near a knot.
    Space(u32),
    /// Along the wall, for a point that has sunk into it near a knot.
    Side(u32),
}

/// The closest point of the wall.
pub(crate) struct Closest<'a> {
    field: &'a SweptField,
    feet: Feet,
    /// The closest point, and the field there; or the point itself where the field is the distance.
    place: Vec3,
    value: Value,
    /// Distance of the point outside the wall, mm.
    outside: f64,
    /// Whether the field at the point is its distance.
    is_distance: bool,
}

impl Closest<'_> {
    /// Distance of the point from the wall, mm; negative behind it.
    pub(crate) fn distance_mm(&self) -> f64 {
        -self.outside
    }

    /// The gradient of the distance: the unit normal of the wall, into the lumen.
    pub(crate) fn normal(&self) -> Vec3 {
        -self.value.gradient.normalize()
    }

    /// The Hessian of the distance, 1/mm.
    pub(crate) fn hessian(&self) -> Matrix3<f64> {
        if self.is_distance {
            return -self.value.turning;
        }
        let size = self.value.gradient.norm();
        let n = self.value.gradient / size;
        let across = Matrix3::identity() - outer(&n, &n);
        let curvature = across * self.field.hessian(&self.feet, &self.place, &self.value) * across / size;
        let bent = Matrix3::identity() + curvature * self.outside;
        let hessian = match bent.try_inverse().filter(|_| bent.determinant() > FOCUS) {
            Some(inverse) => curvature * inverse,
            None => curvature,
        };
        (hessian + hessian.transpose()) * -0.5
    }

    /// Whether the closest point is at a joint of branches.
    #[cfg(test)]
    pub(super) fn is_in_joint(&self) -> bool {
        self.value.is_joint
    }

    /// The knot nearest to the closest point.
    pub(crate) fn piece(&self) -> u32 {
        self.field.piece(self.value.branch, self.value.foot)
    }
}

impl SweptField {
    /// The knot nearest to an arc length of a branch.
    fn piece(&self, branch: u32, foot: f64) -> u32 {
        self.blocks.piece(branch, self.axes[branch as usize].knot_at(foot) as u32)
    }

    /// The branch in which a point is deepest, or to which it is nearest.
    pub(crate) fn near(&self, x: &Vec3) -> Near {
        match self.deepest(x) {
            None => Near { clearance_mm: f64::NAN, piece: 0 },
            Some(Depth { f, room, branch, foot, .. }) => {
                Near { clearance_mm: if f < 0.0 { room } else { -f }, piece: self.piece(branch, foot) }
            }
        }
    }

    /// Depth of a position in that branch. `None` if not finite.
    fn deepest(&self, x: &Vec3) -> Option<Depth> {
        // The one with the nearest ball comes first, which excludes most others.
        self.deepest_from(x, self.blocks.nearest_ball(x)?).map(|(depth, _)| depth)
    }

    /// As [`Self::deepest`], with the block in which it is; fastest if that is asked first.
    fn deepest_from(&self, x: &Vec3, first: usize) -> Option<(Depth, usize)> {
        let mut best: Option<(Depth, usize, usize)> = None;
        let others = (0..self.blocks.len()).filter(|block| *block != first);
        for block in std::iter::once(first).chain(others) {
            let lowest = best.map_or(f64::INFINITY, |(depth, ..)| depth.f);
            if !self.blocks.may_be_nearer(block, x, lowest) {
                continue;
            }
            let part = self.blocks.part(block);
            let axis = &self.axes[part.branch as usize];
            let NearKnot { knot, near, .. } = axis.nearest(x, part.from as usize, part.to as usize);
            // From neighbouring parts the search ends at the same foot.
            if best.is_some_and(|(depth, known, _)| (depth.branch, known) == (part.branch, knot)) {
                continue;
            }
            let depth = self.depth(part.branch as usize, x, near);
            if depth.f < lowest {
                best = Some((depth, knot, block));
            }
        }
        best.map(|(depth, _, block)| (depth, block))
    }

    /// Whether a point is in the lumen, including extensions of open ends.
    pub(crate) fn contains(&self, x: &Vec3) -> bool {
        self.deepest(x).is_some_and(|depth| depth.f < 0.0 || self.level(&depth, x) < 0.0)
    }

    /// f at a place.
    pub(super) fn value_at(&self, x: &Vec3) -> f64 {
        self.deepest(x).map_or(f64::NAN, |depth| self.level(&depth, x))
    }

    /// f at a position with this depth in one of the branches.
    fn level(&self, depth: &Depth, x: &Vec3) -> f64 {
        let branch = depth.branch as usize;
        let parts = self.blocks.about(branch, self.axes[branch].knot_at(depth.foot));
        self.value(&mut self.feet(parts, x, 0.0), x).map_or(f64::NAN, |value| value.f)
    }

    /// Where a straight path leaves the lumen, as a fraction of it, up to `farthest` times its length.
    pub(crate) fn crossing(&self, from: &Vec3, to: &Vec3, farthest: f64) -> Option<f64> {
        let (way, length) = (to - from, (to - from).norm());
        let mut part = 0.0;
        let mut first = self.blocks.nearest_ball(from)?;
        while part <= farthest && length > 0.0 {
            let x = from + way * part;
            let (depth, there) = self.deepest_from(&x, first)?;
            first = there;
            // A position in no branch may still be in a joint.
            if depth.f >= 0.0 && self.level(&depth, &x) >= 0.0 {
                return Some(part);
            }
            part += depth.room.max(STRIDE * depth.radius) / length;
        }
        None
    }

    /// The closest point of the wall to a point. `None` if that is not finite.
    pub(crate) fn closest(&self, x: &Vec3, from: From) -> Option<Closest<'_>> {
        self.closer_than(x, from, f64::INFINITY).ok()?
    }

    /// As [`Self::closest`], if it may be nearer than `limit_mm`; otherwise a lower bound of the distance, mm.
    pub(crate) fn closer_than(
        &self,
        x: &Vec3,
        from: From,
        limit_mm: f64,
    ) -> Result<Option<Closest<'_>>, f64> {
        let piece = match from {
            From::Space(piece) => piece,
            From::Side(piece) => {
                let (branch, knot) = self.blocks.knot(piece);
                let axis = &self.axes[branch];
                let (s, place) = axis.foot(x, axis.step() * axis.follow(x, knot) as f64);
                let radius = place.radius[0];
                let offset = x - place.position;
                let start = place.position + offset * (radius / offset.norm().max(f64::MIN_POSITIVE));
                let knot = axis.knot_at(s);
                let parts = self.blocks.about(branch, knot);
                let mut feet = self.feet(parts, &start, HOLE * radius);
                let Some(value) = self.value(&mut feet, &start) else { return Ok(None) };
                if value.f > -HOLE * radius {
                    return Ok(self.descend(x, feet, start, value));
                }
                // Another branch opens where this one's wall would be.
                self.blocks.piece(branch as u32, knot as u32)
            }
        };
        let (branch, knot) = self.blocks.knot(piece);
        let parts = self.blocks.about(branch, knot);
        let mut feet = self.feet(parts, x, 0.0);
        let (room, only) = self.room(&mut feet, x);
        if room >= limit_mm {
            return Err(room);
        }
        // The wall is about as far as f; from near there on everything relevant is known.
        let (start, radius) = match only.filter(|depth| !depth.is_distance) {
            Some(depth) => (
                x - depth.from_axis * (depth.f / (depth.f + depth.radius).max(f64::MIN_POSITIVE)),
                depth.radius,
            ),
            None => {
                let Some(value) = self.value(&mut feet, x) else { return Ok(None) };
                if value.is_distance {
                    let outside = value.f;
                    let closest = Closest { field: self, feet, place: *x, value, outside, is_distance: true };
                    return Ok(Some(closest));
                }
                (x - value.gradient * (value.f / value.gradient.norm_squared()), value.radius)
            }
        };
        if (start - x).norm() + NEARBY * radius > feet.within_mm() {
            feet = self.feet(parts, &start, NEARBY * radius);
        }
        let Some(value) = self.value(&mut feet, &start) else { return Ok(None) };
        Ok(self.descend(x, feet, start, value))
    }

    /// The closest point of the wall to `x`, starting from a position where the field is `value`.
    fn descend(&self, x: &Vec3, mut feet: Feet, mut place: Vec3, mut value: Value) -> Option<Closest<'_>> {
        let mut known: Option<Matrix3<f64>> = None;
        for step in 0..STEPS {
            let size = value.gradient.norm();
            let n = value.gradient / size;
            let offset = x - place;
            let outside = offset.dot(&n);
            let across = Matrix3::identity() - outer(&n, &n);
            if value.is_joint && step % PATIENCE == 0 {
                known = Some(self.rough_hessian(&feet, &place, &value));
            }
            let hessian = match known {
                Some(known) if value.is_joint => known,
                _ => (value.turning + value.turning.transpose()) * 0.5,
            };
            let towards = -value.f / size;
            let along = (outside - towards) / size;
            let bent = Matrix3::identity() + across * hessian * across * along;
            let wanted = across * (offset - hessian * n * (along * towards));
            // Beyond the centre of a bend the stationary point is where the distance is largest.
            let lateral = match bent.try_inverse().filter(|_| bent.determinant() > FOCUS) {
                Some(inverse) => inverse * wanted,
                None => wanted,
            };
            let change = (lateral + n * towards).cap_magnitude(LONGEST * value.radius);
            place += change;
            value = self.value(&mut feet, &place)?;
            let last = if value.is_joint && known.is_none() { LAST_IN_JOINT } else { LAST };
            if change.norm() <= last * value.radius {
                break;
            }
        }
        let size = value.gradient.norm();
        let outside = (x - place).dot(&value.gradient) / size + value.f / size;
        Some(Closest { field: self, feet, place, value, outside, is_distance: false })
    }
}
