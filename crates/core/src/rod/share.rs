//! The material of an instrument that covers part of an element, as weights of the element's Gauss points.

use super::element::Material;
use super::quadrature::GAUSS;

/// Shares below which a section only touches an element: such shares are the rounding of equal positions.
const ROUNDING: f64 = 1e-9;

/// Weights of the Gauss points in the integral over a part of an element, as multiples of their weights over all of
/// it.
pub(crate) fn shares(from: f64, to: f64) -> [f64; 3] {
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

/// A moment: the stiffness B = EI + (p c; c q) of a cross-section times a curvature along d₁ and d₂.
pub(crate) fn times((bending, [p, q, c]): (f64, [f64; 3]), [u, v]: [f64; 2]) -> [f64; 2] {
    [bending * u + (p * u + c * v), bending * v + (c * u + q * v)]
}

/// The curvature along d₁ and d₂ that a moment bends such a cross-section to.
pub(super) fn bent_by((bending, [p, q, c]): (f64, [f64; 3]), [m, n]: [f64; 2]) -> [f64; 2] {
    let (first, second) = (bending + p, bending + q);
    let determinant = first * second - c * c;
    [(second * m - c * n) / determinant, (first * n - c * m) / determinant]
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
            if self.skew[k] == [0.0; 3] && part.skew[k] == [0.0; 3] {
                for a in 0..2 {
                    let moment =
                        self.bending[k] * self.rest_curvature[k][a] + bending * part.rest_curvature[k][a];
                    self.rest_curvature[k][a] = moment / all_bending;
                }
            } else {
                let skew = part.skew[k].map(|skew| shares[k] * skew);
                let own = times((self.bending[k], self.skew[k]), self.rest_curvature[k]);
                let added = times((bending, skew), part.rest_curvature[k]);
                self.skew[k] = [0, 1, 2].map(|a| self.skew[k][a] + skew[a]);
                let moment = [0, 1].map(|axis| own[axis] + added[axis]);
                self.rest_curvature[k] = bent_by((all_bending, self.skew[k]), moment);
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
    fn skew_sections_share_an_element_by_their_moments() {
        let one = Material {
            bending: [3.0; 3],
            skew: [[1.0, 0.5, -0.5]; 3],
            torsion: [1.5; 3],
            rest_curvature: [[0.1, 0.2]; 3],
            ..Material::NONE
        };
        let other = Material { skew: [[0.2, 2.0, 0.25]; 3], rest_curvature: [[-0.3, 0.0]; 3], ..one };
        let mut sum = Material::NONE;
        sum.add_share(&one, &shares(0.0, 0.4));
        sum.add_share(&other, &shares(0.4, 1.0));
        for k in 0..3 {
            let (p, q) = (shares(0.0, 0.4)[k], shares(0.4, 1.0)[k]);
            let whole = times((sum.bending[k], sum.skew[k]), sum.rest_curvature[k]);
            for a in 0..2 {
                assert!((sum.skew[k][a] - p * one.skew[k][a] - q * other.skew[k][a]).abs() < 1e-12);
                let parts = [(p, &one), (q, &other)].map(|(share, part)| {
                    share * times((part.bending[k], part.skew[k]), part.rest_curvature[k])[a]
                });
                assert!((whole[a] - parts[0] - parts[1]).abs() < 1e-12);
            }
        }
        // Alike ones are one.
        let mut halves = Material::NONE;
        halves.add_share(&one, &shares(0.0, 0.5));
        halves.add_share(&one, &shares(0.5, 1.0));
        for k in 0..3 {
            assert!((0..2).all(|a| (halves.rest_curvature[k][a] - one.rest_curvature[k][a]).abs() < 1e-12));
        }
    }

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
