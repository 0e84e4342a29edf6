//! Contact energy of the wall per length of device.
//!
//! With d the distance of the device's axis from the wall, negative beyond it, r the device's radius and p = r − d
//! the penetration of its surface,
//!
//! ```text
//! ψ(d) = ½ k p²  for p > 0
//! ```
//!
//! a foundation of modulus k (N/mm²), soft or rigid, whose deflection is not limited: a stiff device may sink into a
//! soft wall by many times its radius. The side of the wall it is on follows by continuity ([`super::wall`]), not
//! from the sign of d.

/// Wall energy per length at one radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WallPotential {
    /// Foundation modulus k, N/mm².
    pub modulus_n_per_mm2: f64,
    /// Outer radius r of the device, mm.
    pub radius_mm: f64,
}

impl WallPotential {
    /// Penetration of the surface, mm; 0 where it is clear of the wall.
    pub(crate) fn penetration_mm(&self, distance_mm: f64) -> f64 {
        (self.radius_mm - distance_mm).max(0.0)
    }

    /// ψ(d) in mJ/mm.
    pub(crate) fn value(&self, distance_mm: f64) -> f64 {
        let p = self.penetration_mm(distance_mm);
        0.5 * self.modulus_n_per_mm2 * p * p
    }

    /// As [`WallPotential::derivatives`], for a spring that also pulls and so holds a point that has left the wall.
    pub(super) fn holding(&self, distance_mm: f64) -> (f64, f64) {
        let k = self.modulus_n_per_mm2;
        (k * (distance_mm - self.radius_mm), k)
    }

    /// ψ′(d) in N/mm and ψ″(d) in N/mm².
    pub(crate) fn derivatives(&self, distance_mm: f64) -> (f64, f64) {
        if distance_mm >= self.radius_mm { (0.0, 0.0) } else { self.holding(distance_mm) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POTENTIAL: WallPotential = WallPotential { modulus_n_per_mm2: 3.0, radius_mm: 0.4 };

    #[test]
    fn derivatives_are_those_of_the_value() {
        for d in [-5.0, -0.1, 0.15, 0.3, 0.39, 0.5] {
            let h = 1e-6;
            let (plus, minus, here) = (POTENTIAL.value(d + h), POTENTIAL.value(d - h), POTENTIAL.value(d));
            let (first, second) = POTENTIAL.derivatives(d);
            assert!(((plus - minus) / (2.0 * h) - first).abs() < 1e-6 * (1.0 + first.abs()), "first at {d}");
            let curvature = (plus - 2.0 * here + minus) / (h * h);
            assert!((curvature - second).abs() < 1e-1 * (1.0 + second.abs()), "second at {d}");
        }
    }

    #[test]
    fn what_is_held_is_pulled_beyond_the_wall_and_pressed_as_ever() {
        let (first, second) = POTENTIAL.holding(0.45);
        assert!((first - 0.15).abs() < 1e-12 && second == 3.0);
        for d in [-0.2, 0.3, 0.4] {
            assert_eq!(POTENTIAL.holding(d).0, POTENTIAL.derivatives(d).0);
        }
    }
}
