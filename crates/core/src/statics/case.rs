//! The schema of CASE.toml.

use super::{StaticProblem, StaticSolution};
use crate::solve::NewtonOptions;
use crate::{Error, Result, input};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A static problem of one rod, as written in CASE.toml. Units are the caller's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaticCase {
    /// The rod.
    pub rod: Rod,
    /// Support of its start.
    pub start: Start,
    /// Support of its end; free if absent.
    #[serde(default)]
    pub end: End,
    /// Loads, any number.
    #[serde(default)]
    pub load: Vec<Load>,
    /// The rod's surface, for contact between its loops; if absent, they pass through each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub self_contact: Option<Surface>,
    /// The initial shape of the solution; if absent, the unloaded shape, or one that meets the end conditions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<Initial>,
    /// Options of the solver.
    #[serde(default)]
    pub solver: Solver,
}

/// The rod.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rod {
    /// Length; absent if there are instruments, which have their own.
    #[serde(default)]
    pub length: f64,
    /// Number of elements, 1 to 200,000. Sections, instruments and point loads begin and end at nodes; if these need
    /// more elements, there is one for each piece between them.
    pub elements: usize,
    /// Sections in order from the start; none if there are instruments.
    #[serde(default)]
    pub section: Vec<Section>,
    /// Coaxial instruments that share one centre line, in any order; none for a single rod.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub instrument: Vec<Instrument>,
}

/// One of several coaxial instruments: inextensible, it slides and turns in the others without friction, and comes
/// out of a straight sheath whose mouth is the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    /// Its name in results.
    pub name: String,
    /// Length beyond the start.
    pub inserted: f64,
    /// Angle in radians by which the hand has turned its d₁ about the tangent, against the start's.
    #[serde(default)]
    pub hand: f64,
    /// Play to either side in the next instrument of the list, which then goes from the innermost outwards; 0 for none.
    /// See `rod/play.rs`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub clearance: f64,
    /// Sections in order from its tip, with `until` measured from the tip; the last one ends no nearer than
    /// `inserted`.
    pub section: Vec<Section>,
}

/// Whether there is none.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
pub(super) fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// A section of the rod, or of an instrument. Values with an `_end` vary linearly from the start to the end of the
/// section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Arc length at which it ends; the last one ends at the rod's length.
    pub until: f64,
    /// Bending stiffness.
    #[serde(rename = "EI")]
    pub ei: f64,
    /// Bending stiffness at the section's end, if it tapers.
    #[serde(rename = "EI_end", default, skip_serializing_if = "Option::is_none")]
    pub ei_end: Option<f64>,
    /// Torsional stiffness; may be absent if nothing twists.
    #[serde(rename = "GJ", default, skip_serializing_if = "Option::is_none")]
    pub gj: Option<f64>,
    /// Torsional stiffness at the section's end.
    #[serde(rename = "GJ_end", default, skip_serializing_if = "Option::is_none")]
    pub gj_end: Option<f64>,
    /// Axial stiffness; absent = inextensible.
    #[serde(rename = "EA", default, skip_serializing_if = "Option::is_none")]
    pub ea: Option<f64>,
    /// Axial stiffness at the section's end.
    #[serde(rename = "EA_end", default, skip_serializing_if = "Option::is_none")]
    pub ea_end: Option<f64>,
    /// Rest state t′ = k₁ d₁ + k₂ d₂, d₁ the normal, d₂ = t × d₁.
    #[serde(default)]
    pub rest_curvature: [f64; 2],
    /// Rest curvature at the section's end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest_curvature_end: Option<[f64; 2]>,
    /// Twist per length of the rest state (a rod that was manufactured twisted).
    #[serde(default)]
    pub rest_twist: f64,
}

/// Kinds of start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StartKind {
    /// Position, tangent and rotation about it are held.
    Clamped,
    /// The position is held; a ball joint.
    Pinned,
}

/// The start of the rod.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Start {
    /// Kind.
    #[serde(rename = "type")]
    pub kind: StartKind,
    /// Position.
    #[serde(default)]
    pub position: [f64; 3],
    /// Tangent (any length); along x if absent. For a pinned start: that of the initial shape.
    #[serde(default = "x_axis")]
    pub tangent: [f64; 3],
    /// Direction d₁, made orthogonal to the tangent; if absent, the axis farthest from the tangent, y for a tangent
    /// along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
}

fn x_axis() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

/// Kinds of end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EndKind {
    /// Nothing is held.
    #[default]
    Free,
    /// Tangent and rotation are held, and the position if given.
    Clamped,
    /// The position is held; a ball joint.
    Pinned,
    /// Tangent and rotation are held, the position is free in all directions: a block that translates without
    /// rotating.
    Guided,
}

/// The end of the rod.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct End {
    /// Kind.
    #[serde(rename = "type", default)]
    pub kind: EndKind,
    /// Position (pinned: needed; clamped: absent = free to move).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Direction along which the held position may slide.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slide: Option<[f64; 3]>,
    /// Tangent (clamped, guided); that of the start if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tangent: Option<[f64; 3]>,
    /// Direction d₁ (clamped, guided); that of the start if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Further rotation about the tangent in radians, any number of turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turns: Option<f64>,
}

/// Kinds of load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LoadKind {
    /// A dead force at a point.
    Force,
    /// A dead moment at a point: its vector keeps its direction in space.
    Moment,
    /// A dead force per length over the rod, or from `from` to `to`.
    Distributed,
    /// A force at a point that turns with the rod; `value` is along (t, d₁, d₂) there.
    Follower,
}

/// A load.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Kind.
    pub kind: LoadKind,
    /// Arc length of the point; the end of the rod if absent. Not for distributed loads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// Start of a distributed load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// End of a distributed load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Force, moment or force per length.
    pub value: [f64; 3],
}

/// An initial shape of the solution: constant curvature, or a curve.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Curvature along the start's d₁ and d₂; zero = straight.
    #[serde(default)]
    pub curvature: [f64; 2],
    /// Points of a curve that begins at the start: the rod takes the directions of the curve at equal fractions of
    /// length.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 3]>,
}

/// The surface of a rod that touches itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// Radius of the rod.
    pub radius: f64,
    /// Penalty stiffness, force per length and depth; if absent, 10 EI/radius⁴, which is rigid compared with the rod.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub modulus: Option<f64>,
}

/// Options of the solver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Largest number of Newton iterations per load step, 1 to 100,000.
    pub max_iterations: usize,
    /// Number of equal load steps, 1 to a million; at most ten million load steps times elements.
    pub load_steps: usize,
    /// Largest unbalanced force or moment at a node, relative to the largest in the rod; 1e-14 to 1e-2.
    pub tolerance: f64,
}

impl Default for Solver {
    fn default() -> Self {
        let NewtonOptions { max_iterations, tolerance, .. } = NewtonOptions::default();
        Self { max_iterations, load_steps: 1, tolerance }
    }
}

impl Rod {
    /// Length of the centre line.
    pub(crate) fn line_length(&self) -> f64 {
        self.instrument.iter().map(|i| i.inserted).fold(self.length, f64::max)
    }
}

impl StaticCase {
    /// Reads a case from TOML text and checks it; `name` is its name in errors.
    ///
    /// # Errors
    /// Names file, line and key of a value of the wrong form, or key and value of an impossible one.
    pub fn from_toml(text: &str, name: &Path) -> Result<Self> {
        input::parse_toml::<Self>(text, name)?.checked(name)
    }

    /// Reads a case from a file and checks it.
    ///
    /// # Errors
    /// As [`Self::from_toml`], and if the file cannot be read.
    pub fn from_file(path: &Path) -> Result<Self> {
        let (case, _) = input::from_toml::<Self>(path)?;
        case.checked(path)
    }

    fn checked(self, name: &Path) -> Result<Self> {
        self.check().map_err(|e| Error::content(name, e.to_string()))?;
        Ok(self)
    }

    /// Solves the case. An invalid case is an error; a solution that does not converge is returned with `converged =
    /// false` and the reason.
    ///
    /// # Errors
    /// Values that contradict each other, or a rod that twists without a torsional stiffness.
    pub fn solve(&self) -> Result<StaticSolution> {
        StaticProblem::new(self)?.solve()
    }
}
