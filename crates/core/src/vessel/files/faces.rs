//! Triangulates polygons and triangle strips.
//!
//! A polygon is a fan around its first corner if all triangles of that face the same way, as in every convex polygon.
//! Otherwise its ears are cut off in its own plane, one after another: Meisters, "Polygons have ears", American
//! Mathematical Monthly 82 (1975).

use super::Reason;
use crate::Vec3;
use crate::vessel::SurfaceMesh;

/// Largest number of corners of a polygon whose ears are cut off: the time is quadratic in it.
const MOST_CORNERS: usize = 10_000;
/// Part of a polygon's area below which that of a triangle is rounding.
const ROUNDING: f64 = 1e-12;

/// Faces of a file, stored until all of its vertices are known, with a number that locates each in the file.
#[derive(Debug, Default)]
pub(super) struct Faces {
    /// Corners of all faces, counted from 0.
    corners: Vec<i64>,
    /// For each face the end of its corners, and its number in the file.
    ends: Vec<(usize, usize)>,
}

impl Faces {
    /// Adds a polygon.
    pub(super) fn push(&mut self, polygon: impl IntoIterator<Item = i64>, number: usize) {
        self.corners.extend(polygon);
        self.ends.push((self.corners.len(), number));
    }

    /// Adds the triangles of a strip, every second one reversed. Those that join parts of a strip have a repeated
    /// corner, and are dropped.
    pub(super) fn push_strip(&mut self, strip: &[i64], number: usize) {
        for (k, corners) in strip.windows(3).enumerate() {
            let &[a, b, c] = corners else { continue };
            if a != b && b != c && c != a {
                self.push(if k % 2 == 0 { [a, b, c] } else { [b, a, c] }, number);
            }
        }
    }

    /// Divides all faces into triangles of `mesh`; `what` names a face by its number.
    pub(super) fn fill(self, mesh: &mut SurfaceMesh, what: impl Fn(usize) -> String) -> Result<(), Reason> {
        let mut begin = 0;
        for (end, number) in self.ends {
            push_polygon(mesh, &self.corners[begin..end], || what(number))?;
            begin = end;
        }
        Ok(())
    }
}

/// Divides a polygon into triangles after checking its indices; `what` names it in messages.
fn push_polygon(mesh: &mut SurfaceMesh, polygon: &[i64], what: impl Fn() -> String) -> Result<(), Reason> {
    let count = mesh.vertices_mm.len();
    if let Some(bad) = polygon.iter().find(|&&v| v < 0 || v >= count as i64 || v >= i64::from(u32::MAX)) {
        return Err(format!(
            "{} names vertex {bad} (counted from 0), but there are {count} vertices: remove the face or mend the export",
            what()
        ));
    }
    // A face of one or two corners is no reason to reject thousands of others: as a triangle without area it is
    // removed and counted when the surface is repaired.
    match polygon {
        [] => return Ok(()),
        [a] => mesh.triangles.push([*a as u32; 3]),
        [a, b] => mesh.triangles.push([*a as u32, *b as u32, *b as u32]),
        _ => {
            let corners: Vec<u32> = polygon.iter().map(|v| *v as u32).collect();
            let Flat { at, rounding } = Flat::of(&corners, &mesh.vertices_mm);
            let fan = |k: usize| area([at[0], at[k], at[k + 1]]) >= -rounding;
            let left = match polygon.len() > MOST_CORNERS || (1..at.len() - 1).all(fan) {
                true => (0..at.len()).collect(),
                false => cut_ears(&corners, &at, rounding, &mut mesh.triangles),
            };
            for pair in left[1..].windows(2) {
                mesh.triangles.push([left[0], pair[0], pair[1]].map(|k| corners[k]));
            }
        }
    }
    Ok(())
}

/// A polygon seen along its normal, counter-clockwise.
struct Flat {
    at: Vec<[f64; 2]>,
    /// Area that is rounding.
    rounding: f64,
}

impl Flat {
    fn of(corners: &[u32], vertices_mm: &[Vec3]) -> Self {
        let origin = vertices_mm[corners[0] as usize];
        let offsets: Vec<Vec3> = corners.iter().map(|v| vertices_mm[*v as usize] - origin).collect();
        let next = offsets.iter().cycle().skip(1);
        let normal: Vec3 = offsets.iter().zip(next).map(|(a, b)| a.cross(b)).sum();
        // Along the axis nearest to the normal, which keeps coordinates as they are.
        let k = normal.iamax();
        let (u, v) = if normal[k] < 0.0 { ((k + 2) % 3, (k + 1) % 3) } else { ((k + 1) % 3, (k + 2) % 3) };
        Self { at: offsets.iter().map(|x| [x[u], x[v]]).collect(), rounding: ROUNDING * normal[k].abs() }
    }
}

/// Twice the area of a triangle, positive if it is counter-clockwise.
fn area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Cuts off ears of a polygon; returns the places that are left: two, or more of a polygon that crosses itself.
fn cut_ears(corners: &[u32], at: &[[f64; 2]], rounding: f64, triangles: &mut Vec<[u32; 3]>) -> Vec<usize> {
    let mut left: Vec<usize> = (0..at.len()).collect();
    let mut k = 0;
    // Places since the last ear.
    let mut tried = 0;
    while left.len() > 2 && tried < left.len() {
        let count = left.len();
        let ear = [(k + count - 1) % count, k % count, (k + 1) % count].map(|place| left[place]);
        if is_ear(ear, &left, corners, at, rounding) {
            triangles.push(ear.map(|place| corners[place]));
            left.remove(k % count);
            (k, tried) = (k % count, 0);
        } else {
            (k, tried) = ((k + 1) % count, tried + 1);
        }
    }
    left
}

/// Whether a triangle of three successive places has an area and no other corner of the polygon in it.
fn is_ear(ear: [usize; 3], left: &[usize], corners: &[u32], at: &[[f64; 2]], rounding: f64) -> bool {
    let [a, b, c] = ear.map(|place| at[place]);
    if area([a, b, c]) <= rounding {
        return false;
    }
    // A corner may be passed twice, where a polygon encloses a hole.
    let own = ear.map(|place| corners[place]);
    let is_in = |p: [f64; 2]| [[a, b, p], [b, c, p], [c, a, p]].iter().all(|side| area(*side) >= -rounding);
    !left.iter().any(|place| !own.contains(&corners[*place]) && is_in(at[*place]))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::vessel::check::area_mm2;

    /// The triangles of a polygon, and the area of their surface and of the polygon.
    fn divided(polygon: &[Vec3], first: usize) -> (Vec<[u32; 3]>, f64, f64) {
        let mut mesh = SurfaceMesh { vertices_mm: polygon.to_vec(), triangles: Vec::new() };
        let count = polygon.len();
        let mut faces = Faces::default();
        faces.push((0..count).map(|k| ((first + k) % count) as i64), 1);
        faces.fill(&mut mesh, |_| String::new()).unwrap();
        let next = polygon.iter().cycle().skip(1);
        let exact = polygon.iter().zip(next).map(|(a, b)| a.cross(b)).sum::<Vec3>().norm() / 2.0;
        (mesh.triangles.clone(), area_mm2(&mesh), exact)
    }

    #[test]
    fn concave_polygons_are_divided_without_overlap_from_any_corner_and_in_any_plane() {
        let l = [[0., 0.], [20., 0.], [20., 8.], [8., 8.], [8., 20.], [0., 20.]];
        // A comb with a corner on a straight side, and a kidney.
        let comb = [
            [0., 0.],
            [3., 0.],
            [6., 0.],
            [6., 5.],
            [5., 5.],
            [5., 1.],
            [4., 1.],
            [4., 5.],
            [3., 5.],
            [3., 1.],
            [0., 1.],
        ];
        let kidney: Vec<[f64; 2]> = (0..40)
            .map(|k| {
                let angle = TAU * f64::from(k) / 40.0;
                let radius = 4.0 + 1.8 * (2.0 * angle).cos() + 0.8 * (3.0 * angle + 1.0).cos();
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        for flat in [&l[..], &comb[..], &kidney[..]] {
            for turned in [
                |[x, y]: [f64; 2]| Vec3::new(x, y, 3.0),
                |[x, y]: [f64; 2]| Vec3::new(y, x, 0.4 * x - 0.2 * y),
                |[x, y]: [f64; 2]| Vec3::new(0.1 * x, 7.0 - y, x),
            ] {
                let polygon: Vec<Vec3> = flat.iter().map(|p| turned(*p)).collect();
                for first in 0..polygon.len() {
                    let (triangles, area, exact) = divided(&polygon, first);
                    assert_eq!(triangles.len(), polygon.len() - 2);
                    assert!((area - exact).abs() < 1e-9 * exact, "{first}: {area} of {exact}");
                }
            }
        }
    }

    #[test]
    fn a_convex_polygon_is_a_fan_and_one_that_crosses_itself_is_read() {
        let circle: Vec<Vec3> = (0..7)
            .map(|k| TAU * f64::from(k) / 7.0)
            .map(|angle| Vec3::new(angle.cos(), 0.0, angle.sin()))
            .collect();
        let (triangles, ..) = divided(&circle, 2);
        assert_eq!(triangles, [[2, 3, 4], [2, 4, 5], [2, 5, 6], [2, 6, 0], [2, 0, 1]]);
        let star: Vec<Vec3> = (0..7).map(|k| circle[3 * k % 7]).collect();
        assert_eq!(divided(&star, 0).0.len(), 5);
        let bow = [[0., 0., 0.], [1., 1., 0.], [1., 0., 0.], [0., 1., 0.]].map(Vec3::from);
        assert_eq!(divided(&bow, 0).0.len(), 2);
    }

    #[test]
    fn a_polygon_around_a_hole_leaves_it_open() {
        // The hole is reached by a cut that is passed both ways.
        let outer = [[0., 0.], [9., 0.], [9., 9.], [0., 9.]];
        let hole = [[3., 3.], [3., 6.], [6., 6.], [6., 3.]];
        let vertices_mm = outer.iter().chain(&hole).map(|[x, y]| Vec3::new(*x, *y, 0.0)).collect();
        let mut mesh = SurfaceMesh { vertices_mm, triangles: Vec::new() };
        let mut faces = Faces::default();
        faces.push([0, 1, 2, 3, 0, 4, 5, 6, 7, 4], 1);
        faces.fill(&mut mesh, |_| String::new()).unwrap();
        assert!((area_mm2(&mesh) - 72.0).abs() < 1e-9, "{}", area_mm2(&mesh));
        assert_eq!(mesh.triangles.len(), 8);
    }
}
