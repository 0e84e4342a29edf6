//! Readouts for the operator.

use endowire_assess::Standing;
use endowire_core::insertion::{Packing, StepReport};
use endowire_viewer::Mode;
use serde::Serialize;

use crate::session::IdleKey;

/// Limits above which the operator is warned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Push force, N, in either direction.
    pub push_n: f64,
    /// Torque, N·mm, in either direction.
    pub torque_nmm: f64,
}

impl Default for Limits {
    /// 1 N and 5 N·mm.
    fn default() -> Self {
        Self { push_n: 1.0, torque_nmm: 5.0 }
    }
}

/// An event that the operator must know of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Number of steps carried out before it.
    pub step: usize,
    /// Time of the session, s.
    pub time_s: f64,
    /// Its kind.
    pub kind: EventKind,
    /// Description.
    pub text: String,
}

impl Event {
    /// Seconds for which an event is shown.
    const SHOWN_S: f64 = 6.0;

    /// Whether it is still to be shown after so many steps, at this time: a refusal only until a step succeeds.
    pub fn is_shown(&self, steps: usize, time_s: f64) -> bool {
        let is_over = self.kind == EventKind::Refused && steps > self.step;
        time_s - self.time_s < Self::SHOWN_S && !is_over
    }
}

/// Kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A device released energy and jumped.
    Jumped,
    /// A step that the vessel does not allow, or that found no equilibrium.
    Blocked,
    /// An invalid input or step.
    Refused,
    /// The tip has left the vessel.
    Left,
    /// The force or torque on an instrument exceeds its limit.
    Limit,
    /// A coil was detached.
    Detached,
    /// Loops of coils have come out of the neck of the sac.
    Herniated,
    /// The script has ended, or was ended by a motion of the operator.
    Script,
    /// The subject has ended: its goal was reached, or a limit was passed.
    Ended,
}

/// One instrument.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstrumentReadout {
    /// Its name.
    pub name: String,
    /// Total length, mm.
    pub length_mm: f64,
    /// Length inserted, mm.
    pub inserted_mm: f64,
    /// Advance that the device has not yet followed in its ticks, mm.
    pub behind_mm: f64,
    /// Rotation of the tail, degrees.
    pub rotation_deg: f64,
    /// Value to which it is steered, −1 to 1; `None` if no section of it is steered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steer: Option<f64>,
    /// Push force, N; `None` where it jumps.
    pub push_force_n: Option<f64>,
    /// Torque that holds the instrument, N·mm.
    pub torque_nmm: f64,
    /// Whether force or torque exceed their limits.
    pub warns: bool,
}

/// The cath lab.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabReadout {
    /// Whether the beam is on.
    pub live: bool,
    /// Imaging mode.
    pub mode: Mode,
    /// Primary angle, LAO positive.
    pub lao_deg: f64,
    /// Secondary angle, cranial positive.
    pub cra_deg: f64,
    /// Both angles of the second plane, if there is one.
    pub second_deg: Option<[f64; 2]>,
    /// Magnification.
    pub magnification: f64,
    /// Width of the field of view at the isocentre, mm.
    pub field_mm: f64,
    /// Fractions of the field that the collimator leaves open.
    pub open: [f64; 2],
    /// Beam-on time, s.
    pub beam_s: f64,
    /// Air kerma at the detectors so far, µGy; as delivered by exposure control, if it acts.
    pub dose_ugy: f64,
    /// Air kerma at the patient entrance reference points so far, µGy, without backscatter: 150 mm before the
    /// isocentre. Absent until the beam was on, since it depends on the patient.
    pub entrance_ugy: Option<f64>,
    /// Kerma–area product so far, µGy·m².
    pub kerma_area_ugym2: Option<f64>,
    /// Peak voltage of the tube, kV.
    pub kvp: f64,
    /// Current of the tube in a pulse, mA, if exposure control has chosen it.
    pub current_ma: Option<f64>,
    /// Source to detector, mm.
    pub sid_mm: f64,
    /// Contrast medium that has flowed from hands' injections, ml, including undone ones.
    pub contrast_ml: f64,
}

/// Statistics of the steps so far, without undone ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Went {
    /// Number of steps without an equilibrium.
    pub unconverged_steps: u64,
    /// Number of steps in which a device jumped.
    pub jumps: u64,
    /// Number of relaxations ([`StepReport::relaxations`]).
    pub relaxations: u64,
}

impl Went {
    /// Adds a step.
    pub(crate) fn and(self, report: &StepReport) -> Self {
        Self {
            unconverged_steps: self.unconverged_steps + u64::from(report.has_failed()),
            jumps: self.jumps + u64::from(report.jumped),
            relaxations: self.relaxations + u64::from(report.relaxations),
        }
    }
}

/// The readout at one time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Readout {
    /// Number of steps carried out.
    pub step: usize,
    /// Statistics of these steps.
    #[serde(flatten)]
    pub went: Went,
    /// Time of the session, s.
    pub time_s: f64,
    /// Whether the scene's script is being played.
    pub demonstrates: bool,
    /// Name of the selected instrument.
    pub selected: String,
    /// The instruments, innermost first.
    pub instruments: Vec<InstrumentReadout>,
    /// Position of the foremost tip, mm.
    pub tip_mm: Option<[f64; 3]>,
    /// Number of wall contacts.
    pub contacts: usize,
    /// Sum of the magnitudes of all wall forces, N, as limited and measured of a subject.
    pub wall_force_n: f64,
    /// The cath lab.
    pub lab: LabReadout,
    /// Packing of the scene's sac, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packing: Option<Packing>,
    /// Progress of the subject, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subject: Option<Standing>,
    /// The last event. It stays until another happens: `events` tells whether one has.
    pub event: Option<Event>,
    /// Number of events so far.
    pub events: usize,
    /// Keys that would do nothing now.
    pub idle_keys: Vec<IdleKey>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_is_shown_until_a_step_succeeds_and_others_for_a_while() {
        let event = |kind| Event { step: 7, time_s: 10.0, kind, text: String::new() };
        let refused = event(EventKind::Refused);
        assert!(refused.is_shown(7, 11.0) && !refused.is_shown(8, 11.0) && !refused.is_shown(7, 17.0));
        let jumped = event(EventKind::Jumped);
        assert!(jumped.is_shown(8, 11.0) && !jumped.is_shown(8, 17.0));
    }
}
