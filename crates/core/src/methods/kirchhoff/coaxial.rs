//! The mesh on several coaxial instruments.
//!
//! The line is as long as the instrument inserted farthest, and its nodes are marks at whole element lengths from its
//! tip. Where another instrument or a section ends, stiffness jumps, and a node moves with that end; a mark within
//! half an element of it is removed, so that no sliver arises while an end slides by. Two ends closer than [`NEAR`]
//! share a node, and material ending inside an element counts by its share of the element. An end that has no node
//! because it is near another one counts as at that one: as a share of its own, a stiff section of a micrometre would be
//! bent as much as the soft one beside it.
//!
//! The outermost instrument at a position touches the wall, at the contact points that it would have alone: they are
//! marks on it, and their weights end where it becomes covered. So energies are continuous as ends pass nodes.

use super::mesh::{Fineness, Mesh, NEAR, section_ends};
use crate::contact::ContactPoint;
use crate::device::{Device, Section, Stack, line_mm};
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, Material, shares};

/// An end of a section as near to a node as this fraction of its element counts as at the node: above [`NEAR`] in all
/// elements but slivers, since others are at least half as long as they should be.
const FLUSH: f64 = 2.5 * NEAR;

/// What a node moves with.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Anchor {
    /// The sheath's mouth.
    Mouth,
    /// A mark this many elements from the tip of the line.
    Mark(usize),
    /// A position on an instrument, by its distance from the tip, mm.
    Break(usize, f64),
}

/// The nodes of a line, sheath first, and what each moves with.
#[derive(Debug, Clone)]
pub(super) struct Nodes {
    anchors: Vec<Anchor>,
    fineness: Fineness,
}

impl Nodes {
    /// Nodes for these inserted lengths of the instruments, at least one above 0.
    pub(super) fn new(stack: &Stack, inserted_mm: &[f64], fineness: Fineness) -> Self {
        let element_mm = fineness.element_mm;
        let line = line_mm(inserted_mm.iter().copied());
        let near = NEAR * element_mm;
        let mut breaks: Vec<(f64, Anchor)> = Vec::new();
        // What is too near to another one goes; ends of coils, where they are detached, stay.
        for (index, (device, inserted)) in stack.devices().zip(inserted_mm).enumerate() {
            let at = line - inserted + device.coil_mm();
            if device.coil_mm() > 0.0 && at > near && at < line - near {
                breaks.push((at, Anchor::Break(index, device.coil_mm())));
            }
        }
        for (index, (device, inserted)) in stack.devices().zip(inserted_mm).enumerate() {
            let begins = std::iter::once(0.0).chain(section_ends(device, element_mm));
            for begin in begins.take_while(|begin| begin < inserted) {
                let at = line - inserted + begin;
                if at > near && at < line - near && breaks.iter().all(|(b, _)| (at - b).abs() > near) {
                    breaks.push((at, Anchor::Break(index, begin)));
                }
            }
        }
        let marks = (1..).map(|k| (k as f64 * element_mm, Anchor::Mark(k)));
        let marks = marks.take_while(|(at, _)| *at <= line - 0.5 * element_mm);
        let free = |at: f64| breaks.iter().all(|(b, _)| (at - b).abs() >= 0.5 * element_mm);
        let mut all: Vec<(f64, Anchor)> = marks.filter(|(at, _)| free(*at)).collect();
        all.extend(breaks);
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let inner = all.into_iter().map(|(_, anchor)| anchor);
        let anchors = [Anchor::Mouth].into_iter().chain(inner).chain([Anchor::Mark(0)]).collect();
        Self { anchors, fineness }
    }

    /// Meshes the line, with the same nodes even for other inserted lengths than they were made for.
    pub(super) fn mesh(&self, stack: &Stack, inserted_mm: &[f64], modulus_n_per_mm2: f64, mesh: &mut Mesh) {
        self.place(inserted_mm, mesh);
        mesh.elements.clear();
        let ends = mesh.from_tip_mm.windows(2);
        mesh.elements
            .extend(ends.map(|ends| element(stack, inserted_mm, inserted_mm.len(), (ends[0], ends[1]))));
        self.feel(stack, inserted_mm, modulus_n_per_mm2, mesh);
    }

    /// As [`Self::mesh`], from the mesh of lengths that differ by less than `within_mm`; returns the elements that
    /// change. These have an end that moves along the line, or are near the end of an instrument or section; all
    /// others are unchanged.
    pub(super) fn mesh_beside(
        &self,
        (stack, inserted_mm): (&Stack, &[f64]),
        (known, within_mm): (&Mesh, f64),
        modulus_n_per_mm2: f64,
        mesh: &mut Mesh,
    ) -> Vec<usize> {
        self.place(inserted_mm, mesh);
        mesh.elements.clone_from(&known.elements);
        let line = known.from_tip_mm[0];
        let instruments = stack.devices().zip(&known.inserted_mm);
        let breaks: Vec<f64> =
            instruments.flat_map(|(device, mm)| begins(device).map(move |begin| line - mm + begin)).collect();
        let mut others = Vec::new();
        for e in 0..mesh.elements.len() {
            let [ends, were] = [&*mesh, known].map(|of| (of.from_tip_mm[e], of.from_tip_mm[e + 1]));
            let beside = |at: &f64| were.1 - within_mm <= *at && *at <= were.0 + within_mm;
            if ends != were || breaks.iter().any(beside) {
                mesh.elements[e] = element(stack, inserted_mm, inserted_mm.len(), ends);
                others.push(e);
            }
        }
        self.feel(stack, inserted_mm, modulus_n_per_mm2, mesh);
        others
    }

    /// Sets the arc lengths of the nodes.
    fn place(&self, inserted_mm: &[f64], mesh: &mut Mesh) {
        let line = line_mm(inserted_mm.iter().copied());
        mesh.from_tip_mm.clear();
        mesh.from_tip_mm.extend(self.anchors.iter().map(|anchor| match *anchor {
            Anchor::Mouth => line,
            Anchor::Mark(k) => k as f64 * self.fineness.element_mm,
            Anchor::Break(index, from_tip) => line - inserted_mm[index] + from_tip,
        }));
        mesh.inserted_mm.clear();
        mesh.inserted_mm.extend_from_slice(inserted_mm);
    }

    /// Sets the contact points, tip first.
    fn feel(&self, stack: &Stack, inserted_mm: &[f64], modulus_n_per_mm2: f64, mesh: &mut Mesh) {
        mesh.points.clear();
        let line = line_mm(inserted_mm.iter().copied());
        let mut alone = Mesh::default();
        let mut e = mesh.elements.len() - 1;
        for (index, device) in stack.devices().enumerate() {
            let inserted = inserted_mm[index];
            let covered = line_mm(inserted_mm[index + 1..].iter().copied());
            if inserted <= covered {
                continue;
            }
            alone.build_points(device, inserted, self.fineness, modulus_n_per_mm2);
            cover(device, inserted, covered, &mut alone.points);
            let set = stack.sets()[index].unwrap_or(0);
            for point in &alone.points {
                let from_tip_mm = line - inserted + point.from_tip_mm;
                let (element, xi) = mesh.place(from_tip_mm, &mut e);
                let surface = ContactPoint { element, xi, instrument: index, set, from_tip_mm, ..*point };
                mesh.points.push(surface);
            }
        }
    }
}

/// Starts of the sections of a device, measured from its tip.
fn begins(device: &Device) -> impl Iterator<Item = f64> {
    device.sections().iter().scan(0.0, |end, section| {
        let begin = *end;
        *end += section.length_mm;
        Some(begin)
    })
}

/// Keeps the contact points of an instrument up to where it is `covered` by those outside it, and adds one where it
/// comes out.
fn cover(device: &Device, inserted_mm: f64, covered_mm: f64, points: &mut Vec<ContactPoint>) {
    if covered_mm == 0.0 {
        return;
    }
    let bare = inserted_mm - covered_mm;
    let kept = points.iter().position(|p| p.from_tip_mm >= bare).unwrap_or(points.len());
    let next = points.get(kept).map_or(inserted_mm, |p| p.from_tip_mm);
    points.truncate(kept);
    let Some(last) = points.last_mut() else { return };
    // Half of the interval to the next point becomes half of the interval to the end.
    let step = bare - last.from_tip_mm;
    last.weight_mm -= 0.5 * (next - bare);
    let mut end = ContactPoint { from_tip_mm: bare, weight_mm: 0.5 * step, ..*last };
    end.potential.radius_mm = device.section_at(bare).radius_mm;
    points.push(end);
}

/// An element between two distances from the tip of the line, of those `inner` instruments whose tips are in it or
/// beyond.
pub(super) fn element(
    stack: &Stack,
    inserted_mm: &[f64],
    inner: usize,
    (near, far): (f64, f64),
) -> ElementData {
    let line = line_mm(inserted_mm.iter().copied());
    let mut data = ElementData::of(near - far, Material::NONE);
    for ((device, set), inserted) in stack.devices().zip(stack.sets()).zip(inserted_mm).take(inner) {
        let behind = line - inserted;
        if 0.5 * (near + far) <= behind {
            continue;
        }
        let part = between(device, near - behind, far - behind);
        for (sum, own) in data.bending.iter_mut().zip(part.bending) {
            *sum += own;
        }
        if let Some(set) = set {
            data.materials[*set] = part;
        }
    }
    data
}

/// An element of a single instrument between two distances from its tip, with its set of angles, if any.
pub(super) fn alone(device: &Device, set: Option<usize>, (near, far): (f64, f64)) -> ElementData {
    let part = between(device, near, far);
    let mut data = ElementData { length: near - far, bending: part.bending, ..ElementData::EMPTY };
    if let Some(set) = set {
        data.materials[set] = part;
    }
    data
}

/// The material between two distances from the tip of a device, with each section's share.
fn between(device: &Device, near: f64, far: f64) -> Material {
    let h = near - far;
    let mut sum = Material::NONE;
    for (section, begin, until) in flush_sections(device, near, far) {
        if begin <= far && near <= until {
            return material(section);
        }
        let (first, end) = (near.min(until), far.max(begin));
        if end < first {
            sum.add_share(&material(section), &shares((near - first) / h, (near - end) / h));
        }
    }
    sum
}

/// The section that comes out of the sheath, of which an element has this distance from the tip at the mouth, and that
/// at its other node.
pub(super) fn at_mouth(device: &Device, near: f64, far: f64) -> &Section {
    let mut each = flush_sections(device, near, far);
    each.find(|(_, _, until)| near <= *until).map_or(device.section_at(near), |(section, ..)| section)
}

/// The sections of a device, and where they begin and end, from its tip. Those that end nearly at one of the nodes of
/// an element end there.
fn flush_sections(device: &Device, near: f64, far: f64) -> impl Iterator<Item = (&Section, f64, f64)> {
    let last = device.sections().len() - 1;
    let flush = move |end: f64| {
        let node = if (end - near).abs() < (end - far).abs() { near } else { far };
        if (end - node).abs() < FLUSH * (near - far) { node } else { end }
    };
    device.sections().iter().zip(begins(device)).enumerate().map(move |(k, (section, begin))| {
        let until = if k == last { f64::INFINITY } else { flush(begin + section.length_mm) };
        (section, flush(begin), until)
    })
}

/// A section, at all Gauss points.
fn material(section: &Section) -> Material {
    Material {
        bending: GAUSS.map(|_| section.bending_stiffness_nmm2),
        torsion: GAUSS.map(|_| section.torsion_nmm2()),
        rest_curvature: GAUSS.map(|_| section.rest_curvature_per_mm),
        rest_twist: [0.0; 3],
    }
}
