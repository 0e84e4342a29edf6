//! Length of every ray inside a closed wall: signed depth.
//!
//! A ray enters a closed surface wherever it meets a triangle from outside and leaves it wherever it meets
//! one from inside, so the length inside is Σ ±t, minus at entries and plus at exits. Along a ray, t = depth
//! · obliquity, and on a plane 1/depth is linear over the screen: from the corners it is interpolated with
//! the pixel's weights, which cannot overshoot even for a triangle seen almost edge-on. Neighbours agree on
//! their shared edge, so a silhouette contributes nothing rather than a spike.

use std::collections::HashMap;
use std::ops::Range;

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result, Vec3};

use crate::c_arm::CArm;
use crate::cpu::raster::ScreenTriangle;

/// Pixels that are summed up together: what double precision of a whole large picture would take is not to be had.
const BAND_PX: u32 = 1 << 22;

/// Pixel and inverse depth of each vertex.
fn seen(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<([f64; 2], f64)> {
    let vertex = |v: &Vec3| {
        let beam = c_arm.in_beam(v);
        (c_arm.pixel_of(&beam), 1.0 / (c_arm.sod_mm() + beam.z))
    };
    wall.vertices_mm.iter().map(vertex).collect()
}

/// Calls `visit(pixel, sign, depth)` for each meeting of a pixel's central ray with `wall` in some rows of the picture: −1 where it
/// enters and +1 where it leaves, at a depth in front of the source.
fn meetings(
    width: u32,
    rows: Range<u32>,
    wall: &SurfaceMesh,
    seen: &[([f64; 2], f64)],
    mut visit: impl FnMut(usize, f64, f64),
) {
    for corners in &wall.triangles {
        let corners = corners.map(|v| seen[v as usize]);
        let Some(triangle) = ScreenTriangle::new(corners.map(|c| c.0)) else { continue };
        // Outward triangles turn clockwise on the screen (positive area, rows downwards) where they face the
        // source.
        let sign = -triangle.area2().signum();
        let [i0, i1, i2] = corners.map(|c| c.1);
        triangle.scan_rows(width, rows.clone(), |x, y, [w0, w1, w2]| {
            visit(y * width as usize + x, sign, 1.0 / (w0 * i0 + w1 * i1 + w2 * i2));
        });
    }
}

/// Length inside `wall` of the central ray of each pixel, row by row.
pub(crate) fn wall_path_mm(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<f32> {
    let [width, height] = c_arm.size_px();
    let seen = seen(c_arm, wall);
    let mut path = Vec::with_capacity(width as usize * height as usize);
    let rows = (BAND_PX / width).max(1);
    let mut band = vec![0.0; (rows.min(height) * width) as usize];
    let mut obliquities = c_arm.obliquities();
    for top in (0..height).step_by(rows as usize) {
        let bottom = (top + rows).min(height);
        let first = (top * width) as usize;
        band.fill(0.0);
        meetings(width, top..bottom, wall, &seen, |pixel, sign, depth| band[pixel - first] += sign * depth);
        let lengths = &band[..((bottom - top) * width) as usize];
        path.extend(lengths.iter().zip(&mut obliquities).map(|(length, oblique)| (length * oblique) as f32));
    }
    path
}

/// Every meeting of a pixel's central ray with `wall`: the pixel, the distance from the source, and whether it enters.
pub(crate) fn wall_crossings(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<(u32, f32, bool)> {
    let mut crossings = Vec::new();
    let [width, height] = c_arm.size_px();
    meetings(width, 0..height, wall, &seen(c_arm, wall), |pixel, sign, depth| {
        crossings.push((pixel as u32, (depth * c_arm.obliquity_at(pixel)) as f32, sign < 0.0));
    });
    crossings
}

/// Checks that a wall can be drawn at all: it has triangles, they name vertices that exist, and these are
/// finite.
///
/// # Errors
/// [`Error::Mesh`] saying what is wrong.
pub(crate) fn check_drawable(wall: &SurfaceMesh) -> Result<()> {
    if wall.triangles.is_empty() {
        return Err(Error::Mesh("the wall has no triangles".into()));
    }
    if let Some(i) = wall.vertices_mm.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        return Err(Error::Mesh(format!("vertex {i} is not finite")));
    }
    if let Some(i) =
        wall.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= wall.vertices_mm.len()))
    {
        return Err(Error::Mesh(format!("triangle {i} names a vertex that does not exist")));
    }
    Ok(())
}

/// Checks that signed depth means anything: the wall is closed and outward.
///
/// # Errors
/// [`Error::Mesh`] saying what is wrong.
pub(crate) fn check_closed(wall: &SurfaceMesh) -> Result<()> {
    // Vertices at the same place count as one: files often repeat them for every triangle.
    let mut first: HashMap<[u64; 3], usize> = HashMap::with_capacity(wall.vertices_mm.len());
    let place = |v: &Vec3| [v.x + 0.0, v.y + 0.0, v.z + 0.0].map(f64::to_bits);
    let welded: Vec<usize> =
        wall.vertices_mm.iter().enumerate().map(|(i, v)| *first.entry(place(v)).or_insert(i)).collect();
    let mut balance: HashMap<(usize, usize), i32> = HashMap::with_capacity(wall.triangles.len() * 3 / 2);
    for t in &wall.triangles {
        for k in 0..3 {
            let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| welded[v as usize]);
            if a != b {
                *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
    }
    let open = balance.values().filter(|&&n| n != 0).count();
    if open > 0 {
        return Err(Error::Mesh(format!(
            "path lengths need a closed wall with one winding, but {open} edges are open or wound against their neighbour; \
             cap the openings first"
        )));
    }
    let volume = wall.signed_volume_mm3();
    if volume.is_nan() || volume <= 0.0 {
        return Err(Error::Mesh(format!(
            "the wall encloses {volume:.3} mm³: it is empty or inside out; triangles must be counter-clockwise seen from outside"
        )));
    }
    Ok(())
}
