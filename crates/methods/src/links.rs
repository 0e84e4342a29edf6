//! Segments of fixed length, shared by [`rigid_links`](crate::rigid_links) and [`chord_energy`](crate::chord_energy).

use endowire_core::Vec3;

use crate::{Chain, NodalLoad, Posture, Push};

/// A chain as the directions of its segments.
pub(crate) struct Links {
    /// Unit vectors, the first after the clamp.
    pub(crate) directions: Vec<Vec3>,
    /// Loads on the ends of the segments.
    pub(crate) pushes: Vec<Push>,
    /// Allowed imbalance of torque on a segment, N·mm.
    pub(crate) allowed: f64,
}

impl Links {
    /// The directions of a posture. `tolerance` is as in [`RodModel::relax`](crate::RodModel::relax).
    pub(crate) fn new(chain: &Chain, posture: &Posture, tolerance: f64) -> Self {
        let n = chain.segments();
        Self {
            directions: (0..n).map(|i| posture.chord(i).normalize()).collect(),
            pushes: vec![Push::default(); n],
            allowed: tolerance * chain.force_unit() * chain.length_mm() / n as f64,
        }
    }

    /// Computes the nodes from the directions, and their loads.
    pub(crate) fn place(&mut self, chain: &Chain, load: &mut dyn NodalLoad, posture: &mut Posture) {
        let mut x = chain.start_mm;
        for (i, d) in self.directions.iter().enumerate() {
            x += d * chain.lengths_mm[i];
            posture.positions_mm[i + 1] = x;
            self.pushes[i] = load.on(i + 1, &x);
        }
    }
}
