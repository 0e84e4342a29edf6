//! The table of steps: steps.csv.

use std::path::Path;

use endowire_core::Result;
use endowire_core::insertion::{Move, Simulation};

use crate::columns::columns;
use crate::table;

/// The table.
pub const STEPS: &str = "steps.csv";

columns! {
    /// A row of steps.csv: what was done in a step, and the state after it. With several instruments, advance and rotation
    /// in the step are those of the hand that moved first, other rotations those of the innermost one.
    /// Columns that earlier versions did not write, and those that a table written by hand may leave out, are `None` there.
    pub struct StepRow {
        /// Number of the step, from 1.
        pub step: usize,
        ..hand,
        /// Number of nodes.
        pub nodes: usize,
        /// Place of the foremost tip; 0 where nothing is inserted.
        pub tip_x_mm: f64,
        /// As `tip_x_mm`.
        pub tip_y_mm: f64,
        /// As `tip_x_mm`.
        pub tip_z_mm: f64,
        /// Force with which the hand must push to hold the device; negative if it must pull.
        pub push_force_n: f64,
        /// Torque with which the hand must hold the tail.
        pub torque_nmm: f64,
        /// Energy in bending.
        pub bend_mj: Option<f64>,
        /// Energy in twist.
        pub twist_mj: Option<f64>,
        /// Energy in the wall.
        pub wall_mj: Option<f64>,
        /// Energy in fields; 0 without one.
        pub field_mj: Option<f64>,
        /// Energy in the twist of the tail.
        pub tail_mj: Option<f64>,
        /// Energy in the course of a vessel that yields.
        pub vessel_mj: Option<f64>,
        /// Energy dissipated by friction in the step.
        pub dissipated_mj: Option<f64>,
        /// Number of contact points that the wall presses on.
        pub contacts: Option<usize>,
        /// Largest depth of the device's surface in the wall.
        pub max_penetration_mm: Option<f64>,
        /// Largest angle by which an element bends from end to end.
        pub largest_bend_rad: Option<f64>,
        /// Newton iterations of the step.
        pub iterations: Option<u32>,
        /// Parts into which the command was divided.
        pub substeps: Option<u32>,
        /// Whether the device jumped to a lower minimum and released energy.
        pub jumped: bool,
        /// Number of the opening through which the device has left; empty while it is inside.
        pub left_through: Option<usize>,
        /// Number of nodes that were solved for since the start.
        pub nodes_solved: Option<u64>,
        /// Whether the device carries material angles.
        pub angles: Option<bool>,
        /// Whether the step met the method's own test of an equilibrium.
        pub converged: Option<bool>,
        /// Parts of the command in which the device moved until it came to rest.
        pub relaxations: Option<u32>,
        /// Force out of balance after a relaxation, over the largest force in the device; empty where none was found.
        pub imbalance: Option<f64>,
        /// Energy released in jumps.
        pub released_mj: Option<f64>,
        /// Sum of the magnitudes of all contact forces.
        pub wall_force_sum_n: Option<f64>,
        /// Largest contact force.
        pub wall_force_largest_n: Option<f64>,
        /// Sum of the magnitudes of contact forces at the tip.
        pub wall_force_tip_n: Option<f64>,
        /// Magnitude of the drag of the blood.
        pub drag_n: Option<f64>,
        /// Bound of the displacement of a vessel that yields.
        pub vessel_displacement_mm: Option<f64>,
        /// Time at the end of the step.
        pub time_s: Option<f64>,
    }
}

impl StepRow {
    /// The row of step number `step`, which the simulation has just carried out with these moves, at its end `time_s`.
    pub fn of(step: usize, moves: &[Move], time_s: f64, simulation: &Simulation) -> Self {
        let (report, shape) = (simulation.report(), simulation.shape());
        let command = moves.first().map(|one| one.command).unwrap_or_default();
        let tip = shape.tip_mm().unwrap_or_default();
        let force = simulation.wall_force();
        Self {
            step,
            advance_mm: command.advance_mm,
            rotate_rad: command.rotate_rad,
            inserted_mm: report.inserted_mm,
            rotation_rad: Some(report.rotation_rad),
            mouth_rotation_rad: Some(report.mouth_rotation_rad),
            tip_rotation_rad: Some(report.tip_rotation_rad),
            nodes: shape.len(),
            tip_x_mm: tip.x,
            tip_y_mm: tip.y,
            tip_z_mm: tip.z,
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            bend_mj: Some(report.energy.bend),
            twist_mj: Some(report.energy.twist),
            wall_mj: Some(report.energy.wall),
            field_mj: Some(report.energy.field),
            tail_mj: Some(report.energy.tail),
            vessel_mj: Some(report.energy.vessel),
            dissipated_mj: Some(report.dissipated_mj),
            contacts: Some(report.contacts.len()),
            max_penetration_mm: Some(report.max_penetration_mm),
            largest_bend_rad: Some(report.largest_bend_rad),
            iterations: Some(report.iterations),
            substeps: Some(report.substeps),
            jumped: report.jumped,
            left_through: report.left_through,
            nodes_solved: Some(report.nodes_solved),
            angles: Some(report.angles),
            converged: Some(!report.has_failed()),
            relaxations: Some(report.relaxations),
            imbalance: Some(report.imbalance).filter(|part| part.is_finite()),
            released_mj: Some(report.jump.map_or(0.0, |jump| jump.released_mj)),
            wall_force_sum_n: Some(force.sum_n),
            wall_force_largest_n: Some(force.largest_n),
            wall_force_tip_n: Some(force.tip_n),
            drag_n: Some(report.drag_n.norm()),
            vessel_displacement_mm: Some(simulation.yielded_mm()),
            time_s: Some(time_s),
        }
    }

    /// All energy stored; `None` where the table does not tell bending, twist or the wall's.
    pub fn energy_mj(&self) -> Option<f64> {
        let others = [self.field_mj, self.tail_mj, self.vessel_mj].into_iter().flatten();
        Some(self.bend_mj? + self.twist_mj? + self.wall_mj? + others.sum::<f64>())
    }
}

/// The rows of the table of a recording.
///
/// # Errors
/// [`Error::Content`](endowire_core::Error::Content) for a table that is missing, or has a row that is none.
pub fn read_steps(folder: &Path) -> Result<Vec<StepRow>> {
    table::read(&folder.join(STEPS))
}
