//! The vessel that devices are pushed into.

pub mod anatomy;
mod boxes;
mod centreline;
mod check;
mod conditioning;
mod crossings;
mod extract;
mod far;
mod files;
mod generate;
mod graph;
mod hints;
mod in_front;
mod inside;
mod intersect;
mod labels;
mod line_files;
mod links;
mod lumen;
#[cfg(feature = "markups")]
mod markups;
mod mesh;
pub mod motion;
mod opening;
mod orient;
mod path;
mod pieces;
mod point_lists;
mod query;
mod recipe;
mod repair;
mod repairs;
mod sac;
mod sliver;
mod survey;
mod swc;
mod swept;
#[cfg(test)]
mod tests;
mod topology;
mod trimming;
mod wall;
mod weld;
pub(crate) mod yielding;

pub use centreline::{CentrelineNode, CentrelineTree, Target};
#[cfg(test)]
use check::check_with;
pub use check::{CheckReport, OpeningReport, check, check_repaired};
pub(crate) use conditioning::LARGEST_DEVIATION_MM;
pub use conditioning::{Conditioned, Conditioning, condition};
pub use extract::{CentrelineBranch, CentrelineEnd, ExtractedCentreline};
pub use files::{PatientAxes, SurfaceFrame};
pub(crate) use generate::any_perpendicular;
pub use generate::{GeneratedWall, Resolution};
pub use hints::wall_hints;
pub use labels::{EndKind, Ends, LabelEnd, LabelMap, LabelOptions, LabelReport, LabelSurface, Parts};
pub use links::CentrelineLink;
pub use lumen::{Lumen, Meshed};
pub use mesh::SurfaceMesh;
pub(crate) use mesh::inward_vertex_normals;
pub use motion::{Displacement, MotionMode, VesselMotion, Waveform};
pub use opening::Opening;
pub use path::{CentrelinePath, OnPath};
pub use pieces::PieceReport;
pub(crate) use pieces::Pieces;
pub use query::{Nearest, WallQuery};
pub use recipe::{CentrelineRecipe, NoStore, WallRecipe, WallStore};
pub use repairs::{Repair, RepairKind, RepairMode, RepairOptions};
pub use sac::Sac;
pub use survey::{LumenReport, SeptaReport, StartReport, Survey, survey};
pub use swept::SweptVessel;
pub(crate) use swept::{ClosestFrom, InTube, SweptField, Tube};
pub(crate) use wall::NO_NEIGHBOUR;
pub use wall::{RepairReport, Wall};
pub use yielding::{
    BeforeAfter, Course, Landmark, Straightening, Stretch, YieldingBranch, YieldingEnds, YieldingPreset,
    YieldingSpec, YieldingTether,
};
