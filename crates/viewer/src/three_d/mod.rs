//! The 3D view: code shared by both engines, so that their frames look alike.

mod camera;
mod markers;
mod mesh;
mod room;
mod scale_bar;
mod solids;
mod style;
mod text;

pub(crate) use camera::Camera;
pub(crate) use markers::{annotate, draw as draw_markers};
pub(crate) use mesh::{Vertex, wall_triangles};
pub use solids::{ContactView, largest_force_n};
pub(crate) use solids::{Solids, solid_triangles};
pub(crate) use style::Style;
