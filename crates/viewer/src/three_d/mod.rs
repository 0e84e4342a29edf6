//! The 3D view: what both engines share, so that their frames look alike.

mod camera;
mod markers;
mod mesh;
mod scale_bar;
mod solids;
mod style;
mod text;

pub(crate) use camera::Camera;
pub(crate) use markers::{draw as draw_markers, legend as draw_legend};
pub(crate) use mesh::{Vertex, wall_triangles};
pub(crate) use scale_bar::draw as draw_scale_bar;
pub use solids::ContactView;
pub(crate) use solids::{Solids, solid_triangles};
pub(crate) use style::Style;
