//! The mesh on several coaxial instruments.
//!
//! The line is as long as the instrument inserted farthest, and its nodes are marks at whole element lengths from its
//! tip. Where another instrument or a stretch of one ends, stiffness jumps, and a node moves with that end; where the
//! rest shape of one needs shorter elements, nodes are marks on that. A mark within half an element of an end is
//! removed, so that no sliver arises while an end slides by. Two ends closer than [`Fineness::near_mm`] share a node.
//!
//! The outermost instrument at a position touches the wall, at the contact points that it would have alone: they are
//! marks on it, and their weights end where it becomes covered. So energies are continuous as ends pass nodes.

use super::material::element;
use super::mesh::{Fineness, Mesh};
use super::stretches::{marks_in_bends, stretch_ends};
use crate::contact::ContactPoint;
use crate::device::{Device, Stack, line_mm};

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
        let (element_mm, near_mm) = (fineness.element_mm, fineness.near_mm());
        let line = line_mm(inserted_mm.iter().copied());
        let each = || stack.devices().zip(inserted_mm).enumerate();
        let is_inner = |at: f64| at > near_mm && at < line - near_mm;
        let mut breaks: Vec<(f64, Anchor)> = Vec::new();
        // What is too near to another one goes; ends of coils, where they are detached, stay.
        for (index, (device, inserted)) in each() {
            let at = line - inserted + device.coil_mm();
            if device.coil_mm() > 0.0 && is_inner(at) {
                breaks.push((at, Anchor::Break(index, device.coil_mm())));
            }
        }
        for (index, (device, inserted)) in each() {
            let begins = std::iter::once(0.0).chain(stretch_ends(device, fineness));
            for begin in begins.take_while(|begin| begin < inserted) {
                let at = line - inserted + begin;
                if is_inner(at) && breaks.iter().all(|(b, _)| (at - b).abs() > near_mm) {
                    breaks.push((at, Anchor::Break(index, begin)));
                }
            }
        }
        // Marks give way to ends, and those of gentle bends to those of tight ones.
        let mut bends: Vec<(f64, f64, Anchor)> = Vec::new();
        for (index, (device, inserted)) in each() {
            let marks = marks_in_bends(device, fineness).take_while(|(mark, _)| mark < inserted);
            bends.extend(
                marks.map(|(mark, piece_mm)| (piece_mm, line - inserted + mark, Anchor::Break(index, mark))),
            );
        }
        bends.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (piece_mm, at, anchor) in bends {
            let half_mm = 0.5 * piece_mm;
            let is_free = breaks.iter().all(|(b, _)| (at - b).abs() >= half_mm);
            if at >= half_mm && at <= line - half_mm && is_free {
                breaks.push((at, anchor));
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
        let all = (inserted_mm, inserted_mm.len());
        mesh.elements.extend(ends.map(|ends| element(stack, all, (ends[0], ends[1]), mesh.flush_mm)));
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
                mesh.elements[e] = element(stack, (inserted_mm, inserted_mm.len()), ends, mesh.flush_mm);
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
        mesh.flush_mm = self.fineness.flush_mm();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Instrument, Section};

    /// A tip of this length and radius of rest curvature on a straight shaft.
    fn shaped(name: &str, shaft: Section, (length_mm, bend_mm): (f64, f64)) -> Instrument {
        let tip = Section { length_mm, rest_curvature_per_mm: [1.0 / bend_mm, 0.0], ..shaft };
        Instrument { name: name.to_owned(), device: Device::new(vec![tip, shaft]).unwrap(), may_lead: true }
    }

    #[test]
    fn tight_bends_have_short_elements_in_and_out_of_each_other() {
        let wire = shaped("wire", Section::straight(150.0, 0.2, 5.0), (9.0, 3.0));
        let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(150.0, 0.8, 60.0) };
        let stack = Stack::new(vec![wire, shaped("catheter", catheter, (20.0, 6.0))]).unwrap();
        let fineness = Fineness::of_elements(4.0);
        let mut mesh = Mesh::default();
        for k in 0..400 {
            let inserted_mm = [45.0 + 0.1 * f64::from(k), 60.0];
            let line = line_mm(inserted_mm);
            Nodes::new(&stack, &inserted_mm, fineness).mesh(&stack, &inserted_mm, 1.0, &mut mesh);
            for ends in mesh.from_tip_mm.windows(2) {
                let length_mm = ends[0] - ends[1];
                assert!(length_mm > fineness.near_mm() && length_mm < 8.0, "{inserted_mm:?}: {ends:?}");
                for (inserted, (tip_mm, bend_mm)) in inserted_mm.iter().zip([(9.0, 3.0), (20.0, 6.0)]) {
                    let [near, far] = [ends[0], ends[1]].map(|at| at - (line - inserted));
                    let in_tip = far > -1e-9 && near < tip_mm + 1e-9;
                    assert!(!in_tip || length_mm / bend_mm < 2.0 * 0.5, "{inserted_mm:?}: {ends:?}");
                }
            }
        }
        // Far from the other one the mesh of a bend is that of the wire alone.
        let inserted_mm = [90.0, 60.0];
        Nodes::new(&stack, &inserted_mm, fineness).mesh(&stack, &inserted_mm, 1.0, &mut mesh);
        let mut alone = Mesh::default();
        alone.build(stack.first(), 90.0, fineness, 1.0);
        let tip = |mesh: &Mesh| mesh.from_tip_mm.iter().rev().take(7).copied().collect::<Vec<_>>();
        assert_eq!(tip(&mesh), tip(&alone));
    }
}
