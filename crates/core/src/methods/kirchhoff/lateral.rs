//! Forces across the line between coaxial instruments.
//!
//! An instrument, with all inside it, is a rod of its own on the same line. The imbalance of its elements at a node
//! is the force of the instruments outside it: from its own bending moment, differentiated twice, and its own axial
//! force, as discretised,
//!
//! ```text
//! fᵢ = ∂U_inner/∂xᵢ + ∂(N_e c_e)/∂xᵢ,    across the line
//! ```
//!
//! Only the total axial force of the line is known, not that of each instrument. But in the virtual displacement
//! along the line δxᵢ = tᵢ, δtᵢ = κᵢ at one node, an instrument does work against friction alone. From its tip on
//! this yields the axial force element by element; where its tip is not covered it is that of the line. At ends of
//! instruments, where stiffness jumps, the others also exert a couple, since there is no clearance, and forces there
//! represent a smaller length than elsewhere.
//!
//! With play ([`super::rims`]) there is no couple at an end: the two press on each other at two places, which rub more.
//!
//! Friction along the line ([`crate::contact::Between`]) is internal to the line, and does not bend it. Both hands
//! feel it, and it changes the axial force: around a bend by e^{μφ}, the capstan equation, where everything slips.
//! Normal forces at a node are found together with it, from the tip on.

use super::environment::Environment;
use super::hands::steered;
use super::inner_friction::{pair, radius_mm};
use super::material::element;
use super::mesh::Mesh;
use super::meshed;
use super::rims::Pressed;
use super::state::KirchhoffState;
use crate::Vec3;
use crate::contact::InnerFriction;
use crate::device::{Stack, line_mm};
use crate::methods::LateralForce;
use crate::rod::element::{ElementState, ElementSystem};
use crate::rod::quadrature::{Point, hermite};
use crate::rod::{ElementData, Layout, Material, RodState, beyond, element_gradients, element_system};

/// A force at a node, and that in the rotation of its tangent.
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

    /// `self` plus `factor` times another.
    fn plus(&self, other: &Self, factor: f64) -> Self {
        let turn = [0, 1].map(|a| self.turn[a] + factor * other.turn[a]);
        Self { force: self.force + other.force * factor, turn }
    }

    /// Work in a unit displacement along the line.
    fn along(&self, tangent: &Vec3, curvature: &[f64; 2]) -> f64 {
        self.force.dot(tangent) + self.turn[0] * curvature[0] + self.turn[1] * curvature[1]
    }
}

/// The line at a state, with known forces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line<'a> {
    pub(super) stack: &'a Stack,
    pub(super) mesh: &'a Mesh,
    pub(super) rod: &'a RodState,
    /// Contact points in contact with the wall, and its force.
    pub(super) pressing: &'a [(usize, Vec3)],
    /// Friction between instruments, node by node, the innermost first; empty without friction.
    pub(super) inner_friction: &'a [InnerFriction],
    /// Largest number of iterations for the axial force behind a node and the friction there.
    pub(super) rounds: usize,
}

/// The forces across the line in a state on an instrument and all inside it from those outside, node by node; it is not the
/// outermost.
pub(super) fn lateral_forces_in<const C: usize>(
    environment: &Environment<'_>,
    state: &KirchhoffState,
    instrument: usize,
) -> Vec<LateralForce> {
    let KirchhoffState { hands, rod, inner_friction, touches, .. } = state;
    let mut mesh = Mesh::default();
    meshed(environment, hands, &mut mesh);
    let on_line = touches.iter().take_while(|(point, _)| *point < mesh.points.len());
    let pressing: Vec<_> = on_line.map(|(point, touch)| (*point, touch.contact.total_n())).collect();
    let line = Line {
        stack: &steered(environment.surroundings.stack, hands),
        mesh: &mesh,
        rod,
        pressing: &pressing,
        inner_friction,
        rounds: environment.options.tuning.friction.lateral_rounds,
    };
    lateral_forces::<C>(&line, instrument)
}

impl Line<'_> {
    /// Friction along the line on the inner instruments at a node, and the couple about it, mm, both relative to the
    /// force across the line.
    fn drag(&self, at: (usize, usize)) -> [f64; 2] {
        let pair = pair(self.mesh, at).filter(|(inner, _)| self.stack.friction(*inner) > 0.0);
        let Some((inner, _)) = pair.filter(|_| !self.inner_friction.is_empty()) else { return [0.0; 2] };
        let rub = self.inner_friction[at.0 * (self.mesh.inserted_mm.len() - 1) + inner];
        let radius_mm = radius_mm(self.stack, self.mesh, (at.0, inner));
        [rub.along, radius_mm * rub.around].map(|part| -self.stack.friction(inner) * part)
    }
}

impl Line<'_> {
    /// What presses at places near a node between an instrument, or the next one inside it, and those outside it, if there is friction
    /// between them.
    fn pressed<const C: usize>(&self, at: (usize, usize)) -> Pressed {
        let pair = pair(self.mesh, at).filter(|(inner, _)| self.stack.friction(*inner) > 0.0);
        pair.map_or_else(Pressed::default, |pair| {
            Pressed::at::<C>(self.stack, (self.mesh, self.rod), at.0, pair)
        })
    }
}

/// The node where an instrument, or one inside it, comes out of those outside it; `None` if none does.
pub(super) fn comes_out(mesh: &Mesh, instrument: usize) -> Option<usize> {
    let (own, outside) = mesh.inserted_mm.split_at_checked(instrument + 1)?;
    let [inside_mm, outside_mm] = [own, outside].map(|all| line_mm(all.iter().copied()));
    (inside_mm > outside_mm).then(|| mesh.nearest_node(mesh.from_tip_mm[0] - outside_mm))
}

/// Forces on an instrument and all inside it by those outside it, at every node of the line, sheath first.
pub(super) fn lateral_forces<const C: usize>(line: &Line<'_>, instrument: usize) -> Vec<LateralForce> {
    let Line { stack, mesh, rod, .. } = *line;
    let mut reported = vec![LateralForce::default(); mesh.from_tip_mm.len()];
    let Some((own, outside)) = mesh.inserted_mm.split_at_checked(instrument + 1) else { return reported };
    let [inside_mm, outside_mm, line_mm] =
        [own, outside, &mesh.inserted_mm].map(|all| line_mm(all.iter().copied()));
    let reach_mm = own[instrument].min(outside_mm);
    if reach_mm == 0.0 {
        return reported;
    }
    let first = mesh.nearest_node(line_mm - inside_mm.min(outside_mm));
    let last = mesh.nearest_node(line_mm - reach_mm);
    // Beyond the others it is alone, with the axial force of the line.
    let mut beyond = NodeForce::default();
    let parts = parts::<C>(stack, mesh, rod, (mesh.line().min(first + 1), instrument));
    if comes_out(mesh, instrument).is_some() && first < mesh.line() {
        let [near, _, pull, _] = parts[first];
        let wall = wall_force(line, (first, instrument));
        beyond = near.plus(&pull, rod.tensions[first]).plus(&wall, -1.0);
    }
    for i in (1..=first).rev() {
        let [near, far, near_pull, far_pull] = parts[i - 1];
        let (t, curvature) = (rod.frames[i].t, curvature(mesh, rod, i));
        let known = beyond.plus(&far, 1.0);
        let (along, rate) = (known.along(&t, &curvature), far_pull.along(&t, &curvature));
        let [drag, couple_mm] = line.drag((i, instrument));
        let mut tension = -along / rate;
        let across = |tension: f64| {
            let force = known.plus(&far_pull, tension).force;
            force - t * t.dot(&force)
        };
        let pressed = line.pressed::<C>((i, instrument));
        // The normal force depends on the axial force behind the node, through the angle of the line there.
        for _ in 0..if drag == 0.0 { 0 } else { line.rounds } {
            let next = (drag * pressed.sum_n(&across(tension)) - along) / rate;
            if next == tension {
                break;
            }
            tension = next;
        }
        if i <= last {
            let force_n = across(tension);
            let after = mesh.elements.get(i).filter(|_| i < last).map_or(0.0, |data| data.length);
            let length_mm = 0.5 * (mesh.elements[i - 1].length + after);
            let pressing_n = pressed.sum_n(&force_n);
            let [friction_n, friction_nmm] = [drag, couple_mm].map(|part| part * pressing_n);
            reported[i] =
                LateralForce { force_n, pressing_n, length_mm, tension_n: tension, friction_n, friction_nmm };
        }
        beyond = near.plus(&near_pull, tension);
    }
    reported
}

/// Forces of each of the first elements of an instrument and those inside it at its near and far node without axial
/// force, and per unit of axial force.
fn parts<const C: usize>(
    stack: &Stack,
    mesh: &Mesh,
    rod: &RodState,
    (count, instrument): (usize, usize),
) -> Vec<[NodeForce; 4]> {
    let l = Layout::<C>;
    let both = |of: &[f64; C]| [0, 1].map(|i| NodeForce::of(of, l.position(i), l.tangent(i)));
    let mut all = Vec::with_capacity(count);
    let data = |e: usize| inside(stack, mesh, (e, instrument));
    element_gradients::<C>(0..count, &data, rod, |_, gradient, stretch| {
        let ([near, far], [near_pull, far_pull]) = (both(gradient), both(stretch));
        all.push([near, far, near_pull, far_pull]);
    });
    // What tilts at the end of another one has a tangent of its own there.
    for e in (0..count).filter(|e| mesh.elements[*e].tilt.is_some()) {
        let Some((state, _)) = beyond(&mesh.elements[e], &rod.element::<C>(e)) else { continue };
        let mut own = ElementSystem::<C>::zeros();
        element_system::<C, false>(&data(e), &ElementState { tension: 0.0, ..state }, 0.0, &mut own);
        let ([near, far], [near_pull, far_pull]) = (both(&own.gradient), both(&own.stretch));
        all[e] = [near, far, near_pull, far_pull];
    }
    all
}

/// Element `e` of an instrument and those inside it. If all of them have angles, the mesh stores each separately.
fn inside(stack: &Stack, mesh: &Mesh, (e, instrument): (usize, usize)) -> ElementData {
    let sets = &stack.sets()[..=instrument];
    if sets.contains(&None) {
        let ends = (mesh.from_tip_mm[e], mesh.from_tip_mm[e + 1]);
        return element(stack, (&mesh.inserted_mm, instrument + 1), ends, mesh.flush_mm);
    }
    let whole = &mesh.elements[e];
    let mut data = ElementData::of(whole.length, Material::NONE);
    for set in sets.iter().flatten() {
        let own = &whole.materials[*set];
        for (sum, bending) in data.bending.iter_mut().zip(own.bending) {
            *sum += bending;
        }
        data.materials[*set] = *own;
    }
    data
}

/// Curvature of the line at a node along u and v of its triad: the mean of the adjacent elements.
fn curvature(mesh: &Mesh, rod: &RodState, i: usize) -> [f64; 2] {
    let (mut sum, mut count) = (Vec3::zeros(), 0.0);
    for (e, xi) in [(i.wrapping_sub(1), 1.0), (i, 0.0)] {
        let Some(data) = mesh.elements.get(e) else { continue };
        let (t0, t1) = (rod.frames[e].t, rod.frames[e + 1].t);
        sum += Point::at(xi, 0.0).derivatives(rod.chords[e], t0, t1).1 / data.length;
        count += 1.0;
    }
    [rod.frames[i].u, rod.frames[i].v].map(|axis| axis.dot(&sum) / count)
}

/// Force of the wall at a node on an instrument and those inside it, where it comes out of the others.
fn wall_force(line: &Line<'_>, (i, instrument): (usize, usize)) -> NodeForce {
    let mut sum = NodeForce::default();
    for (index, force) in line.pressing {
        let point = &line.mesh.points[*index];
        let [w0, s0, w1, s1] = hermite(point.xi);
        let (weight, slope) = match point.element {
            e if e == i => (w0, s0),
            e if e + 1 == i => (w1, s1),
            _ => continue,
        };
        if point.instrument <= instrument {
            let slope = slope * line.mesh.elements[point.element].length;
            let frame = &line.rod.frames[i];
            let turn = [frame.u, frame.v].map(|axis| axis.dot(force) * slope);
            sum = sum.plus(&NodeForce { force: force * weight, turn }, 1.0);
        }
    }
    sum
}
