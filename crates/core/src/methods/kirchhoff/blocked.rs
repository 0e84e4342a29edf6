//! Where a vessel is narrower than the device that is pushed into it.
//!
//! A wall that yields lets a device through a vessel somewhat narrower than itself, and then there is nothing to tell. Where no
//! equilibrium is found on the way, the room across the lumen says whether that is why.

use super::{Kirchhoff, softest};
use crate::contact::{FeltWall, Touch, WallContact};
use crate::insertion::Surroundings;
use crate::{PhysicalEnd, Vec3};

/// How far off the wall, in radii, ways across begin: flat triangles may stand into the smooth lumen.
const OFF: f64 = 0.3;
/// Tangents of the angles between the normal and other ways across.
const TILTS: [f64; 2] = [0.4, 1.0];
/// Pieces of the near wall that the way across may meet before it has left them behind.
const PIECES: usize = 4;
/// From one of them the way goes on so much farther, mm.
const ON_MM: f64 = 1e-3;

impl<const C: usize> Kirchhoff<C> {
    /// The narrowest place at which the device presses on the wall and has less room across the lumen than its diameter.
    pub(super) fn narrowest(&mut self, surroundings: &Surroundings<'_>) -> Option<PhysicalEnd> {
        let mesh = &self.current.mesh;
        let mut contact = WallContact::new(
            &self.felt,
            &mesh.points,
            &mut self.memory,
            &mut self.current.friction,
            softest(surroundings.device),
            self.options.skip,
        );
        let mut least: Option<(f64, PhysicalEnd)> = None;
        for (index, point) in mesh.points.iter().enumerate() {
            let device_radius_mm = point.potential.radius_mm;
            let Some(touch) = contact.touch(&mesh.elements, &self.current.state, index) else { continue };
            let Some(lumen_radius_mm) = room_mm(&self.felt, &touch, device_radius_mm) else { continue };
            let part = lumen_radius_mm / device_radius_mm;
            if least.is_none_or(|(narrowest, _)| part < narrowest) {
                let position_mm = touch.contact.position_mm;
                least = Some((part, PhysicalEnd::Blocked { position_mm, lumen_radius_mm, device_radius_mm }));
            }
        }
        least.map(|(_, end)| end)
    }
}

/// Half of the least way across the lumen where the device touches, mm, if that is less than its radius: along the normal, and aslant.
fn room_mm(felt: &FeltWall, touch: &Touch, radius_mm: f64) -> Option<f64> {
    let contact = &touch.contact;
    let n = contact.normal;
    let from = contact.position_mm + n * (contact.penetration_mm - (1.0 - OFF) * radius_mm);
    let e = n.cross(&Vec3::ith(n.iamin(), 1.0)).normalize();
    let f = n.cross(&e);
    let aslant = TILTS.into_iter().flat_map(|tilt| [e, f, -e, -f].map(|side| (n + side * tilt).normalize()));
    let ways = std::iter::once(n).chain(aslant);
    let across = ways.filter_map(|way| {
        let ahead_mm = facing_mm(felt, &from, &way, 2.0 * radius_mm)?;
        let (back_mm, _) = felt.query.first_met(&from, &-way, 2.0 * radius_mm - ahead_mm)?;
        Some(0.5 * (ahead_mm + back_mm))
    });
    across.min_by(f64::total_cmp)
}

/// How far ahead the wall that faces `from` is, mm, within `reach_mm`.
fn facing_mm(felt: &FeltWall, from: &Vec3, way: &Vec3, reach_mm: f64) -> Option<f64> {
    let mut ahead_mm = 0.0;
    for _ in 0..PIECES {
        let (met_mm, triangle) = felt.query.first_met(&(from + way * ahead_mm), way, reach_mm - ahead_mm)?;
        ahead_mm += met_mm;
        if felt.query.inward_normal(triangle).dot(way) < 0.0 {
            return Some(ahead_mm);
        }
        ahead_mm += ON_MM;
    }
    None
}
