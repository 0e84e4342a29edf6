//! What a device is pushed into.

pub mod anatomy;
mod centreline;
mod check;
mod conditioning;
mod crossings;
mod extract;
mod files;
mod generate;
mod hints;
mod inside;
mod intersect;
mod mesh;
pub mod motion;
mod opening;
mod orient;
mod path;
mod point_lists;
mod query;
mod recipe;
mod repair;
mod sac;
mod sliver;
mod survey;
#[cfg(test)]
mod tests;
mod topology;
mod trimming;
mod wall;
mod weld;

pub use centreline::{CentrelineNode, CentrelineTree, Target};
pub use check::{CheckReport, OpeningReport, check, check_with};
pub use conditioning::{Conditioned, Conditioning, condition};
pub use extract::{CentrelineBranch, CentrelineEnd, ExtractedCentreline};
pub use files::{PatientAxes, SurfaceFrame};
pub use generate::{GeneratedWall, Resolution};
pub use hints::wall_hints;
pub use mesh::SurfaceMesh;
pub(crate) use mesh::inward_vertex_normals;
pub use motion::{Displacement, MotionMode, VesselMotion};
pub use opening::Opening;
pub use path::{CentrelinePath, OnPath};
pub use query::{Nearest, WallQuery};
pub use recipe::{CentrelineRecipe, NoStore, WallRecipe, WallStore};
pub use sac::Sac;
pub use survey::{LumenReport, SeptaReport, StartReport, Survey, survey};
pub use wall::{NO_NEIGHBOUR, RepairReport, Wall};
