//! Loops of the device that touch each other.

use super::mesh::Mesh;
use crate::contact::{SelfContact, Skin};
use crate::rod::RodState;

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

/// Whether a device that has slid on along its own curve, by so much at its tip, would have run into itself.
pub(super) fn is_in_its_own_way(
    loops: &mut SelfContact,
    mesh: &Mesh,
    slid: &RodState,
    advance_mm: f64,
) -> bool {
    loops.blocks_its_tip(&mesh.elements, slid, advance_mm)
}
