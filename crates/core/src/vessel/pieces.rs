//! The connected pieces of a wall, and the one that a place names.

use serde::Serialize;

use super::inside::solid_angle;
use super::repairs::{RepairKind, of_groups};
use super::topology::EdgeTable;
use super::{SurfaceMesh, WallQuery};
use crate::Vec3;

/// A connected piece of a wall: a vessel, or something in its lumen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PieceReport {
    /// Its triangles.
    pub triangles: usize,
    /// The sides of its bounding box, mm.
    pub size_mm: [f64; 3],
    /// A place on it, mm, as `piece_at_mm` of a region of the wall names it.
    pub at_mm: [f64; 3],
}

/// The connected pieces of a surface.
#[derive(Debug)]
pub(crate) struct Pieces {
    of_triangle: Vec<u32>,
    count: usize,
}

impl Pieces {
    pub(crate) fn of(mesh: &SurfaceMesh) -> Self {
        let (of_triangle, count) = EdgeTable::new(&mesh.triangles).components(mesh.triangles.len());
        Self { of_triangle, count }
    }

    /// The piece named by a place, and the distance of the place from it, mm: the body in the lumen that holds the place, or else
    /// the piece whose surface is nearest. The middle of a thrombus on the wall may be nearer to the wall.
    pub(crate) fn at(&self, query: &WallQuery, place: &Vec3) -> Option<(u32, f64)> {
        let near = query.nearest(place, f64::MAX)?;
        let mut angles = vec![0.0; self.count];
        for (t, piece) in self.of_triangle.iter().enumerate() {
            angles[*piece as usize] += solid_angle(query.corners(t as u32).map(|corner| corner - place));
        }
        // Bodies face the lumen around them: from within they are seen from their front, all around.
        let held = angles.iter().position(|angle| *angle < -std::f64::consts::TAU);
        Some(match held {
            Some(piece) => (piece as u32, 0.0),
            None => (self.of_triangle[near.triangle as usize], near.distance_mm.abs()),
        })
    }

    /// Whether each vertex of `mesh` belongs to a piece.
    pub(crate) fn vertices_of(&self, piece: u32, mesh: &SurfaceMesh) -> Vec<bool> {
        let mut belongs = vec![false; mesh.vertices_mm.len()];
        for (triangle, of) in mesh.triangles.iter().zip(&self.of_triangle) {
            if *of == piece {
                triangle.iter().for_each(|v| belongs[*v as usize] = true);
            }
        }
        belongs
    }

    /// Size and place of each piece of `mesh`, the largest first.
    pub(super) fn reports(&self, mesh: &SurfaceMesh) -> Vec<PieceReport> {
        let boxes = of_groups(RepairKind::PieceApart, mesh, |t| Some(self.of_triangle[t]));
        // The middle of the triangle nearest to that of the box, which itself may be in the lumen.
        let mut nearest = vec![(f64::INFINITY, Vec3::zeros()); self.count];
        for (t, piece) in self.of_triangle.iter().enumerate() {
            let (piece, middle) = (*piece as usize, mesh.middle(t));
            let away = (middle - Vec3::from(boxes[piece].at_mm)).norm();
            if away < nearest[piece].0 {
                nearest[piece] = (away, middle);
            }
        }
        let report = |(of, (_, at)): (super::Repair, (f64, Vec3))| PieceReport {
            triangles: of.triangles,
            size_mm: of.size_mm,
            at_mm: at.into(),
        };
        let mut reports: Vec<PieceReport> = boxes.into_iter().zip(nearest).map(report).collect();
        let largest_mm = |piece: &PieceReport| Vec3::from(piece.size_mm).norm();
        reports.sort_by(|a, b| largest_mm(b).total_cmp(&largest_mm(a)));
        reports
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::Wall;
    use crate::vessel::repair::shapes::add;

    /// A box with a cube by its floor: the middle of the cube is nearer to the floor than to its own surface.
    fn with_cube() -> Wall {
        let mut mesh = SurfaceMesh::cuboid(Vec3::zeros(), Vec3::new(10.0, 10.0, 40.0), 2.0);
        let cube = SurfaceMesh::cuboid(Vec3::new(3.0, 0.1, 20.0), Vec3::new(7.0, 4.1, 24.0), 1.0);
        add(&mut mesh, &cube);
        Wall::from_surface(&mesh).unwrap()
    }

    #[test]
    fn a_place_names_the_body_that_holds_it_or_the_nearest_surface() {
        let wall = with_cube();
        let (mesh, query) = (wall.mesh(), WallQuery::new(&wall).unwrap());
        let pieces = Pieces::of(mesh);
        let named = |at: [f64; 3]| pieces.at(&query, &Vec3::from(at)).unwrap();
        let (cube, vessel) = (named([5.0, 2.1, 22.0]), named([5.0, 0.0, 5.0]));
        assert!(cube.0 != vessel.0 && cube.1 == 0.0 && vessel.1 < 1e-12, "{cube:?} {vessel:?}");
        // In the cube, but nearer to the floor than to its sides.
        assert_eq!(named([5.0, 0.14, 22.0]), cube);
        // Over the cube and beside it.
        let over = named([5.0, 4.6, 22.0]);
        assert!(over.0 == cube.0 && (over.1 - 0.5).abs() < 1e-9, "{over:?}");
        assert_eq!(named([9.5, 2.0, 22.0]).0, vessel.0);
        let reports = pieces.reports(mesh);
        assert_eq!(reports.len(), 2);
        assert!((Vec3::from(reports[1].size_mm) - Vec3::repeat(4.0)).norm() < 1e-9, "{reports:?}");
        for (report, piece) in reports.iter().zip([vessel.0, cube.0]) {
            let (of, away_mm) = pieces.at(&query, &Vec3::from(report.at_mm)).unwrap();
            assert!(of == piece && away_mm < 1e-9, "{report:?}");
        }
        let belongs = pieces.vertices_of(cube.0, mesh);
        assert!(
            mesh.vertices_mm.iter().zip(&belongs).all(|(v, of)| *of
                == (v.y > 0.05 && v.y < 4.2 && v.z > 19.0 && v.z < 25.0 && v.x > 2.9 && v.x < 7.1))
        );
    }
}
