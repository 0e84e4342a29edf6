//! Mass–spring: Wang, Duratti, Samur, Spaelter and Bleuler, *A computer-based real-time simulation of interventional
//! radiology*, IEEE EMBC 2007.
//!
//! Point masses joined by axial springs and by springs that straighten each pair of neighbours:
//!
//! ```text
//! E = Σ ½ (EA/h) (|eᵢ| − hᵢ)² + Σ ½ kᵢ |eᵢ/hᵢ − eᵢ₋₁/hᵢ₋₁|²,    k = EI/h
//! v ← v + Δt (f/m − c v),    x ← x + Δt v        (semi-implicit Euler; drag and wall stiffness implicit)
//! ```
//!
//! Length is maintained by stiff springs, EA = ratio·EI/h², so it converges as the segments get shorter. Masses can
//! be chosen freely in a search for equilibrium: each is proportional to the stiffness at its node, so that one time
//! step suits all, and the drag c is the critical one of the slowest mode of a cantilever, times a factor.
//!
//! # Limitations
//! No twist and no shaped tips. The number of time steps is quadratic in the number of nodes: the fastest wave
//! determines the time step, the slowest mode the duration.

use endowire_core::device::Device;
use endowire_core::{Result, Vec3};

use crate::explicit::Integration;
use crate::{Chain, NodalLoad, Outcome, Posture, RodModel, refuse_shape};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassSpring {
    /// Ratio of axial to bending stiffness, EA h²/EI.
    pub axial_ratio: f64,
    /// Damping relative to the critical damping of the slowest mode.
    pub damping: f64,
    /// Time step relative to the largest stable one.
    pub time_step: f64,
    /// Largest number of time steps.
    pub max_iterations: usize,
}

impl Default for MassSpring {
    fn default() -> Self {
        Self { axial_ratio: 16.0, damping: 1.5, time_step: 0.9, max_iterations: 1_000_000 }
    }
}

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
        let mut run = Integration::new(chain, self.axial_ratio, self.time_step, self.damping, tolerance);
        run.run(self.max_iterations, |run| {
            run.load(load, posture);
            self.springs(chain, posture, &mut run.force);
            let mut out_of_balance: f64 = 0.0;
            for i in 1..=chain.segments() {
                let held = run.drag * run.masses[i] * run.velocity[i].amax();
                out_of_balance = out_of_balance.max(run.force[i].amax()).max(held);
                run.velocity[i] = run.mobility(i).of(&run.impulse(i));
                posture.positions_mm[i] += run.velocity[i] * run.dt;
            }
            out_of_balance
        })
    }
}

impl MassSpring {
    fn springs(&self, chain: &Chain, posture: &Posture, force: &mut [Vec3]) {
        let mut before = chain.direction;
        for i in 0..chain.segments() {
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
