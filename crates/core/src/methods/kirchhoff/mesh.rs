//! The rod's mesh on an inserted device: elements, their sections, and the contact points.

use super::material::between;
use super::options::{Accuracy, KirchhoffOptions};
use super::stretches::nodes_from_tip;
use crate::contact::{ContactPoint, WallPotential};
use crate::device::{Device, Section};
use crate::rod::ElementData;
use crate::tuning::MeshTuning;

/// Ends of sections closer than this fraction of an element share a node: in shorter elements, differences of unit
/// vectors lose the digits that determine curvature.
const NEAR: f64 = 1e-3;
/// An end of a section counts as at a node that is nearer than this number of such distances: above 1, so that each
/// end that has no node because it is near another one counts as at that.
const FLUSH: f64 = 1.25;
/// What is in by less than this fraction of an element is not yet in.
const JUST_IN: f64 = 1e-9;
/// Contact points are known up to the mark behind the sheath's mouth, which is nearer than this number of elements:
/// none is longer than one and a half, and the last half is not needed.
const BEHIND_MOUTH: f64 = 3.0;
/// Largest number of contact points that an element at the tip has beside the evenly spaced ones: their spacing
/// doubles from 4·10⁻⁹ mm to at most half of the longest element, ten metres, in at most 42 steps.
pub(super) const MOST_POINTS: usize = 64;

/// Resolution of a device's mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Fineness {
    /// Length of elements, mm.
    pub element_mm: f64,
    /// Largest spacing of contact points, in radii of the device.
    pub contact_spacing_radii: f64,
    /// Numbers of the mesh that are choices.
    pub tuning: MeshTuning,
}

impl Fineness {
    /// Approximate number of contact points of a device.
    pub(super) fn points(&self, device: &Device) -> usize {
        let each = device.sections().iter().map(|section| section.length_mm / section.radius_mm);
        (each.sum::<f64>() / self.contact_spacing_radii) as usize
    }

    /// Ends of sections closer than this share a node, mm.
    pub(super) fn near_mm(&self) -> f64 {
        NEAR * self.element_mm
    }

    /// As [`Self::near_mm`], from [`Self::flush_mm`].
    pub(super) fn near_of(flush_mm: f64) -> f64 {
        flush_mm / FLUSH
    }

    /// An end of a section counts as at a node that is nearer than this, mm.
    pub(super) fn flush_mm(&self) -> f64 {
        FLUSH * self.near_mm()
    }

    /// Elements of this length, with contact points dense enough for any crest.
    pub(crate) fn of_elements(element_mm: f64) -> Self {
        let contact_spacing_radii = KirchhoffOptions::of(Accuracy::Fast).contact_spacing_radii;
        Self { element_mm, contact_spacing_radii, tuning: MeshTuning::DEFAULT }
    }
}

/// Elements and contact points of an inserted length.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mesh {
    /// Arc length from the tip of every node, mm, sheath first.
    pub from_tip_mm: Vec<f64>,
    /// Elements, sheath first.
    pub elements: Vec<ElementData>,
    /// Contact points, tip first.
    pub points: Vec<ContactPoint>,
    /// Inserted lengths of the instruments; empty where nothing is inserted.
    pub(super) inserted_mm: Vec<f64>,
    /// Distance from a node within which an end of a section counts as at it, mm.
    pub(super) flush_mm: f64,
    /// As `from_tip_mm`, for more than is inserted: between what contact points are.
    pub(super) ahead_mm: Vec<f64>,
}

/// The sections of a device, asked for from its tip on.
struct FromTip<'a> {
    sections: &'a [Section],
    /// Where the first of them ends, mm.
    end_mm: f64,
}

impl<'a> FromTip<'a> {
    fn of(device: &'a Device) -> Self {
        let sections = device.sections();
        Self { sections, end_mm: sections[0].length_mm }
    }

    /// As [`Device::section_at`]; distances ascend.
    fn at(&mut self, from_tip_mm: f64) -> &'a Section {
        while from_tip_mm >= self.end_mm && self.sections.len() > 1 {
            self.sections = &self.sections[1..];
            self.end_mm += self.sections[0].length_mm;
        }
        &self.sections[0]
    }
}

impl Mesh {
    /// Nothing inserted.
    pub(super) fn withdrawn() -> Self {
        Self { from_tip_mm: vec![0.0], ..Self::default() }
    }

    /// Resets to nothing inserted: one node. Keeps the memory.
    pub(super) fn clear(&mut self) {
        self.from_tip_mm.clear();
        self.from_tip_mm.push(0.0);
        self.elements.clear();
        self.points.clear();
        self.inserted_mm.clear();
    }

    /// Number of elements of the line; those of coils follow when they are solved together.
    pub(super) fn line(&self) -> usize {
        self.from_tip_mm.len() - 1
    }

    /// Element and ξ at this distance from the tip, mm. `e` is where the search starts: calls go from the tip to the
    /// sheath.
    pub(super) fn place(&self, from_tip_mm: f64, e: &mut usize) -> (usize, f64) {
        while *e > 0 && from_tip_mm >= self.from_tip_mm[*e] {
            *e -= 1;
        }
        let xi = 1.0 - (from_tip_mm - self.from_tip_mm[*e + 1]) / self.elements[*e].length;
        (*e, xi.clamp(0.0, 1.0))
    }

    /// The node nearest to this distance from the tip, mm.
    pub(super) fn nearest_node(&self, from_tip_mm: f64) -> usize {
        let off = |i: &usize| (self.from_tip_mm[*i] - from_tip_mm).abs();
        (0..self.from_tip_mm.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// Allocates for up to `elements` elements and `points` contact points.
    pub(super) fn reserve(&mut self, elements: usize, points: usize) {
        self.from_tip_mm.reserve((elements + 1).saturating_sub(self.from_tip_mm.len()));
        self.elements.reserve(elements.saturating_sub(self.elements.len()));
        self.points.reserve(points.saturating_sub(self.points.len()));
    }

    /// Meshes `inserted_mm` (above 0) of `device`; for its nodes see `stretches.rs`.
    pub(crate) fn build(
        &mut self,
        device: &Device,
        inserted_mm: f64,
        fineness: Fineness,
        modulus_n_per_mm2: f64,
    ) {
        self.build_points(device, inserted_mm, fineness, modulus_n_per_mm2);
        self.flush_mm = fineness.flush_mm();
        self.inserted_mm.clear();
        self.inserted_mm.push(inserted_mm);
        // Only fields for a single device are written: the rest of earlier elements is empty.
        self.elements.resize(self.from_tip_mm.len() - 1, ElementData::EMPTY);
        for (ends, data) in self.from_tip_mm.windows(2).zip(&mut self.elements) {
            let material = between(device, (ends[0], ends[1]), self.flush_mm);
            (data.length, data.bending) = (ends[0] - ends[1], material.bending);
            data.materials[0] = material;
        }
    }

    /// Sets nodes and contact points like [`Mesh::build`], without changing the elements.
    ///
    /// Contact points are marks on the device as well, those of whole elements, and enter with it: points that slid
    /// in an element growing at the mouth would put energy into the wall that no hand has given. Each counts by
    /// what is inserted behind it, up to the length that it represents, so that none comes in with a jump.
    pub(super) fn build_points(
        &mut self,
        device: &Device,
        inserted_mm: f64,
        fineness: Fineness,
        modulus_n_per_mm2: f64,
    ) {
        let Fineness { element_mm, contact_spacing_radii, tuning } = fineness;
        nodes_from_tip(device, inserted_mm, fineness, &mut self.from_tip_mm);
        let ahead_mm = (inserted_mm + BEHIND_MOUTH * element_mm).min(device.length_mm());
        nodes_from_tip(device, ahead_mm.max(inserted_mm), fineness, &mut self.ahead_mm);
        self.points.clear();
        let most = 1.0 + fineness.points(device) as f64;
        // Half of the interval beyond the current point; beyond the tip this is its cap.
        let mut half_beyond = device.section_at(0.0).radius_mm;
        let first = self.from_tip_mm.len() - 2;
        let mut sections = FromTip::of(device);
        for (k, ends) in self.ahead_mm.windows(2).rev().enumerate().take_while(|(_, e)| e[1] < inserted_mm) {
            // Whole elements that are not all in are in the one at the mouth.
            let element = first.saturating_sub(k);
            let [near, far] = [self.from_tip_mm[element], self.from_tip_mm[element + 1]];
            let length = ends[0] - ends[1];
            let radius_mm = device.section_at(ends[1]).radius_mm;
            // A thin tip too short for an element of its own determines the spacing in the element, without requiring
            // more points than the device has in all.
            let intervals = (length / (contact_spacing_radii * radius_mm)).ceil();
            let intervals = intervals.min(most).max(tuning.fewest_intervals);
            let spacing = length / intervals;
            // Distance from the element's far end.
            let mut at = 0.0;
            let mut fine = if k == 0 { tuning.tip_spacing_radii * radius_mm } else { spacing };
            while at < (1.0 - 1e-9) * length {
                let left = length - at;
                let step = fine.min(spacing);
                // Where the fine intervals end, the remaining ones are made equal.
                let step =
                    if step >= spacing { left / (left / spacing - 1e-9).ceil() } else { step.min(left) };
                let from_tip_mm = ends[1] + at;
                let behind_mm = inserted_mm - from_tip_mm;
                if behind_mm <= JUST_IN * length {
                    break;
                }
                self.points.push(ContactPoint {
                    element,
                    xi: 1.0 - (ends[1] - far + at) / (near - far),
                    instrument: 0,
                    set: 0,
                    from_tip_mm,
                    weight_mm: (half_beyond + 0.5 * step).min(behind_mm),
                    potential: WallPotential {
                        modulus_n_per_mm2,
                        radius_mm: sections.at(from_tip_mm).radius_mm,
                    },
                });
                half_beyond = 0.5 * step;
                at += step;
                fine *= 2.0;
            }
        }
    }

    /// Whether a contact point of a single device counts by more with every piece that is inserted. One that has just
    /// come in completely still does: what follows is not yet in.
    pub(super) fn is_coming_in(&self, point: &ContactPoint) -> bool {
        let behind_mm = self.from_tip_mm[0] - point.from_tip_mm;
        behind_mm - point.weight_mm <= JUST_IN * self.elements[0].length
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Section;

    #[test]
    fn a_crest_between_two_contact_points_is_felt_before_it_reaches_the_axis() {
        let mut mesh = Mesh::default();
        for (radius_mm, element_mm) in [(0.178, 1.0), (0.178, 4.0), (0.445, 2.0), (0.445, 4.0), (0.9, 4.0)] {
            let device = Device::uniform(100.0, radius_mm, 5.0).unwrap();
            mesh.build(&device, 50.0, Fineness::of_elements(element_mm), 1.0);
            let gaps = mesh.points.windows(2).map(|pair| pair[1].from_tip_mm - pair[0].from_tip_mm);
            let half = 0.5 * gaps.fold(0.0, f64::max) / radius_mm;
            assert!((1.0 - half * half).sqrt() > 0.6, "{radius_mm} mm, {element_mm} mm: {half} radii");
        }
    }

    #[test]
    fn contact_points_lie_no_farther_apart_than_asked_for() {
        let device = Device::uniform(100.0, 0.445, 5.0).unwrap();
        let (mut points, mut widest) = ([0; 2], [0.0; 2]);
        for (k, contact_spacing_radii) in [1.5, 3.0].into_iter().enumerate() {
            let mut mesh = Mesh::default();
            mesh.build(&device, 50.0, Fineness { contact_spacing_radii, ..Fineness::of_elements(5.0) }, 1.0);
            let gaps = mesh.points.windows(2).map(|pair| pair[1].from_tip_mm - pair[0].from_tip_mm);
            (points[k], widest[k]) = (mesh.points.len(), gaps.fold(0.0, f64::max) / 0.445);
            assert!(widest[k] <= contact_spacing_radii && widest[k] > 0.9 * contact_spacing_radii);
            // Their weights sum to the whole device and its cap, less what the last ones lack.
            let all_mm: f64 = mesh.points.iter().map(|point| point.weight_mm).sum();
            let lacks_mm = 50.0 + 0.445 - all_mm;
            assert!((0.0..1.5 * contact_spacing_radii * 0.445 + 1e-9).contains(&lacks_mm), "{all_mm}");
        }
        assert!(points[1] < 3 * points[0] / 4, "{points:?}");
    }

    #[test]
    fn contact_points_come_in_with_the_device_and_count_by_what_is_behind_them() {
        let wire = Section::straight(60.0, 0.4, 5.0);
        let tip = Section { length_mm: 7.3, radius_mm: 0.2, ..wire };
        let device = Device::new(vec![tip, Section::straight(0.4, 0.3, 5.0), wire]).unwrap();
        let (mut mesh, mut before) = (Mesh::default(), Vec::<ContactPoint>::new());
        for element_mm in [1.0, 4.0] {
            before.clear();
            for step in 1..=1000 {
                let inserted_mm = 0.02 * f64::from(step);
                mesh.build(&device, inserted_mm, Fineness::of_elements(element_mm), 1.0);
                let came = &mesh.points[before.len()..];
                assert!(came.iter().all(|point| point.weight_mm <= 0.02 + 1e-9), "{inserted_mm}");
                for (was, is) in before.iter().zip(&mesh.points) {
                    assert_eq!(was.from_tip_mm, is.from_tip_mm, "{inserted_mm}");
                    let more_mm = is.weight_mm - was.weight_mm;
                    assert!((0.0..=0.02 + 1e-9).contains(&more_mm), "{inserted_mm}: {was:?} {is:?}");
                    let ends = [is.element, is.element + 1].map(|i| mesh.from_tip_mm[i]);
                    let at = ends[0] - is.xi * (ends[0] - ends[1]);
                    assert!((at - is.from_tip_mm).abs() < 1e-12 * inserted_mm.max(1.0), "{is:?}");
                }
                before.clone_from(&mesh.points);
            }
        }
    }

    #[test]
    fn devices_of_mixed_scales_have_as_many_contact_points_as_their_sections_ask_for() {
        let (thin, thick) = (Section::straight(1.0, 1e-3, 10.0), Section::straight(9999.0, 1.0, 10.0));
        for sections in [vec![thin, thick], vec![thick, thin], vec![Section { length_mm: 30.0, ..thin }]] {
            let device = Device::new(sections).unwrap();
            for element_mm in [1e4, 3000.0, 1.0] {
                let mut mesh = Mesh::default();
                mesh.build(&device, device.length_mm(), Fineness::of_elements(element_mm), 1.0);
                let asked = Fineness::of_elements(element_mm).points(&device);
                let most = 2 * asked + MOST_POINTS + 2 * mesh.elements.len();
                assert!(mesh.points.len() <= most, "{} points, {element_mm} mm", mesh.points.len());
                // A section too short for an element of its own has the contact points of its neighbour.
                let all = element_mm > 1.0 || mesh.points.len() >= asked;
                assert!(all, "{} points, {element_mm} mm", mesh.points.len());
            }
        }
    }
}
