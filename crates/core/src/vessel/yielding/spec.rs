//! `[vessel.yielding]`: what a vessel and the tissue around it are made of.
//!
//! The presets are choices within what is published, not measurements of a patient: moduli of arteries at their
//! pressure from D. H. Bergel, J. Physiol. 156 (1961), for coronary arteries from B. S. Gow and C. D. Hadfield, Circ.
//! Res. 45 (1979), for cerebral ones from K. Hayashi et al., J. Biomech. 13 (1980); the support of tissue as P. Moireau
//! et al. (2012) found it around the aorta, 10⁵ to 10⁶ dyn/cm³. They differ between people by factors of two and more.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::super::CentrelineTree;
use crate::error::{in_range, number};
use crate::{Error, Result, Vec3};

/// How a vessel yields: a preset, or values, which replace those of the preset.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YieldingSpec {
    /// Where the values come from that are not given.
    pub preset: Option<YieldingPreset>,
    /// Young's modulus of the wall for bending the vessel, N/mm².
    pub wall_modulus_n_per_mm2: Option<f64>,
    /// Thickness of the wall as a part of the radius of the lumen.
    pub thickness_per_radius: Option<f64>,
    /// Bending stiffness B of the vessel, N·mm², in place of that of modulus, thickness and radius.
    pub bending_stiffness_nmm2: Option<f64>,
    /// Support of the tissue by area of the vessel, N/mm³: of a vessel of radius r it is k = 2πr times that.
    pub tissue_n_per_mm3: Option<f64>,
    /// Support k by length of the vessel, N/mm², in place of that of the tissue and the radius.
    pub support_n_per_mm2: Option<f64>,
    /// What becomes of the places where the vessel is cut.
    pub ends: Option<YieldingEnds>,
    /// Longest span of the splines, mm; by default three quarters of (4 B/k)^¼, and no less than three radii.
    pub span_mm: Option<f64>,
    /// Branches that are made of something else.
    #[serde(default)]
    pub branch: Vec<YieldingBranch>,
    /// Places that are held.
    #[serde(default)]
    pub tether: Vec<YieldingTether>,
}

/// Kinds of vessels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum YieldingPreset {
    /// The aorta.
    Aorta,
    /// Iliac and femoral arteries.
    Iliac,
    /// Carotid, subclavian and vertebral arteries.
    Carotid,
    /// Coronary arteries, on the heart.
    Coronary,
    /// Arteries of the brain.
    Cerebral,
}

/// What becomes of the places where a vessel is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum YieldingEnds {
    /// They stay where they are, and may turn.
    #[default]
    Held,
    /// They move freely.
    Free,
}

/// A branch with values of its own: from where it leaves the way to the other targets, to its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YieldingBranch {
    /// The target at its end or in it.
    pub to: String,
    /// As in the table itself.
    pub preset: Option<YieldingPreset>,
    /// As in the table itself.
    pub wall_modulus_n_per_mm2: Option<f64>,
    /// As in the table itself.
    pub thickness_per_radius: Option<f64>,
    /// As in the table itself.
    pub bending_stiffness_nmm2: Option<f64>,
    /// As in the table itself.
    pub tissue_n_per_mm3: Option<f64>,
    /// As in the table itself.
    pub support_n_per_mm2: Option<f64>,
}

/// A place where the vessel is held, by an ostium or a bone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YieldingTether {
    /// The target there.
    pub at: Option<String>,
    /// Or the place, whose nearest point of the centre line is held, mm.
    pub at_mm: Option<[f64; 3]>,
    /// Its stiffness, N/mm.
    pub stiffness_n_per_mm: f64,
}

/// What the vessel is made of at a row of its centre line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OfRow {
    pub(super) bending_nmm2: f64,
    pub(super) support_n_per_mm2: f64,
    radius_mm: f64,
}

/// Given values, some of them missing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Given {
    preset: Option<YieldingPreset>,
    modulus: Option<f64>,
    thickness: Option<f64>,
    bending: Option<f64>,
    tissue: Option<f64>,
    support: Option<f64>,
}

/// Modulus of the wall, N/mm², its thickness per radius, and the support of the tissue, N/mm³.
struct Material(f64, f64, f64);

impl YieldingPreset {
    fn material(self) -> Material {
        match self {
            Self::Aorta => Material(0.9, 0.12, 0.002),
            Self::Iliac => Material(0.9, 0.16, 0.001),
            Self::Carotid => Material(0.6, 0.16, 0.002),
            Self::Coronary => Material(1.0, 0.2, 0.02),
            Self::Cerebral => Material(1.5, 0.15, 0.005),
        }
    }
}

/// Largest values: a metre of steel is no vessel.
const LARGEST_MODULUS: f64 = 1e6;
const LARGEST_BENDING: f64 = 1e9;
const LARGEST_SUPPORT: f64 = 1e6;
/// Largest part of the radius that a wall may be thick.
const THICKEST: f64 = 2.0;
/// Longest span of the splines, mm.
const LONGEST_SPAN_MM: f64 = 1e4;
/// Spans of this part of (4 B/k)^¼ follow a beam under a single force to a hundredth.
const SPAN_OF_LENGTH: f64 = 0.75;
/// Spans are no shorter than so many radii, below which sections of the vessel are no sections of a beam.
const LEAST_SPAN_RADII: f64 = 3.0;
/// A tether holds the vessel at most so many radii from its centre line: bones lie beside it.
const FARTHEST_TETHER_RADII: f64 = 10.0;
/// Most coefficients: the matrix is dense.
const MOST: usize = 2000;

impl Given {
    /// These, and those of `others` where there are none here.
    fn or(self, others: Self) -> Self {
        // Values that come together replace each other.
        let own_wall = self.modulus.is_some() || self.thickness.is_some() || self.preset.is_some();
        let own_tissue = self.tissue.is_some() || self.preset.is_some();
        Self {
            preset: self.preset.or(others.preset),
            modulus: self.modulus.or(others.modulus.filter(|_| self.preset.is_none())),
            thickness: self.thickness.or(others.thickness.filter(|_| self.preset.is_none())),
            bending: self.bending.or(others.bending.filter(|_| !own_wall)),
            tissue: self.tissue.or(others.tissue.filter(|_| self.preset.is_none())),
            support: self.support.or(others.support.filter(|_| !own_tissue)),
        }
    }

    fn check(&self, table: &str) -> Result<()> {
        let checks = [
            ("wall_modulus_n_per_mm2", self.modulus, LARGEST_MODULUS),
            ("thickness_per_radius", self.thickness, THICKEST),
            ("bending_stiffness_nmm2", self.bending, LARGEST_BENDING),
            ("tissue_n_per_mm3", self.tissue, LARGEST_SUPPORT),
            ("support_n_per_mm2", self.support, LARGEST_SUPPORT),
        ];
        for (key, value, most) in checks {
            if let Some(value) = value {
                in_range(&format!("{table}.{key}"), value, most)?;
            }
        }
        let twice = |one: &str, other: &str| {
            let remedy = format!("{other} is given too, and says the same otherwise: keep one of the two");
            Err(Error::parameter(format!("{table}.{one}"), "given", remedy))
        };
        if self.bending.is_some() && (self.modulus.is_some() || self.thickness.is_some()) {
            return twice("bending_stiffness_nmm2", "the modulus or thickness of the wall");
        }
        if self.support.is_some() && self.tissue.is_some() {
            return twice("support_n_per_mm2", "tissue_n_per_mm3");
        }
        Ok(())
    }

    /// The properties at this radius.
    fn at(&self, radius_mm: f64, table: &str) -> Result<OfRow> {
        let material = self.preset.map(YieldingPreset::material);
        let missing = |key: &str| {
            let remedy = "give it, or a preset: aorta, iliac, carotid, coronary or cerebral";
            Error::parameter(format!("{table}.{key}"), "missing", remedy)
        };
        let bending_nmm2 = match self.bending {
            Some(bending) => bending,
            None => {
                let modulus = self.modulus.or(material.as_ref().map(|own| own.0));
                let thickness = self.thickness.or(material.as_ref().map(|own| own.1));
                let modulus = modulus.ok_or_else(|| missing("wall_modulus_n_per_mm2"))?;
                let outer = radius_mm * (1.0 + thickness.ok_or_else(|| missing("thickness_per_radius"))?);
                modulus * PI / 4.0 * (outer.powi(4) - radius_mm.powi(4))
            }
        };
        let support_n_per_mm2 = match self.support {
            Some(support) => support,
            None => {
                let tissue = self.tissue.or(material.as_ref().map(|own| own.2));
                TAU * radius_mm * tissue.ok_or_else(|| missing("support_n_per_mm2"))?
            }
        };
        Ok(OfRow { bending_nmm2, support_n_per_mm2, radius_mm })
    }
}

impl YieldingBranch {
    fn given(&self) -> Given {
        Given {
            preset: self.preset,
            modulus: self.wall_modulus_n_per_mm2,
            thickness: self.thickness_per_radius,
            bending: self.bending_stiffness_nmm2,
            tissue: self.tissue_n_per_mm3,
            support: self.support_n_per_mm2,
        }
    }
}

impl YieldingSpec {
    fn given(&self) -> Given {
        Given {
            preset: self.preset,
            modulus: self.wall_modulus_n_per_mm2,
            thickness: self.thickness_per_radius,
            bending: self.bending_stiffness_nmm2,
            tissue: self.tissue_n_per_mm3,
            support: self.support_n_per_mm2,
        }
    }

    pub(super) fn ends(&self) -> YieldingEnds {
        self.ends.unwrap_or_default()
    }

    /// What the vessel is made of at each row of its centre line.
    pub(super) fn of_rows(&self, tree: &CentrelineTree) -> Result<Vec<OfRow>> {
        let table = "vessel.yielding";
        let given = self.given();
        given.check(table)?;
        if let Some(span_mm) = self.span_mm {
            in_range(&format!("{table}.span_mm"), span_mm, LONGEST_SPAN_MM)?;
        }
        let mut of = vec![(given, table.to_owned()); tree.nodes().len()];
        for (index, branch) in self.branch.iter().enumerate() {
            let table = format!("{table}.branch[{index}]");
            let own = branch.given();
            own.check(&table)?;
            if own == Given::default() {
                let remedy = "has no values: give a preset, or what differs from the rest of the vessel";
                return Err(Error::parameter(format!("{table}.to"), &branch.to, remedy));
            }
            if let Some(other) = self.branch[..index].iter().position(|other| other.to == branch.to) {
                let remedy = format!("is that of branch[{other}] too: give each branch once");
                return Err(Error::parameter(format!("{table}.to"), &branch.to, remedy));
            }
            let row = tree.target(&branch.to).map_err(|error| renamed(error, &format!("{table}.to")))?.row;
            for row in branch_of(tree, row) {
                of[row] = (own.or(given), table.clone());
            }
        }
        tree.nodes().iter().zip(of).map(|(node, (given, table))| given.at(node.radius_mm, &table)).collect()
    }

    /// Length of the spans of a run with these rows, mm.
    pub(super) fn span_mm<'a>(&self, rows: impl Iterator<Item = &'a OfRow>) -> f64 {
        let of_row = |row: &OfRow| {
            let length_mm = (4.0 * row.bending_nmm2 / row.support_n_per_mm2).sqrt().sqrt();
            (SPAN_OF_LENGTH * length_mm).max(LEAST_SPAN_RADII * row.radius_mm)
        };
        self.span_mm.unwrap_or_else(|| rows.map(of_row).fold(f64::INFINITY, f64::min))
    }

    pub(super) fn check_size(&self, count: usize) -> Result<()> {
        if count <= MOST {
            return Ok(());
        }
        let remedy = format!(
            "makes {count} unknowns of the vessel, and at most {MOST} are solved for: give longer ones"
        );
        Err(Error::parameter(
            "vessel.yielding.span_mm",
            self.span_mm.map_or("default".into(), number),
            remedy,
        ))
    }

    /// Rows that are held, with the stiffness of the tether, N/mm.
    pub(super) fn tethers_of(&self, tree: &CentrelineTree) -> Result<Vec<(usize, f64)>> {
        let each = self.tether.iter().enumerate().map(|(index, tether)| {
            let table = format!("vessel.yielding.tether[{index}]");
            in_range(&format!("{table}.stiffness_n_per_mm"), tether.stiffness_n_per_mm, LARGEST_SUPPORT)?;
            let row = match (&tether.at, &tether.at_mm) {
                (Some(name), None) => {
                    tree.target(name).map_err(|error| renamed(error, &format!("{table}.at")))?.row
                }
                (None, Some(place)) if place.iter().all(|part| part.is_finite()) => {
                    let (row, on_line) = tree.nearest(&Vec3::from(*place));
                    let away_mm = (on_line - Vec3::from(*place)).norm();
                    let most_mm = FARTHEST_TETHER_RADII * tree.nodes()[row].radius_mm;
                    if away_mm > most_mm {
                        let remedy = format!(
                            "the centre line is {away_mm:.1} mm away, and a tether holds at most {most_mm:.1} mm from it there: give a place on the vessel"
                        );
                        return Err(Error::parameter(format!("{table}.at_mm"), format!("{place:?}"), remedy));
                    }
                    row
                }
                (None, Some(place)) => {
                    let name = format!("{table}.at_mm");
                    return Err(Error::parameter(name, format!("{place:?}"), "must be finite"));
                }
                (None, None) => {
                    let remedy = "give at, a target, or at_mm, a place";
                    return Err(Error::parameter(format!("{table}.at"), "missing", remedy));
                }
                (Some(name), Some(_)) => {
                    let remedy = "at_mm is given too: keep one of the two";
                    return Err(Error::parameter(format!("{table}.at"), name, remedy));
                }
            };
            Ok((row, tether.stiffness_n_per_mm))
        });
        each.collect()
    }
}

/// Rows of the branch in which a row lies: back to the junction before it, and all behind it.
fn branch_of(tree: &CentrelineTree, row: usize) -> Vec<usize> {
    let (nodes, children) = (tree.nodes(), tree.children());
    let mut first = row;
    while let Some(parent) = nodes[first].parent
        && children[parent].len() == 1
    {
        first = parent;
    }
    let mut rows = vec![first];
    let mut next = 0;
    while next < rows.len() {
        rows.extend_from_slice(&children[rows[next]]);
        next += 1;
    }
    rows
}

/// An error of a target, with the key that names it.
fn renamed(error: Error, key: &str) -> Error {
    match error {
        Error::Parameter { value, remedy, .. } => Error::parameter(key, value, remedy),
        other => other,
    }
}
