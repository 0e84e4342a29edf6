//! The place of the wall next to a point, and how far it is, with derivatives.
//!
//! Of a single branch that does not taper f is the distance. Elsewhere the place y is found by Newton's method: f(y) = 0 and x − y along the
//! normal there, n = ∇f/|∇f|. With δ = (x − y)·n and the curvature A = P ∇∇f P/|∇f| of the wall at y, P = I − nnᵀ, the distance of x has the
//! gradient n and the Hessian
//!
//! ```text
//! A (I + δ A)⁻¹
//! ```
//!
//! A point that has sunk into the wall asks for the place next to it that is on its own side of the wall: the search begins on the tube that
//! it has sunk into, and finds what is nearest from there on, whatever other lumen is behind.

use nalgebra::Matrix3;

use super::blocks::Part;
use super::field::{Depth, Feet, SweptField, Value};
use crate::Vec3;
use crate::products::outer;

/// Most steps to the place next to a point.
const STEPS: usize = 40;
/// Such a step is no longer than this part of the vessel's radius, …
const LONGEST: f64 = 0.5;
/// … and the last one shorter than this: a step of Newton's method leaves its square.
const LAST: f64 = 1e-5;
/// The same where branches are joined and the Hessian is not known: steps leave a part of their length.
const LAST_IN_JOINT: f64 = 1e-11;
/// Steps from one look for the Hessian of a joint to the next.
const PATIENCE: usize = 3;
/// The wall of a branch that lies in the lumen by more than this part of its radius is none: another branch opens there. Where they are joined it does by
/// a sixth of the joint's width, 0.23 radii.
const HOLE: f64 = 0.3;
/// How far the wall may be from where the first step to it ends, in radii of the vessel.
const NEARBY: f64 = 0.1;
/// Where the wall bends towards a sunk point, and the point is nearer than this to the middle of the bend, in parts of its radius, the distance bends no more.
const FOCUS: f64 = 0.05;
/// A way into the wall is followed by steps of this part of the vessel's radius at least.
const STRIDE: f64 = 0.01;

/// Where the wall of a tree is near a point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// No wall is nearer than this, mm; less than 0 outside of the lumen.
    pub(crate) clearance_mm: f64,
    /// The knot next to it.
    pub(crate) piece: u32,
}

/// From where on the wall next to a point is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum From {
    /// Through space, near a knot.
    Space(u32),
    /// Along the wall, of a point that has sunk into it near a knot.
    Side(u32),
}

/// The place of the wall next to a point.
pub(crate) struct Closest<'a> {
    field: &'a SweptField,
    feet: Feet,
    /// The place, and the field there; or the point itself where the field is the distance.
    place: Vec3,
    value: Value,
    /// How far the point is outside of the wall, mm.
    outside: f64,
    /// Whether the field at the point is its distance.
    is_distance: bool,
}

impl Closest<'_> {
    /// How far the point is from the wall, mm; less than 0 behind it.
    pub(crate) fn distance_mm(&self) -> f64 {
        -self.outside
    }

    /// The gradient of that: the unit normal of the wall, into the lumen.
    pub(crate) fn normal(&self) -> Vec3 {
        -self.value.gradient.normalize()
    }

    /// Its Hessian, 1/mm.
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

    /// Whether the place is where branches are joined.
    #[cfg(test)]
    pub(super) fn is_in_joint(&self) -> bool {
        self.value.is_joint
    }

    /// The knot next to the place.
    pub(crate) fn piece(&self) -> u32 {
        self.field.piece(self.value.branch, self.value.foot)
    }
}

impl SweptField {
    /// The knot next to an arc length of a branch.
    fn piece(&self, branch: u32, foot: f64) -> u32 {
        self.blocks.piece(branch, self.axes[branch as usize].knot_at(foot) as u32)
    }

    /// The branch that a point is deepest in, or nearest to.
    pub(crate) fn near(&self, x: &Vec3) -> Near {
        match self.deepest(x) {
            None => Near { clearance_mm: f64::NAN, piece: 0 },
            Some(Depth { f, room, branch, foot, .. }) => {
                Near { clearance_mm: if f < 0.0 { room } else { -f }, piece: self.piece(branch, foot) }
            }
        }
    }

    /// How deep a place is in that branch. None of one that is not finite.
    fn deepest(&self, x: &Vec3) -> Option<Depth> {
        let mut best: Option<Depth> = None;
        let mut ask = |part: Part, lowest: &mut f64| {
            let axis = &self.axes[part.branch as usize];
            let near = axis.nearest(x, part.from as usize, part.to as usize).near;
            let depth = self.depth(part.branch as usize, x, near);
            if depth.f < *lowest {
                (*lowest, best) = (depth.f, Some(depth));
            }
        };
        let mut lowest = f64::INFINITY;
        // What is nearest by its ball comes first, and most others are then out of the question.
        let first = self.blocks.gaps(x).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, part)) = first {
            ask(part, &mut lowest);
        }
        for (gap, part) in self.blocks.gaps(x) {
            if gap < lowest && first.is_some_and(|(_, done)| done != part) {
                ask(part, &mut lowest);
            }
        }
        best
    }

    /// Whether a point is in the lumen, what goes on beyond open ends included.
    pub(crate) fn contains(&self, x: &Vec3) -> bool {
        self.deepest(x).is_some_and(|depth| depth.f < 0.0 || self.level(&depth, x) < 0.0)
    }

    /// f at a place.
    pub(super) fn value_at(&self, x: &Vec3) -> f64 {
        self.deepest(x).map_or(f64::NAN, |depth| self.level(&depth, x))
    }

    /// f at a place that is so deep in one of the branches.
    fn level(&self, depth: &Depth, x: &Vec3) -> f64 {
        let branch = depth.branch as usize;
        let parts = self.blocks.about(branch, self.axes[branch].knot_at(depth.foot));
        self.value(&mut self.feet(parts, x, 0.0), x).map_or(f64::NAN, |value| value.f)
    }

    /// Where a straight way leaves the lumen, as a part of it, up to `farthest` times its length.
    pub(crate) fn crossing(&self, from: &Vec3, to: &Vec3, farthest: f64) -> Option<f64> {
        let (way, length) = (to - from, (to - from).norm());
        let mut part = 0.0;
        while part <= farthest && length > 0.0 {
            let x = from + way * part;
            let depth = self.deepest(&x)?;
            // What is in no branch may still be where they are joined.
            if depth.f >= 0.0 && self.level(&depth, &x) >= 0.0 {
                return Some(part);
            }
            part += depth.room.max(STRIDE * depth.radius) / length;
        }
        None
    }

    /// The place of the wall next to a point. None of a point that is not finite.
    pub(crate) fn closest(&self, x: &Vec3, from: From) -> Option<Closest<'_>> {
        self.closer_than(x, from, f64::INFINITY).ok()?
    }

    /// The same if it may be nearer than `limit_mm`; else how far it is at least, mm.
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
        let room = self.room(&mut feet, x);
        if room >= limit_mm {
            return Err(room);
        }
        let Some(value) = self.value(&mut feet, x) else { return Ok(None) };
        if value.is_distance {
            let outside = value.f;
            return Ok(Some(Closest { field: self, feet, place: *x, value, outside, is_distance: true }));
        }
        // The wall is about as far as f says; from near there on all that counts is known.
        let size = value.gradient.norm();
        let start = x - value.gradient * (value.f / (size * size));
        let mut feet = self.feet(parts, &start, NEARBY * value.radius);
        let Some(value) = self.value(&mut feet, &start) else { return Ok(None) };
        Ok(self.descend(x, feet, start, value))
    }

    /// The place of the wall next to `x`, from a place on where the field is `value`.
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
            // Beyond the middle of a bend the place next to a point is where it is farthest.
            let aside = match bent.try_inverse().filter(|_| bent.determinant() > FOCUS) {
                Some(inverse) => inverse * wanted,
                None => wanted,
            };
            let change = (aside + n * towards).cap_magnitude(LONGEST * value.radius);
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
