//! Discrete elastic rods: Bergou, Wardetzky, Robinson, Audoly and Grinspun, *Discrete elastic rods*, ACM Transactions on
//! Graphics 27 (SIGGRAPH 2008), for guidewires by Tang, Wan, Gould, How and John, *A realistic elastic rod model for
//! real-time simulation of minimally invasive vascular interventions*, The Visual Computer 26, 2010.
//!
//! The bend of a vertex is its curvature binormal, and the bending energy of an isotropic rod that is straight at rest
//!
//! ```text
//! κb = 2 e×f / (|e||f| + e·f),    E = ½ k |κb|²,    k = EI/l̄
//! ```
//!
//! (l̄ half of the two edges at the vertex), integrated by symplectic Euler; after each time step, fast manifold
//! projection (Goldenthal, Harmon, Fattal, Bercovier and Grinspun, *Efficient simulation of inextensible cloth*,
//! SIGGRAPH 2007) restores the lengths of the edges: a few tridiagonal systems for the multipliers. As in the papers,
//! the centre line is dynamic and the material frame quasistatic.
//!
//! Twist of an isotropic rod that is straight at rest is uniform and leaves the rod at once through its free tip, so
//! this special case, the only one needed in the comparison, needs no material frames. Masses and damping are chosen
//! as in [`mass_spring`](crate::mass_spring).
//!
//! The papers do not describe how a stiff wall and the projection are combined. Here the wall's stiffness is implicit
//! at its node, and the projection moves nodes consistently with that step. With the nodes' masses alone in the
//! projection, as first tried, the rod never came to rest in contact: 1 of the 15 sets of the search for parameters
//! settled in the tube instead of 11.
//!
//! # Limitations
//! Only isotropic rods that are straight at rest: shaped tips are rejected. The number of time steps is quadratic in
//! the number of nodes.

use endowire_core::device::Device;
use endowire_core::{Result, Vec3};

use crate::explicit::{Integration, Mobility};
use crate::{Chain, NodalLoad, Outcome, Posture, RodModel, refuse_shape};

/// The method's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscreteRod {
    /// Damping relative to the critical damping of the slowest mode.
    pub damping: f64,
    /// Time step relative to the largest stable one.
    pub time_step: f64,
    /// Relative error of an edge's length at which projection stops.
    pub length_tolerance: f64,
    /// Largest number of time steps.
    pub max_iterations: usize,
}

impl Default for DiscreteRod {
    fn default() -> Self {
        Self { damping: 1.5, time_step: 0.9, length_tolerance: 1e-2, max_iterations: 1_000_000 }
    }
}

/// Largest number of iterations of one projection.
const PROJECTIONS: usize = 10;

impl RodModel for DiscreteRod {
    fn name(&self) -> &'static str {
        "discrete-rod"
    }

    fn check(&self, device: &Device) -> Result<()> {
        refuse_shape(self.name(), device, "is the paper's special case of a rod that is straight at rest")
    }

    fn relax(
        &self,
        chain: &Chain,
        load: &mut dyn NodalLoad,
        posture: &mut Posture,
        tolerance: f64,
    ) -> Outcome {
        let n = chain.segments();
        let joints: Vec<f64> = (0..n).map(|i| chain.joint_stiffness(i)).collect();
        let mut run = Integration::new(chain, 0.0, self.time_step, self.damping, tolerance);
        let mut before = posture.positions_mm.clone();
        let mut projection = Projection::new(chain, self.length_tolerance);
        projection.restore(&run, &mut posture.positions_mm);
        run.run(self.max_iterations, |run| {
            run.load(load, posture);
            bending(chain, &joints, posture, &mut run.force);
            before.copy_from_slice(&posture.positions_mm);
            for i in 1..=n {
                posture.positions_mm[i] += run.mobility(i).of(&run.impulse(i)) * run.dt;
            }
            projection.restore(run, &mut posture.positions_mm);
            // In equilibrium the velocity does not change: its change is the force not balanced by the edges.
            let mut out_of_balance: f64 = 0.0;
            for i in 1..=n {
                let new = (posture.positions_mm[i] - before[i]) / run.dt;
                let change = (new - run.velocity[i]).amax() / run.dt;
                out_of_balance = out_of_balance.max(run.masses[i] * change.max(run.drag * new.amax()));
                run.velocity[i] = new;
            }
            out_of_balance
        })
    }
}

/// Adds the bending forces. With a = e/|e|, b = f/|f| and χ = 1 + a·b, |κb|² = 4 (1 − a·b)/χ.
fn bending(chain: &Chain, joints: &[f64], posture: &Posture, force: &mut [Vec3]) {
    let mut a = chain.direction;
    let mut a_length = 0.0;
    for i in 0..chain.segments() {
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

/// Fast projection onto edges of given length: one tridiagonal system per iteration.
///
/// Mobilities of nodes are those of the time step that is projected ([`Integration::mobility`]). With their masses
/// alone, the force of a wall, implicit in the time step, and the tension of edges would be weighted differently, and
/// the rod would never come to rest in contact.
struct Projection {
    squares: Vec<f64>,
    tolerance: f64,
    mobility: Vec<Mobility>,
    edges: Vec<Vec3>,
    /// Effect of each edge's tension on its near and its far node.
    moves: Vec<[Vec3; 2]>,
    diagonal: Vec<f64>,
    above: Vec<f64>,
    multipliers: Vec<f64>,
}

impl Projection {
    fn new(chain: &Chain, tolerance: f64) -> Self {
        let n = chain.segments();
        Self {
            squares: chain.lengths_mm.iter().map(|h| h * h).collect(),
            tolerance,
            // The clamp does not move.
            mobility: vec![Mobility::default(); n + 1],
            edges: vec![Vec3::zeros(); n],
            moves: vec![[Vec3::zeros(); 2]; n],
            diagonal: vec![0.0; n],
            above: vec![0.0; n],
            multipliers: vec![0.0; n],
        }
    }

    fn restore(&mut self, run: &Integration, x: &mut [Vec3]) {
        let n = self.edges.len();
        for i in 1..=n {
            self.mobility[i] = run.mobility(i);
        }
        for _ in 0..PROJECTIONS {
            let mut largest: f64 = 0.0;
            for i in 0..n {
                let edge = x[i + 1] - x[i];
                self.edges[i] = edge;
                self.multipliers[i] = edge.norm_squared() - self.squares[i];
                largest = largest.max(self.multipliers[i].abs() / self.squares[i]);
                // ∇C of C = |e|² − h² is −2e on the near node and 2e on the far one.
                self.moves[i] = [self.mobility[i].of(&(edge * -2.0)), self.mobility[i + 1].of(&(edge * 2.0))];
            }
            if !largest.is_finite() {
                return;
            }
            // ∇C W ∇Cᵀ, W the mobility.
            for i in 0..n {
                let [near, far] = self.moves[i];
                self.diagonal[i] = 2.0 * self.edges[i].dot(&(far - near));
                if i + 1 < n {
                    self.above[i] = -2.0 * far.dot(&self.edges[i + 1]);
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
                for (node, way) in self.moves[i].iter().enumerate() {
                    x[i + node] -= way * self.multipliers[i];
                }
            }
            // At least one iteration per step: convergence is quadratic, so the lengths settle with the rod.
            if largest <= 2.0 * self.tolerance {
                return;
            }
        }
    }
}
