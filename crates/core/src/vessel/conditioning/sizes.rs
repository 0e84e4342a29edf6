//! Target lengths of edges, and limits of the surface's motion.
//!
//! The local radius of the lumen is half the chord of a ray cast inward along the normal (as in the shape diameter
//! function of Shapira et al., *The Visual Computer* 24, 2008, with one ray), median filtered over neighbours. The
//! target length of edges is
//!
//! ```text
//! h = min(R / 2.2,  0.5 / κ,  √(2.4 R d),  2 mm)       not shorter than min(max(0.6 t, R / 3.5), 0.4 mm)
//! ```
//!
//! with the curvature κ of the conditioned surface so far, the limit t = min(deviation, R/20) and, at a septum of
//! thickness d, a sag h²/8R below 0.3 d. A kink of angle θ can be rounded within t by an arc of radius 8t/θ² and
//! length 8t/θ; with κ = θ²/8t the formula gives edges of 4 t/θ² there; R/3.5 and 0.4 mm are further lower bounds. κ
//! is measured on the resulting surface, not on the given triangles, so that kinks of a coarse mesh that vanish
//! within the limit cost nothing. Neighbouring lengths differ by at most 0.35 of their distance.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use super::corners::Corners;
use super::reference::Reference;
use crate::Vec3;

/// Edge length relative to the local radius: 22 around a tube, as many as the smooth wall needs to be practically
/// round.
const EDGE_PER_RADIUS: f64 = 1.0 / 2.2;
/// Longest edge, mm: some radii of a device. In wide vessels with coarse meshes every edge is a kink, which must be
/// rounded on the scale of a device: with edges up to six of its radii nearly all insertions succeeded, with ten and
/// more few.
const LONGEST_MM: f64 = 2.0;
/// Target for the largest angle between the normals at the ends of an edge, rad. With 1.0 the quadrics at the crests
/// of flow dividers stood 0.2 to 0.5 mm into the lumen, with kinks at which no equilibrium exists; with 0.4 edges are
/// so short that facets of coarse meshes are no longer faired.
const TURN: f64 = 0.5;
/// Shortest edge relative to the limit: the sharpest kink needs no shorter ones.
const FLOOR: f64 = 0.6;
/// Shortest edge relative to the local radius: the smooth wall rounds a kink over one or two edges by itself, and kinks of a
/// coarse mesh are long.
const FLOOR_PER_RADIUS: f64 = 1.0 / 3.5;
/// Upper bound of this shortest edge in wide vessels, mm: crests there are as sharp as in narrow ones, and must be accurate to about the
/// thickness of a wire.
const FLOOR_MM: f64 = 0.4;
/// Factor by which edges are shortened where the surfaces are farther apart than the limit.
const SHORTER: f64 = 0.65;
/// Smallest edge after shortening, as a fraction of the local radius.
const SHORTEST: f64 = 1.0 / 5.0;
/// Upper bound of the limit relative to the local radius.
const LIMIT_PER_RADIUS: f64 = 0.05;
/// Upper bound of the limit relative to the thickness of a septum: two sheets that both move leave a third of it.
const LIMIT_PER_SEPTUM: f64 = 0.33;
/// Where sheets already touch, lower bounds of the limit, and of the edge required by the radius: nothing keeps them
/// apart.
const TOUCHING: (f64, f64) = (0.2, 0.25);
/// Largest thickness of a septum that is detected, in limits.
const SEPTUM: f64 = 4.0;
/// Largest growth of target lengths per length.
const GRADING: f64 = 0.35;
/// Largest number of vertices from which rays are cast; others take the nearest one's radius.
const RAYS: usize = 20_000;
/// Hits of a ray within this fraction of the whole surface's size belong to its start.
const SKIP: f64 = 1e-5;
/// Smallest radius relative to the median of all: a smaller chord is that of a fold.
const LEAST_RADIUS: f64 = 0.3;
/// Radius that few devices pass, mm: a narrower passage, as beside a plug or a membrane, is meshed as if it were that wide.
const LEAST_RADIUS_MM: f64 = 0.2;
/// Triangles of edge h cover √3/4 h² each.
const COVER: f64 = 0.433;

/// Requirements of the whole mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted {
    pub(super) deviation_mm: f64,
    pub(super) most_triangles: usize,
}

/// Sets radius, limit and target length of all vertices. `curvature` is that of the surface so far, 1/mm, or empty at
/// first. Returns whether target lengths had to be raised to limit the number of triangles.
pub(super) fn set(corners: &mut Corners, reference: &Reference, curvature: &[f64], wanted: Wanted) -> bool {
    let septum = cast(corners, reference, wanted);
    let live: Vec<u32> = corners.live_vertices().collect();
    for &v in &live {
        let vertex = &mut corners.vertices[v as usize];
        let (radius, thick) = (vertex.radius_mm, septum[v as usize]);
        let limit = wanted.deviation_mm.min(LIMIT_PER_RADIUS * radius);
        vertex.limit_mm = (LIMIT_PER_SEPTUM * thick).clamp(TOUCHING.0 * limit, limit);
        let round = (EDGE_PER_RADIUS * radius).min(LONGEST_MM);
        let bend = curvature.get(v as usize).copied().unwrap_or(0.0);
        let length = round
            .min(TURN / bend.max(f64::MIN_POSITIVE))
            .min((2.4 * radius * thick).sqrt().max(TOUCHING.1 * round))
            .max((FLOOR * limit).max(FLOOR_PER_RADIUS * radius).min(FLOOR_MM));
        vertex.target_mm = length;
    }
    grade(corners);
    raise(corners, wanted.most_triangles)
}

/// Raises all target lengths until there are not too many triangles; returns whether that was needed.
fn raise(corners: &mut Corners, most_triangles: usize) -> bool {
    let raise = (expected_triangles(corners) / most_triangles as f64).sqrt();
    let needed = raise > 1.0 && raise.is_finite();
    if needed {
        corners.vertices.iter_mut().for_each(|v| v.target_mm *= raise);
    }
    needed
}

/// Shortens the target at some vertices; returns whether lengths had to be raised to limit the number of triangles.
pub(super) fn shorten(corners: &mut Corners, at: &[u32], wanted: Wanted) -> bool {
    for &v in at {
        let vertex = &mut corners.vertices[v as usize];
        let floor = SHORTEST * vertex.radius_mm;
        vertex.target_mm = vertex.target_mm.min((SHORTER * vertex.target_mm).max(floor));
    }
    grade(corners);
    raise(corners, wanted.most_triangles)
}

/// Number of triangles of the target size that cover the surface.
fn expected_triangles(corners: &Corners) -> f64 {
    let of = |t: usize| {
        let [a, b, c] = corners.positions(t as u32);
        let wanted: f64 =
            corners.triangles[t].iter().map(|&v| corners.vertices[v as usize].target_mm).sum::<f64>() / 3.0;
        (b - a).cross(&(c - a)).norm() / (2.0 * COVER * wanted * wanted)
    };
    (0..corners.triangles.len()).filter(|&t| corners.lives(3 * t as u32)).map(of).sum()
}

/// Sets all radii; returns the thickness of the septum behind each vertex, mm, infinite if none is near.
fn cast(corners: &mut Corners, reference: &Reference, wanted: Wanted) -> Vec<f64> {
    let count = corners.vertices.len();
    let live: Vec<u32> = corners.live_vertices().collect();
    let mut radius = vec![f64::NAN; count];
    let mut septum = vec![f64::INFINITY; count];
    let Some((low, high)) = reference.mesh.used_bounds_mm() else { return septum };
    let size_mm = (high - low).norm();
    let skip_mm = SKIP * size_mm;
    let stride = live.len().div_ceil(RAYS).max(1);
    for &v in live.iter().step_by(stride) {
        let vertex = &corners.vertices[v as usize];
        if vertex.normal == Vec3::zeros() {
            continue;
        }
        let start = vertex.at;
        if let Some(chord) = reference.cast(&start, &-vertex.normal, 1.0, skip_mm, size_mm) {
            radius[v as usize] = 0.5 * chord;
        }
        if let Some(thick) =
            reference.cast(&start, &vertex.normal, -1.0, skip_mm, SEPTUM * wanted.deviation_mm)
        {
            septum[v as usize] = thick;
        }
    }
    spread(corners, &mut radius, &mut septum);
    for _ in 0..2 {
        radius = medians(corners, &radius);
    }
    let mut sorted: Vec<f64> = live.iter().map(|&v| radius[v as usize]).filter(|r| r.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.5 * size_mm);
    let least = (LEAST_RADIUS * median).max(LEAST_RADIUS_MM).max(1e-6 * size_mm).max(f64::MIN_POSITIVE);
    for &v in &live {
        let r = radius[v as usize];
        corners.vertices[v as usize].radius_mm = if r.is_finite() { r.max(least) } else { median.max(least) };
    }
    septum
}

/// Propagates radii over the surface to vertices without one.
fn spread(corners: &Corners, radius: &mut [f64], septum: &mut [f64]) {
    let mut queue: VecDeque<u32> =
        corners.live_vertices().filter(|&v| radius[v as usize].is_finite()).collect();
    let (mut spokes, mut around) = (Vec::new(), Vec::new());
    while let Some(v) = queue.pop_front() {
        corners.spokes(v, &mut spokes);
        corners.neighbours(&spokes, &mut around);
        for &w in &around {
            if radius[w as usize].is_nan() {
                radius[w as usize] = radius[v as usize];
                septum[w as usize] = septum[w as usize].min(septum[v as usize]);
                queue.push_back(w);
            }
        }
    }
}

/// Lower median over each vertex and its neighbours.
fn medians(corners: &Corners, values: &[f64]) -> Vec<f64> {
    let mut found = values.to_vec();
    let (mut spokes, mut around, mut sorted) = (Vec::new(), Vec::new(), Vec::new());
    for v in corners.live_vertices() {
        corners.spokes(v, &mut spokes);
        corners.neighbours(&spokes, &mut around);
        sorted.clear();
        sorted.push(values[v as usize]);
        sorted.extend(around.iter().map(|&w| values[w as usize]));
        sorted.sort_by(f64::total_cmp);
        found[v as usize] = sorted[(sorted.len() - 1) / 2];
    }
    found
}

/// Lowers target lengths until neighbours differ by at most [`GRADING`] of their distance: shortest first, as in
/// Dijkstra's algorithm.
fn grade(corners: &mut Corners) {
    let mut heap: BinaryHeap<Reverse<(u64, u32)>> = corners
        .live_vertices()
        .map(|v| Reverse((corners.vertices[v as usize].target_mm.to_bits(), v)))
        .collect();
    let (mut spokes, mut around) = (Vec::new(), Vec::new());
    while let Some(Reverse((bits, v))) = heap.pop() {
        // Positive numbers sort like their bits.
        let target = corners.vertices[v as usize].target_mm;
        if target.to_bits() != bits {
            continue;
        }
        corners.spokes(v, &mut spokes);
        corners.neighbours(&spokes, &mut around);
        for &w in &around {
            let allowed = target + GRADING * (corners.at(v) - corners.at(w)).norm();
            if corners.vertices[w as usize].target_mm > allowed {
                corners.vertices[w as usize].target_mm = allowed;
                heap.push(Reverse((allowed.to_bits(), w)));
            }
        }
    }
}
