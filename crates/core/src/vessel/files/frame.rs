//! Coordinate frames of surface files: their unit, and the directions of their axes in the patient.

use serde::{Deserialize, Serialize};

use super::Reason;
use crate::{Error, Result, Vec3};

/// Directions of x, y and z in the patient; z towards the head in both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PatientAxes {
    /// Left, posterior, superior: the axes of scenes and of DICOM.
    #[serde(rename = "LPS")]
    Lps,
    /// Right, anterior, superior, as in NIfTI: x and y have the opposite sign of LPS.
    #[serde(rename = "RAS")]
    Ras,
}

impl std::str::FromStr for PatientAxes {
    type Err = Error;

    /// Parses `LPS` or `RAS`, in either case.
    fn from_str(word: &str) -> Result<Self> {
        match word.to_ascii_uppercase().as_str() {
            "LPS" => Ok(Self::Lps),
            "RAS" => Ok(Self::Ras),
            _ => Err(Error::parameter("axes", word, "must be LPS (left, posterior, superior) or RAS")),
        }
    }
}

impl PatientAxes {
    /// `LPS` or `RAS`, as in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lps => "LPS",
            Self::Ras => "RAS",
        }
    }

    /// Transforms a point of these axes to those of scenes, LPS.
    pub(in crate::vessel) fn to_lps(self, point: Vec3) -> Vec3 {
        match self {
            Self::Lps => point,
            Self::Ras => Vec3::new(-point.x, -point.y, point.z),
        }
    }
}

/// Coordinate frame of a surface file. A bare number is a unit, with the file's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFrame {
    /// Millimetres per unit of the file: 1 for millimetres, 10 for centimetres, 1000 for metres.
    pub unit_mm: f64,
    /// Axes of the file. `None`: those given by its header (`SPACE=RAS` or `SPACE=LPS`, as 3D Slicer writes them), else LPS.
    pub axes: Option<PatientAxes>,
}

impl From<f64> for SurfaceFrame {
    fn from(unit_mm: f64) -> Self {
        Self { unit_mm, axes: None }
    }
}

impl SurfaceFrame {
    /// Rejects an implausible unit.
    pub(super) fn check(&self) -> Result<()> {
        if self.unit_mm.is_finite() && self.unit_mm > 0.0 {
            return Ok(());
        }
        Err(Error::parameter(
            "unit_mm",
            self.unit_mm,
            "must be finite and positive: millimetres per file unit (1000 for metres)",
        ))
    }
}

/// The prefix of the axes in a title or comment.
const SPACE: &str = "SPACE=";

/// The axes given in headers: the value after `SPACE=`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct ToldAxes(Option<String>);

impl ToldAxes {
    /// Searches for `SPACE=` at the beginning of a word of a title or comment; the first one counts.
    pub(super) fn look_in(&mut self, header: &str) {
        let mut words = header.split(|c: char| c.is_whitespace() || matches!(c, ';' | ',' | '\0' | '"'));
        if let Some(value) = words.find_map(|word| word.strip_prefix(SPACE)) {
            self.say(value);
        }
    }

    /// Stores a value given separately in a file.
    pub(super) fn say(&mut self, value: &str) {
        self.0.get_or_insert_with(|| value.chars().take(20).collect());
    }

    /// The axes, LPS if none were given.
    pub(super) fn axes(&self) -> std::result::Result<PatientAxes, Reason> {
        match &self.0 {
            None => Ok(PatientAxes::Lps),
            Some(value) => value.parse().map_err(|_| {
                format!(
                    "its header says {SPACE}{value}, and LPS and RAS are known: give vessel.axes (--axes)"
                )
            }),
        }
    }
}
