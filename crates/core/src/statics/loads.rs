//! Loads: dead forces, moments and weight, and forces that follow the rod.

use crate::Vec3;
use crate::rod::assembly::RankOne;
use crate::rod::{Assembly, ElementData, Layout, RodState};
use crate::solve::External;
use nalgebra::Matrix3;

/// Loads on a rod, at nodes and over elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Dead forces (node, force).
    pub forces: Vec<(usize, Vec3)>,
    /// Dead moments (node, moment).
    pub moments: Vec<(usize, Vec3)>,
    /// Dead forces per length (first element, one past the last, force per length).
    pub distributed: Vec<(usize, usize, Vec3)>,
    /// Forces that follow the rod (node, components along t, d₁, d₂).
    pub followers: Vec<(usize, Vec3)>,
    /// Dead forces that `factor` leaves alone.
    pub constant: Vec<(usize, Vec3)>,
    /// All other loads are multiplied by this.
    pub factor: f64,
}

impl Default for Loads {
    fn default() -> Self {
        Self {
            forces: vec![],
            moments: vec![],
            distributed: vec![],
            followers: vec![],
            constant: vec![],
            factor: 1.0,
        }
    }
}

impl Loads {
    fn follower(state: &RodState, node: usize, value: &Vec3) -> Vec3 {
        let f = state.material_frame(node);
        f.t * value.x + f.u * value.y + f.v * value.z
    }
}

impl<const C: usize> External<C> for Loads {
    fn energy(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let mut sum = 0.0;
        for (i, f) in &self.forces {
            sum -= f.dot(&(state.positions[*i] - state.positions[0]));
        }
        for (first, last, q) in &self.distributed {
            for e in *first..*last {
                sum -= q.dot(&(centroid(elements, state, e) - state.positions[0])) * elements[e].length;
            }
        }
        sum *= self.factor;
        for (i, f) in &self.constant {
            sum -= f.dot(&(state.positions[*i] - state.positions[0]));
        }
        sum
    }

    fn add(&mut self, elements: &[ElementData], state: &RodState, assembly: &mut Assembly<C>) {
        let l = Layout::<C>;
        assembly.external_energy += External::<C>::energy(self, elements, state);
        for (i, f) in &self.forces {
            assembly.add_node(*i, &(f * -self.factor), &Matrix3::zeros());
        }
        for (i, f) in &self.constant {
            assembly.add_node(*i, &-f, &Matrix3::zeros());
        }
        for (first, last, q) in &self.distributed {
            let q = q * self.factor;
            for e in *first..*last {
                // ∫r ds = h (x₀ + x₁)/2 + h² (t₀ − t₁)/12 for a cubic.
                let h = elements[e].length;
                for i in [e, e + 1] {
                    for a in 0..3 {
                        assembly.residual[l.position(i) + a] -= 0.5 * h * q[a];
                    }
                }
                for (i, weight) in [(e, h * h / 12.0), (e + 1, -h * h / 12.0)] {
                    let frame = &state.frames[i];
                    let row = l.tangent(i);
                    let curve = weight * q.dot(&frame.t);
                    assembly.residual[row] -= weight * q.dot(&frame.u);
                    assembly.residual[row + 1] -= weight * q.dot(&frame.v);
                    assembly.matrix.add(row, row, curve);
                    assembly.matrix.add(row + 1, row + 1, curve);
                }
            }
        }
        for (i, m) in &self.moments {
            // Virtual work M·(t × δt + t δθ). Its derivative is half symmetric and half not: a dead moment has no potential.
            let m = m * self.factor;
            let frame = &state.frames[*i];
            let row = l.tangent(*i);
            let (u, v, t) = (m.dot(&frame.u), m.dot(&frame.v), m.dot(&frame.t));
            assembly.residual[row] -= v;
            assembly.residual[row + 1] += u;
            let mut skew = [[0.0, 0.5 * t, 0.0], [-0.5 * t, 0.0, 0.0], [0.0; 3]];
            if Layout::<C>::TWIST {
                let angle = l.angle(*i);
                assembly.residual[angle] -= t;
                assembly.matrix.add(row, angle, -0.5 * u);
                assembly.matrix.add(row + 1, angle, -0.5 * v);
                skew[0][2] = 0.5 * u;
                skew[1][2] = 0.5 * v;
                skew[2] = [-0.5 * u, -0.5 * v, 0.0];
            }
            for k in 0..3 {
                if skew[k] != [0.0; 3] {
                    let mut p = [0.0; 3];
                    p[k] = 1.0;
                    assembly.rank_ones.push(RankOne { row, p, column: row, q: skew[k] });
                }
            }
        }
        for (i, value) in &self.followers {
            let value = value * self.factor;
            let force = Self::follower(state, *i, &value);
            assembly.add_node(*i, &-force, &Matrix3::zeros());
            let frame = &state.frames[*i];
            let (along, u, v) = (value.x, force.dot(&frame.u), force.dot(&frame.v));
            let rates =
                [frame.u * along - frame.t * u, frame.v * along - frame.t * v, frame.v * u - frame.u * v];
            let count = if Layout::<C>::TWIST { 3 } else { 2 };
            for (k, rate) in rates.iter().enumerate().take(count) {
                let mut q = [0.0; 3];
                q[k] = 1.0;
                assembly.rank_ones.push(RankOne {
                    row: l.position(*i),
                    p: [-rate.x, -rate.y, -rate.z],
                    column: l.tangent(*i),
                    q,
                });
            }
        }
    }

    fn work(&self, from: &RodState, to: &RodState) -> f64 {
        let mut sum = 0.0;
        for (i, m) in &self.moments {
            // The tangent goes along a geodesic, the angle linearly with it: spin t × δ at constant rate, and θ′ t.
            let frame = &from.frames[*i];
            let (a, b) = frame.log(&to.frames[*i].t);
            sum += m.dot(&(frame.v * a - frame.u * b));
            let turn = a.hypot(b);
            let twist = to.angles[*i] - from.angles[*i];
            let mean = if turn > 1e-6 {
                frame.t * (turn.sin() / turn)
                    + (frame.u * a + frame.v * b) * ((1.0 - turn.cos()) / (turn * turn))
            } else {
                frame.t + (frame.u * a + frame.v * b) * 0.5
            };
            sum += twist * m.dot(&mean);
        }
        for (i, value) in &self.followers {
            let force = (Self::follower(from, *i, value) + Self::follower(to, *i, value)) * 0.5;
            sum += force.dot(&(to.positions[*i] - from.positions[*i]));
        }
        sum * self.factor
    }

    fn memoryless(&self) -> bool {
        true
    }

    fn conservative(&self) -> bool {
        self.moments.is_empty() && self.followers.is_empty()
    }

    fn scale(&self) -> [f64; 2] {
        let force = self.forces.iter().chain(&self.followers).map(|(_, f)| f.norm()).fold(0.0, f64::max);
        let moment = self.moments.iter().map(|(_, m)| m.norm()).fold(0.0, f64::max);
        let constant = self.constant.iter().map(|(_, f)| f.norm()).fold(0.0, f64::max);
        [constant.max(force * self.factor.abs()), moment * self.factor.abs()]
    }
}

/// Mean position of an element.
fn centroid(elements: &[ElementData], state: &RodState, e: usize) -> Vec3 {
    let h = elements[e].length;
    (state.positions[e] + state.positions[e + 1]) * 0.5
        + (state.frames[e].t - state.frames[e + 1].t) * (h / 12.0)
}
