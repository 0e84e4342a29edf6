//! Dimensions of a generated body in patient axes (left, posterior, head), mm.
//!
//! All heights follow from two given by a scene: the domes of the diaphragm and the apices of the lungs. Between them
//! are the twelve thoracic vertebrae; abdomen and pelvis follow below, neck and head above, at adult sizes.

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::beside::Beside;
use super::texture::Texture;
use crate::spec::TorsoSpec;

/// Distance of the skin of the back from the middle of the vertebral bodies.
const BACK_MM: f64 = 62.0;
/// Distance of the spine's middle behind the vessel's rearmost point.
const BEHIND_MM: f64 = 20.0;
/// Extent of the body below vessel and diaphragm: a cone beam from any usual angle stays inside.
const BELOW_MM: [f64; 2] = [260.0, 600.0];
/// Smallest height from the diaphragm's domes to the apices of the lungs.
const LEAST_CHEST_MM: f64 = 190.0;
/// Thickness of the chest's wall.
const CHEST_WALL_MM: f64 = 22.0;
/// Half width of a mediastinum without the vessel of a scene, distance of the vessel from the lungs, largest half width
/// as a fraction of the body's, and above the arch, mm.
const LEAST_SIDE_MM: f64 = 27.0;
const AROUND_VESSEL_MM: f64 = 5.0;
const MOST_SIDE: f64 = 0.6;
const MOST_ABOVE_MM: f64 = 42.0;
/// Distance from the tips of the lungs to the arch.
const ARCH_BELOW_MM: f64 = 45.0;
/// Half width and half depth of the ring of the first ribs.
const FIRST_RIB_MM: [f64; 2] = [56.0, 44.0];
/// Half width and half depth of the neck.
const NECK_MM: [f64; 2] = [60.0, 64.0];
/// Start and end of the neck above the apices of the lungs.
const NECK_ABOVE_MM: [f64; 2] = [38.0, 105.0];
/// Height of the head above the neck, and its half width and half depth.
const HEAD_MM: [f64; 3] = [165.0, 78.0, 98.0];
/// Least squareness of the trunk's front.
const FRONT_POWER: f64 = 1.0;
/// Squareness of the head below its middle, where occiput and neck are full; above, it is an ellipsoid.
const OCCIPUT_POWER: f64 = 2.6;

#[derive(Debug)]
pub(super) struct Trunk {
    /// Middle of the vertebral bodies: left, posterior.
    pub(super) spine: [f64; 2],
    /// Middle of the trunk: posterior.
    pub(super) middle_y: f64,
    pub(super) half_width: f64,
    pub(super) half_depth: f64,
    /// Lowest height.
    bottom: f64,
    pub(super) diaphragm: f64,
    pub(super) apex: f64,
    /// The vessel of the scene.
    beside: Beside,
}

/// Smooth step from 0 to 1 as `x` goes from `a` to `b`.
pub(super) fn step(x: f64, a: f64, b: f64) -> f64 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// A point of a superellipse, squarer than an ellipse for powers below one, at an angle from the back towards the left;
/// its front is an ellipse: who lies on a flat back has ribs that fall away to both sides of the breastbone.
fn oval(half: [f64; 2], power: f64, angle: f64) -> [f64; 2] {
    let (s, c) = libm::sincos(angle);
    let power = if c < 0.0 { mix(power, FRONT_POWER.max(power), step(-c, 0.0, 0.5)) } else { power };
    let of = |v: f64| v.signum() * libm::pow(v.abs(), power);
    [half[0] * of(s), half[1] * of(c)]
}

impl Trunk {
    /// For a vessel with this wall, which has vertices.
    pub(super) fn new(spec: &TorsoSpec, wall: &SurfaceMesh) -> Self {
        let (low, high) = wall.bounds_mm().unwrap_or_default();
        let spine = spec.spine_mm.unwrap_or([(low.x + high.x) / 2.0, high.y + BEHIND_MM]);
        let half_depth = spec.depth_mm / 2.0;
        let diaphragm = spec.diaphragm_mm.unwrap_or(low.z + (high.z - low.z) / 3.0);
        let apex = (high.z - 10.0).max(diaphragm + LEAST_CHEST_MM);
        Self {
            spine,
            middle_y: spine[1] + BACK_MM - half_depth,
            half_width: spec.width_mm / 2.0,
            half_depth,
            bottom: (low.z - BELOW_MM[0]).min(diaphragm - BELOW_MM[1]),
            diaphragm,
            apex,
            beside: Beside::new(wall, spine),
        }
    }

    /// Posterior coordinate of the back.
    pub(super) fn back_y(&self) -> f64 {
        self.spine[1] + BACK_MM
    }

    /// Heights of its lower end and of the top of the head.
    pub(super) fn heights(&self) -> [f64; 2] {
        [self.bottom, self.apex + NECK_ABOVE_MM[1] + HEAD_MM[0]]
    }

    /// The texture of its tissues.
    pub(super) fn texture(&self) -> Texture {
        Texture { spine_mm: self.spine, middle_mm: [self.spine[0], self.middle_y] }
    }

    /// Half width of the mediastinum at a height on a side, 1 the left one, and how far it reaches forward from the
    /// spine's middle. The vessel is kept outside the lungs, within reason: in a slim body the lungs keep their place.
    pub(super) fn mediastinum(&self, side: f64, z: f64) -> [f64; 2] {
        let [left, right, forward] = self.beside.at(z);
        let reach = if side > 0.0 { left } else { right } + AROUND_VESSEL_MM;
        let above = step(z, self.apex - ARCH_BELOW_MM - 15.0, self.apex - ARCH_BELOW_MM + 15.0);
        let most = mix(MOST_SIDE * self.half_width, MOST_ABOVE_MM, above).min(MOST_SIDE * self.half_width);
        [reach.clamp(LEAST_SIDE_MM.min(most), most), forward + AROUND_VESSEL_MM]
    }

    /// Height of the chest.
    pub(super) fn chest(&self) -> f64 {
        self.apex - self.diaphragm
    }

    /// Distance from one thoracic vertebra to the next.
    pub(super) fn pitch(&self) -> f64 {
        (self.chest() + 20.0) / 11.0
    }

    /// Height of the middle of thoracic vertebra 1 to 12; lumbar ones continue beyond 12, cervical ones below 1.
    pub(super) fn vertebra(&self, number: i32) -> f64 {
        let (first, pitch) = (self.apex - 5.0, self.pitch());
        let lumbar = (1.32 * pitch).min(36.0);
        match number {
            ..1 => first + 0.85 * pitch.min(20.0) * f64::from(1 - number),
            1..=12 => first - pitch * f64::from(number - 1),
            _ => first - 11.0 * pitch - lumbar * (f64::from(number - 12) - 0.15),
        }
    }

    /// Posterior coordinate of the middle of the vertebral bodies: bent back in the chest, forward in loins and neck.
    pub(super) fn spine_y(&self, z: f64) -> f64 {
        let s = (z - self.diaphragm) / self.chest();
        let bent = |s: f64| libm::sin(std::f64::consts::PI * s.clamp(0.0, 1.0));
        self.spine[1] + 8.0 * bent(s) - 4.0 * bent(-s / 1.1) - 9.0 * step(s, 1.0, 1.5)
    }

    /// Half width and half depth of the skin at a height, its middle (posterior) and its squareness.
    fn skin_at(&self, z: f64) -> ([f64; 2], f64, f64) {
        let [neck, head] = NECK_ABOVE_MM.map(|above| self.apex + above);
        let waist = libm::exp(-((z - self.diaphragm + 120.0) / 70.0).powi(2));
        let [mut w, mut d] = [self.half_width * (1.0 - 0.05 * waist), self.half_depth];
        let mut y = self.middle_y;
        let shoulder = step(z, self.apex - 30.0, neck);
        (w, d) = (mix(w, NECK_MM[0], shoulder), mix(d, NECK_MM[1], step(z, self.apex - 70.0, neck)));
        y = mix(y, self.spine_y(z) - 22.0, step(z, self.apex - 70.0, neck));
        // The head: an ellipsoid, joined to the neck.
        let up = (z - head) / HEAD_MM[0];
        if up > -0.1 {
            let from_middle = 2.0 * up.clamp(0.0, 0.995) - 1.0;
            let power = if from_middle < 0.0 { OCCIPUT_POWER } else { 2.0 };
            let round = libm::pow(1.0 - libm::pow(from_middle.abs(), power), 1.0 / power);
            let joined = step(up, 0.5, 0.4);
            let [w0, d0] = [HEAD_MM[1] * round, HEAD_MM[2] * round];
            let blend = |head: f64, neck: f64| head.max(neck * joined);
            (w, d) = (blend(w0, w), blend(d0, d));
            y += 7.0 * step(up, 0.0, 0.35);
        }
        w += 10.0 * step(z, head - 30.0, head + 5.0) * step(up, 0.4, 0.15);
        // Jaw and face reach forward.
        let face = 17.0 * step(z, head - 75.0, head - 45.0) * step(z, head + 70.0, head + 10.0);
        (d, y) = (d + face, y - face);
        ([w, d], y, mix(0.8, 1.0, shoulder))
    }

    /// Whether a place of the head is inside the skin.
    #[cfg(test)]
    pub(super) fn has_in_head(&self, place: &Vec3) -> bool {
        let ([w, d], y, _) = self.skin_at(place.z);
        let [u, v] = [(place.x - self.spine[0]) / w, (place.y - y) / d];
        u * u + v * v < 1.0
    }

    /// Rings of the skin from the lowest to the top of the head, counter-clockwise seen from above.
    pub(super) fn skin(&self) -> Vec<Vec<Vec3>> {
        const RINGS: usize = 110;
        const SIDES: usize = 72;
        let [_, top] = self.heights();
        let straight = self.diaphragm - 200.0;
        let heights = std::iter::once(self.bottom)
            .chain((0..=RINGS).map(|k| straight + (top - straight) * k as f64 / RINGS as f64));
        let ring = |z: f64| -> Vec<Vec3> {
            let (half, y, power) = self.skin_at(z);
            (0..SIDES)
                .map(|k| {
                    let [u, v] = oval(half, power, -std::f64::consts::TAU * k as f64 / SIDES as f64);
                    Vec3::new(self.spine[0] + u, y + v, z)
                })
                .collect()
        };
        heights.map(ring).collect()
    }

    /// Half width and half depth of the chest inside its wall at a height, and its middle (posterior): a dome that narrows to the
    /// ring of the first ribs.
    pub(super) fn chest_at(&self, z: f64) -> ([f64; 2], f64) {
        let down = ((self.apex + 4.0 - z) / (0.78 * self.chest())).clamp(0.0, 1.0);
        let full = libm::pow(1.0 - libm::pow(1.0 - down, 2.3), 1.0 / 2.3);
        let wide = [self.half_width, self.half_depth].map(|half| half - CHEST_WALL_MM);
        let half = [0, 1].map(|k| mix(FIRST_RIB_MM[k].min(wide[k]), wide[k], full));
        (half, mix(self.spine_y(z) - 30.0, self.middle_y, full))
    }

    /// A point on the chest wall, `out` outside its inner surface, at a height and an angle from the back towards a
    /// side (1 the left, −1 the right).
    pub(super) fn chest_wall(&self, side: f64, z: f64, angle: f64, out: f64) -> Vec3 {
        let (half, y) = self.chest_at(z);
        // The upper ribs are round.
        let power = mix(0.8, 1.0, step(z, self.apex - 0.35 * self.chest(), self.apex));
        let [u, v] = oval(half.map(|h| h + out), power, angle);
        Vec3::new(self.spine[0] + side * u, y + v, z)
    }
}
