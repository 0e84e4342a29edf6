//! Whether a mesh is fine as it is, and how even it is.

use super::Conditioning;
use super::corners::{Corners, Kind};
use super::reference::Reference;
use super::sizes;
use crate::vessel::topology::NONE;

/// Longest over shortest edge around a vertex: a regular grid three times as long as wide has √10.
const LARGEST_RATIO: f64 = 4.0;
/// Smallest angle, radians: that grid has 18°.
const LEAST_ANGLE: f64 = 0.2;
/// Largest angle between neighbouring triangles, radians: where branches part even a fine mesh has a few such edges.
const LARGEST_TURN: f64 = 1.5;
/// Largest angle between all but one in a hundred neighbours: nine edges around a tube have 40°.
const USUAL_TURN: f64 = 0.75;
/// Longest edge over the local radius.
const LONGEST: f64 = 1.6;

/// Angles and edges of a mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evenness {
    pub(super) edge_min_mm: f64,
    pub(super) edge_median_mm: f64,
    pub(super) edge_max_mm: f64,
    pub(super) least_angle: f64,
    pub(super) largest_turn: f64,
    /// Angle between neighbouring triangles that one edge in a hundred exceeds, radians.
    pub(super) usual_turn: f64,
    pub(super) largest_ratio: f64,
}

impl Evenness {
    /// Of the mesh as `at` has it.
    pub(super) fn of(corners: &Corners, at: impl Fn(u32) -> crate::Vec3) -> Self {
        let mut edges = Vec::new();
        let mut extremes = vec![(f64::MAX, 0.0f64); corners.vertices.len()];
        let mut least_angle = f64::MAX;
        let mut cosines = Vec::new();
        let normal = |t: u32| {
            let [a, b, c] = corners.triangles[t as usize].map(&at);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        };
        for e in (0..corners.half_edges()).filter(|&e| corners.lives(e)) {
            let (a, b, c) = (corners.from(e), corners.to(e), corners.apex(e));
            let (x, y) = (at(b) - at(a), at(c) - at(a));
            let angle = x.cross(&y).norm().atan2(x.dot(&y));
            least_angle = least_angle.min(angle);
            if !corners.leads(e) {
                continue;
            }
            let length = x.norm();
            edges.push(length);
            for v in [a, b] {
                let (least, largest) = &mut extremes[v as usize];
                (*least, *largest) = (least.min(length), largest.max(length));
            }
            let back = corners.twin(e);
            if back != NONE {
                cosines.push(normal(e / 3).dot(&normal(back / 3)).clamp(-1.0, 1.0));
            }
        }
        let largest_ratio = extremes
            .iter()
            .filter(|x| x.1 > 0.0)
            .map(|(least, largest)| largest / least.max(f64::MIN_POSITIVE))
            .fold(1.0, f64::max);
        let middle = edges.len() / 2;
        let median =
            if edges.is_empty() { 0.0 } else { *edges.select_nth_unstable_by(middle, f64::total_cmp).1 };
        let one_in_hundred = cosines.len() / 100;
        if !cosines.is_empty() {
            cosines.select_nth_unstable_by(one_in_hundred, f64::total_cmp);
        }
        Self {
            edge_min_mm: edges.iter().copied().fold(f64::MAX, f64::min),
            edge_median_mm: median,
            edge_max_mm: edges.iter().copied().fold(0.0, f64::max),
            least_angle,
            largest_turn: cosines.iter().copied().fold(1.0, f64::min).acos(),
            usual_turn: cosines.get(one_in_hundred).map_or(0.0, |c| c.acos()),
            largest_ratio,
        }
    }

    /// Whether angles are good everywhere and edges do not differ much from their neighbours.
    pub(super) fn is_even(&self) -> bool {
        self.largest_ratio <= LARGEST_RATIO
            && self.least_angle >= LEAST_ANGLE
            && self.largest_turn <= LARGEST_TURN
            && self.usual_turn <= USUAL_TURN
    }
}

/// Whether all edges are short against the vessel. Sets sizes.
pub(super) fn is_fine_enough(corners: &mut Corners, reference: &Reference, options: &Conditioning) -> bool {
    corners.set_normals();
    sizes::set(corners, reference, &[], options.wanted());
    (0..corners.half_edges()).filter(|&e| corners.leads(e)).all(|e| {
        let radius = |v: u32| corners.vertices[v as usize].radius_mm;
        corners.kind(corners.from(e)) == Kind::Locked
            || corners.length_mm(e) <= LONGEST * radius(corners.from(e)).max(radius(corners.to(e)))
    })
}
