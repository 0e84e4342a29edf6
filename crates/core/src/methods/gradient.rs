//! Derivatives of what a command leads to.

use crate::Vec3;
use crate::methods::{Energy, StepReport};
use crate::shape::Shape;

/// Derivatives of what a command leads to, from a state that is given.
///
/// Contacts keep their status: those that press go on pressing, and each sticks or slips as far as friction lets it. What
/// would be needed for another status is the [`Margin`].
#[derive(Debug, Clone)]
pub struct Gradient {
    /// The report of the command.
    pub report: StepReport,
    /// The centre line after it.
    pub shape: Shape,
    /// One for each parameter, in their order.
    pub slopes: Vec<Slope>,
    /// How far the next change of a contact is.
    pub margin: Margin,
}

/// Derivatives in one parameter, per unit of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Slope {
    /// Of the tip, mm.
    pub tip_mm: Vec3,
    /// Of the nodes of the [`Gradient::shape`], mm. All but the first are marks on the device and move with it.
    pub positions_mm: Vec<Vec3>,
    /// Of the push force of each hand, N; `None` where it jumps.
    pub push_force_n: Vec<Option<f64>>,
    /// Of the torque of each hand, N·mm.
    pub torque_nmm: Vec<f64>,
    /// Of the energy terms, mJ.
    pub energy: Energy,
    /// Of the normal forces of the contacts of the [`Gradient::report`], N. Empty if a contact opens or closes right there.
    pub contact_forces_n: Vec<f64>,
    /// Whether it is the slope on one side only: right there a contact opens or closes, or a node of the mesh comes in.
    pub one_sided: bool,
}

/// Distance to the next change of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Margin {
    /// The least force of a contact that presses, N: it opens without it. Infinite without contacts.
    pub least_force_n: f64,
    /// At least so far are points from the wall that do not touch it, mm. Infinite without any.
    pub least_gap_mm: f64,
}
