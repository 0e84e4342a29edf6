//! C6: a wire drawn over the inner wall of a 180° bend, as over a capstan (Euler, Eytelwein).

use super::Row;
use super::channel::Outside;
use super::insertion::Tube;
use crate::contact::{FeltWall, Friction, HandMotion, WallContact, WallMemory};
use crate::device::Device;
use crate::insertion::WallProperties;
use crate::methods::kirchhoff::mesh::Mesh;
use crate::rod::{Clamp, Frame, PLAIN, RodState, Supports};
use crate::solve::{Newton, NewtonOptions};
use crate::statics::Loads;
use crate::{Error, Result, Vec3};
use std::f64::consts::PI;

/// Straight parts and radius of the bend, radius and play of the wire, mm.
pub(super) const STRAIGHT: f64 = 20.0;
pub(super) const BEND: f64 = 30.0;
pub(super) const RADIUS: f64 = 0.45;
pub(super) const PLAY: f64 = 0.5;
/// EI, N·mm², and pull at the far end, N: a wire that bends where it meets the wall within a millimetre.
const BENDING: f64 = 10.0;
const PULL: f64 = 10.0;
/// Foundation modulus, N/mm²: rigid.
const MODULUS: f64 = 1e3;
/// Length by which the wire is drawn, mm.
const DRAWN: f64 = 0.01;

/// A rigid wall of this friction.
pub(super) fn rigid(friction: f64) -> WallProperties {
    WallProperties { modulus_n_per_mm2: MODULUS, friction, ..WallProperties::default() }
}

/// Ratio of the force at the clamp to that at the far end of a wire that is drawn out of the bend, and the angle between them.
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
    let mut mesh = Mesh::default();
    let device = Device::uniform(length, RADIUS, BENDING)?;
    let felt = FeltWall::new(&wall, &device, properties)?;
    mesh.build(&device, length, 1.0, properties.modulus_n_per_mm2);
    let first = Frame::new(Vec3::x(), Some(Vec3::y()));
    let along = |from_tip: &f64| ((length - from_tip - STRAIGHT) / BEND).clamp(0.0, PI);
    let frames = mesh.from_tip_mm.iter().map(|s| first.transported(along(s), 0.0)).collect();
    let mut state = RodState::from_frames(&mesh.elements, Vec3::zeros(), frames);
    let mut supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
    let mut loads = Loads { forces: vec![(mesh.elements.len(), Vec3::x() * -PULL)], ..Loads::default() };
    let mut newton = Newton::<PLAIN>::new(mesh.elements.len());
    let mut known = WallMemory::default();
    // First at rest without friction, on walls that become harder; then drawn.
    let (mut none, mut rubbing) = (Friction::default(), Friction::new(properties.largest_friction()));
    for (softness, moves) in [(1e-3, false), (1e-2, false), (0.1, false), (1.0, false), (1.0, true)] {
        let force = if moves { &mut rubbing } else { &mut none };
        if moves {
            let hand = HandMotion { from_mm: length, to_mm: length - DRAWN, turn_rad: 0.0 };
            force.begin(&mesh.elements, &state, &mesh.points, (&[], &Friction::default()), hand);
        }
        let mut contact = WallContact::new(&felt, &mesh.points, &mut known, force, BENDING, true);
        contact.softness = softness;
        let mut outside = Outside { contact, loads: &mut loads, plates: 0.0 };
        for renewal in 0.. {
            let options = NewtonOptions { tolerance: 1e-8, ..NewtonOptions::default() };
            let found = newton.solve(&mesh.elements, &mut supports, &mut outside, &mut state, &options);
            if !found.converged || renewal > 100 {
                return Err(Error::Computation(format!(
                    "capstan: {} ({:.1e})",
                    found.reason, found.residual
                )));
            }
            if !moves || outside.contact.friction_settled() {
                break;
            }
        }
    }
    let clamp = Clamp::new::<PLAIN>(&newton.start_residual, &state);
    let force = clamp.force.norm();
    // The wire is pulled one way at the clamp and the same way at the tip: it has turned by 180° less the angle between.
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
