//! Closed surfaces through rings of points.

use std::f64::consts::TAU;

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

/// Number of corners of tubes.
const TUBE_SIDES: usize = 14;
/// Number of points between two given ones on a smooth curve.
const BETWEEN: usize = 6;
/// Smallest radius of a tube: a tip.
const TIP_MM: f64 = 0.05;

/// Adds a closed surface through rings with equal numbers of points, counter-clockwise seen from the last ring.
pub(super) fn loft(mesh: &mut SurfaceMesh, rings: &[Vec<Vec3>]) {
    let first = mesh.vertices_mm.len() as u32;
    let sides = rings[0].len() as u32;
    rings.iter().for_each(|ring| mesh.vertices_mm.extend(ring));
    let corner = |ring: u32, k: u32| first + ring * sides + k % sides;
    for ring in 0..rings.len() as u32 - 1 {
        for k in 0..sides {
            let [a, b, c, d] =
                [corner(ring, k), corner(ring, k + 1), corner(ring + 1, k + 1), corner(ring + 1, k)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    for (ring, turned) in [(0, true), (rings.len() as u32 - 1, false)] {
        let points = &rings[ring as usize];
        let hub = mesh.vertices_mm.len() as u32;
        mesh.vertices_mm.push(points.iter().sum::<Vec3>() / f64::from(sides));
        for k in 0..sides {
            let [a, b] = [corner(ring, k), corner(ring, k + 1)];
            mesh.triangles.push(if turned { [hub, b, a] } else { [hub, a, b] });
        }
    }
}

/// Adds the surfaces drawn by `draw` inside out, as a cavity.
pub(super) fn hollow(mesh: &mut SurfaceMesh, draw: impl FnOnce(&mut SurfaceMesh)) {
    let first = mesh.triangles.len();
    draw(mesh);
    mesh.triangles[first..].iter_mut().for_each(|t| t.swap(1, 2));
}

/// Adds a closed tube along at least two points with their radii.
pub(super) fn tube(mesh: &mut SurfaceMesh, points: &[(Vec3, f64)]) {
    let last = points.len() - 1;
    let mut side = Vec3::zeros();
    let rings: Vec<Vec<Vec3>> = (0..=last)
        .map(|i| {
            let along = (points[(i + 1).min(last)].0 - points[i.saturating_sub(1)].0).normalize();
            let start = if i == 0 { Vec3::new(along.y, along.z, along.x).cross(&along) } else { side };
            side = (start - along * start.dot(&along)).normalize();
            let other = along.cross(&side);
            (0..TUBE_SIDES)
                .map(|k| {
                    let (s, c) = libm::sincos(TAU * k as f64 / TUBE_SIDES as f64);
                    points[i].0 + (side * c + other * s) * points[i].1.max(TIP_MM)
                })
                .collect()
        })
        .collect();
    loft(mesh, &rings);
}

/// Adds a closed flat bar through points with half its thickness and the vector of half its height there, with all
/// surfaces `inset` inside.
pub(super) fn bar(mesh: &mut SurfaceMesh, points: &[(Vec3, f64, Vec3)], inset: f64) {
    let last = points.len() - 1;
    let ring = |i: usize| -> Vec<Vec3> {
        let (middle, thick, tall) = points[i];
        let along = points[(i + 1).min(last)].0 - points[i.saturating_sub(1)].0;
        let across = along.cross(&tall).normalize() * (thick - inset).max(TIP_MM);
        let tall = tall.normalize() * (tall.norm() - inset).max(TIP_MM);
        (0..TUBE_SIDES)
            .map(|k| {
                let (s, c) = libm::sincos(TAU * k as f64 / TUBE_SIDES as f64);
                middle + across * s + tall * c
            })
            .collect()
    };
    loft(mesh, &(0..=last).map(ring).collect::<Vec<_>>());
}

/// Adds a bowl about a centre, of these outer and inner radii, whose bottom lies in a direction and whose rim is this
/// angle away from it.
pub(super) fn bowl(mesh: &mut SurfaceMesh, centre: Vec3, [outer, inner]: [f64; 2], down: Vec3, rim_rad: f64) {
    const RINGS: i32 = 10;
    let down = down.normalize();
    let first = Vec3::new(down.y, down.z, down.x).cross(&down).normalize();
    let second = first.cross(&down);
    let ring = |radius: f64, k: i32| -> Vec<Vec3> {
        let (s, c) = libm::sincos(rim_rad * f64::from(k) / f64::from(RINGS));
        let at = |k: usize| libm::sincos(TAU * k as f64 / (2 * TUBE_SIDES) as f64);
        (0..2 * TUBE_SIDES)
            .map(at)
            .map(|(v, u)| centre + (down * c + (first * u + second * v) * s) * radius)
            .collect()
    };
    let outside = (1..=RINGS).map(|k| ring(outer, k));
    let inside = (1..=RINGS).rev().map(|k| ring(inner, k));
    loft(mesh, &outside.chain(inside).collect::<Vec<_>>());
}

/// Adds an ellipsoid with half axes along the coordinates.
pub(super) fn ellipsoid(mesh: &mut SurfaceMesh, centre: Vec3, half: Vec3) {
    ellipsoid_of(mesh, 18, centre, half);
}

/// The same of this number of rings.
pub(super) fn ellipsoid_of(mesh: &mut SurfaceMesh, rings: usize, centre: Vec3, half: Vec3) {
    let ring = |i: usize| -> Vec<Vec3> {
        let (s, c) = libm::sincos(std::f64::consts::PI * i as f64 / rings as f64);
        (0..2 * rings)
            .map(|k| {
                let (v, u) = libm::sincos(TAU * k as f64 / (2 * rings) as f64);
                centre + half.component_mul(&Vec3::new(s * u, s * v, -c))
            })
            .collect()
    };
    loft(mesh, &(1..rings).map(ring).collect::<Vec<_>>());
}

/// A smooth curve through points with their radii (Catmull and Rom 1974), all reduced by `inset`, with round ends.
pub(super) fn smooth(points: &[(Vec3, f64)], inset: f64) -> Vec<(Vec3, f64)> {
    let last = points.len() as isize - 1;
    let at = |i: isize| points[i.clamp(0, last) as usize];
    // Rings of a hemisphere beyond an end.
    let cap = |from: isize, to: isize| {
        let along = (at(to).0 - at(from).0).normalize();
        [0.5, 1.0, 1.45].map(|angle: f64| {
            let radius = at(to).1 - inset;
            (at(to).0 + along * (radius.max(0.0) * libm::sin(angle)), radius * libm::cos(angle))
        })
    };
    let mut curve: Vec<(Vec3, f64)> = cap(1, 0).into_iter().rev().collect();
    for i in 0..last {
        let [a, b, c, d] = [i - 1, i, i + 1, i + 2].map(at);
        for k in 0..BETWEEN {
            let t = k as f64 / BETWEEN as f64;
            let bend = (c.0 - a.0) * t
                + (a.0 * 2.0 - b.0 * 5.0 + c.0 * 4.0 - d.0) * (t * t)
                + (b.0 * 3.0 - a.0 - c.0 * 3.0 + d.0) * (t * t * t);
            curve.push((b.0 + bend / 2.0, b.1 + (c.1 - b.1) * t - inset));
        }
    }
    curve.push((at(last).0, at(last).1 - inset));
    curve.extend(cap(last - 1, last));
    curve
}
