//! Triangulates polygons and triangle strips.

use super::Reason;
use crate::vessel::SurfaceMesh;

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
            push_fan(mesh, &self.corners[begin..end], || what(number))?;
            begin = end;
        }
        Ok(())
    }
}

/// Divides a polygon into a fan of triangles after checking its indices; `what` names it in messages.
fn push_fan(mesh: &mut SurfaceMesh, polygon: &[i64], what: impl Fn() -> String) -> Result<(), Reason> {
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
        _ => {}
    }
    for pair in polygon[1..].windows(2) {
        mesh.triangles.push([polygon[0] as u32, pair[0] as u32, pair[1] as u32]);
    }
    Ok(())
}
