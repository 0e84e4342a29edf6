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
    /// Deformation of the vessel wall, and of the device's surface where its loops touch each other.
    pub wall: f64,
    /// In a [`Field`](crate::field::Field); 0 without one.
    #[serde(default)]
    pub field: f64,
}

impl Energy {
    /// Sum of all terms, mJ.
    pub fn total(&self) -> f64 {
        self.bend + self.twist + self.wall + self.field
    }
}

impl StepReport {
    /// The report of a step in which the hand does nothing.
    pub(crate) fn rest(&mut self) {
        (self.iterations, self.solves, self.substeps) = (0, 0, 0);
        (self.dissipated_mj, self.jumped, self.jump) = (0.0, false, None);
        (self.relaxations, self.slides) = (0, 0);
    }
}

impl StepReport {
    /// Whether the device is on its way still, after ticks: it has not followed its hands, or has not come to rest.
    pub fn is_under_way(&self) -> bool {
        !self.behind.is_empty()
    }

    /// Whether no equilibrium was found, which is another thing than being on the way to one.
    pub fn has_failed(&self) -> bool {
        !self.converged && !self.is_under_way()
    }

    /// What one hand has done and feels: that of an instrument, or of a device alone the whole.
    pub fn hand(&self, index: usize) -> InstrumentReport {
        self.instruments.get(index).copied().unwrap_or(InstrumentReport {
            inserted_mm: self.inserted_mm,
            rotation_rad: self.rotation_rad,
            tip_rotation_rad: self.tip_rotation_rad,
            push_force_n: Some(self.push_force_n),
            torque_nmm: self.torque_nmm,
        })
    }

    /// What every hand has done and feels: of several instruments, or of a device alone.
    pub fn hands(&self) -> Vec<InstrumentReport> {
        self.each_hand().collect()
    }

    /// Length inserted of each instrument, or of the device alone, mm.
    pub fn lengths_mm(&self) -> Vec<f64> {
        self.each_hand().map(|hand| hand.inserted_mm).collect()
    }

    /// How hard the wall holds the device, whose line `shape` is and whose outer radius at the tip is `tip_radius_mm`.
    ///
    /// A contact is at the tip where its place on the device's axis is no farther from the end of the line than that radius: there the wall
    /// is felt by the end itself, and not by the shaft beside it.
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

/// What one of several instruments does after a step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InstrumentReport {
    /// Length inside the sheath's mouth, mm.
    pub inserted_mm: f64,
    /// Turn of its hand since the start, rad.
    pub rotation_rad: f64,
    /// Turn of its tip, carried along the axis without twist, rad.
    pub tip_rotation_rad: f64,
    /// Force with which its hand must push, N: the slope of the energy with respect to its inserted length. None where that jumps: its
    /// tip is at that of another, or nothing of it is in.
    pub push_force_n: Option<f64>,
    /// Torque with which its hand must hold it, N·mm: the slope of the energy with respect to its turn.
    pub torque_nmm: f64,
}

/// How hard the wall holds a device: sizes of the forces at its contacts, each of normal and friction together.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WallForce {
    /// Their sum, N.
    pub sum_n: f64,
    /// The largest one, N. Contacts stand for lengths of the device: it depends on how far they are apart.
    pub largest_n: f64,
    /// The sum of those at the tip ([`StepReport::wall_force`]), N.
    pub tip_n: f64,
}

/// Force across the line, at a node, by which instruments that lie in one another hold each other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LateralForce {
    /// Force on the inner one, N.
    pub force_n: Vec3,
    /// Length of it that the node stands for, mm; 0 where nothing holds it. Where one ends the force is not spread over that: it gathers there.
    pub length_mm: f64,
    /// Axial force of the inner one, and all that lies in it, behind the node, N.
    pub tension_n: f64,
    /// Friction on it along the line, towards the tip, N.
    pub friction_n: f64,
    /// Couple of the friction on it about the line, N·mm.
    pub friction_nmm: f64,
}

/// A jump: from the end of a path of equilibria to where the device comes to rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Jump {
    /// Energy that was lost in it, to motion and friction, mJ. Work of hands, wall and blood = energy stored + `dissipated_mj` + this.
    pub released_mj: f64,
    /// Where the device has moved farthest for the room that it had, mm: its place after the jump.
    pub position_mm: Vec3,
}

/// What is seen and felt of an insertion after a step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StepReport {
    /// Length inside the sheath's mouth, mm; of several instruments that of the farthest.
    pub inserted_mm: f64,
    /// Turn of the tail since the start, rad; of several instruments that of the innermost, as the next.
    pub rotation_rad: f64,
    /// Turn of the tip about the device's axis since the start, carried along the axis without twist, rad: what is left of the
    /// hand's turn, or what a whip adds to it.
    pub tip_rotation_rad: f64,
    /// Energy terms, mJ.
    pub energy: Energy,
    /// Force with which the hand must push to hold the device, N; negative where it must pull. Of several instruments the sum.
    ///
    /// F = −n·t − |m|²/(2EI) at the sheath, with n and m the internal force and moment: the second,
    /// configurational term makes it the derivative of the energy with respect to the inserted length.
    pub push_force_n: f64,
    /// Torque with which the hand must hold the tail, N·mm; of several instruments the sum.
    pub torque_nmm: f64,
    /// Each of several instruments, the innermost first; empty for a device alone.
    pub instruments: Vec<InstrumentReport>,
    /// Deepest penetration of the device's surface into the wall at any node, mm; 0 without contact.
    pub max_penetration_mm: f64,
    /// Energy that friction took in this step, mJ; in jumps it is not separated ([`Jump`]).
    pub dissipated_mj: f64,
    /// Where the wall holds the device.
    pub contacts: Vec<Contact>,
    /// Force of the blood that flows on the device, N; zero where no flow is given.
    pub drag_n: Vec3,
    /// The opening through which the tip has left the vessel, while it is beyond it.
    pub left_through: Option<usize>,
    /// Newton iterations of this step, those of attempts in vain included.
    pub iterations: u32,
    /// Linear solves of these: in an iteration as often as it takes to find which contacts press at its end.
    pub solves: u32,
    /// Parts that the command was cut into.
    pub substeps: u32,
    /// How often the device slid on while the hand held still, because friction and wall forces were not to be had in one step.
    pub slides: u32,
    /// Parts of the command in which no equilibrium was near, at a fold or in a jam, and the device moved until it came to rest: the last
    /// resort. 0 nearly always.
    pub relaxations: u32,
    /// What is left over where it came to rest, over the largest force in the device: of the forces at a node, or of those on the wall
    /// that friction goes with.
    pub imbalance: f64,
    /// Whether the device jumped to a lower minimum: it set free energy that the hand had put in.
    pub jumped: bool,
    /// What was set free, and where; none where nothing was, or the method does not report it.
    pub jump: Option<Jump>,
    /// Whether the device carries material angles: only with a shape or friction.
    pub angles: bool,
    /// Nodes of sub-steps in which the device moved to a new equilibrium, since the start; where it is in one as it has slid, nothing is
    /// solved for.
    pub nodes_solved: u64,
    /// Whether the step met the method's own convergence test.
    pub converged: bool,
    /// What each hand, of a device alone the one, has done in ticks ([`Method::tick`](crate::methods::Method::tick)) that the device has not yet followed: the next tick or
    /// step goes on with it. Empty where nothing is left over.
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
            let told = [force.sum_n, force.largest_n, force.tip_n];
            assert!(told.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{told:?}");
        };
        close(report.wall_force(&shape, 0.5), [0.8, 0.5, 0.3]);
        // A thinner tip has the last alone, one as thick as the way is long all of them.
        close(report.wall_force(&shape, 0.3), [0.8, 0.5, 0.2]);
        close(report.wall_force(&shape, 10.0), [0.8, 0.5, 0.8]);
        // Nothing inserted, and nothing touched.
        close(report.wall_force(&Shape::default(), 0.5), [0.8, 0.5, 0.0]);
        close(StepReport::default().wall_force(&shape, 0.5), [0.0; 3]);
    }
}
