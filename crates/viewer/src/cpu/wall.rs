//! Length of every ray inside a closed wall: signed depth.
//!
//! A ray enters a closed surface where it meets a triangle from outside and leaves it where it meets one from inside,
//! so the length inside is Σ ±t, minus at entries and plus at exits. Along a ray, t = depth · obliquity, and on a
//! plane 1/depth is linear over the screen: it is interpolated from the corners with the pixel's weights, which
//! cannot overshoot even for a triangle seen almost edge-on. Neighbours agree on their shared edge, so a silhouette
//! contributes nothing rather than a spike.

use std::cmp::Ordering;
use std::ops::Range;

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result, Vec3};
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap};

use crate::c_arm::CArm;
use crate::cpu::raster::{ScreenTriangle, on_grid};

/// Number of rows of a band, which one thread sums in double precision.
const BAND_ROWS: u32 = 32;

/// Pixel, rounded to the grid, and inverse depth of each vertex.
pub(crate) fn seen(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<([f64; 2], f64)> {
    let vertex = |v: &Vec3| {
        let beam = c_arm.in_beam(v);
        (on_grid(c_arm.pixel_of(&beam)), 1.0 / (c_arm.sod_mm() + beam.z))
    };
    wall.vertices_mm.par_iter().map(vertex).collect()
}

/// Calls `visit(pixel, sign, depth)` for each intersection of a pixel's central ray with `triangles` in some rows of
/// the image: −1 where it enters and +1 where it leaves, at a depth in front of the source.
fn meetings(
    width: u32,
    rows: Range<u32>,
    triangles: impl Iterator<Item = [u32; 3]>,
    seen: &[([f64; 2], f64)],
    mut visit: impl FnMut(usize, f64, f64),
) {
    for [a, b, c] in triangles {
        let ((a, i0), (b, i1), (c, i2)) = (seen[a as usize], seen[b as usize], seen[c as usize]);
        let Some(triangle) = ScreenTriangle::on_grid([a, b, c]) else { continue };
        // Outward triangles are clockwise on the screen (positive area, rows downwards) where they face the source.
        let sign = -triangle.area2().signum();
        triangle.scan_rows(width, rows.clone(), |x, y, [w0, w1, w2]| {
            visit(y * width as usize + x, sign, (w0 + w1 + w2) / (w0 * i0 + w1 * i1 + w2 * i2));
        });
    }
}

/// The triangles that may be visible in each band of rows, ascending: so sums have the same order for any number of
/// threads.
fn by_band(height: u32, wall: &SurfaceMesh, seen: &[([f64; 2], f64)]) -> Vec<Vec<u32>> {
    let mut bands = vec![vec![]; height.div_ceil(BAND_ROWS) as usize];
    for (index, corners) in (0..).zip(&wall.triangles) {
        let [a, b, c] = *corners;
        let [a, b, c] = [seen[a as usize].0[1], seen[b as usize].0[1], seen[c as usize].0[1]];
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // Casts saturate; one more row on either side allows for the rounding of corners.
        let first = (low - 1.0).max(0.0) as usize / BAND_ROWS as usize;
        let end = ((high + 1.0).max(0.0) as usize / BAND_ROWS as usize + 1).min(bands.len());
        bands[first.min(end)..end].iter_mut().for_each(|band| band.push(index));
    }
    bands
}

/// Length inside `wall` of the central ray of each pixel, row by row.
pub(crate) fn wall_path_mm(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<f32> {
    let [width, height] = c_arm.size_px();
    let seen = seen(c_arm, wall);
    let bands = by_band(height, wall, &seen);
    let [columns, rows] = c_arm.squared_slopes();
    let mut path = vec![0.0; width as usize * height as usize];
    let strips = path.par_chunks_mut((BAND_ROWS * width) as usize).zip(&bands).enumerate();
    strips.for_each_init(Vec::new, |sums, (band, (strip, triangles))| {
        let top = band as u32 * BAND_ROWS;
        let bottom = (top + BAND_ROWS).min(height);
        let first = top as usize * width as usize;
        sums.clear();
        sums.resize(strip.len(), 0.0);
        let triangles = triangles.iter().map(|index| wall.triangles[*index as usize]);
        meetings(width, top..bottom, triangles, &seen, |pixel, sign, depth| {
            sums[pixel - first] += sign * depth;
        });
        let lines = strip.chunks_exact_mut(width as usize).zip(sums.chunks_exact(width as usize));
        for ((lengths, sums), y) in lines.zip(&rows[top as usize..]) {
            for ((length, sum), x) in lengths.iter_mut().zip(sums).zip(&columns) {
                *length = (sum * (1.0 + x + y).sqrt()) as f32;
            }
        }
    });
    path
}

/// Every intersection of a pixel's central ray with `wall`: the pixel, the distance from the source, and whether it
/// enters.
pub(crate) fn wall_crossings(c_arm: &CArm, wall: &SurfaceMesh) -> Vec<(u32, f32, bool)> {
    let mut crossings = Vec::new();
    let [width, height] = c_arm.size_px();
    let triangles = wall.triangles.iter().copied();
    meetings(width, 0..height, triangles, &seen(c_arm, wall), |pixel, sign, depth| {
        crossings.push((pixel as u32, (depth * c_arm.obliquity_at(pixel)) as f32, sign < 0.0));
    });
    crossings
}

/// Checks that a wall can be drawn: it has triangles, their vertices exist, and these are finite.
///
/// # Errors
/// [`Error::Mesh`] with the fault.
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

/// Checks that signed depth is meaningful: the wall is closed and outward.
///
/// # Errors
/// [`Error::Mesh`] with the fault.
pub(crate) fn check_closed(wall: &SurfaceMesh) -> Result<()> {
    let open = unbalanced_edges(wall);
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

/// Edges that the triangles of `wall` do not traverse equally often in both directions.
fn unbalanced_edges(wall: &SurfaceMesh) -> usize {
    let welded = welded(&wall.vertices_mm);
    // Edges encoded by their ends, the smaller index in the higher half of a number, separately for triangles
    // traversing them upwards and downwards. Sorting takes a tenth of the time of a hash map.
    let [mut up, mut down] = [0, 1].map(|_| Vec::<u64>::with_capacity(wall.triangles.len() * 3 / 2));
    let edge = |from: u32, to: u32| u64::from(from) << 32 | u64::from(to);
    for t in &wall.triangles {
        for k in 0..3 {
            let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| welded[v as usize]);
            match a.cmp(&b) {
                Ordering::Less => up.push(edge(a, b)),
                Ordering::Greater => down.push(edge(b, a)),
                Ordering::Equal => {}
            }
        }
    }
    up.sort_unstable();
    down.sort_unstable();
    let runs = |edges: &[u64]| edges.iter().take_while(|edge| **edge == edges[0]).count();
    let (mut up, mut down) = (&up[..], &down[..]);
    let mut unbalanced = 0;
    while let Some(next) = up.first().into_iter().chain(down.first()).min() {
        let here = |edges: &[u64]| if edges.first() == Some(next) { runs(edges) } else { 0 };
        let [n, m] = [here(up), here(down)];
        unbalanced += usize::from(n != m);
        (up, down) = (&up[n..], &down[m..]);
    }
    unbalanced
}

/// For each vertex the first at the same position: files often repeat them for every triangle.
fn welded(vertices_mm: &[Vec3]) -> Vec<u32> {
    // Zeros of either sign are the same position.
    let place = |v: &Vec3| [v.x + 0.0, v.y + 0.0, v.z + 0.0].map(f64::to_bits);
    let mut first = FxHashMap::with_capacity_and_hasher(vertices_mm.len(), FxBuildHasher);
    vertices_mm.iter().map(place).zip(0..).map(|(place, v)| *first.entry(place).or_insert(v)).collect()
}
