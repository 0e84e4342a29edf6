//! What the operator reads.

use endowire_assess::Standing;
use endowire_core::insertion::{Packing, StepReport};
use endowire_viewer::Mode;
use serde::Serialize;

/// Beyond these a hand is warned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Push force, N, of either sign.
    pub push_n: f64,
    /// Torque, N·mm, of either sign.
    pub torque_nmm: f64,
}

impl Default for Limits {
    /// 1 N and 5 N·mm.
    fn default() -> Self {
        Self { push_n: 1.0, torque_nmm: 5.0 }
    }
}

/// What has happened that an operator must know.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Steps carried out before it.
    pub step: usize,
    /// Time of the session, s.
    pub time_s: f64,
    /// What kind.
    pub kind: EventKind,
    /// For people.
    pub text: String,
}

/// Kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// A device let go of energy and jumped.
    Jumped,
    /// A step that the vessel does not allow, or that found no equilibrium.
    Blocked,
    /// An input or a step beyond what there is.
    Refused,
    /// The tip has left the vessel.
    Left,
    /// A force or torque of a hand is beyond its limit.
    Limit,
    /// A coil was left behind.
    Detached,
    /// Loops of coils have come out of the neck of the sac that they fill.
    Herniated,
    /// The script that is shown is at its end, or a hand has taken over.
    Script,
    /// The subject has ended: its goal is reached, or one of its limits is passed.
    Ended,
}

/// One instrument.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstrumentReadout {
    /// Its name.
    pub name: String,
    /// Its own length, mm.
    pub length_mm: f64,
    /// Length inserted, mm.
    pub inserted_mm: f64,
    /// How much farther the hand has pushed than the device has followed in its ticks yet, mm.
    pub behind_mm: f64,
    /// Turn of the hand, degrees.
    pub rotation_deg: f64,
    /// Force with which the hand pushes, N; none where it jumps.
    pub push_force_n: Option<f64>,
    /// Torque with which the hand holds it, N·mm.
    pub torque_nmm: f64,
    /// Whether force or torque are beyond the limits.
    pub warns: bool,
}

/// The room.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabReadout {
    /// Whether the beam is on.
    pub live: bool,
    /// What is shown.
    pub mode: Mode,
    /// Positioner primary angle, LAO positive.
    pub lao_deg: f64,
    /// Positioner secondary angle, cranial positive.
    pub cra_deg: f64,
    /// Both angles of the second plane, where there is one.
    pub second_deg: Option<[f64; 2]>,
    /// Magnification.
    pub magnification: f64,
    /// Width of what is seen at the isocentre, mm.
    pub field_mm: f64,
    /// Shares of the field that the blades leave open.
    pub open: [f64; 2],
    /// How long the beam was on, s.
    pub beam_s: f64,
    /// Air kerma at the detectors so far, µGy: what exposure control has brought, where it acts.
    pub dose_ugy: f64,
}

/// How the steps so far went, less those taken back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Went {
    /// Steps that found no equilibrium.
    pub unconverged_steps: u64,
    /// Steps in which a device jumped.
    pub jumps: u64,
    /// Last resorts ([`StepReport::relaxations`]).
    pub relaxations: u64,
}

impl Went {
    /// With one more step.
    pub(crate) fn and(self, report: &StepReport) -> Self {
        Self {
            unconverged_steps: self.unconverged_steps + u64::from(report.has_failed()),
            jumps: self.jumps + u64::from(report.jumped),
            relaxations: self.relaxations + u64::from(report.relaxations),
        }
    }
}

/// All that is read at one moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Readout {
    /// Steps carried out.
    pub step: usize,
    /// How they went.
    #[serde(flatten)]
    pub went: Went,
    /// Time of the session, s.
    pub time_s: f64,
    /// Whether the scene's script is shown.
    pub demonstrates: bool,
    /// Name of the instrument that is in the hand.
    pub selected: String,
    /// Each instrument, the innermost first.
    pub instruments: Vec<InstrumentReadout>,
    /// Tip of the farthest, mm.
    pub tip_mm: Option<[f64; 3]>,
    /// Wall contacts.
    pub contacts: usize,
    /// Largest force on the wall at one contact, N.
    pub wall_force_n: f64,
    /// The room.
    pub lab: LabReadout,
    /// What coils fill of the scene's sac, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packing: Option<Packing>,
    /// How the subject stands, if it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subject: Option<Standing>,
    /// What has happened last.
    pub event: Option<Event>,
    /// How many events there were.
    pub events: usize,
}
