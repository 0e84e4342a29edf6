//! What was found in a label map, and what was done to make a vessel of it.

use super::cut::Plane;
use super::ends::{EndKind, Tip};
use super::map::LabelMap;
use crate::Vec3;

/// Fraction of voxels without neighbours on two sides above which it is said that a vessel is thin.
const THIN: f64 = 0.05;

/// What was found in a label map, and what was done.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LabelReport {
    /// The labels with the number of their voxels.
    pub labels: Vec<(u16, usize)>,
    /// Sides of a voxel, mm.
    pub voxel_mm: [f64; 3],
    /// Number of connected parts: voxels that share a face or an edge are connected.
    pub parts: usize,
    /// Voxels of the parts that were kept.
    pub kept_voxels: usize,
    /// Voxels of the other parts.
    pub left_out_voxels: usize,
    /// Voxels that the label encloses without being labelled; they were filled.
    pub filled_voxels: usize,
    /// Voxels filled so that every edge of the surface has two faces.
    pub joined_voxels: usize,
    /// Number of rings: ways round that do not close up, as in a circle of Willis, or where vessels touch.
    pub rings: usize,
    /// Fraction of the kept voxels where the label is a single voxel thick.
    pub thin_part: f64,
    /// Volume of the closed surface over that of the voxels, less 1.
    pub volume_error: f64,
    /// The ends that were found.
    pub ends: Vec<LabelEnd>,
    /// Places where the label touches the picture's border without a vessel that ends there.
    pub border_touches: usize,
}

/// An end of a vessel.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LabelEnd {
    /// How it ends.
    pub kind: EndKind,
    /// Where it was opened; where it was left closed, the middle of the vessel near it.
    pub centre_mm: [f64; 3],
    /// Out of the vessel, across the plane; `None` if it was left closed.
    pub direction: Option<[f64; 3]>,
    /// Radius of the largest sphere near it, in voxels, mm.
    pub radius_mm: f64,
    /// Why it was left closed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_because: Option<String>,
}

impl LabelEnd {
    pub(super) fn new(tip: &Tip, plane: Result<Plane, String>, middle_mm: Vec3) -> Self {
        let (centre_mm, direction, closed_because) = match plane {
            Ok(plane) => (plane.centre_mm, Some(plane.outward.into()), None),
            Err(why) => (middle_mm, None, Some(why)),
        };
        Self {
            kind: tip.kind,
            centre_mm: centre_mm.into(),
            direction,
            radius_mm: tip.radius_mm,
            closed_because,
        }
    }

    pub(super) fn move_by(&mut self, shift: &Vec3) {
        self.centre_mm = (Vec3::from(self.centre_mm) + shift).into();
    }
}

impl LabelReport {
    pub(super) fn new(map: &LabelMap, labels: Vec<(u16, usize)>) -> Self {
        Self {
            labels,
            voxel_mm: std::array::from_fn(|k| map.axes_mm().column(k).norm()),
            parts: 0,
            kept_voxels: 0,
            left_out_voxels: 0,
            filled_voxels: 0,
            joined_voxels: 0,
            rings: 0,
            thin_part: 0.0,
            volume_error: 0.0,
            ends: Vec::new(),
            border_touches: 0,
        }
    }

    /// What a user may want to know or change, a sentence each.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.left_out_voxels > 0 {
            notes.push(format!(
                "the label has {} parts that do not touch; {} voxels of the smaller ones are left out",
                self.parts, self.left_out_voxels
            ));
        }
        if self.filled_voxels > 0 {
            notes.push(format!("{} voxels that the label encloses are filled", self.filled_voxels));
        }
        if self.joined_voxels > 0 {
            notes.push(format!(
                "{} voxels are added where the label touches itself by an edge",
                self.joined_voxels
            ));
        }
        if self.rings > 0 {
            notes.push(format!(
                "the label has {}: vessels that touch in the picture, or a real circle",
                if self.rings == 1 { "a ring".to_owned() } else { format!("{} rings", self.rings) }
            ));
        }
        if self.thin_part > THIN {
            notes.push(format!(
                "{:.0} % of its voxels are where the label is a single voxel thick: radii there are those of a voxel, and a finer picture \
                 is needed",
                100.0 * self.thin_part
            ));
        }
        for end in self.ends.iter() {
            if let Some(why) = &end.closed_because {
                let [x, y, z] = end.centre_mm;
                notes.push(format!("the end at [{x:.1}, {y:.1}, {z:.1}] is left closed: {why}"));
            }
        }
        if self.ends.is_empty() {
            notes.push("no end of a vessel is opened: the surface is closed".to_owned());
        }
        if self.border_touches > 0 {
            notes.push(format!(
                "the label touches the picture's border at {} more {}, where no vessel ends",
                self.border_touches,
                if self.border_touches == 1 { "place" } else { "places" }
            ));
        }
        notes
    }
}
