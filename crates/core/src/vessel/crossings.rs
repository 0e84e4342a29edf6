//! Triangles of a surface that intersect.
//!
//! Nearly all pairs with overlapping boxes ([`super::boxes`]) are neighbours of a smooth surface; simple tests in plain
//! arithmetic, each with a margin far above its rounding, exclude most of them before exact predicates decide.

use super::boxes::{LEAF, Tree, meet};
use super::intersect::triangles_intersect;
use super::{SurfaceMesh, sliver};
use crate::Vec3;

/// Limits of the number of pairs of close triangles tested, per triangle and in all: a sound mesh needs about twenty
/// each.
const TRIES_EACH: usize = 64;
const TRIES_BEYOND: usize = 1_000_000;
/// Fraction of a triangle's size below which inexact tests treat a distance as rounding.
const MARGIN: f64 = 1e-9;

/// Pairs of triangles that intersect.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// Pairs, the smaller number first, sorted.
    pub(crate) pairs: Vec<[u32; 2]>,
    /// Whether a limit stopped the search: there may be more.
    pub(crate) capped: bool,
}

/// The intersecting pairs among the triangles with area, up to `limit`; with `marked` only pairs with a marked
/// member.
pub(crate) fn crossings(
    mesh: &SurfaceMesh,
    tolerance_mm: f64,
    marked: Option<&[bool]>,
    limit: usize,
) -> Crossings {
    let solid: Vec<u32> = (0..mesh.triangles.len() as u32)
        .filter(|&i| !sliver::is_degenerate(&mesh.corners(i as usize), tolerance_mm))
        .collect();
    let mut found = Crossings::default();
    let most = TRIES_EACH * solid.len() + TRIES_BEYOND;
    let tree = Tree::new(mesh, solid);
    let mut tried = 0;
    let (mut stack, mut close) = (Vec::new(), Vec::new());
    let is_marked = |t: u32| marked.is_none_or(|m| m[t as usize]);
    'leaves: for leaf in 0..tree.order.len().div_ceil(LEAF) {
        if !tree.leaf(leaf).any(|(_, t)| is_marked(t)) {
            continue;
        }
        // Without marks each pair is found from its earlier member. A marked triangle is tested against all others.
        tree.close_to(leaf, if marked.is_some() { 0 } else { leaf }, &mut stack, &mut close);
        for (place, a) in tree.leaf(leaf).filter(|(_, t)| is_marked(*t)) {
            let bounds = &tree.boxes[place];
            let near = close.iter().filter(|leaf| meet(bounds, &tree.nodes[tree.leaves + **leaf]));
            for (other, b) in near.flat_map(|leaf| tree.leaf(*leaf)) {
                let again = match marked {
                    Some(_) => a == b || (is_marked(b) && b < a),
                    None => other <= place,
                };
                if again || !meet(bounds, &tree.boxes[other]) {
                    continue;
                }
                tried += 1;
                let (first, second) = (mesh.triangles[a as usize], mesh.triangles[b as usize]);
                if !apart(&mesh.vertices_mm, first, second)
                    && triangles_intersect(&mesh.vertices_mm, first, second)
                {
                    found.pairs.push([a.min(b), a.max(b)]);
                }
                if found.pairs.len() >= limit || tried > most {
                    found.capped = true;
                    break 'leaves;
                }
            }
        }
    }
    found.pairs.sort_unstable();
    found
}

/// Whether two triangles are certainly apart, except for vertices that they share.
fn apart(vertices: &[Vec3], a: [u32; 3], b: [u32; 3]) -> bool {
    let at = |[a, b, c]: [u32; 3]| [vertices[a as usize], vertices[b as usize], vertices[c as usize]];
    let (pa, pb) = (at(a), at(b));
    let mut shared = (0..3).filter(|&k| b.contains(&a[k]));
    match (shared.next(), shared.next(), shared.next()) {
        (None, ..) => beside(&pa, &pb) || beside(&pb, &pa),
        (Some(k), None, _) => {
            let l = (0..3).find(|&l| b[l] == a[k]).unwrap_or(0);
            fans_apart(&pa, k, &pb, l) || fans_apart(&pb, l, &pa, k) || cones_apart(&pa, k, &pb, l)
        }
        (Some(k), Some(l), None) => {
            // Neighbours at an angle of more than a right angle, seen along their edge, are not folded.
            let along = pa[l] - pa[k];
            let free = |t: [u32; 3], other: [u32; 3]| (0..3).find(|&j| !other.contains(&t[j])).unwrap_or(0);
            let (p, q) = (pa[free(a, b)] - pa[k], pb[free(b, a)] - pa[k]);
            along.cross(&p).dot(&along.cross(&q)) < 0.0
        }
        _ => false,
    }
}

/// Whether `direction` times an offset of at most `reach` in length is positive beyond its rounding; squared, to
/// avoid roots.
fn clear(dot: f64, direction: &Vec3, reach_squared: f64) -> bool {
    dot > 0.0 && dot * dot > MARGIN * MARGIN * direction.norm_squared() * reach_squared
}

/// Whether all of `b` is beyond the plane of `a` or beyond one of its sides.
fn beside(a: &[Vec3; 3], b: &[Vec3; 3]) -> bool {
    let normal = (a[1] - a[0]).cross(&(a[2] - a[0]));
    let offsets = b.map(|p| p - a[0]);
    let size = (a[1] - a[0]).norm_squared().max((a[2] - a[0]).norm_squared());
    let reach = offsets.iter().map(Vec3::norm_squared).fold(4.0 * size, f64::max);
    let heights = offsets.map(|offset| normal.dot(&offset));
    if heights.iter().all(|h| clear(*h, &normal, reach)) || heights.iter().all(|h| clear(-h, &normal, reach))
    {
        return true;
    }
    (0..3).any(|k| {
        let outward = (a[(k + 1) % 3] - a[k]).cross(&normal);
        b.iter().all(|p| clear(outward.dot(&(p - a[k])), &outward, reach))
    })
}

/// Whether triangle `b` lies beyond one of the two sides of `a` that meet in their common corner (`k` of one, `l` of the other), or
/// on one side of its plane.
fn fans_apart(a: &[Vec3; 3], k: usize, b: &[Vec3; 3], l: usize) -> bool {
    let (next, last) = (a[(k + 1) % 3] - a[k], a[(k + 2) % 3] - a[k]);
    let normal = next.cross(&last);
    let others = [b[(l + 1) % 3] - b[l], b[(l + 2) % 3] - b[l]];
    let reach = next.norm_squared().max(last.norm_squared());
    let reach = others.iter().map(Vec3::norm_squared).fold(reach, f64::max);
    let beyond = |outward: Vec3| others.iter().all(|o| clear(outward.dot(o), &outward, reach));
    beyond(next.cross(&normal)) || beyond(normal.cross(&last)) || beyond(normal) || beyond(-normal)
}

/// Whether the circular cones about two triangles that share a corner (`k` of one, `l` of the other) share nothing
/// else.
fn cones_apart(a: &[Vec3; 3], k: usize, b: &[Vec3; 3], l: usize) -> bool {
    // Axis of the cone, and cosine and sine of its half angle.
    let cone = |t: &[Vec3; 3], k: usize| {
        let unit = |j: usize| (t[(k + j) % 3] - t[k]).normalize();
        let (u, v) = (unit(1), unit(2));
        let axis = (u + v).normalize();
        (axis, axis.dot(&u), (u - v).norm() / 2.0)
    };
    let ((m, cos_a, sin_a), (n, cos_b, sin_b)) = (cone(a, k), cone(b, l));
    // Half angles are below a right angle, so their sum is below two right angles.
    m.dot(&n) < cos_a * cos_b - sin_a * sin_b - MARGIN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_finds_what_trying_all_pairs_finds() {
        // Blades on a helix: some cross, most do not.
        let mut mesh = SurfaceMesh::default();
        for k in 0..120_u32 {
            let t = f64::from(k);
            let centre = Vec3::new((0.9 * t).cos() * 3.0, (0.9 * t).sin() * 3.0, 0.05 * t);
            mesh.vertices_mm.extend([0.0, 2.1, 4.2].map(|turn: f64| {
                centre + 0.7 * Vec3::new((turn + t).cos(), (turn + t).sin(), (turn - 2.0 * t).sin())
            }));
            mesh.triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
        }
        let all: Vec<[u32; 2]> = (0..120_u32)
            .flat_map(|a| (a + 1..120).map(move |b| [a, b]))
            .filter(|[a, b]| {
                let t = |i: &u32| mesh.triangles[*i as usize];
                triangles_intersect(&mesh.vertices_mm, t(a), t(b))
            })
            .collect();
        assert!(all.len() > 10, "{}", all.len());
        let found = crossings(&mesh, 0.0, None, usize::MAX);
        assert_eq!((found.pairs, found.capped), (all.clone(), false));
        let marked: Vec<bool> = (0..120).map(|k| k % 5 == 0).collect();
        let some: Vec<[u32; 2]> =
            all.iter().copied().filter(|pair| pair.iter().any(|t| marked[*t as usize])).collect();
        assert_eq!(crossings(&mesh, 0.0, Some(&marked), usize::MAX).pairs, some);
        assert!(crossings(&mesh, 0.0, None, 3).capped);
    }
}
