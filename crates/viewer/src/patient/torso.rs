//! A trunk of closed surfaces: skin, vertebrae and ribs, lungs. Drawn, not measured: it gives frames the background that eyes
//! and networks expect, at adult sizes.
//!
//! Bone is a cortical shell around marrow in which a share is bone: its length on a ray is that of the outer surface less
//! (1 − share) of the inner one.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use endowire_core::Vec3;
use endowire_core::vessel::SurfaceMesh;

use crate::spec::TorsoSpec;

/// Thickness of cortical shells, mm.
const CORTEX_MM: f64 = 1.0;
/// Share of bone in marrow: thoracic vertebrae have about 150 mg of mineral per cm³, a tenth of cortical bone.
const MARROW_SHARE: f64 = 0.1;
/// Height of a vertebra and of the disc above it, mm (thoracic mean).
const VERTEBRA_MM: [f64; 2] = [20.0, 5.0];
/// Half width and half depth of a vertebral body, mm.
const VERTEBRA_HALF_MM: [f64; 2] = [16.0, 14.0];
/// Distance of the skin of the back from the middle of the vertebral bodies, mm.
const BACK_MM: f64 = 62.0;
/// Distance of the spine's middle behind the vessel's rearmost point, mm.
const BEHIND_MM: f64 = 20.0;
/// How far the trunk goes on beyond the vessel: a cone beam from any usual angle stays inside, mm.
const BEYOND_MM: f64 = 260.0;
/// Half a rib's thickness, mm.
const RIB_MM: f64 = 5.5;
/// Corners of tubes and of the rings of skin and lungs.
const TUBE_SIDES: usize = 14;
const RING_SIDES: usize = 72;

/// Closed surfaces of a trunk.
#[derive(Debug, Clone, Default)]
pub(crate) struct Body {
    pub(crate) skin: SurfaceMesh,
    pub(crate) bones: SurfaceMesh,
    pub(crate) marrow: SurfaceMesh,
    pub(crate) lungs: SurfaceMesh,
}

impl Body {
    /// Share of the marrow's length that is not bone.
    pub(crate) const NOT_BONE: f64 = 1.0 - MARROW_SHARE;

    /// A trunk around a vessel with the given lowest and highest coordinates.
    pub(crate) fn new(spec: &TorsoSpec, (low, high): (Vec3, Vec3)) -> Self {
        let trunk = Trunk::new(spec, low, high);
        let mut body = Self { skin: trunk.skin(), ..Self::default() };
        for (mesh, inset) in [(&mut body.bones, 0.0), (&mut body.marrow, CORTEX_MM)] {
            if spec.spine {
                trunk.spine(mesh, inset);
            }
            if spec.ribs {
                trunk.ribs(mesh, inset);
            }
        }
        if spec.lungs {
            trunk.lungs(&mut body.lungs);
        }
        body
    }
}

/// Measures of a trunk in patient axes, mm.
struct Trunk {
    /// Middle of the vertebral bodies: left, posterior.
    spine: [f64; 2],
    /// Middle of the trunk: posterior.
    middle_y: f64,
    half_width: f64,
    half_depth: f64,
    /// Lowest and highest height.
    z: [f64; 2],
    diaphragm: f64,
    apex: f64,
    /// How far left and right of the spine the mediastinum reaches.
    mediastinum: [f64; 2],
}

impl Trunk {
    fn new(spec: &TorsoSpec, low: Vec3, high: Vec3) -> Self {
        let spine = spec.spine_mm.unwrap_or([(low.x + high.x) / 2.0, high.y + BEHIND_MM]);
        let half_depth = spec.depth_mm / 2.0;
        // The vessel stays outside the lungs, within reason.
        let side = |reach: f64| (reach + 8.0).clamp(34.0, 0.3 * spec.width_mm);
        let diaphragm = spec.diaphragm_mm.unwrap_or(low.z + (high.z - low.z) / 3.0);
        Self {
            spine,
            middle_y: spine[1] + BACK_MM - half_depth,
            half_width: spec.width_mm / 2.0,
            half_depth,
            z: [low.z - BEYOND_MM, high.z + BEYOND_MM],
            diaphragm,
            apex: (high.z - 10.0).max(diaphragm + 190.0),
            mediastinum: [side(high.x - spine[0]), side(spine[0] - low.x)],
        }
    }

    /// A point on an oval inside the skin by `inset`, at an angle from the back towards the left.
    fn oval(&self, inset: f64, angle: f64) -> [f64; 2] {
        // A superellipse of exponent 2.5 is squarer than an ellipse, as trunks are.
        let power = |v: f64| v.signum() * v.abs().powf(0.8);
        let [x, y] = [self.half_width - inset, self.half_depth - inset];
        [self.spine[0] + x * power(angle.sin()), self.middle_y + y * power(angle.cos())]
    }

    fn skin(&self) -> SurfaceMesh {
        // Clockwise from the back over the left seen from above; reversed below.
        let ring = |z: f64| -> Vec<Vec3> {
            (0..RING_SIDES)
                .map(|k| {
                    let [x, y] = self.oval(0.0, -TAU * k as f64 / RING_SIDES as f64);
                    Vec3::new(x, y, z)
                })
                .collect()
        };
        let mut skin = SurfaceMesh::default();
        loft(&mut skin, &[ring(self.z[0]), ring(self.z[1])]);
        skin
    }

    /// Heights of the middles of the vertebral bodies.
    fn vertebrae(&self) -> impl Iterator<Item = f64> {
        let pitch = VERTEBRA_MM[0] + VERTEBRA_MM[1];
        let first = self.z[0] + pitch;
        let count = ((self.z[1] - self.z[0]) / pitch) as usize - 2;
        (0..count).map(move |k| first + pitch * k as f64)
    }

    fn spine(&self, mesh: &mut SurfaceMesh, inset: f64) {
        let [x, y] = self.spine;
        for z in self.vertebrae() {
            let [wide, deep] = VERTEBRA_HALF_MM.map(|half| half - inset);
            let half = VERTEBRA_MM[0] / 2.0 - inset;
            // Wider at the end plates than between them, and the plates hollow.
            let rings: Vec<Vec<Vec3>> = [
                (-0.82, 0.3),
                (-0.88, 0.7),
                (-1.0, 0.96),
                (-0.85, 1.0),
                (-0.4, 0.9),
                (0.4, 0.9),
                (0.85, 1.0),
                (1.0, 0.96),
                (0.88, 0.7),
                (0.82, 0.3),
            ]
            .into_iter()
            .map(|(h, waist): (f64, f64)| {
                (0..24)
                    .map(|k| {
                        let (s, c) = (TAU * f64::from(k) / 24.0).sin_cos();
                        Vec3::new(x + wide * waist * c, y + deep * waist * s, z + half * h)
                    })
                    .collect()
            })
            .collect();
            loft(mesh, &rings);
            let at = |side: f64, back: f64, up: f64| Vec3::new(x + side, y + back, z + up);
            for side in [-1.0, 1.0] {
                // Pedicle, then transverse process.
                tube(mesh, &[at(side * 11.0, 13.5, 3.0), at(side * 12.0, 25.0, 3.0)], 4.0 - inset);
                tube(
                    mesh,
                    &[at(side * 12.0, 26.0, 2.0), at(side * 22.0, 30.0, 4.0), at(side * 31.0, 33.0, 6.0)],
                    4.5 - inset,
                );
            }
            tube(mesh, &[at(0.0, 26.0, 0.0), at(0.0, 38.0, -9.0), at(0.0, 47.0, -19.0)], 3.2 - inset);
        }
    }

    fn ribs(&self, mesh: &mut SurfaceMesh, inset: f64) {
        let least = self.diaphragm - 30.0;
        for z in self.vertebrae().filter(|&z| z > least && z < self.apex + 20.0) {
            // Lower and uppermost ribs are shorter.
            let reach = if z < least + 50.0 { 1.6 } else { 2.35 };
            for side in [-1.0, 1.0] {
                let points: Vec<Vec3> = (0..=36)
                    .map(|k| {
                        let angle = 0.33 + (reach - 0.33) * f64::from(k) / 36.0;
                        let [x, y] = self.oval(16.0, angle);
                        // Out of the joint a little upwards, then down to the front.
                        let drop = 95.0 * ((angle - 0.33) / PI).powf(1.2);
                        Vec3::new(self.spine[0] + side * (x - self.spine[0]), y, z + 8.0 - drop)
                    })
                    .collect();
                tube(mesh, &points, RIB_MM - inset);
            }
        }
    }

    fn lungs(&self, mesh: &mut SurfaceMesh) {
        let bottom = self.diaphragm - 45.0;
        for (side, mediastinum) in [1.0, -1.0].into_iter().zip(self.mediastinum) {
            // Heart: to the left more than to the right.
            let heart = if side > 0.0 { 38.0 } else { 14.0 };
            let medial = |z: f64| mediastinum + heart * (-((z - self.diaphragm - 25.0) / 48.0).powi(2)).exp();
            let ring = |z: f64, scale: f64| -> Vec<Vec3> {
                let medial = medial(z);
                let lateral = |k: usize, n: usize| {
                    // The part of the inner chest wall beyond the mediastinum.
                    let angle = 0.25 + (PI - 0.5) * k as f64 / n as f64;
                    let [x, y] = self.oval(24.0, angle);
                    [(x - self.spine[0]).max(medial + 2.0), y]
                };
                let n = RING_SIDES / 2;
                let mut outline: Vec<[f64; 2]> = (0..=n).map(|k| lateral(k, n)).collect();
                let [back, front] = [outline[0][1], outline[n][1]];
                outline.extend((1..12).map(|k| [medial, front + (back - front) * f64::from(k) / 12.0]));
                let mean = |k: usize| outline.iter().map(|p| p[k]).sum::<f64>() / outline.len() as f64;
                let centre = [mean(0), mean(1)];
                let mut points: Vec<Vec3> = outline
                    .iter()
                    .map(|p| {
                        let [u, v] = [0, 1].map(|k| centre[k] + scale * (p[k] - centre[k]));
                        Vec3::new(self.spine[0] + side * u, v, z)
                    })
                    .collect();
                // From the back over the left to the front is clockwise seen from above; on the right it is not.
                if side > 0.0 {
                    points.reverse();
                }
                points
            };
            let height = self.apex - bottom;
            let rings: Vec<Vec<Vec3>> = (0..=40)
                .map(|k| {
                    let h = f64::from(k) / 40.0;
                    // Full up to two thirds, then a rounded apex.
                    let t = ((h - 0.6) / 0.4).max(0.0);
                    ring(bottom + height * h, (1.0 - 0.99 * t.powf(2.2)).max(0.02))
                })
                .collect();
            loft(mesh, &rings);
            // The diaphragm's dome, taken out of the lung: what it holds is soft tissue.
            let dome: Vec<Vec<Vec3>> = (0..=16)
                .map(|k| {
                    let (s, c) = (FRAC_PI_2 * f64::from(k) / 16.0).sin_cos();
                    ring(bottom + 0.01 + 45.0 * s, (0.985 * c).max(0.01))
                })
                .collect();
            let mut inside = SurfaceMesh::default();
            loft(&mut inside, &dome);
            inside.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            join(mesh, &inside);
        }
    }
}

/// Adds a mesh to another.
fn join(mesh: &mut SurfaceMesh, other: &SurfaceMesh) {
    let offset = mesh.vertices_mm.len() as u32;
    mesh.vertices_mm.extend(&other.vertices_mm);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
}

/// Adds a closed surface through rings of equally many points, counter-clockwise seen from the last ring.
fn loft(mesh: &mut SurfaceMesh, rings: &[Vec<Vec3>]) {
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

/// Adds a closed tube along at least two points.
fn tube(mesh: &mut SurfaceMesh, points: &[Vec3], radius: f64) {
    let last = points.len() - 1;
    let mut side = Vec3::zeros();
    let rings: Vec<Vec<Vec3>> = (0..=last)
        .map(|i| {
            let along = (points[(i + 1).min(last)] - points[i.saturating_sub(1)]).normalize();
            let start = if i == 0 { Vec3::new(along.y, along.z, along.x).cross(&along) } else { side };
            side = (start - along * start.dot(&along)).normalize();
            let other = along.cross(&side);
            (0..TUBE_SIDES)
                .map(|k| {
                    let (s, c) = (TAU * k as f64 / TUBE_SIDES as f64).sin_cos();
                    points[i] + (side * c + other * s) * radius
                })
                .collect()
        })
        .collect();
    loft(mesh, &rings);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::check_closed;

    fn body() -> Body {
        Body::new(&TorsoSpec::default(), (Vec3::new(-40.0, -50.0, 0.0), Vec3::new(40.0, 30.0, 300.0)))
    }

    #[test]
    fn every_surface_is_closed_and_outward_and_has_an_adults_volume() {
        let body = body();
        for (name, mesh, litres) in [
            ("skin", &body.skin, [35.0, 65.0]),
            ("bones", &body.bones, [0.5, 2.5]),
            ("marrow", &body.marrow, [0.3, 2.0]),
            ("lungs", &body.lungs, [2.0, 7.0]),
        ] {
            check_closed(mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
            let volume = mesh.signed_volume_mm3() / 1e6;
            assert!(volume > litres[0] && volume < litres[1], "{name}: {volume} l");
        }
        assert!(body.marrow.signed_volume_mm3() < 0.9 * body.bones.signed_volume_mm3());
    }

    #[test]
    fn what_is_not_wanted_is_not_there() {
        let spec = TorsoSpec { spine: false, ribs: false, lungs: false, ..TorsoSpec::default() };
        let body = Body::new(&spec, (Vec3::zeros(), Vec3::repeat(100.0)));
        assert!(body.bones.triangles.is_empty() && body.lungs.triangles.is_empty());
        assert!(!body.skin.triangles.is_empty());
    }
}
