//! The report of a step: energies, contacts, and the hand's forces.

use super::Environment;
use super::configuration::Configuration;
use super::hands::Hand;
use super::inner_friction::LEAST_SLIP_MM;
use super::slopes::{Acting, write_instruments};
use super::workspace::Tools;
use crate::Vec3;
use crate::contact::Drag;
use crate::contact::extension::left_through;
use crate::device::Stack;
use crate::methods::{Energy, Surroundings};
use crate::rod::{Clamp, Layout};

impl<const C: usize> Tools<C> {
    /// Writes the report of a configuration, that of the last sub-step. Returns the energy dissipated by friction in
    /// hubs and in the sheath, mJ.
    pub(super) fn write_report(
        &mut self,
        environment: &Environment<'_>,
        hands: &[Hand],
        at: &mut Configuration,
    ) -> f64 {
        let surroundings = &environment.surroundings;
        let (mesh, state) = at.parts();
        let (rod, report) = (&state.rod, &mut state.report);
        report.contacts.clear();
        report.max_penetration_mm = 0.0;
        report.drag_n = Vec3::zeros();
        report.inserted_mm = mesh.from_tip_mm[0];
        report.rotation_rad = hands[0].turn_rad;
        report.tip_rotation_rad = report.rotation_rad;
        let tip = rod.positions[rod.elements()];
        let tip = environment.wall().material(&tip);
        report.left_through =
            left_through(surroundings.lumen.openings(), &tip).map(|(opening, _)| opening.index);
        if mesh.elements.is_empty() && self.joined.is_empty() {
            report.energy = Energy::default();
            return self.write_withdrawn(environment, hands, at);
        }
        let stored = self.newton.assembly.energy;
        let field = environment.field_mj(mesh, rod);
        report.energy = Energy { bend: stored.bend, twist: stored.twist, wall: 0.0, field };
        for (_, touch) in &self.touches {
            report.energy.wall += touch.energy_mj;
            report.max_penetration_mm = report.max_penetration_mm.max(touch.contact.penetration_mm);
            report.contacts.push(touch.contact);
        }
        if environment.options.self_contact {
            report.energy.wall += self.loops.stored_mj();
        }
        let drag = surroundings.flow.map(|_| &self.drag);
        report.drag_n = drag.map_or_else(Vec3::zeros, Drag::total_n);
        if mesh.elements.is_empty() {
            return self.write_withdrawn(environment, hands, at);
        }
        let clamp = Clamp::new::<C>(&self.newton.start_residual, rod);
        if surroundings.stack.is_several() {
            let between = self.friction.between.places();
            let loops: Vec<_> = match environment.options.self_contact {
                true => self.loops.pressing().collect(),
                false => Vec::new(),
            };
            // Contacts of coils come last.
            let on_line = self.touches.partition_point(|(point, _)| *point < mesh.points.len());
            let acting = Acting { wall: &self.touches[..on_line], between, loops: &loops, drag };
            write_instruments::<C>(environment, hands, Some(&clamp), acting, at);
            self.rub(at);
            let taken_mj = self.rub_in_valves(surroundings.stack, at);
            return taken_mj + self.rub_in_sheath(surroundings, &clamp, at);
        }
        let frame = rod.material_frame(0);
        let data = &mesh.elements[0].materials[0];
        let rest = frame.u * data.rest_curvature[0][0] + frame.v * data.rest_curvature[0][1];
        report.push_force_n = clamp.push_force(&frame.t, data.bending[0], data.torsion[0], &rest);
        report.torque_nmm = clamp.torque;
        if Layout::<C>::ANGLES > 0 {
            report.tip_rotation_rad += rod.twist();
        }
        self.rub_in_sheath(surroundings, &clamp, at)
    }

    /// The report with nothing inserted: the hands feel no force.
    fn write_withdrawn(&self, environment: &Environment<'_>, hands: &[Hand], at: &mut Configuration) -> f64 {
        let report = &mut at.parts().1.report;
        (report.push_force_n, report.torque_nmm) = (0.0, 0.0);
        if environment.surroundings.stack.is_several() {
            write_instruments::<C>(environment, hands, None, Acting::default(), at);
        }
        0.0
    }

    /// Adds friction in the sheath, on the outermost instrument in it, to the hand's forces in the report; returns
    /// the dissipated energy, mJ.
    fn rub_in_sheath(&self, surroundings: &Surroundings<'_>, clamp: &Clamp, at: &mut Configuration) -> f64 {
        let sheath = surroundings.sheath;
        if !sheath.has_friction() {
            return 0.0;
        }
        let outermost = at.mesh.inserted_mm.iter().rposition(|mm| *mm > 0.0).unwrap_or(0);
        let inserted_mm = at.mesh.inserted_mm.get(outermost).copied().unwrap_or(at.mesh.from_tip_mm[0]);
        let device = &surroundings.stack.instruments()[outermost].device;
        let radius_mm = device.section_at(inserted_mm).radius_mm;
        let [advance_mm, turn_rad] = self.guess.motions[outermost].parts();
        let slip_mm = libm::hypot(advance_mm, radius_mm * turn_rad);
        if slip_mm <= LEAST_SLIP_MM {
            return 0.0;
        }
        let across = clamp.force - sheath.direction * clamp.force.dot(&sheath.direction);
        let friction_n = sheath.friction_n + sheath.friction * across.norm();
        let push_n = friction_n * advance_mm / slip_mm;
        let torque_nmm = friction_n * radius_mm * radius_mm * turn_rad / slip_mm;
        let report = &mut at.parts().1.report;
        report.push_force_n += push_n;
        report.torque_nmm += torque_nmm;
        if let Some(told) = report.instruments.get_mut(outermost) {
            told.push_force_n = told.push_force_n.map(|push| push + push_n);
            told.torque_nmm += torque_nmm;
        }
        friction_n * slip_mm
    }

    /// Adds friction of valves on the hubs of instruments to the hands' forces in the report; returns the dissipated
    /// energy, mJ.
    ///
    /// The valve of the next inserted instrument outside it holds an instrument by F₀ against its slip u = (Δ, r θ)
    /// in that one, with the opposite reaction: outside the body both are straight, and nothing inside moves.
    fn rub_in_valves(&self, stack: &Stack, at: &mut Configuration) -> f64 {
        let (mesh, state) = at.parts();
        let report = &mut state.report;
        let is_in = |index: &usize| mesh.inserted_mm[*index] > 0.0;
        let mut taken_mj = 0.0;
        for outer in (1..mesh.inserted_mm.len()).filter(|index| stack.valve_n(*index) > 0.0 && is_in(index)) {
            let Some(inner) = (0..outer).rev().find(is_in) else { continue };
            let radius_mm = stack.instruments()[inner].device.section_at(f64::INFINITY).radius_mm;
            let [[advance, turn], [outer_advance, outer_turn]] =
                [inner, outer].map(|index| self.guess.motions[index].parts());
            let (advance_mm, turn_rad) = (advance - outer_advance, turn - outer_turn);
            let slip_mm = libm::hypot(advance_mm, radius_mm * turn_rad);
            if slip_mm <= LEAST_SLIP_MM {
                continue;
            }
            let force_n = stack.valve_n(outer);
            let push_n = force_n * advance_mm / slip_mm;
            let torque_nmm = force_n * radius_mm * radius_mm * turn_rad / slip_mm;
            for (index, sign) in [(inner, 1.0), (outer, -1.0)] {
                let told = &mut report.instruments[index];
                told.push_force_n = told.push_force_n.map(|push| push + sign * push_n);
                told.torque_nmm += sign * torque_nmm;
            }
            taken_mj += force_n * slip_mm;
        }
        taken_mj
    }

    /// Adds friction along the line between instruments to the hands' forces in the report; couples about it already
    /// act through the rod.
    fn rub(&self, at: &mut Configuration) {
        let state = at.parts().1;
        for place in self.friction.between.places() {
            let friction_n = place.coefficient * place.force_n * place.parts(&state.rod)[0];
            for (index, sign) in [(place.inner, 1.0), (place.outer, -1.0)] {
                let told = &mut state.report.instruments[index];
                told.push_force_n = told.push_force_n.map(|push| push + sign * friction_n);
            }
        }
    }
}
