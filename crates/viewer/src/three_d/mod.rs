//! The 3D view: what both engines share, so that their frames look alike.

mod camera;
mod mesh;
mod style;

pub(crate) use camera::Camera;
pub(crate) use mesh::{Vertex, device_triangles, wall_triangles};
pub(crate) use style::Style;
