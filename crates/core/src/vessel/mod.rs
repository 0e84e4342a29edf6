//! What a device is pushed into.

pub mod anatomy;
mod centreline;
mod check;
mod conditioning;
mod files;
mod generate;
mod inside;
mod intersect;
mod mesh;
mod opening;
mod orient;
mod query;
mod sliver;
#[cfg(test)]
mod tests;
mod topology;
mod wall;
mod weld;

pub use centreline::{CentrelineNode, CentrelineTree};
pub use check::{CheckReport, OpeningReport, check};
pub use conditioning::{Conditioned, Conditioning, condition};
pub use generate::{GeneratedWall, Resolution};
pub use mesh::SurfaceMesh;
pub use opening::Opening;
pub use query::{Nearest, WallQuery};
pub use wall::{NO_NEIGHBOUR, RepairReport, Wall};
