//! Exact test whether two triangles intersect.
//!
//! All decisions are signs of exact predicates (Shewchuk, "Adaptive precision floating-point arithmetic and fast
//! robust geometric predicates", 1997; crate `robust`), so that neighbours that merely touch never count as
//! intersecting.

use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::Vec3;

fn coord(v: &Vec3) -> Coord3D<f64> {
    Coord3D { x: v.x, y: v.y, z: v.z }
}

/// Sign of the volume of (a, b, c, d).
fn side(a: &Vec3, b: &Vec3, c: &Vec3, d: &Vec3) -> f64 {
    orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Whether segment p–q intersects or touches triangle `t`.
fn segment_meets(p: &Vec3, q: &Vec3, t: &[Vec3; 3]) -> bool {
    let [a, b, c] = t;
    let (below, above) = (side(a, b, c, p), side(a, b, c, q));
    if below == 0.0 && above == 0.0 {
        return flat_segment_meets(p, q, t);
    }
    if below * above > 0.0 {
        return false;
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    around.iter().all(|s| *s >= 0.0) || around.iter().all(|s| *s <= 0.0)
}

/// As [`segment_meets`], for a segment in the plane of the triangle.
fn flat_segment_meets(p: &Vec3, q: &Vec3, t: &[Vec3; 3]) -> bool {
    let normal = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let drop = normal.iamax();
    let flat = |v: &Vec3| Coord { x: v[(drop + 1) % 3], y: v[(drop + 2) % 3] };
    let (p, q, t) = (flat(p), flat(q), [flat(&t[0]), flat(&t[1]), flat(&t[2])]);
    let within = |v: Coord<f64>| {
        let signs = [0, 1, 2].map(|k| orient2d(t[k], t[(k + 1) % 3], v));
        signs.iter().all(|s| *s >= 0.0) || signs.iter().all(|s| *s <= 0.0)
    };
    within(p) || within(q) || (0..3).any(|k| segments_meet(p, q, t[k], t[(k + 1) % 3]))
}

fn segments_meet(a: Coord<f64>, b: Coord<f64>, c: Coord<f64>, d: Coord<f64>) -> bool {
    let apart = |from: f64, to: f64| from * to > 0.0;
    // Collinear segments are found by the caller's test for ends in triangles.
    !apart(orient2d(a, b, c), orient2d(a, b, d)) && !apart(orient2d(c, d, a), orient2d(c, d, b)) && {
        let collinear = orient2d(a, b, c) == 0.0 && orient2d(a, b, d) == 0.0;
        !collinear
    }
}

/// Opposite vertices of an edge on the same side of it within this angle (radians squared over two) are a fold.
const FOLD_COSINE: f64 = 1.0 - 1e-10;

/// Whether two triangles intersect, apart from the vertices they share. `a` and `b` are index triples into
/// `vertices`.
pub(crate) fn triangles_intersect(vertices: &[Vec3], a: [u32; 3], b: [u32; 3]) -> bool {
    let at = |t: [u32; 3]| t.map(|v| vertices[v as usize]);
    let (pa, pb) = (at(a), at(b));
    let shared: Vec<usize> = (0..3).filter(|&k| b.contains(&a[k])).collect();
    match shared.len() {
        0 => {
            (0..3).any(|k| segment_meets(&pa[k], &pa[(k + 1) % 3], &pb))
                || (0..3).any(|k| segment_meets(&pb[k], &pb[(k + 1) % 3], &pa))
        }
        1 => {
            // Only the edges opposite the common vertex can intersect.
            let k = shared[0];
            let other = (0..3).find(|&j| b[j] == a[k]).unwrap_or(0);
            segment_meets(&pa[(k + 1) % 3], &pa[(k + 2) % 3], &pb)
                || segment_meets(&pb[(other + 1) % 3], &pb[(other + 2) % 3], &pa)
        }
        2 => {
            let free = |t: [u32; 3], other: [u32; 3]| (0..3).find(|&k| !other.contains(&t[k])).unwrap_or(0);
            let edge = (pa[shared[1]] - pa[shared[0]]).normalize();
            let across = |p: Vec3| {
                let offset = p - pa[shared[0]];
                (offset - edge * edge.dot(&offset)).normalize()
            };
            across(pa[free(a, b)]).dot(&across(pb[free(b, a)])) > FOLD_COSINE
        }
        // Duplicates are reported separately.
        _ => false,
    }
}

/// Where a ray meets a triangle (Möller and Trumbore, 1997).
pub(super) fn ray_meets(from: &Vec3, way: &Vec3, [a, b, c]: [Vec3; 3]) -> Option<f64> {
    let (e, f) = (b - a, c - a);
    let p = way.cross(&f);
    let inverse = 1.0 / e.dot(&p);
    let s = from - a;
    let u = s.dot(&p) * inverse;
    let q = s.cross(&e);
    let v = way.dot(&q) * inverse;
    let distance = f.dot(&q) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0).then_some(distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHEET: [[f64; 3]; 3] = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.]];

    fn meets(second: [[f64; 3]; 3]) -> bool {
        let vertices: Vec<Vec3> = SHEET.iter().chain(&second).map(|p| Vec3::from(*p)).collect();
        triangles_intersect(&vertices, [0, 1, 2], [3, 4, 5])
    }

    #[test]
    fn crossing_and_touching_triangles_intersect_and_parallel_ones_do_not() {
        assert!(meets([[0.5, 0.5, -1.], [0.5, 0.5, 1.], [0.6, 3., 0.]]));
        assert!(meets([[0.5, 0.5, 0.], [0.5, 0.5, 1.], [0.6, 3., 1.]]), "touches with a vertex");
        assert!(meets([[0.5, 0.5, 0.], [3., 0.5, 0.], [3., 3., 0.]]), "coplanar overlap");
        assert!(meets([[-1., -1., 0.], [9., -1., 0.], [-1., 9., 0.]]), "coplanar, one inside the other");
        assert!(!meets([[0.5, 0.5, 1e-300], [0.5, 0.5, 1.], [0.6, 3., 1.]]), "just above");
        assert!(!meets([[3., 3., 0.], [4., 3., 0.], [3., 4., 0.]]), "coplanar, apart");
    }

    #[test]
    fn neighbours_intersect_only_if_folded() {
        let vertices = [
            [0., 0., 0.],
            [1., 0., 0.],
            [0., 1., 0.],
            [0., -1., 0.],
            [0.2, 0.8, 0.],
            [0.2, 0.8, 1e-3],
            [-1., -1., 0.],
        ]
        .map(Vec3::from);
        assert!(!triangles_intersect(&vertices, [0, 1, 2], [1, 0, 3]), "flat neighbours");
        assert!(triangles_intersect(&vertices, [0, 1, 2], [1, 0, 4]), "folded flat onto its neighbour");
        assert!(!triangles_intersect(&vertices, [0, 1, 2], [1, 0, 5]), "sharp, but open");
        assert!(!triangles_intersect(&vertices, [0, 1, 2], [0, 3, 6]), "fan around a vertex");
        assert!(triangles_intersect(&vertices, [0, 1, 2], [0, 4, 6]), "overlap around a vertex");
    }
}
