//! The rod's mesh on an inserted device: elements, their sections, and the points where the wall is felt.

use crate::contact::{ContactPoint, WallPotential};
use crate::device::Device;
use crate::rod::ElementData;
use crate::rod::quadrature::GAUSS;

/// Contact points lie no farther apart than this many radii of the device.
const SPACING_RADII: f64 = 2.0;
/// Fewest and most intervals between contact points in an element.
const INTERVALS: (f64, f64) = (2.0, 8.0);

/// Elements and contact points of an inserted length.
#[derive(Debug, Clone, Default)]
pub(super) struct Mesh {
    /// Arc length from the tip of every node, mm, sheath first.
    pub(super) from_tip_mm: Vec<f64>,
    /// Elements, sheath first.
    pub(super) elements: Vec<ElementData>,
    /// Contact points, tip first.
    pub(super) points: Vec<ContactPoint>,
}

impl Mesh {
    /// Meshes `inserted_mm` (above 0) of `device` with elements of `element_mm`.
    ///
    /// Nodes are marks on the device, at whole element lengths from the tip; the first element is between half and one
    /// and a half elements long, shorter only where that is all there is.
    pub(super) fn build(&mut self, device: &Device, inserted_mm: f64, element_mm: f64, modulus_n_per_mm2: f64) {
        crate::insertion::nodes_from_tip(inserted_mm, element_mm, &mut self.from_tip_mm);
        self.elements.clear();
        for ends in self.from_tip_mm.windows(2) {
            let length = ends[0] - ends[1];
            let section = |xi: f64| device.section_at(ends[0] - xi * length);
            let sample = GAUSS.map(|g| section(g.xi));
            self.elements.push(ElementData {
                length,
                bending: sample.map(|s| s.bending_stiffness_nmm2),
                torsion: sample.map(|s| s.torsion_nmm2()),
                rest_curvature: sample.map(|s| s.rest_curvature_per_mm),
                rest_twist: [0.0; 3],
                flexibility: 0.0,
            });
        }
        self.points.clear();
        let mut last_half = 0.0;
        for (e, data) in self.elements.iter().enumerate().rev() {
            let radius_mm = device.section_at(self.from_tip_mm[e + 1]).radius_mm;
            let intervals = (data.length / (SPACING_RADII * radius_mm)).ceil().clamp(INTERVALS.0, INTERVALS.1);
            let spacing = data.length / intervals;
            // The node at the element's far end is shared; the tip's has the cap instead of a neighbour.
            let beyond = if e + 1 == self.elements.len() { radius_mm } else { last_half };
            for j in (1..=intervals as usize).rev() {
                let at_end = j == intervals as usize;
                self.points.push(ContactPoint {
                    element: e,
                    xi: if at_end { 1.0 } else { j as f64 / intervals },
                    weight_mm: if at_end { 0.5 * spacing + beyond } else { spacing },
                    potential: WallPotential { modulus_n_per_mm2, radius_mm },
                });
            }
            last_half = 0.5 * spacing;
        }
    }
}
