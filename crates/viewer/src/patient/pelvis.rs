//! Bones of the pelvis and the upper ends of the femurs.

use std::f64::consts::{PI, TAU};

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{bowl, ellipsoid, hollow, loft, smooth, tube};
use super::trunk::{Trunk, step};

/// Centre of a hip joint relative to the middle of the fifth lumbar vertebra: lateral, forward, down, mm.
const HIP_MM: [f64; 3] = [90.0, 22.0, 112.0];

impl Trunk {
    /// The position at distances to the side, back and up from the middle of the last lumbar vertebra.
    fn pelvic(&self, side: f64, back: f64, up: f64) -> Vec3 {
        let z = self.vertebra(17);
        Vec3::new(self.spine[0] + side, self.spine_y(z) + back, z + up)
    }

    /// Adds sacrum, hip bones and the upper ends of the femurs, with all surfaces `inset` inside the bone's.
    pub(super) fn pelvis(&self, mesh: &mut SurfaceMesh, inset: f64) {
        self.sacrum(mesh, inset);
        for side in [-1.0, 1.0] {
            self.iliac_wing(mesh, side, inset);
            if inset == 0.0 {
                self.pelvic_lines(mesh, side);
            }
            self.pubic_arch(mesh, side, inset);
            self.hip_socket(mesh, side, inset);
            self.thigh_bone(mesh, side, inset);
        }
    }

    fn sacrum(&self, mesh: &mut SurfaceMesh, inset: f64) {
        // Height, half width, half depth, how far back.
        let profile = [
            (-138.0, 3.0, 3.0, 14.0),
            (-126.0, 7.0, 4.0, 24.0),
            (-114.0, 6.0, 3.0, 30.0),
            (-102.0, 18.0, 6.0, 36.0),
            (-94.0, 24.0, 6.5, 38.0),
            (-82.0, 28.0, 9.0, 38.0),
            (-73.0, 31.0, 8.5, 37.0),
            (-62.0, 37.0, 12.0, 34.0),
            (-51.0, 42.0, 12.0, 29.0),
            (-42.0, 50.0, 16.0, 24.0),
            (-32.0, 57.0, 18.0, 18.0),
            (-23.0, 58.0, 17.0, 12.0),
            (-17.0, 44.0, 14.0, 9.0),
        ];
        let ring = |(up, wide, deep, back): (f64, f64, f64, f64)| -> Vec<Vec3> {
            (0..28)
                .map(|k| {
                    let (s, c) = libm::sincos(TAU * f64::from(k) / 28.0);
                    // The front is hollow, and compact bone thick at the sides.
                    let hollow = 1.0 - 0.25 * s.min(0.0).abs();
                    self.pelvic((wide - 1.4 * inset) * c, back + (deep - inset) * s * hollow, up)
                })
                .collect()
        };
        loft(mesh, &profile.map(ring));
        // The foramina of the nerves; the remaining bone around them is that of the marrow.
        for (up, out) in [(-34.0, 23.0), (-54.0, 19.0), (-72.0, 15.0), (-88.0, 11.0)] {
            for side in [-1.0, 1.0] {
                let back = 38.0 - 0.35 * (up + 76.0_f64).abs();
                let hole = self.pelvic(side * out, back, up);
                hollow(mesh, |mesh| ellipsoid(mesh, hole, Vec3::new(5.0, 6.0, 4.0).add_scalar(-0.3 * inset)));
            }
        }
    }

    /// A bent plate from the crest to the hip joint, thickened towards it.
    fn iliac_wing(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        const SIDES: usize = 24;
        let [hip_side, hip_front, hip_down] = HIP_MM;
        // A point at a fraction of the height and of the way from the sacrum round the side to the front, on a face
        // or between them. The wing narrows towards the joint; its crest is highest in the middle.
        let point = |up: f64, part: f64, face: f64| {
            let flare = step(up, 0.0, 1.0);
            let [from, to] = [1.25 - 0.85 * flare, 1.75 + 0.35 * flare];
            let angle = from + (to - from) * part;
            let edge = libm::pow(libm::sin(PI * part).max(0.04), 0.4) * step(up, -0.12, 0.06).max(0.05);
            let thick = (4.6 + 8.0 * (1.0 - step(up, 0.0, 0.45))) * edge - (1.7 * inset).min(2.6 * edge);
            let [u, v] = [hip_side + 6.0 + 36.0 * flare, 58.0 + 14.0 * flare].map(|h| h + face * thick);
            let crest = 128.0 * up - 34.0 * up * up * (2.0 * part - 0.75).powi(2);
            let back = v * libm::cos(angle) - hip_front * (1.0 - flare) + 8.0;
            self.pelvic(side * u * libm::sin(angle), back, crest - hip_down + 6.0)
        };
        let ring = |k: i32| -> Vec<Vec3> {
            let up = f64::from(k) / 16.0;
            let mut points: Vec<Vec3> = (0..2 * SIDES)
                .map(|k| {
                    let t = (k % SIDES) as f64 / SIDES as f64;
                    let (part, face) = if k < SIDES { (t, -1.0) } else { (1.0 - t, 1.0) };
                    point(up, part, face)
                })
                .collect();
            if side < 0.0 {
                points.reverse();
            }
            points
        };
        loft(mesh, &(-2..=16).map(ring).collect::<Vec<_>>());
        let crest: Vec<(Vec3, f64)> = (0..=8).map(|k| (point(0.99, f64::from(k) / 8.0, 0.0), 4.8)).collect();
        tube(mesh, &smooth(&crest, inset));
    }

    /// The edges of hip bones that pictures show as lines, all compact bone: the rim of the pelvis from the joint with the
    /// sacrum to the pubis, the border behind with the notch of the sciatic nerve, and that joint.
    fn pelvic_lines(&self, mesh: &mut SurfaceMesh, side: f64) {
        let at = |out: f64, back: f64, up: f64| self.pelvic(side * out, back, up);
        let rim = [
            (at(58.0, 24.0, -26.0), 1.0),
            (at(64.0, 18.0, -52.0), 1.9),
            (at(74.0, 4.0, -76.0), 2.1),
            (at(78.0, -18.0, -98.0), 2.0),
            (at(62.0, -46.0, -112.0), 1.8),
            (at(34.0, -72.0, -120.0), 1.2),
        ];
        let border = [
            (at(50.0, 64.0, 2.0), 1.6),
            (at(47.0, 62.0, -22.0), 1.9),
            (at(50.0, 54.0, -48.0), 1.7),
            (at(62.0, 42.0, -66.0), 1.6),
            (at(72.0, 28.0, -84.0), 1.8),
            (at(66.0, 14.0, -108.0), 2.2),
            (at(70.0, 6.0, -130.0), 1.4),
        ];
        for line in [&rim[..], &border[..]] {
            tube(mesh, &smooth(line, 0.0));
        }
        // Compact bone on both sides of the joint, in front and behind.
        for (out, thick) in [(0.0, 1.1), (3.2, 1.2)] {
            for back in [-4.0, 9.0] {
                let line = [
                    (at(57.0 + out - 0.3 * back, 18.0 + back, -20.0), 0.6 * thick),
                    (at(53.5 + out - 0.2 * back, 25.0 + back, -36.0), thick),
                    (at(47.0 + out, 31.0 + back, -52.0), thick),
                    (at(38.5 + out, 35.0 + back, -66.0), 0.6 * thick),
                ];
                tube(mesh, &smooth(&line, 0.0));
            }
        }
    }

    /// The socket of a hip, open outwards, downwards and forwards.
    fn hip_socket(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        let [hip_side, hip_front, hip_down] = HIP_MM;
        let middle = self.pelvic(side * hip_side, -hip_front, -hip_down - 4.0);
        bowl(mesh, middle, [30.5 - inset, 26.0 + inset], Vec3::new(-0.72 * side, 0.34, 0.6), 1.45);
    }

    /// Pubis and ischium: a ring in front of and below the joint.
    fn pubic_arch(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        let [hip_side, hip_front, hip_down] = HIP_MM;
        let at = |out: f64, back: f64, up: f64| self.pelvic(side * out, back - hip_front, up - hip_down);
        let upper = [
            // From the socket's outside: inside it a bone would be counted twice.
            (at(hip_side - 23.0, -19.0, 4.0), 1.5),
            (at(hip_side - 29.0, -22.0, 1.0), 8.0),
            (at(48.0, -38.0, -4.0), 6.8),
            (at(26.0, -55.0, -13.0), 7.5),
            (at(12.0, -62.0, -23.0), 8.5),
            (at(8.5, -62.0, -34.0), 6.5),
            (at(10.0, -60.0, -42.0), 1.5),
        ];
        let lower = [
            (at(hip_side - 14.0, 25.0, -16.0), 1.5),
            (at(hip_side - 17.0, 27.0, -27.0), 9.5),
            (at(hip_side - 21.0, 26.0, -42.0), 11.5),
            (at(hip_side - 27.0, 26.0, -60.0), 14.0),
            (at(53.0, 18.0, -72.0), 10.5),
            (at(36.0, -14.0, -62.0), 6.0),
            (at(23.0, -38.0, -52.0), 5.0),
            (at(15.0, -53.0, -46.0), 4.0),
            (at(11.0, -58.0, -42.0), 1.5),
        ];
        for path in [&upper[..], &lower[..]] {
            tube(mesh, &smooth(path, inset));
        }
    }

    fn thigh_bone(&self, mesh: &mut SurfaceMesh, side: f64, inset: f64) {
        let [hip_side, hip_front, hip_down] = HIP_MM;
        let at = |out: f64, back: f64, up: f64| self.pelvic(side * out, back - hip_front, up - hip_down);
        ellipsoid(mesh, at(hip_side, 0.0, -4.0), Vec3::repeat(23.5 - inset));
        let neck = [
            // From the head's surface, as what is inside would be counted twice.
            (at(hip_side + 18.0, 2.5, -12.5), 4.5),
            (at(hip_side + 20.5, 3.0, -14.0), 11.5),
            (at(hip_side + 27.0, 5.0, -20.0), 13.0),
            (at(hip_side + 38.0, 8.0, -32.0), 16.0),
            (at(hip_side + 43.0, 9.0, -52.0), 17.0),
            (at(hip_side + 39.0, 6.0, -84.0), 15.0),
            (at(hip_side + 35.0, 3.0, -120.0), 14.0),
            (at(hip_side + 28.0, 0.0, -190.0), 13.5),
        ];
        // The shaft's wall is thick.
        tube(mesh, &smooth(&neck, 3.0 * inset));
        // The greater trochanter rises beside the neck.
        let greater = [
            (at(hip_side + 52.0, 12.0, -14.0), 9.0),
            (at(hip_side + 53.0, 13.0, -26.0), 11.0),
            (at(hip_side + 50.0, 11.0, -42.0), 11.0),
        ];
        tube(mesh, &smooth(&greater, inset));
    }
}
