//! Algorithm 1 of the paper, step by step, for a catheter that enters through a sheath.
//!
//! The paper leaves open how the chain grows while it is pushed by fractions of an element. Here nodes sit at whole
//! multiples of the element length from the tip, as marks on the device, and enter with it; only the first element,
//! between the sheath and the first such node, has another length: between half and one and a half elements, so that
//! no sliver arises.
//!
//! It also leaves open what collides. A node does here if its surface reaches the wall, which its distance to the
//! nearest triangle tells (not to the plane of that triangle, which goes on where the wall does not), before or after the
//! translation: seen only after it, pulling would lift every node off the outside of a bend, and the next solve would
//! shoot the wire straight through the wall.

use serde::{Deserialize, Serialize};

use super::chain::{Chain, PlaneContact};
use super::{banded, dense};
use endowire_core::device::Device;
use endowire_core::insertion::{Command, Contact, Energy, StepReport, Surroundings, nodes_from_tip};
use endowire_core::methods::{ChainState, Content, Method, State, TouchedPlane, check_inserted};
use endowire_core::shape::Shape;
use endowire_core::vessel::WallQuery;
use endowire_core::{Error, Result, Vec3};

/// Options of the paper's method.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Li2011Options {
    /// Element (segment) length l, mm.
    pub element_mm: f64,
    /// Wall stiffness κ per contact node, N/mm.
    pub wall_stiffness_n_per_mm: f64,
}

impl Default for Li2011Options {
    /// The middle column of the paper's Table 2; the paper does not print κ, and 1 N/mm holds a 5 N·mm² wire
    /// within some hundredths of a millimetre of the wall.
    fn default() -> Self {
        Self { element_mm: 2.0, wall_stiffness_n_per_mm: 1.0 }
    }
}

/// Which of the two solves of the same equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinearSolver {
    /// A B⁻¹ x = b, dense.
    Dense,
    /// Block elimination along the chain.
    Banded,
}

/// A node is never lost: wherever one solve has thrown it, the next finds its nearest triangle, as the hierarchy of
/// the paper's reference 22 would.
const REACH_MM: f64 = f64::MAX;
/// Collisions are detected at positions rounded to this, mm. A wire in a plane of symmetry of the mesh lies on the
/// boundary between two triangles, where the twelfth digit of the last solve would choose one, and with it a branch
/// millimetres away: that digit is no reason.
const DETECTION_GRID_MM: f64 = 1e-6;
/// Most elements: (3n)² numbers of 8 bytes in four matrices are 0.6 GB at 1,500 for the dense solve, and one step takes
/// seconds.
const ELEMENT_LIMIT_DENSE: f64 = 1_500.0;
/// Most elements of the banded solve.
const ELEMENT_LIMIT_BANDED: f64 = 100_000.0;
/// Retracting to within this of the sheath, mm, is retracting to it: the rounding of summed increments.
const ZERO_LENGTH_MM: f64 = 1e-9;

/// The paper's method as an insertion: see the [module docs](super) for what it leaves out.
#[derive(Debug, Clone)]
pub struct Li2011 {
    options: Li2011Options,
    solver: LinearSolver,
    state: ChainState,
    // The rest is worked with and made anew by every step.
    chain: Chain,
    workspace: banded::Workspace,
    from_tip_mm: Vec<f64>,
    positions_mm: Vec<Vec3>,
    tangents: Vec<Vec3>,
}

/// The plane of the triangle nearest to `x`, if a surface of radius `radius_mm` about `x` reaches that triangle.
///
/// Past the end of the vessel there is no wall.
fn reached(query: &WallQuery, x: &Vec3, radius_mm: f64) -> Option<TouchedPlane> {
    let x = &x.map(|c| (c / DETECTION_GRID_MM).round() * DETECTION_GRID_MM);
    let near = query.nearest(x, REACH_MM).filter(|near| !near.rim)?;
    let depth_mm = radius_mm - near.distance_mm;
    let normal = query.inward_normal(near.triangle);
    let offset_mm = normal.dot(&near.point_mm) + radius_mm;
    let reaches = depth_mm > DETECTION_GRID_MM && offset_mm - normal.dot(x) > DETECTION_GRID_MM;
    reaches.then_some(TouchedPlane { normal, offset_mm, triangle: near.triangle, depth_mm })
}

impl Li2011 {
    /// The method with nothing inserted.
    ///
    /// # Errors
    /// An element length or wall stiffness that is not positive, a number of nodes beyond memory, or a wall with friction or
    /// regions.
    pub fn new(
        options: Li2011Options,
        solver: LinearSolver,
        surroundings: &Surroundings<'_>,
    ) -> Result<Self> {
        let length_mm = surroundings.device.length_mm();
        endowire_core::error::in_range("method.element_mm", options.element_mm, length_mm)?;
        endowire_core::error::in_range(
            "method.wall_stiffness_n_per_mm",
            options.wall_stiffness_n_per_mm,
            1e9,
        )?;
        surroundings.properties.refuse_regions("the paper's method")?;
        surroundings.refuse_motion("the paper's method")?;
        surroundings.sheath.refuse_friction("the paper's method")?;
        if surroundings.properties.friction > 0.0 {
            return Err(Error::parameter(
                "vessel.wall.friction",
                surroundings.properties.friction,
                "the paper's method has no friction: set it to 0 or use the method kirchhoff",
            ));
        }
        let limit = match solver {
            LinearSolver::Dense => ELEMENT_LIMIT_DENSE,
            LinearSolver::Banded => ELEMENT_LIMIT_BANDED,
        };
        let elements = length_mm / options.element_mm;
        if elements > limit {
            return Err(Error::parameter(
                "method.element_mm",
                options.element_mm,
                format!(
                    "cuts the device of {length_mm} mm into {} elements, more than the {limit} that this method takes: use \
                     longer elements",
                    endowire_core::error::number(elements.ceil())
                ),
            ));
        }
        let sheath = surroundings.sheath;
        let shape = Shape {
            positions_mm: vec![sheath.position_mm],
            tangents: vec![sheath.direction],
            from_tip_mm: vec![0.0],
        };
        Ok(Self {
            options,
            solver,
            state: ChainState {
                shape,
                report: StepReport { converged: true, ..Default::default() },
                touched: Vec::new(),
            },
            chain: Chain {
                start_mm: sheath.position_mm,
                start_tangent: sheath.direction,
                wall_stiffness_n_per_mm: options.wall_stiffness_n_per_mm,
                ..Default::default()
            },
            workspace: banded::Workspace::default(),
            from_tip_mm: Vec::new(),
            positions_mm: Vec::new(),
            tangents: Vec::new(),
        })
    }

    /// The chain of the last step, with its contacts: the linear system that was solved.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Steps 1 and 2 of Algorithm 1: the nodes of the new inserted length, rigidly translated along the sheath.
    fn translate(&mut self, device: &Device, inserted_mm: f64, travel_mm: f64) {
        nodes_from_tip(inserted_mm, self.options.element_mm, &mut self.from_tip_mm);
        let elements = self.from_tip_mm.len() - 1;

        let displacement = self.chain.start_tangent * travel_mm;
        self.positions_mm.clear();
        let mut element = 0;
        for &s in &self.from_tip_mm[1..] {
            self.positions_mm.push(on_curve(&self.state.shape, s, &mut element) + displacement);
        }

        self.chain.lengths_mm.clear();
        self.chain.bending_stiffness_nmm2.clear();
        for ends in self.from_tip_mm.windows(2) {
            self.chain.lengths_mm.push(ends[0] - ends[1]);
            let middle = 0.5 * (ends[0] + ends[1]);
            self.chain.bending_stiffness_nmm2.push(device.section_at(middle).bending_stiffness_nmm2);
        }
        self.chain.forces_n.clear();
        self.chain.forces_n.resize(elements, Vec3::zeros());
    }

    /// Step 3: the nodes whose surface is beyond the wall, each with the plane of its nearest triangle.
    fn collide(&mut self, surroundings: &Surroundings<'_>) {
        self.chain.contacts.clear();
        let nodes = self.positions_mm.len();
        for (index, x) in self.positions_mm.iter().enumerate() {
            let radius_mm = surroundings.device.section_at(self.from_tip_mm[index + 1]).radius_mm;
            let before = self.state.touched.get(nodes - 1 - index).copied().flatten();
            if let Some(TouchedPlane { normal, offset_mm, triangle, .. }) =
                reached(surroundings.query, x, radius_mm).or(before)
            {
                self.chain.contacts.push(PlaneContact { node: index + 1, normal, offset_mm, triangle });
            }
        }
    }

    /// Steps 4 and 5: the linear system.
    fn solve(&mut self) -> Result<()> {
        match self.solver {
            LinearSolver::Dense => dense::solve(&self.chain, &mut self.positions_mm, &mut self.tangents),
            LinearSolver::Banded => {
                banded::solve(&self.chain, &mut self.workspace, &mut self.positions_mm, &mut self.tangents);
            }
        }
        if self.positions_mm.iter().chain(&self.tangents).all(|v| v.iter().all(|c| c.is_finite())) {
            return Ok(());
        }
        Err(Error::Computation(format!(
            "li2011: the linear system of {} nodes and {} contacts has no finite solution: \
             lower method.wall_stiffness_n_per_mm or use longer elements",
            self.chain.elements(),
            self.chain.contacts.len()
        )))
    }

    /// Step 6, and the read-outs.
    fn update(&mut self, surroundings: &Surroundings<'_>, command: Command) {
        let sheath = surroundings.sheath;
        let ChainState { shape, report, touched } = &mut self.state;
        shape.positions_mm.clear();
        shape.positions_mm.push(sheath.position_mm);
        shape.positions_mm.extend_from_slice(&self.positions_mm);
        shape.tangents.clear();
        shape.tangents.push(sheath.direction);
        shape.tangents.extend_from_slice(&self.tangents);
        shape.from_tip_mm.clone_from(&self.from_tip_mm);

        report.inserted_mm = self.from_tip_mm[0];
        report.rotation_rad += command.rotate_rad;
        // Without twist the tip turns with the hand.
        report.tip_rotation_rad = report.rotation_rad;
        report.energy = Energy {
            bend: self.chain.bending_energy_mj(&self.tangents),
            twist: 0.0,
            wall: self.chain.wall_energy_mj(&self.positions_mm),
        };
        report.iterations = 1;

        report.max_penetration_mm = 0.0;
        touched.clear();
        for (x, s) in self.positions_mm.iter().zip(&self.from_tip_mm[1..]).rev() {
            let plane = reached(surroundings.query, x, surroundings.device.section_at(*s).radius_mm);
            report.max_penetration_mm = plane.map_or(0.0, |p| p.depth_mm).max(report.max_penetration_mm);
            touched.push(plane);
        }
        let nodes = self.positions_mm.len();
        let touching = (1..=nodes).filter_map(|node| Some((node, touched[nodes - node]?.triangle)));
        report.converged = self.chain.contacts.iter().map(|c| (c.node, c.triangle)).eq(touching);

        report.contacts.clear();
        let mut held_by = Vec3::zeros();
        for contact in &self.chain.contacts {
            let position_mm = self.positions_mm[contact.node - 1];
            let force_n = self.chain.contact_force_n(contact, &self.positions_mm);
            held_by += contact.normal * force_n;
            report.contacts.push(Contact {
                position_mm,
                normal: contact.normal,
                force_n,
                friction_n: Vec3::zeros(),
                penetration_mm: touched[nodes - contact.node].map_or(0.0, |plane| plane.depth_mm),
                triangle: contact.triangle,
            });
        }
        report.push_force_n = match (self.tangents.first(), self.chain.lengths_mm.first()) {
            (Some(t1), Some(h1)) => {
                let bending = t1 - sheath.direction;
                -held_by.dot(&sheath.direction)
                    - 0.5 * self.chain.bending_stiffness_nmm2[0] * bending.norm_squared() / (h1 * h1)
            }
            _ => 0.0,
        };
    }
}

impl Method for Li2011 {
    fn step(&mut self, surroundings: &Surroundings<'_>, command: Command) -> Result<()> {
        let inserted_mm = self.state.report.inserted_mm + command.advance_mm;
        let inserted_mm = if inserted_mm < ZERO_LENGTH_MM { 0.0 } else { inserted_mm };
        self.translate(surroundings.device, inserted_mm, command.advance_mm);
        self.collide(surroundings);
        self.solve()?;
        self.update(surroundings, command);
        Ok(())
    }

    fn shape(&self) -> &Shape {
        &self.state.shape
    }

    fn report(&self) -> &StepReport {
        &self.state.report
    }

    fn state(&self) -> State {
        State::new(self.solver.method(), Content::Chain(Box::new(self.state.clone())))
    }

    fn restore(&mut self, surroundings: &Surroundings<'_>, state: &State) -> Result<()> {
        let name = self.solver.method();
        let Content::Chain(state) = state.of(name)? else { return Err(state.of_another(name)) };
        let inserted_mm = state.report.inserted_mm;
        check_inserted(inserted_mm, surroundings.device)?;
        nodes_from_tip(inserted_mm, self.options.element_mm, &mut self.from_tip_mm);
        let (shape, nodes) = (&state.shape, self.from_tip_mm.len());
        let moved = shape.positions_mm.first() != Some(&surroundings.sheath.position_mm)
            || shape.tangents.first() != Some(&surroundings.sheath.direction);
        let planes = [0, nodes - 1].contains(&state.touched.len());
        if shape.from_tip_mm != self.from_tip_mm || shape.tangents.len() != nodes || !planes || moved {
            let mend =
                format!("{nodes} nodes are in this vessel from this sheath: restore a state of this scene");
            return Err(Error::parameter("state.nodes", shape.len(), mend));
        }
        self.state.clone_from(state);
        Ok(())
    }

    fn boxed_clone(&self) -> Box<dyn Method> {
        Box::new(self.clone())
    }
}

impl LinearSolver {
    /// Name of the method in scenes and states.
    pub(crate) fn method(self) -> &'static str {
        match self {
            Self::Dense => "li2011-dense",
            Self::Banded => "li2011-banded",
        }
    }
}

/// Position at arc length `s` from the tip on a chain with linear tangents; beyond the sheath, straight back in it.
///
/// `element` is where to start looking, updated to where `s` was found: calls go from the sheath to the tip.
fn on_curve(shape: &Shape, s: f64, element: &mut usize) -> Vec3 {
    let (x, t, from_tip) = (&shape.positions_mm, &shape.tangents, &shape.from_tip_mm);
    if s >= from_tip[0] || shape.len() == 1 {
        return x[0] - t[0] * (s - from_tip[0]);
    }
    while *element + 2 < shape.len() && from_tip[*element + 1] > s {
        *element += 1;
    }
    let (a, b) = (*element, *element + 1);
    let h = from_tip[a] - from_tip[b];
    let along = from_tip[a] - s;
    x[a] + t[a] * along + (t[b] - t[a]) * (0.5 * along * along / h)
}

#[cfg(test)]
mod tests {
    use super::*;
    use endowire_core::vessel::{SurfaceMesh, Wall};

    /// A box with a narrow wedge from its far side up to z = 20: a carina.
    fn wedge() -> WallQuery {
        let profile = [[0., 20.], [-1., 60.], [-10., 60.], [-10., 0.], [10., 0.], [10., 60.], [1., 60.]];
        let n = profile.len() as u32;
        let mut mesh = SurfaceMesh::default();
        for y in [-10.0, 10.0] {
            mesh.vertices_mm.extend(profile.map(|[x, z]| Vec3::new(x, y, z)));
        }
        for k in 0..n {
            let next = (k + 1) % n;
            mesh.triangles.extend([[k, next, k + n], [next, next + n, k + n]]);
        }
        for k in 1..n - 1 {
            mesh.triangles.extend([[0, k + 1, k], [n, n + k, n + k + 1]]);
        }
        WallQuery::new(&Wall::from_surface(&mesh).unwrap()).unwrap()
    }

    #[test]
    fn a_node_in_front_of_a_wedge_touches_it_only_where_it_is_near() {
        let query = wedge();
        let reach = |z: f64| reached(&query, &Vec3::new(0.0, 0.5, z), 0.4);
        // Beyond the planes of both flanks, and five millimetres away from them.
        assert!(reach(15.0).is_none());
        assert!(reach(19.59).is_none());
        let depth_mm = reach(19.9).map(|plane| plane.depth_mm).unwrap();
        assert!((depth_mm - 0.3).abs() < 1e-6, "{depth_mm}");
        // Behind the edge, inside the wedge: the distance is negative.
        assert!(reach(21.0).unwrap().depth_mm > 0.4);
    }
}
