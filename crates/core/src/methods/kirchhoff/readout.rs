//! What a step tells: energies, contacts, and what the hand feels.

use super::{Kirchhoff, softest};
use crate::contact::WallContact;
use crate::contact::extension::left_through;
use crate::insertion::{Energy, Surroundings};
use crate::rod::{Clamp, Layout};

impl<const C: usize> Kirchhoff<C> {
    /// The centre line at the current state.
    pub(super) fn write_shape(&mut self) {
        self.shape.positions_mm.clone_from(&self.current.state.positions);
        self.shape.tangents.clear();
        self.shape.tangents.extend(self.current.state.frames.iter().map(|f| f.t));
        self.shape.from_tip_mm.clone_from(&self.current.mesh.from_tip_mm);
    }

    /// Read-outs at the current state.
    pub(super) fn write_report(&mut self, surroundings: &Surroundings<'_>) {
        let report = &mut self.report;
        report.contacts.clear();
        report.max_penetration_mm = 0.0;
        report.inserted_mm = self.current.mesh.from_tip_mm[0];
        report.tip_rotation_rad = report.rotation_rad;
        let tip = self.current.state.positions[self.current.state.elements()];
        report.left_through = left_through(surroundings.wall, &tip).map(|(opening, _)| opening);
        if self.current.mesh.elements.is_empty() {
            report.energy = Energy::default();
            (report.push_force_n, report.torque_nmm) = (0.0, 0.0);
            return;
        }
        let mut contact = WallContact::new(
            &self.felt,
            &self.current.mesh.points,
            &mut self.memory,
            &mut self.current.friction,
            softest(surroundings.device),
            self.options.skip,
        );
        let stored = self.newton.assembly.energy;
        report.energy = Energy { bend: stored.bend, twist: stored.twist, wall: 0.0 };
        for index in 0..self.current.mesh.points.len() {
            let Some(touch) = contact.touch(&self.current.mesh.elements, &self.current.state, index) else {
                continue;
            };
            report.energy.wall += touch.energy_mj;
            report.max_penetration_mm = report.max_penetration_mm.max(touch.contact.penetration_mm);
            report.contacts.push(touch.contact);
        }

        let clamp = Clamp::new::<C>(&self.newton.start_residual, &self.current.state);
        let frame = self.current.state.material_frame(0);
        let data = &self.current.mesh.elements[0];
        let rest = frame.u * data.rest_curvature[0][0] + frame.v * data.rest_curvature[0][1];
        report.push_force_n = clamp.push_force(&frame.t, data.bending[0], data.torsion[0], &rest);
        report.torque_nmm = clamp.torque;
        if Layout::<C>::TWIST {
            report.tip_rotation_rad += self.current.state.twist();
        }
    }
}
