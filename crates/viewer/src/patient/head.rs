//! Bones of the head: skull, its base, face, jaws and teeth, and the air in its sinuses.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{bar, ellipsoid, hollow, smooth, tube};
use super::trunk::{Trunk, step};

/// Half width, half depth and half height of the skull's inside, mm.
const BRAIN_MM: [f64; 3] = [66.0, 84.0, 66.0];
/// Thickness of the skull and of its base, mm.
const SKULL_MM: f64 = 6.0;
const BASE_MM: f64 = 4.0;
/// Height of the skull's centre above its base, mm.
const ABOVE_BASE_MM: f64 = 60.0;
/// Centres (to the side, back, up) and half axes of a maxillary, the sphenoid and a frontal sinus, mm.
const MAXILLARY_MM: [[f64; 3]; 2] = [[25.0, -54.0, -14.0], [11.0, 15.0, 13.0]];
const SPHENOID_MM: [[f64; 3]; 2] = [[0.0, -26.0, 9.0], [13.0, 12.0, 9.0]];
const FRONTAL_MM: [[f64; 3]; 2] = [[11.0, -78.0, 38.0], [10.0, 4.0, 8.0]];

impl Trunk {
    /// The position at distances to the side, back and up from the middle of the skull's base, just above the first
    /// cervical vertebra.
    fn cranial(&self, side: f64, back: f64, up: f64) -> Vec3 {
        let z = self.vertebra(-6) + 12.0;
        Vec3::new(self.spine[0] + side, self.spine_y(z) - 14.0 + back, z + up)
    }

    /// Adds the bones of the head, with all surfaces `inset` inside the bone's.
    pub(super) fn head(&self, mesh: &mut SurfaceMesh, inset: f64) {
        self.skull(mesh, SKULL_MM - inset, -BASE_MM + inset);
        hollow(mesh, |mesh| self.skull(mesh, inset, -inset));
        for side in [-1.0, 1.0] {
            self.side_of_head(mesh, side, inset);
        }
        // The slope from the saddle to the foramen magnum.
        let clivus = [(self.cranial(0.0, -10.0, 14.0), 4.0), (self.cranial(0.0, 6.0, -2.0), 5.0)];
        tube(mesh, &smooth(&clivus, inset));
        self.jaws(mesh, inset);
        if inset == 0.0 {
            self.thin_bones(mesh);
        }
    }

    /// A surface `out` outside the brain, flat below: highest over the orbits, lowest behind.
    fn skull(&self, mesh: &mut SurfaceMesh, out: f64, below: f64) {
        const ROUND_MM: f64 = 8.0;
        let first = mesh.vertices_mm.len();
        let middle = self.cranial(0.0, 0.0, ABOVE_BASE_MM);
        ellipsoid(mesh, middle, Vec3::from(BRAIN_MM).add_scalar(out));
        for v in &mut mesh.vertices_mm[first..] {
            // The forehead is narrower than the back of the head.
            let back = v.y - middle.y;
            v.x = middle.x + (v.x - middle.x) * (0.9 + 0.1 * step(back, -80.0, 30.0));
            let floor = middle.z - ABOVE_BASE_MM + 34.0 - 42.0 * step(back, -70.0, 35.0) + below;
            let above = v.z - floor;
            v.z = floor + f64::midpoint(above, libm::sqrt(above * above + ROUND_MM * ROUND_MM));
        }
    }

    fn side_of_head(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        let at = |out: f64, back: f64, up: f64| self.cranial(side * out, back, up);
        // The petrous part of the temporal bone with the mastoid.
        let petrous = [
            (at(12.0, -4.0, 6.0), 4.0),
            (at(26.0, 4.0, 8.0), 7.5),
            (at(42.0, 12.0, 7.0), 9.0),
            (at(54.0, 18.0, 2.0), 9.5),
            (at(55.0, 22.0, -16.0), 6.0),
        ];
        let cheek = [
            (at(58.0, -10.0, 2.0), 3.0),
            (at(60.0, -32.0, 0.0), 3.0),
            (at(50.0, -52.0, -2.0), 5.0),
            (at(40.0, -62.0, -6.0), 5.0),
        ];
        for path in [&petrous[..], &cheek[..]] {
            tube(mesh, &smooth(path, inset));
        }
        // The rim of the orbit.
        let rim: Vec<(Vec3, f64)> = (0..=12)
            .map(|k| {
                let (s, c) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 12.0);
                (at(31.0 + 18.0 * c, -70.0 + 12.0 * c.max(0.0), 20.0 + 16.0 * s), 2.6)
            })
            .collect();
        tube(mesh, &smooth(&rim, inset));
    }

    /// Upper and lower jaw.
    fn jaws(&self, mesh: &mut SurfaceMesh, inset: f64) {
        // Half of the lower jaw from its joint to the chin: place, half thickness, half height backwards and upwards.
        let half = [
            ([50.0, -8.0, 6.0], 4.0, [5.0, 0.0]),
            ([50.0, -9.0, -2.0], 3.5, [6.0, 0.0]),
            ([49.0, -13.0, -14.0], 3.5, [15.0, 0.0]),
            ([48.0, -16.0, -34.0], 4.0, [16.0, 0.0]),
            ([46.0, -20.0, -50.0], 5.0, [13.0, 10.0]),
            ([40.0, -34.0, -60.0], 5.5, [3.0, 13.5]),
            ([30.0, -52.0, -64.0], 5.5, [0.0, 13.0]),
            ([17.0, -67.0, -66.0], 5.5, [0.0, 13.0]),
        ];
        type Of = ([f64; 3], f64, [f64; 2]);
        let at = |([out, back, up], thick, tall): Of, side: f64| {
            (self.cranial(side * out, back, up), thick, Vec3::new(0.0, tall[0], tall[1]))
        };
        let chin = at(([0.0, -72.0, -67.0], 6.5, [0.0, 13.5]), 1.0);
        let left = half.into_iter().map(|point| at(point, 1.0));
        let right = half.into_iter().rev().map(|point| at(point, -1.0));
        bar(mesh, &left.chain([chin]).chain(right).collect::<Vec<_>>(), inset);
        let upper: Vec<(Vec3, f64)> =
            (0..=16).map(|k| (self.on_dental_arch(f64::from(k) / 8.0 - 1.0, -36.0), 4.5)).collect();
        tube(mesh, &smooth(&upper, inset));
    }

    /// A place on the arch of the teeth, from the last right one at −1 to the last left one at 1.
    fn on_dental_arch(&self, part: f64, up: f64) -> Vec3 {
        let (s, c) = libm::sincos(1.45 * part);
        self.cranial(26.0 * s, -28.0 - 45.0 * c, up)
    }

    /// What has no marrow: septum, palate, teeth.
    fn thin_bones(&self, mesh: &mut SurfaceMesh) {
        ellipsoid(mesh, self.cranial(0.0, -50.0, -30.0), Vec3::new(24.0, 24.0, 1.6));
        ellipsoid(mesh, self.cranial(0.0, -60.0, -10.0), Vec3::new(0.9, 20.0, 19.0));
        for k in 0..14 {
            let part = (f64::from(k) + 0.5) / 7.0 - 1.0;
            // Molars are wider than incisors.
            let wide = 2.7 + 1.8 * part * part;
            for (up, tall) in [(-43.0, 8.0), (-54.0, 8.5)] {
                ellipsoid(mesh, self.on_dental_arch(part, up), Vec3::new(wide, wide, tall));
            }
        }
    }

    /// Adds the air in sinuses, nose and throat, down to the larynx.
    pub(super) fn air_of_head(&self, mesh: &mut SurfaceMesh, larynx: Vec3) {
        for [[out, back, up], half] in
            [MAXILLARY_MM, SPHENOID_MM, FRONTAL_MM, [[7.0, -58.0, -10.0], [4.5, 20.0, 16.0]]]
        {
            ellipsoid(mesh, self.cranial(out, back, up), Vec3::from(half));
            if out > 0.0 {
                ellipsoid(mesh, self.cranial(-out, back, up), Vec3::from(half));
            }
        }
        let throat = [
            (self.cranial(0.0, -34.0, -14.0), 7.0),
            (self.cranial(0.0, -26.0, -30.0), 7.0),
            (self.cranial(0.0, -24.0, -50.0), 7.0),
            (larynx + Vec3::z() * 8.0, 6.0),
        ];
        tube(mesh, &smooth(&throat, 0.0));
        // Cells of the mastoids.
        for side in [-1.0, 1.0] {
            ellipsoid(mesh, self.cranial(side * 55.0, 21.0, -6.0), Vec3::new(3.5, 5.0, 8.0));
        }
    }
}
