//! Drag on a piece of a thread.

use std::f64::consts::PI;

use super::FlowAt;
use crate::Vec3;

/// Largest ratio of a thread's radius to the lumen's; thicker threads are treated as this.
const THICKEST: f64 = 0.99;
/// Distance from the wall, in radii of the lumen, within which a thread counts as lying on it.
const NEXT_TO_WALL: f64 = 1e-6;

/// Drag per length on a thread along a tube, `offset_mm` off its axis, N/mm.
pub(crate) fn drag_n_per_mm(gradient_n_per_mm3: f64, radius_mm: f64, thread_mm: f64, offset_mm: f64) -> f64 {
    let (r, e) = (radius_mm, offset_mm);
    let a = thread_mm.min(THICKEST * r);
    let product = |sign: f64| (r + sign * e).powi(2) - a * a;
    let s = (product(-1.0) * product(1.0)).sqrt();
    let within = if e < r - a - NEXT_TO_WALL * a {
        s / ((r * r + a * a - e * e) / (2.0 * a * r)).acosh()
    } else {
        2.0 * a * r
    };
    0.5 * PI * gradient_n_per_mm3 * (within - 2.0 * a * a)
}

impl FlowAt {
    /// Drag per length on a thread of this radius with this unit tangent, N/mm.
    pub(crate) fn drag_n_per_mm(&self, thread_mm: f64, tangent: &Vec3) -> Vec3 {
        let along = drag_n_per_mm(self.gradient_n_per_mm3, self.radius_mm, thread_mm, self.offset_mm);
        (self.direction * 2.0 - tangent * self.direction.dot(tangent)) * along
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// The same drag by least squares of a series: u + G|x|²/4μ as harmonic functions of the tube and of the outside
    /// of the thread, whose logarithm carries the whole flux.
    fn by_series(r: f64, a: f64, e: f64) -> f64 {
        const TERMS: usize = 24;
        const PLACES: usize = 200;
        let mut matrix = DMatrix::zeros(2 * PLACES, 2 * TERMS + 2);
        let mut right = DVector::zeros(2 * PLACES);
        for k in 0..2 * PLACES {
            let angle = 2.0 * PI * (k / 2) as f64 / PLACES as f64;
            let (x, y) = match k % 2 {
                0 => (r * angle.cos(), r * angle.sin()),
                _ => (e + a * angle.cos(), a * angle.sin()),
            };
            let (outer, from) = ((x.hypot(y), y.atan2(x)), ((x - e).hypot(y), y.atan2(x - e)));
            matrix[(k, 0)] = 1.0;
            matrix[(k, 1)] = from.0.ln();
            for n in 1..=TERMS {
                let m = n as f64;
                matrix[(k, n + 1)] = (outer.0 / r).powf(m) * (m * outer.1).cos();
                matrix[(k, TERMS + n + 1)] = (a / from.0).powf(m) * (m * from.1).cos();
            }
            right[k] = 0.25 * (x * x + y * y);
        }
        let found = matrix.svd(true, true).solve(&right, 1e-14).unwrap();
        2.0 * PI * found[1].abs() - PI * a * a
    }

    #[test]
    fn drag_is_that_of_the_annulus_and_off_the_axis_that_of_a_series() {
        for (r, a) in [(5.0, 0.2), (2.0, 0.445), (1.0, 0.6)] {
            let annulus = 0.5 * PI * ((r * r - a * a) / f64::ln(r / a) - 2.0 * a * a);
            assert!((drag_n_per_mm(1.0, r, a, 0.0) / annulus - 1.0).abs() < 1e-12);
            for e in [0.0, 0.3, 0.6, 0.9].map(|part| part * (r - a)) {
                let (found, series) = (drag_n_per_mm(1.0, r, a, e), by_series(r, a, e));
                // Next to the wall the series converges slowly.
                assert!(
                    (found / series - 1.0).abs() < if e < 0.7 * (r - a) { 1e-6 } else { 2e-2 },
                    "{r} {a} {e}: {found} {series}"
                );
            }
            // On the wall it has the limit's value.
            let [on, near] = [1.0, 1.0 - 1e-5].map(|part| drag_n_per_mm(1.0, r, a, part * (r - a)));
            assert!(
                (on / (PI * a * (r - a)) - 1.0).abs() < 1e-12 && (near / on - 1.0).abs() < 1e-4,
                "{on} {near}"
            );
        }
    }

    #[test]
    fn across_the_flow_it_is_twice_that_along_it() {
        let at = FlowAt { direction: Vec3::z(), radius_mm: 3.0, offset_mm: 0.5, gradient_n_per_mm3: 1e-3 };
        let along = at.drag_n_per_mm(0.2, &-Vec3::z());
        let across = at.drag_n_per_mm(0.2, &Vec3::x());
        assert!((across - along * 2.0).norm() < 1e-15 && along.z > 0.0, "{along} {across}");
        // An oblique flow also pushes a thread sideways.
        let aslant = at.drag_n_per_mm(0.2, &Vec3::new(0.6, 0.0, 0.8));
        assert!(aslant.x < 0.0 && aslant.z > along.z);
    }
}
