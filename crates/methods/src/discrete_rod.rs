//! Discrete elastic rods: Bergou, Wardetzky, Robinson, Audoly and Grinspun, *Discrete elastic rods*, ACM Transactions on
//! Graphics 27 (SIGGRAPH 2008), for guidewires by Tang, Wan, Gould, How and John, *A realistic elastic rod model for
//! real-time simulation of minimally invasive vascular interventions*, The Visual Computer 26, 2010.
//!
//! The bend of a vertex is its curvature binormal (eq. 1), and its bending energy for an isotropic straight rod (section
//! 4.2.2)
//!
//! ```text
//! κb = 2 e×f / (|e||f| + e·f),    E = ½ k |κb|²,    k = EI/l̄
//! ```
//!
//! integrated by symplectic Euler; after each time step, fast manifold projection (Goldenthal et al. 2007; section 8 of the
//! paper) restores the lengths of the edges: a tridiagonal system for the multipliers, a few times.
//!
//! Twist of an isotropic rod that is straight at rest is uniform and leaves the rod at once through its free tip (section 5.1), so
//! this special case needs no material frames, and no others are asked for in the comparison. Masses and damping are chosen as
//! in [`mass_spring`](crate::mass_spring).
//!
//! # What it cannot do
//! As in section 4.2.2, isotropic rods that are straight at rest: shaped tips are refused. The number of time steps grows with
//! the square of the number of nodes.

use endowire_core::device::Device;
use endowire_core::{Result, Vec3};

use crate::mass_spring::{CHECK_EVERY, node_stiffness, slowest_frequency};
use crate::{Chain, NodalLoad, Outcome, Posture, Push, RodModel, refuse_shape};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscreteRod {
    /// Damping over that which is critical for the slowest mode.
    pub damping: f64,
    /// Time step over the largest stable one.
    pub time_step: f64,
    /// Relative error of an edge's length with which a round of projection is the last.
    pub length_tolerance: f64,
    /// Most time steps.
    pub max_iterations: usize,
}

impl Default for DiscreteRod {
    fn default() -> Self {
        Self { damping: 1.5, time_step: 0.9, length_tolerance: 1e-2, max_iterations: 1_000_000 }
    }
}

/// Most rounds of one projection.
const PROJECTIONS: usize = 10;

impl RodModel for DiscreteRod {
    fn name(&self) -> &'static str {
        "discrete-rod"
    }

    fn check(&self, device: &Device) -> Result<()> {
        refuse_shape(self.name(), device, "is the rod of the paper's section 4.2.2, straight at rest")
    }

    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome {
        let n = chain.segments();
        let masses = node_stiffness(chain, 0.0);
        let joints: Vec<f64> = (0..n).map(|i| chain.joint_stiffness(i)).collect();
        let dt = 2.0 * self.time_step;
        let c = 2.0 * self.damping * slowest_frequency(chain, &masses);
        let allowed = tolerance * chain.force_unit() / n as f64;
        let mut velocity = vec![Vec3::zeros(); n + 1];
        let mut force = vec![Vec3::zeros(); n + 1];
        let mut pushes = vec![Push::default(); n + 1];
        let mut before = posture.positions_mm.clone();
        let mut projection = Projection::new(chain, &masses, self.length_tolerance);
        projection.restore(&mut posture.positions_mm);
        for iteration in 1..=self.max_iterations {
            forces(chain, &joints, load, posture, &mut pushes, &mut force);
            before.copy_from_slice(&posture.positions_mm);
            for i in 1..=n {
                posture.positions_mm[i] += pushes[i].velocity(masses[i], c, &velocity[i], &force[i], dt) * dt;
            }
            projection.restore(&mut posture.positions_mm);
            // What is left of a step in equilibrium is nothing: the change of velocity is the force that the edges do not hold.
            let mut out_of_balance: f64 = 0.0;
            for i in 1..=n {
                let new = (posture.positions_mm[i] - before[i]) / dt;
                let unheld = masses[i] * ((new - velocity[i]).amax() / dt).max(c * new.amax());
                out_of_balance = out_of_balance.max(unheld);
                velocity[i] = new;
            }
            if iteration % CHECK_EVERY == 0 {
                if out_of_balance <= allowed {
                    return Outcome { iterations: iteration, converged: true };
                }
                if !out_of_balance.is_finite() {
                    return Outcome { iterations: iteration, converged: false };
                }
            }
        }
        Outcome { iterations: self.max_iterations, converged: false }
    }
}

/// Loads and bending forces. With a = e/|e|, b = f/|f| and χ = 1 + a·b, |κb|² = 4 (1 − a·b)/χ.
fn forces(
    chain: &Chain,
    joints: &[f64],
    load: &mut dyn NodalLoad,
    posture: &Posture,
    pushes: &mut [Push],
    force: &mut [Vec3],
) {
    let n = chain.segments();
    for i in 1..=n {
        pushes[i] = load.on(i, &posture.positions_mm[i]);
        force[i] = pushes[i].force_n;
    }
    let mut a = chain.direction;
    let mut a_length = 0.0;
    for i in 0..n {
        let edge = posture.chord(i);
        let b_length = edge.norm();
        let b = edge / b_length;
        let chi = 1.0 + a.dot(&b);
        // d(½ k |κb|²)/d(a·b) = −4 k/χ².
        let slope = 4.0 * joints[i] / (chi * chi);
        let cosine = chi - 1.0;
        // −∂E/∂f.
        let on_f = (a - b * cosine) * (slope / b_length);
        force[i + 1] += on_f;
        force[i] -= on_f;
        if i > 0 {
            let on_e = (b - a * cosine) * (slope / a_length);
            force[i] += on_e;
            force[i - 1] -= on_e;
        }
        (a, a_length) = (b, b_length);
    }
}

/// Fast projection onto edges of given length: one tridiagonal system a round.
struct Projection {
    squares: Vec<f64>,
    inverse_masses: Vec<f64>,
    tolerance: f64,
    edges: Vec<Vec3>,
    diagonal: Vec<f64>,
    above: Vec<f64>,
    multipliers: Vec<f64>,
}

impl Projection {
    fn new(chain: &Chain, masses: &[f64], tolerance: f64) -> Self {
        let n = chain.segments();
        let mut inverse_masses: Vec<f64> = masses.iter().map(|m| 1.0 / m).collect();
        inverse_masses[0] = 0.0;
        Self {
            squares: chain.lengths_mm.iter().map(|h| h * h).collect(),
            inverse_masses,
            tolerance,
            edges: vec![Vec3::zeros(); n],
            diagonal: vec![0.0; n],
            above: vec![0.0; n],
            multipliers: vec![0.0; n],
        }
    }

    fn restore(&mut self, x: &mut [Vec3]) {
        let n = self.edges.len();
        for _ in 0..PROJECTIONS {
            let mut largest: f64 = 0.0;
            for i in 0..n {
                self.edges[i] = x[i + 1] - x[i];
                self.multipliers[i] = self.edges[i].norm_squared() - self.squares[i];
                largest = largest.max(self.multipliers[i].abs() / self.squares[i]);
            }
            if !largest.is_finite() {
                return;
            }
            // ∇C M⁻¹ ∇Cᵀ, with C = |e|² − h².
            for i in 0..n {
                let w = &self.inverse_masses;
                self.diagonal[i] = 4.0 * (w[i] + w[i + 1]) * self.edges[i].norm_squared();
                if i + 1 < n {
                    self.above[i] = -4.0 * w[i + 1] * self.edges[i].dot(&self.edges[i + 1]);
                }
            }
            for i in 1..n {
                let factor = self.above[i - 1] / self.diagonal[i - 1];
                self.diagonal[i] -= factor * self.above[i - 1];
                self.multipliers[i] -= factor * self.multipliers[i - 1];
            }
            for i in (0..n).rev() {
                let beyond = if i + 1 < n { self.above[i] * self.multipliers[i + 1] } else { 0.0 };
                self.multipliers[i] = (self.multipliers[i] - beyond) / self.diagonal[i];
            }
            for i in 0..n {
                let way = self.edges[i] * (2.0 * self.multipliers[i]);
                x[i] += way * self.inverse_masses[i];
                x[i + 1] -= way * self.inverse_masses[i + 1];
            }
            // At least one round a step: convergence is quadratic, so the lengths settle with the rod.
            if largest <= 2.0 * self.tolerance {
                return;
            }
        }
    }
}
