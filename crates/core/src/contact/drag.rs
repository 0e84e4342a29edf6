//! Drag of the flow on a device.
//!
//! Each contact point represents the length half-way to its neighbours, and carries the drag on it ([`crate::flow`]).
//! The forces are those at a state near the equilibrium, and dead during its solution, V = −Σ fᵢ·(xᵢ − x₀): they vary
//! with position in the lumen over millimetres, and are renewed when they have changed.

use super::{ContactPoint, MovedWall};
use crate::Vec3;
use crate::flow::{BloodFlow, FlowAt};
use crate::rod::{ElementData, PointSum, RodState, Stencils};

/// Drag at the contact points of a device.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drag {
    /// Force on each point, N.
    forces_n: Vec<Vec3>,
    /// The same forces summed by element, as derivatives of V.
    sums: Vec<(usize, PointSum)>,
    /// Sum of the magnitudes, N.
    size_n: f64,
}

impl Drag {
    /// Renews the forces at a state. Returns the sum of their changes over the sum of the forces, 0 without forces.
    pub(crate) fn renew(
        &mut self,
        flow: &BloodFlow,
        wall: MovedWall<'_>,
        points: &[ContactPoint],
        elements: &[ElementData],
        state: &RodState,
    ) -> f64 {
        self.forces_n.resize(points.len(), Vec3::zeros());
        // From the tip: element boundaries, and midpoints between contact points.
        let mut begins: Vec<f64> =
            elements.iter().rev().scan(0.0, |sum, e| Some(std::mem::replace(sum, *sum + e.length))).collect();
        let line_mm = elements.iter().map(|e| e.length).sum::<f64>();
        begins.reverse();
        let place = |p: &ContactPoint| begins[p.element] + (1.0 - p.xi) * elements[p.element].length;
        let (mut changed_n, mut last_mm) = (0.0, 0.0);
        let was_n = std::mem::take(&mut self.size_n);
        self.sums.clear();
        for (index, point) in points.iter().enumerate() {
            let next_mm = points.get(index + 1).map_or(line_mm, |next| 0.5 * (place(point) + place(next)));
            let length_mm = next_mm - last_mm;
            last_mm = next_mm;
            let (e, x) = (point.element, point.position(elements, state));
            let [from, to] = [e, e + 1].map(|node| state.frames[node].t);
            let tangent = from.lerp(&to, point.xi).normalize();
            let material = wall.material(&x);
            let drag = flow.at(&material).map_or_else(Vec3::zeros, |flow| {
                let flow = FlowAt { direction: wall.carried(&material, &flow.direction), ..flow };
                flow.drag_n_per_mm(point.potential.radius_mm, &tangent) * length_mm
            });
            changed_n += (drag - self.forces_n[index]).norm();
            self.size_n += drag.norm();
            self.forces_n[index] = drag;
            if self.sums.last().is_none_or(|(element, _)| *element != e) {
                self.sums.push((e, PointSum::default()));
            }
            if let Some((_, sum)) = self.sums.last_mut() {
                sum.add(point.xi, &-drag, None);
            }
        }
        let most_n = self.size_n.max(was_n);
        if most_n > 0.0 { changed_n / most_n } else { 0.0 }
    }

    /// Adds V and its derivatives.
    pub(crate) fn add(&self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
        into.add_value(self.value_mj(elements, state));
        for (e, sum) in &self.sums {
            into.add_points(state, &elements[*e], *e, sum);
        }
    }

    /// V, mJ.
    pub(crate) fn value_mj(&self, elements: &[ElementData], state: &RodState) -> f64 {
        self.sums.iter().map(|(e, sum)| sum.along(state, &elements[*e], *e)).sum()
    }

    /// Force on a contact point, N.
    pub(crate) fn force_n(&self, index: usize) -> Vec3 {
        self.forces_n.get(index).copied().unwrap_or_default()
    }

    /// Total force on the device, N.
    pub(crate) fn total_n(&self) -> Vec3 {
        self.forces_n.iter().sum()
    }

    /// Sum of the magnitudes of the forces, N.
    pub(crate) fn size_n(&self) -> f64 {
        self.size_n
    }
}
