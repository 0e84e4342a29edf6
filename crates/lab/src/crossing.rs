//! Whether a device passes through a triangle of a surface, and whether its report of the penetration there is
//! correct.
//!
//! An independent check: it shares no code with the queries of the simulation, and uses the triangles as given,
//! before any repair.
//!
//! A soft wall yields, and the axis of a device may be behind it. Where the axis meets a triangle, the penetration is
//! its radius r; where it is D behind, r + D. A depth changes by at most the distance along the device, so a contact
//! at a distance a must report at least r + D − a ([`CrossingTest::missing_mm`]). A device that has come through the
//! wall reports less.

use std::collections::BTreeMap;

use endowire_core::Vec3;
use endowire_core::insertion::Simulation;
use endowire_core::shape::Shape;
use endowire_core::vessel::{NoStore, SurfaceMesh, Wall};

/// Number of chords per element: with 4, the error for a curve of radius 10 mm in an element of 5 mm is within 0.02
/// mm.
const CHORDS: usize = 4;

/// Smallest size of a grid's cell, mm.
const LEAST_CELL_MM: f64 = 0.5;
/// Largest number of cells along the longest edge of a triangle: one huge triangle among small ones must not fill
/// millions of cells.
const MOST_CELLS_ALONG: f64 = 32.0;

/// Upper bound of half the distance between contact points, in radii.
const APART_RADII: f64 = 1.5;
/// Distance from an opening's axis, in its radii, within which there is no wall beyond the opening's plane.
const BESIDE_RADII: f64 = 2.0;
/// Larger depths behind the triangles are reported as this, mm.
const FARTHEST_MM: f64 = 20.0;

/// Largest distance of the contact surface from the triangles, mm.
const FELT_MM: f64 = 0.1;
/// The same in edges: a smooth wall that turns by a radian along an edge is an eighth of it away from its middle.
const FELT_EDGES: f64 = 0.125;

/// The triangles of a mesh in the cells of a grid, for testing lines against them.
#[derive(Debug)]
pub struct CrossingTest {
    triangles: Vec<[Vec3; 3]>,
    /// Mean length of an edge, mm.
    pub edge_mm: f64,
    cell_mm: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
}

impl CrossingTest {
    /// Prepares the test of lines against `mesh`.
    pub fn new(mesh: &SurfaceMesh) -> Self {
        let triangles: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
        let edges: f64 = triangles.iter().map(|[a, b, _]| (b - a).norm()).sum();
        let longest = triangles.iter().map(|[a, b, c]| (a.sup(b).sup(c) - a.inf(b).inf(c)).amax());
        let edge_mm = edges / triangles.len().max(1) as f64;
        let cell_mm = (2.0 * edge_mm).max(longest.fold(0.0, f64::max) / MOST_CELLS_ALONG).max(LEAST_CELL_MM);
        let mut test = Self { triangles, edge_mm, cell_mm, cells: BTreeMap::new() };
        for i in 0..test.triangles.len() {
            let [a, b, c] = test.triangles[i];
            let normal = (b - a).cross(&(c - a));
            // A cell that the triangle's plane passes by has nothing of it; with room for rounding.
            let half = 0.501 * cell_mm * normal.abs().sum();
            for cell in test.cells_of(&a.inf(&b).inf(&c), &a.sup(&b).sup(&c)) {
                let middle = Vec3::from(cell.map(|k| (k as f64 + 0.5) * cell_mm));
                if (middle - a).dot(&normal).abs() <= half {
                    test.cells.entry(cell).or_default().push(i as u32);
                }
            }
        }
        test
    }

    fn cells_of(&self, low: &Vec3, high: &Vec3) -> impl Iterator<Item = [i64; 3]> + use<> {
        let [low, high] = [low, high].map(|x| x.map(|c| (c / self.cell_mm).floor() as i64));
        (low.x..=high.x)
            .flat_map(move |x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| [x, y, z])))
    }

    /// Where the straight path from one point to another first passes through a triangle, as a fraction of the path.
    fn first_met(&self, from: Vec3, to: Vec3) -> Option<f64> {
        let cells = self.cells_of(&from.inf(&to), &from.sup(&to));
        let near = cells.flat_map(|cell| self.cells.get(&cell).into_iter().flatten());
        near.filter_map(|&i| passes(&self.triangles[i as usize], from, to)).min_by(f64::total_cmp)
    }

    /// Whether any segment of the line through `points` passes through a triangle.
    pub fn crosses(&self, points: &[Vec3]) -> bool {
        points.windows(2).any(|ends| self.first_met(ends[0], ends[1]).is_some())
    }

    /// By how much the penetration reported by the device is too small, mm, where it passes through a triangle and
    /// beyond; `None` if it passes through none. If the device was pressed in, this is at most the distance between
    /// the contact surface and the triangles. `wall`, made of these triangles, distinguishes inside from outside.
    pub fn missing_mm(&self, wall: &Wall, simulation: &Simulation) -> Option<f64> {
        let (shape, stack) = (simulation.shape(), simulation.stack());
        let inserted_mm = simulation.report().lengths_mm();
        let contacts = &simulation.report().contacts;
        let points = curve(shape);
        // A tip leaves through an opening, and so does a bow whose tip is still inside.
        let is_out = |x: &Vec3| {
            wall.openings().iter().any(|opening| {
                let (beyond_mm, lateral_mm) = opening.beyond_and_off_axis_mm(x);
                beyond_mm > 0.0 && lateral_mm < BESIDE_RADII * opening.radius_mm
            })
        };
        let missing = |x: &Vec3, behind_mm: f64, (piece, part): (usize, f64)| {
            // An instrument may end at the element's first node, so the radius is that at the position itself.
            let (e, within) = (piece / CHORDS, ((piece % CHORDS) as f64 + part) / CHORDS as f64);
            let (near, far) = (shape.from_tip_mm[e], shape.from_tip_mm[e + 1]);
            let radius_mm = stack.outermost_radius_mm(&inserted_mm, near + (far - near) * within);
            let near = contacts.iter().map(|c| ((c.position_mm - x).norm(), c.penetration_mm));
            let next = near.min_by(|a, b| a.0.total_cmp(&b.0));
            // Next to a position without contact the device does not press at all.
            let reported =
                next.filter(|(away, _)| *away < APART_RADII * radius_mm).map(|(away, depth)| away + depth);
            radius_mm + behind_mm - reported.unwrap_or(0.0)
        };
        let mut most: Option<f64> = None;
        let mut note = |mm: f64| most = Some(most.map_or(mm.max(0.0), |most| most.max(mm)));
        let mut behind = false;
        for (piece, ends) in points.windows(2).enumerate() {
            if is_out(&ends[1]) {
                behind = false;
                continue;
            }
            if let Some(part) = self.first_met(ends[0], ends[1]) {
                note(missing(&ends[0].lerp(&ends[1], part), 0.0, (piece, part)));
                behind = true;
            }
            behind = behind && wall.winding_number(&ends[1]) < 0.5;
            if behind {
                let distance_mm = self.distance_mm(&ends[1], FARTHEST_MM).unwrap_or(FARTHEST_MM);
                note(missing(&ends[1], distance_mm, (piece, 1.0)));
            }
        }
        most
    }

    /// Whether the device of a simulation is behind the triangles by more than its reported penetration.
    pub fn is_crossed_by(&self, simulation: &Simulation) -> bool {
        let felt_mm = FELT_MM.max(FELT_EDGES * self.edge_mm);
        // The triangles are those of its wall, so it has one.
        let wall = simulation.lumen().wall(&NoStore);
        wall.is_ok_and(|wall| {
            self.missing_mm(wall, simulation).is_some_and(|missing_mm| missing_mm > felt_mm)
        })
    }

    /// Distance of a point from the nearest triangle, mm, if one is within `reach_mm`.
    pub fn distance_mm(&self, point: &Vec3, reach_mm: f64) -> Option<f64> {
        let mut best = reach_mm;
        let mut found = false;
        // Near cells first: most points are near a triangle, and far cells are many.
        let mut tried = 0.5 * self.cell_mm;
        loop {
            let around = tried.min(reach_mm);
            for cell in self.cells_of(&point.add_scalar(-around), &point.add_scalar(around)) {
                for &i in self.cells.get(&cell).into_iter().flatten() {
                    let distance = to_triangle(point, &self.triangles[i as usize]);
                    if distance <= best {
                        (best, found) = (distance, true);
                    }
                }
            }
            if (found && best <= around) || around >= reach_mm {
                return found.then_some(best);
            }
            tried *= 2.0;
        }
    }
}

/// Length of the chords between points, mm.
pub(crate) fn chords_mm(points: &[Vec3]) -> f64 {
    points.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum()
}

/// Points along the device's curve: the cubics through positions and tangents of the nodes.
pub fn curve(shape: &Shape) -> Vec<Vec3> {
    curve_in(shape, CHORDS)
}

/// The same with this number of chords per element.
pub(crate) fn curve_in(shape: &Shape, chords: usize) -> Vec<Vec3> {
    let (x, t, s) = (&shape.positions_mm, &shape.tangents, &shape.from_tip_mm);
    let mut points: Vec<Vec3> = x.first().copied().into_iter().collect();
    for e in 0..x.len().saturating_sub(1) {
        let h = s[e] - s[e + 1];
        points.extend((1..=chords).map(|k| {
            let u = k as f64 / chords as f64;
            let (v, w) = (u * u, u * u * u);
            x[e] * (1.0 - 3.0 * v + 2.0 * w)
                + t[e] * (h * (u - 2.0 * v + w))
                + x[e + 1] * (3.0 * v - 2.0 * w)
                + t[e + 1] * (h * (w - v))
        }));
    }
    points
}

/// Where the path passes through a triangle, as a fraction of it: Möller and Trumbore, *Fast, minimum storage
/// ray/triangle intersection*, 1997.
fn passes([a, b, c]: &[Vec3; 3], from: Vec3, to: Vec3) -> Option<f64> {
    let (way, e, f) = (to - from, b - a, c - a);
    let p = way.cross(&f);
    let det = e.dot(&p);
    if det.abs() < 1e-14 {
        return None;
    }
    let s = from - a;
    let q = s.cross(&e);
    let (u, v, t) = (s.dot(&p) / det, way.dot(&q) / det, f.dot(&q) / det);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)).then_some(t)
}

/// Distance of a point from a triangle, by the regions of Ericson, *Real-Time Collision Detection*, 2005, section 5.1.5.
fn to_triangle(p: &Vec3, [a, b, c]: &[Vec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.norm();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.norm();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.norm();
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let foot = if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        a + ab * (d1 / (d1 - d3))
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        a + ac * (d2 / (d2 - d6))
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
    } else {
        a + (ab * vb + ac * vc) / (va + vb + vc)
    };
    (p - foot).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

    #[test]
    fn a_crossing_is_found_and_a_line_inside_is_none() {
        let made =
            GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
        let test = CrossingTest::new(made.wall.mesh());
        let z = |x: f64, z: f64| Vec3::new(x, 0.0, z);
        assert!(test.crosses(&[z(0.0, 50.0), z(9.0, 50.0)]));
        assert!(!test.crosses(&[z(0.0, 10.0), z(0.0, 50.0)]));
        // Both ends are inside; only the curve between them leaves.
        let t = Vec3::new(1.0, 0.0, 0.2).normalize();
        let back = Vec3::new(-t.x, 0.0, t.z);
        let shape = |t: Vec3, back: Vec3| Shape {
            positions_mm: vec![z(0.0, 40.0), z(0.0, 60.0)],
            tangents: vec![t, back],
            from_tip_mm: vec![25.0, 0.0],
        };
        assert!(test.crosses(&curve(&shape(t, back))));
        assert!(!test.crosses(&curve(&shape(Vec3::z(), Vec3::z()))));
    }

    #[test]
    fn the_distance_is_that_of_the_nearest_of_all_triangles() {
        let made =
            GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(1.2)).unwrap();
        let test = CrossingTest::new(made.wall.mesh());
        let query = endowire_core::vessel::WallQuery::new(&made.wall).unwrap();
        for k in 0..200 {
            let k = f64::from(k);
            let x = Vec3::new(45.0 + 50.0 * (0.7 * k).sin(), 6.0 * (1.3 * k).cos(), 70.0 + 75.0 * k.sin());
            let expected = query.nearest(&x, f64::MAX).unwrap().distance_mm.abs();
            match test.distance_mm(&x, 20.0) {
                Some(found) => assert!((found - expected).abs() < 1e-9, "{x}: {found} {expected}"),
                None => assert!(expected > 20.0, "{x}: {expected}"),
            }
        }
    }
}
