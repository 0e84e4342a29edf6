//! What instruments that lie in one another exert on each other across the line.
//!
//! An instrument, with all that lies in it, is a rod of its own on the same line. What its elements lack at a node is what the instruments
//! outside it give: its own bending moment, differentiated twice, with its own axial force, as the mesh has them,
//!
//! ```text
//! fᵢ = ∂U_inner/∂xᵢ + ∂(N_e c_e)/∂xᵢ,    across the line
//! ```
//!
//! The line knows its axial force and not that of each instrument. But moved along the line by the virtual displacement δxᵢ = tᵢ,
//! δtᵢ = κᵢ at one node, an instrument does work against friction alone. From its tip on that tells the axial force of one element after the
//! other; where its tip is not covered it is that of the line. At ends of instruments, where stiffness jumps, the others exert a couple too,
//! as the play between them is none, and forces there stand for less length than elsewhere.
//!
//! Instruments keep their lengths and share the line, so that one slips in another everywhere by the difference Δ of what their hands do, and
//! friction along the line is μ|fᵢ| against it wherever they go on slipping. It is a force within the line, and bends nothing. It is felt by both hands,
//! and builds up in the axial force: around a bend by e^{μφ}, the capstan's law. It depends on nothing that is solved for but what presses,
//! and is told of an equilibrium that was found without it. Instruments that go together exert none.

use super::coaxial::element;
use super::mesh::Mesh;
use super::state::KirchhoffState;
use crate::Vec3;
use crate::device::{Stack, line_mm};
use crate::methods::LateralForce;
use crate::rod::element::ElementSystem;
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{Layout, RodState, element_system};

/// Rounds in which the axial force behind a node and the friction there are found: each is nearer by μ times half the angle of an element.
const ROUNDS: usize = 12;
/// Least slip, mm: less is the rounding of lengths.
pub(super) const LEAST_SLIP_MM: f64 = 1e-9;

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

/// Forces on an instrument and all that lies in it by those outside it, at every node of the line, sheath first, after the hands have gone by
/// `motions`.
pub(super) fn lateral_forces<const C: usize>(
    stack: &Stack,
    mesh: &Mesh,
    state: &KirchhoffState,
    motions: &[[f64; 2]],
    instrument: usize,
) -> Vec<LateralForce> {
    let mut told = vec![LateralForce::default(); mesh.from_tip_mm.len()];
    let Some((own, outside)) = mesh.inserted_mm.split_at_checked(instrument + 1) else { return told };
    let [inside_mm, outside_mm, line] =
        [own, outside, &mesh.inserted_mm].map(|all| line_mm(all.iter().copied()));
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
        let (along, rate) = (known.along(&t, &curvature), far_pull.along(&t, &curvature));
        let drag = drag(stack, mesh, motions, (i, instrument));
        let mut tension = -along / rate;
        let across = |tension: f64| {
            let force = known.plus(&far_pull, tension).force;
            force - t * t.dot(&force)
        };
        // What presses depends on the axial force behind the node, by the angle that the line turns there.
        for _ in 0..if drag == 0.0 { 0 } else { ROUNDS } {
            tension = (drag * across(tension).norm() - along) / rate;
        }
        if i <= last {
            let force_n = across(tension);
            let after = mesh.elements.get(i).filter(|_| i < last).map_or(0.0, |data| data.length);
            let length_mm = 0.5 * (mesh.elements[i - 1].length + after);
            let friction_n = drag * force_n.norm();
            told[i] = LateralForce { force_n, length_mm, tension_n: tension, friction_n };
        }
        beyond = near.plus(&near_pull, tension);
    }
    told
}

/// The instrument that rubs on another just behind a node, of those in `instrument` and itself, and that other.
pub(super) fn pair(mesh: &Mesh, (i, instrument): (usize, usize)) -> Option<(usize, usize)> {
    let place = mesh.from_tip_mm[0] - 0.5 * (mesh.from_tip_mm[i - 1] + mesh.from_tip_mm[i]);
    let there = |k: &usize| mesh.inserted_mm[*k] > place;
    Some(((0..=instrument).rev().find(there)?, (instrument + 1..mesh.inserted_mm.len()).find(there)?))
}

/// Slip of an instrument in one outside it, mm; what is less than the rounding of lengths is none.
pub(super) fn slip_mm(motions: &[[f64; 2]], (inner, outer): (usize, usize)) -> f64 {
    let advance = |k: usize| motions.get(k).map_or(0.0, |motion| motion[0]);
    let slip = advance(inner) - advance(outer);
    if slip.abs() > LEAST_SLIP_MM { slip } else { 0.0 }
}

/// Friction along the line on what is inside at a node, over the force across it.
fn drag(stack: &Stack, mesh: &Mesh, motions: &[[f64; 2]], at: (usize, usize)) -> f64 {
    let Some((inner, outer)) = pair(mesh, at).filter(|(inner, _)| stack.friction(*inner) > 0.0) else {
        return 0.0;
    };
    match slip_mm(motions, (inner, outer)) {
        0.0 => 0.0,
        slip => -stack.friction(inner) * slip.signum(),
    }
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
