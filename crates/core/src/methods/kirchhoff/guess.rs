//! The prediction of the next equilibrium in a sub-step.
//!
//! The simple prediction is the device slid along its own curve. If the hand repeats its motion, the correction of
//! the last step is added ([`Correction`]).

use super::configuration::Start;
use super::extrapolation::Correction;
use super::mesh::Mesh;
use crate::contact::{HandMotion, SelfContact, WallContact};
use crate::rod::{Frame, RodState};

/// The candidates for the prediction.
#[derive(Debug, Clone, Default)]
pub(super) struct Guess {
    /// What each hand does in the sub-step.
    pub(super) motions: Vec<HandMotion>,
    /// The correction, on the nodes of the sub-step.
    learnt: Correction,
    slid: RodState,
    /// Triads of the device slid in the vessel as it was, if the vessel moves; else empty.
    pub(super) before_motion: Vec<Frame>,
    pub(super) other: RodState,
    /// The room of each node at the prediction, mm.
    pub(super) room_mm: Vec<f64>,
}

impl Guess {
    /// Allocates for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.slid.reserve(elements);
        self.before_motion.reserve((elements + 1).saturating_sub(self.before_motion.len()));
        self.other.reserve(elements);
        self.room_mm.reserve((elements + 1).saturating_sub(self.room_mm.len()));
    }

    /// If `repeats`, adds the correction to the slid device in `state`, unless the result is beyond the wall or passes through
    /// itself. With friction, angles are then measured from the triads of the device where its slip begins. Returns
    /// whether the prediction is valid.
    pub(super) fn choose(
        &mut self,
        contact: &mut WallContact<'_>,
        loops: Option<&mut SelfContact>,
        (start, mesh, state): (Start<'_>, &Mesh, &mut RodState),
        repeats: bool,
    ) -> bool {
        self.slid.copy_from(state);
        let corrected = repeats && self.correct(contact, loops, (start, mesh, &mut *state));
        if contact.has_friction() {
            if !self.before_motion.is_empty() {
                state.measure_from(&self.before_motion);
            } else if corrected {
                state.measure_from(&self.slid.frames[..=mesh.line()]);
            }
        }
        corrected || !contact.is_outside(&mesh.elements, state)
    }

    /// Adds the correction to the slid device in `state`, or leaves it as it is; returns whether it did.
    fn correct(
        &mut self,
        contact: &mut WallContact<'_>,
        loops: Option<&mut SelfContact>,
        (start, mesh, state): (Start<'_>, &Mesh, &mut RodState),
    ) -> bool {
        let elements = &mesh.elements;
        let line = &elements[..mesh.line()];
        let correction = &start.state.correction;
        let Some(factor) = correction.repeats(&self.motions) else { return false };
        // Nodes of a single device are the same marks in every step.
        if mesh.inserted_mm.len() == 1 {
            correction.apply(factor, line, state);
        } else {
            correction.transfer(start.mesh, mesh, &mut self.learnt);
            self.learnt.apply(factor, line, state);
        }
        let wrong = contact.is_outside(elements, state)
            || loops.is_some_and(|loops| loops.crosses(elements, &self.slid, state));
        if wrong {
            state.copy_from(&self.slid);
        }
        !wrong
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
