//! Whether a mesh is good enough as it is, and how uniform it is.

use super::corners::{Corners, Kind};
use crate::vessel::topology::NONE;

/// Largest ratio of longest to shortest edge around a vertex: a regular grid three times as long as wide has √10.
const LARGEST_RATIO: f64 = 4.0;
/// Smallest angle, rad: that grid has 18°.
const LEAST_ANGLE: f64 = 0.2;
/// Largest angle between neighbouring triangles, rad: at bifurcations even a fine mesh has a few such edges.
const LARGEST_TURN: f64 = 1.5;
/// Largest 99th percentile of angles between neighbours, rad: nine edges around a tube have 40°.
const USUAL_TURN: f64 = 0.75;
/// Largest ratio of an edge to the local radius.
const LONGEST: f64 = 1.6;
/// Sine of a difference of angles that counts as rounding.
const DOUBT: f64 = 1e-9;

/// Angles and edges of a mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Evenness {
    pub(super) edge_min_mm: f64,
    pub(super) edge_median_mm: f64,
    pub(super) edge_max_mm: f64,
    pub(super) least_angle: f64,
    pub(super) largest_turn: f64,
    /// 99th percentile of angles between neighbouring triangles, rad.
    pub(super) usual_turn: f64,
    pub(super) largest_ratio: f64,
}

impl Evenness {
    /// For the mesh with vertices at `at`.
    pub(super) fn of(corners: &Corners, at: impl Fn(u32) -> crate::Vec3) -> Self {
        let mut edges = Vec::new();
        let mut extremes = vec![(f64::MAX, 0.0f64); corners.vertices.len()];
        // The smallest angle, and its sine and cosine times an arbitrary length.
        let (mut least_angle, mut least) = (f64::MAX, (0.0, -1.0));
        let mut cosines = Vec::new();
        let normal = |t: u32| {
            let [a, b, c] = corners.triangles[t as usize].map(&at);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        };
        for e in (0..corners.half_edges()).filter(|&e| corners.lives(e)) {
            let (a, b, c) = (corners.from(e), corners.to(e), corners.apex(e));
            let (x, y) = (at(b) - at(a), at(c) - at(a));
            let (sine, cosine) = (x.cross(&y).norm(), x.dot(&y));
            // The sine of the difference excludes nearly all, without an arc tangent.
            let beyond = sine * least.1 - cosine * least.0;
            if beyond.is_nan() || beyond <= DOUBT * (sine + cosine.abs()) * (least.0 + least.1.abs()) {
                let angle = libm::atan2(sine, cosine);
                if angle < least_angle {
                    (least_angle, least) = (angle, (sine, cosine));
                }
            }
            if !corners.leads(e) {
                continue;
            }
            let length = x.norm();
            edges.push(length);
            for v in [a, b] {
                let (shortest, longest) = &mut extremes[v as usize];
                (*shortest, *longest) = (shortest.min(length), longest.max(length));
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
            largest_turn: libm::acos(cosines.iter().copied().fold(1.0, f64::min)),
            usual_turn: cosines.get(one_in_hundred).map_or(0.0, |c| libm::acos(*c)),
            largest_ratio,
        }
    }

    /// Whether angles are good everywhere and edges resemble their neighbours.
    pub(super) fn is_even(&self) -> bool {
        self.largest_ratio <= LARGEST_RATIO
            && self.least_angle >= LEAST_ANGLE
            && self.largest_turn <= LARGEST_TURN
            && self.usual_turn <= USUAL_TURN
    }
}

/// Whether all edges are short relative to the vessel, whose sizes are set.
pub(super) fn is_fine_enough(corners: &Corners) -> bool {
    (0..corners.half_edges()).filter(|&e| corners.leads(e)).all(|e| {
        let radius = |v: u32| corners.vertices[v as usize].radius_mm;
        corners.kind(corners.from(e)) == Kind::Locked
            || corners.length_mm(e) <= LONGEST * radius(corners.from(e)).max(radius(corners.to(e)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::random::{splitmix64, unit};
    use crate::vessel::SurfaceMesh;

    #[test]
    fn the_least_angle_is_that_of_all_angles_to_the_bit() {
        for seed in 0..50 {
            // Unconnected triangles, some nearly equal and some without an area.
            let mut mesh = SurfaceMesh::default();
            for k in 0..20_u32 {
                let like = if k % 3 == 0 { 0 } else { k };
                let at = |n: u32| unit(splitmix64(seed, u64::from(9 * like + n)));
                let corner = |n: u32| Vec3::new(at(n), at(n + 1), at(n + 2)) * (1.0 + f64::from(k));
                mesh.vertices_mm.extend([0, 3, 6].map(corner));
                mesh.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
            }
            if seed == 7 {
                mesh.vertices_mm[31] = mesh.vertices_mm[30];
            }
            let corners = Corners::new(&mesh, 0.1);
            let angle = |[a, b, c]: [Vec3; 3]| {
                let (x, y) = (b - a, c - a);
                libm::atan2(x.cross(&y).norm(), x.dot(&y))
            };
            let least = (0..mesh.triangles.len())
                .map(|t| mesh.corners(t))
                .flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]])
                .map(angle)
                .fold(f64::MAX, f64::min);
            assert_eq!(Evenness::of(&corners, |v| corners.at(v)).least_angle, least, "{seed}");
        }
    }
}
