//! Triangles of the 3D view in view coordinates, ready for either engine.

use bytemuck::{Pod, Zeroable};
use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use crate::device::DevicePoint;
use crate::three_d::Camera;

/// Faces that meet at a sharper angle than the one with this cosine (40°) keep their edge: a cap on a tube
/// stays flat.
const CREASE: f64 = 0.766;
/// Corners of a device's cross section.
const SIDES: usize = 14;
/// Rings of each rounded end.
const CAP_RINGS: usize = 4;
/// Least width of a device on screen, pixels: half a millimetre of wire in a long scene would vanish
/// otherwise.
const LEAST_WIDTH_PX: f64 = 2.4;

/// A corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
}

/// The wall as a list of triangles with smooth normals.
pub(crate) fn wall_triangles(camera: &Camera, wall: &SurfaceMesh) -> Vec<Vertex> {
    // Twice the area times the normal: large faces count more.
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
            vertices.push(vertex(camera, &wall.vertices_mm[v as usize], &normal));
        }
    }
    vertices
}

fn vertex(camera: &Camera, position_mm: &Vec3, normal: &Vec3) -> Vertex {
    Vertex {
        position: camera.in_view(position_mm).map(|x| x as f32),
        normal: camera.direction_in_view(normal).map(|x| x as f32),
    }
}

/// A device as a tube with rounded ends, outward triangles.
pub(crate) fn device_triangles(camera: &Camera, points: &[DevicePoint]) -> Vec<Vertex> {
    let tangent = |i: usize| points[i].tangent.normalize();
    let radius = |i: usize| {
        let distance = -camera.in_view(&points[i].position_mm)[2];
        points[i].radius_mm.max(camera.pixel_mm_at(distance.max(camera.near)) * LEAST_WIDTH_PX / 2.0)
    };
    // Centre, radius, direction, and tilt of the normal out of the cross section (sine, cosine).
    let mut sections: Vec<(Vec3, f64, Vec3, [f64; 2])> = Vec::with_capacity(points.len() + 2 * CAP_RINGS);
    let cap = |i: usize, outwards: f64, sections: &mut Vec<_>| {
        for ring in 0..CAP_RINGS {
            let step = if outwards < 0.0 { CAP_RINGS - ring } else { ring + 1 };
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * step as f64 / CAP_RINGS as f64).sin_cos();
            let r = radius(i);
            let centre = points[i].position_mm + tangent(i) * (outwards * r * sin);
            sections.push((centre, r * cos, tangent(i), [outwards * sin, cos]));
        }
    };
    let last = points.len() - 1;
    cap(0, -1.0, &mut sections);
    for (i, point) in points.iter().enumerate() {
        sections.push((point.position_mm, radius(i), tangent(i), [0.0, 1.0]));
    }
    cap(last, 1.0, &mut sections);

    let mut side = perpendicular(&sections[0].2);
    let mut rings: Vec<[Vertex; SIDES]> = Vec::with_capacity(sections.len());
    for (centre, r, t, [sin, cos]) in &sections {
        // The least rotation that keeps the frame across the tube.
        side = (side - t * side.dot(t)).try_normalize(1e-6).unwrap_or_else(|| perpendicular(t));
        let other = t.cross(&side);
        rings.push(std::array::from_fn(|k| {
            let (s, c) = (std::f64::consts::TAU * k as f64 / SIDES as f64).sin_cos();
            let radial = side * c + other * s;
            vertex(camera, &(centre + radial * *r), &(radial * *cos + t * *sin))
        }));
    }
    let mut vertices = Vec::with_capacity(6 * SIDES * rings.len());
    for pair in rings.windows(2) {
        for k in 0..SIDES {
            let next = (k + 1) % SIDES;
            let [a, b, c, d] = [pair[0][k], pair[0][next], pair[1][next], pair[1][k]];
            vertices.extend([a, b, c, a, c, d]);
        }
    }
    vertices
}

fn perpendicular(t: &Vec3) -> Vec3 {
    let least = if t.x.abs() <= t.y.abs().min(t.z.abs()) {
        Vec3::x()
    } else if t.y.abs() <= t.z.abs() {
        Vec3::y()
    } else {
        Vec3::z()
    };
    t.cross(&least).normalize()
}
