//! What an equilibrium stores and exerts: its energies, the drag on it, and the forces of the hands.

use super::Environment;
use super::configuration::{Configuration, Start};
use super::hands::HandForce;
use super::material::at_mouth;
use super::slopes::{Acting, set_hand_forces, steer_mj};
use super::state::KirchhoffState;
use super::workspace::Tools;
use crate::Vec3;
use crate::contact::Drag;
use crate::methods::{Energy, Sheath};
use crate::rod::Clamp;

impl<const C: usize> Tools<C> {
    /// Writes energies and forces into the state of a configuration, that of the last sub-step, whose contacts are
    /// known. Returns the energy dissipated by friction of valves and of the sheath along the line, mJ.
    pub(super) fn write_forces(&mut self, environment: &Environment<'_>, at: &mut Configuration) -> f64 {
        let clamp = self.write_inside(environment, at);
        let sheath = environment.surroundings.sheath;
        let stack = environment.surroundings.stack;
        if clamp.is_some() && stack.is_steerable() {
            for k in 0..at.state.hands.len() {
                let steer_mj = steer_mj::<C>(stack, at.start(), k);
                at.parts().1.hand_forces[k].steer_mj = steer_mj;
            }
        }
        let state = at.parts().1;
        state.across_n = clamp.map_or(0.0, |clamp| across_n(sheath, &clamp));
        let KirchhoffState { rod, twists, hand_forces, energy, across_n, .. } = state;
        let (stored_mj, at_grips) = self.tails.write((sheath, *across_n), rod, twists, hand_forces);
        energy.tail = stored_mj;
        self.around_mj = at_grips.around_mj;
        at_grips.along_mj
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
            tail: 0.0,
            vessel: surroundings.course.map_or(0.0, |course| course.energy_mj(&state.course_mm)),
        };
        let drag = surroundings.flow.map(|_| &self.drag);
        state.drag_n = drag.map_or_else(Vec3::zeros, Drag::total_n);
        if mesh.elements.is_empty() {
            return None;
        }
        let clamp = Clamp::new::<C>(&self.newton.start_residual, rod);
        // The first node turns freely: its rows are balanced by the tail.
        let clamp = Clamp { torque: self.tails.body_nmm(rod), ..clamp };
        if surroundings.stack.is_several() {
            let between = self.friction.between.places();
            let loops: Vec<_> = match environment.options.self_contact {
                true => self.loops.pressing().collect(),
                false => Vec::new(),
            };
            set_hand_forces::<C>(environment, Acting { between, loops: &loops, drag }, at);
            self.add_inner_friction(at);
            return Some(clamp);
        }
        let push_n =
            alone_push_n(environment, Start { mesh, state }, &clamp) + self.newton.unbalanced_along_n(rod);
        state.hand_forces[0] = HandForce { push_n, ..HandForce::default() };
        Some(clamp)
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

/// Push force inside the body of a device alone, N, with these forces at the sheath's mouth, without what is out of balance.
pub(super) fn alone_push_n(
    environment: &Environment<'_>,
    Start { mesh, state }: Start<'_>,
    clamp: &Clamp,
) -> f64 {
    let surroundings = &environment.surroundings;
    let frame = state.rod.material_frame(0);
    let ends = (mesh.from_tip_mm[0], mesh.from_tip_mm[1]);
    let section = at_mouth(surroundings.device, ends, mesh.flush_mm);
    // What comes in where the wall presses stores energy in it.
    let coming_in = state.touches.iter().filter_map(|(index, touch)| {
        let point = mesh.points.get(*index).filter(|point| mesh.is_coming_in(point))?;
        Some(touch.energy_mj / point.weight_mm)
    });
    let torsion = section.torsion_nmm2();
    let clamped_n = if section.soft_plane.is_some() {
        clamp.skew_push_force(&frame, section.stiffness_nmm2(), torsion, section.rest_curvature_per_mm)
    } else {
        let [along_u, along_v] = section.rest_curvature_per_mm;
        let rest = frame.u * along_u + frame.v * along_v;
        clamp.push_force(&frame.t, section.bending_stiffness_nmm2, torsion, &rest)
    };
    clamped_n + coming_in.sum::<f64>()
}

/// Force across the sheath at its mouth, N.
pub(super) fn across_n(sheath: &Sheath, clamp: &Clamp) -> f64 {
    (clamp.force - sheath.direction * clamp.force.dot(&sheath.direction)).norm()
}
