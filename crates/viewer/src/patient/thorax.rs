//! Bones of the chest: ribs with their cartilages, sternum, clavicles and scapulae.

use std::f64::consts::{PI, TAU};

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{bar, loft, smooth, tube};
use super::trunk::{Trunk, step};

/// Distance of ribs outside the chest's inner surface, mm.
const RIB_OUT_MM: f64 = 6.0;
/// Anterior end of each rib, as an angle from the back, and its descent there in distances of vertebrae.
const RIBS: [[f64; 2]; 12] = [
    [2.45, 1.3],
    [2.45, 2.1],
    [2.42, 2.7],
    [2.38, 3.2],
    [2.34, 3.6],
    [2.28, 3.9],
    [2.2, 4.1],
    [2.08, 4.1],
    [1.97, 3.9],
    [1.85, 3.6],
    [1.3, 2.4],
    [0.9, 1.4],
];

impl Trunk {
    /// Position of rib 1 to 12 at a fraction of its length.
    fn rib(&self, number: usize, side: f64, part: f64) -> Vec3 {
        let [end, fall] = RIBS[number - 1];
        let z = self.vertebra(number as i32) + 0.3 * self.pitch();
        let from = 0.36;
        let angle = from + (end - from) * part;
        // From the joint slightly upwards, then down to the front.
        let drop =
            fall * self.pitch() * (0.25 * part + 0.75 * step(part, -0.15, 1.0)) - 4.0 * libm::sin(PI * part);
        let free = self.chest_wall(side, z - drop, angle, RIB_OUT_MM);
        let joint = Vec3::new(self.spine[0] + side * 21.0, self.spine_y(z) + 17.0, z);
        joint + (free - joint) * step(part, -0.02, 0.16)
    }

    /// Adds the ribs: flat, taller than thick, with a thick lower edge.
    pub(super) fn ribs(&self, mesh: &mut SurfaceMesh, inset: f64) {
        for number in 1..=12 {
            for side in [-1.0, 1.0] {
                let floats = number > 10;
                let places: Vec<Vec3> =
                    (0..=40).map(|k| self.rib(number, side, f64::from(k) / 40.0)).collect();
                let path: Vec<(Vec3, f64, Vec3)> = (0..=40)
                    .map(|k| {
                        let part = k as f64 / 40.0;
                        // Floating ribs end in a tip.
                        let thin = if floats { (1.0 - 0.99 * part.powi(6)).sqrt() } else { 1.0 };
                        let along = (places[(k + 1).min(40)] - places[k.saturating_sub(1)]).normalize();
                        let up = (Vec3::z() - along * along.z).normalize();
                        // Round at the neck, flat at the side, wider to the front.
                        let flat = step(part, 0.05, 0.3);
                        let tall = 4.4 + 2.0 * flat + 1.0 * step(part, 0.6, 1.0);
                        (places[k], (4.0 - 0.7 * flat) * thin, up * (tall * thin))
                    })
                    .collect();
                bar(mesh, &path, inset);
            }
        }
    }

    /// Adds the cartilages from the ribs to the sternum and, for ribs 8 to 10, to the one above. They are the same in
    /// bone and marrow, with a constant fraction of bone.
    pub(super) fn cartilages(&self, mesh: &mut SurfaceMesh) {
        for number in 1..=10_usize {
            for side in [-1.0, 1.0] {
                let from = self.rib(number, side, 0.985);
                let angle = RIBS[number - 1][0];
                let joins = number > 7;
                let to = match joins {
                    false => self.sternum_z(number),
                    true => self.sternum_z(7) - self.pitch() * 0.6 * (number - 7) as f64,
                };
                let reach = if joins { angle + 0.62 * (PI - 0.2 - angle) } else { PI - 0.17 };
                let path: Vec<(Vec3, f64)> = (0..=14)
                    .map(|k| {
                        let part = f64::from(k) / 14.0;
                        let z = from.z + (to - from.z) * step(part, -0.2, 1.1)
                            - 0.1 * self.pitch() * libm::sin(PI * part);
                        let on = self.chest_wall(side, z, angle + (reach - angle) * part, RIB_OUT_MM);
                        (from + (on - from) * step(part, 0.0, 0.3), 4.4 - 0.9 * part)
                    })
                    .collect();
                tube(mesh, &path);
            }
        }
    }

    /// Height on the sternum where cartilage 1 to 7 joins it.
    fn sternum_z(&self, number: usize) -> f64 {
        let [top, length] = self.sternum();
        top - length * (0.1 + 0.75 * (number - 1) as f64 / 6.0)
    }

    /// Upper end and length of the sternum.
    fn sternum(&self) -> [f64; 2] {
        [self.vertebra(3), 7.2 * self.pitch()]
    }

    /// Adds sternum, clavicles and scapulae.
    pub(super) fn girdle(&self, mesh: &mut SurfaceMesh, inset: f64) {
        let [top, length] = self.sternum();
        let profile = [
            (1.0, 4.0),
            (0.96, 6.0),
            (0.86, 9.0),
            (0.78, 17.0),
            (0.6, 17.5),
            (0.45, 15.0),
            (0.3, 13.0),
            (0.27, 14.5),
            (0.14, 23.0),
            (0.05, 27.0),
            (0.0, 20.0),
        ];
        let ring = |(down, half): (f64, f64)| -> Vec<Vec3> {
            let z = top - length * down;
            let front = self.chest_wall(1.0, z, PI, RIB_OUT_MM);
            (0..20)
                .map(|k| {
                    let (s, c) = libm::sincos(TAU * f64::from(k) / 20.0);
                    front + Vec3::new((half - inset) * c, (6.0 - inset) * s, 0.0)
                })
                .collect()
        };
        loft(mesh, &profile.map(ring));
        for side in [-1.0, 1.0] {
            let joint = self.chest_wall(1.0, top - 2.0, PI, RIB_OUT_MM);
            let at = |u: f64, v: f64, w: f64| joint + Vec3::new(side * u, v, w);
            let reach = 0.86 * self.half_width;
            let clavicle = [
                (at(19.0, 0.0, 2.0), 8.5),
                (at(0.28 * reach, -7.0, 6.0), 6.2),
                (at(0.55 * reach, 6.0, 12.0), 5.6),
                (at(0.8 * reach, 26.0, 17.0), 6.0),
                (at(reach, 38.0, 16.0), 6.5),
            ];
            tube(mesh, &smooth(&clavicle, inset));
            self.shoulder_blade(mesh, side, inset);
        }
    }

    /// A plate on the back of the ribs, with a thick edge towards the arm.
    fn shoulder_blade(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        let [low, high] = [self.vertebra(8), self.vertebra(2)];
        const SIDES: usize = 20;
        let ring = |k: usize| -> Vec<Vec3> {
            let up = k as f64 / 14.0;
            let z = low + (high - low) * up;
            // The medial edge is nearly straight, the other one extends to the joint and back.
            let medial = 0.62 - 0.08 * up;
            let lateral = medial + 0.1 + 0.62 * step(up, 0.0, 0.9) - 0.3 * step(up, 0.88, 1.0);
            let mut points: Vec<Vec3> = (0..2 * SIDES)
                .map(|k| {
                    let t = (k % SIDES) as f64 / SIDES as f64;
                    let (part, face) = if k < SIDES { (t, -1.0) } else { (1.0 - t, 1.0) };
                    let angle = medial + (lateral - medial) * part;
                    let thick = 1.7 + 3.5 * step(part, 0.75, 1.0) - 0.8 * inset;
                    self.chest_wall(
                        side,
                        z,
                        angle,
                        17.0 + face * thick * libm::sin(PI * part).max(0.1).sqrt(),
                    )
                })
                .collect();
            if side < 0.0 {
                points.reverse();
            }
            points
        };
        loft(mesh, &(0..=14).map(ring).collect::<Vec<_>>());
    }
}
