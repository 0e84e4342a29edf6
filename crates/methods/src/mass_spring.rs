//! Mass–spring: Wang, Duratti, Samur, Spaelter and Bleuler, *A computer-based real-time simulation of interventional
//! radiology*, IEEE EMBC 2007.
//!
//! Point masses joined by springs along the device and by springs that straighten each pair of neighbours:
//!
//! ```text
//! E = Σ ½ (EA/h) (|eᵢ| − hᵢ)² + Σ ½ kᵢ |eᵢ/hᵢ − eᵢ₋₁/hᵢ₋₁|²,    k = EI/h
//! v ← v + Δt (f/m − c v),    x ← x + Δt v        (semi-implicit Euler; drag and wall stiffness implicit)
//! ```
//!
//! Length is kept by stiff springs, EA = ratio·EI/h², so it is met as the segments get shorter. Masses are free in a search for
//! equilibrium: each is set in proportion to the stiffness at its node, with which one time step suits all. The damping c is
//! that which is critical for the slowest mode of a cantilever, times a factor.
//!
//! # What it cannot do
//! No twist and no shaped tips. The number of time steps grows with the square of the number of nodes: the fastest wave decides
//! the time step, the slowest mode the time.

use endowire_core::device::Device;
use endowire_core::{Result, Vec3};

use crate::{Chain, NodalLoad, Outcome, Posture, Push, RodModel, refuse_shape};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassSpring {
    /// Axial stiffness over bending stiffness, EA h²/EI.
    pub axial_ratio: f64,
    /// Damping over that which is critical for the slowest mode.
    pub damping: f64,
    /// Time step over the largest stable one.
    pub time_step: f64,
    /// Most time steps.
    pub max_iterations: usize,
}

impl Default for MassSpring {
    fn default() -> Self {
        Self { axial_ratio: 16.0, damping: 1.5, time_step: 0.9, max_iterations: 1_000_000 }
    }
}

/// Lowest frequency of a cantilever, squared: ω² = 12.36 EI/(ρ L⁴).
const SLOWEST: f64 = 12.362;
/// Time steps between two looks at what is out of balance.
pub(crate) const CHECK_EVERY: usize = 20;

impl RodModel for MassSpring {
    fn name(&self) -> &'static str {
        "mass-spring"
    }

    fn check(&self, device: &Device) -> Result<()> {
        refuse_shape(self.name(), device, "has masses and springs without material directions")
    }

    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome {
        let n = chain.segments();
        let masses = node_stiffness(chain, self.axial_ratio);
        // Masses equal to stiffnesses: no frequency is above 1, so that steps up to 2 are stable.
        let dt = 2.0 * self.time_step;
        let c = 2.0 * self.damping * slowest_frequency(chain, &masses);
        let allowed = tolerance * chain.force_unit() / n as f64;
        let mut velocity = vec![Vec3::zeros(); n + 1];
        let mut force = vec![Vec3::zeros(); n + 1];
        let mut pushes = vec![Push::default(); n + 1];
        for iteration in 1..=self.max_iterations {
            self.forces(chain, load, posture, &mut pushes, &mut force);
            let mut out_of_balance: f64 = 0.0;
            for i in 1..=n {
                out_of_balance = out_of_balance.max(force[i].amax()).max(c * masses[i] * velocity[i].amax());
                velocity[i] = pushes[i].velocity(masses[i], c, &velocity[i], &force[i], dt);
                posture.positions_mm[i] += velocity[i] * dt;
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

impl MassSpring {
    fn forces(
        &self,
        chain: &Chain,
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
        let mut before = chain.direction;
        for i in 0..n {
            let h = chain.lengths_mm[i];
            let edge = posture.chord(i);
            let length = edge.norm();
            let axial = self.axial_ratio * chain.bending_nmm2[i] / (h * h * h);
            let pull = edge * (axial * (length - h) / length);
            force[i] += pull;
            force[i + 1] -= pull;
            let d = edge / h;
            let moment = (d - before) * chain.joint_stiffness(i);
            force[i + 1] -= moment / h;
            force[i] += moment / h;
            if i > 0 {
                let h = chain.lengths_mm[i - 1];
                force[i] += moment / h;
                force[i - 1] -= moment / h;
            }
            before = d;
        }
    }
}

/// A bound on the stiffness that a node sees: the sum of the magnitudes of its row.
pub(crate) fn node_stiffness(chain: &Chain, axial_ratio: f64) -> Vec<f64> {
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
pub(crate) fn slowest_frequency(chain: &Chain, masses: &[f64]) -> f64 {
    let length = chain.length_mm();
    let mass: f64 = masses[1..].iter().sum();
    let softest = chain.bending_nmm2.iter().fold(f64::MAX, |a: f64, b| a.min(*b));
    (SLOWEST * softest / (mass * length.powi(3))).sqrt()
}
