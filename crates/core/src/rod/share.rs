//! The material of an instrument that covers part of an element, as weights of the element's Gauss points.

use super::element::Material;
use super::quadrature::GAUSS;

/// Shares below which a section only touches an element: such shares are the rounding of equal positions.
const ROUNDING: f64 = 1e-9;

/// Weights of the Gauss points in the integral over a part of an element, as multiples of their weights over all of
/// it.
pub fn shares(from: f64, to: f64) -> [f64; 3] {
    let power = |n: i32| (to.powi(n) - from.powi(n)) / f64::from(n);
    let [a, b, c] = GAUSS.map(|point| point.xi);
    // ∫ (ξ − p)(ξ − q) over the part.
    let product = |p: f64, q: f64| power(3) - (p + q) * power(2) + p * q * power(1);
    [
        product(b, c) / ((a - b) * (a - c) * GAUSS[0].weight),
        product(a, c) / ((b - a) * (b - c) * GAUSS[1].weight),
        product(a, b) / ((c - a) * (c - b) * GAUSS[2].weight),
    ]
}

impl Material {
    /// Adds a share of a section to the instrument's material in this element; rest states are averaged, weighted by
    /// stiffness.
    pub(crate) fn add_share(&mut self, part: &Self, shares: &[f64; 3]) {
        // A mean weighted by zero stiffness would not be a number.
        if shares.iter().all(|share| share.abs() < ROUNDING) {
            return;
        }
        for k in 0..3 {
            let (bending, torsion) = (shares[k] * part.bending[k], shares[k] * part.torsion[k]);
            let (all_bending, all_torsion) = (self.bending[k] + bending, self.torsion[k] + torsion);
            for a in 0..2 {
                let moment =
                    self.bending[k] * self.rest_curvature[k][a] + bending * part.rest_curvature[k][a];
                self.rest_curvature[k][a] = moment / all_bending;
            }
            self.rest_twist[k] =
                (self.torsion[k] * self.rest_twist[k] + torsion * part.rest_twist[k]) / all_torsion;
            (self.bending[k], self.torsion[k]) = (all_bending, all_torsion);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_that_only_touches_an_element_leaves_its_material_as_it_is() {
        let straight = Material { bending: [2.0; 3], torsion: [1.5; 3], ..Material::NONE };
        let bent = Material { rest_curvature: [[0.1, 0.0]; 3], ..straight };
        for from in [0.0, 0.3, 1.0] {
            let mut sum = Material::NONE;
            sum.add_share(&bent, &shares(from, from + 1e-17));
            sum.add_share(&straight, &shares(0.0, 1.0));
            assert!(sum.rest_curvature.iter().flatten().all(|curvature| *curvature == 0.0));
            assert!(sum.bending.iter().all(|bending| (bending - 2.0).abs() < 1e-12));
        }
        // A section in half of the element counts by half.
        let mut sum = Material::NONE;
        sum.add_share(&bent, &shares(0.0, 0.5));
        sum.add_share(&straight, &shares(0.5, 1.0));
        let mean: f64 = (0..3).map(|k| GAUSS[k].weight * sum.bending[k] * sum.rest_curvature[k][0]).sum();
        assert!((mean - 0.5 * 2.0 * 0.1).abs() < 1e-12, "{mean}");
    }
}
