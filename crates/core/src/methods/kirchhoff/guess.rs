//! Where a sub-step looks for the next equilibrium first.
//!
//! The device slid along its own curve is the plain guess. Where the hand repeats its motion, what the last step changed on it is
//! repeated too ([`Correction`]); a tip with a shape of its own may instead be carried by the device behind it.

use super::configuration::Start;
use super::extrapolation::Correction;
use super::mesh::Mesh;
use super::transport::carry;
use crate::contact::{HandMotion, WallContact};
use crate::rod::{ElementData, RodState};
use crate::solve::Newton;

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

/// The candidates. By default those of several instruments, whose tips are carried by nothing.
#[derive(Debug, Clone, Default)]
pub(super) struct Guess {
    /// Length from the tip within which the device has a shape of its own, mm.
    pub(super) shaped_mm: f64,
    /// What each hand does in the sub-step.
    pub(super) motions: Vec<HandMotion>,
    /// What was learnt, on the nodes of the sub-step.
    learnt: Correction,
    slid: RodState,
    pub(super) other: RodState,
}

impl Guess {
    /// For a device alone with a shape of its own within `shaped_mm` of its tip.
    pub(super) fn new(shaped_mm: f64) -> Self {
        Self { shaped_mm, ..Self::default() }
    }

    /// Takes memory for `elements` elements.
    pub(super) fn reserve(&mut self, elements: usize) {
        self.slid.reserve(elements);
        self.other.reserve(elements);
    }

    /// Replaces the slid device in `state` by the best candidate. Where the tip's way is `blocked`, the one that carries the tip's
    /// shape comes first.
    pub(super) fn choose<const C: usize>(
        &mut self,
        newton: &Newton<C>,
        contact: &mut WallContact<'_>,
        (start, mesh, state): (Start<'_>, &Mesh, &mut RodState),
        blocked: bool,
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
        let outside = contact.is_outside(elements, state);
        if self.shaped_mm > 0.0 {
            self.other.copy_from(state);
            carry(
                (start.mesh, &start.state.rod),
                mesh,
                self.shaped_mm,
                self.motions[0].turn_rad,
                &mut self.other,
            );
            if !contact.is_outside(elements, &self.other)
                && (outside
                    || blocked
                    || newton.energy_at(elements, contact, &self.other)
                        < newton.energy_at(elements, contact, state))
            {
                std::mem::swap(state, &mut self.other);
                return Quality::Near;
            }
        }
        if outside { Quality::Beyond } else { Quality::Near }
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
