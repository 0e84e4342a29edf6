//! Where energies outside the rod put their values and derivatives, by what they depend on; which unknowns those are, and how many a
//! node has, the assembly knows.

use nalgebra::Matrix3;

use super::couples::Couple;
use super::element::ElementData;
use super::points::PointSum;
use super::state::RodState;
use crate::Vec3;

/// Three unknowns of a node that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Triple {
    /// Its position.
    Position,
    /// Turns of its tangent along u and v of its triad, and its material angle.
    Turn,
}

/// A sum of energies, each given by value, gradient and Hessian in a few unknowns. Gradients are forces on the rod with the sign changed.
/// What hangs on a material angle is left out where the rod carries none.
pub trait Stencils {
    /// Whether Hessians are wanted beside gradients; where not, they are left out whatever is given.
    fn wants_hessian(&self) -> bool;

    /// Adds to the value of the energy.
    fn add_value(&mut self, energy: f64);

    /// Adds derivatives in the position of node `i`.
    fn add_node(&mut self, i: usize, gradient: &Vec3, hessian: &Matrix3<f64>);

    /// Adds derivatives in the turn of node `i`: of its tangent along u and v of its triad, and about it.
    fn add_turn(&mut self, i: usize, gradient: &Vec3, hessian: &Matrix3<f64>);

    /// Adds derivatives in the positions of points of element `e`, gathered.
    fn add_points(&mut self, state: &RodState, element: &ElementData, e: usize, sum: &PointSum);

    /// Adds derivatives in the positions of two points of elements that are no neighbours.
    fn add_couple(&mut self, elements: &[ElementData], state: &RodState, couple: &Couple);

    /// Adds those derivatives of the energy of a point (element, ξ and set of angles) that see the material angle there: the first and
    /// second `spin` derivatives in the angle, and the `mixed` one in angle and position.
    fn add_spin(
        &mut self,
        state: &RodState,
        element: &ElementData,
        point: (usize, f64, usize),
        mixed: &Vec3,
        spin: (f64, f64),
    );

    /// Adds first and second derivative in the difference of two material angles of node `i`, that of the first set less that of the second.
    fn add_turning(&mut self, i: usize, sets: (usize, usize), derivatives: (f64, f64));

    /// Adds p qᵀ to the matrix alone, p in the `rows` and q in the `columns` of node `i`: the part of the stiffness of loads that follow
    /// the rod that no energy has.
    fn add_rank_one(&mut self, i: usize, rows: (Triple, [f64; 3]), columns: (Triple, [f64; 3]));
}
