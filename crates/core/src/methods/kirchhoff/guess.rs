//! Where a sub-step looks for the next equilibrium first.
//!
//! The device slid along its own curve is the plain guess. Where the hand repeats its motion, what the last step changed on it is
//! repeated too ([`Correction`]).

use super::configuration::Start;
use super::extrapolation::Correction;
use super::mesh::Mesh;
use crate::contact::{HandMotion, SelfContact, WallContact};
use crate::rod::RodState;

/// The candidates.
#[derive(Debug, Clone, Default)]
pub(super) struct Guess {
    /// What each hand does in the sub-step.
    pub(super) motions: Vec<HandMotion>,
    /// What was learnt, on the nodes of the sub-step.
    learnt: Correction,
    slid: RodState,
    pub(super) other: RodState,
    /// The room that each node has where the device is predicted, mm.
    pub(super) room_mm: Vec<f64>,
}

impl Guess {
    /// Takes memory for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.slid.reserve(elements);
        self.other.reserve(elements);
        self.room_mm.reserve((elements + 1).saturating_sub(self.room_mm.len()));
    }

    /// Replaces the slid device in `state` by one that repeats what was learnt, unless that is beyond the wall or has gone through itself. Returns whether what it is
    /// now is not.
    pub(super) fn choose(
        &mut self,
        contact: &mut WallContact<'_>,
        mut loops: Option<&mut SelfContact>,
        (start, mesh, state): (Start<'_>, &Mesh, &mut RodState),
    ) -> bool {
        self.slid.copy_from(state);
        let elements = &mesh.elements;
        let line = &elements[..mesh.line()];
        let correction = &start.state.correction;
        if let Some(factor) = correction.repeats(&self.motions) {
            // Nodes of a device alone are the same marks in every step.
            if mesh.inserted_mm.is_empty() {
                correction.apply(factor, line, state);
            } else {
                correction.transfer(start.mesh, mesh, &mut self.learnt);
                self.learnt.apply(factor, line, state);
            }
            let mut crosses =
                || loops.as_deref_mut().is_some_and(|loops| loops.crosses(elements, &self.slid, state));
            if !contact.is_outside(elements, state) && !crosses() {
                return true;
            }
            state.copy_from(&self.slid);
        }
        !contact.is_outside(elements, state)
    }

    /// Goes on from where a solution has come to: `state`, which is the slid device, becomes that.
    pub(super) fn resume(&mut self, under_way: &RodState, state: &mut RodState) {
        self.slid.copy_from(state);
        state.copy_from(under_way);
    }

    /// What an equilibrium that was found teaches.
    pub(super) fn teach(&self, found: &RodState, correction: &mut Correction) {
        correction.learn(&self.motions, &self.slid, found);
    }
}
