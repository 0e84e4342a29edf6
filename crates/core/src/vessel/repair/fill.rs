//! Triangulation of holes.
//!
//! Of all triangulations of the loop the one with the smallest maximal angle between neighbours, and among these the
//! one of smallest area: Liepa, "Filling holes in meshes", SGP 2003, after Barequet and Sharir, "Filling gaps in the
//! boundary of a polyhedron" (1995). The time is cubic in the loop's length, so long loops are first divided by
//! chords.

use crate::Vec3;
use crate::vessel::SurfaceMesh;
use crate::vessel::topology::EdgeTable;

/// Largest number of vertices of a loop that is triangulated at once, and of any loop.
const AT_ONCE: usize = 80;
const LONGEST: usize = 4000;

/// Largest angle, as 1 − cosine, and area of a triangulation.
type Weight = (f64, f64);

const NEVER: Weight = (f64::INFINITY, f64::INFINITY);

/// The loop's geometry and its forbidden chords.
struct Hole<'a> {
    mesh: &'a SurfaceMesh,
    table: &'a EdgeTable,
    rim: &'a [u32],
    /// Unit normal of the triangle on the other side of each edge of the loop.
    outer: Vec<Vec3>,
}

/// Triangles that close the loop `rim`, wound in its direction; `None` for a loop that is too long or cannot be
/// closed without an edge that the mesh already has. `table` is that of the mesh.
pub(super) fn fill(mesh: &SurfaceMesh, table: &EdgeTable, rim: &[u32]) -> Option<Vec<[u32; 3]>> {
    if rim.len() < 3 || rim.len() > LONGEST {
        return None;
    }
    let outer = (0..rim.len())
        .map(|k| {
            let (a, b) = (rim[k], rim[(k + 1) % rim.len()]);
            table
                .uses(a, b)
                .first()
                .map_or(Vec3::zeros(), |only| unit_normal(mesh.corners(only.triangle as usize)))
        })
        .collect();
    let hole = Hole { mesh, table, rim, outer };
    let mut triangles = Vec::with_capacity(rim.len() - 2);
    let all: Vec<usize> = (0..rim.len()).collect();
    hole.close(&all, &mut triangles)?;
    Some(triangles)
}

fn unit_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
}

impl Hole<'_> {
    fn at(&self, place: usize) -> Vec3 {
        self.mesh.vertices_mm[self.rim[place] as usize]
    }

    /// Whether two positions of the loop may be joined across the hole.
    fn may_join(&self, i: usize, k: usize) -> bool {
        let (i, k) = (i.min(k), i.max(k));
        k - i == 1
            || (i == 0 && k == self.rim.len() - 1)
            || self.table.uses(self.rim[i], self.rim[k]).is_empty()
    }

    /// Closes the loop of some positions, in order.
    fn close(&self, places: &[usize], triangles: &mut Vec<[u32; 3]>) -> Option<()> {
        if places.len() > AT_ONCE
            && let Some((i, k)) = self.chord(places)
        {
            self.close(&places[i..=k], triangles)?;
            let rest: Vec<usize> = places[..=i].iter().chain(&places[k..]).copied().collect();
            return self.close(&rest, triangles);
        }
        if places.len() > 4 * AT_ONCE { None } else { self.best(places, triangles) }
    }

    /// The chord that is shortest relative to the path around it and leaves a fifth of the loop on either side.
    fn chord(&self, places: &[usize]) -> Option<(usize, usize)> {
        let count = places.len();
        let mut best = (f64::INFINITY, None);
        for i in 0..count {
            for k in i + count / 5..(i + count - count / 5).min(count) {
                let length = (self.at(places[k]) - self.at(places[i])).norm();
                if length < best.0 && self.may_join(places[i], places[k]) {
                    best = (length, Some((i, k)));
                }
            }
        }
        best.1
    }

    /// The best triangulation of a loop of some positions, from the best ones of its parts.
    fn best(&self, places: &[usize], triangles: &mut Vec<[u32; 3]>) -> Option<()> {
        let n = places.len();
        let at: Vec<Vec3> = places.iter().map(|place| self.at(*place)).collect();
        // Weight, middle vertex and normal of the triangle over the chord from i to k.
        let mut weight = vec![(0.0, 0.0); n * n];
        let mut middle = vec![0_usize; n * n];
        let mut normal = vec![Vec3::zeros(); n * n];
        for i in 0..n - 1 {
            let is_rim = places[i + 1] - places[i] == 1;
            // A side that is a chord of the whole loop has no triangle yet.
            normal[i * n + i + 1] = if is_rim { self.outer[places[i]] } else { Vec3::zeros() };
        }
        let last_side = if places[0] == 0 && places[n - 1] == self.rim.len() - 1 {
            self.outer[places[n - 1]]
        } else {
            Vec3::zeros()
        };
        for span in 2..n {
            for i in 0..n - span {
                let k = i + span;
                let mut best = (NEVER, 0, Vec3::zeros());
                if span < n - 1 && !self.may_join(places[i], places[k]) {
                    weight[i * n + k] = NEVER;
                    continue;
                }
                for j in i + 1..k {
                    let (left, right) = (weight[i * n + j], weight[j * n + k]);
                    if left.0.max(right.0) > best.0.0 {
                        continue;
                    }
                    let cross = (at[j] - at[i]).cross(&(at[k] - at[i]));
                    let own = cross.try_normalize(0.0).unwrap_or_default();
                    let bend =
                        |other: &Vec3| if *other == Vec3::zeros() { 0.0 } else { 1.0 - own.dot(other) };
                    let mut worst = bend(&normal[i * n + j]).max(bend(&normal[j * n + k]));
                    if span == n - 1 {
                        worst = worst.max(bend(&last_side));
                    }
                    let worst = worst.max(left.0).max(right.0);
                    let total = (worst, left.1 + right.1 + cross.norm() / 2.0);
                    if total < best.0 {
                        best = (total, j, own);
                    }
                }
                (weight[i * n + k], middle[i * n + k], normal[i * n + k]) = best;
            }
        }
        if !weight[n - 1].1.is_finite() {
            return None;
        }
        let mut open = vec![(0, n - 1)];
        while let Some((i, k)) = open.pop() {
            if k - i < 2 {
                continue;
            }
            let j = middle[i * n + k];
            triangles.push([i, j, k].map(|place| self.rim[places[place]]));
            open.extend([(i, j), (j, k)]);
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::opening;

    /// A band of a cone frustum: two rings of `n`, the lower one of radius 1.
    fn band(n: u32) -> SurfaceMesh {
        let ring = |height: f64, radius: f64| {
            (0..n).map(move |k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
                Vec3::new(radius * cos, radius * sin, height)
            })
        };
        let triangles = (0..n)
            .flat_map(|k| {
                let l = (k + 1) % n;
                [[k, l, n + k], [l, n + l, n + k]]
            })
            .collect();
        SurfaceMesh { vertices_mm: ring(0.0, 1.0).chain(ring(1.0, 1.5)).collect(), triangles }
    }

    #[test]
    fn a_ring_of_any_length_is_closed_flat() {
        for n in [3, 4, 40, 500] {
            let mesh = band(n);
            let table = EdgeTable::new(&mesh.triangles);
            for opening in opening::boundary(&mesh, &EdgeTable::new(&mesh.triangles)).openings {
                let filled = fill(&mesh, &table, &opening.boundary).unwrap();
                assert_eq!(filled.len(), n as usize - 2);
                let mut closed = mesh.clone();
                closed.triangles = filled;
                let area = crate::vessel::check::area_mm2(&closed);
                let sides = f64::from(n);
                let radius = closed.corners(0)[0].xy().norm();
                let ring = 0.5 * sides * radius * radius * (std::f64::consts::TAU / sides).sin();
                assert!((area / ring - 1.0).abs() < 1e-9, "{n}: {area} {ring}");
            }
        }
    }

    #[test]
    fn an_edge_that_is_there_is_not_made_again() {
        // Two triangles of a tetrahedron: the loop's four vertices already have one edge across.
        let mesh = SurfaceMesh {
            vertices_mm: [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Vec3::from).to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3]],
        };
        let table = EdgeTable::new(&mesh.triangles);
        let rim = opening::boundary(&mesh, &EdgeTable::new(&mesh.triangles)).openings[0].boundary.clone();
        let filled = fill(&mesh, &table, &rim).unwrap();
        assert_eq!(filled.len(), 2);
        let closed: Vec<[u32; 3]> = mesh.triangles.iter().chain(&filled).copied().collect();
        assert_eq!(EdgeTable::new(&closed).edges().filter(|uses| uses.len() != 2).count(), 0);
    }
}
