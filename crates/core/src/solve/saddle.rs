//! Descent from an equilibrium that is not a minimum, along its most negative curvature as long as the energy
//! decreases.

use super::external::External;
use super::newton::{ENERGY_ROUNDING, Newton};
use super::report::StepRecord;
use crate::rod::{ElementData, Layout, RodState, Supports};

impl<const C: usize> Newton<C> {
    /// Replaces the step by the direction of most negative curvature: inverse iteration with the shifted factor.
    pub(super) fn negative_curvature(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        state: &RodState,
    ) {
        let l = Layout::<C>;
        let n = elements.len();
        let first = l.support(n);
        self.step.fill(0.0);
        // The initial vector must not be orthogonal to any mode: both directions across, no symmetry along the rod.
        for i in 0..=n {
            let s = (i as f64 + 0.37) / (n as f64 + 1.0);
            let frame = &state.frames[i];
            let w = frame.local(&crate::Vec3::new(0.31 + s, 0.83 - 0.6 * s * s, 0.29 + 0.4 * s));
            self.step[l.tangent(i)] = w.y;
            self.step[l.tangent(i) + 1] = w.z;
        }
        for _ in 0..self.tuning.saddle_iterations {
            self.spare.fill(0.0);
            for i in 0..=n {
                let h = elements[i.min(n - 1)].length;
                for a in 0..2 {
                    let row = l.tangent(i) + a;
                    self.spare[row] = h * self.step[row];
                }
                for row in (0..Layout::<C>::ANGLES).map(|set| l.angle(i, set)) {
                    self.spare[row] = h * self.step[row];
                }
            }
            for row in supports.held::<C>().into_iter().flatten() {
                self.spare[row] = 0.0;
            }
            self.factor.solve(&mut self.spare);
            let size = self.spare[..first].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let scale = if size > 0.0 { 1.0 / size } else { 1.0 };
            for (s, v) in self.step.iter_mut().zip(&self.spare) {
                *s = v * scale;
            }
        }
        for value in &mut self.step[first..] {
            *value = 0.0;
        }
    }

    /// Moves along the negative curvature in `self.step` as long as the energy decreases.
    pub(super) fn leave(
        &mut self,
        elements: &[ElementData],
        supports: &mut Supports,
        external: &mut dyn External,
        state: &mut RodState,
    ) -> Option<StepRecord> {
        let l = Layout::<C>;
        let first = l.support(elements.len());
        let (turn, twist) = RodState::largest_turn::<C>(elements, state, &self.step);
        let unit = self.tuning.saddle_rad / turn.max(twist).max(1e-300);
        let before = self.assembly.energy.total() + self.assembly.external_energy;
        let scale = self.assembly.energy.total().abs() + self.assembly.external_energy.abs();
        let mut alpha = unit;
        for _ in 0..self.tuning.saddle_halvings {
            for sign in [1.0, -1.0] {
                self.trial.advance::<C>(elements, state, &self.step, sign * alpha);
                if supports.conditions() > 0 {
                    self.correct(elements, supports, first);
                }
                let energy_change = self.energy(elements, external, state) - before;
                // Reactions times errors of the conditions: energy gained by violating the supports does not count as
                // descent.
                let opened: f64 = supports
                    .gaps(&self.trial)
                    .iter()
                    .zip(&supports.multipliers)
                    .map(|(gap, multiplier)| 2.0 * (gap * multiplier).abs())
                    .sum();
                let change = energy_change + opened;
                if change < -ENERGY_ROUNDING * scale {
                    self.trial.tensions.copy_from_slice(&state.tensions);
                    std::mem::swap(state, &mut self.trial);
                    supports.follow(state);
                    return Some(StepRecord {
                        energy_change,
                        merit_change: change,
                        energy_scale: scale,
                        residual: 0.0,
                        fraction: sign * alpha / unit,
                        shift: 0.0,
                    });
                }
            }
            alpha *= 0.5;
        }
        None
    }
}
