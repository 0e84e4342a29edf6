//! What is pushed: a wire or catheter of sections, from the tip backwards.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// One length of a device with constant properties.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Length, mm.
    pub length_mm: f64,
    /// Outer radius, mm.
    pub radius_mm: f64,
    /// Bending stiffness EI, N·mm².
    pub bending_stiffness_nmm2: f64,
}

/// A device: its sections, **tip first**, because the tip is what enters first.
///
/// Points of a device are named by their arc length from the tip, which does not change as it is pushed.
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    sections: Vec<Section>,
    length_mm: f64,
}

/// Longest device accepted, mm. Ten metres: three times the longest exchange wire made; more is a unit mistake.
const LENGTH_LIMIT_MM: f64 = 10_000.0;
/// Thickest device accepted, mm. A 30 F sheath has radius 5 mm; more than 50 mm is a unit mistake.
const RADIUS_LIMIT_MM: f64 = 50.0;
/// Stiffest device accepted, N·mm²: a solid steel rod of 12 mm diameter.
const STIFFNESS_LIMIT_NMM2: f64 = 2e8;

impl Device {
    /// A device from its sections, tip first.
    ///
    /// # Errors
    /// Names the first section value that is not finite, not positive, or absurd.
    pub fn new(sections: Vec<Section>) -> Result<Self> {
        if sections.is_empty() {
            return Err(Error::parameter("device.section", "[]", "give at least one section, tip first"));
        }
        for (index, section) in sections.iter().enumerate() {
            for (field, value, limit) in [
                ("length_mm", section.length_mm, LENGTH_LIMIT_MM),
                ("radius_mm", section.radius_mm, RADIUS_LIMIT_MM),
                ("bending_stiffness_nmm2", section.bending_stiffness_nmm2, STIFFNESS_LIMIT_NMM2),
            ] {
                crate::error::in_range(&format!("device.section[{index}].{field}"), value, limit)?;
            }
        }
        let length_mm = sections.iter().map(|s| s.length_mm).sum();
        crate::error::in_range("device length (sum of section lengths) in mm", length_mm, LENGTH_LIMIT_MM)?;
        Ok(Self { sections, length_mm })
    }

    /// A device that is the same everywhere.
    ///
    /// # Errors
    /// As [`Device::new`].
    pub fn uniform(length_mm: f64, radius_mm: f64, bending_stiffness_nmm2: f64) -> Result<Self> {
        Self::new(vec![Section { length_mm, radius_mm, bending_stiffness_nmm2 }])
    }

    /// Whole length, mm.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// The sections, tip first.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The section at an arc length from the tip; beyond either end, the section at that end.
    pub fn section_at(&self, from_tip_mm: f64) -> &Section {
        let mut end = 0.0;
        for section in &self.sections {
            end += section.length_mm;
            if from_tip_mm < end {
                return section;
            }
        }
        // `new` refuses devices without sections.
        &self.sections[self.sections.len() - 1]
    }

    /// Largest outer radius, mm.
    pub fn max_radius_mm(&self) -> f64 {
        self.sections.iter().map(|s| s.radius_mm).fold(0.0, f64::max)
    }
}
