//! Contact points of a device: where the wall is evaluated.

use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::contact::{Distance, WallPotential};
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{ElementData, RodState};

/// A point of the device at which contact with the wall is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ContactPoint {
    /// Element and local coordinate 0…1.
    pub element: usize,
    /// Local coordinate in the element.
    pub xi: f64,
    /// Index of the outermost instrument there, which touches the wall; 0 for a single device.
    pub instrument: usize,
    /// Its set of material angles; 0 where it has none.
    pub set: usize,
    /// Arc length from the tip, mm.
    pub from_tip_mm: f64,
    /// Length of device that the point represents, mm.
    pub weight_mm: f64,
    /// Energy per length.
    pub potential: WallPotential,
}

impl ContactPoint {
    /// Position on the device's axis, mm.
    pub(crate) fn position(&self, elements: &[ElementData], state: &RodState) -> Vec3 {
        let (e, x, frames) = (self.element, &state.positions, &state.frames);
        self.between(&[x[e], x[e + 1], frames[e].t, frames[e + 1].t], elements[e].length)
    }

    /// Position on the device's axis, mm, and unit tangent there.
    pub(crate) fn position_and_tangent(&self, elements: &[ElementData], state: &RodState) -> (Vec3, Vec3) {
        (self.position(elements, state), state.tangent_in(self.element, self.xi))
    }

    /// Position on an element of that length, given positions and tangents of its nodes, mm.
    pub(super) fn between(&self, [x0, x1, t0, t1]: &[Vec3; 4], length_mm: f64) -> Vec3 {
        if self.xi == 1.0 {
            return *x1;
        }
        let [w0, s0, w1, s1] = hermite(self.xi);
        x0 * w0 + x1 * w1 + (t0 * s0 + t1 * s1) * length_mm
    }

    /// Normal of the wall and force on it at this distance, N; `factor` as in
    /// [`Stiffness`](super::regions::Stiffness).
    pub(super) fn pressed(&self, d: &Distance, factor: f64) -> (Vec3, f64) {
        // The gradient of the smooth distance is only nearly of unit length; the normal is normalised.
        let size = d.gradient.norm();
        (d.gradient / size, -factor * self.weight_mm * self.potential.derivatives(d.value_mm).0 * size)
    }

    /// Its element, ξ and set of angles.
    pub(crate) fn place(&self) -> (usize, f64, usize) {
        (self.element, self.xi, self.set)
    }

    /// Material angle, rad.
    pub(crate) fn angle(&self, state: &RodState) -> f64 {
        let [w0, w1, wb] = Point::at(self.xi, 0.0).phi;
        let sets = state.sets();
        let e = sets * self.element + self.set;
        w0 * state.angles[e] + w1 * state.angles[e + sets] + wb * state.bubbles[e]
    }

    /// Material angle, rad, and radius, mm: what spin turns.
    #[inline]
    pub(super) fn turned(&self, state: &RodState) -> (f64, f64) {
        (self.angle(state), self.potential.radius_mm)
    }
}

/// A contact with the wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Position on the device's axis, mm.
    pub position_mm: Vec3,
    /// Direction of the wall's elastic force on the device: the unit normal into the lumen. At the edge of a region
    /// it is inclined to the softer side.
    pub normal: Vec3,
    /// Elastic normal force of the wall, N.
    pub force_n: f64,
    /// Friction force on the device, along the wall and against its slip, N.
    pub friction_n: Vec3,
    /// Penetration of the device's surface into the wall, mm.
    pub penetration_mm: f64,
    /// Triangle of the wall mesh.
    pub triangle: u32,
}

impl Contact {
    /// Total force of the wall on the device, N.
    pub fn total_n(&self) -> Vec3 {
        self.normal * self.force_n + self.friction_n
    }
}

/// A contact point that presses on the wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Touch {
    /// Energy stored in the wall there, mJ.
    pub energy_mj: f64,
    /// Position and forces.
    pub contact: Contact,
    /// Moment of friction on the device about its axis, N·mm.
    pub friction_nmm: f64,
}

impl Touch {
    /// Whether all its numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let Self { energy_mj, contact, friction_nmm } = self;
        let vectors = [&contact.position_mm, &contact.normal, &contact.friction_n];
        let sizes = [*energy_mj, contact.force_n, contact.penetration_mm, *friction_nmm];
        vectors.into_iter().flatten().chain(&sizes).all(|part| part.is_finite())
    }
}

/// Wall queries made and avoided. They measure work, which depends on what a simulation still remembers of earlier
/// positions, and are not part of the state of an insertion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counters {
    /// Queries of the bounding volume hierarchy.
    pub queries: u64,
    /// Queries answered by the quadrics about the last triangle.
    pub near: u64,
    /// Queries answered by the last clearance, or by an earlier query at the same position.
    pub avoided: u64,
}

impl Counters {
    /// Adds other counts.
    pub(crate) fn add(&mut self, other: &Self) {
        self.queries += other.queries;
        self.near += other.near;
        self.avoided += other.avoided;
    }
}
