//! What the forces at the end of a part have more than Newton's matrix there: U of [`super`].
//!
//! Friction on the wall follows from the place of a point by its normal force and normal, and by the spin of the device as it is measured
//! from the slid one.
//!
//! It also has a moment m about the device that is no derivative of an energy. Newton's matrix is that of unknowns from x: a tangent moves by
//! (a, b), its triad with it by the smallest rotation, angles are measured from there. Forces beside x are those of its unknowns there. When a
//! tangent has moved by a, and then by b, its triad is turned by ½ab against that of one smallest rotation to the same place, so the force in b
//! of an energy E is
//!
//! ```text
//! ∂E/∂b + H_ba a + ½ a ∂E/∂θ,    and that in a after a motion by b    ∂E/∂a + H_ab b − ½ b ∂E/∂θ
//! ```
//!
//! At an equilibrium ∂E/∂θ = −m at each node. Without friction it is nought.

use super::super::mesh::Mesh;
use super::remembered::{Between, Scatter, twisting};
use super::sparse::Sparse;
use crate::Vec3;
use crate::contact::PressingSlopes;
use crate::rod::Layout;
use crate::rod::quadrature::Point;

impl Between<'_> {
    /// Of the forces beyond those in Newton's matrix: of friction and of the wall that follow from the place of a point, and of friction
    /// by the spin of the device as it is measured from the slid one.
    pub(super) fn lagging<const C: usize>(&self, pressing: &[PressingSlopes]) -> Sparse {
        let l = Layout::<C>;
        let mut lagging = Sparse::default();
        for at in pressing {
            let (e, xi, _) = self.mesh.points[at.index].place();
            let scatter = Scatter::at::<C>(self.rod, self.mesh, at.index);
            let mut add = |column: usize, force: Vec3, moment: f64| {
                scatter.add((force, moment), |row, own| lagging.add(row, column, own));
            };
            for (column, way) in &scatter.columns {
                add(*column, at.lagging.0 * way, at.lagging.1.dot(way));
            }
            let Some(friction) = at.friction.filter(|_| !self.slid.is_empty()) else { continue };
            let [w0, w1, _] = Point::at(xi, 0.0).phi;
            for (node, weight) in [(e, w0), (e + 1, w1)] {
                let frame = &self.rod.frames[node];
                let by = twisting(&self.slid[node].t, &frame.t) * weight;
                for (axis, way) in [frame.u, frame.v].iter().enumerate() {
                    let spin = by.dot(way);
                    add(l.tangent(node) + axis, friction.by_spin.0 * spin, friction.by_spin.1 * spin);
                }
            }
        }
        lagging
    }
}

/// Adds what the moments of friction on the wall do where tangents move.
pub(super) fn add_moments<const C: usize>(mesh: &Mesh, pressing: &[PressingSlopes], lagging: &mut Sparse) {
    let l = Layout::<C>;
    if Layout::<C>::ANGLES == 0 {
        return;
    }
    for at in pressing {
        let (e, xi, _) = mesh.points[at.index].place();
        let [w0, w1, _] = Point::at(xi, 0.0).phi;
        for (node, weight) in [(e, w0), (e + 1, w1)] {
            let (a, half_nmm) = (l.tangent(node), 0.5 * weight * at.acts.friction.1);
            lagging.add(a + 1, a, -half_nmm);
            lagging.add(a, a + 1, half_nmm);
        }
    }
}
