//! What a device is pushed into.

mod mesh;

pub use mesh::SurfaceMesh;
