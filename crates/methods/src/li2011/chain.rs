//! The discrete energy of the paper, eqs. 1–9, and the constraint that the paper omits.
//!
//! Nodes 0…n, element i of length hᵢ between nodes i−1 and i. With tangents linear in between,
//!
//! ```text
//! xᵢ = xᵢ₋₁ + ½ hᵢ (tᵢ₋₁ + tᵢ)                      (5, 8)
//! Ue = ½ Σᵢ αᵢ |tᵢ − tᵢ₋₁|² / hᵢ                    (2, 6)
//! Up = ½ Σⱼ kⱼ (nⱼ·xⱼ − dⱼ)²                        (7)   over the springs j of the wall
//! W  = −Σᵢ fᵢ·(xᵢ − xᵢ⁰)                            (9)
//! ```
//!
//! x₀ and t₀ are given by the sheath (section 2.2.4); t₁…tₙ are the unknowns.
//!
//! With unit tangents each node has another row with a multiplier λᵢ. |tᵢ| = 1 is not linear; about a direction t̂ᵢ
//! close to tᵢ it is
//!
//! ```text
//! t̂ᵢ·tᵢ = 1,      ∂U/∂tᵢ + λᵢ t̂ᵢ = 0
//! ```
//!
//! exact up to second order in the angle between them. That error vanishes when tangents are divided by their length
//! ([`Chain::normalise`]).

use endowire_core::Vec3;

/// A spring of the wall at a node: energy ½ k (n·x − d)².
///
/// A triangle is one spring, whose direction n is its normal and whose stiffness k is κ (eq. 7). A smooth wall has a
/// second one across the device, for the curvature of the lumen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// The node, 1…n.
    pub node: usize,
    /// Unit direction n.
    pub direction: Vec3,
    /// Offset d, mm: the spring's force is zero where n·x = d.
    pub offset_mm: f64,
    /// Stiffness k, N/mm.
    pub stiffness_n_per_mm: f64,
}

impl Spring {
    /// Force on the node at `x`, N along the spring's direction; negative where it pulls, which eq. 7 permits since
    /// it is quadratic on both sides of the plane.
    pub fn force_n(&self, x: &Vec3) -> f64 {
        self.stiffness_n_per_mm * (self.offset_mm - self.direction.dot(x))
    }
}

/// A catheter in the paper's discretisation.
#[derive(Debug, Clone, Default)]
pub struct Chain {
    /// Position x₀ of the sheath, mm.
    pub start_mm: Vec3,
    /// Tangent t₀ of the sheath.
    pub start_tangent: Vec3,
    /// Element lengths h₁…hₙ, mm, all positive.
    pub lengths_mm: Vec<f64>,
    /// Bending constants α₁…αₙ of the elements, N·mm².
    pub bending_stiffness_nmm2: Vec<f64>,
    /// External forces f₁…fₙ on the nodes, N.
    pub forces_n: Vec<Vec3>,
    /// Springs of the wall, in ascending order of their nodes.
    pub springs: Vec<Spring>,
    /// Directions t̂₁…t̂ₙ about which tangents have unit length; empty if tangents are free, as printed.
    pub directions: Vec<Vec3>,
}

impl Chain {
    /// A straight chain of `elements` equal elements from the sheath, without load or contact, its tangents free.
    pub fn uniform(
        start_mm: Vec3,
        start_tangent: Vec3,
        length_mm: f64,
        elements: usize,
        stiffness_nmm2: f64,
    ) -> Self {
        Self {
            start_mm,
            start_tangent,
            lengths_mm: vec![length_mm / elements as f64; elements],
            bending_stiffness_nmm2: vec![stiffness_nmm2; elements],
            forces_n: vec![Vec3::zeros(); elements],
            springs: Vec::new(),
            directions: Vec::new(),
        }
    }

    /// Number of elements n: also the number of unknown tangents.
    pub fn elements(&self) -> usize {
        self.lengths_mm.len()
    }

    /// The direction t̂ of a node, 1…n; `None` if tangents are free.
    pub fn direction(&self, node: usize) -> Option<&Vec3> {
        self.directions.get(node - 1)
    }

    /// Bending energy Ue in mJ of the tangents t₁…tₙ (eq. 6).
    pub fn bending_energy_mj(&self, tangents: &[Vec3]) -> f64 {
        let mut previous = self.start_tangent;
        let mut energy = 0.0;
        for ((t, h), alpha) in tangents.iter().zip(&self.lengths_mm).zip(&self.bending_stiffness_nmm2) {
            energy += 0.5 * alpha * (t - previous).norm_squared() / h;
            previous = *t;
        }
        energy
    }

    /// Energy of the springs in mJ at the positions x₁…xₙ (eq. 7).
    pub fn spring_energy_mj(&self, positions_mm: &[Vec3]) -> f64 {
        let energy = |s: &Spring| {
            let p = s.direction.dot(&positions_mm[s.node - 1]) - s.offset_mm;
            0.5 * s.stiffness_n_per_mm * p * p
        };
        self.springs.iter().map(energy).sum()
    }

    /// Positions x₁…xₙ of the tangents t₁…tₙ (eq. 8).
    pub fn integrate(&self, tangents: &[Vec3], positions_mm: &mut Vec<Vec3>) {
        positions_mm.clear();
        let (mut x, mut previous) = (self.start_mm, self.start_tangent);
        for (t, h) in tangents.iter().zip(&self.lengths_mm) {
            x += (previous + t) * (0.5 * h);
            positions_mm.push(x);
            previous = *t;
        }
    }

    /// Divides tangents by their length, and computes the resulting positions.
    pub fn normalise(&self, tangents: &mut [Vec3], positions_mm: &mut Vec<Vec3>) {
        tangents.iter_mut().for_each(|t| *t /= t.norm());
        self.integrate(tangents, positions_mm);
    }

    /// −∂U/∂tᵢ at the tangents t₁…tₙ and their positions: the residual of eq. 10, without multipliers.
    ///
    /// Summed mechanically: the force on everything beyond an element acts on its tangents with the lever ½h, and
    /// wall forces follow from penetrations. This equals b − At without the cancellation between stiffness times
    /// position and offset, which costs A and b six digits.
    pub fn residual(&self, tangents: &[Vec3], positions_mm: &[Vec3], residual: &mut Vec<Vec3>) {
        let n = self.elements();
        residual.clear();
        residual.extend_from_slice(&self.forces_n);
        for spring in &self.springs {
            let node = spring.node - 1;
            residual[node] += spring.direction * spring.force_n(&positions_mm[node]);
        }
        // Force on node i and all beyond it, then its levers, both from the tip.
        for i in (1..n).rev() {
            let beyond = residual[i];
            residual[i - 1] += beyond;
        }
        for i in 0..n {
            let next =
                if i + 1 < n { residual[i + 1] * (0.5 * self.lengths_mm[i + 1]) } else { Vec3::zeros() };
            residual[i] = residual[i] * (0.5 * self.lengths_mm[i]) + next;
        }
        let mut previous = self.start_tangent;
        for i in 0..n {
            let moment = (tangents[i] - previous) * (self.bending_stiffness_nmm2[i] / self.lengths_mm[i]);
            residual[i] -= moment;
            if i > 0 {
                residual[i - 1] += moment;
            }
            previous = tangents[i];
        }
    }
}
