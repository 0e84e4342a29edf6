//! Loops of the device that touch each other.

use super::mesh::Mesh;
use crate::contact::Skin;
use crate::device::{Device, Stack};

/// The surface of each element of what is in: as thick as its outermost instrument in the middle, and as hard as a rod can tell.
pub(super) fn skins<'a>(mesh: &'a Mesh, stack: &'a Stack) -> impl Iterator<Item = Skin> + 'a {
    let alone = [mesh.from_tip_mm[0]];
    middles(mesh).zip(&mesh.elements).map(move |(middle_mm, element)| {
        let inserted_mm = if mesh.inserted_mm.is_empty() { &alone[..] } else { &mesh.inserted_mm };
        Skin::rigid(stack.felt_radius_mm(inserted_mm, middle_mm), element.bending[1])
    })
}

/// That of a device by itself.
pub(super) fn skins_alone<'a>(mesh: &'a Mesh, device: &'a Device) -> impl Iterator<Item = Skin> + 'a {
    middles(mesh)
        .zip(&mesh.elements)
        .map(|(middle_mm, element)| Skin::rigid(device.section_at(middle_mm).radius_mm, element.bending[1]))
}

/// How far the middles of elements are from the tip, mm.
fn middles(mesh: &Mesh) -> impl Iterator<Item = f64> + '_ {
    mesh.from_tip_mm.windows(2).map(|ends| 0.5 * (ends[0] + ends[1]))
}
