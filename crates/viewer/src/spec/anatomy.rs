//! `[view.patient]`, `[view.flow]`, `[[view.injection]]` and `[[view.device]]`: other objects in the beam.

use std::path::PathBuf;
use std::sync::Arc;

use endowire_core::vessel::CentrelineTree;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use super::{COORDINATE_MM, finite_within};
use crate::device::DevicePart;

/// The `[view.patient]` table: the patient. Without it the body is a slab ([`crate::XRaySpec::tissue_mm`]).
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PatientSpec {
    /// A generated body.
    pub torso: Option<TorsoSpec>,
    /// A computed tomogram.
    pub ct: Option<CtSpec>,
    /// Whether the scene's vessel moves (`[[vessel.motion]]`): it takes the body along, which has no motion of its own
    /// then.
    #[serde(skip)]
    pub vessel_moves: bool,
}

/// The `[view.patient.torso]` table: a generated body of soft tissue, bones and air, in patient axes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct TorsoSpec {
    /// Left to right, 100 to 800.
    pub width_mm: f64,
    /// Front to back, 80 to 600.
    pub depth_mm: f64,
    /// Middle of the vertebral bodies, left and posterior, -100,000 to 100,000; absent: behind the vessel's centre.
    pub spine_mm: Option<[f64; 2]>,
    /// Height of the diaphragm's domes, -100,000 to 100,000; absent: a third of the vessel's height. Chest, neck and
    /// head are above it, abdomen and pelvis below.
    pub diaphragm_mm: Option<f64>,
    /// Vertebrae, pelvis and skull.
    pub spine: bool,
    /// Ribs, sternum, clavicles and scapulae.
    pub ribs: bool,
    /// Lungs, trachea and the air of stomach and colon.
    pub lungs: bool,
    /// Electrodes of an ECG on the chest, with their leads.
    pub electrodes: bool,
    /// Width of the table that the body lies on, 200 to 1000: a plate of carbon fibre between two rails of aluminium.
    /// Absent: no table.
    pub table_mm: Option<f64>,
    /// How far the diaphragm goes down with each breath, 0 (held) to 40; absent: 12. It begins to breathe in at time
    /// zero, and subtractions hold the breath. Where the vessel moves (`[[vessel.motion]]`), it takes the body along, and
    /// only 0 may be given.
    pub breath_mm: Option<f64>,
    /// Duration of a breath, 1 to 60.
    pub breath_s: f64,
    /// How far the borders of the heart go in with each beat, 0 (it rests) to 15; absent: 4. It beats at
    /// `flow.heart_rate_per_min`. Beside a vessel that moves as `breath_mm`.
    pub beat_mm: Option<f64>,
}

/// What diaphragm and heart move if a scene does not say, mm: a quiet breath, and the border of a heart.
const BREATH_MM: f64 = 12.0;
const BEAT_MM: f64 = 4.0;

impl TorsoSpec {
    /// How far the diaphragm goes down with a breath.
    pub(crate) fn breath_mm(&self) -> f64 {
        self.breath_mm.unwrap_or(BREATH_MM)
    }

    /// How far the heart's borders go in with a beat.
    pub(crate) fn beat_mm(&self) -> f64 {
        self.beat_mm.unwrap_or(BEAT_MM)
    }
}

impl Default for TorsoSpec {
    fn default() -> Self {
        Self {
            width_mm: 330.0,
            depth_mm: 215.0,
            spine_mm: None,
            diaphragm_mm: None,
            spine: true,
            ribs: true,
            lungs: true,
            electrodes: true,
            table_mm: None,
            breath_mm: None,
            breath_s: 4.0,
            beat_mm: None,
        }
    }
}

/// The `[view.patient.ct]` table.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CtSpec {
    /// Hounsfield units, at most 268 million voxels (512 × 512 × 1024): a NIfTI-1 or NIfTI-2 volume (.nii or
    /// .nii.gz), or a folder with the slices of one CT series as DICOM files, uncompressed. Impossible values are
    /// rejected, and a volume without any part of the vessel.
    pub file: PathBuf,
    /// Position of the volume's origin in the scene's axes, each coordinate -100,000 to 100,000.
    #[serde(default)]
    pub offset_mm: [f64; 3],
}

impl PatientSpec {
    /// Whether there is a patient, and not just a slab.
    pub(crate) fn is_given(&self) -> bool {
        self.torso.is_some() || self.ct.is_some()
    }

    pub(super) fn validate(&self) -> Result<()> {
        if let Some(torso) = &self.torso {
            finite_within("view.patient.torso.width_mm", torso.width_mm, [100.0, 800.0])?;
            finite_within("view.patient.torso.depth_mm", torso.depth_mm, [80.0, 600.0])?;
            for (key, value, range) in [
                ("breath_mm", torso.breath_mm.unwrap_or(0.0), [0.0, 40.0]),
                ("breath_s", torso.breath_s, [1.0, 60.0]),
                ("beat_mm", torso.beat_mm.unwrap_or(0.0), [0.0, 15.0]),
            ] {
                finite_within(&format!("view.patient.torso.{key}"), value, range)?;
            }
            let own = [("breath_mm", torso.breath_mm), ("beat_mm", torso.beat_mm)];
            let mut moves =
                own.into_iter().filter_map(|(key, value)| Some((key, value.filter(|value| *value > 0.0)?)));
            if self.vessel_moves
                && let Some((key, value)) = moves.next()
            {
                let remedy = "the vessel moves ([[vessel.motion]]) and takes the body along: leave this out, or give the \
                              vessel this motion too";
                return Err(Error::parameter(format!("view.patient.torso.{key}"), value, remedy));
            }
            for x in torso.spine_mm.into_iter().flatten() {
                finite_within("view.patient.torso.spine_mm", x, COORDINATE_MM)?;
            }
            if let Some(width) = torso.table_mm {
                finite_within("view.patient.torso.table_mm", width, [200.0, 1000.0])?;
            }
            if let Some(z) = torso.diaphragm_mm {
                finite_within("view.patient.torso.diaphragm_mm", z, COORDINATE_MM)?;
            }
            if let Some(ct) = &self.ct {
                let remedy = "view.patient.torso is given too: keep one of the two";
                return Err(Error::parameter("view.patient.ct.file", ct.file.display(), remedy));
            }
        }
        for x in self.ct.iter().flat_map(|ct| ct.offset_mm) {
            finite_within("view.patient.ct.offset_mm", x, COORDINATE_MM)?;
        }
        Ok(())
    }
}

/// The `[view.flow]` table: the blood flow that transports contrast medium.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlowSpec {
    /// Centre-line table of the vessel (x y z radius parent, mm), of at most 50,000 points at most 2 mm apart.
    pub tree: Option<PathBuf>,
    /// A given centre line of the vessel, if `tree` names none.
    #[serde(skip)]
    pub centreline: Option<Arc<CentrelineTree>>,
    /// A point near the inlet end of the tree, each coordinate -100,000 to 100,000; absent: the widest end, or of
    /// several about as wide the one nearest to the head.
    pub inlet_mm: Option<[f64; 3]>,
    /// Blood flow there, 0.001 to 100,000.
    pub inflow_ml_per_s: f64,
    /// At a bifurcation the flow divides as radiusⁿ: 2 for large arteries, 3 (Murray's law) for small ones; 0 to 10.
    pub split_exponent: f64,
    /// Fraction of the flow in systole, 0 (steady) to 0.95.
    pub pulsatility: f64,
    /// Heart rate, 10 to 300; a heartbeat begins at time zero.
    pub heart_rate_per_min: f64,
    /// Mean residence time of contrast medium in the tissue behind an end of the tree, 0.01 to 1000: it washes out
    /// exponentially.
    pub tissue_s: f64,
    /// Radius of that tissue, 1 to 200; absent: it is not drawn. None is drawn behind an end that carries more blood
    /// than tissue of this size can take (20 ml a minute per ml): that is a large vessel which was cut, and its medium
    /// leaves the picture.
    pub tissue_mm: Option<f64>,
    /// Spreading of a bolus: its standard deviation in time is this times the square root of the transit time, s^½; 0
    /// to 10.
    pub dispersion: f64,
}

impl Default for FlowSpec {
    fn default() -> Self {
        // A resting heart pumps 5 l/min.
        Self {
            tree: None,
            centreline: None,
            inlet_mm: None,
            inflow_ml_per_s: 80.0,
            split_exponent: 2.0,
            pulsatility: 0.6,
            heart_rate_per_min: 70.0,
            tissue_s: 4.0,
            tissue_mm: None,
            dispersion: 0.12,
        }
    }
}

impl FlowSpec {
    pub(super) fn validate(&self) -> Result<()> {
        finite_within("view.flow.inflow_ml_per_s", self.inflow_ml_per_s, [0.001, 1e5])?;
        finite_within("view.flow.split_exponent", self.split_exponent, [0.0, 10.0])?;
        finite_within("view.flow.dispersion", self.dispersion, [0.0, 10.0])?;
        finite_within("view.flow.pulsatility", self.pulsatility, [0.0, 0.95])?;
        finite_within("view.flow.heart_rate_per_min", self.heart_rate_per_min, [10.0, 300.0])?;
        finite_within("view.flow.tissue_s", self.tissue_s, [0.01, 1000.0])?;
        if let Some(radius) = self.tissue_mm {
            finite_within("view.flow.tissue_mm", radius, [1.0, 200.0])?;
        }
        for x in self.inlet_mm.into_iter().flatten() {
            finite_within("view.flow.inlet_mm", x, COORDINATE_MM)?;
        }
        Ok(())
    }
}

/// One `[[view.injection]]` table: contrast medium (370 mg iodine per ml) through a catheter or the inlet.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct InjectionSpec {
    /// Start, in the time of the frames, -10,000 to 10,000.
    pub start_s: f64,
    /// Duration, 0.001 to 200.
    pub duration_s: f64,
    /// Rate, 0.001 to 10,000.
    pub rate_ml_per_s: f64,
    /// Position: the nearest point of the centre line, each coordinate -100,000 to 100,000; absent: the inlet.
    pub at_mm: Option<[f64; 3]>,
    /// Whether it comes out of the tip of the innermost instrument with a lumen, wherever that is; not with `at_mm`.
    #[serde(default)]
    pub at_tip: bool,
}

/// Longest injection, s: transport of medium is computed in steps of hundredths of a second.
const LONGEST_S: f64 = 200.0;

impl InjectionSpec {
    pub(super) fn validate(&self, index: usize) -> Result<()> {
        let key = |name: &str| format!("view.injection[{index}].{name}");
        finite_within(&key("start_s"), self.start_s, [-1e4, 1e4])?;
        finite_within(&key("duration_s"), self.duration_s, [0.001, LONGEST_S])?;
        finite_within(&key("rate_ml_per_s"), self.rate_ml_per_s, [0.001, 1e4])?;
        for x in self.at_mm.into_iter().flatten() {
            finite_within(&key("at_mm"), x, COORDINATE_MM)?;
        }
        if self.at_tip && self.at_mm.is_some() {
            return Err(Error::parameter(key("at_tip"), true, "at_mm is given too: keep one of the two"));
        }
        Ok(())
    }
}

/// Checks the `[[view.device]]` tables.
pub(super) fn validate_parts(parts: &[DevicePart]) -> Result<()> {
    parts.iter().enumerate().try_for_each(|(i, part)| part.validate(&format!("view.device[{i}]")))
}
