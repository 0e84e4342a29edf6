//! Scatters the stencils of external energies into the assembly.

use nalgebra::Matrix3;

use super::assembly::{Assembly, RankOne};
use super::couples::{Couple, Link};
use super::element::ElementData;
use super::layout::Layout;
use super::points::PointSum;
use super::quadrature::{Point, hermite};
use super::state::RodState;
use super::stencils::{Stencils, Triple};
use crate::Vec3;

impl<const C: usize> Stencils for Assembly<C> {
    fn wants_hessian(&self) -> bool {
        self.hessian
    }

    fn add_value(&mut self, energy: f64) {
        self.external_energy += energy;
    }

    fn add_node(&mut self, i: usize, gradient: &Vec3, hessian: &Matrix3<f64>) {
        self.add_three(Layout::<C>.position(i), 3, gradient, hessian);
    }

    fn add_turn(&mut self, i: usize, gradient: &Vec3, hessian: &Matrix3<f64>) {
        let count = if Layout::<C>::ANGLES > 0 { 3 } else { 2 };
        self.add_three(Layout::<C>.tangent(i), count, gradient, hessian);
    }

    fn add_points(&mut self, state: &RodState, element: &ElementData, e: usize, sum: &PointSum) {
        self.add_gathered(state, element, e, sum);
    }

    fn add_couple(&mut self, elements: &[ElementData], state: &RodState, couple: &Couple) {
        self.add_coupled(elements, state, couple);
    }

    fn add_link(&mut self, elements: &[ElementData], state: &RodState, link: &Link) {
        self.add_linked(elements, state, link);
    }

    fn add_spin(
        &mut self,
        state: &RodState,
        element: &ElementData,
        (e, xi, set): (usize, f64, usize),
        mixed: &Vec3,
        (first, second): (f64, f64),
    ) {
        if Layout::<C>::ANGLES == 0 {
            return;
        }
        let angles = angle_weights::<C>((e, xi, set));
        let columns = point_columns::<C>(state, element, e, xi);
        for (i, &(row, p)) in angles.iter().enumerate() {
            self.residual[row] += first * p;
            if !self.hessian {
                continue;
            }
            for &(column, q) in &angles[i..] {
                self.matrix.add(row, column, second * p * q);
            }
            for (column, way) in &columns {
                self.matrix.add(row, *column, p * mixed.dot(way));
            }
        }
    }

    fn add_turning(&mut self, i: usize, (a, b): (usize, usize), (first, second): (f64, f64)) {
        if a.max(b) >= Layout::<C>::ANGLES {
            return;
        }
        let [a, b] = [a, b].map(|set| Layout::<C>.angle(i, set));
        self.residual[a] += first;
        self.residual[b] -= first;
        if self.hessian {
            self.matrix.add(a, a, second);
            self.matrix.add(b, b, second);
            self.matrix.add(a, b, -second);
        }
    }

    fn add_rank_one(&mut self, i: usize, rows: (Triple, [f64; 3]), columns: (Triple, [f64; 3])) {
        let place = |(triple, mut values): (Triple, [f64; 3])| match triple {
            Triple::Position => (Layout::<C>.position(i), values),
            Triple::Turn => {
                if Layout::<C>::ANGLES == 0 {
                    values[2] = 0.0;
                }
                (Layout::<C>.tangent(i), values)
            }
        };
        let ((row, p), (column, q)) = (place(rows), place(columns));
        if p != [0.0; 3] && q != [0.0; 3] {
            self.rank_ones.push(RankOne { row, p, column, q });
        }
    }
}

impl<const C: usize> Assembly<C> {
    /// Adds derivatives in the first `count` of three unknowns from row `at` on.
    fn add_three(&mut self, at: usize, count: usize, gradient: &Vec3, hessian: &Matrix3<f64>) {
        for a in 0..count {
            self.residual[at + a] += gradient[a];
            if !self.hessian {
                continue;
            }
            for b in a..count {
                self.matrix.add(at + a, at + b, hessian[(a, b)]);
            }
        }
    }
}

/// Weights of the angles of a set in the angle of the point at ξ of element `e`.
pub(crate) fn angle_weights<const C: usize>((e, xi, set): (usize, f64, usize)) -> [(usize, f64); 3] {
    let l = Layout::<C>;
    let [w0, w1, wb] = Point::at(xi, 0.0).phi;
    [(l.angle(e, set), w0), (l.bubble(e, set), wb), (l.angle(e + 1, set), w1)]
}

/// Rows that move the point at ξ of element `e`, with its displacement per unit: w₀ dx₀ + s₀(u a + v b) + ….
pub(crate) fn point_columns<const C: usize>(
    state: &RodState,
    element: &ElementData,
    e: usize,
    xi: f64,
) -> [(usize, Vec3); 10] {
    let l = Layout::<C>;
    let [w0, s0, w1, s1] = hermite(xi);
    let (s0, s1) = (s0 * element.length, s1 * element.length);
    let (f0, f1) = (&state.frames[e], &state.frames[e + 1]);
    [
        (l.position(e), Vec3::x() * w0),
        (l.position(e) + 1, Vec3::y() * w0),
        (l.position(e) + 2, Vec3::z() * w0),
        (l.tangent(e), f0.u * s0),
        (l.tangent(e) + 1, f0.v * s0),
        (l.position(e + 1), Vec3::x() * w1),
        (l.position(e + 1) + 1, Vec3::y() * w1),
        (l.position(e + 1) + 2, Vec3::z() * w1),
        (l.tangent(e + 1), f1.u * s1),
        (l.tangent(e + 1) + 1, f1.v * s1),
    ]
}

/// Changes of x₀, h t₀, x₁ and h t₁ of element `e` in the step `d`.
pub(crate) fn element_step<const C: usize>(
    state: &RodState,
    element: &ElementData,
    e: usize,
    d: &[f64],
) -> [Vec3; 4] {
    let l = Layout::<C>;
    let node = |i: usize| {
        let (x, t, f) = (l.position(i), l.tangent(i), &state.frames[i]);
        (Vec3::new(d[x], d[x + 1], d[x + 2]), (f.u * d[t] + f.v * d[t + 1]) * element.length)
    };
    let ((x0, t0), (x1, t1)) = (node(e), node(e + 1));
    [x0, t0, x1, t1]
}

/// Displacement of the point at ξ of element `e` in the step `d`.
pub(crate) fn point_step<const C: usize>(
    state: &RodState,
    element: &ElementData,
    (e, xi): (usize, f64),
    d: &[f64],
) -> Vec3 {
    let l = Layout::<C>;
    let [w0, s0, w1, s1] = hermite(xi);
    let node = |i: usize, w: f64, s: f64| {
        let (x, t, f) = (l.position(i), l.tangent(i), &state.frames[i]);
        Vec3::new(d[x], d[x + 1], d[x + 2]) * w + (f.u * d[t] + f.v * d[t + 1]) * (s * element.length)
    };
    node(e, w0, s0) + node(e + 1, w1, s1)
}

/// Change of the material angle of the instrument in a `set` of angles at ξ of element `e` in a step `d`, rad.
pub(crate) fn point_turn<const C: usize>((e, xi, set): (usize, f64, usize), d: &[f64]) -> f64 {
    if Layout::<C>::ANGLES == 0 {
        return 0.0;
    }
    angle_weights::<C>((e, xi, set)).iter().map(|(row, share)| share * d[*row]).sum()
}
