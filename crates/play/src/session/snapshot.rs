//! What a session shows: its readout, and data for drawing.

use endowire_core::insertion::DetachedCoil;
use endowire_core::shape::Shape;
use endowire_core::vessel::Displacement;
use endowire_viewer::{ContactView, FrameTime};

use super::{Session, packing};
use crate::TICKS_PER_S;
use crate::lab::Lab;
use crate::readout::{InstrumentReadout, LabReadout, Readout};

/// Data for drawing one frame.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// The line of all instruments.
    pub shape: Shape,
    /// Inserted length of each instrument, mm.
    pub inserted_mm: Vec<f64>,
    /// Contacts with the wall.
    pub contacts: Vec<ContactView>,
    /// Displacement of the vessel; `None` if it never moves.
    pub displacement: Option<Displacement>,
    /// Detached coils.
    pub coils: Vec<DetachedCoil>,
    /// The cath lab.
    pub lab: Lab,
    /// Number and time of the frame.
    pub moment: FrameTime,
    /// The readout.
    pub readout: Readout,
}

impl Snapshot {
    /// Whether the 3D view is hidden: in an exam, until it has ended.
    pub fn hides_three_d(&self) -> bool {
        self.readout.subject.as_ref().is_some_and(|one| one.task.exam && one.verdict.is_none())
    }
}

impl Session {
    /// Data for drawing the current state.
    pub fn snapshot(&self) -> Snapshot {
        let report = self.simulation.report();
        let contact = |c: &endowire_core::insertion::Contact| ContactView {
            position_mm: c.position_mm,
            force_n: c.total_n(),
        };
        let frame = self.ticks * self.lab.fluoro().frames_per_s as u64 / TICKS_PER_S as u64;
        Snapshot {
            shape: self.simulation.shape().clone(),
            inserted_mm: report.lengths_mm(),
            contacts: report.contacts.iter().map(contact).collect(),
            displacement: self.simulation.displacement(),
            coils: self.simulation.coils().to_vec(),
            lab: self.lab.clone(),
            moment: FrameTime { frame, time_s: self.time_s() },
            readout: self.readout(),
        }
    }

    /// The readout.
    pub fn readout(&self) -> Readout {
        let report = self.simulation.report();
        let spec = self.lab.fluoro();
        Readout {
            step: self.history.steps(),
            went: self.history.went(),
            time_s: self.time_s(),
            demonstrates: self.demonstrates(),
            selected: self.simulation.stack().instruments()[self.selected].name.clone(),
            instruments: self.instruments(),
            tip_mm: self.simulation.shape().tip_mm().map(Into::into),
            contacts: report.contacts.len(),
            wall_force_n: self.telemetry.record().wall_forces_n(&self.simulation)[0],
            lab: LabReadout {
                live: self.lab.is_live(),
                mode: spec.xray.mode,
                lao_deg: spec.c_arm.primary_deg,
                cra_deg: spec.c_arm.secondary_deg,
                second_deg: self.lab.second_deg(),
                magnification: self.lab.magnification(),
                field_mm: self.lab.field_mm(),
                open: self.lab.open(),
                beam_s: self.lab.beam_s(),
                dose_ugy: self.lab.dose_ugy(),
                entrance_ugy: self.lab.entrance_ugy(),
                kerma_area_ugym2: self.lab.kerma_area_ugym2(),
                kvp: self.lab.kvp(),
                current_ma: self.lab.current_ma(),
                sid_mm: spec.c_arm.sid_mm,
                contrast_ml: self.contrast_ml(),
            },
            packing: packing(self.sac.as_ref()),
            subject: self.standing(),
            event: self.events.last().cloned(),
            events: self.events_in_all,
            idle_keys: self.idle_keys(),
        }
    }

    fn instruments(&self) -> Vec<InstrumentReadout> {
        let each = self.simulation.stack().instruments().iter().zip(self.simulation.report().hands());
        each.zip(self.hands_mm())
            .map(|((one, report), hand_mm)| InstrumentReadout {
                name: one.name.clone(),
                length_mm: one.device.length_mm(),
                inserted_mm: report.inserted_mm,
                behind_mm: hand_mm - report.inserted_mm,
                rotation_deg: report.rotation_rad.to_degrees(),
                steer: one.device.is_steerable().then_some(report.steer),
                push_force_n: report.push_force_n,
                torque_nmm: report.torque_nmm,
                warns: self.beyond(&report),
            })
            .collect()
    }

    /// Contrast medium that hands have injected so far, ml.
    fn contrast_ml(&self) -> f64 {
        let by_s = self.time_s();
        self.telemetry.record().injections.iter().map(|one| one.flowed_ml(by_s)).sum::<f64>() + 0.0
    }
}
