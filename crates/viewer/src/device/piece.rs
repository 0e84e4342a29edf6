//! Straight pieces of a centre line: frusta between mitres.
//!
//! Each piece is a cone frustum, cut at both ends by the plane that bisects it and its neighbour (a mitre).
//! Neighbouring cylinders meet that plane in the same ellipse, so pieces neither overlap nor leave gaps in bends. The
//! first and last planes are perpendicular to the axis: ends are flat.

use endowire_core::Vec3;

use super::DevicePoint;

/// A frustum between two mitre planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Centre of the first end.
    pub(crate) start: Vec3,
    /// Unit direction to the second end.
    pub(crate) axis: Vec3,
    /// Centre of the second end.
    pub(crate) end: Vec3,
    /// Plane normals at both ends, pointing forwards.
    pub(crate) planes: [Vec3; 2],
    /// Products of these normals with the centres. Neighbours store exactly the same numbers for their common plane.
    pub(crate) offsets: [f64; 2],
    pub(crate) radius: f64,
    /// Change of the radius per length.
    pub(crate) slope: f64,
    /// Largest radius, and the ratio by which a mitre extends beyond it.
    largest: f64,
    mitre: f64,
}

impl Piece {
    /// Radius of two spheres about the ends that together enclose the piece.
    pub(crate) fn reach(&self) -> f64 {
        self.largest * self.mitre
    }

    /// Its largest radius.
    pub(crate) fn largest_radius(&self) -> f64 {
        self.largest
    }

    /// How far its mitres reach beyond the centres of its ends, along its axis.
    pub(crate) fn beyond_mm(&self) -> f64 {
        self.largest * (self.mitre * self.mitre - 1.0).max(0.0).sqrt()
    }

    /// What tells pieces of a centre line from each other: their place and radius.
    pub(crate) fn key(&self) -> [u64; 8] {
        let [a, b] = [&self.start, &self.end];
        [a.x, a.y, a.z, b.x, b.y, b.z, self.radius, self.slope].map(f64::to_bits)
    }

    /// Radius in its middle.
    pub(crate) fn middle_radius(&self) -> f64 {
        if self.slope == 0.0 {
            self.radius
        } else {
            self.radius + 0.5 * self.slope * (self.end - self.start).norm()
        }
    }

    /// The piece as a cylinder of another radius.
    pub(crate) fn with_radius(&self, radius: f64) -> Self {
        Self { radius, slope: 0.0, largest: radius, ..*self }
    }
}

/// Smallest cosine of half the angle of a bend for mitres (a bend of 150°); sharper corners are blunted.
const SHARPEST_MITRE: f64 = 0.26;

/// The mitred pieces between consecutive points of a refined centre line.
pub(crate) fn pieces(points: &[DevicePoint]) -> Vec<Piece> {
    let chords: Vec<(Vec3, f64)> = points
        .windows(2)
        .map(|pair| {
            let chord = pair[1].position_mm - pair[0].position_mm;
            let length = chord.norm();
            (chord / length.max(f64::MIN_POSITIVE), length)
        })
        .collect();
    let plane = |k: usize| {
        let before = chords[k.saturating_sub(1)].0;
        let after = chords[k.min(chords.len() - 1)].0;
        (before + after).try_normalize(2.0 * SHARPEST_MITRE).unwrap_or(before)
    };
    (chords.iter().enumerate())
        .map(|(k, &(axis, length))| {
            let [r0, r1] = [points[k].radius_mm, points[k + 1].radius_mm];
            let planes = [plane(k), plane(k + 1)];
            let sharpest = planes[0].dot(&axis).min(planes[1].dot(&axis)).max(SHARPEST_MITRE);
            Piece {
                start: points[k].position_mm,
                axis,
                end: points[k + 1].position_mm,
                planes,
                offsets: [planes[0].dot(&points[k].position_mm), planes[1].dot(&points[k + 1].position_mm)],
                radius: r0,
                slope: (r1 - r0) / length.max(f64::MIN_POSITIVE),
                largest: r0.max(r1),
                mitre: 1.0 / sharpest,
            }
        })
        .collect()
}
