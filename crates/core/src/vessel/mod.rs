//! What a device is pushed into.

mod inside;
mod mesh;
mod opening;
mod orient;
mod query;
mod sliver;
mod topology;
mod wall;
mod weld;

pub use mesh::SurfaceMesh;
pub use opening::Opening;
pub use query::{Nearest, WallQuery};
pub use wall::{RepairReport, Wall};
pub(crate) use mesh::area;
