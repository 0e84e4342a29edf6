//! The report of a step.

use serde::{Deserialize, Serialize};

use super::command::Command;
use crate::Vec3;
use crate::contact::Contact;
use crate::shape::Shape;

/// The terms of the total potential energy, mJ.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Energy {
    /// Bending.
    pub bend: f64,
    /// Twist; 0 for methods without it.
    pub twist: f64,
    /// Deformation of the vessel wall, and of the device's surface at contacts between its loops.
    pub wall: f64,
    /// In a [`Field`](crate::field::Field); 0 without one.
    #[serde(default)]
    pub field: f64,
    /// Twist of the tails, between the hands and the sheath's mouth; 0 for methods without it.
    #[serde(default)]
    pub tail: f64,
    /// Of a vessel whose course yields; 0 where it does not.
    #[serde(default)]
    pub vessel: f64,
}

impl Energy {
    /// Sum of all terms, mJ.
    pub fn total(&self) -> f64 {
        self.bend + self.twist + self.wall + self.field + self.tail + self.vessel
    }
}

impl StepReport {
    /// Turns it into the report of a step without hand motion.
    pub(crate) fn rest(&mut self) {
        (self.iterations, self.solves, self.substeps) = (0, 0, 0);
        (self.dissipated_mj, self.jumped, self.jump) = (0.0, false, None);
        (self.relaxations, self.slides) = (0, 0);
    }
}

impl StepReport {
    /// Whether the device is still moving: it has not caught up with its hands, or has not come to rest, after a tick
    /// or after a step whose linear solves were used up.
    pub fn is_under_way(&self) -> bool {
        !self.behind.is_empty()
    }

    /// Whether no equilibrium was found, in contrast to being on the way to one.
    pub fn has_failed(&self) -> bool {
        !self.converged && !self.is_under_way()
    }

    /// Writes the single device as the only instrument, for a method that has no others.
    pub fn write_alone(&mut self) {
        self.instruments.clear();
        let alone = self.hand(0);
        self.instruments.push(alone);
    }

    /// Motion and forces of one hand: of an instrument, or of a single device.
    pub fn hand(&self, index: usize) -> InstrumentReport {
        self.instruments.get(index).copied().unwrap_or(InstrumentReport {
            inserted_mm: self.inserted_mm,
            rotation_rad: self.rotation_rad,
            mouth_rotation_rad: self.mouth_rotation_rad,
            tip_rotation_rad: self.tip_rotation_rad,
            push_force_n: Some(self.push_force_n),
            torque_nmm: self.torque_nmm,
            steer: 0.0,
            steer_mj: 0.0,
        })
    }

    /// Motions and forces of all hands: of several instruments, or of a single device.
    pub fn hands(&self) -> Vec<InstrumentReport> {
        self.each_hand().collect()
    }

    /// Length inserted of each instrument, or of the single device, mm.
    pub fn lengths_mm(&self) -> Vec<f64> {
        self.each_hand().map(|hand| hand.inserted_mm).collect()
    }

    /// Forces of the wall on the device, whose centre line is `shape` and whose outer radius at the tip is
    /// `tip_radius_mm`.
    ///
    /// A contact counts as at the tip if its position on the axis is within that radius of the end of the line: there
    /// it is the end itself that touches the wall, not the shaft beside it.
    pub fn wall_force(&self, shape: &Shape, tip_radius_mm: f64) -> WallForce {
        let tip_mm = shape.tip_mm();
        let mut force = WallForce::default();
        for contact in &self.contacts {
            let size_n = contact.total_n().norm();
            force.sum_n += size_n;
            force.largest_n = force.largest_n.max(size_n);
            if tip_mm.is_some_and(|tip_mm| (contact.position_mm - tip_mm).norm() <= tip_radius_mm) {
                force.tip_n += size_n;
            }
        }
        force
    }

    fn each_hand(&self) -> impl Iterator<Item = InstrumentReport> {
        (0..self.instruments.len().max(1)).map(|index| self.hand(index))
    }
}

/// Motion and forces of an instrument after a step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InstrumentReport {
    /// Length inside the sheath's mouth, mm.
    pub inserted_mm: f64,
    /// Rotation of its hand since the start, rad.
    pub rotation_rad: f64,
    /// Rotation of it at the sheath's mouth, rad: that of the hand less the twist of the tail between.
    pub mouth_rotation_rad: f64,
    /// Rotation of its tip, transported along the axis without twist, rad.
    pub tip_rotation_rad: f64,
    /// Push force of its hand, N: derivative of the energy in its inserted length. `None` where it jumps: its tip is
    /// at that of another, or it is one of several that is not inserted.
    pub push_force_n: Option<f64>,
    /// Holding torque of its hand, N·mm: derivative of the energy in its rotation.
    pub torque_nmm: f64,
    /// Value to which it is steered, −1 to 1; 0 for those that are not.
    pub steer: f64,
    /// Derivative of the energy of the inserted length in that value, mJ: what steering takes.
    pub steer_mj: f64,
}

/// Magnitudes of the wall's forces on a device, each contact's normal force and friction combined.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WallForce {
    /// Their sum, N.
    pub sum_n: f64,
    /// The largest, N. Contacts represent lengths of the device, so it depends on their spacing.
    pub largest_n: f64,
    /// Sum of those at the tip ([`StepReport::wall_force`]), N.
    pub tip_n: f64,
}

/// Force across the line between coaxial instruments at a node.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LateralForce {
    /// Force on the inner instrument, N.
    pub force_n: Vec3,
    /// Sum of the magnitudes with which the two press on each other there, N: more than that force where they have play and
    /// lean on a rim, or on both sides of the lumen.
    pub pressing_n: f64,
    /// Length that the node represents, mm; 0 without a force. Where an instrument ends the force is not distributed
    /// over it but concentrated there.
    pub length_mm: f64,
    /// Axial force behind the node of the inner instrument with all inside it, N.
    pub tension_n: f64,
    /// Friction on it along the line, towards the tip, N.
    pub friction_n: f64,
    /// Couple of friction on it about the line, N·mm.
    pub friction_nmm: f64,
}

/// A jump (snap-through): from a fold to where the device comes to rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Jump {
    /// Energy lost in it to motion and friction, mJ. Work of hands, wall and blood = increase of stored energy +
    /// `dissipated_mj` + this.
    pub released_mj: f64,
    /// Position after the jump, mm, of the node with the largest motion relative to its room.
    pub position_mm: Vec3,
}

/// Observable results of an insertion after a step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StepReport {
    /// Length inside the sheath's mouth, mm; with several instruments, of the one inserted farthest.
    pub inserted_mm: f64,
    /// Rotation of the hand since the start, rad; with several instruments this and the next two are those of the
    /// innermost.
    pub rotation_rad: f64,
    /// Rotation of the device at the sheath's mouth since the start, rad: the hand's, less the twist of the tail between.
    pub mouth_rotation_rad: f64,
    /// Rotation of the tip about the device's axis since the start, transported along the axis without twist, rad:
    /// the hand's rotation reduced by lag or increased by whip.
    pub tip_rotation_rad: f64,
    /// Energy terms, mJ.
    pub energy: Energy,
    /// Force of the hand that holds the device, N; positive pushes, negative pulls. With several instruments, the
    /// sum.
    ///
    /// F = −n·t − |m|²/(2EI) at the sheath, with n and m the internal force and moment: with the second,
    /// configurational term it is the derivative of the energy in the inserted length.
    pub push_force_n: f64,
    /// Torque of the hand that holds the tail, N·mm; with several instruments, the sum.
    pub torque_nmm: f64,
    /// Each instrument, the innermost first; a single device is the only one.
    pub instruments: Vec<InstrumentReport>,
    /// Deepest penetration of the device's surface into the wall at any node, mm; 0 without contact.
    pub max_penetration_mm: f64,
    /// Largest angle by which an element bends from end to end, rad, those of detached coils included. Above 60° a force
    /// may be off by a hundredth, and no element may bend by more than 120°.
    pub largest_bend_rad: f64,
    /// Energy dissipated by friction in this step, mJ; in jumps it is not separated ([`Jump`]).
    pub dissipated_mj: f64,
    /// Contacts with the wall.
    pub contacts: Vec<Contact>,
    /// Drag of blood flow on the device, N; zero without flow.
    pub drag_n: Vec3,
    /// The opening through which the device has left the vessel, while its tip is not back.
    pub left_through: Option<usize>,
    /// Newton iterations of this step, including failed attempts.
    pub iterations: u32,
    /// Linear solves in these iterations: each takes as many as finding the active contacts at its end needs.
    pub solves: u32,
    /// Number of sub-steps of the command.
    pub substeps: u32,
    /// Number of relaxations with the hands held still, needed where friction and wall forces could not be solved for
    /// at once.
    pub slides: u32,
    /// Sub-steps without a nearby equilibrium, at a fold or in a jam, in which the device moved until it came to
    /// rest: the last resort, almost always 0.
    pub relaxations: u32,
    /// Imbalance where it came to rest, relative to the largest force in the device: of the forces at a node, or of
    /// the normal forces that friction follows.
    pub imbalance: f64,
    /// Whether the device jumped to a lower minimum: it released energy that the hand had put in.
    pub jumped: bool,
    /// Energy released, and where; `None` if none was, or the method does not report it.
    pub jump: Option<Jump>,
    /// Whether the device has material angles: only with a rest shape or friction.
    pub angles: bool,
    /// Nodes of sub-steps in which the device moved to a new equilibrium, since the start; sub-steps need no solution
    /// if the device is in equilibrium after sliding.
    pub nodes_solved: u64,
    /// Whether the step met the method's own convergence test.
    pub converged: bool,
    /// Motion of each hand (of a single device one) that the device has not yet followed, in ticks and in steps whose
    /// linear solves were used up ([`Simulation::most_solves`](crate::insertion::Simulation::most_solves)): the next
    /// tick or step continues with it. Empty if nothing remains; zeros if the device is on its way to where it rests.
    pub behind: Vec<Command>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_at_the_tip_is_that_within_a_radius_of_it() {
        let at = |x_mm: f64, force_n: f64, friction_n: f64| Contact {
            position_mm: Vec3::new(x_mm, 0.0, 0.0),
            normal: Vec3::y(),
            force_n,
            friction_n: Vec3::new(friction_n, 0.0, 0.0),
            penetration_mm: 0.0,
            triangle: 0,
        };
        let shape = Shape {
            positions_mm: vec![Vec3::zeros(), Vec3::new(10.0, 0.0, 0.0)],
            tangents: vec![Vec3::x(); 2],
            from_tip_mm: vec![10.0, 0.0],
        };
        let contacts = vec![at(2.0, 0.3, 0.4), at(9.6, 0.1, 0.0), at(10.0, 0.2, 0.0)];
        let report = StepReport { contacts, ..StepReport::default() };
        let close = |force: WallForce, expected: [f64; 3]| {
            let reported = [force.sum_n, force.largest_n, force.tip_n];
            assert!(reported.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{reported:?}");
        };
        close(report.wall_force(&shape, 0.5), [0.8, 0.5, 0.3]);
        // A thin tip includes the last contact alone, one as thick as the distance all of them.
        close(report.wall_force(&shape, 0.3), [0.8, 0.5, 0.2]);
        close(report.wall_force(&shape, 10.0), [0.8, 0.5, 0.8]);
        // Nothing inserted, no contacts.
        close(report.wall_force(&Shape::default(), 0.5), [0.8, 0.5, 0.0]);
        close(StepReport::default().wall_force(&shape, 0.5), [0.0; 3]);
    }
}
