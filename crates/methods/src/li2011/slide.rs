//! Step 2 of Algorithm 1: positions of the nodes of a new inserted length before the solve.
//!
//! "Translate each node by disp" can be read in two ways. **Free**, as printed: all nodes move by the same vector,
//! along the sheath. In a bend that pushes the wire sideways through the wall. **Unit**: every node moves by disp
//! along the wire's own curve, like a sliding wire; beyond the tip the curve continues straight. The tangents there
//! are the directions t̂ about which the solve keeps tangents of unit length ([`super::chain`]).

use endowire_core::Vec3;
use endowire_core::shape::Shape;
use serde::{Deserialize, Serialize};

/// Interpretation of tangents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TangentReading {
    /// Of unit length, on a wire that slides along its own curve.
    #[default]
    Unit,
    /// Of any length, on a wire that is moved along the sheath as a whole: as printed.
    Free,
}

/// Positions of the nodes at `from_tip_mm`, without the sheath's, after a push by `travel_mm`; and, for unit
/// tangents, their directions.
pub(super) fn translate(
    reading: TangentReading,
    shape: &Shape,
    from_tip_mm: &[f64],
    travel_mm: f64,
    (positions_mm, directions): (&mut Vec<Vec3>, &mut Vec<Vec3>),
) {
    positions_mm.clear();
    directions.clear();
    let mut element = 0;
    for &s in &from_tip_mm[1..] {
        match reading {
            TangentReading::Unit => {
                let (x, t) = on_curve(shape, s - travel_mm, &mut element);
                positions_mm.push(x);
                directions.push(t.normalize());
            }
            TangentReading::Free => {
                let (x, _) = on_curve(shape, s, &mut element);
                positions_mm.push(x + shape.tangents[0] * travel_mm);
            }
        }
    }
}

/// Position and tangent at arc length `s` from the tip on a chain with linear tangents; straight on beyond the tip, and straight back
/// in the sheath.
///
/// `element` is where the search starts, updated to where `s` was found: calls go from the sheath to the tip.
fn on_curve(shape: &Shape, s: f64, element: &mut usize) -> (Vec3, Vec3) {
    let (x, t, from_tip) = (&shape.positions_mm, &shape.tangents, &shape.from_tip_mm);
    let last = shape.len() - 1;
    if s >= from_tip[0] || last == 0 {
        return (x[0] - t[0] * (s - from_tip[0]), t[0]);
    }
    if s <= 0.0 {
        return (x[last] - t[last] * s, t[last]);
    }
    while *element + 1 < last && from_tip[*element + 1] > s {
        *element += 1;
    }
    let (a, b) = (*element, *element + 1);
    let h = from_tip[a] - from_tip[b];
    let along = from_tip[a] - s;
    let bend = (t[b] - t[a]) / h;
    (x[a] + t[a] * along + bend * (0.5 * along * along), t[a] + bend * along)
}
