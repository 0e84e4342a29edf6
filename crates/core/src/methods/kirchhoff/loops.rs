//! Loops of the device that touch each other.

use super::mesh::Mesh;
use crate::contact::Skin;

/// The surface of each element: as thick as the wall feels it, and as hard as a rod can tell.
pub(super) fn skins(mesh: &Mesh) -> impl Iterator<Item = Skin> + '_ {
    let mut radii_mm = vec![0.0f64; mesh.elements.len()];
    for point in &mesh.points {
        let radius_mm = &mut radii_mm[point.element];
        *radius_mm = radius_mm.max(point.potential.radius_mm);
    }
    radii_mm
        .into_iter()
        .zip(&mesh.elements)
        .map(|(radius_mm, element)| Skin::rigid(radius_mm, element.bending[1]))
}
