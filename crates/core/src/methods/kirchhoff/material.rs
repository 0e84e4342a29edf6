//! What is between two nodes: each section of an instrument counts by its share of the element.
//!
//! An end that has no node because it is near another one counts as at that one: as a share of its own, a stiff section
//! of a micrometre would be bent as much as the soft one beside it.

use super::mesh::Fineness;
use super::rims;
use crate::device::{Device, Section, Stack, line_mm};
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, Material, shares};

/// An element between two distances from the tip of the line, of those `inner` instruments whose tips are in it or
/// beyond. Ends of sections nearer than `flush_mm` to a node count as at it.
pub(super) fn element(
    stack: &Stack,
    (inserted_mm, inner): (&[f64], usize),
    (near, far): (f64, f64),
    flush_mm: f64,
) -> ElementData {
    let line = line_mm(inserted_mm.iter().copied());
    let mut data = ElementData::of(near - far, Material::NONE);
    for ((device, set), inserted) in stack.devices().zip(stack.sets()).zip(inserted_mm).take(inner) {
        let behind = line - inserted;
        if 0.5 * (near + far) <= behind {
            continue;
        }
        let part = between(device, (near - behind, far - behind), flush_mm);
        for (sum, own) in data.bending.iter_mut().zip(part.bending) {
            *sum += own;
        }
        if let Some(set) = set {
            data.materials[*set] = part;
        }
    }
    if stack.has_play() && inner == inserted_mm.len() {
        data.tilt = rims::tilt((stack, inserted_mm), (near, far), Fineness::near_of(flush_mm), &data);
    }
    data
}

/// An element of a single instrument between two distances from its tip, with its set of angles, if any.
pub(super) fn alone(
    device: &Device,
    set: Option<usize>,
    (near, far): (f64, f64),
    flush_mm: f64,
) -> ElementData {
    let part = between(device, (near, far), flush_mm);
    let mut data = ElementData { length: near - far, bending: part.bending, ..ElementData::EMPTY };
    if let Some(set) = set {
        data.materials[set] = part;
    }
    data
}

/// The material between two distances from the tip of a device, with each section's share.
pub(super) fn between(device: &Device, (near, far): (f64, f64), flush_mm: f64) -> Material {
    let h = near - far;
    let mut sum = Material::NONE;
    for (section, begin, until) in flush_sections(device, (near, far), flush_mm) {
        if begin <= far && near <= until {
            return material(section);
        }
        let (first, end) = (near.min(until), far.max(begin));
        if end < first {
            sum.add_share(&material(section), &shares((near - first) / h, (near - end) / h));
        }
        if near <= until {
            break;
        }
    }
    sum
}

/// The section that comes out of the sheath, of which an element has this distance from the tip at the mouth, and that
/// at its other node.
pub(super) fn at_mouth(device: &Device, (near, far): (f64, f64), flush_mm: f64) -> &Section {
    let mut each = flush_sections(device, (near, far), flush_mm);
    each.find(|(_, _, until)| near <= *until).map_or(device.section_at(near), |(section, ..)| section)
}

/// The sections of a device, and where they begin and end, from its tip. Those that end nearly at one of the nodes of
/// an element end there; equal ones that follow each other are one.
fn flush_sections(
    device: &Device,
    (near, far): (f64, f64),
    flush_mm: f64,
) -> impl Iterator<Item = (&Section, f64, f64)> {
    let flush = move |end: f64| {
        let node = if (end - near).abs() < (end - far).abs() { near } else { far };
        if (end - node).abs() < flush_mm { node } else { end }
    };
    let mut left = device.sections().iter().peekable();
    let (mut end, mut until) = (0.0, flush(0.0));
    std::iter::from_fn(move || {
        let section = left.next()?;
        end += section.length_mm;
        while let Some(next) = left.next_if(|next| is_same(section, next)) {
            end += next.length_mm;
        }
        let begin = until;
        until = if left.peek().is_none() { f64::INFINITY } else { flush(end) };
        Some((section, begin, until))
    })
}

/// Whether both are of the same material.
pub(super) fn is_same(a: &Section, b: &Section) -> bool {
    a.bending_stiffness_nmm2 == b.bending_stiffness_nmm2
        && a.soft_plane == b.soft_plane
        && a.rest_curvature_per_mm == b.rest_curvature_per_mm
        && a.torsion_nmm2() == b.torsion_nmm2()
        && a.steer == b.steer
}

/// A section, at all Gauss points.
fn material(section: &Section) -> Material {
    let (bending, skew) = section.stiffness_nmm2();
    Material {
        bending: GAUSS.map(|_| bending),
        skew: GAUSS.map(|_| skew),
        torsion: GAUSS.map(|_| section.torsion_nmm2()),
        rest_curvature: GAUSS.map(|_| section.rest_curvature_per_mm),
        rest_twist: [0.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_sections_are_one_and_ends_near_nodes_are_at_them() {
        let wire = |length_mm: f64| Section::straight(length_mm, 0.4, 5.0);
        let stiff = Section::straight(20.0, 0.4, 15.0);
        let cut = Device::new(vec![wire(1.0), wire(1.5), wire(2.5), stiff]).unwrap();
        assert_eq!(between(&cut, (4.0, 0.5), 5e-3).bending, [5.0; 3]);
        assert_eq!(between(&cut, (5.001, 2.0), 5e-3).bending, [5.0; 3]);
        assert_eq!(between(&cut, (8.0, 4.999), 5e-3).bending, [15.0; 3]);
        // Half and half.
        let both = between(&cut, (6.0, 4.0), 5e-3);
        let mean: f64 =
            GAUSS.iter().zip(both.bending).map(|(point, stiffness)| point.weight * stiffness).sum();
        assert!((mean - 10.0).abs() < 1e-12, "{mean}");
        assert_eq!(at_mouth(&cut, (5.001, 2.0), 5e-3).bending_stiffness_nmm2, 5.0);
        assert_eq!(at_mouth(&cut, (5.1, 2.0), 5e-3).bending_stiffness_nmm2, 15.0);
    }
}
