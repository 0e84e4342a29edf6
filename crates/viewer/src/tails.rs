//! Ends of vessels in the beam.
//!
//! A wall ends where its surface was cut. A real artery goes on and divides, and more and more of its medium is in
//! branches too fine to be seen. So a vessel continues straight beyond its openings, and contrast medium fades along
//! this tail: filled up to a flat end it would look sawn off, filled up to a tip like a sharpened pencil.

use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::vessel::{Opening, SurfaceMesh, Wall};

/// Length of a tail relative to the radius of its opening, and the longest one, mm: behind the aorta it must not
/// hold so much blood that a bolus is smeared.
const LENGTH: f64 = 6.0;
const LONGEST_MM: f64 = 40.0;
/// Number of rings along a tail. Medium that is everywhere is less by the same amount from each one on.
const RINGS: u32 = 12;

/// Length over which medium fades beyond an end of this radius, mm.
pub(crate) fn fade_mm(radius_mm: f64) -> f64 {
    (LENGTH * radius_mm).min(LONGEST_MM)
}

/// Share of the medium that is still seen at a part of this length.
pub(crate) fn left(part: f64) -> f64 {
    let left = 1.0 - part.clamp(0.0, 1.0);
    left * left * (3.0 - 2.0 * left)
}

/// The part of the length at which this share is left.
fn part_with(share: f64) -> f64 {
    0.5 + libm::sin(libm::asin(1.0 - 2.0 * share) / 3.0)
}

/// What is filled with blood in the beam.
#[derive(Debug, Default)]
pub(crate) struct Filled {
    /// The closed surface of a wall with tails at its openings.
    pub(crate) surface: Arc<SurfaceMesh>,
    /// The tails from each of their rings on: a ray's length in all of these together is [`Filled::DEPTH`] times the
    /// length that medium seems to lack.
    pub(crate) faded: SurfaceMesh,
}

impl Filled {
    /// Number of surfaces that `faded` consists of at the tip of a tail.
    pub(crate) const DEPTH: f32 = RINGS as f32;

    /// The lumen of a wall with tails.
    pub(crate) fn with_tails(wall: &Wall) -> Self {
        let (mut surface, mut faded) = (wall.mesh().clone(), SurfaceMesh::default());
        wall.openings().iter().for_each(|opening| add_tail(&mut surface, &mut faded, opening));
        Self { surface: Arc::new(surface), faded }
    }
}

fn add_tail(surface: &mut SurfaceMesh, faded: &mut SurfaceMesh, opening: &Opening) {
    let length_mm = fade_mm(opening.radius_mm);
    let rim: Vec<Vec3> = opening.boundary.iter().map(|&v| surface.vertices_mm[v as usize]).collect();
    let mut last = opening.boundary.clone();
    let mut last_faded = vec![];
    for ring in 0..RINGS {
        let part = part_with(1.0 - (f64::from(ring) + 0.5) / f64::from(RINGS));
        let middle = opening.centre_mm + opening.direction * (part * length_mm);
        // Slowly narrower at first, as arteries are.
        let scale = libm::sqrt(libm::cos(part * std::f64::consts::FRAC_PI_2));
        let places: Vec<Vec3> = rim.iter().map(|v| middle + (v - opening.centre_mm) * scale).collect();
        let next = add_points(surface, &places);
        join(surface, &last, &next, 1);
        last = next;
        let next = add_points(faded, &places);
        join(faded, &last_faded, &next, ring);
        let middle = add_points(faded, &[middle])[0];
        // Towards the vessel.
        close(faded, &next, middle, [1, 0]);
        last_faded = next;
    }
    let tip = [opening.centre_mm + opening.direction * length_mm];
    let point = add_points(surface, &tip)[0];
    close(surface, &last, point, [0, 1]);
    let point = add_points(faded, &tip)[0];
    (0..RINGS).for_each(|_| close(faded, &last_faded, point, [0, 1]));
}

fn add_points(mesh: &mut SurfaceMesh, places_mm: &[Vec3]) -> Vec<u32> {
    let first = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.extend(places_mm);
    (first..).take(places_mm.len()).collect()
}

/// Adds the band between two rings a number of times.
fn join(mesh: &mut SurfaceMesh, last: &[u32], next: &[u32], times: u32) {
    let sides = last.len();
    for _ in 0..times {
        for k in 0..sides {
            let l = (k + 1) % sides;
            mesh.triangles.extend([[last[k], last[l], next[l]], [last[k], next[l], next[k]]]);
        }
    }
}

/// Adds the fan between a ring and a point, with the corners of a side in this order.
fn close(mesh: &mut SurfaceMesh, ring: &[u32], point: u32, [first, second]: [usize; 2]) {
    let sides = ring.len();
    mesh.triangles.extend((0..sides).map(|k| [ring[(k + first) % sides], ring[(k + second) % sides], point]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::check_closed;

    /// An open tube of radius 2 and length 30 with 48 sides.
    fn tube() -> Wall {
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
        Wall::from_surface(&tube).unwrap()
    }

    #[test]
    fn an_open_tube_is_closed_by_tails_of_three_diameters() {
        let wall = tube();
        let filled = Filled::with_tails(&wall);
        check_closed(&filled.surface).unwrap();
        let (low, high) = filled.surface.bounds_mm().unwrap();
        assert!((high.z - 42.0).abs() < 0.1 && (low.z + 12.0).abs() < 0.1, "{low} {high}");
        // ∫ cos(π t/2) dt is 2/π of a cylinder of 12 mm.
        let of_tube = wall.closed_mesh().signed_volume_mm3();
        let more = filled.surface.signed_volume_mm3() / of_tube - 1.0;
        let expected = 2.0 * 12.0 * 2.0 / std::f64::consts::PI / 30.0;
        assert!((more / expected - 1.0).abs() < 0.02, "{more} {expected}");
        // What medium lacks there: ∫ (1 − left) cos(π t/2) dt.
        let parts = (0..1000).map(|k| (f64::from(k) + 0.5) / 1000.0);
        let lacking = parts.map(|t| (1.0 - left(t)) * (t * std::f64::consts::FRAC_PI_2).cos() / 1000.0);
        let lacking = 2.0 * 12.0 * lacking.sum::<f64>() / 30.0;
        let faded = filled.faded.signed_volume_mm3() / f64::from(Filled::DEPTH) / of_tube;
        assert!((faded / lacking - 1.0).abs() < 0.03, "{faded} {lacking}");
    }

    #[test]
    fn a_tail_of_the_aorta_is_no_longer_than_its_limit_and_each_share_has_its_part() {
        assert!((fade_mm(1.5) - 9.0).abs() < 1e-12 && (fade_mm(13.0) - LONGEST_MM).abs() < 1e-12);
        for k in 0..=10 {
            let share = f64::from(k) / 10.0;
            assert!((left(part_with(share)) - share).abs() < 1e-12, "{share}");
        }
    }
}
