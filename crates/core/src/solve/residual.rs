//! The size of a residual, and whether it is at the level of rounding.

use super::external::External;
use super::newton::Newton;
use crate::Vec3;
use crate::rod::{ElementData, Layout, RodState, Supports};

/// Size of a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ResidualSize {
    /// Largest unbalanced force or moment at a node, relative to the largest in the rod, its loads and supports.
    pub relative: f64,
    /// Whether every row is below its tolerance.
    pub small: bool,
    /// Whether every row is below its tolerance or its possible rounding error. Rows of short, stiff elements beside
    /// weak forces cannot become smaller; that the floor is reached shows only when steps cease to reduce the
    /// residual.
    pub rounding: bool,
}

impl<const C: usize> Newton<C> {
    /// The size of the residual of the assembled system.
    pub(crate) fn residual(
        &self,
        elements: &[ElementData],
        external: &dyn External,
        supports: &Supports,
        tolerance: f64,
    ) -> ResidualSize {
        let l = Layout::<C>;
        let n = elements.len();
        let length: f64 = elements.iter().map(|e| e.length).sum();
        let outside = external.sizes();
        let held = supports.multipliers;
        let mut force = self.assembly.scale[0].max(outside.force_n);
        force = held[..3].iter().fold(force, |m, v| m.max(v.abs()));
        let mut moment = self.assembly.scale[1].max(outside.moment_nmm);
        moment = held[3..].iter().fold(moment, |m, v| m.max(v.abs()));
        if Layout::<C>::ANGLES > 0 {
            // Coaxial instruments may balance large moments among themselves without any external force.
            moment = elements.iter().map(ElementData::mutual_moment).fold(moment, f64::max);
        }
        let mut relative = 0.0f64;
        let (mut small, mut rounding) = (true, true);
        let residual = &self.assembly.residual;
        let (forces, least) = (force + moment / length, f64::EPSILON / 1e-16);
        let mut before = 1.0 / (elements[0].length * elements[0].length);
        for i in 0..=n {
            let (a, b) = (&elements[i.saturating_sub(1)], &elements[i.min(n - 1)]);
            let after = if i < n { 1.0 / (b.length * b.length) } else { before };
            let h = a.length.min(b.length);
            let stiff = (a.bending[2] * before).max(b.bending[0] * after);
            before = after;
            let moments = moment + force * h;
            // Angles round like tangents.
            let twisted = (0..Layout::<C>::ANGLES)
                .map(|set| a.materials[set].torsion[2].max(b.materials[set].torsion[0]));
            let spun = twisted.fold(0.0, f64::max) / (h * h);
            // Rounding of unit vectors causes a force 12 EI/h² δ and a moment 6 EI/h δ.
            let floor = 100.0 * f64::EPSILON * stiff + outside.rounding_n;
            let mut rows = |value: f64, scale: f64, floor: f64| {
                small &= value <= tolerance * scale;
                rounding &= value <= tolerance * scale + floor;
                let r = if value <= 1e-3 * floor { 0.0 } else { value / (scale + floor / least) };
                relative = larger(relative, r);
            };
            let largest =
                |from: usize, to: usize| residual[from..to].iter().fold(0.0, |m, v| larger(m, v.abs()));
            rows(largest(l.position(i), l.position(i) + 3), forces, floor);
            let mut turning = largest(l.tangent(i), l.tangent(i) + 2);
            for set in 0..Layout::<C>::ANGLES {
                turning = larger(turning, residual[l.angle(i, set)].abs());
                if i < n {
                    turning = larger(turning, residual[l.bubble(i, set)].abs());
                }
            }
            rows(turning, moments, floor.max(100.0 * f64::EPSILON * spun) * h);
        }
        let first = l.support(n);
        for j in 0..6 {
            let scale = if j < 3 { length } else { 1.0 };
            let value = self.assembly.residual[first + j].abs() / scale;
            small &= value <= tolerance;
            rounding &= value <= tolerance;
            relative = larger(relative, value);
        }
        ResidualSize { relative, small, rounding }
    }

    /// Forces that the assembled system leaves unbalanced at free nodes, along the rod, N.
    ///
    /// A hand holds them too. By the envelope theorem a state off its equilibrium by a residual r has a push force off
    /// by r · dx/ds, and a rod that advances moves nearly along itself. A stiff rod along which little acts is an
    /// equilibrium within its tolerance before its axial force is known: all of its push force is here.
    pub(crate) fn unbalanced_along_n(&self, state: &RodState) -> f64 {
        let rows = |i: usize| &self.assembly.residual[Layout::<C>.position(i)..][..3];
        let along = (1..=state.elements()).map(|i| Vec3::from_column_slice(rows(i)).dot(&state.frames[i].t));
        along.sum()
    }
}

/// The larger of two non-negative numbers, or NaN if one is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}
