//! Energies of two points of the centre line on elements that are not neighbours.
//!
//! The points are Σ cᵢ qᵢ with q = (x₀, h t₀, x₁, h t₁) of each element, as in [`super::points`], and an energy of both is given by its
//! derivatives in the eight. Tangents turn on a sphere: at second order tᵢ moves by −½|δ|² tᵢ as well.

use nalgebra::Matrix3;

use super::assembly::Assembly;
use super::element::ElementData;
use super::layout::Layout;
use super::state::RodState;
use crate::Vec3;

/// What two points depend on: x₀, h t₀, x₁ and h t₁ of the first element, and of the second.
pub const PLACES: usize = 8;

/// Derivatives of an energy of two points.
#[derive(Debug, Clone, Copy)]
pub struct Couple {
    /// The element of the first point.
    pub first: usize,
    /// The element of the second point.
    pub second: usize,
    /// First derivatives.
    pub gradient: [Vec3; PLACES],
    /// Derivatives with which tangents turn: the first derivatives or, where forces are unknowns of their own, the
    /// values of these.
    pub carried: [Vec3; PLACES],
    /// Second derivatives, i ≤ j; the other entries are not read.
    pub hessian: [[Matrix3<f64>; PLACES]; PLACES],
}

/// A degree of freedom: its row, which of the eight vectors it moves, and in which direction.
type Way = (usize, usize, Vec3);

impl<const C: usize> Assembly<C> {
    /// Adds the energy of two points.
    pub(super) fn add_coupled(&mut self, elements: &[ElementData], state: &RodState, couple: &Couple) {
        let ways = ways::<C>(elements, state, couple);
        for (row, place, way) in &ways {
            self.residual[*row] += way.dot(&couple.gradient[*place]);
        }
        if !self.hessian {
            return;
        }
        for (k, (column, right, along)) in ways.iter().enumerate() {
            for (row, left, way) in &ways[..=k] {
                let value = way.dot(&(couple.hessian[*left][*right] * along));
                self.add_entry(*row, *column, value);
            }
        }
        let l = Layout::<C>;
        for (side, e) in couple.sides() {
            for (node, place) in [(e, 4 * side + 1), (e + 1, 4 * side + 3)] {
                let back = elements[e].length * couple.carried[place].dot(&state.frames[node].t);
                for row in [l.tangent(node), l.tangent(node) + 1] {
                    self.matrix.add(row, row, -back);
                }
            }
        }
    }

    /// Adds to an entry of the matrix, in or outside the band.
    fn add_entry(&mut self, i: usize, j: usize, value: f64) {
        let block = Layout::<C>::BLOCK;
        if (i / block).abs_diff(j / block) <= 1 {
            self.matrix.add(i, j, value);
        } else {
            self.couplings.add(i, j, value);
        }
    }
}

impl Couple {
    /// Zero energy, for a point on each of two elements.
    pub fn none([first, second]: [usize; 2]) -> Self {
        Self {
            first,
            second,
            gradient: [Vec3::zeros(); PLACES],
            carried: [Vec3::zeros(); PLACES],
            hessian: [[Matrix3::zeros(); PLACES]; PLACES],
        }
    }

    /// The two points, numbered, and their elements.
    fn sides(&self) -> impl Iterator<Item = (usize, usize)> {
        [self.first, self.second].into_iter().enumerate()
    }
}

/// The unknowns of both elements.
fn ways<const C: usize>(elements: &[ElementData], state: &RodState, couple: &Couple) -> [Way; 20] {
    let l = Layout::<C>;
    let mut ways = [(0, 0, Vec3::zeros()); 20];
    let mut count = 0;
    let mut put = |way: Way| {
        ways[count] = way;
        count += 1;
    };
    for (side, e) in couple.sides() {
        let h = elements[e].length;
        for (end, node) in [e, e + 1].into_iter().enumerate() {
            let place = 4 * side + 2 * end;
            for (a, axis) in [Vec3::x(), Vec3::y(), Vec3::z()].into_iter().enumerate() {
                put((l.position(node) + a, place, axis));
            }
            let frame = &state.frames[node];
            put((l.tangent(node), place + 1, frame.u * h));
            put((l.tangent(node) + 1, place + 1, frame.v * h));
        }
    }
    ways
}
