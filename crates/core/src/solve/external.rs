//! Energies outside the rod, as Newton's method asks for them.

use crate::rod::{Assembly, ElementData, RodState};

/// Energies outside the rod: loads, walls.
pub trait External<const C: usize> {
    /// Potential energy at a state.
    fn energy(&mut self, elements: &[ElementData], state: &RodState) -> f64;
    /// Adds gradient, Hessian and energy at a state to the assembly.
    fn add(&mut self, elements: &[ElementData], state: &RodState, assembly: &mut Assembly<C>);
    /// Work done on the way between two states by loads that have no potential.
    fn work(&self, _from: &RodState, _to: &RodState) -> f64 {
        0.0
    }
    /// Whether all of it has a potential. Where not, the stiffness is unsymmetric and there are no minima to look for.
    fn conservative(&self) -> bool {
        true
    }
    /// Whether it can stop a step short, as a wall does.
    fn obstructs(&self) -> bool {
        false
    }
    /// Whether its energy hangs on the state alone, not on what [`External::add`] was given before.
    fn memoryless(&self) -> bool {
        false
    }
    /// Part of the way from the state last given to [`External::add`] to `to` that crosses nothing.
    fn safe_fraction(&mut self, _elements: &[ElementData], _to: &RodState) -> f64 {
        1.0
    }
    /// What rounding of positions leaves of its forces at a node.
    fn rounding(&self) -> f64 {
        0.0
    }
    /// Size of the forces and moments it exerts, for the scale of the residual.
    fn scale(&self) -> [f64; 2] {
        [0.0; 2]
    }
}
