//! Loads: dead forces, moments and weight, and follower forces.

use crate::Vec3;
use crate::rod::{ElementData, Frame, RodState, Stencils, Triple};
use crate::solve::{External, Sizes};
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
    /// Follower forces (node, components along t, d₁, d₂).
    pub followers: Vec<(usize, Vec3)>,
    /// Dead forces that are not multiplied by `factor`.
    pub constant: Vec<(usize, Vec3)>,
    /// Factor of all other loads.
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

impl External for Loads {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        into.add_value(self.value(elements, state));
        let none = Matrix3::zeros();
        for (i, f) in &self.forces {
            into.add_node(*i, &(f * -self.factor), &none);
        }
        for (i, f) in &self.constant {
            into.add_node(*i, &-f, &none);
        }
        for (first, last, q) in &self.distributed {
            let q = q * self.factor;
            for e in *first..*last {
                // ∫r ds = h (x₀ + x₁)/2 + h² (t₀ − t₁)/12 for a cubic.
                let h = elements[e].length;
                for i in [e, e + 1] {
                    into.add_node(i, &(q * (-0.5 * h)), &none);
                }
                for (i, weight) in [(e, h * h / 12.0), (e + 1, -h * h / 12.0)] {
                    let frame = &state.frames[i];
                    let curve = weight * q.dot(&frame.t);
                    let gradient = Vec3::new(-(weight * q.dot(&frame.u)), -(weight * q.dot(&frame.v)), 0.0);
                    into.add_turn(i, &gradient, &Matrix3::from_diagonal(&Vec3::new(curve, curve, 0.0)));
                }
            }
        }
        for (i, m) in &self.moments {
            linearise_moment(*i, &state.frames[*i], &(m * self.factor), into);
        }
        for (i, value) in &self.followers {
            let value = value * self.factor;
            let force = Self::follower(state, *i, &value);
            into.add_node(*i, &-force, &none);
            let frame = &state.frames[*i];
            let (along, u, v) = (value.x, force.dot(&frame.u), force.dot(&frame.v));
            let rates =
                [frame.u * along - frame.t * u, frame.v * along - frame.t * v, frame.v * u - frame.u * v];
            for (k, rate) in rates.iter().enumerate() {
                let p = [-rate.x, -rate.y, -rate.z];
                into.add_rank_one(*i, (Triple::Position, p), (Triple::Turn, unit(k)));
            }
        }
    }

    fn value(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
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

    fn work(&self, from: &RodState, to: &RodState) -> f64 {
        let mut sum = 0.0;
        for (i, m) in &self.moments {
            // The tangent moves along a geodesic and the angle linearly with it: spin t × δ at constant rate, and θ′
            // t.
            let frame = &from.frames[*i];
            let (a, b) = frame.log(&to.frames[*i].t);
            sum += m.dot(&(frame.v * a - frame.u * b));
            let turn = libm::hypot(a, b);
            let twist = to.angles[*i] - from.angles[*i];
            let mean = if turn > 1e-6 {
                frame.t * (libm::sin(turn) / turn)
                    + (frame.u * a + frame.v * b) * ((1.0 - libm::cos(turn)) / (turn * turn))
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

    fn is_conservative(&self) -> bool {
        self.moments.is_empty() && self.followers.is_empty()
    }

    fn sizes(&self) -> Sizes {
        let force = self.forces.iter().chain(&self.followers).map(|(_, f)| f.norm()).fold(0.0, f64::max);
        let moment = self.moments.iter().map(|(_, m)| m.norm()).fold(0.0, f64::max);
        let constant = self.constant.iter().map(|(_, f)| f.norm()).fold(0.0, f64::max);
        let by = self.factor.abs();
        Sizes { force_n: constant.max(force * by), moment_nmm: moment * by, rounding_n: 0.0 }
    }
}

/// Mean position of an element.
fn centroid(elements: &[ElementData], state: &RodState, e: usize) -> Vec3 {
    let h = elements[e].length;
    (state.positions[e] + state.positions[e + 1]) * 0.5
        + (state.frames[e].t - state.frames[e + 1].t) * (h / 12.0)
}

/// A dead moment on node `i`: its virtual work is M·(t × δt + t δθ). The derivative is half symmetric and half skew:
/// a dead moment has no potential.
fn linearise_moment(i: usize, frame: &Frame, m: &Vec3, into: &mut dyn Stencils) {
    let (u, v, t) = (m.dot(&frame.u), m.dot(&frame.v), m.dot(&frame.t));
    let (a, b) = (-0.5 * u, -0.5 * v);
    let symmetric = Matrix3::new(0.0, 0.0, a, 0.0, 0.0, b, a, b, 0.0);
    into.add_turn(i, &Vec3::new(-v, u, -t), &symmetric);
    let skew = [[0.0, 0.5 * t, 0.5 * u], [-0.5 * t, 0.0, 0.5 * v], [-0.5 * u, -0.5 * v, 0.0]];
    for (k, q) in skew.into_iter().enumerate() {
        into.add_rank_one(i, (Triple::Turn, unit(k)), (Triple::Turn, q));
    }
}

fn unit(k: usize) -> [f64; 3] {
    let mut values = [0.0; 3];
    values[k] = 1.0;
    values
}
