//! Path length maps: the geometry of a fluoroscopic frame before any physics.

use crate::material::Material;

/// Length of each pixel's central ray inside each object, in millimetres, row by row from the top left.
///
/// Lengths are geometric, before nesting: `lumen_mm` is the length inside the closed wall including devices. A device
/// displaces the content of the lumen, so the length through blood is `lumen_mm` minus those of the devices.
#[derive(Debug, Clone, PartialEq)]
pub struct PathLengths {
    /// Pixels per row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Length inside the body: soft tissue and everything within it; for a CT volume, its equivalent of soft tissue
    /// and bone.
    pub body_mm: Vec<f32>,
    /// Length inside bone, as cortical bone of the same mass; empty if the patient has none.
    pub bone_mm: Vec<f32>,
    /// Length inside the lungs; empty if the patient has none.
    pub lung_mm: Vec<f32>,
    /// Length inside the closed wall.
    pub lumen_mm: Vec<f32>,
    /// Length of undiluted contrast medium in the lumen, outside devices; empty if there is none.
    pub contrast_mm: Vec<f32>,
    /// Length inside devices, one map per material, in order of first appearance.
    pub devices_mm: Vec<(Material, Vec<f32>)>,
}

impl PathLengths {
    /// Index of the pixel in column `x` and row `y`.
    pub fn index(&self, x: u32, y: u32) -> usize {
        y as usize * self.width as usize + x as usize
    }

    /// Whether it has the same maps of the same size.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let materials = |paths: &Self| paths.devices_mm.iter().map(|map| map.0).collect::<Vec<_>>();
        let sizes = |paths: &Self| paths.maps().map(<[f32]>::len).collect::<Vec<_>>();
        materials(self) == materials(other) && sizes(self) == sizes(other)
    }

    /// Whether the lengths on a ray equal those of another with the same maps.
    pub(crate) fn is_same_at(&self, other: &Self, i: usize) -> bool {
        self.maps().zip(other.maps()).all(|(a, b)| a.get(i) == b.get(i))
    }

    fn maps(&self) -> impl Iterator<Item = &[f32]> {
        let fixed = [&self.body_mm, &self.bone_mm, &self.lung_mm, &self.lumen_mm, &self.contrast_mm];
        fixed.into_iter().chain(self.devices_mm.iter().map(|map| &map.1)).map(Vec::as_slice)
    }
}
