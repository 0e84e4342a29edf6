//! Derivatives of what a command leads to.

use crate::methods::{Command, Parameter, StepReport, Surroundings};
use crate::shape::Shape;
use crate::{Result, Vec3};

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

/// Derivatives in one parameter, per unit of it, or along a change of several.
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
    /// Of the whole stored energy, mJ.
    pub energy_mj: f64,
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

/// What a command has led to.
#[derive(Debug, Clone)]
pub struct Passed {
    /// Its report.
    pub report: StepReport,
    /// The centre line after it.
    pub shape: Shape,
    /// How far the next change of a contact is.
    pub margin: Margin,
}

/// Weights of what a command leads to, in the sum of which a derivative is; those of an empty list are 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Weights {
    /// Of the coordinates of the tip, per mm.
    pub tip_mm: Vec3,
    /// Of the nodes of the shape, per mm.
    pub positions_mm: Vec<Vec3>,
    /// Of the push force of each hand, per N.
    pub push_force_n: Vec<f64>,
    /// Of the torque of each hand, per N·mm.
    pub torque_nmm: Vec<f64>,
    /// Of the whole stored energy, per mJ.
    pub energy_mj: f64,
    /// Of the normal forces of the contacts of the report, per N.
    pub contact_forces_n: Vec<f64>,
}

/// Derivatives of a sum of what commands lead to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pulled {
    /// By each parameter, per unit of it.
    pub by: Vec<f64>,
    /// Whether each is that on one side only, where the mesh or a contact changes.
    pub one_sided: Vec<bool>,
    /// By the motion of each instrument's hand in each command, per mm, rad and unit of steering, where that was asked for.
    pub hands: Vec<Vec<Command>>,
}

/// Commands that a method has recorded, to be differentiated backwards.
pub trait Tape: Send + Sync {
    /// What they led to, one after the other.
    fn passed(&self) -> &[Passed];

    /// Derivatives of the sum with the weights of each command by parameters, and by the hands in each command if that is asked for, in the
    /// surroundings of the first command.
    ///
    /// # Errors
    /// A parameter that does not exist, and weights of another number.
    fn pull(&self, first: &Surroundings<'_>, weights: &[Weights], by: (&[Parameter], bool))
    -> Result<Pulled>;

    /// Derivatives of what each command leads to, one along each change of parameters together, each so much.
    ///
    /// # Errors
    /// A parameter that does not exist, no change, and a result that has no derivative.
    fn push(&self, first: &Surroundings<'_>, along: &[Vec<(Parameter, f64)>]) -> Result<Vec<Vec<Slope>>>;

    /// What each command leads to where a parameter is larger by so much, solved anew at the same contacts and in the same parts.
    #[cfg(test)]
    fn solved(&self, first: &Surroundings<'_>, by: (Parameter, f64)) -> Result<Vec<Vec<f64>>>;
}
