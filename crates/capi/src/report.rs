//! What a step led to: the report, each instrument, contacts.

use endowire_core::Vec3;
use endowire_core::insertion::{Contact, Simulation};

use crate::border::{Room, Sized64, fill, handle};
use crate::simulation::EndowireSimulation;
use crate::status::{EndowireStatus, Failure, call};

/// What the last step led to. With several instruments, numbers without a name of their own are of all together.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndowireReport {
    /// Set it to `sizeof(EndowireReport)`; the library sets it to how many bytes it has filled.
    pub size: u64,
    /// Time since the start, s.
    pub time_s: f64,
    /// Length beyond the mouth of the sheath of the instrument that is farthest in, mm.
    pub inserted_mm: f64,
    /// The tip of that instrument; the mouth of the sheath while nothing is in. mm.
    pub tip_mm: [f64; 3],
    /// Sum of the forces of all hands, N; positive pushes.
    pub push_force_n: f64,
    /// Sum of the torques of all hands, N mm.
    pub torque_nmm: f64,
    /// Sum of the magnitudes of the wall's forces, N.
    pub wall_force_sum_n: f64,
    /// The largest of them, N.
    pub wall_force_largest_n: f64,
    /// Those at the tip, N.
    pub wall_force_tip_n: f64,
    /// Deepest penetration of the wall, mm; 0 without contact.
    pub max_penetration_mm: f64,
    /// Energy of bending, mJ.
    pub bend_energy_mj: f64,
    /// Energy of twist, mJ.
    pub twist_energy_mj: f64,
    /// Energy of the deformed wall, mJ.
    pub wall_energy_mj: f64,
    /// Energy in fields, mJ.
    pub field_energy_mj: f64,
    /// Energy in the twist of the tails outside the body, mJ.
    pub tail_energy_mj: f64,
    /// Energy dissipated by friction in this step, mJ.
    pub dissipated_mj: f64,
    /// Energy released in jumps, mJ; 0 without jumps.
    pub released_mj: f64,
    /// Out-of-balance force relative to the largest force in the instruments.
    pub imbalance: f64,
    /// Drag of the blood on all instruments, N.
    pub drag_n: [f64; 3],
    /// The opening through which the instruments have left the vessel; -1 inside.
    pub left_through: i32,
    /// Number of instruments.
    pub instruments: u32,
    /// Number of points of `endowire_positions_mm`.
    pub points: u32,
    /// Number of contacts of `endowire_contacts`.
    pub contacts: u32,
    /// Number of detached coils.
    pub coils: u32,
    /// Newton iterations.
    pub iterations: u32,
    /// Linear solves in them.
    pub solves: u32,
    /// Parts into which the command was divided.
    pub substeps: u32,
    /// How often the instruments slid on while the hands kept still.
    pub slides: u32,
    /// Parts that did not follow a path from the last equilibrium; nearly always 0.
    pub relaxations: u32,
    /// 1 if the step met the convergence test of its method, otherwise 0.
    pub converged: u32,
    /// 1 while motion is behind, or the instruments are not at rest: the next step or tick goes on with it.
    pub under_way: u32,
    /// 1 if no equilibrium was found, in contrast to being under way to one.
    pub failed: u32,
    /// 1 if the instruments jumped to a lower minimum.
    pub jumped: u32,
}

impl Sized64 for EndowireReport {
    const FIRST_BYTES: usize = 240;
}

/// One instrument.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndowireInstrument {
    /// Set it to `sizeof(EndowireInstrument)`; the library sets it to how many bytes it has filled.
    pub size: u64,
    /// Its whole length, mm.
    pub length_mm: f64,
    /// Its largest outer radius, mm.
    pub max_radius_mm: f64,
    /// Length of the coil at its tip that can be detached, mm; 0 if there is none.
    pub coil_mm: f64,
    /// Length beyond the mouth of the sheath, mm.
    pub inserted_mm: f64,
    /// Its tip; the mouth of the sheath while it is not in. mm.
    pub tip_mm: [f64; 3],
    /// Rotation of its hand since the start, rad.
    pub rotation_rad: f64,
    /// Rotation at the mouth of the sheath, rad: the hand's, less the twist of the tail between.
    pub mouth_rotation_rad: f64,
    /// Rotation of its tip, relative to a frame carried along the axis without twist, rad.
    pub tip_rotation_rad: f64,
    /// Force of its hand, N; positive pushes. NaN where it jumps: if its tip is at that of another, or it is not in.
    pub push_force_n: f64,
    /// Torque of its hand, N mm.
    pub torque_nmm: f64,
    /// Value to which it is steered, -1 to 1.
    pub steer: f64,
    /// What steering takes: derivative of the energy in that value, mJ.
    pub steer_mj: f64,
    /// Motion of its hand that it has not followed yet, mm.
    pub behind_advance_mm: f64,
    /// Rotation of its hand that it has not followed yet, rad.
    pub behind_rotate_rad: f64,
    /// Change of its steering that it has not followed yet.
    pub behind_steer: f64,
    /// 1 if it can be steered, otherwise 0.
    pub steerable: u32,
    /// 1 once its coil is detached, otherwise 0.
    pub detached: u32,
}

impl Sized64 for EndowireInstrument {
    const FIRST_BYTES: usize = 152;
}

/// A contact with the wall. Forces are of the wall on the instruments.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndowireContact {
    /// Place on the axis, mm.
    pub position_mm: [f64; 3],
    /// Unit normal into the lumen.
    pub normal: [f64; 3],
    /// Normal force, N.
    pub force_n: f64,
    /// Friction, N.
    pub friction_n: [f64; 3],
    /// Penetration, mm.
    pub penetration_mm: f64,
    /// Triangle of the vessel (`endowire_vessel_triangles`).
    pub triangle: u64,
}

impl EndowireContact {
    fn of(contact: &Contact) -> Self {
        Self {
            position_mm: contact.position_mm.into(),
            normal: contact.normal.into(),
            force_n: contact.force_n,
            friction_n: contact.friction_n.into(),
            penetration_mm: contact.penetration_mm,
            triangle: contact.triangle.into(),
        }
    }
}

/// A count for C; more than four thousand million of anything are not there.
fn count(of: usize) -> u32 {
    u32::try_from(of).unwrap_or(u32::MAX)
}

/// The tip, or the mouth of the sheath while nothing is in.
fn or_mouth(tip_mm: Option<Vec3>, simulation: &Simulation) -> [f64; 3] {
    tip_mm.unwrap_or(simulation.sheath().position_mm).into()
}

impl EndowireReport {
    fn of(simulation: &Simulation) -> Self {
        let (report, force) = (simulation.report(), simulation.wall_force());
        Self {
            size: 0,
            time_s: simulation.time_s(),
            inserted_mm: report.inserted_mm,
            tip_mm: or_mouth(simulation.shape().tip_mm(), simulation),
            push_force_n: report.push_force_n,
            torque_nmm: report.torque_nmm,
            wall_force_sum_n: force.sum_n,
            wall_force_largest_n: force.largest_n,
            wall_force_tip_n: force.tip_n,
            max_penetration_mm: report.max_penetration_mm,
            bend_energy_mj: report.energy.bend,
            twist_energy_mj: report.energy.twist,
            wall_energy_mj: report.energy.wall,
            field_energy_mj: report.energy.field,
            tail_energy_mj: report.energy.tail,
            dissipated_mj: report.dissipated_mj,
            released_mj: report.jump.map_or(0.0, |jump| jump.released_mj),
            imbalance: report.imbalance,
            drag_n: report.drag_n.into(),
            left_through: report
                .left_through
                .map_or(-1, |opening| i32::try_from(opening).unwrap_or(i32::MAX)),
            instruments: count(simulation.stack().instruments().len()),
            points: count(simulation.shape().len()),
            contacts: count(report.contacts.len()),
            coils: count(simulation.coils().len()),
            iterations: report.iterations,
            solves: report.solves,
            substeps: report.substeps,
            slides: report.slides,
            relaxations: report.relaxations,
            converged: report.converged.into(),
            under_way: report.is_under_way().into(),
            failed: report.has_failed().into(),
            jumped: report.jumped.into(),
        }
    }
}

impl EndowireInstrument {
    fn of(simulation: &Simulation, index: usize) -> Result<Self, Failure> {
        let instruments = simulation.stack().instruments();
        let Some(instrument) = instruments.get(index) else {
            let text = format!("instrument = {index}: there are {}, the innermost is 0", instruments.len());
            return Err(Failure::input(text));
        };
        let (device, hand) = (&instrument.device, simulation.report().hand(index));
        let behind = simulation.report().behind.get(index).copied().unwrap_or_default();
        Ok(Self {
            size: 0,
            length_mm: device.length_mm(),
            max_radius_mm: device.max_radius_mm(),
            coil_mm: device.coil_mm(),
            inserted_mm: hand.inserted_mm,
            tip_mm: or_mouth(simulation.tip_of_mm(index), simulation),
            rotation_rad: hand.rotation_rad,
            mouth_rotation_rad: hand.mouth_rotation_rad,
            tip_rotation_rad: hand.tip_rotation_rad,
            push_force_n: hand.push_force_n.unwrap_or(f64::NAN),
            torque_nmm: hand.torque_nmm,
            steer: hand.steer,
            steer_mj: hand.steer_mj,
            behind_advance_mm: behind.advance_mm,
            behind_rotate_rad: behind.rotate_rad,
            behind_steer: behind.steer,
            steerable: device.is_steerable().into(),
            detached: simulation.coils().iter().any(|coil| coil.instrument == index).into(),
        })
    }
}

/// Fills the report of the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_report(
    simulation: *const EndowireSimulation,
    report: *mut EndowireReport,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let told = EndowireReport::of(&*unsafe { handle("simulation", simulation) }?.lock()?);
        // SAFETY: the caller's promise of a structure as large as its size says.
        unsafe { fill("report", report, &told) }
    })
}

/// Fills what is known of one instrument; the innermost is 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_instrument(
    simulation: *const EndowireSimulation,
    instrument: usize,
    out: *mut EndowireInstrument,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let told = EndowireInstrument::of(&simulation, instrument)?;
        // SAFETY: the caller's promise of a structure as large as its size says.
        unsafe { fill("out", out, &told) }
    })
}

/// Copies the contacts with the wall: a list (see the top) with a capacity in contacts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn endowire_contacts(
    simulation: *const EndowireSimulation,
    contacts: *mut EndowireContact,
    capacity: usize,
    count: *mut usize,
) -> EndowireStatus {
    call(|| {
        // SAFETY: the caller's promise of a handle.
        let simulation = unsafe { handle("simulation", simulation) }?.lock()?;
        let list: Vec<_> = simulation.report().contacts.iter().map(EndowireContact::of).collect();
        // SAFETY: the caller's promise of room for as many as the capacity says, and of a place for a count.
        unsafe { Room { name: "contacts", out: contacts, capacity, count }.take(&list) }
    })
}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::*;

    #[test]
    fn layouts_of_the_first_version_stay_and_have_no_gaps() {
        // Gaps would be bytes that nobody has written.
        assert_eq!(size_of::<EndowireReport>(), EndowireReport::FIRST_BYTES);
        assert_eq!(offset_of!(EndowireReport, left_through), 8 * 23);
        assert_eq!(offset_of!(EndowireReport, jumped) + 4, EndowireReport::FIRST_BYTES);
        assert_eq!(size_of::<EndowireInstrument>(), EndowireInstrument::FIRST_BYTES);
        assert_eq!(offset_of!(EndowireInstrument, steerable), 8 * 18);
        assert_eq!(offset_of!(EndowireInstrument, detached) + 4, EndowireInstrument::FIRST_BYTES);
        assert_eq!(size_of::<EndowireContact>(), 8 * 12);
    }
}
