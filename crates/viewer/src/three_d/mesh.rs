//! Triangles of the 3D view in view coordinates, ready for either engine.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use crate::three_d::Camera;

/// Cosine (40°) of the angle between faces above which their edge stays sharp: a cap on a tube stays flat.
const CREASE: f64 = 0.766;

/// A corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "gpu", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    /// Red, green, blue of a solid; the wall has its own colour.
    pub(crate) colour: [u8; 4],
}

/// The wall as a list of triangles with smooth normals.
pub(crate) fn wall_triangles(camera: &Camera, wall: &SurfaceMesh) -> Vec<Vertex> {
    // Twice the area times the normal: large faces weigh more.
    let faces: Vec<Vec3> = (0..wall.triangles.len())
        .map(|i| {
            let [a, b, c] = wall.corners(i);
            (b - a).cross(&(c - a))
        })
        .collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); wall.vertices_mm.len()];
    for (face, corners) in (0..).zip(&wall.triangles) {
        corners.iter().for_each(|&v| around[v as usize].push(face));
    }
    let mut vertices = Vec::with_capacity(3 * faces.len());
    for (corners, own) in wall.triangles.iter().zip(&faces) {
        for &v in corners {
            let smooth: Vec3 = (around[v as usize].iter())
                .map(|&f| faces[f as usize])
                .filter(|f| f.dot(own) >= CREASE * f.norm() * own.norm())
                .sum();
            let normal = smooth.try_normalize(0.0).unwrap_or_default();
            vertices.push(Vertex::new(camera, &wall.vertices_mm[v as usize], &normal, [0; 4]));
        }
    }
    vertices
}

impl Vertex {
    pub(crate) fn new(camera: &Camera, position_mm: &Vec3, normal: &Vec3, colour: [u8; 4]) -> Self {
        Self {
            position: camera.in_view(position_mm).map(|x| x as f32),
            normal: camera.direction_in_view(normal).map(|x| x as f32),
            colour,
        }
    }
}
