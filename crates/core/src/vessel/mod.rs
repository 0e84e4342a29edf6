//! What a device is pushed into.

mod centreline;
mod files;
mod inside;
mod mesh;
mod opening;
mod orient;
mod query;
mod sliver;
mod topology;
mod wall;
mod weld;

pub use centreline::{CentrelineNode, CentrelineTree};
pub use mesh::SurfaceMesh;
pub(crate) use mesh::area;
pub use opening::Opening;
pub use query::{Nearest, WallQuery};
pub use wall::{RepairReport, Wall};
