//! Ends of vessels in the beam.
//!
//! A wall ends where its surface was cut; in the beam a vessel filled with contrast medium up to a flat end would
//! look sawn off. So it continues straight and tapers to a point, as if it divided into invisibly fine branches.

use endowire_core::vessel::{Opening, SurfaceMesh, Wall};

/// Length of an added tail relative to the radius of the opening, and number of rings along it.
const LENGTH: f64 = 3.0;
const RINGS: u32 = 14;

/// The closed surface of a wall whose openings taper off.
pub(crate) fn with_tails(wall: &Wall) -> SurfaceMesh {
    let mut mesh = wall.mesh().clone();
    wall.openings().iter().for_each(|opening| add_tail(&mut mesh, opening));
    mesh
}

fn add_tail(mesh: &mut SurfaceMesh, opening: &Opening) {
    let length_mm = LENGTH * opening.radius_mm;
    let sides = opening.boundary.len();
    let rim = opening.boundary.clone();
    let mut last = rim.clone();
    for ring in 1..RINGS {
        let part = f64::from(ring) / f64::from(RINGS);
        // Without a kink at its start.
        let scale = libm::cos(part * std::f64::consts::FRAC_PI_2);
        let first = mesh.vertices_mm.len() as u32;
        for &vertex in &rim {
            let from_centre = mesh.vertices_mm[vertex as usize] - opening.centre_mm;
            let along = opening.direction * (part * length_mm);
            mesh.vertices_mm.push(opening.centre_mm + along + from_centre * scale);
        }
        let next: Vec<u32> = (first..).take(sides).collect();
        for k in 0..sides {
            let l = (k + 1) % sides;
            mesh.triangles.extend([[last[k], last[l], next[l]], [last[k], next[l], next[k]]]);
        }
        last = next;
    }
    let point = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.push(opening.centre_mm + opening.direction * length_mm);
    mesh.triangles.extend((0..sides).map(|k| [last[k], last[(k + 1) % sides], point]));
}

#[cfg(test)]
mod tests {
    use endowire_core::Vec3;

    use super::*;
    use crate::cpu::check_closed;

    #[test]
    fn an_open_tube_is_closed_by_points_and_holds_their_volume_more() {
        // An open tube of radius 2 and length 30 with 48 sides.
        let sides = 48;
        let at = |k: u32, z: f64| {
            let (s, c) = (std::f64::consts::TAU * f64::from(k % sides) / f64::from(sides)).sin_cos();
            Vec3::new(2.0 * c, 2.0 * s, z)
        };
        let mut tube = SurfaceMesh::default();
        for ring in 0..=15 {
            tube.vertices_mm.extend((0..sides).map(|k| at(k, 2.0 * f64::from(ring))));
        }
        for ring in 0..15 {
            for k in 0..sides {
                let corner = |ring: u32, k: u32| ring * sides + k % sides;
                let [a, b] = [corner(ring, k), corner(ring, k + 1)];
                let [d, c] = [corner(ring + 1, k), corner(ring + 1, k + 1)];
                tube.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let wall = Wall::from_surface(&tube).unwrap();
        let tailed = with_tails(&wall);
        check_closed(&tailed).unwrap();
        let (low, high) = tailed.bounds_mm().unwrap();
        assert!((high.z - 36.0).abs() < 0.1 && (low.z + 6.0).abs() < 0.1, "{low} {high}");
        // ∫ cos²(π t/2) dt is a half: each tail is half a cylinder of 6 mm.
        let more = tailed.signed_volume_mm3() / wall.closed_mesh().signed_volume_mm3();
        assert!((more - 1.0 - 6.0 / 30.0).abs() < 0.01, "{more}");
    }
}
