//! The pixels at least half covered by a closed wall, by 8 × 8 rays each: the rays of a pixel are the bits of a word.

use endowire_core::vessel::SurfaceMesh;

use super::raster::{ScreenTriangle, span};
use super::wall::seen;
use crate::c_arm::CArm;

/// Number of rays across a pixel.
const RAYS: usize = 8;
/// Marks pixels that are not requested.
const NOT_ASKED: u32 = u32::MAX;

/// Those `asked` pixels that are at least half covered. Pixels at the silhouette are few, and triangles elsewhere are
/// skipped, so this is far less work than rays through the whole image.
pub(crate) fn covered_by_half(c_arm: &CArm, wall: &SurfaceMesh, asked: &[u32]) -> Vec<u32> {
    let [width, height] = c_arm.size_px().map(|n| n as usize);
    let mut places = vec![NOT_ASKED; width * height];
    (0..).zip(asked).for_each(|(place, &pixel)| places[pixel as usize] = place);
    let mut words = vec![0_u64; asked.len()];
    let rays = c_arm.refined(RAYS as u32);
    let [columns, rows] = rays.size_px();
    let seen = seen(&rays, wall);
    for corners in &wall.triangles {
        let corners = corners.map(|v| seen[v as usize].0);
        // A ray that leaves has entered: triangles that face the source, clockwise on the screen, are sufficient.
        let Some(triangle) = ScreenTriangle::on_grid(corners).filter(|t| t.area2() > 0.0) else { continue };
        let [xs, ys] = [(0, columns), (1, rows)].map(|(k, size)| {
            let [a, b, c] = corners.map(|corner| corner[k]);
            span(a.min(b).min(c), a.max(b).max(c), size)
        });
        let pixels = |rays: &std::ops::Range<usize>| rays.start / RAYS..rays.end.div_ceil(RAYS);
        let is_asked = |y: usize| places[y * width..][pixels(&xs)].iter().any(|place| *place != NOT_ASKED);
        if !pixels(&ys).any(is_asked) {
            continue;
        }
        for y in ys {
            let (low, high) = triangle.extent(y as f64 + 0.5);
            let met = span(low, high, columns);
            for x in pixels(&met) {
                let place = places[y / RAYS * width + x];
                if place != NOT_ASKED {
                    let [first, end] =
                        [met.start, met.end].map(|ray| ray.clamp(x * RAYS, (x + 1) * RAYS) - x * RAYS);
                    words[place as usize] |= ((1_u64 << end) - (1_u64 << first)) << (y % RAYS * RAYS);
                }
            }
        }
    }
    let half = |word: &u64| word.count_ones() as usize >= RAYS * RAYS / 2;
    asked.iter().zip(&words).filter(|(_, word)| half(word)).map(|(pixel, _)| *pixel).collect()
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;

    use super::*;
    use crate::cpu::wall::wall_path_mm;
    use crate::spec::CArmSpec;

    /// A closed tube of some radius, bent like an arc, of quadrilaterals cut in two.
    fn tube(radius_mm: f64) -> SurfaceMesh {
        const AROUND: u32 = 48;
        const ALONG: u32 = 60;
        let mut vertices_mm = Vec::new();
        for i in 0..=ALONG {
            let at = 2.5 * f64::from(i) / f64::from(ALONG);
            let out = Vec3::new(at.cos(), 0.0, at.sin());
            for j in 0..AROUND {
                let turn = std::f64::consts::TAU * f64::from(j) / f64::from(AROUND);
                vertices_mm.push(out * (30.0 + radius_mm * turn.cos()) + Vec3::y() * radius_mm * turn.sin());
            }
        }
        let mut triangles = Vec::new();
        for i in 0..ALONG {
            for j in 0..AROUND {
                let at = |i: u32, j: u32| i * AROUND + j % AROUND;
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
                triangles.push([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
        for j in 1..AROUND - 1 {
            let last = ALONG * AROUND;
            triangles.push([0, j + 1, j]);
            triangles.push([last, last + j, last + j + 1]);
        }
        let mesh = SurfaceMesh { vertices_mm, triangles };
        assert!(mesh.signed_volume_mm3() > 0.0);
        mesh
    }

    #[test]
    fn half_coverage_is_that_of_lengths_of_as_many_rays_and_two_of_four_rays_are_too_many() {
        for radius_mm in [0.4, 1.5, 6.0] {
            let wall = tube(radius_mm);
            let spec = CArmSpec {
                primary_deg: 25.0,
                secondary_deg: 10.0,
                pixel_mm: Some(0.6),
                ..CArmSpec::default()
            };
            let arm = CArm::new(&spec, [160, 160], &wall).unwrap();
            let met = |rays: u32| {
                let lengths = wall_path_mm(&arm.refined(rays), &wall);
                let mut met = vec![0_u32; 160 * 160];
                let width = 160 * rays as usize;
                for (ray, length) in lengths.iter().enumerate() {
                    let pixel = ray / width / rays as usize * 160 + ray % width / rays as usize;
                    met[pixel] += u32::from(*length > 1e-3);
                }
                met
            };
            let (two, eight) = (met(2), met(8));
            let edge: Vec<u32> = (0..160 * 160).filter(|&i| (1..=3).contains(&two[i as usize])).collect();
            let covered = covered_by_half(&arm, &wall, &edge);
            let exact: Vec<u32> = edge.iter().copied().filter(|&i| eight[i as usize] >= 32).collect();
            let off = covered.iter().filter(|i| !exact.contains(i)).count()
                + exact.iter().filter(|i| !covered.contains(i)).count();
            // For grazing rays rounding decides.
            assert!(edge.len() > 100 && off * 100 <= edge.len(), "{radius_mm}: {off} of {}", edge.len());
            // Counter-check: with only four rays, of which two must hit.
            let rough = edge.iter().filter(|&&i| two[i as usize] >= 2).count();
            assert!(rough * 20 > exact.len() * 21, "{radius_mm}: {rough} {}", exact.len());
            // Elsewhere four rays give the same.
            let lost =
                (0..160 * 160).filter(|&i| two[i] % 4 == 0 && (two[i] == 4) != (eight[i] >= 32)).count();
            assert!(lost * 50 <= edge.len(), "{radius_mm}: {lost}");
        }
    }
}
