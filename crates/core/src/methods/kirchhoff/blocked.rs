//! Where a vessel is narrower than the device that is pushed into it.
//!
//! A wall that yields lets a device through a vessel somewhat narrower than itself, and then there is nothing to tell. Where no
//! equilibrium is found on the way, the room across the lumen says whether that is why.

use super::{Kirchhoff, softest};
use crate::PhysicalEnd;
use crate::contact::{FeltWall, Touch, WallContact};
use crate::insertion::Surroundings;

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

/// Half of the way across the lumen from where the device touches, mm, if that is less than its radius.
fn room_mm(felt: &FeltWall, touch: &Touch, radius_mm: f64) -> Option<f64> {
    let contact = &touch.contact;
    let foot = contact.position_mm + contact.normal * (contact.penetration_mm - radius_mm);
    let mut across_mm = 0.0;
    for _ in 0..PIECES {
        let from = foot + contact.normal * across_mm;
        let reach_mm = 2.0 * radius_mm - across_mm;
        let (way_mm, triangle) = felt.query.first_met(&from, &contact.normal, reach_mm)?;
        across_mm += way_mm;
        if felt.query.inward_normal(triangle).dot(&contact.normal) < 0.0 {
            return Some(0.5 * across_mm);
        }
        across_mm += ON_MM;
    }
    None
}
