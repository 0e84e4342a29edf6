//! The discrete energy of the paper, eqs. 1–9.
//!
//! Nodes 0…n, element i of length hᵢ between nodes i−1 and i. With tangents linear in between,
//!
//! ```text
//! xᵢ = xᵢ₋₁ + ½ hᵢ (tᵢ₋₁ + tᵢ)                      (5, 8)
//! Ue = ½ Σᵢ αᵢ |tᵢ − tᵢ₋₁|² / hᵢ                    (2, 6)
//! Up = ½ Σⱼ κ (nⱼ·xⱼ − dⱼ)²                         (7)   over the contact nodes j
//! W  = −Σᵢ fᵢ·(xᵢ − xᵢ⁰)                            (9)
//! ```
//!
//! x₀ and t₀ are the sheath (section 2.2.4) and do not vary; t₁…tₙ are the unknowns.

use endowire_core::Vec3;

/// A node held off one wall triangle: the plane n·x = d, penalised with stiffness κ (eq. 7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneContact {
    /// The node, 1…n.
    pub node: usize,
    /// Unit normal n of the triangle, into the lumen.
    pub normal: Vec3,
    /// Offset d in mm: the node's axis touches where n·x = d.
    pub offset_mm: f64,
    /// The wall triangle.
    pub triangle: u32,
}

/// One catheter as the paper discretises it.
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
    /// Contacts, in ascending order of their nodes.
    pub contacts: Vec<PlaneContact>,
    /// Wall stiffness κ per contact node, N/mm.
    pub wall_stiffness_n_per_mm: f64,
}

impl Chain {
    /// A straight chain of `elements` equal elements from the sheath, without load or contact.
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
            contacts: Vec::new(),
            wall_stiffness_n_per_mm: 0.0,
        }
    }

    /// Number of elements n: also the number of unknown tangents.
    pub fn elements(&self) -> usize {
        self.lengths_mm.len()
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

    /// Wall energy Up in mJ of the positions x₁…xₙ (eq. 7).
    pub fn wall_energy_mj(&self, positions_mm: &[Vec3]) -> f64 {
        self.contacts
            .iter()
            .map(|c| {
                let p = c.normal.dot(&positions_mm[c.node - 1]) - c.offset_mm;
                0.5 * self.wall_stiffness_n_per_mm * p * p
            })
            .sum()
    }

    /// Force of the wall on the node of `contact`, N along its normal; negative where the wall would pull,
    /// which eq. 7 allows since it is quadratic on both sides of the plane.
    pub fn contact_force_n(&self, contact: &PlaneContact, positions_mm: &[Vec3]) -> f64 {
        self.wall_stiffness_n_per_mm
            * (contact.offset_mm - contact.normal.dot(&positions_mm[contact.node - 1]))
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

    /// −∂U/∂tᵢ at the tangents t₁…tₙ and their positions: what is left of eq. 10.
    ///
    /// Summed as a person would: the force on everything beyond an element acts on its tangents with the lever ½h, and
    /// wall forces come from penetrations. The same residual as b − At, but free of the cancellation between
    /// stiffness times position and offset, which costs A and b six digits.
    pub fn residual(&self, tangents: &[Vec3], positions_mm: &[Vec3], residual: &mut Vec<Vec3>) {
        let n = self.elements();
        residual.clear();
        residual.extend_from_slice(&self.forces_n);
        for contact in &self.contacts {
            residual[contact.node - 1] += contact.normal * self.contact_force_n(contact, positions_mm);
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
