//! Detached coils are solved for together with the line: as rods of their own behind its tip, each after a gap.
//!
//! Nothing holds a free rod. A small resistance to its motion,
//!
//! ```text
//! V = Σ ½ c wᵢ |xᵢ − x̄ᵢ|²,    c = RESISTANCE · EI / mm⁴
//! ```
//!
//! from its position at the start of the part of the command, makes the solution unique. It holds nothing for long:
//! the next part starts where this one ends.

use std::sync::Arc;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::loops::capsule;
use super::material::alone;
use super::mesh::{Fineness, Mesh};
use super::state::KirchhoffState;
use crate::contact::{Capsule, ContactPoint, KnownPoints, NormalForce};
use crate::device::Stack;
use crate::methods::DetachedCoil;
use crate::rod::{ElementData, RodState, Stencils};
use crate::shape::Shape;
use crate::solve::External;
use crate::{Error, Result, Vec3};

/// The configuration of a detached coil.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct FreeCoil {
    /// Index of the instrument whose coil it was.
    pub(super) instrument: usize,
    /// Arc lengths of its nodes from its tip, mm; the detached end first.
    pub(super) from_tip_mm: Vec<f64>,
    pub(super) rod: RodState,
    /// Normal forces at its contact points, tip first; empty without friction.
    pub(super) forces: Vec<NormalForce>,
    pub(super) known: KnownPoints,
}

/// All coils of a state, in the order of detachment; shared, since most states have none.
pub(super) type Coils = Arc<Vec<FreeCoil>>;

impl FreeCoil {
    /// The coil that is the front part of a line, up to one of its nodes.
    pub(super) fn from_line(mesh: &Mesh, state: &KirchhoffState, (instrument, node): (usize, usize)) -> Self {
        let from_tip_mm = mesh.from_tip_mm[node..].to_vec();
        // Contact points are in order from the tip.
        let points = mesh.points.partition_point(|point| point.from_tip_mm < from_tip_mm[0]);
        Self {
            instrument,
            from_tip_mm,
            rod: state.rod.part(node..mesh.from_tip_mm.len()),
            forces: state.forces.iter().take(points).copied().collect(),
            known: state.known.part(0..points),
        }
    }

    /// Its reported centre line.
    pub(super) fn reported(&self) -> DetachedCoil {
        DetachedCoil {
            instrument: self.instrument,
            shape: Shape {
                positions_mm: self.rod.positions.clone(),
                tangents: self.rod.frames.iter().map(|frame| frame.t).collect(),
                from_tip_mm: self.from_tip_mm.clone(),
            },
        }
    }

    /// Its elements and contact points; elements are counted from its first one.
    fn mesh(&self, stack: &Stack, fineness: Fineness, modulus_n_per_mm2: f64) -> Mesh {
        let device = &stack.instruments()[self.instrument].device;
        let set = stack.sets()[self.instrument];
        let mut mesh = Mesh::default();
        // The contact points are those of the whole instrument there.
        mesh.build_points(device, device.length_mm(), fineness, modulus_n_per_mm2);
        mesh.points.retain(|point| point.from_tip_mm < self.from_tip_mm[0]);
        let ends = self.from_tip_mm.windows(2).map(|ends| (ends[0], ends[1]));
        mesh.elements = ends.map(|ends| alone(device, set, ends, fineness.flush_mm())).collect();
        mesh.from_tip_mm.clone_from(&self.from_tip_mm);
        let mut e = mesh.elements.len() - 1;
        let mut points = std::mem::take(&mut mesh.points);
        for point in &mut points {
            let (element, xi) = mesh.place(point.from_tip_mm, &mut e);
            let (instrument, set) = (self.instrument, set.unwrap_or(0));
            *point = ContactPoint { element, xi, instrument, set, ..*point };
        }
        Mesh { points, ..mesh }
    }

    /// Checks that a restored coil is possible for these instruments, since a file may contain anything.
    pub(super) fn check(
        &self,
        stack: &Stack,
        (fineness, pieces): (Fineness, usize),
        (sets, has_friction): (usize, bool),
    ) -> Result<()> {
        let is_one = || {
            let coil_mm = stack.instruments().get(self.instrument)?.device.coil_mm();
            let (nodes, rod) = (self.from_tip_mm.len(), &self.rod);
            let falls = self.from_tip_mm.windows(2).all(|ends| ends[0] > ends[1] && ends[0].is_finite());
            if coil_mm == 0.0 || nodes < 2 || !falls || self.from_tip_mm.last() != Some(&0.0) {
                return None;
            }
            let points = self.mesh(stack, fineness, 1.0).points.len();
            let forces = if has_friction { points } else { 0 };
            let fits = rod.fits(nodes - 1, sets) && rod.is_finite() && self.forces.len() == forces;
            (fits && self.known.fits(points, pieces)).then_some(())
        };
        let remedy = "is no coil of this scene's instruments: restore a state of this scene";
        is_one().ok_or_else(|| Error::parameter("state.coils", self.instrument, remedy))
    }
}

/// Data of the coils beside their states.
#[derive(Debug, Clone, Default)]
pub(super) struct Joined {
    /// Instrument of each coil.
    instruments: Vec<usize>,
    /// For each coil a gap and its elements.
    elements: Vec<ElementData>,
    /// The surfaces of these elements.
    capsules: Vec<Capsule>,
    /// The contact points of all coils; their elements are counted from the first gap.
    points: Vec<ContactPoint>,
    /// Number of contact points of each coil.
    counts: Vec<usize>,
}

impl Joined {
    /// Sets the data for these coils.
    pub(super) fn renew(
        &mut self,
        coils: &[FreeCoil],
        stack: &Stack,
        fineness: Fineness,
        modulus_n_per_mm2: f64,
    ) {
        if self.instruments.iter().eq(coils.iter().map(|coil| &coil.instrument)) {
            return;
        }
        *self = Self::default();
        for coil in coils {
            let device = &stack.instruments()[coil.instrument].device;
            let mesh = coil.mesh(stack, fineness, modulus_n_per_mm2);
            let first = self.elements.len() + 1;
            self.instruments.push(coil.instrument);
            self.counts.push(mesh.points.len());
            self.elements.push(ElementData::BREAK);
            self.capsules.push(Capsule::NONE);
            self.elements.extend_from_slice(&mesh.elements);
            self.capsules.extend(
                mesh.elements
                    .iter()
                    .zip(mesh.from_tip_mm.windows(2))
                    .map(|(data, ends)| capsule(device, 0.5 * (ends[0] + ends[1]), data)),
            );
            let moved = |point: ContactPoint| ContactPoint { element: first + point.element, ..point };
            self.points.extend(mesh.points.into_iter().map(moved));
        }
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.instruments.is_empty()
    }

    /// The surfaces of gaps and coils.
    pub(super) fn capsules(&self) -> impl Iterator<Item = Capsule> + '_ {
        self.capsules.iter().copied()
    }

    /// Adds the coils to the mesh of a line.
    pub(super) fn add_to(&self, mesh: &mut Mesh) {
        let first = mesh.elements.len();
        mesh.elements.extend_from_slice(&self.elements);
        let moved = |point: &ContactPoint| ContactPoint { element: first + point.element, ..*point };
        mesh.points.extend(self.points.iter().map(moved));
    }

    /// Removes coils from a mesh and its rod; returns them at their positions there, with normal forces and knowledge
    /// of the wall.
    pub(super) fn take_off(
        &self,
        were: &[FreeCoil],
        mesh: &mut Mesh,
        after: &mut KirchhoffState,
    ) -> Vec<FreeCoil> {
        let line = mesh.elements.len() - self.elements.len();
        let mut points = mesh.points.len() - self.points.len();
        mesh.elements.truncate(line);
        mesh.points.truncate(points);
        let first = points;
        let mut node = line + 1;
        let coils = were.iter().zip(&self.counts).map(|(coil, count)| {
            let nodes = node..node + coil.from_tip_mm.len();
            let felt = points..points + count;
            (node, points) = (nodes.end, felt.end);
            FreeCoil {
                instrument: coil.instrument,
                from_tip_mm: coil.from_tip_mm.clone(),
                rod: after.rod.part(nodes),
                forces: after.forces.get(felt.clone()).unwrap_or_default().to_vec(),
                known: after.known.part(felt),
            }
        });
        let coils = coils.collect();
        after.rod.truncate(line + 1);
        after.forces.truncate(first);
        after.known.truncate(first);
        coils
    }
}

/// The rods of a line and of coils, one behind the other.
pub(super) fn join(line: &mut RodState, coils: &[FreeCoil]) {
    for coil in coils {
        line.join(&coil.rod);
    }
}

/// The resistance to motion of free rods.
pub(super) struct Resistance {
    /// Index of the first node with resistance.
    first: usize,
    /// Initial positions of the nodes, and stiffness of the resistance, N/mm.
    nodes: Vec<(Vec3, f64)>,
}

impl Resistance {
    /// For the rods from element `first` on, at their positions, with c in 1/mm⁴.
    pub(super) fn of(elements: &[ElementData], rod: &RodState, from: usize, per_mm4: f64) -> Self {
        let mut nodes: Vec<_> = rod.positions[from..].iter().map(|x| (*x, 0.0)).collect();
        for (e, element) in elements[from..].iter().enumerate().filter(|(_, data)| !data.is_break()) {
            let half = 0.5 * per_mm4 * element.bending[1] * element.length;
            nodes[e].1 += half;
            nodes[e + 1].1 += half;
        }
        Self { first: from, nodes }
    }
}

impl External for Resistance {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        into.add_value(self.value(elements, state));
        for (i, ((was, resists), is)) in self.nodes.iter().zip(&state.positions[self.first..]).enumerate() {
            let stiffness = Matrix3::from_diagonal_element(*resists);
            into.add_node(self.first + i, &((is - was) * *resists), &stiffness);
        }
    }

    fn value(&mut self, _elements: &[ElementData], state: &RodState) -> f64 {
        let nodes = self.nodes.iter().zip(&state.positions[self.first..]);
        nodes.map(|((was, resists), is)| 0.5 * resists * (is - was).norm_squared()).sum()
    }
}
