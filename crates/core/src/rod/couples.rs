//! Energies of two points of the centre line on elements that are not neighbours.
//!
//! The points are Σ cᵢ qᵢ with q = (x₀, h t₀, x₁, h t₁) of each element, as in [`super::points`], and an energy of both is given by its
//! derivatives in the eight. Tangents turn on a sphere: at second order tᵢ moves by −½|δ|² tᵢ as well.

use nalgebra::{Matrix3, Matrix3x2, SMatrix};

use super::assembly::Assembly;
use super::element::ElementData;
use super::layout::Layout;
use super::state::RodState;
use crate::Vec3;

/// What two points depend on: x₀, h t₀, x₁ and h t₁ of the first element, and of the second.
pub(crate) const PLACES: usize = 8;

/// Derivatives of an energy of two points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Couple {
    /// The element of the first point.
    pub(crate) first: usize,
    /// The element of the second point.
    pub(crate) second: usize,
    /// First derivatives.
    pub(crate) gradient: [Vec3; PLACES],
    /// Derivatives with which tangents turn: the first derivatives or, where forces are unknowns of their own, the
    /// values of these.
    pub(crate) carried: [Vec3; PLACES],
    /// Second derivatives, i ≤ j; the other entries are not read.
    pub(crate) hessian: [[Matrix3<f64>; PLACES]; PLACES],
}

/// A spring that is linear in the unknowns, between two points of the centre line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Link {
    /// The elements of both points.
    pub(crate) elements: [usize; 2],
    /// Weights of the eight in the difference of the points, first minus second.
    pub(crate) weights: [f64; PLACES],
    /// First derivative in that difference.
    pub(crate) gradient: Vec3,
    /// Second derivative in it.
    pub(crate) hessian: Matrix3<f64>,
}

/// Unknowns of a node on which a point depends: its position, and the rotation of its tangent along u and v.
const OWN: usize = 5;

/// A node on which one of two points depends.
struct End {
    node: usize,
    /// Which of the eight vectors is its position; the next one is its tangent.
    place: usize,
    /// What that tangent moves by as it turns along u and v of the node's triad: h u, h v.
    turns: Matrix3x2<f64>,
    /// h t.
    tangent: Vec3,
}

impl<const C: usize> Assembly<C> {
    /// Adds the energy of two points.
    pub(super) fn add_coupled(&mut self, elements: &[ElementData], state: &RodState, couple: &Couple) {
        let l = Layout::<C>;
        let ends = ends([couple.first, couple.second], elements, state);
        for End { node, place, turns, .. } in &ends {
            let (force, turning) = (couple.gradient[*place], turns.tr_mul(&couple.gradient[place + 1]));
            (0..3).for_each(|a| self.residual[l.position(*node) + a] += force[a]);
            (0..2).for_each(|a| self.residual[l.tangent(*node) + a] += turning[a]);
        }
        if !self.hessian {
            return;
        }
        for (k, one) in ends.iter().enumerate() {
            self.add_own(one, couple);
            for other in &ends[k + 1..] {
                self.add_between(one.node, other.node, &couple.between(one, other));
            }
        }
    }

    /// Adds a linear spring between two points.
    pub(super) fn add_linked(&mut self, elements: &[ElementData], state: &RodState, link: &Link) {
        let l = Layout::<C>;
        // What the difference changes by with the unknowns of each node.
        let ends = ends(link.elements, elements, state).map(|End { node, place, turns, .. }| {
            let mut ways = SMatrix::<f64, 3, OWN>::zeros();
            ways.fixed_columns_mut::<3>(0).fill_diagonal(link.weights[place]);
            ways.fixed_columns_mut::<2>(3).copy_from(&(turns * link.weights[place + 1]));
            (node, ways)
        });
        for (k, (node, ways)) in ends.iter().enumerate() {
            let force = ways.tr_mul(&link.gradient);
            let first = l.position(*node);
            (0..OWN).for_each(|a| self.residual[first + a] += force[a]);
            if !self.hessian {
                continue;
            }
            let stiff = link.hessian * ways;
            for (m, (other, others)) in ends.iter().enumerate().skip(k) {
                let block = others.tr_mul(&stiff);
                let block = std::array::from_fn(|a| std::array::from_fn(|b| block[(b, a)]));
                if m == k {
                    self.add_on_diagonal(*node, &block);
                } else {
                    self.add_between(*node, *other, &block);
                }
            }
        }
    }

    /// Adds the derivatives in the unknowns of one node.
    fn add_own(&mut self, end: &End, couple: &Couple) {
        let l = Layout::<C>;
        self.add_on_diagonal(end.node, &couple.between(end, end));
        let back = couple.carried[end.place + 1].dot(&end.tangent);
        for row in [l.tangent(end.node), l.tangent(end.node) + 1] {
            self.matrix.add(row, row, -back);
        }
    }

    /// Adds a symmetric block of the unknowns of one node.
    fn add_on_diagonal(&mut self, node: usize, block: &[[f64; OWN]; OWN]) {
        let rows = own_rows::<C>(node);
        for a in 0..OWN {
            for b in a..OWN {
                self.matrix.add(rows[a], rows[b], block[a][b]);
            }
        }
    }

    /// Adds the derivatives in the unknowns of one node and of another, in or outside the band.
    fn add_between(&mut self, one: usize, other: usize, block: &[[f64; OWN]; OWN]) {
        if one.abs_diff(other) > 1 {
            let first = Layout::<C>.position(0);
            return self.couplings.add_block((one, other), first, block);
        }
        let (rows, columns) = (own_rows::<C>(one), own_rows::<C>(other));
        for (row, values) in rows.iter().zip(block) {
            for (column, value) in columns.iter().zip(values) {
                self.matrix.add(*row, *column, *value);
            }
        }
    }
}

/// The nodes on which points of two elements depend.
fn ends(of: [usize; 2], elements: &[ElementData], state: &RodState) -> [End; 4] {
    [0, 1, 2, 3].map(|k| {
        let element = of[k / 2];
        let node = element + k % 2;
        let (frame, h) = (&state.frames[node], elements[element].length);
        let turns = Matrix3x2::from_columns(&[frame.u * h, frame.v * h]);
        End { node, place: 2 * k, turns, tangent: frame.t * h }
    })
}

/// The rows of a node's position and tangent.
fn own_rows<const C: usize>(node: usize) -> [usize; OWN] {
    let first = Layout::<C>.position(node);
    [0, 1, 2, 3, 4].map(|a| first + a)
}

impl Couple {
    /// Zero energy, for a point on each of two elements.
    pub(crate) fn none([first, second]: [usize; 2]) -> Self {
        Self {
            first,
            second,
            gradient: [Vec3::zeros(); PLACES],
            carried: [Vec3::zeros(); PLACES],
            hessian: [[Matrix3::zeros(); PLACES]; PLACES],
        }
    }

    /// Second derivatives in the unknowns of one end and of the same or a later one.
    fn between(&self, one: &End, other: &End) -> [[f64; OWN]; OWN] {
        let (i, j) = (one.place, other.place);
        let turned = self.hessian[i][j + 1] * other.turns;
        // Of one end alone the derivative in tangent and position stands above the diagonal.
        let across = if i == j { turned.transpose() } else { one.turns.tr_mul(&self.hessian[i + 1][j]) };
        let both = one.turns.tr_mul(&(self.hessian[i + 1][j + 1] * other.turns));
        let mut block = [[0.0; OWN]; OWN];
        for a in 0..3 {
            for b in 0..3 {
                block[a][b] = self.hessian[i][j][(a, b)];
            }
            for b in 0..2 {
                block[a][3 + b] = turned[(a, b)];
                block[3 + b][a] = across[(b, a)];
            }
        }
        for a in 0..2 {
            for b in 0..2 {
                block[3 + a][3 + b] = both[(a, b)];
            }
        }
        block
    }
}
