//! Places on a device where the wall is felt, and what happens there.

use crate::Vec3;
use crate::contact::{Distance, WallPotential};
use crate::insertion::Contact;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{ElementData, RodState};

/// A place on the device where the wall is felt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// Element and local coordinate 0…1.
    pub element: usize,
    /// Local coordinate in the element.
    pub xi: f64,
    /// Arc length from the tip, mm.
    pub from_tip_mm: f64,
    /// Length of device that the point stands for, mm.
    pub weight_mm: f64,
    /// Energy per length.
    pub potential: WallPotential,
}

impl ContactPoint {
    /// Position on the device's axis, mm.
    pub fn position(&self, elements: &[ElementData], state: &RodState) -> Vec3 {
        let (e, xi) = (self.element, self.xi);
        if xi == 1.0 {
            return state.positions[e + 1];
        }
        let [w0, s0, w1, s1] = hermite(xi);
        let h = elements[e].length;
        state.positions[e] * w0
            + state.positions[e + 1] * w1
            + (state.frames[e].t * s0 + state.frames[e + 1].t * s1) * h
    }

    /// Normal of the wall and force on it at a distance, N; `factor` as in [`Stiffness`](super::grading::Stiffness).
    pub(super) fn pressed(&self, d: &Distance, factor: f64) -> (Vec3, f64) {
        // The smooth distance has a gradient of nearly unit length; the normal has one.
        let size = d.gradient.norm();
        (d.gradient / size, -factor * self.weight_mm * self.potential.derivatives(d.value_mm).0 * size)
    }

    /// Material angle, rad.
    pub fn angle(&self, state: &RodState) -> f64 {
        let [w0, w1, wb] = Point::at(self.xi, 0.0).phi;
        let e = self.element;
        w0 * state.angles[e] + w1 * state.angles[e + 1] + wb * state.bubbles[e]
    }
}

/// A contact point that presses on the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Energy stored in the wall there, mJ.
    pub energy_mj: f64,
    /// Place and forces.
    pub contact: Contact,
}

/// Questions about the wall, asked and avoided. They tell of the work that was done, which hangs on what a simulation still knows of places
/// where a device has been, and not of the state of an insertion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Counters {
    /// Questions to the bounding volume hierarchy.
    pub queries: u64,
    /// Questions that the quadrics about the last triangle answered.
    pub near: u64,
    /// Questions that the last clearance answered, or the same question before, of the same point or of another in its place.
    pub avoided: u64,
}

impl Counters {
    /// Adds another count.
    pub fn add(&mut self, other: &Self) {
        self.queries += other.queries;
        self.near += other.near;
        self.avoided += other.avoided;
    }
}
