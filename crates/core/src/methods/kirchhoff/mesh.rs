//! The rod's mesh on an inserted device: elements, their sections, and the points where the wall is felt.

use crate::contact::{ContactPoint, WallPotential};
use crate::device::Device;
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, Material};

/// Contact points lie no farther apart than this many radii of the device.
const SPACING_RADII: f64 = 2.0;
/// At the tip they begin this close, in radii, and double: a tip that touches the wall at an angle leaves it within a
/// tenth of its radius.
const TIP_SPACING_RADII: f64 = 1.0 / 256.0;
/// Fewest and most intervals between contact points in an element.
const INTERVALS: (f64, f64) = (2.0, 8.0);
/// No element has more contact points: at the tip of the thinnest device they double from 4·10⁻⁹ mm up to half of the longest element,
/// ten metres, 42 times at most.
pub(super) const MOST_POINTS: usize = 64;

/// Elements and contact points of an inserted length.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Arc length from the tip of every node, mm, sheath first.
    pub from_tip_mm: Vec<f64>,
    /// Elements, sheath first.
    pub elements: Vec<ElementData>,
    /// Contact points, tip first.
    pub points: Vec<ContactPoint>,
    /// Lengths inserted of several instruments; empty for a device alone.
    pub(super) inserted_mm: Vec<f64>,
}

impl Mesh {
    /// Nothing inserted: one node. Keeps the memory.
    pub(super) fn clear(&mut self) {
        self.from_tip_mm.clear();
        self.from_tip_mm.push(0.0);
        self.elements.clear();
        self.points.clear();
        self.inserted_mm.clear();
    }

    /// The node nearest to a place so far from the tip, mm.
    pub(super) fn nearest_node(&self, from_tip_mm: f64) -> usize {
        let off = |i: &usize| (self.from_tip_mm[*i] - from_tip_mm).abs();
        (0..self.from_tip_mm.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// Takes memory for up to `elements` elements and `points` contact points.
    pub(super) fn reserve(&mut self, elements: usize, points: usize) {
        self.from_tip_mm.reserve((elements + 1).saturating_sub(self.from_tip_mm.len()));
        self.elements.reserve(elements.saturating_sub(self.elements.len()));
        self.points.reserve(points.saturating_sub(self.points.len()));
    }

    /// Meshes `inserted_mm` (above 0) of `device` with elements of `element_mm`.
    ///
    /// Nodes are marks on the device, at whole element lengths from the tip; the first element is between half and one
    /// and a half elements long, shorter only where that is all there is.
    pub fn build(&mut self, device: &Device, inserted_mm: f64, element_mm: f64, modulus_n_per_mm2: f64) {
        self.build_points(device, inserted_mm, element_mm, modulus_n_per_mm2);
        // Only what one device needs is written: of elements that were here before the rest is empty.
        self.elements.resize(self.from_tip_mm.len() - 1, ElementData::EMPTY);
        for (ends, data) in self.from_tip_mm.windows(2).zip(&mut self.elements) {
            let length = ends[0] - ends[1];
            let section = |xi: f64| device.section_at(ends[0] - xi * length);
            let sample = GAUSS.map(|g| section(g.xi));
            let bending = sample.map(|s| s.bending_stiffness_nmm2);
            (data.length, data.bending) = (length, bending);
            data.materials[0] = Material {
                bending,
                torsion: sample.map(|s| s.torsion_nmm2()),
                rest_curvature: sample.map(|s| s.rest_curvature_per_mm),
                rest_twist: [0.0; 3],
            };
        }
    }

    /// Sets nodes and contact points as [`Mesh::build`] does, and leaves the elements alone.
    pub(super) fn build_points(
        &mut self,
        device: &Device,
        inserted_mm: f64,
        element_mm: f64,
        modulus_n_per_mm2: f64,
    ) {
        crate::insertion::nodes_from_tip(inserted_mm, element_mm, &mut self.from_tip_mm);
        self.points.clear();
        // Half of the interval beyond the point at hand; beyond the tip there is its cap.
        let mut half_beyond = device.section_at(0.0).radius_mm;
        let last = self.from_tip_mm.len() - 2;
        for (e, ends) in self.from_tip_mm.windows(2).enumerate().rev() {
            let length = ends[0] - ends[1];
            let radius_mm = device.section_at(ends[1]).radius_mm;
            let intervals = (length / (SPACING_RADII * radius_mm)).ceil().clamp(INTERVALS.0, INTERVALS.1);
            let spacing = length / intervals;
            // Distance from the element's far end.
            let mut at = 0.0;
            let mut fine = if e == last { TIP_SPACING_RADII * radius_mm } else { spacing };
            while at < (1.0 - 1e-9) * length {
                let left = length - at;
                let step = fine.min(spacing);
                // The intervals that are left are made equal where the fine ones end.
                let step =
                    if step >= spacing { left / (left / spacing - 1e-9).ceil() } else { step.min(left) };
                self.points.push(ContactPoint {
                    element: e,
                    xi: 1.0 - at / length,
                    instrument: 0,
                    set: 0,
                    from_tip_mm: ends[1] + at,
                    weight_mm: half_beyond + 0.5 * step,
                    potential: WallPotential { modulus_n_per_mm2, radius_mm },
                });
                half_beyond = 0.5 * step;
                at += step;
                fine *= 2.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Section;

    #[test]
    fn devices_of_mixed_scales_have_few_contact_points() {
        let (thin, thick) = (Section::straight(1.0, 1e-6, 10.0), Section::straight(9999.0, 1.0, 10.0));
        for sections in [vec![thin, thick], vec![thick, thin], vec![Section { length_mm: 1e4, ..thin }]] {
            let device = Device::new(sections).unwrap();
            for element_mm in [1e4, 3000.0, 1.0] {
                let mut mesh = Mesh::default();
                mesh.build(&device, device.length_mm(), element_mm, 1.0);
                let most = MOST_POINTS + 8 * mesh.elements.len();
                assert!(mesh.points.len() <= most, "{} points, {element_mm} mm", mesh.points.len());
                let first = mesh.points.iter().filter(|p| p.element + 1 == mesh.elements.len()).count();
                assert!(first <= MOST_POINTS, "{first} points in the first element, {element_mm} mm");
            }
        }
    }
}
