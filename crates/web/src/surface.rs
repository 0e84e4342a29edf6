//! The class `Surface` of the JavaScript package: checks whether a surface file is usable as a vessel.

use std::path::Path;

use endowire_core::vessel::{SurfaceMesh, Wall, wall_hints};
use endowire_core::{Error, Result};
use endowire_viewer::{Backend, Frames, Image, Renderer, View, ViewSpec};
use serde::Serialize;
use wasm_bindgen::prelude::*;

use crate::session::picture;
use crate::{object, thrown};

/// A repaired surface and its picture.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Surface {
    reported: Document,
    image: Image,
}

#[derive(Debug, Serialize)]
struct Document {
    triangles: usize,
    size_mm: [f64; 3],
    notes: Vec<String>,
    hints: Vec<String>,
    inlet: Option<usize>,
    openings: Vec<Hole>,
}

#[derive(Debug, Serialize)]
struct Hole {
    index: usize,
    radius_mm: f64,
    centre_mm: [f64; 3],
    pixel: Option<[f64; 2]>,
}

#[wasm_bindgen]
impl Surface {
    /// Reads and repairs the bytes of a surface file (STL, OBJ, PLY, VTP, VTK) whose unit is `unit_mm` millimetres,
    /// and draws it with `side` pixels a side. The extension of `name` gives the format.
    ///
    /// # Errors
    /// Why it cannot be used.
    #[wasm_bindgen(constructor)]
    pub fn new(name: &str, bytes: &[u8], unit_mm: f64, side: u32) -> std::result::Result<Surface, JsError> {
        Self::of(Path::new(name), bytes, unit_mm, side).map_err(thrown)
    }

    /// Properties of the surface.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(unchecked_return_type = "SurfaceReport")]
    pub fn report(&self) -> std::result::Result<JsValue, JsError> {
        object(&self.reported)
    }

    /// A 3D picture of the surface.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(unchecked_return_type = "Picture")]
    pub fn picture(&self) -> std::result::Result<JsValue, JsError> {
        picture(self.image.clone())
    }
}

impl Surface {
    fn of(name: &Path, bytes: &[u8], unit_mm: f64, side: u32) -> Result<Self> {
        let surface = SurfaceMesh::from_bytes(bytes, name, unit_mm)?;
        let wall = Wall::from_surface(&surface).map_err(|error| Error::content(name, error.to_string()))?;
        let spec = ViewSpec {
            views: vec![View::ThreeD],
            size_px: [side; 2],
            backend: Backend::Cpu,
            ..ViewSpec::default()
        };
        let mut renderer = Renderer::of_wall(&spec, &wall)?;
        let Frames { three_d: Some(image), .. } = renderer.render(&[])? else {
            return Err(Error::parameter("view.views", "3d", "was not drawn"));
        };
        let hole = |one: &endowire_core::vessel::Opening| Hole {
            index: one.index,
            radius_mm: one.radius_mm,
            centre_mm: one.centre_mm.into(),
            pixel: renderer.three_d_pixel(&one.centre_mm),
        };
        let (low, high) = wall.mesh().bounds_mm().unwrap_or_default();
        let reported = Document {
            triangles: wall.mesh().triangles.len(),
            size_mm: (high - low).into(),
            notes: wall.report().notes(),
            hints: wall_hints(&wall, unit_mm),
            inlet: wall.inlet().map(|one| one.index),
            openings: wall.openings().iter().map(hole).collect(),
        };
        Ok(Self { reported, image })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn openings_are_seen_where_they_are_and_what_is_no_surface_is_reported() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/vessels/curved_tube.stl");
        let bytes = std::fs::read(file).unwrap();
        let surface = Surface::of(Path::new("tube.stl"), &bytes, 1.0, 128).unwrap();
        assert_eq!(surface.reported.openings.len(), 2);
        assert!(
            surface.reported.inlet.is_some() && surface.reported.hints.is_empty(),
            "{:?}",
            surface.reported
        );
        for hole in &surface.reported.openings {
            let [x, y] = hole.pixel.unwrap();
            assert!((0.0..128.0).contains(&x) && (0.0..128.0).contains(&y), "{hole:?}");
        }
        // With a wrong unit, the vessel is far too small.
        assert!(!Surface::of(Path::new("tube.stl"), &bytes, 0.01, 128).unwrap().reported.hints.is_empty());
        let reported = Surface::of(Path::new("tube.stl"), &bytes[..200], 1.0, 128).unwrap_err().to_string();
        assert!(reported.starts_with("tube.stl"), "{reported}");
    }
}
