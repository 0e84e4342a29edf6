//! Positions of the nodes of an inserted device.

/// Writes the arc lengths from the tip of the nodes of `inserted_mm` of a device, sheath first, tip (0) last.
///
/// Nodes are marks on the device, at whole multiples of `element_mm` from the tip, and enter with it. Only the first
/// element has another length: between half and one and a half elements, so that no sliver arises while a device is
/// pushed by fractions of an element; it is shorter only if it is the only one. With nothing inserted there is one
/// node.
pub fn nodes_from_tip(inserted_mm: f64, element_mm: f64, from_tip_mm: &mut Vec<f64>) {
    let elements = if inserted_mm > 0.0 { ((inserted_mm / element_mm).round() as usize).max(1) } else { 0 };
    from_tip_mm.clear();
    from_tip_mm.push(inserted_mm);
    from_tip_mm.extend((0..elements).rev().map(|k| k as f64 * element_mm));
}
