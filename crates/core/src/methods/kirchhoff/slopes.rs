//! Hand forces of several instruments: derivatives of the energy in the insertion and rotation of each.
//!
//! By the envelope theorem the derivative of the discrete energy in an inserted length is that in the mesh alone, at
//! fixed tangents, chords per length and angles: ends of the instrument and of its sections move with their nodes,
//! and so do its contact points. It is exact for the mesh. Only a few elements change, whose energies are
//! differenced; contact points and contacts between loops move, and do the work of their forces. Where an instrument
//! is twisted, the material arriving at a node has another angle than that before: unless the node moves with it, it
//! rotates by τ per length, against the couples of friction between instruments. The energy released by the sheath,
//! ½EI|κ⁰|² per length, is part of it.

use super::Environment;
use super::coaxial::Nodes;
use super::configuration::{Configuration, Start};
use super::hands::{HandForce, lengths};
use super::material::at_mouth;
use super::mesh::Mesh;
use crate::Vec3;
use crate::contact::{ContactPoint, Drag, Place, Pressing, RodPlace, Touch};
use crate::rod::quadrature::hermite;
use crate::rod::{ElementData, RodState, element_energy};

/// Step of finite differences, as a fraction of the shortest element.
const STEP: f64 = 1e-5;
/// Number of steps within which ends count as flush, and by which a contact point or its weight changes at most.
const MEET: f64 = 4.0;

/// Forces on the instruments beside those of the wall, and friction between them.
#[derive(Clone, Copy)]
pub(super) struct Acting<'a> {
    /// Friction between instruments.
    pub(super) between: &'a [Place],
    /// Contacts between loops.
    pub(super) loops: &'a [Pressing],
    pub(super) drag: Option<&'a Drag>,
}

/// Sets the forces of the hands of several instruments.
pub(super) fn set_hand_forces<const C: usize>(
    environment: &Environment<'_>,
    acting: Acting<'_>,
    at: &mut Configuration,
) {
    let stack = environment.surroundings.stack;
    let inserted: Vec<f64> = lengths(&at.state.hands).collect();
    let nodes = Nodes::new(stack, &inserted, environment.options.fineness());
    let turning = turning(acting.between, at.start());
    let push_force = |together: &[usize]| {
        push_force::<C>(environment, &nodes, (together, &inserted), (acting, &turning), at.start())
    };
    let each = (0..inserted.len()).map(|index| {
        let push_n = push_force(&[index]);
        HandForce { push_n: push_n.unwrap_or(0.0), jumps: push_n.is_none(), ..HandForce::default() }
    });
    let mut forces: Vec<HandForce> = each.collect();
    // Where ends are flush the force of a single hand jumps; that of all flush instruments together has a value.
    let flush: Vec<usize> =
        (0..forces.len()).filter(|index| forces[*index].jumps && inserted[*index] > 0.0).collect();
    let together =
        flush.chunk_by(|a, b| (inserted[*a] - inserted[*b]).abs() <= MEET * difference_mm(at.start()));
    for flush in together.filter(|flush| flush.len() > 1) {
        let share_n = push_force(flush).unwrap_or(0.0) / flush.len() as f64;
        flush.iter().for_each(|index| forces[*index].push_n = share_n);
    }
    at.parts().1.hand_forces = forces;
}

/// Push force of the hands of instruments that move `together`, with flush ends if they are several; `None` where it
/// jumps.
fn push_force<const C: usize>(
    environment: &Environment<'_>,
    nodes: &Nodes,
    (together, inserted_mm): (&[usize], &[f64]),
    (acting, turning): (Acting<'_>, &[Turning]),
    at: Start<'_>,
) -> Option<f64> {
    let stack = environment.surroundings.stack;
    let (own, step) = (inserted_mm[together[0]], difference_mm(at));
    let meets = |(other, end): (usize, &f64)| !together.contains(&other) && (end - own).abs() <= MEET * step;
    if own <= MEET * step || inserted_mm.iter().enumerate().any(meets) {
        return None;
    }
    let beside = |by: f64| {
        let mut inserted = inserted_mm.to_vec();
        together.iter().for_each(|index| inserted[*index] += by);
        Beside::new(environment, nodes, (&inserted, MEET * step), at)
    };
    let (back, on) = (beside(-step), beside(step));
    let stored = 0.5 * (on.stored_more_than::<C>(&back, at) / step);
    // Contacts of coils come last.
    let on_line = at.state.touches.partition_point(|(point, _)| *point < at.mesh.points.len());
    let pressed = &at.state.touches[..on_line];
    // If an active point vanishes on one side, or another one appears there, the other side's slope is used.
    let gains = |side: &Beside| side.mesh.points.len() > at.mesh.points.len();
    let wall = match (on.wall_slope(pressed, at, step), back.wall_slope(pressed, at, -step)) {
        (Some(one), Some(_)) if gains(&back) && !gains(&on) => one,
        (Some(_), Some(other)) if gains(&on) && !gains(&back) => other,
        (Some(one), Some(other)) => 0.5 * (one + other),
        (one, other) => one.or(other)?,
    };
    let loops = (on.pressing_mj(acting.loops, at) - back.pressing_mj(acting.loops, at)) / (2.0 * step);
    let field = (on.field_mj(environment) - back.field_mj(environment)) / (2.0 * step);
    let turned = (on.turning_against(turning, at) - back.turning_against(turning, at)) / (2.0 * step);
    let dragged = acting.drag.map_or(0.0, |drag| {
        // If a point appears or vanishes on one side, the other side's is used.
        let each = at.mesh.points.iter().enumerate().filter_map(|(index, point)| {
            let way = match (on.moved_mm(point, at, step), back.moved_mm(point, at, step)) {
                (Some(on), Some(back)) => (on - back) / (2.0 * step),
                (on, back) => on.map(|on| on / step).or(back.map(|back| -back / step))?,
            };
            Some(drag.force_n(index).dot(&way))
        });
        each.sum()
    });
    let far = own - at.mesh.elements[0].length;
    let straightened_n = together.iter().map(|index| {
        let device = &stack.instruments()[*index].device;
        at_mouth(device, (inserted_mm[*index], far), at.mesh.flush_mm).straightening_n()
    });
    Some(stored + wall + loops + field + turned - dragged - straightened_n.sum::<f64>())
}

/// Step of finite differences, mm.
fn difference_mm(at: Start<'_>) -> f64 {
    STEP * at.mesh.elements.iter().map(|e| e.length).fold(f64::INFINITY, f64::min)
}

/// Twist of the instrument in a `set` of angles at node `i`, towards the tip: the mean of the adjacent elements that
/// contain it.
fn twist_per_mm(at: Start<'_>, i: usize, set: usize) -> f64 {
    let is_in = |e: &usize| at.mesh.elements.get(*e).is_some_and(|data| data.materials[set].is_present());
    let (mut sum, mut count) = (0.0, 0.0);
    for e in [i - 1, i].into_iter().filter(is_in) {
        let rod = &at.state.rod;
        let turned = rod.angle(e + 1, set) - rod.angle(e, set) + rod.reference_twists[e];
        sum += turned / at.mesh.elements[e].length;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Position at ξ of an element.
fn place_mm(elements: &[ElementData], rod: &RodState, (e, xi): RodPlace) -> Vec3 {
    let [w0, s0, w1, s1] = hermite(xi);
    let (x, frames) = (&rod.positions, &rod.frames);
    x[e] * w0 + x[e + 1] * w1 + (frames[e].t * s0 + frames[e + 1].t * s1) * elements[e].length
}

/// A node at which friction between two instruments, the inner one first, holds twist.
struct Turning {
    node: usize,
    instruments: [usize; 2],
    couple_nmm: f64,
    twists_per_mm: [f64; 2],
}

/// These nodes, from the places with friction between instruments.
fn turning(between: &[Place], at: Start<'_>) -> Vec<Turning> {
    let each = between.iter().filter_map(|place| {
        let sets = place.sets?;
        let twist = |set: usize| twist_per_mm(at, place.node, set);
        Some(Turning {
            node: place.node,
            instruments: [place.inner, place.outer],
            couple_nmm: place.couple(&at.state.rod).0,
            twists_per_mm: [twist(sets.0), twist(sets.1)],
        })
    });
    each.collect()
}

/// The configuration with slightly different inserted lengths, and unchanged unknowns.
struct Beside {
    mesh: Mesh,
    /// Elements that differ from those of the current lengths.
    others: Vec<usize>,
    rod: RodState,
}

impl Beside {
    fn new(
        environment: &Environment<'_>,
        nodes: &Nodes,
        (inserted_mm, within_mm): (&[f64], f64),
        at: Start<'_>,
    ) -> Self {
        let surroundings = &environment.surroundings;
        let mut mesh = Mesh::default();
        let modulus = surroundings.properties.modulus_n_per_mm2;
        let known = (at.mesh, within_mm);
        let others = nodes.mesh_beside((surroundings.stack, inserted_mm), known, modulus, &mut mesh);
        let mut rod = at.state.rod.clone();
        rod.place(&mesh.elements);
        Self { mesh, others, rod }
    }

    /// Difference of the rod's stored energy from the other side, mJ.
    fn stored_more_than<const C: usize>(&self, other: &Self, at: Start<'_>) -> f64 {
        // An element differs on both sides, or on neither.
        let pairs = self.others.iter().map(|&e| (e, &self.mesh.elements[e], &other.mesh.elements[e]));
        let changed = pairs.filter(|(_, here, there)| here != there);
        let more = changed.map(|(e, here, there)| {
            let state = at.state.rod.element::<C>(e);
            element_energy::<C>(here, &state).total() - element_energy::<C>(there, &state).total()
        });
        more.sum()
    }

    /// Energy in the fields, mJ.
    fn field_mj(&self, environment: &Environment<'_>) -> f64 {
        environment.field_mj(&self.mesh, &self.rod)
    }

    /// Work against the couples of friction between instruments on the way here, on which what lies at a node turns with its twist, mJ.
    fn turning_against(&self, between: &[Turning], at: Start<'_>) -> f64 {
        let each = between.iter().map(|place| {
            // Change of the distance from its tip of the material there.
            let label = |mesh: &Mesh, k: usize| {
                mesh.from_tip_mm[place.node] - (mesh.from_tip_mm[0] - mesh.inserted_mm[k])
            };
            let moved = |k: usize| label(&self.mesh, k) - label(at.mesh, k);
            let work = |k: usize| moved(place.instruments[k]) * place.twists_per_mm[k];
            place.couple_nmm * (work(0) - work(1))
        });
        each.sum()
    }

    /// Change of the energy of contacts between loops, mJ: their points move against the forces and represent more or
    /// less length.
    fn pressing_mj(&self, loops: &[Pressing], at: Start<'_>) -> f64 {
        let each = loops.iter().map(|pair| {
            let moved_mm = |place: RodPlace| {
                place_mm(&self.mesh.elements, &self.rod, place)
                    - place_mm(&at.mesh.elements, &at.state.rod, place)
            };
            // Coils are not part of it.
            let on_line = |e: usize| e < at.mesh.elements.len();
            let [a, b] =
                pair.places.map(|place| if on_line(place.0) { moved_mm(place) } else { Vec3::zeros() });
            let longer = |e: usize| self.mesh.elements[e].length / at.mesh.elements[e].length - 1.0;
            let widened = if on_line(pair.site) { longer(pair.site) } else { 0.0 };
            widened * pair.energy_mj - pair.force_n.dot(&(a - b))
        });
        each.sum()
    }

    /// The contact point that differs `at` the current lengths.
    fn same_point(&self, was: &ContactPoint, step_mm: f64) -> Option<&ContactPoint> {
        let within = MEET * step_mm;
        let first = self.mesh.points.partition_point(|p| p.from_tip_mm < was.from_tip_mm - within);
        let mut near =
            self.mesh.points[first..].iter().take_while(|p| p.from_tip_mm <= was.from_tip_mm + within);
        near.find(|p| p.instrument == was.instrument && (p.weight_mm - was.weight_mm).abs() <= within)
    }

    /// Motion of the material at a contact point in this change of lengths, if the point still exists. The point where
    /// an instrument comes out of another is always there, and its material goes on.
    fn moved_mm(&self, was: &ContactPoint, at: Start<'_>, step_mm: f64) -> Option<Vec3> {
        let is = self.same_point(was, step_mm.abs())?;
        let from_tip_mm = |p: &ContactPoint, mesh: &Mesh| {
            p.from_tip_mm - (mesh.from_tip_mm[0] - mesh.inserted_mm[p.instrument])
        };
        let lag_mm = from_tip_mm(is, &self.mesh) - from_tip_mm(was, at.mesh);
        let moved =
            is.position(&self.mesh.elements, &self.rod) - was.position(&at.mesh.elements, &at.state.rod);
        Some(moved + self.rod.frames[is.element].t * lag_mm)
    }

    /// Slope of the wall's energy towards these lengths, N: active points move against their forces, and represent
    /// more or less length. `None` if one of them does not exist here.
    fn wall_slope(&self, pressed: &[(usize, Touch)], at: Start<'_>, step_mm: f64) -> Option<f64> {
        let each = pressed.iter().map(|(index, touch)| {
            let was = &at.mesh.points[*index];
            let is = self.same_point(was, step_mm.abs())?;
            let moved: Vec3 = is.position(&self.mesh.elements, &self.rod) - touch.contact.position_mm;
            let widened = (is.weight_mm - was.weight_mm) / was.weight_mm;
            let turned = is.angle(&self.rod) - was.angle(&self.rod);
            let rubbed = touch.contact.friction_n.dot(&moved) + touch.friction_nmm * turned;
            let work = touch.contact.force_n * touch.contact.normal.dot(&moved) + rubbed;
            Some((widened * touch.energy_mj - work) / step_mm)
        });
        each.sum()
    }
}
