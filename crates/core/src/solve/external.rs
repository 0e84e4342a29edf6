//! Energies outside the rod, as Newton's method asks for them.

use crate::Vec3;
use crate::rod::{ElementData, RodState, Stencils};

/// What a step does to the point at ξ of an element, on the instrument in a set of angles: how far it moves it, mm, and turns it, rad.
pub type Moved<'a> = dyn Fn((usize, f64, usize)) -> (Vec3, f64) + 'a;

/// An energy outside the rod: loads, walls, or several of them together. It says where it acts in terms of the rod
/// ([`Stencils`]) and knows nothing of unknowns.
///
/// Newton's method asks in this order:
///
/// 1. [`linearise`](External::linearise) at a state, which is the *base* from then on, until the next one is linearised.
/// 2. [`safe_fraction`](External::safe_fraction) of the way from the base to a trial.
/// 3. [`value`](External::value) at that trial; as often as it takes, trials being nearer and nearer to the base.
/// 4. [`linearise`](External::linearise) at the trial that was taken.
///
/// Where something in the energy is lagged, as the normal forces are that friction follows, it is renewed when a base is linearised and at
/// no other time, so that one step lowers one energy.
pub trait External {
    /// Adds value, gradient and Hessian at a state, which becomes the base.
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils);

    /// Potential energy at a state, with what is lagged as it was at the base.
    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64;

    /// Part of the straight way from the base to `to` that crosses nothing.
    fn safe_fraction(&mut self, _elements: &[ElementData], _to: &RodState) -> f64 {
        1.0
    }

    /// Notes what a step from the base does to contacts, to first order. Returns whether there are any: a trial may then [`stray`](External::stray).
    fn foresee(&mut self, _moved: &Moved<'_>) -> bool {
        false
    }

    /// Notes the contacts into which a trial, the second of two states and `part` of the step from the first, the base, has run, by the plane in which each has met the wall.
    /// Returns whether there are any that were not foreseen.
    fn meet(
        &mut self,
        _elements: &[ElementData],
        _states: (&RodState, &RodState),
        _part: f64,
        _moved: &Moved<'_>,
    ) -> bool {
        false
    }

    /// Foresees what another step does to the contacts known, and adds the springs of those that it leads to and takes away those that it
    /// leads out of. Returns how many were changed.
    fn press_or_let_go(
        &mut self,
        _elements: &[ElementData],
        _base: &RodState,
        _moved: &Moved<'_>,
        _into: &mut dyn Stencils,
    ) -> usize {
        0
    }

    /// Part of the way from the step foreseen last to another, which solves the system as it is, at which the model has its minimum: of the
    /// energy with springs where contacts press and none where they would pull, and friction. It is `most` at the most.
    fn part_towards(&mut self, _moved: &Moved<'_>, most: f64) -> f64 {
        most
    }

    /// Adds the springs again of contacts that press at the base and were let go, for good, and has friction be stiffer. Returns at how many
    /// points.
    fn hold_on(&mut self, _elements: &[ElementData], _base: &RodState, _into: &mut dyn Stencils) -> usize {
        0
    }

    /// Nothing is foreseen any more: the step that was is not taken.
    fn forget(&mut self) {}

    /// Adds the forces, as a gradient at the base, the first of two states, by which contacts at a trial, the second, `part` of the step
    /// from there, are off what was foreseen. Returns their size over that of the forces foreseen.
    fn stray(
        &mut self,
        _elements: &[ElementData],
        _states: (&RodState, &RodState),
        _part: f64,
        _into: &mut dyn Stencils,
    ) -> f64 {
        0.0
    }

    /// Whether it rises so steeply within a step that a trial may have to be looked for between one that was taken and one that was
    /// refused, as a wall does.
    fn is_steep(&self) -> bool {
        false
    }

    /// Whether all of it has a potential. Where not, the stiffness is unsymmetric and there are no minima to look for.
    fn is_conservative(&self) -> bool {
        true
    }

    /// Work done on the way between two states by loads that have no potential.
    fn work(&self, _from: &RodState, _to: &RodState) -> f64 {
        0.0
    }

    /// What rounding of positions leaves of its forces at a node, at the base.
    fn rounding(&self) -> f64 {
        0.0
    }

    /// Size of the forces and moments it exerts, for the scale of the residual.
    fn scale(&self) -> [f64; 2] {
        [0.0; 2]
    }
}
