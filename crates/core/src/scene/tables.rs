//! The tables of a scene file for vessel, devices and sheath.

use std::path::PathBuf;

use serde::Deserialize;

use super::sac::SacSpec;
use crate::device::{FileTable, Kind, PartTable, Section};
use crate::flow::VesselFlow;
use crate::insertion::{Sheath, WallProperties};
use crate::vessel::{
    CentrelineTree, MotionMode, Opening, PatientAxes, RepairMode, RepairOptions, Resolution, SurfaceFrame,
    YieldingSpec,
};
use crate::{Error, Result, Vec3};

/// `[vessel]`: a surface file, or a centre-line tree from which the surface is built.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VesselSpec {
    /// Surface mesh (STL, OBJ, PLY, VTP or VTK).
    pub file: Option<PathBuf>,
    /// Millimetres per unit of the surface file; 1 if absent.
    pub unit_mm: Option<f64>,
    /// Axes of the surface file, overriding those of its header.
    pub axes: Option<PatientAxes>,
    /// What of the surface file is repaired; all if absent.
    pub repair: Option<RepairMode>,
    /// Places of holes in it that are meant and stay open, such as fenestrations, mm.
    #[serde(default)]
    pub keep_open_mm: Vec<[f64; 3]>,
    /// Centre-line table (x y z radius parent, mm) from which the wall is built; rows may name targets.
    pub tree: Option<PathBuf>,
    /// Centre-line table for `file`, used instead of a computed one.
    pub centreline: Option<PathBuf>,
    /// Edge length of the wall built from the tree, mm.
    pub edge_mm: Option<f64>,
    /// Number of triangles of the wall built from the tree, instead of `edge_mm`.
    pub triangles: Option<usize>,
    /// Stiffness and friction of the wall.
    #[serde(default)]
    pub wall: WallProperties,
    /// Motion of the vessel: a sum of modes.
    #[serde(default)]
    pub motion: Vec<MotionMode>,
    /// How it yields as a whole, along its centre line; only its wall does if absent.
    pub yielding: Option<YieldingSpec>,
    /// Flow through its centre line, with drag on devices; none if absent.
    pub flow: Option<VesselFlow>,
    /// The sac to be filled by coils; none if absent.
    pub sac: Option<SacSpec>,
}

impl VesselSpec {
    /// The coordinate frame of `file`.
    pub(super) fn frame(&self) -> SurfaceFrame {
        SurfaceFrame { unit_mm: self.unit_mm.unwrap_or(1.0), axes: self.axes }
    }

    /// The repair of `file`.
    pub(super) fn repair_options(&self) -> RepairOptions {
        RepairOptions {
            mode: self.repair.unwrap_or_default(),
            keep_open_mm: self.keep_open_mm.iter().map(|place| Vec3::from(*place)).collect(),
        }
    }

    /// Resolution of the wall built from `tree`.
    pub(super) fn resolution(&self, tree: &CentrelineTree) -> Result<Resolution> {
        match (self.edge_mm, self.triangles) {
            (Some(edge_mm), None) => Ok(Resolution::EdgeMm(edge_mm)),
            (None, Some(triangles)) => Ok(Resolution::Triangles(triangles)),
            (None, None) => Ok(Resolution::fitting(tree)),
            (Some(edge_mm), Some(_)) => Err(Error::parameter(
                "vessel.edge_mm",
                edge_mm,
                "vessel.triangles is given too: keep one of the two",
            )),
        }
    }
}

/// `[device]`: sections or parts, or a file with them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceSpec {
    /// A [`DeviceFile`](crate::device::DeviceFile).
    pub file: Option<PathBuf>,
    /// Sections, tip first.
    #[serde(default)]
    pub section: Vec<Section>,
    /// Its kind, if it is given by parts: as in a device file.
    kind: Option<Kind>,
    length_mm: Option<f64>,
    length_cm: Option<f64>,
    source: Option<String>,
    #[serde(default)]
    part: Vec<PartTable>,
}

impl DeviceSpec {
    /// The contents as those of a file.
    pub(super) fn tables(&self) -> FileTable {
        FileTable {
            name: String::new(),
            kind: self.kind,
            length_mm: self.length_mm,
            length_cm: self.length_cm,
            source: self.source.clone(),
            section: self.section.clone(),
            part: self.part.clone(),
        }
    }
}

/// `[[instrument]]`: one of several coaxial instruments, with sections or parts, or a file with them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstrumentSpec {
    /// Its name in script and recording.
    pub name: String,
    /// A [`DeviceFile`](crate::device::DeviceFile).
    pub file: Option<PathBuf>,
    /// Sections, tip first.
    #[serde(default)]
    pub section: Vec<Section>,
    /// Its kind, if it is given by parts: as in a device file.
    kind: Option<Kind>,
    length_mm: Option<f64>,
    length_cm: Option<f64>,
    source: Option<String>,
    #[serde(default)]
    part: Vec<PartTable>,
    /// Initial inserted length, mm.
    #[serde(default)]
    pub inserted_mm: f64,
    /// Whether its tip may be farther in than that of the instrument inside it, for all but the first; it may if
    /// absent.
    pub may_lead: Option<bool>,
    /// Coulomb coefficient of friction between it and the instruments outside it, along the line and around it; 0
    /// disables it.
    #[serde(default)]
    pub friction: f64,
    /// Whether it has the play in the instruments outside it that the radii leave, and tilts where one of the two ends.
    #[serde(default)]
    pub clearance: bool,
    /// Friction of the valve on its hub, which seals what is inside, N; 0 disables it.
    #[serde(default)]
    pub valve_n: f64,
}

impl InstrumentSpec {
    /// The contents as those of a file.
    pub(super) fn tables(&self) -> FileTable {
        FileTable {
            name: self.name.clone(),
            kind: self.kind,
            length_mm: self.length_mm,
            length_cm: self.length_cm,
            source: self.source.clone(),
            section: self.section.clone(),
            part: self.part.clone(),
        }
    }
}

/// `[sheath]`: an opening of the vessel, or a point and a direction.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheathSpec {
    /// Index of an opening; the device enters at its middle, against its outward direction.
    pub opening: Option<usize>,
    /// Depth of the mouth inside the opening, mm; 1 if absent.
    pub depth_mm: Option<f64>,
    /// Mouth of the sheath, mm.
    pub position_mm: Option<[f64; 3]>,
    /// Direction of insertion, any length.
    pub direction: Option<[f64; 3]>,
    /// Direction towards which a positive first rest curvature bends a device at rotation zero, any length; that of the
    /// coordinate axis least aligned with the direction of insertion if absent.
    pub bends_towards: Option<[f64; 3]>,
    /// Friction of the valve, N; 0 disables it.
    #[serde(default)]
    pub friction_n: f64,
    /// Coulomb coefficient in the mouth; 0 disables it.
    #[serde(default)]
    pub friction: f64,
}

/// Default depth of the sheath's mouth inside an opening, mm: clear of the rim.
pub(super) const DEPTH_MM: f64 = 1.0;

impl SheathSpec {
    /// The keys present, for messages.
    fn given(&self) -> String {
        let keys = [
            ("opening", self.opening.is_some()),
            ("depth_mm", self.depth_mm.is_some()),
            ("position_mm", self.position_mm.is_some()),
            ("direction", self.direction.is_some()),
        ];
        let given: Vec<&str> = keys.iter().filter(|(_, given)| *given).map(|(key, _)| *key).collect();
        format!("{{{}}}", given.join(", "))
    }

    /// The sheath in a vessel.
    ///
    /// # Errors
    /// A nonexistent opening, contradictory keys, values that are not finite or out of range.
    pub fn place(&self, vessel: &impl AsRef<[Opening]>) -> Result<Sheath> {
        let sheath = match (self.opening, self.position_mm, self.direction) {
            (Some(opening), None, None) => {
                Sheath::at_opening(vessel, opening, self.depth_mm.unwrap_or(DEPTH_MM))
            }
            (None, Some(position), Some(direction)) if self.depth_mm.is_none() => {
                Sheath::new(Vec3::from(position), Vec3::from(direction))
            }
            _ => Err(Error::parameter(
                "sheath",
                self.given(),
                "give either opening (with depth_mm if wanted) or position_mm and direction",
            )),
        }?;
        let sheath = sheath.with_friction(self.friction_n, self.friction)?;
        self.bends_towards.map_or(Ok(sheath), |towards| sheath.bending_towards(Vec3::from(towards)))
    }
}
