//! Device files: one TOML document that describes a device, in a maker's terms or by sections.
//!
//! ```toml
//! name = "0.035 inch wire"
//! kind = "guidewire"
//! length_cm = 180.0
//!
//! [[part]]                              # tip first
//! name = "J"
//! bend = { radius_mm = 3.0, angle_deg = 180.0 }
//! outer_diameter_inch = 0.035
//! bending_stiffness_nmm2 = 5.0
//! material = "steel_316l"
//!
//! [[part]]
//! name = "transition"
//! length_mm = 100.0
//! outer_diameter_inch = 0.035
//! bending_stiffness_nmm2 = [5.0, 291.0] # towards the tip, at the other end
//! sections = 20
//!
//! [[part]]
//! name = "shaft"                        # what is left of the length
//! outer_diameter_inch = 0.035
//! flexural_modulus_gpa = 9.5
//! ```

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::part::{Part, PartTable, length_ways};
use super::quantity::{Quantity, one_of};
use super::{Device, LENGTH_LIMIT_MM, Section};
use crate::file::{FileSystem, Files};
use crate::input::from_toml_of;
use crate::{Error, Result};

/// Kinds of devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Guide wire: 0.035 inch and similar.
    Guidewire,
    /// Wire for small vessels: 0.014 and 0.018 inch.
    Microwire,
    /// Catheter for small vessels.
    Microcatheter,
    /// Diagnostic catheter.
    Catheter,
    /// Catheter in which other catheters run.
    GuidingCatheter,
    /// Sheath.
    Sheath,
    /// Embolisation coil on its pusher.
    Coil,
}

impl Kind {
    /// Whether every part of it has a lumen.
    fn is_tube(self) -> bool {
        !matches!(self, Self::Guidewire | Self::Microwire | Self::Coil)
    }
}

/// The tables of a device file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileTable {
    #[serde(default)]
    pub(crate) name: String,
    pub(crate) kind: Option<Kind>,
    pub(crate) length_mm: Option<f64>,
    pub(crate) length_cm: Option<f64>,
    pub(crate) source: Option<String>,
    #[serde(default)]
    pub(crate) section: Vec<Section>,
    #[serde(default)]
    pub(crate) part: Vec<PartTable>,
}

/// A device file: parts with their names, materials and sources, and the resulting device.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceFile {
    /// Name of the device; the file's stem if absent.
    pub name: String,
    /// Its kind; optional in files of sections.
    pub kind: Option<Kind>,
    /// Source of its data.
    pub source: Option<String>,
    /// Its parts, tip first; in a file of sections each section is a part.
    pub parts: Vec<Part>,
    /// The resulting device.
    pub device: Device,
}

/// Tolerance of lengths, mm: rounding in tables.
const SAME_LENGTH_MM: f64 = 1e-3;

impl DeviceFile {
    /// Reads a device file.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read; otherwise [`Error::Content`] with file, part, key, value and
    /// correction.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_of(&FileSystem, path)
    }

    /// As [`Self::read`], for a file of `files`.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_of(files: &dyn Files, path: &Path) -> Result<Self> {
        let (table, _): (FileTable, _) = from_toml_of(files, path)?;
        let stem = || path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let named = if table.name.is_empty() { FileTable { name: stem(), ..table } } else { table };
        named.resolve().map_err(|e| Error::content(path, e.to_string()))
    }
}

impl FileTable {
    /// The first of its keys that is present, for messages; `None` if there are only sections, or nothing.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let keys = [
            ("kind", self.kind.is_some()),
            ("length_mm", self.length_mm.is_some()),
            ("length_cm", self.length_cm.is_some()),
            ("source", self.source.is_some()),
            ("part", !self.part.is_empty()),
        ];
        keys.into_iter().find(|(_, given)| *given).map(|(key, _)| key)
    }

    /// The device described by the tables.
    ///
    /// # Errors
    /// Values that are missing, out of range, given twice, or contradictory, by part and key.
    pub(crate) fn resolve(self) -> Result<DeviceFile> {
        let length = one_of("device", length_ways(self.length_mm, self.length_cm), LENGTH_LIMIT_MM)?;
        let length_mm = length.map(|length| length.ends.at(0.0));
        let (parts, device) = match (self.section.is_empty(), self.part.is_empty()) {
            (false, false) => {
                let value = format!("{} tables", self.part.len());
                return Err(Error::parameter("part", value, "section is given too: keep one of the two"));
            }
            (true, false) => self.of_parts(length_mm)?,
            (_, true) => self.of_sections()?,
        };
        let differs = |length: &Quantity| (length.ends.at(0.0) - device.length_mm()).abs() > SAME_LENGTH_MM;
        if let Some(length) = length.filter(differs) {
            let remedy = format!(
                "the parts have {} mm together: they must agree, or one part leaves its length out and is what is left",
                device.length_mm()
            );
            return Err(Error::parameter(format!("device.{}", length.key), length.given, remedy));
        }
        Ok(DeviceFile { name: self.name, kind: self.kind, source: self.source, parts, device })
    }

    fn of_sections(&self) -> Result<(Vec<Part>, Device)> {
        let device = Device::new(self.section.clone())?;
        let mut begin_mm = 0.0;
        let part = |(index, section): (usize, &Section)| {
            let part = Part::of_section(format!("section {index}"), section, begin_mm);
            begin_mm += section.length_mm;
            part
        };
        let parts = self.section.iter().enumerate().map(part).collect();
        Ok((parts, device))
    }

    fn of_parts(&self, length_mm: Option<f64>) -> Result<(Vec<Part>, Device)> {
        let Some(kind) = self.kind else {
            let remedy = "say what it is: guidewire, microwire, microcatheter, catheter, guiding_catheter, sheath or coil";
            return Err(Error::parameter("kind", "absent", remedy));
        };
        let lengths = self.lengths(length_mm)?;
        let mut parts = Vec::with_capacity(self.part.len());
        let mut begin_mm = 0.0;
        for (table, length_mm) in self.part.iter().zip(lengths) {
            parts.push(table.resolve(begin_mm, length_mm, kind.is_tube(), self.source.as_deref())?);
            begin_mm += length_mm;
        }
        let mut device = Device::new(parts.iter().flat_map(Part::sections).collect())?;
        if kind == Kind::Coil {
            // The wound part is the coil; behind it is the pusher.
            let wound = self.part.iter().zip(&parts).take_while(|(table, _)| table.is_wound());
            let coil_mm: f64 = wound.map(|(_, part)| part.from_tip_mm[1] - part.from_tip_mm[0]).sum();
            if coil_mm > 0.0 && coil_mm < device.length_mm() {
                device = device.with_coil(coil_mm)?;
            }
        }
        Ok((parts, device))
    }

    /// Lengths of the parts: one may omit its own, and gets the remaining length.
    fn lengths(&self, length_mm: Option<f64>) -> Result<Vec<f64>> {
        let given: Vec<Option<f64>> = self.part.iter().map(PartTable::length_mm).collect::<Result<_>>()?;
        let absent = |index: usize, remedy: String| {
            let name = format!("part \"{}\".length_mm", self.part[index].name);
            Err(Error::parameter(name, "absent", remedy))
        };
        let mut open = (0..given.len()).filter(|&index| given[index].is_none());
        let Some(first) = open.next() else { return Ok(given.into_iter().flatten().collect()) };
        if let Some(second) = open.next() {
            let remedy = format!("part \"{}\" leaves it out too, and only one may", self.part[first].name);
            return absent(second, remedy);
        }
        let Some(length_mm) = length_mm else {
            return absent(first, "give it, or the device's own length_mm or length_cm".into());
        };
        let others: f64 = given.iter().flatten().sum();
        let left = length_mm - others;
        if left.is_nan() || left <= 0.0 {
            return absent(
                first,
                format!("the other parts have {others} mm of the device's {length_mm} mm: nothing is left"),
            );
        }
        Ok(given.into_iter().map(|length| length.unwrap_or(left)).collect())
    }
}
