//! Bones of the head: skull, its base, face and jaw.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{ellipsoid, hollow, smooth, tube};
use super::trunk::Trunk;

/// Half width, half depth and half height of the skull's inside, mm.
const BRAIN_MM: [f64; 3] = [66.0, 84.0, 66.0];
/// Thickness of the skull, mm.
const SKULL_MM: f64 = 6.0;
/// Height of the skull's centre above its base, mm.
const ABOVE_BASE_MM: f64 = 52.0;

impl Trunk {
    /// The position at distances to the side, back and up from the middle of the skull's base, just above the first
    /// cervical vertebra.
    fn cranial(&self, side: f64, back: f64, up: f64) -> Vec3 {
        let z = self.vertebra(-6) + 12.0;
        Vec3::new(self.spine[0] + side, self.spine_y(z) - 14.0 + back, z + up)
    }

    /// Adds the bones of the head, with all surfaces `inset` inside the bone's.
    pub(super) fn head(&self, mesh: &mut SurfaceMesh, inset: f64) {
        let brain = self.cranial(0.0, 0.0, ABOVE_BASE_MM + 8.0);
        let half = |more: f64| Vec3::from(BRAIN_MM.map(|half| half + more));
        ellipsoid(mesh, brain, half(SKULL_MM - inset));
        hollow(mesh, |mesh| ellipsoid(mesh, brain, half(inset)));
        for side in [-1.0, 1.0] {
            let at = |out: f64, back: f64, up: f64| self.cranial(side * out, back, up);
            // The petrous part of the temporal bone.
            let petrous = [
                (at(12.0, -4.0, 4.0), 5.0),
                (at(26.0, 4.0, 6.0), 9.0),
                (at(42.0, 12.0, 7.0), 11.0),
                (at(52.0, 18.0, 4.0), 11.0),
                (at(51.0, 22.0, -12.0), 8.0),
            ];
            let cheek = [
                (at(50.0, -14.0, 2.0), 4.0),
                (at(52.0, -32.0, 0.0), 4.0),
                (at(45.0, -48.0, -2.0), 6.0),
                (at(32.0, -56.0, -8.0), 5.0),
            ];
            for path in [&petrous[..], &cheek[..]] {
                tube(mesh, &smooth(path, inset));
            }
            // The rim of the orbit.
            let rim: Vec<(Vec3, f64)> = (0..=12)
                .map(|k| {
                    let (s, c) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 12.0);
                    (at(31.0 + 19.0 * c, -64.0 + 9.0 * c.max(0.0), 20.0 + 17.0 * s), 3.5)
                })
                .collect();
            tube(mesh, &smooth(&rim, inset));
        }
        let half_jaw = [
            (50.0, -8.0, -2.0, 5.5),
            (49.0, -10.0, -28.0, 6.5),
            (44.0, -20.0, -50.0, 7.0),
            (34.0, -44.0, -60.0, 6.5),
            (17.0, -64.0, -66.0, 7.0),
        ];
        let at = |(out, back, up, radius): (f64, f64, f64, f64), side: f64| {
            (self.cranial(side * out, back, up), radius)
        };
        let left = half_jaw.into_iter().map(|point| at(point, 1.0));
        let right = half_jaw.into_iter().rev().map(|point| at(point, -1.0));
        let chin = at((0.0, -69.0, -67.0, 8.0), 1.0);
        let jaw: Vec<(Vec3, f64)> = left.chain([chin]).chain(right).collect();
        tube(mesh, &smooth(&jaw, inset));
        // Sphenoid and clivus, and the upper jaw.
        ellipsoid(mesh, self.cranial(0.0, -12.0, 8.0), Vec3::new(16.0, 18.0, 10.0).add_scalar(-inset));
        ellipsoid(mesh, self.cranial(0.0, -56.0, -26.0), Vec3::new(28.0, 20.0, 13.0).add_scalar(-inset));
    }
}
