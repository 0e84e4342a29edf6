//! A device where it is: mesh, state, and the friction that it met on its way there.

use super::mesh::Mesh;
use crate::contact::Friction;
use crate::insertion::Sheath;
use crate::rod::{Frame, RodState};

/// What a step starts from and ends with.
#[derive(Debug, Clone, Default)]
pub(super) struct Configuration {
    pub(super) mesh: Mesh,
    pub(super) state: RodState,
    pub(super) friction: Friction,
}

impl Configuration {
    /// Nothing inserted.
    pub(super) fn at(sheath: &Sheath, friction: f64) -> Self {
        let mut configuration = Self { friction: Friction::new(friction), ..Self::default() };
        configuration.mesh.from_tip_mm.push(0.0);
        configuration.state.frames.push(Frame::new(sheath.direction, None));
        configuration.state.angles.push(0.0);
        configuration.state.positions.push(sheath.position_mm);
        configuration
    }

    /// Length inside the sheath's mouth, mm.
    pub(super) fn inserted_mm(&self) -> f64 {
        self.mesh.from_tip_mm[0]
    }

    /// Pulls the device back to the sheath's mouth; the tail has the angle `tail_rad`.
    pub(super) fn withdraw(&mut self, tail_rad: f64) {
        self.mesh.clear();
        self.state.clear();
        self.state.angles[0] = tail_rad;
        self.friction.clear();
    }
}
