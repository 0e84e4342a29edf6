//! A rod between flat walls: the bench of the contact cases.

use crate::contact::{FeltWall, Friction, WallContact, WallMemory};
use crate::device::Device;
use crate::insertion::{WallProperties, WallRegion};
use crate::methods::kirchhoff::mesh::Mesh;
use crate::rod::{Assembly, Clamp, ElementData, Frame, PLAIN, RodState, Supports};
use crate::solve::{External, Newton, NewtonOptions};
use crate::statics::Loads;
use crate::vessel::{SurfaceMesh, Wall};
use crate::{Error, Result, Vec3};
use nalgebra::Matrix3;

/// A rod along x from the origin in a channel whose walls are the planes y = floor and y = ceiling.
///
/// Two rigid plates without play hold the nodes in the plane z = 0: flat walls alone leave a buckled rod free to turn about
/// its axis and escape. In the plane they do nothing.
pub(super) struct Channel {
    walls: Walls,
    mesh: Mesh,
    memory: Memory,
    newton: Newton<PLAIN>,
    /// Loads on the nodes.
    pub(super) loads: Loads,
    /// What holds the ends.
    pub(super) supports: Supports,
    /// Where the rod is.
    pub(super) state: RodState,
}

struct Walls {
    felt: FeltWall,
    setup: Setup,
    /// Stiffness of the plates at a node.
    plates: f64,
}

/// The walls' energy at the points of `mesh`.
fn contact<'a>(walls: &'a Walls, mesh: &'a Mesh, memory: &'a mut Memory) -> WallContact<'a> {
    let (known, friction) = (&mut memory.known, &mut memory.friction);
    WallContact::new(&walls.felt, &mesh.points, known, friction, walls.setup.bending, true)
}

/// What contact remembers; there is no friction here.
#[derive(Default)]
struct Memory {
    known: WallMemory,
    friction: Friction,
}

/// What a channel is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Setup {
    /// Length of the rod.
    pub(super) length: f64,
    /// Its bending stiffness.
    pub(super) bending: f64,
    /// Its radius.
    pub(super) radius: f64,
    /// Elements.
    pub(super) elements: usize,
    /// Heights of the walls.
    pub(super) walls: [f64; 2],
    /// Their foundation modulus.
    pub(super) modulus: f64,
}

/// Stiffness of the plates at a node, over that of a rod of the element's length.
const PLATES: f64 = 1e3;

/// The walls, the plates and the loads as one energy.
pub(super) struct Outside<'a> {
    pub(super) contact: WallContact<'a>,
    pub(super) loads: &'a mut Loads,
    /// Stiffness of the plates at a node.
    pub(super) plates: f64,
}

impl External<PLAIN> for Outside<'_> {
    fn energy(&mut self, elements: &[ElementData], state: &RodState) -> f64 {
        let off: f64 = state.positions.iter().map(|x| x.z * x.z).sum();
        0.5 * self.plates * off
            + External::<PLAIN>::energy(&mut self.contact, elements, state)
            + External::<PLAIN>::energy(self.loads, elements, state)
    }

    fn add(&mut self, elements: &[ElementData], state: &RodState, assembly: &mut Assembly<PLAIN>) {
        self.loads.add(elements, state, assembly);
        self.contact.add(elements, state, assembly);
        for (i, x) in state.positions.iter().enumerate() {
            let force = Vec3::z() * (self.plates * x.z);
            assembly.external_energy += 0.5 * force.z * x.z;
            assembly.add_node(i, &force, &(Matrix3::from_diagonal(&Vec3::z()) * self.plates));
        }
    }

    fn obstructs(&self) -> bool {
        true
    }

    fn safe_fraction(&mut self, elements: &[ElementData], to: &RodState) -> f64 {
        External::<PLAIN>::safe_fraction(&mut self.contact, elements, to)
    }

    fn scale(&self) -> [f64; 2] {
        External::<PLAIN>::scale(&*self.loads)
    }
}

impl Channel {
    /// The channel with a straight rod in it, clamped at the origin.
    pub(super) fn new(setup: &Setup) -> Result<Self> {
        Self::with_regions(setup, 0.25 * setup.length, Vec::new())
    }

    /// The same with `region`s in walls whose triangles have sides of about `cell`.
    pub(super) fn with_regions(setup: &Setup, cell: f64, region: Vec<WallRegion>) -> Result<Self> {
        let Setup { length, bending, radius, elements, walls, modulus } = *setup;
        // So far away that no edge of the box is felt: each of three steps (the edge is drawn in, vertices reach there, points
        // feel these vertices) reaches at most a diagonal and a half of a cell.
        let aside = cell * (6.0 * (radius / cell).max(1.0)).ceil();
        let low = Vec3::new(-aside, walls[0], -aside);
        let high = Vec3::new(length + aside, walls[1], aside);
        let wall = Wall::from_surface(&cuboid(low, high, cell))?;
        let device = Device::uniform(length, radius, bending)?;
        let mut mesh = Mesh::default();
        mesh.build(&device, length, length / elements as f64, modulus);
        let state = RodState::straight(&mesh.elements, Vec3::zeros(), Frame::new(Vec3::x(), Some(Vec3::y())));
        let h = mesh.elements[0].length;
        let properties = WallProperties { modulus_n_per_mm2: modulus, friction: 0.0, region };
        let walls = Walls {
            felt: FeltWall::new(&wall, &device, &properties)?,
            setup: *setup,
            plates: PLATES * bending / (h * h * h),
        };
        Ok(Self {
            walls,
            newton: Newton::new(mesh.elements.len()),
            mesh,
            memory: Memory::default(),
            loads: Loads::default(),
            supports: Supports { start_tangent: true, start_angle: true, ..Supports::default() },
            state,
        })
    }

    /// Elements of the rod.
    pub(super) fn elements(&self) -> &[ElementData] {
        &self.mesh.elements
    }

    /// Moves the rod to a minimum of the energy.
    pub(super) fn solve(&mut self) -> Result<()> {
        let mut outside = Outside {
            contact: contact(&self.walls, &self.mesh, &mut self.memory),
            loads: &mut self.loads,
            plates: self.walls.plates,
        };
        let (elements, supports) = (&self.mesh.elements, &mut self.supports);
        let options = NewtonOptions::default();
        let report = self.newton.solve(elements, supports, &mut outside, &mut self.state, &options);
        match report.converged {
            true => Ok(()),
            false => Err(Error::Computation(format!("{} (residual {:.1e})", report.reason, report.residual))),
        }
    }

    /// Whether the state as it is, taken for an equilibrium, is a minimum.
    pub(super) fn is_stable(&mut self) -> bool {
        let mut outside = Outside {
            contact: contact(&self.walls, &self.mesh, &mut self.memory),
            loads: &mut self.loads,
            plates: self.walls.plates,
        };
        let elements = &self.mesh.elements;
        self.newton.assemble(elements, &self.supports, &mut outside, &self.state);
        let minimum = elements.len() + self.supports.conditions();
        self.newton.factor(elements, &self.supports).is_some_and(|inertia| inertia.negative == minimum)
    }

    /// What the clamp at the start exerts, at the state solved last.
    pub(super) fn clamp(&self) -> Clamp {
        Clamp::new::<PLAIN>(&self.newton.start_residual, &self.state)
    }

    /// Sum of the wall's forces on the rod.
    pub(super) fn wall_force(&mut self) -> Vec3 {
        let mut contact = contact(&self.walls, &self.mesh, &mut self.memory);
        let mut force = Vec3::zeros();
        for index in 0..self.mesh.points.len() {
            if let Some(touch) = contact.touch(&self.mesh.elements, &self.state, index) {
                force += touch.contact.normal * touch.contact.force_n;
            }
        }
        force
    }
}

/// The six faces of a box, in cells of about `cell`.
fn cuboid(low: Vec3, high: Vec3, cell: f64) -> SurfaceMesh {
    let mut mesh = SurfaceMesh::default();
    let size = high - low;
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = |k: usize| (size[k] / cell).round().max(1.0) as u32;
        let (m, n) = (count(a), count(b));
        for side in [low[axis], high[axis]] {
            let first = mesh.vertices_mm.len() as u32;
            for i in 0..=m {
                for j in 0..=n {
                    let mut x = low;
                    x[axis] = side;
                    x[a] += size[a] * f64::from(i) / f64::from(m);
                    x[b] += size[b] * f64::from(j) / f64::from(n);
                    mesh.vertices_mm.push(x);
                }
            }
            for i in 0..m {
                for j in 0..n {
                    let at = |i: u32, j: u32| first + i * (n + 1) + j;
                    let (p, q, r, s) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                    if side == high[axis] {
                        mesh.triangles.extend([[p, q, r], [p, r, s]]);
                    } else {
                        mesh.triangles.extend([[p, r, q], [p, s, r]]);
                    }
                }
            }
        }
    }
    mesh
}
