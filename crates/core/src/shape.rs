//! The centre line of an inserted device: output of methods, input of recorders and viewers.

use serde::{Deserialize, Serialize};

pub use crate::rod::Frame;

use crate::Vec3;
use crate::rod::quadrature::hermite;

/// The inserted part of a device, from the sheath to the tip.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Shape {
    /// Node positions, sheath first, in millimetres.
    pub positions_mm: Vec<Vec3>,
    /// Tangents dx/ds at the nodes (unit length unless the method does not enforce it).
    pub tangents: Vec<Vec3>,
    /// Device arc length at each node, measured **from the tip** in millimetres: the last entry is 0.
    ///
    /// An arc length from the tip names the same point of the device whatever length is inserted.
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

    /// Largest angle between the directions at two neighbouring nodes, rad: by how much an element bends.
    pub fn largest_turn_rad(&self) -> f64 {
        largest_turn_rad(self.tangents.iter().copied())
    }

    /// Allocates for up to `nodes` nodes.
    pub(crate) fn reserve(&mut self, nodes: usize) {
        self.positions_mm.reserve(nodes.saturating_sub(self.positions_mm.len()));
        self.tangents.reserve(nodes.saturating_sub(self.tangents.len()));
        self.from_tip_mm.reserve(nodes.saturating_sub(self.from_tip_mm.len()));
    }

    /// The point of the centre line at an arc length from the tip, mm: on the cubic through positions and tangents of
    /// the adjacent nodes. Beyond either end, that end; `None` if there is no node.
    pub fn position_at(&self, from_tip_mm: f64) -> Option<Vec3> {
        let tip = self.tip_mm()?;
        // Lengths from the tip decrease along the nodes: those before `after` are farther from the tip.
        let after = self.from_tip_mm.partition_point(|s| *s > from_tip_mm);
        if after == 0 {
            return self.positions_mm.first().copied();
        }
        let Some(end_mm) = self.from_tip_mm.get(after) else { return Some(tip) };
        let before = after - 1;
        let h = self.from_tip_mm[before] - end_mm;
        let [w0, s0, w1, s1] = hermite((self.from_tip_mm[before] - from_tip_mm) / h);
        let (x, t) = (&self.positions_mm, &self.tangents);
        Some(x[before] * w0 + x[after] * w1 + (t[before] * s0 + t[after] * s1) * h)
    }

    /// The part from the sheath to the node nearest to this arc length from the tip, mm: that of an instrument which
    /// ends there.
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

/// Largest angle between unit vectors that follow each other, rad.
pub(crate) fn largest_turn_rad(mut tangents: impl Iterator<Item = Vec3>) -> f64 {
    let Some(mut last) = tangents.next() else { return 0.0 };
    let turns = tangents.map(|next| {
        let last = std::mem::replace(&mut last, next);
        // Exact for small angles too, where the cosine is not.
        libm::atan2(last.cross(&next).norm(), last.dot(&next))
    });
    turns.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_between_nodes_lie_on_the_curve() {
        // Two arcs of a circle of radius 10 mm; the cubic stays within h⁴κ³/384 of an arc.
        let node = |angle: f64| Vec3::new(10.0 * angle.sin(), 0.0, 10.0 - 10.0 * angle.cos());
        let angles = [0.0, 0.2, 0.4];
        let shape = Shape {
            positions_mm: angles.map(node).to_vec(),
            tangents: angles.map(|a: f64| Vec3::new(a.cos(), 0.0, a.sin())).to_vec(),
            from_tip_mm: vec![4.0, 2.0, 0.0],
        };
        for (from_tip_mm, angle) in [(4.0, 0.0), (3.0, 0.1), (2.0, 0.2), (0.5, 0.35), (0.0, 0.4)] {
            let off = (shape.position_at(from_tip_mm).unwrap() - node(angle)).norm();
            assert!(off < 1e-4, "{from_tip_mm}: {off}");
        }
        assert_eq!(shape.position_at(9.0), Some(node(0.0)));
        assert_eq!(shape.position_at(-1.0), shape.tip_mm());
        assert_eq!(Shape::default().position_at(1.0), None);
    }
}
