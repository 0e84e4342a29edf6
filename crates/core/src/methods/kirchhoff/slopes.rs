//! What the hand of each of several instruments feels: slopes of the energy with respect to its own insertion and turn.
//!
//! By the envelope theorem the derivative of the discrete energy with respect to an inserted length is that in the mesh alone, while
//! tangents, chords over lengths and angles stay as they are: ends of the instrument and of its sections take their nodes along, and so do
//! its contact points. It is exact for the mesh. What the sheath no longer stores, ½EI|κ⁰|² a length, is part of it.

use super::Environment;
use super::coaxial::{Nodes, line_mm};
use super::configuration::{Configuration, Start};
use super::hands::{Hand, lengths};
use super::mesh::Mesh;
use super::workspace::Tools;
use crate::contact::WallContact;
use crate::insertion::InstrumentReport;
use crate::rod::{Clamp, element_energy};
use crate::solve::External;

/// Step of the differences of the energy, as a part of the shortest element: less than a device sinks into a wall, whose energy bends where
/// that begins.
const STEP: f64 = 1e-5;
/// Steps within which ends meet.
const MEET: f64 = 4.0;

impl<const C: usize> Tools<C> {
    /// Sets the reports of several instruments whose hands are there.
    pub(super) fn write_instruments(
        &mut self,
        environment: &Environment<'_>,
        hands: &[Hand],
        clamp: Option<&Clamp>,
        at: &mut Configuration,
    ) {
        let sets = environment.surroundings.stack.sets();
        let inserted = lengths(hands);
        let mut told = Vec::with_capacity(hands.len());
        for (index, hand) in hands.iter().enumerate() {
            let set = sets[index].filter(|_| hand.inserted_mm > 0.0);
            let twist = set.map_or(0.0, |set| {
                let from_tip = line_mm(&inserted) - hand.inserted_mm;
                let off = |i: &usize| (at.mesh.from_tip_mm[*i] - from_tip).abs();
                let tip = (0..at.mesh.from_tip_mm.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
                at.state.rod.twist_to(tip.unwrap_or(0), set)
            });
            told.push(InstrumentReport {
                inserted_mm: hand.inserted_mm,
                rotation_rad: hand.turn_rad,
                tip_rotation_rad: hand.turn_rad + twist,
                push_force_n: self.push_force(environment, index, &inserted, at.start()),
                torque_nmm: set.zip(clamp).map_or(0.0, |(set, clamp)| clamp.torques[set]),
            });
        }
        let report = &mut at.parts().1.report;
        (report.rotation_rad, report.tip_rotation_rad) = (told[0].rotation_rad, told[0].tip_rotation_rad);
        report.push_force_n = told.iter().filter_map(|i| i.push_force_n).sum();
        report.torque_nmm = told.iter().map(|i| i.torque_nmm).sum();
        report.instruments = told;
    }

    /// Force with which one hand pushes; none where it jumps.
    fn push_force(
        &mut self,
        environment: &Environment<'_>,
        index: usize,
        inserted_mm: &[f64],
        at: Start<'_>,
    ) -> Option<f64> {
        let stack = environment.surroundings.stack;
        let shortest = at.mesh.elements.iter().map(|e| e.length).fold(f64::INFINITY, f64::min);
        let (own, step) = (inserted_mm[index], STEP * shortest);
        let meets = |(other, end): (usize, &f64)| other != index && (end - own).abs() <= MEET * step;
        if own <= MEET * step || inserted_mm.iter().enumerate().any(meets) {
            return None;
        }
        let nodes = Nodes::new(stack, inserted_mm, environment.options.element_mm);
        let mut energy = |by: f64| {
            let mut inserted = inserted_mm.to_vec();
            inserted[index] += by;
            self.energy_with(environment, &nodes, &inserted, at)
        };
        let near = energy(step) - energy(-step);
        let far = energy(2.0 * step) - energy(-2.0 * step);
        let mouth = stack.instruments()[index].device.section_at(own);
        let [u, v] = mouth.rest_curvature_per_mm;
        let straightening = 0.5 * mouth.bending_stiffness_nmm2 * (u * u + v * v);
        Some((8.0 * near - far) / (12.0 * step) - straightening)
    }

    /// Energy of instruments with these lengths inserted and the unknowns of those that are `at` a place near by.
    fn energy_with(
        &mut self,
        environment: &Environment<'_>,
        nodes: &Nodes,
        inserted_mm: &[f64],
        at: Start<'_>,
    ) -> f64 {
        let surroundings = &environment.surroundings;
        let mut mesh = Mesh::default();
        nodes.mesh(surroundings.stack, inserted_mm, surroundings.properties.modulus_n_per_mm2, &mut mesh);
        let mut moved = at.state.rod.clone();
        moved.place(&mesh.elements);
        let each = mesh.elements.iter().enumerate();
        let stored: f64 =
            each.map(|(e, data)| element_energy::<C>(data, &moved.element::<C>(e)).total()).sum();
        let softest = surroundings.stack.softest_nmm2();
        let advance_mm = mesh.from_tip_mm[0] - at.mesh.from_tip_mm[0];
        self.memory.begin(&at.state.known, &at.mesh.points, &mesh.points, advance_mm);
        let mut contact =
            WallContact::new(environment.felt, &mesh.points, &mut self.memory, &mut self.friction, softest);
        stored + contact.value(&mesh.elements, &moved)
    }
}
