//! Removes triangles without area, without opening slits.

use super::SurfaceMesh;
use super::mesh::retain_numbered;
use super::topology::{EdgeTable, NONE};
use crate::Vec3;

/// Largest number of passes; each removes every sliver except those next to another one, and chains of slivers need a
/// few.
const PASSES: usize = 16;

/// Length up to which an edge is closed to remove a sliver in a cluster of them, in tolerances: corners of such a
/// cluster are a little too far apart to be welded.
const CLUSTER: f64 = 10.0;

/// Whether a triangle is thinner than `tolerance_mm` (or rounding).
pub(crate) fn is_degenerate(corners: &[Vec3; 3], tolerance_mm: f64) -> bool {
    let [a, b, c] = *corners;
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    (b - a).cross(&(c - a)).norm() <= longest * tolerance_mm.max(1e-12 * longest)
}

/// Removes triangles with a repeated vertex, and needles, whose corners are distinct but collinear. Removing only the
/// needle would leave a slit between its long edge and its two short ones, so the long edge is flipped together with
/// the triangle across it. Returns the number of degenerate triangles found; none remains.
pub(crate) fn remove_degenerate(mesh: &mut SurfaceMesh, tolerance_mm: f64) -> usize {
    let before = mesh.triangles.len();
    mesh.triangles.retain(|t| !repeated(t));
    let mut found = before - mesh.triangles.len();
    for pass in 0..PASSES {
        let slivers: Vec<usize> =
            (0..mesh.triangles.len()).filter(|&i| is_degenerate(&mesh.corners(i), tolerance_mm)).collect();
        if slivers.is_empty() {
            return found;
        }
        if pass == 0 {
            found += slivers.len();
        }
        let across = EdgeTable::new(&mesh.triangles).neighbours(mesh.triangles.len());
        let mut touched = vec![false; mesh.triangles.len()];
        let mut gone = vec![false; mesh.triangles.len()];
        for &index in &slivers {
            let corners = mesh.corners(index);
            let length = |side: usize| (corners[(side + 1) % 3] - corners[side]).norm();
            let side = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
            let beyond = across[index][side];
            if beyond == NONE {
                // On the border the needle is simply removed: its short edges become the border.
                gone[index] = !touched[index];
            } else if !touched[index] && !touched[beyond as usize] {
                (touched[index], touched[beyond as usize]) = (true, true);
                flip_long_edge(&mut mesh.triangles, index, side, beyond as usize);
            }
            touched[index] = true;
        }
        retain_numbered(&mut mesh.triangles, |index, t| !gone[index] && !repeated(t));
    }
    close_clusters(mesh, tolerance_mm);
    // The rest leaves slits.
    let survivors: Vec<bool> =
        (0..mesh.triangles.len()).map(|i| !is_degenerate(&mesh.corners(i), tolerance_mm)).collect();
    retain_numbered(&mut mesh.triangles, |index, _| survivors[index]);
    found
}

/// Removes clusters of slivers with corners close to each other, between which flips only pass slivers around: both
/// ends of the shortest edge of each become one, until none is left.
fn close_clusters(mesh: &mut SurfaceMesh, tolerance_mm: f64) {
    loop {
        let mut joined: Vec<u32> = (0..mesh.vertices_mm.len() as u32).collect();
        let mut touched = vec![false; joined.len()];
        for index in 0..mesh.triangles.len() {
            let corners = mesh.corners(index);
            if !is_degenerate(&corners, tolerance_mm) {
                continue;
            }
            let length = |side: usize| (corners[(side + 1) % 3] - corners[side]).norm();
            let side = (0..3).min_by(|&a, &b| length(a).total_cmp(&length(b))).unwrap_or(0);
            let [a, b] = [side, (side + 1) % 3].map(|k| mesh.triangles[index][k]);
            if length(side) <= CLUSTER * tolerance_mm && !touched[a as usize] && !touched[b as usize] {
                joined[a.max(b) as usize] = a.min(b);
                (touched[a as usize], touched[b as usize]) = (true, true);
            }
        }
        if !touched.contains(&true) {
            return;
        }
        for t in &mut mesh.triangles {
            *t = t.map(|v| joined[v as usize]);
        }
        mesh.triangles.retain(|t| !repeated(t));
    }
}

fn repeated(t: &[u32; 3]) -> bool {
    t[0] == t[1] || t[1] == t[2] || t[2] == t[0]
}

/// Replaces needle (a, b, c), long edge a–b, and its neighbour across a–b by the two halves of the neighbour cut at c.
/// Counted as two triangles before and after, of which none is a needle unless c lies on another edge as well.
fn flip_long_edge(triangles: &mut [[u32; 3]], needle: usize, side: usize, beyond: usize) {
    let (a, b) = (triangles[needle][side], triangles[needle][(side + 1) % 3]);
    let c = triangles[needle][(side + 2) % 3];
    let other = triangles[beyond];
    let with = |from: u32, to: u32| other.map(|v| if v == from { to } else { v });
    triangles[needle] = with(a, c);
    triangles[beyond] = with(b, c);
}

#[cfg(test)]
mod tests {
    use super::super::opening;
    use super::*;

    #[test]
    fn a_needle_goes_without_opening_a_slit() {
        // A square of two triangles plus a needle (0, 2, 4) on its diagonal, 4 in its middle.
        let mut mesh = SurfaceMesh {
            vertices_mm: [[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0.5, 0.5]]
                .map(|[x, y]| Vec3::new(x, y, 0.0))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 4], [0, 4, 3], [4, 2, 3]],
        };
        let area = |m: &SurfaceMesh| {
            (0..m.triangles.len()).map(|i| crate::vessel::mesh::area(&m.corners(i))).sum::<f64>()
        };
        assert_eq!(opening::boundary(&mesh, &EdgeTable::new(&mesh.triangles)).openings.len(), 1);
        // A flip counts too: such a mesh is not as it was given.
        assert_eq!(remove_degenerate(&mut mesh, 1e-6), 1);
        assert_eq!((mesh.triangles.len(), remove_degenerate(&mut mesh, 1e-6)), (4, 0));
        assert!((0..mesh.triangles.len()).all(|i| !is_degenerate(&mesh.corners(i), 1e-6)));
        assert_eq!(opening::boundary(&mesh, &EdgeTable::new(&mesh.triangles)).openings[0].boundary.len(), 4);
        assert!((area(&mesh) - 1.0).abs() < 1e-15);
    }
    #[test]
    fn a_cluster_of_slivers_is_closed_to_a_point() {
        // In the middle of a square, the corners of a smaller one, 1.2 tolerances wide: its two halves are too thin
        // whichever diagonal divides it.
        let side = 0.5 * 1.2e-3;
        let outer = [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]];
        let inner = outer.map(|[x, y]| [side * x, side * y]);
        let vertices_mm = outer.iter().chain(&inner).map(|[x, y]| Vec3::new(*x, *y, 0.0)).collect();
        let ring = (0..4).flat_map(|k: u32| {
            let next = (k + 1) % 4;
            [[k, next, 4 + k], [next, 4 + next, 4 + k]]
        });
        let triangles = ring.chain([[4, 5, 6], [4, 6, 7]]).collect();
        let mut mesh = SurfaceMesh { vertices_mm, triangles };
        assert_eq!(remove_degenerate(&mut mesh, 1e-3), 6);
        assert_eq!(mesh.triangles.len(), 4);
        let borders = opening::boundary(&mesh, &EdgeTable::new(&mesh.triangles)).openings;
        assert_eq!(borders.len(), 1, "the square's own border");
        assert_eq!(borders[0].boundary.len(), 4);
    }
}
