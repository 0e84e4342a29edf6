//! Explicit integration towards equilibrium, shared by [`mass_spring`](crate::mass_spring) and
//! [`discrete_rod`](crate::discrete_rod).
//!
//! Masses can be chosen freely in a search for equilibrium: each is proportional to the stiffness at its node, so
//! that one time step suits all. The drag is the critical one of the slowest mode of a cantilever, times a factor.

use endowire_core::Vec3;

use crate::{Chain, NodalLoad, Outcome, Posture, Push};

/// Lowest frequency of a cantilever, squared: ω² = 12.36 EI/(ρ L⁴).
const SLOWEST: f64 = 12.362;
/// Number of time steps between two convergence tests.
const CHECK_EVERY: usize = 20;

/// A running integration. Node 0 is the clamp.
pub(crate) struct Integration {
    pub(crate) masses: Vec<f64>,
    /// Time step.
    pub(crate) dt: f64,
    /// Drag over mass.
    pub(crate) drag: f64,
    pub(crate) velocity: Vec<Vec3>,
    /// Force on the nodes.
    pub(crate) force: Vec<Vec3>,
    /// Loads on the nodes.
    pub(crate) pushes: Vec<Push>,
    /// Allowed imbalance at a node, N.
    allowed: f64,
}

impl Integration {
    /// Starts still. `axial_ratio` is EA h²/EI of axial springs, `time_step` is relative to the largest stable one,
    /// `damping` to the critical one, `tolerance` as in [`RodModel::relax`](crate::RodModel::relax).
    pub(crate) fn new(chain: &Chain, axial_ratio: f64, time_step: f64, damping: f64, tolerance: f64) -> Self {
        let n = chain.segments();
        let masses = node_stiffness(chain, axial_ratio);
        let drag = 2.0 * damping * slowest_frequency(chain, &masses);
        Self {
            masses,
            // Masses equal stiffnesses: no frequency is above 1, so steps up to 2 are stable.
            dt: 2.0 * time_step,
            drag,
            velocity: vec![Vec3::zeros(); n + 1],
            force: vec![Vec3::zeros(); n + 1],
            pushes: vec![Push::default(); n + 1],
            allowed: tolerance * chain.force_unit() / n as f64,
        }
    }

    /// Sets the forces to the loads at the current positions.
    pub(crate) fn load(&mut self, load: &mut dyn NodalLoad, posture: &Posture) {
        for i in 1..self.masses.len() {
            self.pushes[i] = load.on(i, &posture.positions_mm[i]);
            self.force[i] = self.pushes[i].force_n;
        }
    }

    /// Mobility of node `i` in one time step.
    pub(crate) fn mobility(&self, i: usize) -> Mobility {
        let inertia = self.masses[i] * (1.0 + self.drag * self.dt);
        let held = self.dt * self.dt * self.pushes[i].stiffness_n_per_mm;
        Mobility {
            free: 1.0 / inertia,
            held: held / (inertia * (inertia + held)),
            normal: self.pushes[i].normal,
        }
    }

    /// Impulse on node `i` in one time step, including its momentum.
    pub(crate) fn impulse(&self, i: usize) -> Vec3 {
        self.velocity[i] * self.masses[i] + self.force[i] * self.dt
    }

    /// Steps until balanced. `step` takes one time step and returns the largest imbalance.
    pub(crate) fn run(&mut self, most: usize, mut step: impl FnMut(&mut Self) -> f64) -> Outcome {
        for iterations in 1..=most {
            let out_of_balance = step(self);
            if iterations % CHECK_EVERY == 0 {
                let converged = out_of_balance <= self.allowed;
                if converged || !out_of_balance.is_finite() {
                    return Outcome { iterations, converged };
                }
            }
        }
        Outcome { iterations: most, converged: false }
    }
}

/// The inverse of a node's effective inertia in one time step: mass, drag, and the stiffness of its load, which is
/// implicit so that it does not limit the time step. (m(1 + cΔt) + Δt² k n nᵀ) v⁺ = m v + Δt f.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Mobility {
    free: f64,
    held: f64,
    normal: Vec3,
}

impl Mobility {
    /// Velocity after an impulse.
    pub(crate) fn of(&self, impulse: &Vec3) -> Vec3 {
        impulse * self.free - self.normal * (self.held * self.normal.dot(impulse))
    }
}

/// An upper bound of the stiffness at a node: the sum of the magnitudes of its row.
fn node_stiffness(chain: &Chain, axial_ratio: f64) -> Vec<f64> {
    let n = chain.segments();
    let mut rows = vec![0.0; n + 1];
    for i in 0..n {
        let h = chain.lengths_mm[i];
        let axial = 2.0 * axial_ratio * chain.bending_nmm2[i] / (h * h * h);
        rows[i] += axial;
        rows[i + 1] += axial;
        let k = chain.joint_stiffness(i);
        let inverse = |j: usize| 1.0 / chain.lengths_mm[j];
        let weights = if i == 0 {
            [0.0, inverse(0), inverse(0)]
        } else {
            [inverse(i - 1), inverse(i - 1) + inverse(i), inverse(i)]
        };
        let sum: f64 = weights.iter().sum();
        for (offset, weight) in weights.iter().enumerate() {
            if let Some(row) = (i + offset).checked_sub(1) {
                rows[row] += k * weight * sum;
            }
        }
    }
    rows
}

/// Lowest frequency of the chain as a cantilever with these masses.
fn slowest_frequency(chain: &Chain, masses: &[f64]) -> f64 {
    let length = chain.length_mm();
    let mass: f64 = masses[1..].iter().sum();
    let softest = chain.bending_nmm2.iter().fold(f64::MAX, |a: f64, b| a.min(*b));
    (SLOWEST * softest / (mass * length.powi(3))).sqrt()
}
