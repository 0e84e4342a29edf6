//! A coil is left behind.
//!
//! What was the first part of the line becomes a rod of its own, without a hand: it comes to rest in the vessel, on itself, on the coils before it and on the
//! catheter, which hold still meanwhile. Since nothing holds a free rod that touches nothing, it moves against a little resistance
//!
//! ```text
//! V = Σ ½ c wᵢ |xᵢ − x̄ᵢ|²,    c = RESISTANCE · EI / mm⁴
//! ```
//!
//! from where it was. From then on it stays where it is. The pusher is taken out, and what is left in the sheath comes to rest as after any command.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::configuration::Configuration;
use super::guess::Guess;
use super::hands::{Hand, lengths, read};
use super::loops::{skins, skins_alone};
use super::mesh::Mesh;
use super::search::Search;
use super::state::KirchhoffState;
use super::substep::Effort;
use super::transport::transport_together;
use super::workspace::{Tools, Workspace};
use super::{Environment, meshed};
use crate::contact::{ContactCache, ContactPoint, Friction, HandMotion, SelfContact, Still, WallContact};
use crate::device::{Stack, line_mm};
use crate::methods::detached::{DetachedCoil, still};
use crate::methods::{InstrumentReport, StepReport};
use crate::rod::{ElementData, RodState, Stencils, Supports};
use crate::shape::Shape;
use crate::solve::{External, Newton};
use crate::{Error, Result, Vec3};

/// c: a coil of 60 mm that moves by 1 mm meets a thousandth of the force that bends it to a radius of 1 mm.
const RESISTANCE_PER_MM4: f64 = 1e-5;
/// A coil that is in a catheter by less than this, mm, is out of it.
const OUT_MM: f64 = 1e-6;

/// The resistance of a rod that is free.
struct Resistance {
    /// Where nodes were, and what resists there, N/mm.
    nodes: Vec<(Vec3, f64)>,
}

impl Resistance {
    fn of(elements: &[ElementData], rod: &RodState) -> Self {
        let mut nodes: Vec<_> = rod.positions.iter().map(|x| (*x, 0.0)).collect();
        for (e, element) in elements.iter().enumerate() {
            let half = 0.5 * RESISTANCE_PER_MM4 * element.bending[1] * element.length;
            nodes[e].1 += half;
            nodes[e + 1].1 += half;
        }
        Self { nodes }
    }
}

impl External for Resistance {
    fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        into.add_value(self.value(elements, state));
        for (i, ((was, resists), is)) in self.nodes.iter().zip(&state.positions).enumerate() {
            into.add_node(i, &((is - was) * *resists), &Matrix3::from_diagonal_element(*resists));
        }
    }

    fn value(&mut self, _elements: &[ElementData], state: &RodState) -> f64 {
        let nodes = self.nodes.iter().zip(&state.positions);
        nodes.map(|((was, resists), is)| 0.5 * resists * (is - was).norm_squared()).sum()
    }
}

/// Refuses a coil that cannot be detached.
fn check(environment: &Environment<'_>, from: &KirchhoffState, instrument: usize) -> Result<f64> {
    let stack = environment.surroundings.stack;
    let refused = |mend: String| {
        let name = stack.instruments().get(instrument).map_or_else(String::new, |one| one.name.clone());
        Err(Error::parameter("detach", format!("{name:?}"), mend))
    };
    let coil_mm = stack.instruments().get(instrument).map_or(0.0, |one| one.device.coil_mm());
    if coil_mm == 0.0 {
        return refused(
            "is no coil: a device file of kind coil whose first part has a winding is one".into(),
        );
    }
    if from.coils.iter().any(|coil| coil.instrument == instrument) {
        return refused("is detached already: push the next coil".into());
    }
    if !environment.options.self_contact {
        return refused("what follows would pass through it: set method.self_contact = true".into());
    }
    let inserted_mm = from.report.lengths_mm();
    // Its end comes free of what it lay in where it no longer touches that.
    let device = &stack.instruments()[instrument].device;
    let outside = stack.devices().zip(&inserted_mm).skip(instrument + 1).filter(|(_, mm)| **mm > 0.0);
    let free_mm = outside
        .map(|(outer, mm)| mm + outer.section_at(0.0).radius_mm + device.section_at(coil_mm).radius_mm)
        .fold(0.0, f64::max);
    let left_mm = coil_mm + free_mm - inserted_mm[instrument];
    if left_mm > OUT_MM {
        return refused(format!("is not out yet: advance it by {left_mm:.3} mm"));
    }
    Ok(coil_mm)
}

/// The part of a rod from a node on.
fn from_node(rod: &RodState, first: usize) -> RodState {
    let sets = rod.sets();
    RodState {
        frames: rod.frames[first..].to_vec(),
        chords: rod.chords[first..].to_vec(),
        tensions: rod.tensions[first..].to_vec(),
        angles: rod.angles[sets * first..].to_vec(),
        bubbles: rod.bubbles[sets * first..].to_vec(),
        reference_twists: rod.reference_twists[first..].to_vec(),
        positions: rod.positions[first..].to_vec(),
    }
}

/// The line of a rod on a mesh.
fn shape(rod: &RodState, mesh: &Mesh) -> Shape {
    Shape {
        positions_mm: rod.positions.clone(),
        tangents: rod.frames.iter().map(|frame| frame.t).collect(),
        from_tip_mm: mesh.from_tip_mm.clone(),
    }
}

impl<const C: usize> Workspace<C> {
    /// Detaches the coil of an instrument from the state `from`, and leaves the new state in `now`.
    ///
    /// # Errors
    /// As [`Method::detach`](crate::methods::Method::detach).
    pub(super) fn detach(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        instrument: usize,
    ) -> Result<()> {
        let coil_mm = check(environment, from, instrument)?;
        let stack = environment.surroundings.stack;
        let mut hands = Vec::new();
        read(&from.report, &mut hands);
        hands[instrument] = Hand::default();
        // What is left, where it lies before it comes to rest.
        let mut left = Configuration { mesh: Mesh::default(), state: Arc::new(from.clone()) };
        meshed(environment, &hands, &mut left.mesh);
        let (mesh, state) = left.parts();
        let points = mesh.points.len();
        state.known.keep_last(points, line_mm(lengths(&hands)) - self.mesh.from_tip_mm[0]);
        state.forces.drain(..state.forces.len().saturating_sub(points));
        state.inner_friction.clear();
        state.correction.clear();
        state.report.inserted_mm = mesh.from_tip_mm[0];
        if let Some(told) = state.report.instruments.get_mut(instrument) {
            *told = InstrumentReport::default();
        }
        if mesh.elements.is_empty() {
            state.withdraw(stack, &hands);
        } else {
            transport_together((&self.mesh, &from.rod), mesh, stack.sets(), &mut state.rod);
            state.turn_tails(stack, &hands);
            // Nothing pushes at its end any more: a straight catheter stores too little for that to be found by going downhill.
            state.rod.tensions.fill(0.0);
        }
        let coil = self.tools.released(environment, (&self.mesh, from), (&left, instrument, coil_mm))?;
        let (mesh, state) = left.parts();
        Arc::make_mut(&mut state.coils).push(coil);
        if mesh.elements.is_empty() {
            let at_rest = StepReport {
                instruments: std::mem::take(&mut state.report.instruments),
                ..StepReport::default()
            };
            state.report = StepReport { angles: from.report.angles, converged: true, ..at_rest };
            self.now = left;
            self.tools.write_report(environment, &hands, &mut self.now);
            return Ok(());
        }
        let Configuration { mesh, state } = left;
        let was = std::mem::replace(&mut self.mesh, mesh);
        let done = self.carry_out(environment, &state, &[]);
        self.mesh = was;
        // What is set free stays in the coil.
        let report = &mut self.now.parts().1.report;
        (report.jump, report.jumped) = (None, false);
        done
    }
}

impl<const C: usize> Tools<C> {
    /// The coil that was the first part of the line, where it comes to rest while what is left holds still.
    ///
    /// # Errors
    /// It does not come to rest.
    fn released(
        &mut self,
        environment: &Environment<'_>,
        (whole, from): (&Mesh, &KirchhoffState),
        (left, instrument, coil_mm): (&Configuration, usize, f64),
    ) -> Result<DetachedCoil> {
        let surroundings = &environment.surroundings;
        let device = &surroundings.stack.instruments()[instrument].device;
        let first = whole.nearest_node(coil_mm);
        let mut rod = from_node(&from.rod, first);
        let out = whole.points.iter().filter(|point| point.element >= first);
        let mesh = Mesh {
            from_tip_mm: whole.from_tip_mm[first..].to_vec(),
            elements: whole.elements[first..].to_vec(),
            points: out.map(|point| ContactPoint { element: point.element - first, ..*point }).collect(),
            inserted_mm: Vec::new(),
        };
        let mut newton = Newton::<C>::new(mesh.elements.len());
        let mut cache = ContactCache::new(environment.surface);
        cache.begin(&from.known, &mesh.points, &mesh.points, 0.0);
        let mut friction = Friction::new(surroundings.properties.largest_friction());
        let rests = vec![
            HandMotion { from_mm: 0.0, to_mm: 0.0, turn_rad: 0.0 };
            surroundings.stack.instruments().len()
        ];
        friction.begin(&mesh.elements, &rod, &mesh.points, (&mesh.points, &from.forces), &rests);
        let softest_nmm2 = surroundings.stack.softest_nmm2();
        let mut contact =
            WallContact::new(environment.wall(), &mesh.points, &mut cache, &mut friction, softest_nmm2);
        let mut loops = SelfContact::new(&mesh.elements, skins_alone(&mesh, device).collect());
        let mut others = DetachedCoil::elements(&from.coils, surroundings.stack);
        others.extend(left_elements(left, surroundings.stack, from.coils.len()));
        loops.beside(&others.into());
        let mut resistance = Resistance::of(&mesh.elements, &rod);
        let mut supports = Supports { start_free: true, ..Supports::default() };
        let mut search = Search {
            newton: &mut newton,
            guess: &mut Guess::default(),
            contact: &mut contact,
            beside: vec![&mut loops, &mut resistance],
            supports: &mut supports,
            elements: &mesh.elements,
            state: &mut rod,
            has_friction: surroundings.properties.has_friction(),
            tolerance: environment.options.tolerance,
            effort: Effort::Flight,
            most: environment.options.max_iterations,
            most_solves: usize::MAX,
            iterations: 0,
            solves: 0,
            slides: 0,
        };
        let found = search.run();
        contact.know_whole_base(&mesh.elements);
        let passes = contact.passes_through(&mesh.elements, &rod);
        self.counters.add(&contact.count());
        if passes || rod.is_folded() || !found.residual.is_finite() {
            return Err(Error::Computation(format!(
                "kirchhoff: a detached coil does not come to rest: {}",
                found.reason
            )));
        }
        Ok(DetachedCoil { instrument, shape: shape(&rod, &mesh) })
    }
}

/// The elements of what is left in the sheath, as the `rod`th of those that are still.
fn left_elements(left: &Configuration, stack: &Stack, rod: usize) -> Vec<Still> {
    let skins: Vec<_> = skins(&left.mesh, stack).collect();
    let line = shape(&left.state.rod, &left.mesh);
    let skin = |from_tip_mm: f64| skins[left.mesh.from_tip_mm[1..].partition_point(|mm| *mm > from_tip_mm)];
    still(&line, rod, skin).collect()
}
