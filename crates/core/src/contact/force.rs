//! The merit of a contact whose force is an unknown. Derived in [`super::wall`] (`wall/forces.rs`); walls and
//! self-contact pairs share it.

/// c: penalty ρ over the stiffness of the element. With a larger one points activate and release at smaller depths,
/// with a smaller one at smaller forces.
pub(super) const PENALTY: f64 = 0.1;

/// Merit of a point, mJ, its force, N, and derivative in ln κ, mJ.
pub(super) fn merit(kappa: f64, rho: f64, force_n: f64, depth_mm: f64) -> (f64, f64, f64) {
    let t = (force_n + rho * depth_mm).max(0.0);
    let by_force = t / (kappa + rho);
    let value_mj = 0.5 * (kappa * t * by_force - force_n * force_n) / rho;
    (value_mj, kappa * by_force, 0.5 * kappa * by_force * by_force)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merit_falls_by_its_force_and_is_the_walls_energy_where_it_is_stiff() {
        let (kappa, rho) = (30.0, 2.0);
        for (force_n, depth_mm) in [(0.0, 0.1), (0.5, 0.02), (0.5, -0.1), (0.5, -0.3), (0.0, -0.1)] {
            let h = 1e-6;
            let at = |by: f64| merit(kappa, rho, force_n, depth_mm + by).0;
            let stiffer = |by: f64| merit(kappa * by.exp(), rho, force_n, depth_mm).0;
            let slope = (at(h) - at(-h)) / (2.0 * h);
            let (_, exerted_n, by_modulus_mj) = merit(kappa, rho, force_n, depth_mm);
            assert!((slope - exerted_n).abs() < 1e-8, "{force_n} {depth_mm}");
            let slope = (stiffer(h) - stiffer(-h)) / (2.0 * h);
            assert!((slope - by_modulus_mj).abs() < 1e-8, "{force_n} {depth_mm}");
        }
        // At the depth f/κ the force is f, whatever the penalty.
        for rho in [0.1, 2.0, 1e4] {
            assert!((merit(kappa, rho, 0.6, 0.6 / kappa).1 - 0.6).abs() < 1e-12);
        }
        let depth_mm: f64 = 0.05;
        let stored_mj = 0.5 * kappa * depth_mm * depth_mm;
        assert!((merit(kappa, 1e9, 0.2, depth_mm).0 / stored_mj - 1.0).abs() < 1e-6);
        assert!(merit(kappa, rho, 0.2, depth_mm).0 < 0.5 * stored_mj);
    }
}
