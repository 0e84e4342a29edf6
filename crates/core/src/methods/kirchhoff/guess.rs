//! The prediction of the next equilibrium in a sub-step.
//!
//! The simple prediction is the device slid along its own curve. If the hand repeats its motion, the correction of
//! the last step is added ([`Correction`]).

use super::configuration::Start;
use super::extrapolation::Correction;
use super::mesh::Mesh;
use crate::contact::{HandMotion, SelfContact, WallContact};
use crate::rod::RodState;

/// The candidates for the prediction.
#[derive(Debug, Clone, Default)]
pub(super) struct Guess {
    /// What each hand does in the sub-step.
    pub(super) motions: Vec<HandMotion>,
    /// The correction, on the nodes of the sub-step.
    learnt: Correction,
    pub(super) slid: RodState,
    pub(super) other: RodState,
    /// The room of each node at the prediction, mm.
    pub(super) room_mm: Vec<f64>,
}

impl Guess {
    /// Allocates for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.slid.reserve(elements);
        self.other.reserve(elements);
        self.room_mm.reserve((elements + 1).saturating_sub(self.room_mm.len()));
    }

    /// Adds the correction to the slid device in `state`, unless the result is beyond the wall or passes through
    /// itself. Returns whether the prediction is valid.
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
            // Nodes of a single device are the same marks in every step.
            if mesh.inserted_mm.is_empty() {
                correction.apply(factor, line, state);
            } else {
                correction.transfer(start.mesh, mesh, &mut self.learnt);
                self.learnt.apply(factor, line, state);
            }
            if contact.rubs() {
                state.measure_from(&self.slid.frames[..=line.len()]);
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

    /// Continues from an unfinished solution: replaces `state`, the slid device, by that.
    pub(super) fn resume(&mut self, under_way: &RodState, state: &mut RodState) {
        self.slid.copy_from(state);
        state.copy_from(under_way);
    }

    /// Stores the correction of an equilibrium.
    pub(super) fn teach(&self, found: &RodState, correction: &mut Correction) {
        correction.learn(&self.motions, &self.slid, found);
    }
}
