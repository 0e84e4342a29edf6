//! The centre line of an inserted device, as methods produce it and recorders and viewers read it.

use serde::{Deserialize, Serialize};

use crate::Vec3;

/// The inserted part of a device, from the sheath to the tip.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Shape {
    /// Node positions, sheath first, in millimetres.
    pub positions_mm: Vec<Vec3>,
    /// Tangents dx/ds at the nodes (unit length unless the method does not enforce it).
    pub tangents: Vec<Vec3>,
    /// Device arc length at each node, measured **from the tip** in millimetres: the last entry is 0.
    ///
    /// From the tip, because that names a point of the device whatever length is inserted.
    pub from_tip_mm: Vec<f64>,
}

impl Shape {
    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.positions_mm.len()
    }

    /// Whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.positions_mm.is_empty()
    }

    /// Takes memory for up to `nodes` nodes.
    pub(crate) fn reserve(&mut self, nodes: usize) {
        self.positions_mm.reserve(nodes.saturating_sub(self.positions_mm.len()));
        self.tangents.reserve(nodes.saturating_sub(self.tangents.len()));
        self.from_tip_mm.reserve(nodes.saturating_sub(self.from_tip_mm.len()));
    }

    /// The part up to the node nearest to a place so far from the tip, mm: that of an instrument which ends there.
    pub fn behind(&self, from_tip_mm: f64) -> Self {
        let off = |place: usize| (self.from_tip_mm[place] - from_tip_mm).abs();
        let Some(last) = (0..self.len()).min_by(|a, b| off(*a).total_cmp(&off(*b))) else {
            return Self::default();
        };
        let end_mm = self.from_tip_mm[last];
        Self {
            positions_mm: self.positions_mm[..=last].to_vec(),
            tangents: self.tangents[..=last].to_vec(),
            from_tip_mm: self.from_tip_mm[..=last].iter().map(|mm| mm - end_mm).collect(),
        }
    }

    /// Position of the tip, if anything is inserted.
    pub fn tip_mm(&self) -> Option<Vec3> {
        self.positions_mm.last().copied()
    }
}
