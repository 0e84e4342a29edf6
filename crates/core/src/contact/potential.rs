//! The energy of a wall that is pressed, per length of device.
//!
//! With d the distance of the device's axis from the wall, r its radius and p = r − d the depth to which its surface is
//! beyond the wall,
//!
//! ```text
//! ψ(d) = ½ k p²  for p > 0,  plus  −k (g − ĝ)² ln(g/ĝ)  for g = d − 0.3 r < ĝ = 0.3 r
//! ```
//!
//! The first term is a foundation of modulus k (N/mm²), soft or rigid. The second is the barrier of Li et al.,
//! *Incremental potential contact*, SIGGRAPH 2020: twice continuously differentiable, zero in any sensible state, and
//! infinite at three tenths of the radius, more than the smooth wall stands off the flat triangles. So a wall can be
//! too soft for a device, but its axis never crosses it.

/// Wall energy per length at one radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallPotential {
    /// Foundation modulus k, N/mm².
    pub modulus_n_per_mm2: f64,
    /// Outer radius r of the device, mm.
    pub radius_mm: f64,
}

/// Distance in radii at which the barrier is infinite, …
const FLOOR: f64 = 0.3;
/// … and how far above it the barrier begins.
const BARRIER: f64 = 0.3;

impl WallPotential {
    /// Depth of the surface beyond the wall, mm; 0 where it is clear of it.
    pub fn penetration_mm(&self, distance_mm: f64) -> f64 {
        (self.radius_mm - distance_mm).max(0.0)
    }

    /// ψ(d) in mJ/mm: infinite on and beyond the wall.
    pub fn value(&self, distance_mm: f64) -> f64 {
        let (k, d, r) = (self.modulus_n_per_mm2, distance_mm, self.radius_mm);
        if d >= r {
            return 0.0;
        }
        if !self.is_allowed(d) {
            return f64::INFINITY;
        }
        let spring = 0.5 * k * (r - d) * (r - d);
        let (gap, edge) = (d - FLOOR * r, BARRIER * r);
        if gap >= edge { spring } else { spring - k * (gap - edge) * (gap - edge) * (gap / edge).ln() }
    }

    /// Whether the energy is finite at this distance.
    pub fn is_allowed(&self, distance_mm: f64) -> bool {
        distance_mm > FLOOR * self.radius_mm
    }

    /// As [`WallPotential::derivatives`], with a spring that also pulls: what holds a point to a wall that it has come off.
    pub(super) fn holding(&self, distance_mm: f64) -> (f64, f64) {
        let (k, off_mm) = (self.modulus_n_per_mm2, distance_mm - self.radius_mm);
        if off_mm > 0.0 { (k * off_mm, k) } else { self.derivatives(distance_mm) }
    }

    /// ψ′(d) in N/mm and ψ″(d) in N/mm², at an allowed distance.
    pub fn derivatives(&self, distance_mm: f64) -> (f64, f64) {
        let (k, d, r) = (self.modulus_n_per_mm2, distance_mm, self.radius_mm);
        if d >= r {
            return (0.0, 0.0);
        }
        let (mut first, mut second) = (-k * (r - d), k);
        let (gap, edge) = (d - FLOOR * r, BARRIER * r);
        if gap < edge {
            let (short, log) = (gap - edge, (gap / edge).ln());
            first -= k * (2.0 * short * log + short * short / gap);
            second -= k * (2.0 * log + 4.0 * short / gap - short * short / (gap * gap));
        }
        (first, second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POTENTIAL: WallPotential = WallPotential { modulus_n_per_mm2: 3.0, radius_mm: 0.4 };

    #[test]
    fn derivatives_are_those_of_the_value() {
        for d in [0.125, 0.15, 0.23, 0.25, 0.3, 0.39, 0.5] {
            let h = 1e-6;
            let (plus, minus, here) = (POTENTIAL.value(d + h), POTENTIAL.value(d - h), POTENTIAL.value(d));
            let (first, second) = POTENTIAL.derivatives(d);
            assert!(((plus - minus) / (2.0 * h) - first).abs() < 1e-6 * (1.0 + first.abs()), "first at {d}");
            let curvature = (plus - 2.0 * here + minus) / (h * h);
            assert!((curvature - second).abs() < 1e-3 * (1.0 + second.abs()), "second at {d}");
        }
    }

    #[test]
    fn what_is_held_is_pulled_beyond_the_wall_and_pressed_as_ever() {
        let (first, second) = POTENTIAL.holding(0.45);
        assert!((first - 0.15).abs() < 1e-12 && second == 3.0);
        for d in [0.2, 0.3, 0.4] {
            assert_eq!(POTENTIAL.holding(d), if d < 0.4 { POTENTIAL.derivatives(d) } else { (0.0, 0.0) });
        }
    }

    #[test]
    fn the_force_is_continuous_where_terms_switch_on() {
        for switch in [0.24, 0.4] {
            let (below, above) = (POTENTIAL.derivatives(switch - 1e-9), POTENTIAL.derivatives(switch + 1e-9));
            assert!((below.0 - above.0).abs() < 1e-7, "at {switch}");
        }
    }

    #[test]
    fn the_axis_cannot_reach_the_wall() {
        assert!(
            POTENTIAL.value(0.12 + 1e-12) > POTENTIAL.value(0.13)
                && POTENTIAL.derivatives(0.12 + 1e-6).0 < -1e3
        );
        assert_eq!(POTENTIAL.value(0.12), f64::INFINITY);
    }
}
