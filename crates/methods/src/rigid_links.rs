//! Rigid links: Dawson, Cotin, Meglan, Shaffer and Ferrell, *Designing a computer-based simulator for interventional
//! cardiology training*, Catheterization and Cardiovascular Interventions 51, 2000.
//!
//! A device is a chain of rigid links on spherical joints. A joint between links of directions dᵢ₋₁ and dᵢ has a torsional
//! spring, ½ kθ² with k = EI/l, and a damper; contact, injection and user forces act on the nodes. The generalised
//! coordinates are the directions of the links alone, so length is exact and a force on a node turns every link before it:
//!
//! ```text
//! δxⱼ = Σ_{i ≤ j} lᵢ δdᵢ,    M v̇ = τ − C v,    τᵢ = lᵢ Σ_{j ≥ i} fⱼ + spring torques
//! (M + Δt C + Δt² K) v⁺ = M v + Δt τ,    d ← d + Δt v⁺
//! ```
//!
//! Springs of joints and contacts are implicit (K), loads are not. The mass matrix couples every link with every other and is
//! factored as such: O(n³) a time step. Mass and dampers are free in a search for equilibrium; they are given in the
//! units of the device (its length, EI, and EI/L⁴ for the mass per length).
//!
//! # What it cannot do
//! Links do not twist: no torque, and no shaped tips. The cost grows with the cube of the number of links.

use endowire_core::device::Device;
use endowire_core::{Result, Vec3};
use nalgebra::{DMatrix, DVector, Matrix3};

use crate::links::Links;
use crate::{Chain, NodalLoad, Outcome, Posture, RodModel, refuse_shape};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidLinks {
    /// Time step in units of √(ρL⁴/EI).
    pub time_step: f64,
    /// Joint dampers over joint springs, in the same unit.
    pub damping: f64,
    /// Largest turn of a link in one time step, rad.
    pub largest_turn_rad: f64,
    /// Most time steps.
    pub max_iterations: usize,
}

impl Default for RigidLinks {
    fn default() -> Self {
        Self { time_step: 0.25, damping: 0.2, largest_turn_rad: 1.0, max_iterations: 2_000 }
    }
}

impl RodModel for RigidLinks {
    fn name(&self) -> &'static str {
        "rigid-links"
    }

    fn check(&self, device: &Device) -> Result<()> {
        refuse_shape(self.name(), device, "has links without material directions")
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
        let mut velocity = vec![Vec3::zeros(); n];
        let mut system = System::new(n);
        for iteration in 0..=self.max_iterations {
            links.place(chain, load, posture);
            system.assemble(chain, &links);
            if iteration > 0 && system.torque.amax() <= links.allowed {
                return Outcome { iterations: iteration, converged: true };
            }
            if iteration == self.max_iterations
                || !self.step(chain, load.trusted_mm(), &mut system, &mut links.directions, &mut velocity)
            {
                break;
            }
        }
        Outcome { iterations: self.max_iterations, converged: false }
    }
}

impl RigidLinks {
    /// One time step. False if the matrix is not positive definite, which only numbers that are not finite can do.
    fn step(
        &self,
        chain: &Chain,
        trusted_mm: f64,
        system: &mut System,
        links: &mut [Vec3],
        velocity: &mut [Vec3],
    ) -> bool {
        let n = links.len();
        let dt = self.time_step;
        let mut v = DVector::zeros(2 * n);
        for i in 0..n {
            for a in 0..2 {
                v[2 * i + a] = velocity[i].dot(&system.basis[i][a]);
            }
        }
        let rhs = &system.mass * v + &system.torque * dt;
        let matrix =
            &system.mass + &system.joints * (dt * (dt + self.damping)) + &system.contacts * (dt * dt);
        let Some(factor) = matrix.cholesky() else { return false };
        let v = factor.solve(&rhs);
        let (mut x, mut farthest) = (Vec3::zeros(), 0.0f64);
        for i in 0..n {
            let [p, q] = system.basis[i];
            velocity[i] = p * v[2 * i] + q * v[2 * i + 1];
            x += velocity[i] * (chain.lengths_mm[i] * dt);
            farthest = farthest.max(x.norm());
        }
        let scale = (self.largest_turn_rad / (dt * v.amax())).min(trusted_mm / farthest).min(1.0);
        for i in 0..n {
            velocity[i] *= scale;
            links[i] = (links[i] + velocity[i] * dt).normalize();
        }
        v.amax().is_finite()
    }
}

/// Torques on the links and the matrices of the motion, in two directions across each link.
struct System {
    basis: Vec<[Vec3; 2]>,
    torque: DVector<f64>,
    mass: DMatrix<f64>,
    joints: DMatrix<f64>,
    contacts: DMatrix<f64>,
}

impl System {
    fn new(n: usize) -> Self {
        let square = DMatrix::zeros(2 * n, 2 * n);
        Self {
            basis: vec![[Vec3::zeros(); 2]; n],
            torque: DVector::zeros(2 * n),
            mass: square.clone(),
            joints: square.clone(),
            contacts: square,
        }
    }

    fn assemble(&mut self, chain: &Chain, Links { directions: links, pushes, .. }: &Links) {
        let n = links.len();
        for (i, d) in links.iter().enumerate() {
            let u = d.cross(&if d.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() }).normalize();
            self.basis[i] = [u, d.cross(&u)];
        }
        let density = chain.force_unit() / chain.length_mm().powi(2);
        self.joints.fill(0.0);
        self.contacts.fill(0.0);
        // Force, mass and stiffness of everything beyond a link: it moves all of that.
        let (mut force, mut mass, mut yielding) = (Vec3::zeros(), 0.0, Matrix3::zeros());
        for i in (0..n).rev() {
            let (l, push) = (chain.lengths_mm[i], pushes[i]);
            force += push.force_n;
            yielding += push.normal * push.normal.transpose() * push.stiffness_n_per_mm;
            mass += 0.5 * density * (l + chain.lengths_mm.get(i + 1).unwrap_or(&0.0));
            let before = if i == 0 { chain.direction } else { links[i - 1] };
            let mut pull = force * l + before * spring(chain, i, &before, &links[i]);
            let mut stiffness = chain.joint_stiffness(i);
            if i + 1 < n {
                pull += links[i + 1] * spring(chain, i + 1, &links[i], &links[i + 1]);
                stiffness += chain.joint_stiffness(i + 1);
            }
            for a in 0..2 {
                self.torque[2 * i + a] = pull.dot(&self.basis[i][a]);
                self.joints[(2 * i + a, 2 * i + a)] = stiffness;
            }
            if i > 0 {
                let k = chain.joint_stiffness(i);
                self.couple(i, i - 1, |p, q| -k * p.dot(q), |system| &mut system.joints);
            }
            for j in 0..=i {
                let lever = l * chain.lengths_mm[j];
                self.couple(i, j, |p, q| mass * lever * p.dot(q), |system| &mut system.mass);
                if yielding != Matrix3::zeros() {
                    let felt = yielding * lever;
                    self.couple(i, j, |p, q| p.dot(&(felt * q)), |system| &mut system.contacts);
                }
            }
        }
    }

    /// Writes what couples links i and j, in both halves of a symmetric matrix.
    fn couple(
        &mut self,
        i: usize,
        j: usize,
        value: impl Fn(&Vec3, &Vec3) -> f64,
        matrix: impl Fn(&mut Self) -> &mut DMatrix<f64>,
    ) {
        let (p, q) = (self.basis[i], self.basis[j]);
        let matrix = matrix(self);
        for a in 0..2 {
            for b in 0..2 {
                let value = value(&p[a], &q[b]);
                matrix[(2 * i + a, 2 * j + b)] = value;
                matrix[(2 * j + b, 2 * i + a)] = value;
            }
        }
    }
}

/// Stiffness of joint `i` times θ/sin θ: its torque on link a is this times the other link's direction across a.
fn spring(chain: &Chain, i: usize, before: &Vec3, after: &Vec3) -> f64 {
    let (sine, cosine) = (before.cross(after).norm(), before.dot(after));
    chain.joint_stiffness(i) * if sine > 1e-9 { sine.atan2(cosine) / sine } else { 1.0 }
}
