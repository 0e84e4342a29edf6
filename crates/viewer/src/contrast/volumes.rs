//! The visible lumen of each point of the tree.
//!
//! The medium of a cell is its fraction times its volume. An image shows that medium in the lumen according to the
//! cell's shares, so that is the volume which the cell must have: then the visible amount is the injected one,
//! wherever surface and centre line disagree, at branches' origins and in the ends added for images.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::mixing::{Mixing, STEP_MM};
use crate::cpu::ScreenTriangle;

/// Approximate number of sample positions in the lumen.
const PLACES: f64 = 4e5;
/// Largest distance of lines through the lumen, mm, and largest number of lines side by side.
const APART_MM: f64 = 1.0;
const MOST_ACROSS: f64 = 4000.0;

/// Volumes of `cells` cells in the lumen that a closed `wall` encloses, mm³.
pub(super) fn volumes_mm3(mixing: &mut Mixing, cells: usize, wall: &SurfaceMesh) -> Vec<f64> {
    let mut volumes = vec![0.0; cells];
    let Some((low, high)) = wall.bounds_mm() else { return volumes };
    let wanted_mm = libm::cbrt(wall.signed_volume_mm3().max(0.0) / PLACES).min(APART_MM);
    let apart_mm = wanted_mm.max((high - low).amax() / MOST_ACROSS);
    if apart_mm <= 0.0 {
        return volumes;
    }
    let size = [high.x - low.x, high.y - low.y].map(|length| (length / apart_mm).ceil() as u32 + 1);
    // Intersections of lines along z with the wall: line, height, and whether they leave.
    let mut meetings: Vec<(usize, f64, bool)> = Vec::new();
    for index in 0..wall.triangles.len() {
        let corners = wall.corners(index);
        let on_screen = corners.map(|v| [(v.x - low.x) / apart_mm, (v.y - low.y) / apart_mm]);
        let Some(triangle) = ScreenTriangle::new(on_screen) else { continue };
        let leaves = triangle.area2() > 0.0;
        triangle.scan(size, |x, y, weights| {
            let sum: f64 = weights.iter().sum();
            let z = corners.iter().zip(weights).map(|(v, w)| v.z * w).sum::<f64>() / sum;
            meetings.push((y * size[0] as usize + x, z, leaves));
        });
    }
    meetings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut shares = Vec::new();
    for of_line in meetings.chunk_by(|a, b| a.0 == b.0) {
        let line = of_line[0].0;
        let [x, y] = [line % size[0] as usize, line / size[0] as usize].map(|i| (i as f64 + 0.5) * apart_mm);
        let mut depth = 0;
        for pair in of_line.windows(2) {
            depth += if pair[0].2 { -1 } else { 1 };
            let length = pair[1].1 - pair[0].1;
            if depth <= 0 || length <= 0.0 {
                continue;
            }
            let steps = (length / STEP_MM).ceil();
            let volume = apart_mm * apart_mm * length / steps;
            for k in 0..steps as usize {
                let z = pair[0].1 + (k as f64 + 0.5) * length / steps;
                let place = Vec3::new(low.x + x, low.y + y, z);
                mixing.remember(&place);
                mixing.shares(&place, &mut shares);
                shares.iter().for_each(|&(cell, share)| volumes[cell as usize] += volume * f64::from(share));
            }
        }
    }
    volumes
}
