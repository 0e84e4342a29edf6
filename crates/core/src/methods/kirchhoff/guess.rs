//! Where a sub-step looks for the next equilibrium first.
//!
//! The device slid along its own curve is the plain guess. Where the hand repeats its motion, what the last step changed on it is
//! repeated too ([`Correction`]).

use super::configuration::Start;
use super::extrapolation::Correction;
use super::mesh::Mesh;
use crate::contact::{HandMotion, WallContact};
use crate::rod::{ElementData, RodState};

/// How good a guess is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quality {
    /// It repeats what the last step has taught.
    Learnt,
    /// It follows the last equilibrium.
    Near,
    /// It is beyond the wall.
    Beyond,
}

/// The candidates.
#[derive(Debug, Clone, Default)]
pub(super) struct Guess {
    /// What each hand does in the sub-step.
    pub(super) motions: Vec<HandMotion>,
    /// What was learnt, on the nodes of the sub-step.
    learnt: Correction,
    slid: RodState,
    pub(super) other: RodState,
}

impl Guess {
    /// Takes memory for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.slid.reserve(elements);
        self.other.reserve(elements);
    }

    /// Replaces the slid device in `state` by one that repeats what was learnt, unless that is beyond the wall.
    pub(super) fn choose(
        &mut self,
        contact: &mut WallContact<'_>,
        (start, mesh, state): (Start<'_>, &Mesh, &mut RodState),
    ) -> Quality {
        self.slid.copy_from(state);
        let elements = &mesh.elements;
        let correction = &start.state.correction;
        if let Some(factor) = correction.repeats(&self.motions) {
            // Nodes of a device alone are the same marks in every step.
            if mesh.inserted_mm.is_empty() {
                correction.apply(factor, elements, state);
            } else {
                correction.transfer(start.mesh, mesh, &mut self.learnt);
                self.learnt.apply(factor, elements, state);
            }
            if !contact.is_outside(elements, state) {
                return Quality::Learnt;
            }
            state.copy_from(&self.slid);
        }
        if contact.is_outside(elements, state) { Quality::Beyond } else { Quality::Near }
    }

    /// Goes back to the slid device.
    pub(super) fn plain(&self, state: &mut RodState) {
        state.copy_from(&self.slid);
    }

    /// What an equilibrium that was found teaches, of `hooks` too, after what was learnt `before`.
    pub(super) fn teach(
        &self,
        elements: &[ElementData],
        found: &RodState,
        hooks: bool,
        (before, correction): (&Correction, &mut Correction),
    ) {
        correction.learn(&self.motions, elements, (&self.slid, found), hooks, before);
    }
}
