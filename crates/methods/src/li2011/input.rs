//! Algorithm 1 of the paper for one input of the hand: translation, collision detection, solution, and remaining
//! errors.
//!
//! The paper does not specify which nodes collide. Here a node does if its surface reaches the wall before or after
//! the translation: if only after it, pulling would lift every node off the outside of a bend, and the next solve
//! would throw the wire straight through the wall.
//!
//! One linear solve is exact up to second order in the motion of the input. The remaining error is measured: the
//! distance of the wall at each node from its position in the solve, and the distance of nodes with unit tangents
//! from those of the solve. Moreover, a wall cannot pull: planes treated as two-sided springs may pull at nodes that
//! have come off, on a stiff wall by micrometres with as much force as others press. Released at the next input and
//! met again at the one after, such nodes hold a wire back for tens of inputs. Forces are those of the solve, which
//! balance bending.

use endowire_core::contact::extension::left_through;
use endowire_core::insertion::{Contact, Energy, Surroundings, nodes_from_tip};
use endowire_core::methods::{ChainState, TouchedPlane};

use endowire_core::{Error, Result, Vec3};

use super::chain::{Chain, Spring};
use super::options::{Li2011Options, LinearSolver};
use super::slide::{TangentReading, translate};
use super::wall::{FeltWall, Met};
use super::{banded, dense};

/// Largest error, in radii of the device, of an input that has converged.
const CONVERGED_RADII: f64 = 0.1;
/// Largest pulling force of a plane in a converged input, relative to the largest pressing force.
const CONVERGED_PULL: f64 = 0.2;
/// Distance from the wall, in radii, within which a node that pressed at the last input is held to it.
const HOLD_RADII: f64 = 0.5;

/// Memory for computing inputs. An input reads a state and stores its result here.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub(super) options: Li2011Options,
    pub(super) solver: LinearSolver,
    pub(super) wall: FeltWall,
    pub(super) chain: Chain,
    pub(super) from_tip_mm: Vec<f64>,
    workspace: banded::Workspace,
    /// Contacts before the solve, by node.
    met: Vec<Option<Met>>,
    /// Positions before the solve, and a lower bound of each node's clearance there, mm.
    predicted_mm: Vec<Vec3>,
    clear_mm: Vec<f64>,
    /// Positions of the solve, before tangents were normalised: forces balance there.
    solved_mm: Vec<Vec3>,
    positions_mm: Vec<Vec3>,
    tangents: Vec<Vec3>,
    /// Penetration of each node's surface.
    depths_mm: Vec<f64>,
    /// Largest distance of the wall from its position in the solve, mm.
    misfit_mm: f64,
}

impl Input {
    pub(super) fn new(options: Li2011Options, solver: LinearSolver, wall: FeltWall, chain: Chain) -> Self {
        Self {
            options,
            solver,
            wall,
            chain,
            from_tip_mm: Vec::new(),
            workspace: banded::Workspace::default(),
            met: Vec::new(),
            predicted_mm: Vec::new(),
            clear_mm: Vec::new(),
            solved_mm: Vec::new(),
            positions_mm: Vec::new(),
            tangents: Vec::new(),
            depths_mm: Vec::new(),
            misfit_mm: 0.0,
        }
    }

    /// Steps 2 to 5 of Algorithm 1 from `state` to a new inserted length. Returns the remaining error: up to 1 it has
    /// converged.
    pub(super) fn work_out(
        &mut self,
        surroundings: &Surroundings<'_>,
        state: &ChainState,
        inserted_mm: f64,
    ) -> Result<f64> {
        self.translate(surroundings, state, inserted_mm);
        self.collide(surroundings, state);
        self.solve()?;
        Ok(self.left_over(surroundings))
    }

    /// Step 2: the nodes of the new inserted length, before the solve.
    fn translate(&mut self, surroundings: &Surroundings<'_>, state: &ChainState, inserted_mm: f64) {
        let travel_mm = inserted_mm - state.report.inserted_mm;
        nodes_from_tip(inserted_mm, self.options.element_mm, &mut self.from_tip_mm);
        let Chain { lengths_mm, bending_stiffness_nmm2, forces_n, directions, .. } = &mut self.chain;
        let from_tip_mm = &self.from_tip_mm;
        let moved = (&mut self.positions_mm, directions);
        translate(self.options.tangents, &state.shape, from_tip_mm, travel_mm, moved);
        lengths_mm.clear();
        bending_stiffness_nmm2.clear();
        for ends in from_tip_mm.windows(2) {
            lengths_mm.push(ends[0] - ends[1]);
            let middle = 0.5 * (ends[0] + ends[1]);
            bending_stiffness_nmm2.push(surroundings.device.section_at(middle).bending_stiffness_nmm2);
        }
        forces_n.clear();
        forces_n.resize(from_tip_mm.len() - 1, Vec3::zeros());
    }

    /// Step 3: collisions of the nodes, as springs.
    fn collide(&mut self, surroundings: &Surroundings<'_>, state: &ChainState) {
        self.chain.springs.clear();
        self.met.clear();
        self.clear_mm.clear();
        self.predicted_mm.clone_from(&self.positions_mm);
        let nodes = self.positions_mm.len();
        let stiffness_n_per_mm = self.options.wall_stiffness_n_per_mm;
        for (index, x) in self.positions_mm.iter().enumerate() {
            let radius_mm = surroundings.device.section_at(self.from_tip_mm[index + 1]).radius_mm;
            let before = state.touched.get(nodes - 1 - index).copied().flatten();
            let gap_mm = if before.is_some() { HOLD_RADII * radius_mm } else { 0.0 };
            let direction = self.chain.directions.get(index).unwrap_or(&self.chain.start_tangent);
            let met = self.wall.met(x, direction, (radius_mm, gap_mm));
            self.clear_mm.push(met.err().unwrap_or(0.0));
            // A plane extends beyond its triangle.
            let met = match self.wall {
                FeltWall::Triangle(_) => met.ok().or(before.map(|plane| Met { plane, across: None })),
                FeltWall::Smooth(..) => met.ok(),
            };
            self.met.push(met);
            let Some(Met { plane, across }) = met else { continue };
            let spring = Spring {
                node: index + 1,
                direction: plane.normal,
                offset_mm: plane.offset_mm,
                stiffness_n_per_mm,
            };
            self.chain.springs.push(spring);
            let pressed_n = before.map_or(stiffness_n_per_mm * plane.depth_mm, |plane| plane.force_n);
            if let Some((direction, curvature_per_mm)) = across.filter(|_| pressed_n > 0.0) {
                let (offset_mm, stiffness_n_per_mm) = (direction.dot(x), pressed_n * curvature_per_mm);
                self.chain.springs.push(Spring { direction, offset_mm, stiffness_n_per_mm, ..spring });
            }
        }
    }

    /// Steps 4 and 5: the linear system.
    fn solve(&mut self) -> Result<()> {
        match self.solver {
            LinearSolver::Dense => dense::solve(&self.chain, &mut self.solved_mm, &mut self.tangents),
            LinearSolver::Banded => {
                banded::solve(&self.chain, &mut self.workspace, &mut self.solved_mm, &mut self.tangents);
            }
        }
        match self.options.tangents {
            TangentReading::Unit => self.chain.normalise(&mut self.tangents, &mut self.positions_mm),
            TangentReading::Free => self.positions_mm.clone_from(&self.solved_mm),
        }
        if self.positions_mm.iter().chain(&self.tangents).all(|v| v.iter().all(|c| c.is_finite())) {
            return Ok(());
        }
        Err(Error::Computation(format!(
            "li2011: the linear system of {} nodes and {} contacts has no finite solution: \
             lower method.wall_stiffness_n_per_mm or use longer elements",
            self.chain.elements(),
            self.met.iter().flatten().count()
        )))
    }

    /// The remaining error of the input: 1 at the limit of convergence.
    fn left_over(&mut self, surroundings: &Surroundings<'_>) -> f64 {
        self.depths_mm.clear();
        self.misfit_mm = 0.0;
        let mut left_over = self.pull() / CONVERGED_PULL;
        for (index, (x, solved)) in self.positions_mm.iter().zip(&self.solved_mm).enumerate() {
            let radius_mm = surroundings.device.section_at(self.from_tip_mm[index + 1]).radius_mm;
            let clear = (x - self.predicted_mm[index]).norm() < self.clear_mm[index];
            let depth_mm = if clear { 0.0 } else { self.wall.depth_mm(x, radius_mm) };
            let taken_mm = self.met[index].map_or(0.0, |met| met.plane.offset_mm - met.plane.normal.dot(x));
            let misfit_mm = (taken_mm - depth_mm).abs();
            self.misfit_mm = self.misfit_mm.max(misfit_mm);
            left_over = left_over.max(misfit_mm.max((x - solved).norm()) / (CONVERGED_RADII * radius_mm));
            self.depths_mm.push(depth_mm);
        }
        left_over
    }

    /// Largest pulling force of a plane on a node, relative to the largest pressing one: a wall cannot pull.
    fn pull(&self) -> f64 {
        let (mut pull_n, mut press_n) = (0.0f64, 0.0f64);
        for (met, x) in self.met.iter().zip(&self.solved_mm) {
            let Some(Met { plane, .. }) = met else { continue };
            let force_n = plane.offset_mm - plane.normal.dot(x);
            (pull_n, press_n) = (pull_n.max(-force_n), press_n.max(force_n));
        }
        if pull_n > 0.0 { pull_n / press_n.max(pull_n) } else { 0.0 }
    }

    /// Step 6: the new state, except for the motion of the hand.
    pub(super) fn read_out(&self, surroundings: &Surroundings<'_>, state: &mut ChainState) {
        let sheath = surroundings.sheath;
        let ChainState { shape, report, touched } = state;
        shape.positions_mm.clear();
        shape.positions_mm.push(sheath.position_mm);
        shape.positions_mm.extend_from_slice(&self.positions_mm);
        shape.tangents.clear();
        shape.tangents.push(sheath.direction);
        shape.tangents.extend_from_slice(&self.tangents);
        shape.from_tip_mm.clone_from(&self.from_tip_mm);

        report.contacts.clear();
        touched.clear();
        let stiffness_n_per_mm = self.options.wall_stiffness_n_per_mm;
        let (mut held_by, mut wall_mj, mut largest_n) = (Vec3::zeros(), 0.0, 0.0f64);
        let nodes = self.positions_mm.iter().zip(&self.solved_mm).zip(&self.depths_mm);
        for (((x, solved), &depth_mm), met) in nodes.zip(&self.met) {
            let Some(Met { plane, .. }) = met else {
                touched.push(None);
                continue;
            };
            let taken_mm = plane.offset_mm - plane.normal.dot(solved);
            let force_n = stiffness_n_per_mm * taken_mm;
            largest_n = largest_n.max(force_n.abs());
            wall_mj += 0.5 * force_n * taken_mm;
            held_by += plane.normal * force_n;
            report.contacts.push(Contact {
                position_mm: *x,
                normal: plane.normal,
                force_n,
                friction_n: Vec3::zeros(),
                penetration_mm: depth_mm,
                triangle: plane.triangle,
            });
            let touches = force_n > 0.0 || depth_mm > 0.0;
            touched.push(touches.then_some(TouchedPlane { depth_mm, force_n, ..*plane }));
        }
        touched.reverse();
        report.inserted_mm = self.from_tip_mm[0];
        report.max_penetration_mm = self.depths_mm.iter().copied().fold(0.0, f64::max);
        let misfit_n = stiffness_n_per_mm * self.misfit_mm;
        report.imbalance = if misfit_n > 0.0 { misfit_n / largest_n.max(misfit_n) } else { 0.0 };
        let bend = self.chain.bending_energy_mj(&self.tangents);
        report.energy = Energy { bend, wall: wall_mj, ..Energy::default() };
        report.push_force_n = match (self.tangents.first(), self.chain.lengths_mm.first()) {
            (Some(t1), Some(h1)) => {
                let bending = t1 - sheath.direction;
                -held_by.dot(&sheath.direction)
                    - 0.5 * self.chain.bending_stiffness_nmm2[0] * bending.norm_squared() / (h1 * h1)
            }
            _ => 0.0,
        };
        let line = self.positions_mm.iter().copied();
        report.left_through =
            left_through(surroundings.lumen.openings(), line).map(|(opening, _)| opening.index);
    }
}
