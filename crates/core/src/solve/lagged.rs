//! What is lagged follows a step: the matrix that is not symmetric answered with the one that is.
//!
//! Friction is assembled with normal forces that do not change within a step. The symmetric matrix K then leaves out the part U by which
//! they do change with the state ([`External::follow`]), and what a step leaves of the residual r is of first order,
//!
//! ```text
//! r(x + δ) = r + (K + U) δ + O(δ²) = U δ,    K δ = −r
//! ```
//!
//! Each round solves with the factors at hand for what the step before left,
//!
//! ```text
//! K δₖ₊₁ = −(r + U δₖ),    δ₀ = −K⁻¹ r
//! ```
//!
//! which is Richardson's iteration on the whole matrix with K as its preconditioner (Y. Saad, *Iterative Methods for Sparse Linear
//! Systems*, 2nd ed., section 4.1): with ρ the spectral radius of K⁻¹U, a tenth on walls softer than the rod, a step leaves ρᵏ⁺¹ of the error in
//! place of ρ. A round costs a solution with factors, a twentieth of the iteration that it spares.

use super::contacts::moved;
use super::newton::{Newton, Problem};
use crate::rod::RodState;

/// Rounds of a step. A third one spares nothing: what is left then is of second order in the step.
const ROUNDS: usize = 2;
/// Part of what the step without them lowers the energy by, to first order, that the one with them must.
const DESCENT: f64 = 0.5;

impl<const C: usize> Newton<C> {
    /// Lets what is lagged follow the step from the assembled state, which the factors at hand have answered. Where that is not nearly as steep a
    /// descent, as where normal forces run away with friction, the step is left as it is.
    pub(super) fn follow_step(&mut self, problem: &mut Problem<'_>, state: &RodState) {
        let Problem { elements, supports, external, .. } = problem;
        self.before.copy_from_slice(&self.step);
        let mut followed = false;
        for _ in 0..ROUNDS {
            let step = &self.step;
            let follows = self.assembly.beside(&mut self.spare, |into| {
                external.follow(elements, state, &moved::<C>(elements, state, step), into)
            });
            if !follows {
                break;
            }
            followed = true;
            self.spare.iter_mut().for_each(|r| *r = -*r);
            supports.held::<C>().into_iter().flatten().for_each(|row| self.spare[row] = 0.0);
            self.factor.solve(&mut self.spare);
            for ((step, more), before) in self.step.iter_mut().zip(&self.spare).zip(&self.before) {
                *step = before + more;
            }
        }
        let slope = |step: &[f64]| self.assembly.slope(step);
        if followed && slope(&self.step) > DESCENT * slope(&self.before) {
            self.step.copy_from_slice(&self.before);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use crate::Vec3;
    use crate::rod::{ElementData, Frame, PLAIN, RodState, Stencils, Supports};
    use crate::solve::{External, Moved, Newton, NewtonOptions};

    const ELEMENTS: usize = 20;
    /// 3EI/L³ of a rod of 20 mm and 10 N·mm², N/mm.
    const STIFFNESS: f64 = 3.0 * 10.0 / 8000.0;

    /// A force across the tip that grows with its deflection, by a part of what the rod answers with, and is renewed where a state is
    /// linearised.
    struct Growing {
        lagged_n: f64,
        follows: bool,
    }

    impl Growing {
        const RATE: f64 = 0.3 * STIFFNESS;
    }

    impl External for Growing {
        fn linearise(&mut self, elements: &[ElementData], state: &RodState, into: &mut dyn Stencils) {
            self.lagged_n = 0.002 + Self::RATE * state.positions[ELEMENTS].x;
            into.add_node(ELEMENTS, &(Vec3::x() * -self.lagged_n), &Matrix3::zeros());
            into.add_value(self.value(elements, state));
        }
        fn value(&mut self, _elements: &[ElementData], state: &RodState) -> f64 {
            -self.lagged_n * state.positions[ELEMENTS].x
        }
        fn follow(
            &mut self,
            _elements: &[ElementData],
            _base: &RodState,
            moved: &Moved<'_>,
            into: &mut dyn Stencils,
        ) -> bool {
            let (way, _) = moved((ELEMENTS - 1, 1.0, 0));
            into.add_node(ELEMENTS, &(Vec3::x() * (-Self::RATE * way.x)), &Matrix3::zeros());
            self.follows
        }
        fn is_lagged(&self) -> bool {
            true
        }
    }

    /// Iterations to where the force is that of the deflection, and that, mm.
    fn bent(follows: bool) -> (usize, f64) {
        let elements = vec![ElementData::plain(1.0, 10.0); ELEMENTS];
        let mut state = RodState::straight(&elements, Vec3::zeros(), Frame::new(Vec3::z(), None));
        let mut supports = Supports { start_tangent: true, ..Supports::default() };
        let mut newton = Newton::<PLAIN>::new(ELEMENTS);
        let mut force = Growing { lagged_n: 0.0, follows };
        let options = NewtonOptions::default();
        let report = newton.solve(&elements, &mut supports, &mut force, &mut state, &options);
        assert!(report.converged && report.stable, "{}", report.reason);
        (report.iterations, state.positions[ELEMENTS].x)
    }

    #[test]
    fn what_follows_a_step_is_found_in_fewer() {
        let ((few, with_mm), (many, without_mm)) = (bent(true), bent(false));
        assert!((with_mm - without_mm).abs() < 1e-7, "{with_mm} and {without_mm}");
        // 0.002 N / (3EI/L³ − rate), but for the arc.
        assert!((with_mm - 0.002 / (0.7 * STIFFNESS)).abs() < 0.01, "{with_mm}");
        assert!(few <= 8 && many > 2 * few, "{few} iterations, {many} where nothing follows");
    }
}
