//! What instruments that lie in one another exert on each other across the line.
//!
//! An instrument, with all that lies in it, is a rod of its own on the same line. What its elements lack at a node is what the instruments
//! outside it give: its own bending moment, differentiated twice, with its own axial force, as the mesh has them,
//!
//! ```text
//! fᵢ = ∂U_inner/∂xᵢ + ∂(N_e c_e)/∂xᵢ,    across the line
//! ```
//!
//! The line knows its axial force and not that of each instrument. But an instrument slides in the others without friction: moved along the
//! line by the virtual displacement δxᵢ = tᵢ, δtᵢ = κᵢ at one node, it does no work. From its tip on that tells the axial force of one
//! element after the other; where its tip is not covered it is that of the line. At ends of instruments, where stiffness jumps, the others
//! exert a couple too, as the play between them is none, and forces there stand for less length than elsewhere.

use super::coaxial::{element, line_mm};
use super::mesh::Mesh;
use super::state::KirchhoffState;
use crate::Vec3;
use crate::device::Stack;
use crate::insertion::LateralForce;
use crate::rod::element::ElementSystem;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{Layout, RodState, element_system};

/// A force at a node, and that in the turn of its tangent.
#[derive(Debug, Clone, Copy, Default)]
struct NodeForce {
    force: Vec3,
    turn: [f64; 2],
}

impl NodeForce {
    fn of<const C: usize>(gradient: &[f64; C], position: usize, tangent: usize) -> Self {
        let force = Vec3::new(gradient[position], gradient[position + 1], gradient[position + 2]);
        Self { force, turn: [gradient[tangent], gradient[tangent + 1]] }
    }

    /// `self` and `factor` times another.
    fn plus(&self, other: &Self, factor: f64) -> Self {
        let turn = [0, 1].map(|a| self.turn[a] + factor * other.turn[a]);
        Self { force: self.force + other.force * factor, turn }
    }

    /// Work on a unit displacement along the line.
    fn along(&self, tangent: &Vec3, curvature: &[f64; 2]) -> f64 {
        self.force.dot(tangent) + self.turn[0] * curvature[0] + self.turn[1] * curvature[1]
    }
}

/// Forces on an instrument and all that lies in it by those outside it, at every node of the line, sheath first.
pub(super) fn lateral_forces<const C: usize>(
    stack: &Stack,
    mesh: &Mesh,
    state: &KirchhoffState,
    instrument: usize,
) -> Vec<LateralForce> {
    let mut told = vec![LateralForce::default(); mesh.from_tip_mm.len()];
    let Some((own, outside)) = mesh.inserted_mm.split_at_checked(instrument + 1) else { return told };
    let (inside_mm, outside_mm, line) = (line_mm(own), line_mm(outside), line_mm(&mesh.inserted_mm));
    let reach_mm = own[instrument].min(outside_mm);
    if reach_mm == 0.0 {
        return told;
    }
    let first = mesh.nearest_node(line - inside_mm.min(outside_mm));
    let last = mesh.nearest_node(line - reach_mm);
    let rod = &state.rod;
    // Beyond the others it is alone, with the axial force of the line.
    let mut beyond = NodeForce::default();
    if inside_mm > outside_mm && first < mesh.elements.len() {
        let [near, _, pull, _] = parts::<C>(stack, mesh, rod, (first, instrument));
        let wall = wall_force(mesh, state, (first, instrument));
        beyond = near.plus(&pull, rod.tensions[first]).plus(&wall, -1.0);
    }
    for i in (1..=first).rev() {
        let [near, far, near_pull, far_pull] = parts::<C>(stack, mesh, rod, (i - 1, instrument));
        let (t, curvature) = (rod.frames[i].t, curvature(mesh, rod, i));
        let known = beyond.plus(&far, 1.0);
        let tension = -known.along(&t, &curvature) / far_pull.along(&t, &curvature);
        if i <= last {
            let force = known.plus(&far_pull, tension).force;
            let after = mesh.elements.get(i).filter(|_| i < last).map_or(0.0, |data| data.length);
            let length_mm = 0.5 * (mesh.elements[i - 1].length + after);
            told[i] = LateralForce { force_n: force - t * t.dot(&force), length_mm };
        }
        beyond = near.plus(&near_pull, tension);
    }
    told
}

/// What element `e` of an instrument and those in it exerts at its near and its far node without axial force, and there with a unit of it.
fn parts<const C: usize>(
    stack: &Stack,
    mesh: &Mesh,
    rod: &RodState,
    (e, instrument): (usize, usize),
) -> [NodeForce; 4] {
    let ends = (mesh.from_tip_mm[e], mesh.from_tip_mm[e + 1]);
    let data = element(stack, &mesh.inserted_mm, instrument + 1, ends);
    let mut system = ElementSystem::<C>::zeros();
    let mut at = rod.element::<C>(e);
    at.tension = 0.0;
    element_system::<C, false>(&data, &at, 0.0, &mut system);
    let l = Layout::<C>;
    let both = |of: &[f64; C]| [0, 1].map(|i| NodeForce::of(of, l.position(i), l.tangent(i)));
    let ([near, far], [near_pull, far_pull]) = (both(&system.gradient), both(&system.stretch));
    [near, far, near_pull, far_pull]
}

/// Curvature of the line at a node along u and v of its triad: the mean of the elements beside it.
fn curvature(mesh: &Mesh, rod: &RodState, i: usize) -> [f64; 2] {
    let (mut sum, mut count) = (Vec3::zeros(), 0.0);
    for (e, xi) in [(i.wrapping_sub(1), 1.0), (i, 0.0)] {
        let Some(data) = mesh.elements.get(e) else { continue };
        let (t0, t1) = (rod.frames[e].t, rod.frames[e + 1].t);
        sum += Point::at(xi, 0.0).derivatives(&rod.chords[e], &t0, &t1).1 / data.length;
        count += 1.0;
    }
    [rod.frames[i].u, rod.frames[i].v].map(|axis| axis.dot(&sum) / count)
}

/// What the wall exerts at a node on an instrument and those in it, where it comes out of the others.
fn wall_force(mesh: &Mesh, state: &KirchhoffState, (i, instrument): (usize, usize)) -> NodeForce {
    let (rod, mut sum) = (&state.rod, NodeForce::default());
    let mut contacts = state.report.contacts.iter().peekable();
    for point in &mesh.points {
        let Some(contact) = contacts.peek() else { break };
        // Contacts are in the order of points.
        if point.position(&mesh.elements, rod) != contact.position_mm {
            continue;
        }
        let force = contact.total_n();
        contacts.next();
        let [w0, s0, w1, s1] = hermite(point.xi);
        let (weight, slope) = match point.element {
            e if e == i => (w0, s0),
            e if e + 1 == i => (w1, s1),
            _ => continue,
        };
        if point.instrument <= instrument {
            let slope = slope * mesh.elements[point.element].length;
            let turn = [rod.frames[i].u, rod.frames[i].v].map(|axis| axis.dot(&force) * slope);
            sum = sum.plus(&NodeForce { force: force * weight, turn }, 1.0);
        }
    }
    sum
}
