//! The configuration of a device: its state, and the corresponding mesh.

use std::sync::Arc;

use super::hands::Hand;
use super::mesh::{Fineness, Mesh};
use super::state::KirchhoffState;
use crate::device::Stack;
use crate::methods::Surroundings;

/// The result of a sub-step.
#[derive(Debug, Clone)]
pub(super) struct Configuration {
    pub(super) mesh: Mesh,
    /// Written before it is shared; after that it is never changed.
    pub(super) state: Arc<KirchhoffState>,
}

/// What a sub-step starts from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) state: &'a KirchhoffState,
}

impl Configuration {
    /// Nothing inserted.
    pub(super) fn at(surroundings: &Surroundings<'_>, has_angles: bool) -> Self {
        Self { mesh: Mesh::withdrawn(), state: Arc::new(KirchhoffState::at(surroundings, has_angles)) }
    }

    /// The start of the next sub-step.
    pub(super) fn start(&self) -> Start<'_> {
        Start { mesh: &self.mesh, state: &self.state }
    }

    /// Ensures that the state is not shared, and allocates for up to `elements` elements and `points` contact points.
    pub(super) fn own(&mut self, elements: usize, points: usize) {
        self.mesh.reserve(elements, points);
        Arc::make_mut(&mut self.state).reserve(elements, points);
    }

    /// The mesh, and the state to write to.
    pub(super) fn parts(&mut self) -> (&mut Mesh, &mut KirchhoffState) {
        (&mut self.mesh, Arc::make_mut(&mut self.state))
    }

    /// All instruments are pulled back to the sheath's mouth; sets the hands.
    pub(super) fn withdraw(&mut self, stack: &Stack, hands: &[Hand]) {
        let (mesh, state) = self.parts();
        mesh.clear();
        state.withdraw(stack, hands);
    }
}

/// Numbers of elements and contact points of fully inserted devices: the maximum in a step.
pub(super) fn largest(stack: &Stack, fineness: Fineness) -> (usize, usize) {
    // All nodes of each: more than are ever on one line.
    let (mut elements, mut points) = (1, 0);
    let mut mesh = Mesh::default();
    for device in stack.devices() {
        mesh.build(device, device.length_mm(), fineness, 1.0);
        elements += mesh.elements.len() + 1;
        points += mesh.points.len();
    }
    // The first element may have more contact points than any other.
    (elements, points + super::mesh::MOST_POINTS)
}
