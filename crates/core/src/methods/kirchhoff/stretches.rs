//! The nodes of a device: which ends of its sections, and which marks between them.
//!
//! A stretch is made of sections that follow each other and are alike; in it a device is meshed as if it were one
//! section. A device whose sections are cut in pieces has the same stretches, and a taper of many short sections needs
//! no node for each. Where stiffness, radius or rest curvature jumps a stretch ends, however short it is.

use super::material::is_same;
use super::mesh::Fineness;
use crate::device::{Device, Section};

/// Slack in numbers of elements, for rounding.
const ROUNDING: f64 = 1e-9;

/// A stretch of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stretch {
    /// Its beginning and end, from the device's tip, mm.
    begin_mm: f64,
    end_mm: f64,
    /// Largest rest curvature in it, 1/mm.
    curvature_per_mm: f64,
    /// Whether it is the last one of the device.
    is_last: bool,
}

impl Stretch {
    /// Length of its elements, mm, and their number. In the last stretch they have the requested length, or that at
    /// which its rest shape bends as much as allowed; their number is then not whole.
    fn pieces(&self, Fineness { element_mm, tuning, .. }: Fineness) -> (f64, f64) {
        let length_mm = self.end_mm - self.begin_mm;
        let turn_rad = tuning.largest_turn_rad;
        if self.is_last {
            let piece_mm = element_mm.min(turn_rad / self.curvature_per_mm);
            return (piece_mm, length_mm / piece_mm);
        }
        let bends = (length_mm * self.curvature_per_mm / turn_rad - ROUNDING).ceil();
        let count = (length_mm / element_mm).round().max(bends).max(1.0);
        (length_mm / count, count)
    }

    /// Whether its rest shape needs elements shorter than requested.
    fn is_bent(&self, Fineness { element_mm, tuning, .. }: Fineness) -> bool {
        self.curvature_per_mm * element_mm > tuning.largest_turn_rad
    }

    /// The marks in it, from the device's tip, mm.
    fn marks(self, fineness: Fineness) -> impl Iterator<Item = f64> {
        let (piece_mm, count) = self.pieces(fineness);
        let marks = (1..).map(move |k| (f64::from(k), self.begin_mm + f64::from(k) * piece_mm));
        marks.take_while(move |(k, _)| *k < count - ROUNDING).map(|(_, at)| at)
    }
}

/// What follows each other without a change.
fn are_equal(a: &Section, b: &Section) -> bool {
    is_same(a, b) && a.radius_mm == b.radius_mm
}

/// Whether no node is needed where one follows the other.
fn are_alike(a: &Section, b: &Section, Fineness { element_mm, tuning, .. }: Fineness) -> bool {
    let alike = |a: f64, b: f64| (a - b).abs() <= tuning.alike * a.max(b);
    let [u, v] = [0, 1].map(|axis| a.rest_curvature_per_mm[axis] - b.rest_curvature_per_mm[axis]);
    alike(a.bending_stiffness_nmm2, b.bending_stiffness_nmm2)
        && alike(a.torsion_nmm2(), b.torsion_nmm2())
        && alike(a.radius_mm, b.radius_mm)
        && libm::hypot(u, v) * element_mm <= tuning.alike_rad
        && a.steer == b.steer
        && a.soft_plane == b.soft_plane
}

/// The stretches of a device from its tip on.
///
/// Those of sections that are alike, but not equal, end where they are half an element long: long sections then have
/// nodes at their ends. A coil ends at a node, since it is detached there. Sections too short for a node of their own
/// belong to what follows.
fn stretches(device: &Device, fineness: Fineness) -> impl Iterator<Item = Stretch> {
    let mut left = device.sections().iter().peekable();
    let (mut begin_mm, mut end_mm) = (0.0, 0.0);
    std::iter::from_fn(move || {
        let mut first: Option<&Section> = None;
        let mut curvature_per_mm: f64 = 0.0;
        while let Some(section) = left.next() {
            end_mm += section.length_mm;
            // Nodes stay where they are while it is steered.
            curvature_per_mm = curvature_per_mm.max(device.most_bent_per_mm(section));
            let first_one = *first.get_or_insert(section);
            let Some(next) = left.peek() else { break };
            if device.is_coil_end(end_mm) {
                break;
            }
            let length_mm = end_mm - begin_mm;
            if are_equal(section, next) {
                continue;
            }
            if length_mm <= fineness.near_mm() {
                (first, curvature_per_mm) = (None, 0.0);
            } else if length_mm >= 0.5 * fineness.element_mm || !are_alike(first_one, next, fineness) {
                break;
            }
        }
        let is_last = left.peek().is_none();
        let stretch = Stretch { begin_mm, end_mm, curvature_per_mm, is_last };
        let is_one = end_mm > begin_mm;
        begin_mm = end_mm;
        is_one.then_some(stretch)
    })
}

/// Starts of the stretches of a device behind its tip, mm.
pub(super) fn stretch_ends(device: &Device, fineness: Fineness) -> impl Iterator<Item = f64> {
    stretches(device, fineness).filter(|stretch| !stretch.is_last).map(|stretch| stretch.end_mm)
}

/// The marks of a device where its rest shape needs elements shorter than requested, from its tip on, and the lengths
/// of these, mm.
pub(super) fn marks_in_bends(device: &Device, fineness: Fineness) -> impl Iterator<Item = (f64, f64)> {
    let bent = stretches(device, fineness).filter(move |stretch| stretch.is_bent(fineness));
    bent.flat_map(move |stretch| {
        let piece_mm = stretch.pieces(fineness).0;
        stretch.marks(fineness).map(move |at| (at, piece_mm))
    })
}

/// Writes the arc lengths from the tip of the nodes of `inserted_mm` (above 0) of `device`, sheath first, tip (0) last.
///
/// Nodes are marks on the device and enter with it: the ends of its stretches, and between them equally spaced marks
/// about one element apart; closer where the rest shape bends by more than `largest_turn_rad` in an element. In an
/// element that contained a jump of stiffness or rest curvature, energy would depend on where in it that is, and an
/// element too long for its shape stores energy where the device stores none: both would cause a spurious push force
/// on a hook as it comes in. The first element is at least half an element long where a mark enters, and may be as
/// short as [`Fineness::near_mm`] where the end of a stretch does.
pub(super) fn nodes_from_tip(
    device: &Device,
    inserted_mm: f64,
    fineness: Fineness,
    from_tip_mm: &mut Vec<f64>,
) {
    from_tip_mm.clear();
    from_tip_mm.push(0.0);
    for stretch in stretches(device, fineness) {
        let last_mm = inserted_mm - 0.5 * stretch.pieces(fineness).0;
        from_tip_mm.extend(stretch.marks(fineness).take_while(|at| *at <= last_mm));
        if stretch.is_last || stretch.end_mm >= inserted_mm - fineness.near_mm() {
            break;
        }
        from_tip_mm.push(stretch.end_mm);
    }
    from_tip_mm.push(inserted_mm);
    from_tip_mm.reverse();
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOOK: [f64; 2] = [1.0 / 3.0, 0.0];

    fn nodes(device: &Device, inserted_mm: f64, element_mm: f64) -> Vec<f64> {
        let mut nodes = Vec::new();
        nodes_from_tip(device, inserted_mm, Fineness::of_elements(element_mm), &mut nodes);
        nodes
    }

    fn ends(device: &Device, element_mm: f64) -> Vec<f64> {
        stretch_ends(device, Fineness::of_elements(element_mm)).collect()
    }

    #[test]
    fn jumps_are_nodes_and_elements_turn_little_in_their_rest_shape() {
        let wire = Section::straight(100.0, 0.4, 5.0);
        let hook = Section { length_mm: 7.0, rest_curvature_per_mm: HOOK, ..wire };
        let stiff = Section::straight(0.3, 0.4, 15.0);
        let device = Device::new(vec![hook, Section::straight(10.0, 0.4, 5.0), stiff, wire]).unwrap();
        let jumps = [7.0, 17.0, 17.3];
        for element_mm in [1.0, 2.0, 4.0] {
            let (near_mm, largest_rad) = (1e-3 * element_mm, 0.5);
            for k in 1..=400 {
                let inserted_mm = 0.1 * f64::from(k);
                let nodes = nodes(&device, inserted_mm, element_mm);
                assert_eq!((nodes[0], *nodes.last().unwrap()), (inserted_mm, 0.0));
                for end in jumps {
                    let is_node = nodes[1..].iter().any(|at| (at - end).abs() < 1e-12);
                    assert_eq!(is_node, inserted_mm > end + near_mm, "{inserted_mm}: {nodes:?}");
                }
                for (index, ends) in nodes.windows(2).enumerate() {
                    let length = ends[0] - ends[1];
                    assert!(length <= 1.5 * element_mm + 1e-9, "{inserted_mm}: {nodes:?}");
                    let is_stiff = (ends[1] - 17.0).abs() < 1e-12;
                    let short = index == 0 || is_stiff || length >= 0.5 * element_mm.min(1.5);
                    assert!(short, "{inserted_mm}: {nodes:?}");
                    assert!(ends[0] > 7.0 || length / 3.0 <= 1.5 * largest_rad, "{inserted_mm}: {nodes:?}");
                }
            }
        }
    }

    #[test]
    fn a_device_whose_sections_are_cut_has_the_same_nodes() {
        let tip = Section { rest_curvature_per_mm: [0.08, 0.0], ..Section::straight(18.0, 0.4, 3.0) };
        let shaft = Section::straight(182.0, 0.4, 15.0);
        let cut = |section: Section, count: usize| {
            let length_mm = section.length_mm / count as f64;
            std::iter::repeat_n(Section { length_mm, ..section }, count)
        };
        let whole = Device::new(vec![tip, shaft]).unwrap();
        for count in [2, 7, 45] {
            let pieces = Device::new(cut(tip, count).chain(cut(shaft, 13 * count)).collect()).unwrap();
            for k in 1..=40 {
                let inserted_mm = 1.7 * f64::from(k);
                let [a, b] = [&whole, &pieces].map(|device| nodes(device, inserted_mm, 4.0));
                assert_eq!(a.len(), b.len());
                assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_fine_taper_has_no_node_for_each_section_and_ends_at_one() {
        let tip = |k: u32| Section::straight(0.9, 0.3 + 0.005 * f64::from(k), 3.0);
        let sections = (0..20).map(tip).chain([Section::straight(182.0, 0.4, 15.0)]);
        let device = Device::new(sections.collect()).unwrap();
        let found = ends(&device, 4.0);
        assert_eq!(found.len(), 7, "{found:?}");
        assert!((found[6] - 18.0).abs() < 1e-12);
        // A steep one has more: none of its stretches changes by much.
        let tip = |k: u32| Section::straight(0.1, 0.3, 3.0 * 1.2f64.powi(k as i32));
        let steep = (0..20).map(tip).chain([Section::straight(182.0, 0.3, 150.0)]);
        assert!(ends(&Device::new(steep.collect()).unwrap(), 4.0).len() >= 9);
    }

    #[test]
    fn slivers_have_no_elements() {
        let wire = Section::straight(50.0, 0.4, 5.0);
        let sliver = Section { rest_curvature_per_mm: [1.0, 0.0], ..Section::straight(1e-3, 0.4, 50.0) };
        let device = Device::new(vec![sliver, wire, sliver, Section::straight(50.0, 0.4, 20.0)]).unwrap();
        let found = ends(&device, 4.0);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(nodes(&device, 40.0, 4.0).len(), 11);
    }

    #[test]
    fn marks_of_bends_are_those_of_the_device_alone() {
        let hook = Section { rest_curvature_per_mm: HOOK, ..Section::straight(7.0, 0.4, 5.0) };
        let device = Device::new(vec![hook, Section::straight(100.0, 0.4, 5.0)]).unwrap();
        let marks: Vec<(f64, f64)> = marks_in_bends(&device, Fineness::of_elements(4.0)).collect();
        let alone = nodes(&device, 30.0, 4.0);
        assert_eq!(marks.len(), 4);
        assert!(marks.iter().all(|(at, piece_mm)| alone.contains(at) && (piece_mm - 1.4).abs() < 1e-12));
        assert_eq!(marks_in_bends(&device, Fineness::of_elements(1.0)).count(), 0);
    }
}
