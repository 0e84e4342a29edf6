//! Contact forces of the wall on the nodes of a chain: ½ k p² per length, p the penetration of the surface.
//!
//! The wall is that of the scene, not of a method: all methods use the core's smooth distance and its extensions
//! beyond openings, like `kirchhoff`, and so have the same limit.

use endowire_core::Vec3;
use endowire_core::contact::ContactSurface;
use endowire_core::insertion::{Contact, Surroundings};

use crate::{NodalLoad, Push};

/// Distance beyond its radius over which a node seeks the wall, mm; results within it are reused.
const LOOK_MM: f64 = 3.0;
/// Motion of a node near the wall, as a fraction of its radius, after which its nearest piece is sought again.
const LOOK_AGAIN: f64 = 0.5;

/// Cached result of a node.
#[derive(Debug, Clone, Copy, Default)]
struct Known {
    asked_at: Vec3,
    /// Nearest piece of wall and its distance, mm.
    near: Option<(u32, f64)>,
    fresh: bool,
}

/// The wall as a load.
pub(crate) struct WallLoad<'a> {
    wall: &'a ContactSurface,
    known: Vec<Known>,
    radii: Vec<f64>,
    /// Stiffness of the wall for the length of device that a node represents, N/mm; including the tip's cap.
    stiffness: Vec<f64>,
}

impl<'a> WallLoad<'a> {
    pub(crate) fn new(
        wall: &'a ContactSurface,
        surroundings: &Surroundings<'_>,
        from_tip_mm: &[f64],
    ) -> Self {
        let n = from_tip_mm.len() - 1;
        let radii: Vec<f64> =
            from_tip_mm.iter().map(|s| surroundings.device.section_at(*s).radius_mm).collect();
        let stiffness = (0..=n)
            .map(|i| {
                let before = if i > 0 { from_tip_mm[i - 1] - from_tip_mm[i] } else { 0.0 };
                let after = if i < n { from_tip_mm[i] - from_tip_mm[i + 1] } else { 2.0 * radii[n] };
                0.5 * (before + after) * surroundings.properties.modulus_n_per_mm2
            })
            .collect();
        Self { wall, known: vec![Known::default(); n + 1], radii, stiffness }
    }

    /// Penetration of the surface at `x`, the wall's normal and its piece.
    fn depth(&mut self, node: usize, x: &Vec3) -> Option<(f64, Vec3, u32)> {
        let radius = self.radii[node];
        let known = &mut self.known[node];
        let moved = (x - known.asked_at).norm();
        // Clear of the wall by more than its motion, or moved so little that the same piece can be used.
        let clear = known.near.map_or(LOOK_MM, |(_, distance)| distance - 2.0 * radius);
        if !known.fresh || moved > clear.max(LOOK_AGAIN * radius) {
            let near = self.wall.nearest_piece(x, radius + LOOK_MM);
            *known = Known { asked_at: *x, near, fresh: true };
        }
        let (piece, flat) = known.near?;
        if flat - moved > 2.0 * radius {
            return None;
        }
        let distance = self.wall.distance(x, piece)?;
        let depth = radius - distance.value_mm;
        (depth > 0.0).then_some((depth, distance.gradient, piece))
    }

    /// The wall's energy in mJ and its contacts at the nodes of a chain.
    pub(crate) fn contacts(&mut self, positions_mm: &[Vec3], contacts: &mut Vec<Contact>) -> f64 {
        contacts.clear();
        let mut energy = 0.0;
        for node in 1..positions_mm.len() {
            let Some((depth, normal, triangle)) = self.depth(node, &positions_mm[node]) else { continue };
            energy += 0.5 * self.stiffness[node] * depth * depth;
            contacts.push(Contact {
                position_mm: positions_mm[node],
                normal,
                force_n: self.stiffness[node] * depth,
                friction_n: Vec3::zeros(),
                penetration_mm: depth,
                triangle,
            });
        }
        energy
    }
}

impl NodalLoad for WallLoad<'_> {
    fn on(&mut self, node: usize, x: &Vec3) -> Push {
        let Some((depth, normal, _)) = self.depth(node, x) else { return Push::default() };
        let stiffness_n_per_mm = self.stiffness[node];
        Push { force_n: normal * (stiffness_n_per_mm * depth), normal, stiffness_n_per_mm }
    }

    fn trusted_mm(&self) -> f64 {
        LOOK_AGAIN * self.radii[self.radii.len() - 1]
    }
}
