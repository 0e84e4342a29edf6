//! Bones of the head: skull, its base, face, jaws and teeth, and the air in its sinuses.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{bar, ellipsoid, ellipsoid_of, hollow, smooth, tube};
use super::trunk::{Trunk, step};

/// Half width, half depth and half height of the skull's inside, mm.
const BRAIN_MM: [f64; 3] = [66.0, 84.0, 66.0];
/// Thickness of the skull and of its base, mm.
const SKULL_MM: f64 = 6.0;
const BASE_MM: f64 = 4.0;
/// The floor of the skull in the middle and at the sides: back and up, mm. From the forehead over the roofs of the orbits to
/// the saddle, whose back stands up, then down the clivus to the occiput; at the sides the middle fossa lies lower.
const FLOOR_MM: [&[[f64; 2]]; 2] = [
    &[
        [-90.0, 38.0],
        [-62.0, 29.0],
        [-32.0, 23.0],
        [-21.0, 21.0],
        [-16.0, 13.0],
        [-10.0, 13.0],
        [-7.0, 23.0],
        [-3.0, 19.0],
        [8.0, -4.0],
        [22.0, -11.0],
        [42.0, -12.0],
        [62.0, -2.0],
        [100.0, 30.0],
    ],
    &[
        [-90.0, 40.0],
        [-60.0, 33.0],
        [-44.0, 31.0],
        [-36.0, 10.0],
        [-20.0, -2.0],
        [2.0, -2.0],
        [22.0, -10.0],
        [42.0, -14.0],
        [62.0, -2.0],
        [100.0, 30.0],
    ],
];
/// Height of the crest of the petrous bone above the floor, and half its breadth, mm.
const CREST_MM: [f64; 2] = [15.0, 6.0];
/// Height of the skull's centre above its base, mm.
const ABOVE_BASE_MM: f64 = 60.0;
/// Centres (to the side, back, up) and half axes of a maxillary, the sphenoid and a frontal sinus, mm.
const MAXILLARY_MM: [[f64; 3]; 2] = [[25.0, -54.0, -14.0], [11.0, 15.0, 13.0]];
const SPHENOID_MM: [[f64; 3]; 2] = [[0.0, -26.0, 9.0], [13.0, 12.0, 9.0]];
const FRONTAL_MM: [[f64; 3]; 2] = [[11.0, -78.0, 38.0], [10.0, 4.0, 8.0]];

/// Height of the skull's floor at a distance to the side and back, mm.
fn floor_mm(side: f64, back: f64) -> f64 {
    let aside = side.abs();
    let line = |points: &[[f64; 2]]| {
        let after = points.iter().position(|point| point[0] >= back).unwrap_or(points.len() - 1).max(1);
        let [a, b] = [points[after - 1], points[after]];
        a[1] + (b[1] - a[1]) * step(back, a[0], b[0])
    };
    let [middle, beside] = FLOOR_MM.map(line);
    let floor = middle + (beside - middle) * step(aside, 11.0, 27.0);
    // The crest runs from the saddle backwards to the side; the roof of an orbit is a dome.
    let [tall, broad] = CREST_MM;
    let off = (back - 0.48 * (aside - 12.0)) / broad;
    let crest = tall * libm::exp(-off * off) * step(aside, 9.0, 20.0);
    let roof = 5.0 * libm::exp(-((aside - 28.0) / 13.0).powi(2)) * step(back, -40.0, -56.0);
    floor + crest + roof
}

impl Trunk {
    /// The position at distances to the side, back and up from the middle of the skull's base, just above the first
    /// cervical vertebra.
    fn cranial(&self, side: f64, back: f64, up: f64) -> Vec3 {
        let z = self.vertebra(-6) + 12.0;
        Vec3::new(self.spine[0] + side, self.spine_y(z) - 14.0 + back, z + up)
    }

    /// Adds the bones of the head, with all surfaces `inset` inside the bone's.
    pub(super) fn head(&self, mesh: &mut SurfaceMesh, inset: f64) {
        // Two tables of compact bone, and little between them.
        let table = 1.7 * inset;
        self.skull(mesh, SKULL_MM, -table, -BASE_MM + inset);
        hollow(mesh, |mesh| self.skull(mesh, 0.0, table, -inset));
        for side in [-1.0, 1.0] {
            self.side_of_head(mesh, side, inset);
            self.eye_socket(mesh, side, inset);
        }
        // The slope from the saddle to the foramen magnum.
        let clivus = [(self.cranial(0.0, -8.0, 12.0), 4.0), (self.cranial(0.0, 6.0, -6.0), 5.0)];
        tube(mesh, &smooth(&clivus, inset));
        self.jaws(mesh, inset);
        if inset == 0.0 {
            self.thin_bones(mesh);
        }
    }

    /// A surface around the brain, this `thick` and another bit `out`: the vault, thin at the temples and thick behind,
    /// and below it the floor, moved by `below`.
    fn skull(&self, mesh: &mut SurfaceMesh, thick: f64, out: f64, below: f64) {
        const ROUND_MM: f64 = 3.0;
        const RINGS: usize = 72;
        let first = mesh.vertices_mm.len();
        let base = self.cranial(0.0, 0.0, 0.0);
        let middle = base + Vec3::z() * ABOVE_BASE_MM;
        ellipsoid_of(mesh, RINGS, middle, Vec3::from(BRAIN_MM));
        for v in &mut mesh.vertices_mm[first..] {
            let way = (*v - middle).component_div(&Vec3::from(BRAIN_MM));
            let part = 1.0 - 0.45 * way.x * way.x + 0.15 * step(way.y, 0.55, 1.0) * step(way.z, 0.5, 0.0);
            *v += way.normalize() * (thick * part + out);
            // The forehead is narrower than the back of the head, which bulges.
            let back = v.y - middle.y;
            v.x = middle.x + (v.x - middle.x) * (0.88 + 0.12 * step(back, -80.0, 20.0));
            v.y += 2.0 * step(back, 20.0, 85.0) * step(v.z - middle.z, 25.0, -15.0);
            let floor = base.z + floor_mm(v.x - middle.x, v.y - middle.y) + below;
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
        // The hardest bone of all.
        tube(mesh, &smooth(&petrous, 2.6 * inset));
        tube(mesh, &smooth(&cheek, inset));
    }

    /// The rim of an orbit, thick at the side, and the wings of the sphenoid behind it.
    fn eye_socket(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        let at = |out: f64, back: f64, up: f64| self.cranial(side * out, back, up);
        let rim: Vec<(Vec3, f64)> = (0..=14)
            .map(|k| {
                let (s, c) = libm::sincos(std::f64::consts::TAU * f64::from(k) / 14.0);
                let thick = 2.3 + 1.7 * c.max(0.0) + 1.2 * s.max(0.0);
                // Squarer than a circle, drooping to the side.
                let (wide, tall) = (19.0 * c * (1.0 + 0.1 * s.abs()), 16.5 * s * (1.0 + 0.12 * c.abs()));
                (at(31.0 + wide, -72.0 + 13.0 * c.max(0.0), 17.0 + tall - 0.1 * wide), thick)
            })
            .collect();
        tube(mesh, &smooth(&rim, 2.0 * inset));
        let lesser = [
            (at(6.0, -26.0, 23.0), 2.6),
            (at(22.0, -32.0, 27.0), 1.9),
            (at(40.0, -42.0, 32.0), 1.8),
            (at(54.0, -44.0, 40.0), 2.2),
        ];
        let greater = [
            (at(12.0, -28.0, 10.0), 2.8),
            (at(28.0, -38.0, 2.0), 2.0),
            (at(44.0, -44.0, 12.0), 2.2),
            (at(54.0, -40.0, 30.0), 2.2),
        ];
        for path in [&lesser[..], &greater[..]] {
            tube(mesh, &smooth(path, 2.0 * inset));
        }
        // The body of the upper jaw about its sinus, and the bone of the cheek.
        let cheekbone =
            [(at(40.0, -62.0, -2.0), 6.0), (at(46.0, -60.0, -8.0), 6.5), (at(36.0, -62.0, -18.0), 5.0)];
        tube(mesh, &smooth(&cheekbone, inset));
        let nasal = [(at(3.0, -88.0, 14.0), 2.2), (at(5.0, -92.0, 2.0), 1.8), (at(10.0, -84.0, -10.0), 1.8)];
        tube(mesh, &smooth(&nasal, inset));
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
        for (out, up, wide) in [(-13.0, -30.0, 9.0), (0.0, -27.5, 10.0), (13.0, -30.0, 9.0)] {
            ellipsoid(mesh, self.cranial(out, -52.0, up), Vec3::new(wide, 20.0, 0.5));
        }
        ellipsoid(mesh, self.cranial(0.8, -60.0, -10.0), Vec3::new(0.45, 18.0, 18.0));
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
