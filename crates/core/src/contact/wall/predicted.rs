//! How far a device ends from where it was predicted, measured by the room that it has.
//!
//! An equilibrium is the next one on the device's path if it lies near the one that was predicted: continuation methods cut their steps by
//! that distance (E. L. Allgower, K. Georg, *Numerical Continuation Methods*, 1990, chapter 6). What is near a place in a vessel says the
//! vessel: a point that is in the lumen has as much room as it has clearance, and one that touches has its radius.

use super::WallContact;
use crate::Vec3;
use crate::rod::{ElementData, RodState};

/// Where a point was predicted, and the room that it has there, mm.
#[derive(Debug, Clone, Copy)]
pub(in crate::contact) struct Predicted {
    at_mm: Vec3,
    room_mm: f64,
}

impl WallContact<'_> {
    /// Notes where all points are predicted: at this state.
    pub fn predict(&mut self, elements: &[ElementData], state: &RodState) {
        self.cache.predicted.clear();
        for index in 0..self.points.len() {
            let point = &self.points[index];
            let at_mm = point.position(elements, state);
            let radius_mm = point.potential.radius_mm;
            let material = self.surface.material(&at_mm);
            let clearance_mm = self.read_within(index, &material, f64::NEG_INFINITY).distance_mm();
            self.cache.predicted.push(Predicted { at_mm, room_mm: (radius_mm * room_radii()).max(clearance_mm) });
        }
    }

    /// The farthest that a point is at a state from where it was predicted, over the room that it has there.
    pub fn off_prediction(&self, elements: &[ElementData], state: &RodState) -> f64 {
        let off = |(point, was): (&super::ContactPoint, &Predicted)| {
            (point.position(elements, state) - was.at_mm).norm() / was.room_mm
        };
        self.points.iter().zip(&self.cache.predicted).map(off).fold(0.0, f64::max)
    }
}

fn room_radii() -> f64 {
    static V: std::sync::OnceLock<f64> = std::sync::OnceLock::new();
    *V.get_or_init(|| std::env::var("ROOMR").map_or(1.0, |v| v.parse().unwrap()))
}
