//! The interface by which external energies add values and derivatives, in terms of what they depend on; only the
//! assembly knows which unknowns these are and how many a node has.

use nalgebra::Matrix3;

use super::couples::{Couple, Link};
use super::element::ElementData;
use super::points::PointSum;
use super::state::RodState;
use crate::Vec3;

/// Three unknowns of a node that are addressed together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Triple {
    /// The position of the node.
    Position,
    /// Rotations of the tangent along u and v of its triad, and the material angle.
    Turn,
}

/// A sum of energies, each given by value, gradient and Hessian in a few unknowns. Gradients are minus the forces on
/// the rod. Terms in a material angle are dropped where the rod has none.
pub(crate) trait Stencils {
    /// Whether Hessians are wanted beside gradients; if not, they are ignored.
    fn wants_hessian(&self) -> bool;

    /// Adds to the value of the energy.
    fn add_value(&mut self, energy: f64);

    /// Adds derivatives in the position of node `i`.
    fn add_node(&mut self, i: usize, gradient: &Vec3, hessian: &Matrix3<f64>);

    /// Adds derivatives in the rotation of node `i`: of its tangent along u and v of its triad, and about it.
    fn add_turn(&mut self, i: usize, gradient: &Vec3, hessian: &Matrix3<f64>);

    /// Adds the summed derivatives in the positions of points of element `e`.
    fn add_points(&mut self, state: &RodState, element: &ElementData, e: usize, sum: &PointSum);

    /// Adds derivatives in the positions of two points on elements that are not neighbours.
    fn add_couple(&mut self, elements: &[ElementData], state: &RodState, couple: &Couple);

    /// Adds a linear spring between two points on elements that are not neighbours.
    fn add_link(&mut self, elements: &[ElementData], state: &RodState, link: &Link);

    /// Adds the derivatives in the material angle of the energy of a point (element, ξ and set of angles): the first
    /// and second `spin` derivatives in the angle, and the `mixed` one in angle and position.
    fn add_spin(
        &mut self,
        state: &RodState,
        element: &ElementData,
        point: (usize, f64, usize),
        mixed: &Vec3,
        spin: (f64, f64),
    );

    /// Adds the first and second derivative in the difference of two material angles of node `i`: first set minus
    /// second.
    fn add_turning(&mut self, i: usize, sets: (usize, usize), derivatives: (f64, f64));

    /// Adds p qᵀ to the matrix alone, p in the `rows` and q in the `columns` of node `i`: the non-conservative part
    /// of the stiffness of follower loads.
    fn add_rank_one(&mut self, i: usize, rows: (Triple, [f64; 3]), columns: (Triple, [f64; 3]));
}
