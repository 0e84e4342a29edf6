//! Uniform triangles of target size on the given surface.
//!
//! After Botsch and Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004. One round:
//!
//! 1. Edges longer than 4/3 of the target are split, the longest first, until none is left or there are four times as
//!    many triangles as are wanted. A new vertex lies on the given surface, or in the middle of its edge where the
//!    nearest place on the surface is farther away than a quarter of the edge.
//! 2. Edges shorter than 4/5 of the target are collapsed in passes with bounds of 1/5, 2/5, 3/5 and 4/5, so that the
//!    shortest go first.
//! 3. Twice, edges are flipped towards six neighbours per vertex (four on a rim), unless a triangle becomes much
//!    worse, and free vertices are moved over the surface to the centroids of their surroundings, weighted by area
//!    over the fourth power of the target length (Du, Faber, Gunzburger, *SIAM Review* 41, 1999).
//!
//! After the last round, flips by the Delaunay criterion alternate with such moves, and a flip is the last.
//!
//! **What is refused.** A collapse, flip or move that turns a triangle by more than about 45° or makes a needle; a
//! needle may become better. A collapse that makes an edge longer than 1.4 of its target, unless it was about as long
//! before. A collapse, move or flip that takes the mesh farther from where it was than a fraction of the limit of
//! deviation: this preserves ridges and tips, but not the tips of folds. Vertices of a rim do not move; they are
//! removed only where the rim stays close to them, and only along it. Locked vertices, where the mesh is not a
//! manifold, are neither removed nor moved, no edge with one at its ends or opposite it is flipped, and an open edge
//! between two of them is not split.
//!
//! **Cutting off spikes** (`spikes`) uses `pull_together` and `flip_some`: between marked vertices short edges are
//! collapsed to their middles and edges are flipped, whatever the effect on the surface. All other vertices remain on
//! the given surface, except for the middles of step 1.
//!
//! All orders are fixed.

use super::corners::{Corners, Kind, Vertex, next, previous};
use super::reference::{Reference, square_to};
use crate::Vec3;
use crate::vessel::topology::NONE;

/// Edges longer than this fraction of the target are split.
const LONG: f64 = 4.0 / 3.0;
/// Edges shorter than these fractions of the target are collapsed, the shortest first.
const SHORT: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Longest edge, as a fraction of the target, that may result from a collapse.
const TOO_LONG: f64 = 1.4;
/// Where a spike is cut off, edges shorter than this fraction of the target are collapsed.
const TOGETHER: f64 = 0.5;
/// Largest number of halvings of one edge: from a metre to a micrometre.
const HALVINGS: usize = 20;
/// Number of passes of collapses with one bound; each finds less.
const PASSES: usize = 6;
/// Smallest cosine of the angle by which a triangle may rotate when a neighbour is collapsed or an edge flipped.
const LEAST_COSINE: f64 = 0.7;
/// Ratio of height to longest edge below which a triangle's normal is noise.
const NEEDLE: f64 = 0.02;
/// Distance from its destination, in target lengths, within which a vertex is not moved.
const AT_REST: f64 = 0.05;
/// Largest distance from the surface at which a collapsed and a moved vertex may leave a point behind, in limits:
/// this preserves ridges and tips.
const LEFT: (f64, f64) = (0.8, 0.5);
/// Cosine between a vertex's normal and those of its triangles below which it is the tip of a fold, which need not be
/// preserved.
const FOLDED: f64 = 0.2;
/// Largest distance of a removed vertex of a rim from the remaining rim, in limits.
const RIM: f64 = 0.25;
/// Largest distance of a flipped edge from its old triangles, in limits.
const FLIP: f64 = 0.5;

/// Editing of a mesh on a surface.
pub(super) struct Remesher<'a, 'b> {
    pub(super) reference: &'a Reference<'b>,
    pub(super) most_triangles: usize,
}

impl Remesher<'_, '_> {
    /// Runs this many rounds of splits, collapses, flips and smoothing.
    pub(super) fn run(&self, corners: &mut Corners, rounds: usize) {
        for _ in 0..rounds {
            self.split(corners);
            collapse(corners);
            corners.compact();
            for _ in 0..2 {
                flip(corners, by_valence);
                corners.set_normals();
                self.even_out(corners);
            }
        }
        for _ in 0..2 {
            flip(corners, by_angles);
            corners.set_normals();
            self.even_out(corners);
        }
        flip(corners, by_angles);
        corners.set_normals();
    }

    fn split(&self, corners: &mut Corners) {
        for _ in 0..HALVINGS {
            let mut long: Vec<(f64, u32)> = (0..corners.half_edges())
                .filter(|&e| corners.leads(e))
                .map(|e| (corners.length_mm(e) / corners.target_mm(e), e))
                .filter(|(ratio, e)| *ratio > LONG && may_split(corners, *e))
                .collect();
            if long.is_empty() || corners.triangles.len() > 4 * self.most_triangles {
                return;
            }
            long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (ratio, e) in long {
                // Splits next to it have left it unchanged, or halved it.
                if corners.length_mm(e) / corners.target_mm(e) > 0.75 * ratio {
                    let middle = self.middle(corners, e);
                    corners.split(e, middle);
                }
            }
        }
    }

    /// The vertex to be inserted on an edge.
    fn middle(&self, corners: &Corners, e: u32) -> Vertex {
        let (a, b) = (&corners.vertices[corners.from(e) as usize], &corners.vertices[corners.to(e) as usize]);
        let open = corners.twin(e) == NONE;
        let x = 0.5 * (a.at + b.at);
        let (one, other) = (self.reference.walk(&x, a.place), self.reference.walk(&x, b.place));
        let foot = if other.square < one.square { other } else { one };
        // A foot farther away than a quarter of the edge belongs elsewhere.
        let near = foot.square < 0.0625 * (b.at - a.at).norm_squared();
        Vertex {
            at: if near { foot.at } else { x },
            normal: (a.normal + b.normal).try_normalize(1e-6).unwrap_or(a.normal),
            place: foot.triangle,
            kind: if open { Kind::Rim } else { Kind::Free },
            target_mm: 0.5 * (a.target_mm + b.target_mm),
            radius_mm: 0.5 * (a.radius_mm + b.radius_mm),
            limit_mm: a.limit_mm.min(b.limit_mm),
        }
    }

    /// Moves free vertices to the centroids of their surroundings, over the surface.
    fn even_out(&self, corners: &mut Corners) {
        let mut spokes = Vec::new();
        for v in 0..corners.vertices.len() as u32 {
            if corners.kind(v) != Kind::Free {
                continue;
            }
            corners.spokes(v, &mut spokes);
            if spokes.is_empty() {
                continue;
            }
            let vertex = corners.vertices[v as usize];
            let (mut sum, mut total) = (Vec3::zeros(), 0.0);
            for &e in &spokes {
                let [a, b, c] = corners.positions(e / 3);
                let wanted: f64 = corners.triangles[e as usize / 3]
                    .iter()
                    .map(|&w| corners.vertices[w as usize].target_mm)
                    .sum();
                let weight = (b - a).cross(&(c - a)).norm() / (wanted * wanted).powi(2);
                sum += (a + b + c) * (weight / 3.0);
                total += weight;
            }
            let way = sum / total - vertex.at;
            let way = way - vertex.normal * vertex.normal.dot(&way);
            // Nothing to gain, or NaN.
            let square = way.norm_squared();
            if !square.is_finite() || square <= (AT_REST * vertex.target_mm).powi(2) {
                continue;
            }
            for part in [1.0, 0.4] {
                let foot = self.reference.walk(&(vertex.at + way * part), vertex.place);
                if stays_sound(corners, &spokes, &foot.at) && keeps(corners, &spokes, &foot.at, None, LEFT.1)
                {
                    corners.vertices[v as usize].at = foot.at;
                    corners.vertices[v as usize].place = foot.triangle;
                    break;
                }
            }
        }
    }
}

fn may_split(corners: &Corners, e: u32) -> bool {
    // An open edge between locked vertices belongs to many triangles, and must stay one edge for all of them.
    corners.twin(e) != NONE
        || (corners.kind(corners.from(e)) == Kind::Rim || corners.kind(corners.to(e)) == Kind::Rim)
}

/// Twice the area as a vector, and the square of the longest edge.
fn shape([a, b, c]: &[Vec3; 3]) -> (Vec3, f64) {
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    ((b - a).cross(&(c - a)), longest)
}

/// Whether a triangle may become another: it keeps its direction, or that of the surface if it was a needle; no new
/// needles.
fn may_become(before: &[Vec3; 3], after: &[Vec3; 3], normal: &Vec3) -> bool {
    let ((old, old_square), (new, new_square)) = (shape(before), shape(after));
    let (old_area, new_area) = (old.norm(), new.norm());
    let was_needle = old_area <= NEEDLE * old_square;
    if new_area <= NEEDLE * new_square {
        // An improvement of a bad triangle.
        return was_needle && new_area * old_square > old_area * new_square;
    }
    if was_needle {
        return normal.dot(&new) > 0.3 * new_area;
    }
    old.dot(&new) > LEAST_COSINE * old_area * new_area
}

/// Whether the triangles around a vertex stay valid when it moves.
fn stays_sound(corners: &Corners, spokes: &[u32], to: &Vec3) -> bool {
    spokes.iter().all(|&e| {
        let before = corners.positions(e / 3);
        let mut after = before;
        after[e as usize % 3] = *to;
        may_become(&before, &after, &corners.vertices[corners.from(e) as usize].normal)
    })
}

/// Whether the surface at the vertex with these spokes stays within this many limits of its position when the vertex
/// moves, onto a neighbour if given.
fn keeps(corners: &Corners, spokes: &[u32], to: &Vec3, onto: Option<u32>, limits: f64) -> bool {
    let Some(first) = spokes.first() else { return true };
    let vertex = &corners.vertices[corners.from(*first) as usize];
    let folded = |e: &u32| {
        let (normal, _) = shape(&corners.positions(e / 3));
        normal.dot(&vertex.normal) < FOLDED * normal.norm()
    };
    if spokes.iter().any(folded) {
        return true;
    }
    let allowed = (limits * vertex.limit_mm).powi(2);
    spokes.iter().filter(|&&e| onto.is_none_or(|v| !corners.triangles[e as usize / 3].contains(&v))).any(
        |&e| {
            let mut after = corners.positions(e / 3);
            after[e as usize % 3] = *to;
            square_to(&vertex.at, &after) <= allowed
        },
    )
}

fn collapse(corners: &mut Corners) {
    let mut work = Work::default();
    for bound in SHORT {
        for _ in 0..PASSES {
            let mut count = 0;
            for e in 0..corners.half_edges() {
                if corners.leads(e) && corners.length_mm(e) < bound * corners.target_mm(e) {
                    count += usize::from(try_collapse(corners, e, &mut work));
                }
            }
            if count * 200 < corners.triangles.len() {
                break;
            }
            corners.compact();
        }
    }
}

/// Collapses short edges between `marked` vertices, whatever the effect on the surface.
pub(super) fn pull_together(corners: &mut Corners, marked: &[bool]) {
    let mut work = Work::default();
    for e in 0..corners.half_edges() {
        if !corners.lives(e)
            || !marked[corners.from(e) as usize]
            || !corners.leads(e)
            || corners.twin(e) == NONE
            || corners.length_mm(e) >= TOGETHER * corners.target_mm(e)
            || [corners.from(e), corners.to(e)]
                .iter()
                .any(|&v| !marked[v as usize] || corners.kind(v) != Kind::Free)
        {
            continue;
        }
        work.look(corners, [corners.from(e), corners.to(e)]);
        if corners.may_collapse(e, &work.around[0], &work.around[1]) {
            let middle = 0.5 * (corners.at(corners.from(e)) + corners.at(corners.to(e)));
            let kept = corners.to(e);
            corners.collapse(e, false, &work.spokes[0]);
            corners.vertices[kept as usize].at = middle;
        }
    }
}

#[derive(Default)]
struct Work {
    spokes: [Vec<u32>; 2],
    around: [Vec<u32>; 2],
}

impl Work {
    fn look(&mut self, corners: &Corners, ends: [u32; 2]) {
        for k in 0..2 {
            corners.spokes(ends[k], &mut self.spokes[k]);
            corners.neighbours(&self.spokes[k], &mut self.around[k]);
        }
    }
}

fn try_collapse(corners: &mut Corners, e: u32, work: &mut Work) -> bool {
    let ends = [corners.from(e), corners.to(e)];
    let kinds = ends.map(|v| corners.kind(v));
    let open = corners.twin(e) == NONE;
    if kinds.contains(&Kind::Locked) || (kinds == [Kind::Rim; 2] && !open) {
        return false;
    }
    work.look(corners, ends);
    if !corners.may_collapse(e, &work.around[0], &work.around[1]) {
        return false;
    }
    // The end to remove: a rim is not pulled inwards; otherwise the one whose removal leaves shorter edges.
    let longest = |gone: usize| -> Option<f64> {
        if kinds[gone] == Kind::Rim
            && (kinds[1 - gone] != Kind::Rim
                || !rim_stays(corners, ends[gone], ends[1 - gone], &work.spokes[gone]))
        {
            return None;
        }
        let to = corners.at(ends[1 - gone]);
        let mut longest = 0.0f64;
        for &s in &work.spokes[gone] {
            let triangle = corners.triangles[s as usize / 3];
            if triangle.contains(&ends[1 - gone]) {
                continue;
            }
            let before = corners.positions(s / 3);
            let mut after = before;
            after[s as usize % 3] = to;
            if !may_become(&before, &after, &corners.vertices[ends[1 - gone] as usize].normal) {
                return None;
            }
            for w in [corners.to(s), corners.apex(s)] {
                let target = 0.5
                    * (corners.vertices[w as usize].target_mm
                        + corners.vertices[ends[1 - gone] as usize].target_mm);
                let ratio = (corners.at(w) - to).norm() / target;
                // An edge that was as long before is permitted: otherwise a needle's other end would go first.
                if ratio > TOO_LONG
                    && (corners.at(w) - corners.at(ends[gone])).norm() < 0.95 * (corners.at(w) - to).norm()
                {
                    return None;
                }
                longest = longest.max(ratio);
            }
        }
        keeps(corners, &work.spokes[gone], &to, Some(ends[1 - gone]), LEFT.0).then_some(longest)
    };
    let gone = match (longest(0), longest(1)) {
        (Some(a), Some(b)) => usize::from(b < a),
        (Some(_), None) => 0,
        (None, Some(_)) => 1,
        (None, None) => return false,
    };
    corners.collapse(e, gone == 1, &work.spokes[gone]);
    true
}

/// Whether a rim without one of its vertices stays close to it.
fn rim_stays(corners: &Corners, gone: u32, kept: u32, spokes: &[u32]) -> bool {
    let ends = spokes.iter().flat_map(|&s| {
        let leaving = (corners.twin(s) == NONE).then(|| corners.to(s));
        let coming = (corners.twin(previous(s)) == NONE).then(|| corners.apex(s));
        [leaving, coming].into_iter().flatten()
    });
    let Some(other) = ends.into_iter().find(|&v| v != kept) else { return false };
    let (x, a, b) = (corners.at(gone), corners.at(kept), corners.at(other));
    let way = b - a;
    let along = (way.dot(&(x - a)) / way.norm_squared()).clamp(0.0, 1.0);
    let limit = RIM * corners.vertices[gone as usize].limit_mm;
    (a + way * along - x).norm_squared() <= limit * limit
}

/// The two triangles of an edge a–b, with corners c and d across, and the excess of their numbers of neighbours.
pub(super) struct Pair {
    at: [Vec3; 4],
    excess: [i32; 4],
}

/// Brings valences closer to six, without a much sharper corner.
fn by_valence(pair: &Pair) -> bool {
    let sum = |change: [i32; 4]| (0..4).map(|k| (pair.excess[k] + change[k]).pow(2)).sum::<i32>();
    let [a, b, c, d] = pair.at;
    let before = quality(&[a, b, c]).min(quality(&[b, a, d]));
    let after = quality(&[a, d, c]).min(quality(&[b, c, d]));
    sum([-1, -1, 1, 1]) < sum([0; 4]) && after > 0.5 * before
}

/// The angles opposite the edge sum to more than π (the Delaunay criterion).
pub(super) fn by_angles(pair: &Pair) -> bool {
    let [a, b, c, d] = pair.at;
    let angle = |at: Vec3| libm::atan2((a - at).cross(&(b - at)).norm(), (a - at).dot(&(b - at)));
    angle(c) + angle(d) > std::f64::consts::PI + 1e-3
}

/// Twice the ratio of inscribed to circumscribed radius: 1 for equilateral, 0 for degenerate triangles.
fn quality(t: &[Vec3; 3]) -> f64 {
    let [a, b, c] = [(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()];
    (a + b - c) * (b + c - a) * (c + a - b) / (a * b * c).max(f64::MIN_POSITIVE)
}

fn flip(corners: &mut Corners, wanted: fn(&Pair) -> bool) {
    flip_some(corners, wanted, None);
}

/// Flips edges; if `marked` is given only those between marked vertices, without regard to the surface.
pub(super) fn flip_some(corners: &mut Corners, wanted: fn(&Pair) -> bool, marked: Option<&[bool]>) {
    let mut excess: Vec<i32> =
        corners.vertices.iter().map(|v| if v.kind == Kind::Rim { -4 } else { -6 }).collect();
    for e in (0..corners.half_edges()).filter(|&e| corners.leads(e)) {
        excess[corners.from(e) as usize] += 1;
        excess[corners.to(e) as usize] += 1;
    }
    let (mut spokes, mut around) = (Vec::new(), Vec::new());
    for e in 0..corners.half_edges() {
        let back = corners.twin(e);
        if !corners.leads(e)
            || back == NONE
            || marked.is_some_and(|m| !m[corners.from(e) as usize] || !m[corners.to(e) as usize])
        {
            continue;
        }
        let quad = [corners.from(e), corners.to(e), corners.apex(e), corners.apex(back)];
        if quad[2] == quad[3] || quad.iter().any(|&v| corners.kind(v) == Kind::Locked) {
            continue;
        }
        let at = quad.map(|v| corners.at(v));
        if !wanted(&Pair { at, excess: quad.map(|v| excess[v as usize]) })
            || !(marked.is_some() || may_flip(corners, quad, &at))
        {
            continue;
        }
        corners.spokes(quad[2], &mut spokes);
        corners.neighbours(&spokes, &mut around);
        // A corner keeps three neighbours, one on a rim two.
        if around.contains(&quad[3]) || excess[quad[0] as usize] <= -3 || excess[quad[1] as usize] <= -3 {
            continue;
        }
        corners.flip(e);
        for (v, change) in quad.into_iter().zip([-1, -1, 1, 1]) {
            excess[v as usize] += change;
        }
    }
    debug_assert!(
        (0..corners.half_edges())
            .filter(|&e| corners.lives(e))
            .all(|e| corners.to(e) == corners.from(next(e)))
    );
}

/// Whether the surface stays in place and keeps its direction when an edge is flipped.
fn may_flip(corners: &Corners, quad: [u32; 4], [a, b, c, d]: &[Vec3; 4]) -> bool {
    let normal: Vec3 = quad.iter().map(|&v| corners.vertices[v as usize].normal).sum();
    let normal = normal.try_normalize(1e-6).unwrap_or_default();
    let (old, new) = ([[*a, *b, *c], [*b, *a, *d]], [[*a, *d, *c], [*b, *c, *d]]);
    if !new.iter().all(|n| old.iter().all(|o| may_become(o, n, &normal))) {
        return false;
    }
    // Distance between the two diagonals.
    let across = (b - a).cross(&(d - c));
    let size = across.norm();
    let limit = quad.iter().map(|&v| corners.vertices[v as usize].limit_mm).fold(f64::MAX, f64::min);
    size > 0.0 && (across.dot(&(c - a)) / size).abs() <= FLIP * limit.max(0.02 * (b - a).norm())
}
