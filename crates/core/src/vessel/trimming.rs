//! Cuts jagged rims back to an even line.
//!
//! A surface cut out of a larger one along its triangles ends in teeth of one or two edges, each with its own
//! inclination. Extruded beyond the opening they would become furrows, with spikes between. So where a rim has teeth,
//! everything beyond an even line below them is cut off: with the height h of a point beyond the opening's plane and
//! its angle θ about its axis,
//!
//! ```text
//! φ = h − H(θ),    H(θ) = Σₖ aₖ cos kθ + bₖ sin kθ,  k = 0, 1, 2
//! ```
//!
//! is 0 on the line. H is fitted to the rim, by least squares over its length, and lowered until no tooth is below
//! it; k = 1 and 2 represent oblique rims and saddles. Triangles are cut where φ changes its sign along an edge.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{SMatrix, SVector};

use super::topology::{EdgeTable, NONE};
use super::{Opening, SurfaceMesh, Wall};
use crate::{Result, Vec3};

/// Largest height of teeth, in edges of the rim, that are left unchanged.
const EVEN: f64 = 0.4;
/// Largest depth of the cut, in radii of the opening.
const DEEPEST: f64 = 1.0;
/// Height beyond the line, in heights of the highest tooth, above which a part is not a tooth.
const BEYOND: f64 = 1.5;
/// Distance from the line, in edges of the rim, within which a vertex counts as on it, to avoid slivers.
const ON_LINE: f64 = 0.25;

/// The line to which a rim is cut back.
struct Line {
    opening: Opening,
    across: [Vec3; 2],
    heights: SVector<f64, 5>,
    /// Height of the highest tooth over it, mm.
    teeth_mm: f64,
    /// Mean edge of the rim, mm.
    edge_mm: f64,
}

impl Line {
    /// The line below the teeth of a rim; `None` if it has no teeth, or does not go around once.
    fn below(mesh: &SurfaceMesh, opening: &Opening) -> Option<Self> {
        let first = opening.direction.cross(&Vec3::ith(opening.direction.iamin(), 1.0)).normalize();
        let across = [first, opening.direction.cross(&first)];
        let count = opening.boundary.len();
        let edge_mm = opening.boundary_length_mm(mesh) / count as f64;
        let mut line =
            Self { opening: opening.clone(), across, heights: SVector::zeros(), teeth_mm: 0.0, edge_mm };
        let at = |k: usize| mesh.vertices_mm[opening.boundary[k % count] as usize];
        let mut matrix = SMatrix::<f64, 5, 5>::zeros();
        let mut right = SVector::<f64, 5>::zeros();
        for k in 0..count {
            let (height_mm, row) = line.seen(&at(k));
            let weight = (at(k + 1) - at(k)).norm() + (at(k + count - 1) - at(k)).norm();
            matrix += row * row.transpose() * weight;
            right += row * (height_mm * weight);
        }
        line.heights = matrix.cholesky()?.solve(&right);
        let [lowest, highest] =
            (0..count).map(|k| line.beyond_mm(&at(k))).fold([0.0f64; 2], |[a, b], h| [a.min(h), b.max(h)]);
        line.teeth_mm = highest - lowest;
        line.heights[0] += lowest;
        (line.teeth_mm > EVEN * edge_mm && line.teeth_mm <= DEEPEST * opening.radius_mm).then_some(line)
    }

    /// Height of a point beyond the opening's plane, mm, and the terms of H at its angle.
    fn seen(&self, x: &Vec3) -> (f64, SVector<f64, 5>) {
        let y = x - self.opening.centre_mm;
        let [u, v] = self.across.map(|axis| axis.dot(&y));
        let r = libm::hypot(u, v).max(f64::MIN_POSITIVE);
        let (cos, sin) = (u / r, v / r);
        (
            y.dot(&self.opening.direction),
            SVector::from([1.0, cos, sin, cos * cos - sin * sin, 2.0 * cos * sin]),
        )
    }

    /// φ, mm.
    fn beyond_mm(&self, x: &Vec3) -> f64 {
        let (height_mm, row) = self.seen(x);
        height_mm - self.heights.dot(&row)
    }

    /// The triangles of `mesh` that are partly beyond the line, from the rim on; `None` if they lead on to more than
    /// teeth.
    fn teeth(&self, mesh: &SurfaceMesh) -> Option<BTreeSet<u32>> {
        let across = EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len());
        let beyond = |v: u32| self.beyond_mm(&mesh.vertices_mm[v as usize]);
        let is_cut = |t: &u32| mesh.triangles[*t as usize].iter().any(|v| beyond(*v) > 0.0);
        let rim: BTreeSet<u32> = self.opening.boundary.iter().copied().collect();
        let at_rim = |t: &u32| mesh.triangles[*t as usize].iter().any(|v| rim.contains(v));
        let mut next: Vec<u32> =
            (0..mesh.triangles.len() as u32).filter(|t| at_rim(t) && is_cut(t)).collect();
        let mut found = BTreeSet::new();
        while let Some(triangle) = next.pop() {
            if !found.insert(triangle) {
                continue;
            }
            let corners = mesh.triangles[triangle as usize];
            if corners.iter().any(|v| beyond(*v) > BEYOND * self.teeth_mm) {
                return None;
            }
            let others = across[triangle as usize].into_iter().filter(|t| *t != NONE && is_cut(t));
            next.extend(others.filter(|t| !found.contains(t)));
        }
        Some(found)
    }

    /// Cuts off the parts of `teeth` beyond the line.
    fn cut(&self, mesh: &mut SurfaceMesh, teeth: &BTreeSet<u32>) {
        let height = |x: &Vec3| {
            let beyond_mm = self.beyond_mm(x);
            if beyond_mm.abs() < ON_LINE * self.edge_mm { 0.0 } else { beyond_mm }
        };
        cut_off(mesh, teeth, height);
    }
}

/// Cuts off what is above height 0 of some triangles. Heights of their vertices that should count as 0, to avoid slivers,
/// are to be 0.
pub(super) fn cut_off(mesh: &mut SurfaceMesh, part: &BTreeSet<u32>, height: impl Fn(&Vec3) -> f64) {
    let mut heights: BTreeMap<u32, f64> = BTreeMap::new();
    for v in part.iter().flat_map(|t| mesh.triangles[*t as usize]) {
        heights.insert(v, height(&mesh.vertices_mm[v as usize]));
    }
    let mut between: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut kept = Vec::new();
    for corners in part.iter().map(|t| mesh.triangles[*t as usize]) {
        let mut polygon = Vec::with_capacity(4);
        for k in 0..3 {
            let [v, w] = [corners[k], corners[(k + 1) % 3]];
            let [at, to] = [heights[&v], heights[&w]];
            if at <= 0.0 {
                polygon.push(v);
            }
            if at * to < 0.0 {
                let vertices = &mut mesh.vertices_mm;
                polygon.push(*between.entry((v.min(w), v.max(w))).or_insert_with(|| {
                    vertices.push(vertices[v as usize].lerp(&vertices[w as usize], at / (at - to)));
                    vertices.len() as u32 - 1
                }));
            }
        }
        // A triangle without a corner below the line is beyond it.
        if corners.iter().any(|v| heights[v] < 0.0) {
            let x = |k: usize| mesh.vertices_mm[polygon[k] as usize];
            match polygon[..] {
                [a, b, c] => kept.push([a, b, c]),
                [a, b, c, d] if (x(2) - x(0)).norm() <= (x(3) - x(1)).norm() => {
                    kept.extend([[a, b, c], [a, c, d]]);
                }
                [a, b, c, d] => kept.extend([[a, b, d], [b, c, d]]),
                _ => {}
            }
        }
    }
    let whole = (0..).zip(&mesh.triangles).filter(|(index, _)| !part.contains(index));
    mesh.triangles = whole.map(|(_, triangle)| *triangle).chain(kept).collect();
}

impl Wall {
    /// The wall with the teeth of its rims cut off; the wall itself if there are none.
    ///
    /// # Errors
    /// As [`Wall::welded`].
    pub fn with_even_rims(&self) -> Result<Cow<'_, Self>> {
        let lines: Vec<Line> =
            self.openings().iter().filter_map(|opening| Line::below(self.mesh(), opening)).collect();
        let mut changed = None;
        for line in lines {
            let mesh = changed.as_ref().unwrap_or(self.mesh());
            if let Some(teeth) = line.teeth(mesh) {
                line.cut(changed.get_or_insert_with(|| self.mesh().clone()), &teeth);
            }
        }
        changed.map_or(Ok(Cow::Borrowed(self)), |mesh| Self::welded(&mesh).map(Cow::Owned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tube of radius 5 mm along z with edges of about 1 mm, of which triangles at the upper end are removed if
    /// `is_off` holds for their middles.
    fn tube(is_off: impl Fn(&Vec3, u32) -> bool) -> Wall {
        let (rows, columns) = (24, 32);
        let mut mesh = SurfaceMesh::default();
        for j in 0..rows {
            for i in 0..columns {
                let angle = std::f64::consts::TAU * f64::from(i) / f64::from(columns);
                mesh.vertices_mm.push(Vec3::new(5.0 * angle.cos(), 5.0 * angle.sin(), f64::from(j)));
            }
        }
        for j in 0..rows - 1 {
            for i in 0..columns {
                let next = (i + 1) % columns;
                let [a, b, c, d] =
                    [(i, j), (next, j), (next, j + 1), (i, j + 1)].map(|(i, j)| j * columns + i);
                for triangle in [[a, b, c], [a, c, d]] {
                    let middle: Vec3 =
                        triangle.iter().map(|v| mesh.vertices_mm[*v as usize]).sum::<Vec3>() / 3.0;
                    if !is_off(&middle, i) {
                        mesh.triangles.push(triangle);
                    }
                }
            }
        }
        Wall::welded(&mesh).unwrap()
    }

    /// The surface of a wall whose rims were cut back; `None` if none was.
    fn trimmed(wall: &Wall) -> Option<SurfaceMesh> {
        match wall.with_even_rims().unwrap() {
            Cow::Borrowed(_) => None,
            Cow::Owned(wall) => Some(wall.mesh().clone()),
        }
    }

    /// Heights of the upper rim over the plane z = 15 + 0.3 x.
    fn rim(mesh: &SurfaceMesh) -> Vec<f64> {
        let wall = Wall::welded(mesh).unwrap();
        assert_eq!(wall.openings().len(), 2);
        let upper = wall.openings().iter().find(|o| o.centre_mm.z > 5.0).unwrap();
        let at = |v: &u32| wall.mesh().vertices_mm[*v as usize];
        upper.boundary.iter().map(|v| at(v).z - 15.0 - 0.3 * at(v).x).collect()
    }

    #[test]
    fn teeth_are_cut_off_along_an_even_line_and_the_rest_is_as_it_was() {
        let toothed = tube(|x, i| x.z > 15.0 + 0.3 * x.x + if i.is_multiple_of(3) { 1.2 } else { 0.0 });
        let spread = |heights: &[f64]| {
            let most = heights.iter().copied().fold(f64::MIN, f64::max);
            most - heights.iter().copied().fold(f64::MAX, f64::min)
        };
        let before = rim(toothed.mesh());
        let mesh = trimmed(&toothed).unwrap();
        let after = rim(&mesh);
        // Vertices within a quarter of an edge of the line are not moved.
        assert!(spread(&after) < 0.75 && spread(&before) > 1.8, "{} {}", spread(&after), spread(&before));
        // No lower than the deepest notch.
        let lowest = |heights: &[f64]| heights.iter().copied().fold(f64::MAX, f64::min);
        assert!(lowest(&after) > lowest(&before) - 0.6, "{} {}", lowest(&after), lowest(&before));
        // On the surface: nothing else of the tube's facets remains.
        assert!(mesh.vertices_mm.iter().all(|v| (4.95..=5.0 + 1e-9).contains(&v.xy().norm())));
        let below = |mesh: &SurfaceMesh| {
            let low = |t: &&[u32; 3]| t.iter().all(|v| mesh.vertices_mm[*v as usize].z < 11.0);
            mesh.triangles.iter().filter(low).count()
        };
        assert_eq!(below(&mesh), below(toothed.mesh()));
    }

    #[test]
    fn even_rims_stay() {
        assert!(trimmed(&tube(|x, _| x.z > 15.0)).is_none());
        let toothed = |x: &Vec3, i: u32| x.z > 15.0 + if i.is_multiple_of(3) { 1.2 } else { 0.0 };
        assert!(trimmed(&tube(toothed)).is_some(), "the twin");
    }

    #[test]
    fn what_is_higher_than_teeth_is_left_alone() {
        // Four tongues that protrude are not teeth.
        assert!(trimmed(&tube(|x, i| x.z > 12.0 + if i % 8 < 4 { 8.0 } else { 0.0 })).is_none());
        assert!(trimmed(&tube(|x, i| x.z > 12.0 + if i % 8 < 4 { 3.0 } else { 0.0 })).is_some(), "the twin");
    }
}
