//! The contact surface beyond the vessel's openings.
//!
//! A surface ends where the scan ended, and a wall that ceases to hold a tip from one point to the next has no
//! equilibrium there. Every opening that a device can pass is extended straight along its direction, like flow
//! extensions in vessel models, and closed at its end, so that there is a wall everywhere; smaller openings are holes
//! of the mesh and are closed. Extensions that would meet each other or the vessel are shortened. The triangles of
//! the vessel keep their numbers.
//!
//! An extension starts in the direction of the wall at the rim, which may be inclined to the opening's direction, for
//! example at the lip of a dome that was cut off: otherwise the kink would be a crest all around, at a lip one that
//! points into the lumen, over which a device finds no equilibrium. The inclination decreases over a radius of the
//! opening, x(w) = w (1 − w/R)².
//!
//! A rim has the corners of the cut surface, which would become furrows that catch a tip if extruded. So the rim
//! blends into its best-fit ellipse, r(s) = c + a cos s + b sin s with the fraction s of its length, over its own
//! width.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::Matrix3;

use crate::vessel::{Opening, SurfaceMesh, Wall};
use crate::{Error, PhysicalEnd, Result, Vec3};

/// Length of an extension left, mm, at which a tip counts as having left the vessel.
const LEFT_MM: f64 = 2.0;
/// Length over which a rim blends into an ellipse, in radii of the opening.
const ROUNDING: f64 = 2.0;
/// Length over which the wall's inclination at the rim decays, in radii of the opening.
const STRAIGHTENING: f64 = 1.0;
/// Largest slope of the wall against the opening's direction that is continued: an extension widens by 4/27 of it
/// times the radius, and a tenth of the radius is kept free around it.
const STEEPEST: f64 = 0.67;
/// Depth of the cone that closes an opening without room in front of it, in radii of the opening.
const INWARD: f64 = 0.1;
/// Half length of rim over which the inclination is averaged, in radii of the opening.
const NEIGHBOURHOOD: f64 = 0.3;

/// The surface of `wall` with its openings wider than `radius_mm` extended and the others closed.
pub(crate) fn extended(wall: &Wall, radius_mm: f64) -> SurfaceMesh {
    let mut mesh = wall.mesh().clone();
    let beside = beside_rims(wall);
    for opening in wall.openings() {
        if opening.beyond_mm == 0.0 {
            close_inward(&mut mesh, opening);
        } else if opening.radius_mm > radius_mm {
            extend(&mut mesh, opening, &beside);
        } else {
            opening.close(&mut mesh);
        }
    }
    mesh
}

/// Triangles with two corners on rims.
fn beside_rims(wall: &Wall) -> Vec<[u32; 3]> {
    let mut on_rim = vec![false; wall.mesh().vertices_mm.len()];
    wall.openings().iter().flat_map(|o| &o.boundary).for_each(|v| on_rim[*v as usize] = true);
    let is_beside = |t: &&[u32; 3]| t.iter().filter(|v| on_rim[**v as usize]).count() > 1;
    wall.mesh().triangles.iter().filter(is_beside).copied().collect()
}

/// Closes an opening that the vessel touches by a cone into it, since a flat cap would be felt on the other side.
fn close_inward(mesh: &mut SurfaceMesh, opening: &Opening) {
    let centre = mesh.vertices_mm.len();
    opening.close(mesh);
    mesh.vertices_mm[centre] -= opening.direction * (INWARD * opening.radius_mm);
}

/// Adds rings along the opening's direction, as far apart as the rim's vertices.
fn extend(mesh: &mut SurfaceMesh, opening: &Opening, beside: &[[u32; 3]]) {
    let count = opening.boundary.len();
    let at = |k: usize| mesh.vertices_mm[opening.boundary[k % count] as usize];
    let around = opening.boundary_length_mm(mesh);
    let rings = (opening.beyond_mm / (around / count as f64)).ceil().clamp(1.0, 1000.0) as usize;
    let rim: Vec<Vec3> = (0..count).map(at).collect();
    let round = ellipse(&rim);
    let leans = leans(mesh, opening, beside);
    let mut last = opening.boundary.clone();
    for ring in 1..=rings {
        let way_mm = opening.beyond_mm * ring as f64 / rings as f64;
        let t = (way_mm / (ROUNDING * opening.radius_mm)).min(1.0);
        let (share, way) = (t * t * (3.0 - 2.0 * t), opening.direction * way_mm);
        let u = (way_mm / (STRAIGHTENING * opening.radius_mm)).min(1.0);
        let lean_mm = way_mm * (1.0 - u) * (1.0 - u);
        let first = mesh.vertices_mm.len() as u32;
        let places = rim.iter().zip(&round).zip(&leans);
        mesh.vertices_mm.extend(places.map(|((v, w), lean)| v + (w - v) * share + way + lean * lean_mm));
        let next: Vec<u32> = (first..first + count as u32).collect();
        for k in 0..count {
            let l = (k + 1) % count;
            // Oriented like a cap along the boundary, as is the first triangle of the strip.
            mesh.triangles.push([last[k], last[l], next[k]]);
            mesh.triangles.push([last[l], next[l], next[k]]);
        }
        last = next;
    }
    let centre = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.push(opening.centre_mm + opening.direction * opening.beyond_mm);
    mesh.triangles.extend((0..count).map(|k| [last[k], last[(k + 1) % count], centre]));
}

/// Slope of the wall against the opening's direction at each corner of its rim: across over along, averaged over the
/// rim's neighbourhood, since a rim may be jagged. It is that of the planes of the triangles `beside` it.
fn leans(mesh: &SurfaceMesh, opening: &Opening, beside: &[[u32; 3]]) -> Vec<Vec3> {
    let boundary = &opening.boundary;
    let count = boundary.len();
    let number: BTreeMap<u32, usize> = boundary.iter().enumerate().map(|(k, v)| (*v, k)).collect();
    let mut outward = vec![Vec3::zeros(); count];
    for triangle in beside {
        for k in 0..3 {
            let ends = [0, 1, 2].map(|j| triangle[(k + j) % 3]);
            let (Some(&i), Some(&j)) = (number.get(&ends[0]), number.get(&ends[1])) else { continue };
            if (i + 1) % count != j && (j + 1) % count != i {
                continue;
            }
            let [a, b, c] = ends.map(|v| mesh.vertices_mm[v as usize]);
            let (edge, from) = (b - a, a - c);
            let away = from - edge * (edge.dot(&from) / edge.norm_squared().max(f64::MIN_POSITIVE));
            let way = away.try_normalize(0.0).unwrap_or_default() * edge.norm();
            outward[i] += way;
            outward[j] += way;
        }
    }
    let around = opening.boundary_length_mm(mesh).max(f64::MIN_POSITIVE);
    let reach = ((NEIGHBOURHOOD * opening.radius_mm * count as f64 / around).round() as usize).min(count / 2);
    let lean = |k: usize| {
        let sum: Vec3 = (0..=2 * reach).map(|n| outward[(k + count + n - reach) % count]).sum();
        let along = sum.dot(&opening.direction);
        let across = sum - opening.direction * along;
        let size = across.norm();
        if along > 0.0 && size > 0.0 { across * ((size / along).min(STEEPEST) / size) } else { Vec3::zeros() }
    };
    (0..count).map(lean).collect()
}

/// The points of the best-fit ellipse of a closed line, one for each of its corners: least squares over its length.
fn ellipse(line: &[Vec3]) -> Vec<Vec3> {
    let count = line.len();
    let side = |k: usize| (line[(k + 1) % count] - line[k]).norm();
    let around: f64 = (0..count).map(side).sum();
    let (mut s, mut matrix, mut right) = (0.0, Matrix3::zeros(), Matrix3::zeros());
    let mut rows = Vec::with_capacity(count);
    for k in 0..count {
        let row = Vec3::new(1.0, libm::cos(s), libm::sin(s));
        let length = 0.5 * (side(k) + side((k + count - 1) % count));
        matrix += row * row.transpose() * length;
        right += row * line[k].transpose() * length;
        rows.push(row);
        s += side(k) * TAU / around;
    }
    match matrix.cholesky() {
        Some(factor) => {
            let found = factor.solve(&right);
            rows.iter().map(|row| found.tr_mul(row)).collect()
        }
        // A degenerate triangle.
        None => line.to_vec(),
    }
}

/// How far beyond an opening a tip may go, mm.
pub(crate) fn leave_mm(opening: &Opening) -> f64 {
    (opening.beyond_mm - LEFT_MM).max(0.0)
}

/// Whether `x` lies beyond an opening, in its extension.
pub(crate) fn is_beyond_an_opening(openings: &[Opening], x: &Vec3) -> bool {
    openings.iter().any(|o| {
        let (beyond_mm, lateral_mm) = o.beyond_and_off_axis_mm(x);
        beyond_mm > 0.0 && beyond_mm <= o.beyond_mm && is_in_front(o, lateral_mm)
    })
}

/// Whether a point so far off an opening's axis lies in front of it.
fn is_in_front(opening: &Opening, lateral_mm: f64) -> bool {
    lateral_mm < 1.5 * opening.radius_mm
}

/// The opening through which a device whose points are given from its entry to its tip has left the vessel, and how
/// far its farthest point beyond is beyond the opening's plane, mm.
///
/// It is judged along the device and not by its tip's place: the last opening that the device passes outwards, unless
/// it comes back through it. So a tip that is carried past an extension's end in one command, or a device that turns
/// back outside, has left as well.
pub fn left_through(openings: &[Opening], line: impl IntoIterator<Item = Vec3>) -> Option<(&Opening, f64)> {
    let mut left: Option<(&Opening, f64)> = None;
    let mut before: Option<Vec3> = None;
    for point in line {
        if let Some(start) = before {
            if let Some((opening, outwards)) = passed(openings, &start, &point) {
                left = outwards.then_some((opening, 0.0));
            }
            if let Some((opening, farthest_mm)) = &mut left {
                *farthest_mm = farthest_mm.max(opening.beyond_and_off_axis_mm(&point).0);
            }
        }
        before = Some(point);
    }
    left
}

/// The opening that a segment passes, and whether outwards.
fn passed<'a>(openings: &'a [Opening], start: &Vec3, end: &Vec3) -> Option<(&'a Opening, bool)> {
    openings.iter().filter(|o| o.beyond_mm > 0.0).find_map(|o| {
        let height_mm = |x: &Vec3| (x - o.centre_mm).dot(&o.direction);
        let (from_mm, to_mm) = (height_mm(start), height_mm(end));
        if (from_mm > 0.0) == (to_mm > 0.0) {
            return None;
        }
        let at = start + (end - start) * (from_mm / (from_mm - to_mm));
        is_in_front(o, o.beyond_and_off_axis_mm(&at).1).then_some((o, to_mm > 0.0))
    })
}

/// Rejects a device that, `ahead_mm` farther, would be too far beyond an opening; its points are given from its entry
/// to its tip.
///
/// # Errors
/// [`PhysicalEnd::Left`].
pub fn check_inside(openings: &[Opening], line: impl IntoIterator<Item = Vec3>, ahead_mm: f64) -> Result<()> {
    let Some((opening, beyond_mm)) = left_through(openings, line) else { return Ok(()) };
    let limit_mm = leave_mm(opening);
    if beyond_mm + ahead_mm > limit_mm {
        return Err(Error::End(PhysicalEnd::Left { opening: opening.index, beyond_mm, limit_mm }));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vessel::{GeneratedWall, Resolution, anatomy, check};

    #[test]
    fn the_extended_vessel_is_sound_and_keeps_its_triangles() {
        let wall =
            GeneratedWall::new(&anatomy::tree("aortic_arch").unwrap(), Resolution::EdgeMm(3.0)).unwrap().wall;
        let mesh = extended(&wall, 0.5);
        assert_eq!(mesh.triangles[..wall.mesh().triangles.len()], wall.mesh().triangles[..]);
        let report = check(&mesh).unwrap();
        assert!(report.watertight && report.is_sound(), "{report:?}");
        let closed = check(&extended(&wall, 100.0)).unwrap();
        assert!(closed.watertight && closed.is_sound(), "{closed:?}");
    }

    #[test]
    fn corners_of_a_rim_vanish_and_an_ellipse_stays() {
        let polygon = |rough: f64| -> Vec<Vec3> {
            (0..24)
                .map(|k| {
                    let (sin, cos) = (TAU * f64::from(k) / 24.0).sin_cos();
                    Vec3::new(3.0 * cos, 3.0 * sin, 0.3 * cos) * (1.0 + rough * f64::from(k % 2))
                })
                .collect()
        };
        let (smooth, rough) = (polygon(0.0), polygon(0.1));
        for (v, w) in smooth.iter().zip(ellipse(&smooth)) {
            assert!((v - w).norm() < 0.01, "{v} {w}");
        }
        let sizes: Vec<f64> = ellipse(&rough).iter().map(|v| v.xy().norm()).collect();
        let (least, most) = sizes.iter().fold((f64::MAX, 0.0f64), |(a, b), r| (a.min(*r), b.max(*r)));
        assert!(most - least < 0.02 && (least - 3.15).abs() < 0.03, "{least} {most}");
    }

    #[test]
    fn an_extension_begins_as_the_wall_arrives() {
        // A tube of radius 4 that narrows towards its end by 0.5 mm per mm.
        let ring = |z: f64, r: f64| {
            (0..24).map(move |k| {
                let (sin, cos) = (TAU * f64::from(k) / 24.0).sin_cos();
                Vec3::new(r * cos, r * sin, z)
            })
        };
        let rings = [(0.0, 4.0), (5.0, 4.0), (8.0, 4.0), (9.0, 3.5), (10.0, 3.0)];
        let vertices_mm = rings.into_iter().flat_map(|(z, r)| ring(z, r)).collect();
        let strip = |n: u32| {
            (0..24).flat_map(move |k| {
                let [a, b] = [24 * n + k, 24 * n + (k + 1) % 24];
                [[a, b, a + 24], [b, b + 24, a + 24]]
            })
        };
        let wall =
            Wall::from_surface(&SurfaceMesh { vertices_mm, triangles: (0..4).flat_map(strip).collect() })
                .unwrap();
        let top = wall.openings().iter().find(|o| o.direction.z > 0.5).unwrap();
        for lean in leans(wall.mesh(), top, &beside_rims(&wall)).iter().zip(&top.boundary) {
            let out = wall.mesh().vertices_mm[*lean.1 as usize].xy().normalize();
            assert!((lean.0.xy() + out * 0.5).norm() < 0.02 && lean.0.z.abs() < 1e-12, "{lean:?}");
        }
        // Where the tube is straight the slope is zero.
        let bottom = wall.openings().iter().find(|o| o.direction.z < -0.5).unwrap();
        assert!(leans(wall.mesh(), bottom, &beside_rims(&wall)).iter().all(|lean| lean.norm() < 1e-9));
        let mesh = extended(&wall, 0.5);
        let radii = mesh.vertices_mm.iter().filter(|v| v.z > 10.5).map(|v| v.xy().norm());
        let (least, most) =
            radii.filter(|r| *r > 0.1).fold((f64::MAX, 0.0f64), |(a, b), r| (a.min(r), b.max(r)));
        // Wider by 0.5 · 4/27 of the radius, and back to it at the end.
        assert!(
            (least - (3.0 - 3.0 * 0.5 * 4.0 / 27.0)).abs() < 0.03 && (most - 3.0).abs() < 0.03,
            "{least} {most}"
        );
    }

    /// A straight tube of 100 mm along z, and a device in it as the points of a line.
    fn left_a_tube(heights_mm: &[f64], off_mm: &[f64]) -> Option<f64> {
        let wall = GeneratedWall::new(&anatomy::tree("straight_tube").unwrap(), Resolution::EdgeMm(2.0))
            .unwrap()
            .wall;
        let top = wall.openings().iter().find(|o| o.direction.z > 0.5).unwrap();
        let line = heights_mm.iter().zip(off_mm).map(|(z, x)| Vec3::new(*x, 0.0, *z));
        left_through(wall.openings(), line).map(|(opening, beyond_mm)| {
            assert_eq!(opening.index, top.index);
            beyond_mm
        })
    }

    #[test]
    fn a_device_has_left_through_the_opening_that_it_passes_last() {
        let is = |found: Option<f64>, beyond_mm: f64| (found.unwrap() - beyond_mm).abs() < 1e-6;
        assert!(is(left_a_tube(&[0.0, 95.0, 105.0], &[0.0, 0.0, 1.0]), 5.0));
        assert!(left_a_tube(&[0.0, 50.0, 95.0], &[0.0, 0.0, 1.0]).is_none());
        // In one command past the end of the extension, and then back beside the tube.
        assert!(is(left_a_tube(&[0.0, 90.0, 140.0], &[0.0; 3]), 40.0));
        assert!(is(left_a_tube(&[0.0, 90.0, 110.0, 140.0, 90.0], &[0.0, 0.0, 0.0, 30.0, 60.0]), 40.0));
        // A hairpin: as far as its bend, until its tip is back.
        assert!(is(left_a_tube(&[0.0, 95.0, 115.0, 101.0], &[0.0, 0.0, 0.5, 1.0]), 15.0));
        assert!(left_a_tube(&[0.0, 95.0, 115.0, 90.0], &[0.0, 0.0, 0.5, 1.0]).is_none());
        // Beside an opening nothing is passed.
        assert!(left_a_tube(&[90.0, 110.0], &[60.0, 60.0]).is_none());
    }
}
