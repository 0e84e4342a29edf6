//! Whether a device passes through a triangle of the wall.

use std::collections::BTreeMap;

use endowire_core::Vec3;
use endowire_core::shape::Shape;
use endowire_core::vessel::SurfaceMesh;

/// Chords per element: with 4 of them, a curve of radius 10 mm in an element of 5 mm is met within 0.02 mm.
const CHORDS: usize = 4;

/// The triangles of a mesh in the cells of a grid, for testing lines against them.
pub struct CrossingTest {
    triangles: Vec<[Vec3; 3]>,
    cell_mm: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
}

impl CrossingTest {
    /// Prepares the test of lines against `mesh`.
    pub fn new(mesh: &SurfaceMesh) -> Self {
        let triangles: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
        let edges: f64 = triangles.iter().map(|[a, b, _]| (b - a).norm()).sum();
        let cell_mm = (2.0 * edges / triangles.len() as f64).max(0.5);
        let mut test = Self { triangles, cell_mm, cells: BTreeMap::new() };
        for i in 0..test.triangles.len() {
            let [a, b, c] = test.triangles[i];
            for cell in test.cells_of(&a.inf(&b).inf(&c), &a.sup(&b).sup(&c)) {
                test.cells.entry(cell).or_default().push(i as u32);
            }
        }
        test
    }

    fn cells_of(&self, low: &Vec3, high: &Vec3) -> impl Iterator<Item = [i64; 3]> + use<> {
        let [low, high] = [low, high].map(|x| x.map(|c| (c / self.cell_mm).floor() as i64));
        (low.x..=high.x)
            .flat_map(move |x| (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| [x, y, z])))
    }

    /// Whether any piece of the line through `points` passes through a triangle.
    pub fn crosses(&self, points: &[Vec3]) -> bool {
        points.windows(2).any(|ends| {
            self.cells_of(&ends[0].inf(&ends[1]), &ends[0].sup(&ends[1])).any(|cell| {
                self.cells
                    .get(&cell)
                    .into_iter()
                    .flatten()
                    .any(|&i| passes(&self.triangles[i as usize], ends[0], ends[1]))
            })
        })
    }

    /// Whether the curve of a device passes through a triangle.
    pub fn crosses_curve(&self, shape: &Shape) -> bool {
        self.crosses(&curve(shape))
    }
}

/// Points along the device's curve: the cubics through positions and tangents of the nodes.
fn curve(shape: &Shape) -> Vec<Vec3> {
    let (x, t, s) = (&shape.positions_mm, &shape.tangents, &shape.from_tip_mm);
    let mut points: Vec<Vec3> = x.first().copied().into_iter().collect();
    for e in 0..x.len().saturating_sub(1) {
        let h = s[e] - s[e + 1];
        points.extend((1..=CHORDS).map(|k| {
            let u = k as f64 / CHORDS as f64;
            let (v, w) = (u * u, u * u * u);
            x[e] * (1.0 - 3.0 * v + 2.0 * w)
                + t[e] * (h * (u - 2.0 * v + w))
                + x[e + 1] * (3.0 * v - 2.0 * w)
                + t[e + 1] * (h * (w - v))
        }));
    }
    points
}

/// Möller and Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997.
fn passes([a, b, c]: &[Vec3; 3], from: Vec3, to: Vec3) -> bool {
    let (way, e, f) = (to - from, b - a, c - a);
    let p = way.cross(&f);
    let det = e.dot(&p);
    if det.abs() < 1e-14 {
        return false;
    }
    let s = from - a;
    let q = s.cross(&e);
    let (u, v, t) = (s.dot(&p) / det, way.dot(&q) / det, f.dot(&q) / det);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
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
        // Both ends inside, only the curve between them leaves.
        let t = Vec3::new(1.0, 0.0, 0.2).normalize();
        let back = Vec3::new(-t.x, 0.0, t.z);
        let shape = |t: Vec3, back: Vec3| Shape {
            positions_mm: vec![z(0.0, 40.0), z(0.0, 60.0)],
            tangents: vec![t, back],
            from_tip_mm: vec![25.0, 0.0],
        };
        assert!(test.crosses_curve(&shape(t, back)));
        assert!(!test.crosses_curve(&shape(Vec3::z(), Vec3::z())));
    }
}
