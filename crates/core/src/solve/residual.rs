//! How large a residual is, and when it is as small as it gets.

use super::newton::{External, Newton};
use crate::rod::{ElementData, Layout, Supports};

/// Size of a residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualSize {
    /// Largest force or moment left at a node over the largest in the rod, its loads and supports.
    pub relative: f64,
    /// Whether every row is below its tolerance.
    pub small: bool,
    /// Whether every row is below its tolerance or what rounding of the unknowns may leave in it. Rows of short, stiff elements
    /// beside weak forces get no smaller; whether one is as small as it gets shows only when steps cease to shrink it.
    pub rounding: bool,
}

impl<const C: usize> Newton<C> {
    /// How large the residual of the assembled system is.
    pub fn residual(
        &self,
        elements: &[ElementData],
        external: &dyn External<C>,
        supports: &Supports,
        tolerance: f64,
    ) -> ResidualSize {
        let l = Layout::<C>;
        let n = elements.len();
        let length: f64 = elements.iter().map(|e| e.length).sum();
        let outside = external.scale();
        let held = supports.multipliers;
        let mut force = self.assembly.scale[0].max(outside[0]);
        force = held[..3].iter().fold(force, |m, v| m.max(v.abs()));
        let mut moment = self.assembly.scale[1].max(outside[1]);
        moment = held[3..].iter().fold(moment, |m, v| m.max(v.abs()));
        let mut relative = 0.0f64;
        let (mut small, mut rounding) = (true, true);
        for i in 0..=n {
            let (a, b) = (&elements[i.saturating_sub(1)], &elements[i.min(n - 1)]);
            let h = a.length.min(b.length);
            let stiff = (a.bending[2] / (a.length * a.length)).max(b.bending[0] / (b.length * b.length));
            let forces = force + moment / length;
            let moments = moment + force * h;
            // What rounding of unit vectors leaves of a force 12 EI/h² δ and of a moment 6 EI/h δ.
            let floor = 100.0 * f64::EPSILON * stiff;
            let mut row = |value: f64, scale: f64, floor: f64| {
                let value = value.abs();
                small &= value <= tolerance * scale;
                rounding &= value <= tolerance * scale + floor;
                let r =
                    if value <= 1e-3 * floor { 0.0 } else { value / (scale + floor / f64::EPSILON * 1e-16) };
                relative = if r.is_nan() || relative.is_nan() { f64::NAN } else { relative.max(r) };
            };
            for k in 0..3 {
                row(self.assembly.residual[l.position(i) + k], forces, floor);
            }
            for k in 0..2 {
                row(self.assembly.residual[l.tangent(i) + k], moments, floor * h);
            }
            if Layout::<C>::TWIST {
                row(self.assembly.residual[l.angle(i)], moments, floor * h);
                if i < n {
                    row(self.assembly.residual[l.bubble(i)], moments, floor * h);
                }
            }
        }
        let first = l.support(n);
        for j in 0..6 {
            let scale = if j < 3 { length } else { 1.0 };
            let value = self.assembly.residual[first + j].abs() / scale;
            small &= value <= tolerance;
            rounding &= value <= tolerance;
            relative = if value.is_nan() || relative.is_nan() { f64::NAN } else { relative.max(value) };
        }
        ResidualSize { relative, small, rounding }
    }
}
