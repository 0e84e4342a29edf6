//! The wall's push on the nodes of a chain: ½ k p² per length, p the depth of the surface beyond the wall.
//!
//! The wall is the scene's, not a method's: all methods feel core's smooth distance and its extensions beyond openings, the
//! same that `kirchhoff` feels, and so have the same limit.

use endowire_core::Vec3;
use endowire_core::contact::ContactSurface;
use endowire_core::insertion::{Contact, Surroundings};

use crate::{NodalLoad, Push};

/// How far beyond its radius a node looks for the wall, mm: what it sees it need not ask for again.
const LOOK_MM: f64 = 3.0;
/// A node near the wall looks for its nearest piece again when it has moved by this part of its radius.
const LOOK_AGAIN: f64 = 0.5;

/// What a node knows of the wall.
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
    /// Stiffness of the wall for the length of device that a node stands for, N/mm; the tip's cap included.
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

    /// Depth of the surface beyond the wall at `x`, the wall's normal and its piece.
    fn depth(&mut self, node: usize, x: &Vec3) -> Option<(f64, Vec3, u32)> {
        let radius = self.radii[node];
        let known = &mut self.known[node];
        let moved = (x - known.asked_at).norm();
        // Clear of the wall by more than it has moved, or so little moved that the same piece will do.
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
