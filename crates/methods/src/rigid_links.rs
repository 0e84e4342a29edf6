//! Rigid links: Dawson, Cotin, Meglan, Shaffer and Ferrell, *Designing a computer-based simulator for interventional
//! cardiology training*, Catheterization and Cardiovascular Interventions 51, 2000.
//!
//! A device is a chain of rigid links on spherical joints. A joint between links of directions dᵢ₋₁ and dᵢ has a
//! torsional spring, ½ kθ² with k = EI/l, and a damper; contact, injection and user forces act on the nodes. The
//! generalised coordinates are the directions of the links alone, so length is exact and a force on a node acts on
//! every link before it:
//!
//! ```text
//! δxⱼ = Σ_{i ≤ j} lᵢ δdᵢ,    M v̇ = τ − C v,    τᵢ = lᵢ Σ_{j ≥ i} fⱼ + spring torques
//! (M + Δt C + Δt² K) v⁺ = M v + Δt τ,    d ← d + Δt v⁺
//! ```
//!
//! Springs of joints and contacts are implicit (K), loads are not. Mass and dampers can be chosen freely in a search
//! for equilibrium; they are given in the units of the device (its length, EI, and EI/L⁴ for the mass per length).
//!
//! M and the contacts couple every link with every other, and yet a step takes O(n), like the recursions for chains
//! of bodies (Featherstone, *The calculation of robot dynamics using articulated-body inertias*, Int. J. Robotics
//! Research 2, 1983). With the velocity xⱼ of node j in addition to those of the links, xⱼ = xⱼ₋₁ + lⱼ vⱼ, the step
//! is the minimum of
//!
//! ```text
//! Σⱼ ½ xⱼᵀ (mⱼ + Δt² kⱼ nⱼnⱼᵀ) xⱼ + ½ Kⱼ vⱼ² − κⱼ vⱼ·vⱼ₋₁ − rⱼ·vⱼ
//! ```
//!
//! and the contribution of everything beyond a link is a quadratic function of its velocity and that of its node: a
//! recursion from the tip with blocks of five, and back.
//!
//! # Limitations
//! Links do not twist: no torque, and no shaped tips.

use endowire_core::device::Device;
use endowire_core::{Result, Vec3};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2};

use crate::links::Links;
use crate::{Chain, NodalLoad, Outcome, Posture, RodModel, refuse_shape};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidLinks {
    /// Time step in units of √(ρL⁴/EI).
    pub time_step: f64,
    /// Ratio of joint dampers to joint springs, in the same unit.
    pub damping: f64,
    /// Largest rotation of a link in one time step, rad.
    pub largest_turn_rad: f64,
    /// Largest number of time steps.
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
            if iteration > 0 && system.largest_torque() <= links.allowed {
                return Outcome { iterations: iteration, converged: true };
            }
            if iteration == self.max_iterations
                || !self.step(chain, load.trusted_mm(), &mut system, &mut links, &mut velocity)
            {
                break;
            }
        }
        Outcome { iterations: self.max_iterations, converged: false }
    }
}

impl RigidLinks {
    /// One time step. Returns false if the matrix is not positive definite, which happens only with numbers that are
    /// not finite.
    fn step(
        &self,
        chain: &Chain,
        trusted_mm: f64,
        system: &mut System,
        links: &mut Links,
        velocity: &mut [Vec3],
    ) -> bool {
        let dt = self.time_step;
        let Some(fastest) = system.solve(chain, links, (dt, self.damping), velocity) else { return false };
        let (mut x, mut farthest) = (Vec3::zeros(), 0.0f64);
        for (v, length_mm) in velocity.iter().zip(&chain.lengths_mm) {
            x += v * (length_mm * dt);
            farthest = farthest.max(x.norm());
        }
        let scale = (self.largest_turn_rad / (dt * fastest)).min(trusted_mm / farthest).min(1.0);
        for (v, direction) in velocity.iter_mut().zip(&mut links.directions) {
            *v *= scale;
            *direction = (*direction + *v * dt).normalize();
        }
        fastest.is_finite()
    }
}

/// A link in the equations of motion, in two directions across it.
#[derive(Debug, Clone, Copy)]
struct Body {
    across: Matrix3x2<f64>,
    torque: Vector2<f64>,
    /// Mass at its far node.
    mass: f64,
    /// Stiffness of its joints, N·mm: of its own, and including the next one.
    joint: f64,
    joints: f64,
}

/// The optimal velocity of a link: v is `by_node` x + `by_link` v′ + `alone`, with the velocities of the node and the
/// link before it.
#[derive(Debug, Clone, Copy, Default)]
struct Answer {
    by_node: Matrix2x3<f64>,
    by_link: Matrix2<f64>,
    alone: Vector2<f64>,
}

/// Contribution of everything beyond a link to the cost: ½ of a quadratic form of its node's velocity x and its own
/// v, and a linear one.
#[derive(Debug, Clone, Copy, Default)]
struct Cost {
    xx: Matrix3<f64>,
    vx: Matrix2x3<f64>,
    vv: Matrix2<f64>,
    x: Vec3,
    v: Vector2<f64>,
}

/// The equations of motion.
struct System {
    bodies: Vec<Body>,
    answers: Vec<Answer>,
}

impl System {
    fn new(n: usize) -> Self {
        let (across, torque) = (Matrix3x2::zeros(), Vector2::zeros());
        let body = Body { across, torque, mass: 0.0, joint: 0.0, joints: 0.0 };
        Self { bodies: vec![body; n], answers: vec![Answer::default(); n] }
    }

    fn largest_torque(&self) -> f64 {
        self.bodies.iter().fold(0.0, |most, body| most.max(body.torque.amax()))
    }

    fn assemble(&mut self, chain: &Chain, Links { directions: links, pushes, .. }: &Links) {
        let n = links.len();
        let density = chain.force_unit() / chain.length_mm().powi(2);
        // Force on everything beyond a link, which the link moves.
        let mut force = Vec3::zeros();
        for i in (0..n).rev() {
            let (d, l) = (links[i], chain.lengths_mm[i]);
            let u = d.cross(&if d.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() }).normalize();
            let across = Matrix3x2::from_columns(&[u, d.cross(&u)]);
            force += pushes[i].force_n;
            let before = if i == 0 { chain.direction } else { links[i - 1] };
            let mut pull = force * l + before * spring(chain, i, &before, &d);
            let joint = chain.joint_stiffness(i);
            let mut joints = joint;
            if i + 1 < n {
                pull += links[i + 1] * spring(chain, i + 1, &d, &links[i + 1]);
                joints += chain.joint_stiffness(i + 1);
            }
            let mass = 0.5 * density * (l + chain.lengths_mm.get(i + 1).unwrap_or(&0.0));
            self.bodies[i] = Body { across, torque: across.tr_mul(&pull), mass, joint, joints };
        }
    }

    /// Replaces the velocities of links by those after a time step with this damping. Returns the largest, or `None`
    /// if the matrix is not positive definite.
    fn solve(
        &mut self,
        chain: &Chain,
        links: &Links,
        (dt, damping): (f64, f64),
        velocity: &mut [Vec3],
    ) -> Option<f64> {
        // Momentum of everything beyond a link.
        let mut momentum: Vec<Vec3> = Vec::with_capacity(velocity.len());
        let mut x = Vec3::zeros();
        for ((v, body), l) in velocity.iter().zip(&self.bodies).zip(&chain.lengths_mm) {
            x += v * *l;
            momentum.push(x * body.mass);
        }
        let (implicit, mut beyond) = (dt * (dt + damping), Vec3::zeros());
        let mut cost = Cost::default();
        for i in (0..velocity.len()).rev() {
            let (Body { across, torque, mass, joint, joints }, l) = (self.bodies[i], chain.lengths_mm[i]);
            let push = links.pushes[i];
            beyond += momentum[i];
            let wanted = across.tr_mul(&beyond) * l + torque * dt;
            let node = cost.xx
                + Matrix3::identity() * mass
                + push.normal * push.normal.transpose() * (dt * dt * push.stiffness_n_per_mm);
            // With x = x′ + l v the cost in v is ½ vᵀ own v + v·(by_node x′ + by_link v′ − alone).
            let turn = cost.vx * across * l;
            let own = across.tr_mul(&(node * across)) * (l * l)
                + Matrix2::identity() * (joints * implicit)
                + turn
                + turn.transpose()
                + cost.vv;
            let by_node = across.tr_mul(&node) * l + cost.vx;
            let before = if i == 0 { Matrix3x2::zeros() } else { self.bodies[i - 1].across };
            let by_link = across.tr_mul(&before) * (-joint * implicit);
            let alone = wanted - across.tr_mul(&cost.x) * l - cost.v;
            let factor = own.cholesky()?;
            let answer = Answer {
                by_node: -factor.solve(&by_node),
                by_link: -factor.solve(&by_link),
                alone: factor.solve(&alone),
            };
            cost = Cost {
                xx: node + by_node.tr_mul(&answer.by_node),
                vx: by_link.tr_mul(&answer.by_node),
                vv: by_link.tr_mul(&answer.by_link),
                x: cost.x + by_node.tr_mul(&answer.alone),
                v: by_link.tr_mul(&answer.alone),
            };
            self.answers[i] = answer;
        }
        let (mut x, mut v, mut fastest) = (Vec3::zeros(), Vector2::zeros(), 0.0f64);
        for (i, link) in velocity.iter_mut().enumerate() {
            let Answer { by_node, by_link, alone } = self.answers[i];
            v = by_node * x + by_link * v + alone;
            fastest = fastest.max(v.amax());
            *link = self.bodies[i].across * v;
            x += *link * chain.lengths_mm[i];
        }
        Some(fastest)
    }
}

/// Stiffness of joint `i` times θ/sin θ: its torque on link a is this times the other link's direction across a.
fn spring(chain: &Chain, i: usize, before: &Vec3, after: &Vec3) -> f64 {
    let (sine, cosine) = (before.cross(after).norm(), before.dot(after));
    chain.joint_stiffness(i) * if sine > 1e-9 { sine.atan2(cosine) / sine } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Push;
    use nalgebra::{DMatrix, DVector};

    /// The recursion compared with the matrix that it never forms.
    #[test]
    fn a_step_of_the_recursion_is_that_of_the_dense_matrix() {
        let n = 7;
        let mut count = 0.0f64;
        let mut vector = || {
            Vec3::from_fn(|_, _| {
                count += 1.0;
                (count * count).sin()
            })
        };
        let lengths_mm = (0..n).map(|i| 1.0 + 0.3 * i as f64).collect();
        let chain = Chain { lengths_mm, ..Chain::uniform(1.0, n, 3.0) };
        let links = Links {
            directions: (0..n).map(|_| (Vec3::x() * 2.0 + vector()).normalize()).collect(),
            pushes: (0..n)
                .map(|i| Push {
                    force_n: vector(),
                    normal: vector().normalize(),
                    stiffness_n_per_mm: if i % 2 == 0 { 4.0 } else { 0.0 },
                })
                .collect(),
            allowed: 0.0,
        };
        let (dt, damping) = (0.25, 0.2);
        let mut system = System::new(n);
        system.assemble(&chain, &links);
        let start: Vec<Vec3> =
            system.bodies.iter().map(|body| body.across * body.across.tr_mul(&vector())).collect();
        let across = |i: usize| system.bodies[i].across;
        let mut matrix = DMatrix::zeros(2 * n, 2 * n);
        let mut rhs = DVector::zeros(2 * n);
        for i in 0..n {
            rhs.rows_mut(2 * i, 2).copy_from(&(system.bodies[i].torque * dt));
            let joints = Matrix2::identity() * (system.bodies[i].joints * dt * (dt + damping));
            matrix.view_mut((2 * i, 2 * i), (2, 2)).copy_from(&joints);
            for j in 0..n {
                let lever = chain.lengths_mm[i] * chain.lengths_mm[j];
                for k in i.max(j)..n {
                    let (mass, push) = (system.bodies[k].mass, links.pushes[k]);
                    let inertia = Matrix3::identity() * mass;
                    let yielding =
                        push.normal * push.normal.transpose() * (dt * dt * push.stiffness_n_per_mm);
                    let block = across(i).tr_mul(&((inertia + yielding) * across(j))) * lever;
                    let mut to = matrix.view_mut((2 * i, 2 * j), (2, 2));
                    to += block;
                    let mut to = rhs.rows_mut(2 * i, 2);
                    to += across(i).tr_mul(&start[j]) * (mass * lever);
                }
                if j + 1 == i || i + 1 == j {
                    let stiffness = system.bodies[i.max(j)].joint * dt * (dt + damping);
                    let mut to = matrix.view_mut((2 * i, 2 * j), (2, 2));
                    to -= across(i).tr_mul(&across(j)) * stiffness;
                }
            }
        }
        let expected = matrix.cholesky().unwrap().solve(&rhs);
        let mut velocity = start.clone();
        system.solve(&chain, &links, (dt, damping), &mut velocity).unwrap();
        for (i, v) in velocity.iter().enumerate() {
            let off = system.bodies[i].across.tr_mul(v) - expected.rows(2 * i, 2);
            assert!(off.norm() < 1e-12 * expected.norm(), "{i}: {off:?}");
        }
        // Counter-check: the initial velocities differ.
        let moved = velocity.iter().zip(&start).map(|(v, s)| (v - s).norm()).fold(0.0, f64::max);
        assert!(moved > 0.1 * expected.norm(), "{moved}");
    }
}
