//! C6: a wire drawn over the inner wall of a 180° bend, as over a capstan (Euler, Eytelwein).

use super::Row;
use super::insertion::Tube;

use endowire_core::insertion::WallProperties;
use endowire_core::shape::Frame;
use endowire_core::statics::{WallRod, WallRodSpec};
use endowire_core::{Result, Vec3};
use std::f64::consts::PI;

/// Lengths of the straight parts, radius of the bend, radius and clearance of the wire, mm.
pub(super) const STRAIGHT: f64 = 20.0;
pub(super) const BEND: f64 = 30.0;
pub(super) const RADIUS: f64 = 0.45;
pub(super) const PLAY: f64 = 0.5;
/// EI, N·mm², and pull at the far end, N: the wire conforms to the wall within a millimetre of touching it.
const BENDING: f64 = 10.0;
const PULL: f64 = 10.0;
/// Foundation modulus, N/mm²: rigid.
const MODULUS: f64 = 1e3;
/// Length by which the wire is drawn, mm.
const DRAWN: f64 = 0.01;

/// A practically rigid wall with this friction.
pub(super) fn rigid(friction: f64) -> WallProperties {
    WallProperties { modulus_n_per_mm2: MODULUS, friction, ..WallProperties::default() }
}

/// Ratio of the force at the clamp to that at the far end for a wire drawn out of the bend, and the angle between
/// them.
pub(super) fn drawn(properties: &WallProperties, edge_mm: f64) -> Result<(f64, f64)> {
    let tube = Tube {
        begin_mm: 1.0,
        straight_mm: STRAIGHT,
        bend_mm: BEND,
        turn: PI,
        end_mm: STRAIGHT,
        radius_mm: RADIUS + PLAY,
    };
    let wall = tube.wall(0.5, edge_mm)?;
    let length = 2.0 * STRAIGHT + PI * BEND - 5.0;
    let setup = WallRodSpec {
        length,
        bending: BENDING,
        radius: RADIUS,
        elements: length.round() as usize,
        modulus: properties.modulus_n_per_mm2,
    };
    let first = Frame::new(Vec3::x(), Some(Vec3::y()));
    let along = |s: f64| first.transported(((s - STRAIGHT) / BEND).clamp(0.0, PI), 0.0);
    let mut rod = WallRod::on_wall(&wall, properties, &setup, Vec3::zeros(), along)?;
    rod.tolerance = 1e-8;
    rod.loads.forces = vec![(rod.elements(), Vec3::x() * -PULL)];
    // First in equilibrium without friction, then drawn.
    rod.solve()?;
    rod.slide(properties.largest_friction(), -DRAWN)?;
    let clamp = rod.clamp();
    let force = clamp.force.norm();
    // The wire is pulled in the same direction at the clamp and at the tip: it has turned by 180° less the angle
    // between.
    let angle = PI - (clamp.force / force).dot(&-Vec3::x()).clamp(-1.0, 1.0).acos();
    Ok((force / PULL, angle))
}

pub(super) fn capstan() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for friction in [0.0, 0.1, 0.3] {
        let (ratio, angle) = drawn(&rigid(friction), 0.4)?;
        let name = format!("C6 capstan, μ={friction}");
        rows.push(Row::relative(&name, "ratio of forces", ratio, (friction * angle).exp(), 1e-2));
        rows.push(Row::relative(&name, "angle of wrap", angle, PI, 1e-2));
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_coefficient_is_seen() {
        let (ratio, angle) = drawn(&rigid(0.11), 0.4).unwrap();
        assert!(!Row::relative("", "", ratio, (0.1 * angle).exp(), 1e-2).pass, "{ratio}");
    }
}
