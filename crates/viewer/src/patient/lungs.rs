//! Air in the body: lungs with their vessels, trachea, throat and sinuses, stomach and colon.
//!
//! A lung is the region inside the chest wall, outside heart, mediastinum and spine, above the diaphragm and below
//! the dome of its apex. The limits are distances, blended where they meet, and the surface is found along rays from
//! an axis inside; at the bottom it turns inwards over the diaphragm, so that the lung ends in a thin edge behind and
//! at the sides.

use std::f64::consts::{PI, TAU};

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use super::loft::{ellipsoid, ellipsoid_of, hollow, loft, smooth, tube};
use super::motion::BodyMotion;
use super::trunk::{Trunk, step};
use crate::spec::TorsoSpec;

/// Radius over which limits are blended, mm.
const BLEND_MM: f64 = 9.0;
/// Height of the diaphragm's dome over its edge at the side, mm.
const DOME_MM: f64 = 42.0;
/// Half axes of the heart, and its centre relative to the middle of chest and diaphragm: left, forward, up, mm.
const HEART_MM: [[f64; 3]; 2] = [[71.0, 48.0, 58.0], [23.0, 26.0, 25.0]];
/// Least distance of the mediastinum from the back of the breastbone, mm: the lungs nearly meet before it.
const BEFORE_MM: f64 = 26.0;
/// Steps towards the surface from the axis, mm.
const STRIDE_MM: f64 = 4.0;
/// Number of times distances are averaged with their neighbours': the region behind the heart ends smoothly.
const SMOOTHINGS: usize = 6;
/// Numbers of corners of a ring, of rings from the lung's edge to its apex, and of rings over the diaphragm.
const SIDES: usize = 48;
const RINGS: usize = 36;
const DOME_RINGS: usize = 12;
/// Number of generations of a lung's vessels, and radii of the first and the thinnest, mm.
const GENERATIONS: u32 = 7;
const VESSELS_MM: [f64; 2] = [4.9, 0.7];
/// Angle between a vessel and its two branches.
const FORK_RAD: f64 = 0.5;
/// The golden angle, by which the planes of bifurcations are rotated.
const TURN_RAD: f64 = 2.399_963;

/// The smooth maximum of two distances.
fn blended(a: f64, b: f64) -> f64 {
    f64::midpoint(a + b, ((a - b).powi(2) + BLEND_MM * BLEND_MM).sqrt())
}

/// Distances averaged with their neighbours in the ring and in the rings before and behind.
fn smoothed(mut reaches: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for _ in 0..SMOOTHINGS {
        let before = reaches.clone();
        let last = before.len() - 1;
        // The apex is fixed.
        for (i, ring) in reaches.iter_mut().enumerate().take(last - 1).skip(1) {
            for (k, reach) in ring.iter_mut().enumerate() {
                let beside = before[i][(k + 1) % SIDES] + before[i][(k + SIDES - 1) % SIDES];
                *reach = before[i][k] / 2.0 + (beside + before[i - 1][k] + before[i + 1][k]) / 8.0;
            }
        }
    }
    reaches
}

/// One lung.
struct Lung<'a> {
    trunk: &'a Trunk,
    /// 1 the left one, −1 the right one.
    side: f64,
    /// Largest half width of the mediastinum.
    widest: f64,
    /// Height of the diaphragm's dome.
    dome: f64,
}

impl Trunk {
    /// How the heart that the lungs leave room for, and the diaphragm, move.
    pub(super) fn motion(&self, spec: &TorsoSpec) -> BodyMotion {
        let [half, at] = HEART_MM;
        BodyMotion {
            breath_mm: spec.breath_mm(),
            beat_mm: spec.beat_mm(),
            diaphragm: self.diaphragm,
            apex: self.apex,
            heart: Vec3::new(self.spine[0] + at[0], self.middle_y - at[1], self.diaphragm + at[2]),
            heart_half_mm: half.into(),
        }
    }
}

impl Lung<'_> {
    /// Approximate distance of a point outside the lung's sides, mm; negative inside.
    fn outside(&self, u: f64, y: f64, z: f64) -> f64 {
        let trunk = self.trunk;
        let ([wide, deep], middle) = trunk.chest_at(z);
        // The apex is a dome below the ring of the first ribs.
        let tip = ((z - trunk.apex + 55.0) / 57.0).clamp(0.0, 0.999);
        let narrow = (1.0 - tip * tip).sqrt();
        let half = [(wide - 2.0) * narrow, (deep - 2.0) * narrow];
        let reach = libm::pow(u.abs() / half[0], 2.5) + libm::pow((y - middle).abs() / half[1], 2.5);
        let wall = (libm::pow(reach, 0.4) - 1.0) * half[0].min(half[1]);
        // Great vessels, wider at arch and hilum.
        let bump = |at: f64, width: f64| libm::exp(-((z - at) / width).powi(2));
        let hilum = self.hilum_z();
        let bulge =
            7.0 * bump(trunk.apex - 62.0, 16.0) * f64::from(self.side > 0.0) + 6.0 * bump(hilum, 26.0);
        // The right atrium, and the ascending aorta with the upper vein.
        let right = 11.0 * bump(trunk.diaphragm + 34.0, 36.0) + 4.0 * bump(hilum + 36.0, 26.0);
        let bulge = if self.side < 0.0 { right - 3.0 } else { bulge - 2.0 };
        let [inner, forward] = trunk.mediastinum(self.side, z);
        let inner = inner + bulge;
        let round = |u: f64, v: f64, half: [f64; 2]| {
            (1.0 - libm::hypot(u / half[0], v / half[1])) * half[0].min(half[1])
        };
        // From the spine to the front of the great vessels.
        let back = trunk.spine_y(z) + 10.0;
        let front = (trunk.spine[1] - forward).min(middle - 0.15 * deep).max(middle - deep + BEFORE_MM);
        let between = {
            let [v, half] = [y - f64::midpoint(back, front), f64::midpoint(back, -front)];
            let out = libm::pow(u.abs() / inner, 3.0) + libm::pow(v.abs() / half, 3.0);
            (1.0 - libm::cbrt(out)) * inner.min(half)
        };
        let spine = round(u, y - trunk.spine_y(z) - 4.0, [31.0, 30.0]);
        let [half, at] = HEART_MM;
        let heart = [self.side * u - at[0], y - trunk.middle_y + at[1], z - trunk.diaphragm - at[2]];
        // The heart's long axis goes down to the left.
        let turned = [heart[0] * 0.9 - heart[2] * 0.44, heart[1], heart[0] * 0.44 + heart[2] * 0.9];
        let norm = (0..3).map(|k| (turned[k] / half[k]).powi(2)).sum::<f64>().sqrt();
        let heart = (1.0 - norm) * half[1];
        blended(blended(wall, between), blended(spine, heart))
    }

    /// Height of the hilum.
    fn hilum_z(&self) -> f64 {
        self.trunk.diaphragm + (0.53 + 0.03 * self.side) * self.trunk.chest()
    }

    /// An interior point at a height: to the side and posterior.
    fn axis(&self, z: f64) -> [f64; 2] {
        let ([wide, _], middle) = self.trunk.chest_at(z);
        let down = step(z, self.trunk.apex, self.trunk.diaphragm + 40.0);
        let inner = (self.widest + 6.0).max(33.0);
        // At the apex between mediastinum and wall; below behind the heart.
        [inner + (0.42 + 0.1 * down) * (wide - inner), middle + 4.0 + 12.0 * down]
    }

    /// Highest height at which the axis is inside.
    fn top(&self) -> f64 {
        let inside = |z: f64| {
            let [u, y] = self.axis(z);
            self.outside(u, y, z) < -4.0
        };
        let steps = (0..200).map(|k| self.trunk.apex - f64::from(k) * 0.5);
        steps.into_iter().find(|z| inside(*z)).unwrap_or(self.trunk.apex - 100.0)
    }

    /// Distance of the surface from the axis at a height, in a direction (angle from the side towards the back): the
    /// first limit on the ray.
    fn reach(&self, z: f64, angle: f64) -> f64 {
        let [u, y] = self.axis(z);
        let (s, c) = libm::sincos(angle);
        let is_inside = |r: f64| self.outside(u + r * c, y + r * s, z) < 0.0;
        let first =
            (1..).map(|k| STRIDE_MM * f64::from(k)).find(|r| *r > self.trunk.half_width || !is_inside(*r));
        let mut out = first.unwrap_or(STRIDE_MM);
        let mut inside = out - STRIDE_MM;
        for _ in 0..16 {
            let middle = f64::midpoint(inside, out);
            if is_inside(middle) { inside = middle } else { out = middle }
        }
        inside
    }

    /// Height of the edge in a direction: lowest behind and at the side.
    fn edge(&self, angle: f64) -> f64 {
        let (s, c) = libm::sincos(angle);
        self.dome - DOME_MM - 16.0 * s - 10.0 * c
    }

    /// Rings over the diaphragm from the middle of its dome to the edge, then up to the apex.
    fn rings(&self) -> Vec<Vec<Vec3>> {
        let top = self.top();
        let angle = |k: usize| TAU * k as f64 / SIDES as f64;
        // Height, and fraction of the distance from the axis, of each point.
        let over = (1..=DOME_RINGS).map(|ring| ring as f64 / DOME_RINGS as f64).map(|part| {
            let at = |k: usize| {
                let edge = self.edge(angle(k));
                (edge + (self.dome - edge) * (1.0 - libm::pow(part, 2.4)), part * 0.995)
            };
            (0..SIDES).map(at).collect::<Vec<_>>()
        });
        // Closer together towards the apex, which is round.
        let up = (0..=RINGS).map(|ring| libm::sin(PI / 2.0 * ring as f64 / RINGS as f64)).map(|part| {
            let at = |k: usize| (self.edge(angle(k)) + (top - self.edge(angle(k))) * part, 1.0);
            (0..SIDES).map(at).collect::<Vec<_>>()
        });
        let places: Vec<Vec<(f64, f64)>> = over.chain(up).collect();
        let reach = |ring: &Vec<(f64, f64)>| -> Vec<f64> {
            ring.iter().enumerate().map(|(k, (z, _))| self.reach(*z, angle(k))).collect()
        };
        let reaches = smoothed(places.iter().map(reach).collect());
        let point = |k: usize, (z, part): (f64, f64), reach: f64| {
            let [u, y] = self.axis(z);
            let (s, c) = libm::sincos(angle(k));
            Vec3::new(self.trunk.spine[0] + self.side * (u + part * reach * c), y + part * reach * s, z)
        };
        let ring = |(places, reaches): (Vec<(f64, f64)>, Vec<f64>)| -> Vec<Vec3> {
            let of = places.into_iter().zip(reaches).enumerate();
            let mut points: Vec<Vec3> = of.map(|(k, (place, reach))| point(k, place, reach)).collect();
            if self.side < 0.0 {
                points.reverse();
            }
            points
        };
        places.into_iter().zip(reaches).map(ring).collect()
    }

    /// Whether a point is well inside.
    fn holds(&self, point: &Vec3) -> bool {
        let u = self.side * (point.x - self.trunk.spine[0]);
        let [axis, y] = self.axis(point.z);
        let off = libm::hypot(u - axis, point.y - y) / 75.0;
        let diaphragm = self.dome - DOME_MM * libm::pow(off, 2.4).min(1.0);
        self.outside(u, point.y, point.z) < -3.0 && point.z > diaphragm + 4.0
    }

    /// Adds the vessel that starts at a point, and its branches, as long as they are inside.
    fn vessel(&self, mesh: &mut SurfaceMesh, start: Vec3, along: Vec3, normal: Vec3, generation: u32) {
        let part = f64::from(generation) / f64::from(GENERATIONS);
        let [thick, thin] = VESSELS_MM;
        let radius = |part: f64| thick * libm::pow(thin / thick, part.min(1.0));
        let length = 30.0 - 14.0 * part;
        let end = start + along * length;
        let bent = start + along * (0.5 * length) + normal * (0.05 * length);
        if !self.holds(&end) && generation > 0 {
            return;
        }
        let [from, to] = [radius(part), radius(part + 1.0 / f64::from(GENERATIONS))];
        tube(mesh, &[(start, from), (bent, f64::midpoint(from, to)), (end, to)]);
        if generation + 1 == GENERATIONS {
            return;
        }
        let other = along.cross(&normal);
        for sign in [1.0, -1.0] {
            let (s, c) = libm::sincos(sign * FORK_RAD * (1.0 - 0.25 * sign * (part - 0.5)));
            let next = along * c + normal * s;
            let (ts, tc) = libm::sincos(TURN_RAD);
            let turned = other * tc + (normal * c - along * s) * ts;
            let turned = turned - next * turned.dot(&next);
            self.vessel(mesh, end - along * (0.5 * to), next.normalize(), turned.normalize(), generation + 1);
        }
    }
}

impl Trunk {
    /// Adds lungs, trachea and the air below.
    pub(super) fn air(&self, mesh: &mut SurfaceMesh) {
        let carina = Vec3::new(self.spine[0], self.spine_y(self.apex) - 40.0, self.apex - 85.0);
        for side in [1.0, -1.0] {
            // The liver lifts the right dome.
            let dome = self.diaphragm + 3.0 - 8.0 * side;
            let heights = (0..40).map(|k| self.diaphragm + self.chest() * f64::from(k) / 40.0);
            let widest = heights.map(|z| self.mediastinum(side, z)[0]).fold(0.0, f64::max);
            let lung = Lung { trunk: self, side, widest, dome };
            loft(mesh, &lung.rings());
            let z = lung.hilum_z();
            let [u, y] = lung.axis(z);
            let root = Vec3::new(self.spine[0] + side * (self.mediastinum(side, z)[0] + 14.0), y - 6.0, z);
            let out = Vec3::new(side * u, 0.0, 0.0).normalize();
            hollow(mesh, |mesh| {
                for (up, back) in [
                    (1.0, 0.1),
                    (-0.05, -0.45),
                    (-1.05, 0.35),
                    (0.35, 0.7),
                    (-0.55, -0.2),
                    (0.75, -0.5),
                    (-0.8, 0.9),
                ] {
                    let along = (out + Vec3::new(0.0, back, up)).normalize();
                    let normal = Vec3::new(0.0, up, -back).cross(&along).normalize();
                    lung.vessel(mesh, root, along, normal, 0);
                }
            });
            // Outside the lungs' own air, so only up to their surface.
            let bronchus = [(carina, 7.0), (carina + (root - carina) * 0.5, 6.0), (root - out * 14.0, 5.0)];
            tube(mesh, &smooth(&bronchus, 0.0));
        }
        let larynx = Vec3::new(self.spine[0], self.spine_y(self.apex + 75.0) - 30.0, self.apex + 75.0);
        let middle = (carina + larynx) / 2.0 + Vec3::y() * -6.0;
        tube(mesh, &smooth(&[(larynx, 6.0), (middle, 8.5), (carina + Vec3::z() * 8.0, 8.5)], 0.0));
        self.air_of_head(mesh, larynx);
        self.bowel(mesh);
    }

    /// Adds the air in stomach and colon.
    fn bowel(&self, mesh: &mut SurfaceMesh) {
        let front = self.middle_y - 0.35 * self.half_depth;
        let at = |part: f64, back: f64, down: f64| {
            Vec3::new(self.spine[0] + part * self.half_width, front + back, self.diaphragm - down)
        };
        // The stomach's dome under the left diaphragm.
        for (part, down, half) in
            [(0.36, 40.0, [22.0, 9.0, 10.0]), (0.48, 36.0, [16.0, 8.0, 9.0]), (0.28, 52.0, [12.0, 6.0, 11.0])]
        {
            ellipsoid(mesh, at(part, 25.0, down), Vec3::from(half));
        }
        // Haustra: bubbles in a row, along the colon from its right to its left bend and down.
        let frame = [
            (-0.66, 190.0),
            (-0.68, 130.0),
            (-0.55, 95.0),
            (-0.1, 138.0),
            (0.4, 105.0),
            (0.68, 60.0),
            (0.7, 150.0),
        ];
        for (pair, number) in frame.windows(2).zip(0..) {
            for k in 0..9 {
                let hash = |more: f64| libm::sin(f64::from(number * 9 + k) * TURN_RAD + more).abs();
                // Gas comes in runs, between what is solid.
                let run = libm::sin(f64::from(number * 9 + k) * 0.61 + 0.8);
                if run < 0.15 || hash(0.4) < 0.2 {
                    continue;
                }
                let t = (f64::from(k) + 0.5) / 9.0;
                let part = pair[0].0 + (pair[1].0 - pair[0].0) * t;
                let down = pair[0].1 + (pair[1].1 - pair[0].1) * t;
                // Overlapping pouches on both sides of a bowel's middle.
                for side in [-1.0, 1.0] {
                    let size = 0.55 + 0.75 * hash(1.0 + side);
                    let half = Vec3::new(8.5, 4.5, 6.5) * (size * (0.5 + 0.5 * run));
                    let aside = side * 4.0 * hash(3.0);
                    let place = at(part, 10.0 + 12.0 * hash(5.0), down + 8.0 * hash(4.0) + aside);
                    ellipsoid_of(mesh, 10, place + Vec3::x() * (0.5 * aside), half);
                }
            }
        }
    }
}
