//! Energies of points on an element's centre line, gathered point by point and added to the system at once.
//!
//! The point at ξ is Σ cᵢ qᵢ with q = (x₀, h t₀, x₁, h t₁) and the weights cᵢ of [`hermite`], so energies of gradient g and Hessian H
//! in the position have Σ cᵢ g and Σ cᵢ cⱼ H in q. Tangents turn on a sphere: at second order tᵢ moves by −½|δ|² tᵢ as well.

use nalgebra::Matrix3;

use super::assembly::Assembly;
use super::element::ElementData;
use super::layout::Layout;
use super::quadrature::{Point, hermite};
use super::state::RodState;
use crate::Vec3;
use crate::field::EnergyDensity;

/// Gradients and Hessians of energies of points of one element.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PointSum {
    /// Gradients in x₀, h t₀, x₁ and h t₁.
    forces: [Vec3; 4],
    /// Hessians in pairs of these, i ≤ j; the other entries are zero.
    stiffness: [[Matrix3<f64>; 4]; 4],
    /// Whether anything has been added.
    felt: bool,
}

impl PointSum {
    /// Whether nothing has been added.
    pub(crate) fn is_empty(&self) -> bool {
        !self.felt
    }

    /// Energy of constant gradients, zero where all points are at the device's first node: Σ gᵢ·(xᵢ − x₀).
    pub(crate) fn along(&self, state: &RodState, element: &ElementData, e: usize) -> f64 {
        let start = state.positions[0];
        let [x0, x1] = [e, e + 1].map(|node| state.positions[node] - start);
        let [t0, t1] = [e, e + 1].map(|node| state.frames[node].t * element.length);
        let [f0, g0, f1, g1] = &self.forces;
        f0.dot(&x0) + g0.dot(&t0) + f1.dot(&x1) + g1.dot(&t1)
    }

    /// Adds an energy of the point at ξ from its gradient and, if wanted, Hessian in the position of that point.
    pub(crate) fn add(&mut self, xi: f64, gradient: &Vec3, hessian: Option<&Matrix3<f64>>) {
        self.felt = true;
        let c = hermite(xi);
        for i in 0..4 {
            self.forces[i] += gradient * c[i];
        }
        let Some(hessian) = hessian else { return };
        for i in 0..4 {
            let part = hessian * c[i];
            for j in i..4 {
                self.stiffness[i][j] += part * c[j];
            }
        }
    }

    /// Adds a part of the energy of a point at ξ of an element of this length that depends on its tangent as well ([`crate::field`]).
    pub(crate) fn add_directed(&mut self, (xi, length): (f64, f64), weight: f64, density: &EnergyDensity) {
        self.felt = true;
        let c = hermite(xi);
        let [chord, along, ahead] = Point::at(xi, 0.0).y;
        let d = [-chord, along, chord, ahead].map(|part| part / length);
        let EnergyDensity { by_positions, by_position_and_tangent: mixed, by_tangents, .. } = density;
        let turned = mixed.transpose();
        for i in 0..4 {
            self.forces[i] += (density.by_position * c[i] + density.by_tangent * d[i]) * weight;
            for j in i..4 {
                self.stiffness[i][j] += (by_positions * (c[i] * c[j])
                    + mixed * (c[i] * d[j])
                    + turned * (d[i] * c[j])
                    + by_tangents * (d[i] * d[j]))
                    * weight;
            }
        }
    }
}

impl<const C: usize> Assembly<C> {
    /// Adds the summed energies of points of element `e`.
    pub(super) fn add_gathered(&mut self, state: &RodState, element: &ElementData, e: usize, sum: &PointSum) {
        let l = Layout::<C>;
        let h = element.length;
        let [f0, g0, f1, g1] = &sum.forces;
        let (first, second) = (&state.frames[e], &state.frames[e + 1]);
        let (d0, d1) = ([first.u * h, first.v * h], [second.u * h, second.v * h]);
        let (x0, t0) = (l.position(e), l.tangent(e));
        let (x1, t1) = (l.position(e + 1), l.tangent(e + 1));
        for a in 0..3 {
            self.residual[x0 + a] += f0[a];
            self.residual[x1 + a] += f1[a];
        }
        for a in 0..2 {
            self.residual[t0 + a] += d0[a].dot(g0);
            self.residual[t1 + a] += d1[a].dot(g1);
        }
        if !self.hessian {
            return;
        }
        let s = &sum.stiffness;
        let begin = Layout::<C>::BLOCK * e;
        let [x0, t0, x1, t1] = [x0, t0, x1, t1].map(|row| row - begin);
        let mut rows = [[0.0; C]; C];
        for a in 0..3 {
            for b in 0..3 {
                if b >= a {
                    rows[x0 + a][x0 + b] = s[0][0][(a, b)];
                    rows[x1 + a][x1 + b] = s[2][2][(a, b)];
                }
                rows[x0 + a][x1 + b] = s[0][2][(a, b)];
            }
        }
        for a in 0..2 {
            let (near, across) = (s[0][1] * d0[a], s[1][2].tr_mul(&d0[a]));
            let (far, along) = (s[0][3] * d1[a], s[2][3] * d1[a]);
            for b in 0..3 {
                rows[x0 + b][t0 + a] = near[b];
                rows[t0 + a][x1 + b] = across[b];
                rows[x0 + b][t1 + a] = far[b];
                rows[x1 + b][t1 + a] = along[b];
            }
            let (own, other, last) = (s[1][1] * d0[a], s[1][3].tr_mul(&d0[a]), s[3][3] * d1[a]);
            for b in 0..2 {
                rows[t0 + a][t1 + b] = other.dot(&d1[b]);
                if b >= a {
                    rows[t0 + a][t0 + b] = own.dot(&d0[b]);
                    rows[t1 + a][t1 + b] = last.dot(&d1[b]);
                }
            }
            rows[t0 + a][t0 + a] -= h * g0.dot(&first.t);
            rows[t1 + a][t1 + a] -= h * g1.dot(&second.t);
        }
        self.matrix.add_blocks(begin, &rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::{Frame, PLAIN, TWISTED};

    /// Springs from three points of the second element to fixed places.
    const SPRINGS: [(f64, f64, Vec3); 3] = [
        (0.2, 3.0, Vec3::new(0.3, 0.2, -0.1)),
        (0.7, 5.0, Vec3::new(1.1, -0.3, 0.4)),
        (1.0, 2.0, Vec3::new(0.9, 0.6, 0.2)),
    ];

    fn place(element: &ElementData, state: &RodState, xi: f64) -> Vec3 {
        let [a, b, c, d] = hermite(xi);
        let h = element.length;
        state.positions[1] * a + state.positions[2] * c + (state.frames[1].t * b + state.frames[2].t * d) * h
    }

    fn energy(element: &ElementData, state: &RodState) -> f64 {
        SPRINGS.iter().map(|(xi, k, to)| 0.5 * k * (place(element, state, *xi) - to).norm_squared()).sum()
    }

    fn derivatives_are_those_of_the_energy<const C: usize>() {
        let data = ElementData::plain(0.8, 1.0);
        let elements = [data; 3];
        let frame = |x: f64| Frame::new(Vec3::new(1.0, x, 0.3 - x * x), None);
        let state = RodState::from_frames(&elements, Vec3::zeros(), [0.0, 0.4, 0.9, 1.0].map(frame).to_vec());
        let mut assembly = Assembly::<C>::new(3);
        let mut sum = PointSum::default();
        assert!(sum.is_empty());
        for (xi, k, to) in SPRINGS {
            let off = place(&data, &state, xi) - to;
            sum.add(xi, &(off * k), Some(&(Matrix3::identity() * k)));
        }
        assembly.add_gathered(&state, &data, 1, &sum);
        let l = Layout::<C>;
        let rows: Vec<usize> = (1..3)
            .flat_map(|i| (0..5).map(move |a| (i, a)))
            .map(|(i, a)| if a < 3 { l.position(i) + a } else { l.tangent(i) + a - 3 })
            .collect();
        // Positions move along lines and tangents along great circles.
        let moved = |way: &[f64], h: f64| {
            let mut to = state.clone();
            for i in 0..2 {
                let w = &way[5 * i..5 * i + 5];
                to.positions[i + 1] += Vec3::new(w[0], w[1], w[2]) * h;
                to.frames[i + 1] = state.frames[i + 1].transported(h * w[3], h * w[4]);
            }
            energy(&data, &to)
        };
        for seed in 0..20 {
            let way: Vec<f64> = (0..10).map(|k| (1.7 * f64::from(seed) + 2.3 * f64::from(k)).sin()).collect();
            let (h, here) = (1e-4, energy(&data, &state));
            let (plus, minus) = (moved(&way, h), moved(&way, -h));
            let slope: f64 = rows.iter().zip(&way).map(|(row, w)| assembly.residual[*row] * w).sum();
            assert!(((plus - minus) / (2.0 * h) - slope).abs() < 1e-6, "slope in direction {seed}");
            let mut curve = 0.0;
            for (i, w) in rows.iter().zip(&way) {
                for (j, v) in rows.iter().zip(&way) {
                    curve += assembly.matrix.get(*i, *j) * w * v;
                }
            }
            let found = (plus + minus - 2.0 * here) / (h * h);
            assert!(
                (found - curve).abs() < 1e-5 * (1.0 + curve.abs()),
                "direction {seed}: {found} and {curve}"
            );
        }
    }

    #[test]
    fn derivatives_are_those_of_the_energy_with_and_without_angles() {
        derivatives_are_those_of_the_energy::<PLAIN>();
        derivatives_are_those_of_the_energy::<TWISTED>();
    }
}
