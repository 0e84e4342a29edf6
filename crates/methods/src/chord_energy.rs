//! Energy minimisation of chord vectors: Konings, van de Kraats, Alderliesten and Niessen, *Analytical guide wire motion
//! algorithm for simulation of endovascular interventions*, Medical & Biological Engineering & Computing 41, 2003;
//! Alderliesten, Konings and Niessen, *Simulation of minimally invasive vascular interventions for training purposes*,
//! Computer Aided Surgery 9, 2004, and *Modeling friction, intrinsic curvature, and rotation of guide wires for simulation of
//! minimally invasive vascular interventions*, IEEE Transactions on Biomedical Engineering 54, 2007.
//!
//! A wire is a chain of joints connected by straight segments λᵢ = l dᵢ of fixed length. With the wall's energy to
//! second order, the total energy as a function of one segment, with all others fixed, is
//!
//! ```text
//! E(dᵢ) = −kᵢ dᵢ·(dᵢ₋₁ + bᵢ) − kᵢ₊₁ dᵢ·(dᵢ₊₁ − bᵢ₊₁) − l F·dᵢ + ½ l² (δdᵢ)ᵀ S δdᵢ
//! ```
//!
//! (k = EI/l; b the intrinsic bend of a joint; F and S force and stiffness of the wall on everything beyond, which
//! moves with dᵢ), whose minimum on |dᵢ| = 1 is known in closed form: the direction of a vector. Segments are updated
//! in turn from the tip to the sheath, repeatedly, until none moves: this is the semi-analytic relaxation.
//!
//! # Limitations
//! The wire does not twist: the tail's rotation reaches the tip at once (the papers assume an infinite torsion
//! constant), so there is no torque and no whip. The number of sweeps is quadratic in the number of segments. The
//! papers' friction is omitted: no scene of the comparison has any.

use endowire_core::Vec3;
use nalgebra::Matrix3;

use crate::links::Links;
use crate::{Chain, NodalLoad, Outcome, Posture, Push, RodModel, Strain};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChordEnergy {
    /// Largest number of sweeps.
    pub max_iterations: usize,
}

impl Default for ChordEnergy {
    fn default() -> Self {
        Self { max_iterations: 200_000 }
    }
}

impl RodModel for ChordEnergy {
    fn name(&self) -> &'static str {
        "chord-energy"
    }

    fn strain(&self, chain: &Chain, posture: &Posture) -> Strain {
        let directions: Vec<Vec3> = (0..chain.segments()).map(|i| posture.chord(i).normalize()).collect();
        let mut bends = vec![Vec3::zeros(); directions.len()];
        intrinsic_bends(chain, &directions, &mut bends);
        Strain { bend_mj: chain.bending_energy_from_mj(posture, &bends), ..Strain::default() }
    }

    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome {
        let n = chain.segments();
        let mut links = Links::new(chain, posture, tolerance);
        let joints: Vec<f64> = (0..n).map(|i| chain.joint_stiffness(i)).collect();
        let shaped = chain.rest_curvature_per_mm.iter().any(|k| *k != [0.0; 2]);
        let mut bends = vec![Vec3::zeros(); n];
        for iteration in 1..=self.max_iterations {
            links.place(chain, load, posture);
            if shaped {
                intrinsic_bends(chain, &links.directions, &mut bends);
            }
            let largest = round(chain, &joints, &bends, &links.pushes, &mut links.directions);
            let converged = largest <= links.allowed;
            if converged || !largest.is_finite() {
                return Outcome { iterations: iteration, converged };
            }
        }
        Outcome { iterations: self.max_iterations, converged: false }
    }
}

/// Updates every segment once, tip first. Returns the largest torque on a segment, N·mm.
fn round(chain: &Chain, joints: &[f64], bends: &[Vec3], pushes: &[Push], links: &mut [Vec3]) -> f64 {
    let n = links.len();
    let (mut force, mut yielding) = (Vec3::zeros(), Matrix3::zeros());
    let mut largest: f64 = 0.0;
    for i in (0..n).rev() {
        let (l, d, push) = (chain.lengths_mm[i], links[i], pushes[i]);
        force += push.force_n;
        let before = if i == 0 { chain.direction } else { links[i - 1] };
        let mut pull = (before + bends[i]) * joints[i] + force * l;
        if i + 1 < n {
            // The next joint's bend rotates with this segment, hence the cosine.
            pull += (links[i + 1] - bends[i + 1] * links[i + 1].dot(&d)) * joints[i + 1];
        }
        largest = largest.max((pull - d * pull.dot(&d)).norm());
        let moved = if push.stiffness_n_per_mm == 0.0 && yielding == Matrix3::zeros() {
            pull.normalize()
        } else {
            yielding += push.normal * push.normal.transpose() * push.stiffness_n_per_mm;
            // The wall's second-order term about the segment's position; across it, the sphere adds pull·d.
            let along = pull.dot(&d).max(joints[i]);
            let across = Matrix3::identity() - d * d.transpose();
            let matrix = Matrix3::identity() * along + across * yielding * across * (l * l);
            let turn = matrix.lu().solve(&(across * pull)).unwrap_or_else(Vec3::zeros);
            (d + turn).normalize()
        };
        // Everything beyond has moved too, and changes the forces.
        force -= yielding * (moved - d) * l;
        links[i] = moved;
    }
    largest
}

/// Intrinsic bend of every joint: the rest curvature in the clamp's triad, transported along the wire without twist.
fn intrinsic_bends(chain: &Chain, links: &[Vec3], bends: &mut [Vec3]) {
    let frame = chain.clamp_frame();
    let mut u: Vec3 = frame.matrix().column(1).into();
    let mut before = chain.direction;
    for i in 0..links.len() {
        // Half of the bend is due to the segment on either side; before the clamp there is none.
        let mut angle = [0.0; 2];
        for segment in [Some(i), i.checked_sub(1)].into_iter().flatten() {
            for (a, curvature) in angle.iter_mut().zip(chain.rest_curvature_per_mm[segment]) {
                *a += 0.5 * chain.lengths_mm[segment] * curvature;
            }
        }
        let v = before.cross(&u);
        bends[i] = u * angle[0] + v * angle[1];
        let d = links[i];
        u = (u - (before + d) * (u.dot(&d) / (1.0 + before.dot(&d)))).normalize();
        before = d;
    }
}
