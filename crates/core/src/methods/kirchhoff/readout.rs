//! What an equilibrium stores and exerts: its energies, the drag on it, and the forces of the hands.

use super::Environment;
use super::configuration::Configuration;
use super::hands::{HandForce, OutsideFriction, ROUNDED_MM};
use super::material::at_mouth;
use super::slopes::{Acting, set_hand_forces};
use super::workspace::Tools;
use crate::Vec3;
use crate::contact::{Drag, HandMotion};
use crate::device::Stack;
use crate::methods::{Energy, Surroundings};
use crate::rod::Clamp;

impl<const C: usize> Tools<C> {
    /// Writes energies and forces into the state of a configuration, that of the last sub-step, whose contacts are
    /// known. Returns the energy dissipated by friction of valves and of the sheath, mJ.
    pub(super) fn write_forces(&mut self, environment: &Environment<'_>, at: &mut Configuration) -> f64 {
        let clamp = self.write_inside(environment, at);
        self.rub_outside(&environment.surroundings, clamp.as_ref(), &mut at.parts().1.hand_forces)
    }

    /// Writes them without friction outside the body. Returns the forces at the sheath's mouth, unless nothing is
    /// inserted.
    fn write_inside(&mut self, environment: &Environment<'_>, at: &mut Configuration) -> Option<Clamp> {
        let surroundings = &environment.surroundings;
        let (mesh, state) = at.parts();
        // Where nothing is inserted hands feel no force.
        state.hand_forces.fill(HandForce { jumps: surroundings.stack.is_several(), ..HandForce::default() });
        (state.energy, state.drag_n) = (Energy::default(), Vec3::zeros());
        if mesh.elements.is_empty() && self.joined.is_empty() {
            return None;
        }
        let rod = &state.rod;
        let stored = self.newton.assembly.energy;
        let in_wall_mj: f64 = state.touches.iter().fold(0.0, |sum, (_, touch)| sum + touch.energy_mj);
        let in_loops_mj = if environment.options.self_contact { self.loops.stored_mj() } else { 0.0 };
        state.energy = Energy {
            bend: stored.bend,
            twist: stored.twist,
            wall: in_wall_mj + in_loops_mj,
            field: environment.field_mj(mesh, rod),
        };
        let drag = surroundings.flow.map(|_| &self.drag);
        state.drag_n = drag.map_or_else(Vec3::zeros, Drag::total_n);
        if mesh.elements.is_empty() {
            return None;
        }
        let clamp = Clamp::new::<C>(&self.newton.start_residual, rod);
        if surroundings.stack.is_several() {
            let between = self.friction.between.places();
            let loops: Vec<_> = match environment.options.self_contact {
                true => self.loops.pressing().collect(),
                false => Vec::new(),
            };
            set_hand_forces::<C>(environment, &clamp, Acting { between, loops: &loops, drag }, at);
            self.add_inner_friction(at);
            return Some(clamp);
        }
        let frame = rod.material_frame(0);
        let ends = (mesh.from_tip_mm[0], mesh.from_tip_mm[1]);
        let section = at_mouth(surroundings.device, ends, mesh.flush_mm);
        let [along_u, along_v] = section.rest_curvature_per_mm;
        let rest = frame.u * along_u + frame.v * along_v;
        // What comes in where the wall presses stores energy in it.
        let coming_in = state.touches.iter().filter_map(|(index, touch)| {
            let point = mesh.points.get(*index).filter(|point| mesh.is_coming_in(point))?;
            Some(touch.energy_mj / point.weight_mm)
        });
        let (bending, torsion) = (section.bending_stiffness_nmm2, section.torsion_nmm2());
        let clamped_n = clamp.push_force(&frame.t, bending, torsion, &rest);
        let push_n = clamped_n + coming_in.sum::<f64>() + self.newton.unbalanced_along_n(rod);
        state.hand_forces[0] = HandForce { push_n, torque_nmm: clamp.torque, ..HandForce::default() };
        Some(clamp)
    }

    /// Writes friction outside the body on hands that hold an inserted instrument; returns the dissipated energy, mJ,
    /// also of instruments that have just been pulled out.
    fn rub_outside(
        &self,
        surroundings: &Surroundings<'_>,
        clamp: Option<&Clamp>,
        forces: &mut [HandForce],
    ) -> f64 {
        let taken_mj =
            self.rub_in_valves(surroundings.stack, forces) + self.rub_in_sheath(surroundings, clamp, forces);
        for (force, motion) in forces.iter_mut().zip(&self.guess.motions) {
            if motion.to_mm == 0.0 {
                force.outside = OutsideFriction::default();
            }
        }
        taken_mj
    }

    /// Friction in the sheath, on the outermost instrument in it; returns the dissipated energy, mJ.
    fn rub_in_sheath(
        &self,
        surroundings: &Surroundings<'_>,
        clamp: Option<&Clamp>,
        forces: &mut [HandForce],
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
        add(&mut forces[outermost], friction, 1.0);
        taken_mj
    }

    /// Friction of valves on the hubs of instruments; returns the dissipated energy, mJ.
    ///
    /// The valve of the next inserted instrument outside it holds an instrument by F₀ against its slip u = (Δ, r θ)
    /// in that one, with the opposite reaction: outside the body both are straight, and nothing inside moves.
    fn rub_in_valves(&self, stack: &Stack, forces: &mut [HandForce]) -> f64 {
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
            add(&mut forces[inner], friction, 1.0);
            add(&mut forces[outer], friction, -1.0);
            taken_mj += one_mj;
        }
        taken_mj
    }

    /// Adds friction along the line between instruments to the hands' forces; couples about it already act through the
    /// rod.
    fn add_inner_friction(&self, at: &mut Configuration) {
        let state = at.parts().1;
        for place in self.friction.between.places() {
            let friction_n = place.coefficient * place.force_n * place.parts(&state.rod)[0];
            state.hand_forces[place.inner].push_n += friction_n;
            state.hand_forces[place.outer].push_n -= friction_n;
        }
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
    if slip_mm <= ROUNDED_MM {
        return (OutsideFriction::default(), 0.0);
    }
    let push_n = friction_n * advance_mm / slip_mm;
    let torque_nmm = friction_n * radius_mm * radius_mm * turn_rad / slip_mm;
    (OutsideFriction { push_n, torque_nmm }, friction_n * slip_mm)
}

fn add(to: &mut HandForce, friction: OutsideFriction, sign: f64) {
    to.outside.push_n += sign * friction.push_n;
    to.outside.torque_nmm += sign * friction.torque_nmm;
}
