//! The report of a step: energies, contacts, and the hand's forces.

use super::Environment;
use super::configuration::Configuration;
use super::hands::Hand;
use super::inner_friction::LEAST_SLIP_MM;
use super::slopes::{Acting, write_instruments};
use super::state::OutsideFriction;
use super::workspace::Tools;
use crate::Vec3;
use crate::contact::extension::left_through;
use crate::contact::{Drag, HandMotion};
use crate::device::Stack;
use crate::methods::{Energy, Surroundings};
use crate::rod::{Clamp, Layout};

impl<const C: usize> Tools<C> {
    /// Writes the report of a configuration, that of the last sub-step. Returns the energy dissipated by friction of
    /// valves and of the sheath, mJ.
    pub(super) fn write_report(
        &mut self,
        environment: &Environment<'_>,
        hands: &[Hand],
        at: &mut Configuration,
    ) -> f64 {
        let clamp = self.write_inside(environment, hands, at);
        self.rub_outside(&environment.surroundings, clamp.as_ref(), at)
    }

    /// Writes the report without friction outside the body. Returns the forces at the sheath's mouth, unless nothing is
    /// inserted.
    fn write_inside(
        &mut self,
        environment: &Environment<'_>,
        hands: &[Hand],
        at: &mut Configuration,
    ) -> Option<Clamp> {
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
            write_withdrawn::<C>(environment, hands, at);
            return None;
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
            write_withdrawn::<C>(environment, hands, at);
            return None;
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
            return Some(clamp);
        }
        let frame = rod.material_frame(0);
        let data = &mesh.elements[0].materials[0];
        let rest = frame.u * data.rest_curvature[0][0] + frame.v * data.rest_curvature[0][1];
        // What comes in where the wall presses stores energy in it.
        let coming_in = self.touches.iter().filter_map(|(index, touch)| {
            let point = mesh.points.get(*index).filter(|point| mesh.is_coming_in(point))?;
            Some(touch.energy_mj / point.weight_mm)
        });
        let clamped_n = clamp.push_force(&frame.t, data.bending[0], data.torsion[0], &rest);
        report.push_force_n = clamped_n + coming_in.sum::<f64>() + self.newton.unbalanced_along_n(rod);
        report.torque_nmm = clamp.torque;
        if Layout::<C>::ANGLES > 0 {
            report.tip_rotation_rad += rod.twist();
        }
        Some(clamp)
    }

    /// Adds friction outside the body to the forces of hands that hold an inserted instrument; returns the dissipated
    /// energy, mJ, also of instruments that have just been pulled out.
    fn rub_outside(
        &self,
        surroundings: &Surroundings<'_>,
        clamp: Option<&Clamp>,
        at: &mut Configuration,
    ) -> f64 {
        let state = at.parts().1;
        state.outside.fill(OutsideFriction::default());
        let taken_mj = self.rub_in_valves(surroundings.stack, &mut state.outside)
            + self.rub_in_sheath(surroundings, clamp, &mut state.outside);
        let (report, outside) = (&mut state.report, &mut state.outside);
        for (index, (friction, motion)) in outside.iter_mut().zip(&self.guess.motions).enumerate() {
            if motion.to_mm == 0.0 {
                *friction = OutsideFriction::default();
            }
            report.push_force_n += friction.push_n;
            report.torque_nmm += friction.torque_nmm;
            if let Some(told) = report.instruments.get_mut(index) {
                told.push_force_n = told.push_force_n.map(|push| push + friction.push_n);
                told.torque_nmm += friction.torque_nmm;
            }
        }
        taken_mj
    }

    /// Friction in the sheath, on the outermost instrument in it; returns the dissipated energy, mJ.
    fn rub_in_sheath(
        &self,
        surroundings: &Surroundings<'_>,
        clamp: Option<&Clamp>,
        outside: &mut [OutsideFriction],
    ) -> f64 {
        let (sheath, motions) = (surroundings.sheath, &self.guess.motions);
        if !sheath.has_friction() {
            return 0.0;
        }
        let Some(outermost) = motions.iter().rposition(is_in) else { return 0.0 };
        let device = &surroundings.stack.instruments()[outermost].device;
        let radius_mm = device.section_at(motions[outermost].to_mm).radius_mm;
        let across_n = clamp.map_or(0.0, |clamp| {
            (clamp.force - sheath.direction * clamp.force.dot(&sheath.direction)).norm()
        });
        let friction_n = sheath.friction_n + sheath.friction * across_n;
        let (friction, taken_mj) = against(friction_n, motions[outermost].parts(), radius_mm);
        add(&mut outside[outermost], friction, 1.0);
        taken_mj
    }

    /// Friction of valves on the hubs of instruments; returns the dissipated energy, mJ.
    ///
    /// The valve of the next inserted instrument outside it holds an instrument by F₀ against its slip u = (Δ, r θ)
    /// in that one, with the opposite reaction: outside the body both are straight, and nothing inside moves.
    fn rub_in_valves(&self, stack: &Stack, outside: &mut [OutsideFriction]) -> f64 {
        let motions = &self.guess.motions;
        let mut taken_mj = 0.0;
        for outer in (1..motions.len()).filter(|index| stack.valve_n(*index) > 0.0 && is_in(&motions[*index]))
        {
            let Some(inner) = (0..outer).rev().find(|index| is_in(&motions[*index])) else { continue };
            let radius_mm = stack.instruments()[inner].device.section_at(f64::INFINITY).radius_mm;
            let [[advance, turn], [outer_advance, outer_turn]] =
                [inner, outer].map(|index| motions[index].parts());
            let slip = [advance - outer_advance, turn - outer_turn];
            let (friction, one_mj) = against(stack.valve_n(outer), slip, radius_mm);
            add(&mut outside[inner], friction, 1.0);
            add(&mut outside[outer], friction, -1.0);
            taken_mj += one_mj;
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

/// The report with nothing inserted: the hands feel no force.
fn write_withdrawn<const C: usize>(environment: &Environment<'_>, hands: &[Hand], at: &mut Configuration) {
    let report = &mut at.parts().1.report;
    (report.push_force_n, report.torque_nmm) = (0.0, 0.0);
    if environment.surroundings.stack.is_several() {
        write_instruments::<C>(environment, hands, None, Acting::default(), at);
    }
}

/// Whether an instrument is inserted before or after a motion.
fn is_in(motion: &HandMotion) -> bool {
    motion.from_mm.max(motion.to_mm) > 0.0
}

/// Friction of this size, N, against an advance, mm, and a turn, rad, at this radius; and the energy that it dissipates,
/// mJ.
fn against(friction_n: f64, [advance_mm, turn_rad]: [f64; 2], radius_mm: f64) -> (OutsideFriction, f64) {
    let slip_mm = libm::hypot(advance_mm, radius_mm * turn_rad);
    if slip_mm <= LEAST_SLIP_MM {
        return (OutsideFriction::default(), 0.0);
    }
    let push_n = friction_n * advance_mm / slip_mm;
    let torque_nmm = friction_n * radius_mm * radius_mm * turn_rad / slip_mm;
    (OutsideFriction { push_n, torque_nmm }, friction_n * slip_mm)
}

fn add(to: &mut OutsideFriction, friction: OutsideFriction, sign: f64) {
    to.push_n += sign * friction.push_n;
    to.torque_nmm += sign * friction.torque_nmm;
}
