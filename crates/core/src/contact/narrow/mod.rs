//! The distance from the wall where a lumen is round and little wider than the device.
//!
//! The smooth wall of a mesh is close to the surface that it samples, but a device that nearly fills its lumen is
//! near the axis, where small waves of a wall decide which side is the nearest: with play p in a tube of radius R,
//! waves of amplitude ε that go m times around make one place the nearest only while ε m² < p. There also quadrics
//! are extrapolated to their centres of curvature. A thick device feels none of these waves. So a tube is fitted to
//! such stretches ([`trace`]), and its distance g is joined to that of the mesh, f, along the axis:
//!
//! ```text
//! F = f + λ (g − f),    λ = S((s − s₀)/R) S((s₁ − s)/R) S((w a − r)/((w − v) a))
//! ```
//!
//! with the foot s on the axis between the ends s₀ and s₁ of a stretch, the radius r there, that of the thickest
//! device a, and S from 0 to 1 twice continuously differentiable. F depends on position alone.

mod section;
#[cfg(test)]
mod tests;
mod trace;
mod vertices;

use super::SmoothWall;
use super::distance::rise;
use crate::vessel::{InTube, Tube};
use crate::{Vec3, products::outer};
use nalgebra::Matrix3;
pub(super) use vertices::Corner;
use vertices::Vertices;

/// v and w: radius of the lumen, over that of the device, up to which the tube counts alone, and from which the mesh
/// does.
const NARROW: (f64, f64) = (1.5, 1.7);
/// Radius over that of the device up to which the wall around a vertex of a coarse mesh may appear bent for the
/// lumen to be looked at.
const LOOKED_AT: f64 = 2.0;
/// Largest ratio of a vertex's curvatures along and around a tube.
const STRAIGHT: f64 = 0.5;
/// How far the wall may be off a tube, over the play.
const ROUND: f64 = 0.25;
/// Part of a tube at its ends that does not count, and length over which it is joined to the mesh, in its radii.
const LEFT_OUT: f64 = 0.75;
const JOINED: f64 = 1.0;

/// No place.
const NONE: u32 = u32::MAX;

/// A tube, and where it counts.
#[derive(Debug, Clone)]
struct Fitted {
    tube: Tube,
    /// Number of its first centre among those of all.
    first: u32,
    /// Arc lengths between which it counts, and over which it is joined to the mesh there, mm.
    ranges: Vec<([f64; 2], f64)>,
}

/// The narrow stretches of a wall.
#[derive(Debug, Clone)]
pub(super) struct Narrow {
    tubes: Vec<Fitted>,
    /// For each triangle a centre next to it, or none.
    places: Vec<u32>,
    /// How far the wall is off the tube at each centre, mm.
    off_mm: Vec<f64>,
    /// Radius of the thickest device, mm.
    thickest_mm: f64,
}

/// A point in a narrow stretch.
pub(super) struct Within {
    /// λ with its gradient and Hessian.
    share: f64,
    slope: Vec3,
    bend: Matrix3<f64>,
    tube: InTube,
}

impl Narrow {
    /// The narrow stretches of a wall for devices up to this radius, mm; `None` if it has none.
    pub(super) fn of(smooth: &SmoothWall, thickest_mm: f64) -> Option<Self> {
        let least_per_mm = (LOOKED_AT * thickest_mm).recip();
        let is_seed = |corner: &Corner| {
            let [around, along] = corner.curvature;
            around > least_per_mm && along.abs() < STRAIGHT * around
        };
        let seeds = (0..).zip(smooth.corners()).filter(|(_, corner)| is_seed(corner)).map(|(v, _)| v);
        let seeds: Vec<u32> = seeds.collect();
        if seeds.is_empty() {
            return None;
        }
        let widest_mm = NARROW.1 * thickest_mm;
        let vertices = Vertices::new(smooth.corners().collect(), widest_mm);
        let mut all = Self { tubes: Vec::new(), places: Vec::new(), off_mm: Vec::new(), thickest_mm };
        let mut at = vec![NONE; vertices.all.len()];
        for traced in trace::traced(&vertices, &seeds, widest_mm) {
            let ranges = ranges(&traced.tube, &traced.off_mm, thickest_mm);
            if ranges.is_empty() {
                continue;
            }
            let first = all.off_mm.len() as u32;
            traced.vertices.iter().for_each(|(v, centre)| at[*v as usize] = first + centre);
            all.off_mm.extend(&traced.off_mm);
            all.tubes.push(Fitted { tube: traced.tube, first, ranges });
        }
        if all.tubes.is_empty() {
            return None;
        }
        let of = |triangle: &[u32; 3]| triangle.iter().map(|v| at[*v as usize]).min().unwrap_or(NONE);
        all.places = smooth.triangles().iter().map(of).collect();
        Some(all)
    }

    /// How far the wall may lie inside its triangles where tubes count, mm.
    pub(super) fn insets_mm(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let off_mm = |place: u32| self.off_mm[place as usize].min(self.thickest_mm);
        let known = self.places.iter().enumerate().filter(|(_, place)| **place != NONE);
        known.map(move |(triangle, place)| (triangle as u32, off_mm(*place)))
    }

    /// A point next to a triangle, if it is in a narrow stretch.
    pub(super) fn at(&self, x: &Vec3, triangle: u32) -> Option<Within> {
        let place = self.places[triangle as usize];
        if place == NONE {
            return None;
        }
        let index = self.tubes.partition_point(|fitted| fitted.first <= place) - 1;
        let Fitted { tube, first, ranges } = &self.tubes[index];
        let found = tube.at(x, tube.step_mm() * f64::from(place - first));
        let s = found.foot_mm;
        let &([low, high], over_mm) = ranges.iter().find(|([low, high], _)| *low < s && s < *high)?;
        let (begun, ended) = (rise((s - low) / over_mm), rise((high - s) / over_mm));
        let span_mm = (NARROW.1 - NARROW.0) * self.thickest_mm;
        let [r, r1, r2] = found.radius;
        let tight = rise((NARROW.1 * self.thickest_mm - r) / span_mm);
        // Each by arc length.
        let a = [begun[0], begun[1] / over_mm, begun[2] / (over_mm * over_mm)];
        let b = [ended[0], -ended[1] / over_mm, ended[2] / (over_mm * over_mm)];
        let c = [
            tight[0],
            -tight[1] * r1 / span_mm,
            tight[2] * (r1 / span_mm) * (r1 / span_mm) - tight[1] * r2 / span_mm,
        ];
        let [share, by, twice] = times(times(a, b), c);
        (share > 0.0).then(|| Within {
            share,
            slope: found.along * by,
            // Without the curvature of s itself.
            bend: outer(&found.along, &found.along) * twice,
            tube: found,
        })
    }
}

impl Within {
    /// Whether the mesh does not count at all.
    pub(super) fn is_whole(&self) -> bool {
        self.share >= 1.0
    }

    /// The distance from the tube.
    pub(super) fn alone(&self) -> super::Distance {
        let InTube { distance_mm, gradient, hessian, .. } = self.tube;
        super::Distance { value_mm: distance_mm, gradient, hessian }
    }

    /// The distance, joined to that of the mesh.
    pub(super) fn joined(&self, mesh: &super::Distance) -> super::Distance {
        let (tube, share) = (self.alone(), self.share);
        let apart = tube.value_mm - mesh.value_mm;
        let away = tube.gradient - mesh.gradient;
        let turned = outer(&self.slope, &away);
        super::Distance {
            value_mm: mesh.value_mm + share * apart,
            gradient: mesh.gradient + away * share + self.slope * apart,
            hessian: mesh.hessian
                + (tube.hessian - mesh.hessian) * share
                + turned
                + turned.transpose()
                + self.bend * apart,
        }
    }
}

/// Arc lengths between which a tube counts, and the lengths over which it is joined to the mesh: where it is narrow
/// and round. Its ends, beyond which no triangle tells of it, are left out.
fn ranges(tube: &Tube, off_mm: &[f64], thickest_mm: f64) -> Vec<([f64; 2], f64)> {
    let step_mm = tube.step_mm();
    let counts = |k: usize| {
        let (r, bend) = tube.radius_and_bend(step_mm * k as f64);
        let [from_start, from_end] = [k, off_mm.len() - 1 - k].map(|steps| step_mm * steps as f64);
        let is_inner = from_start.min(from_end) >= LEFT_OUT * r;
        is_inner && r <= NARROW.1 * thickest_mm && bend * r < 0.5 && off_mm[k] <= ROUND * (r - thickest_mm)
    };
    let mut found = Vec::new();
    let mut from = None;
    for k in 0..=off_mm.len() {
        if k < off_mm.len() && counts(k) {
            from = from.or(Some(k));
        } else if let Some(first) = from.take() {
            let ends = [step_mm * first as f64, step_mm * (k - 1) as f64];
            let over_mm = JOINED * tube.radius_and_bend(0.5 * (ends[0] + ends[1])).0;
            if ends[1] - ends[0] > 2.0 * over_mm {
                found.push((ends, over_mm));
            }
        }
    }
    found
}

/// The product of two functions, with two derivatives.
fn times(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]]
}
