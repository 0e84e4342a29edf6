//! The trial state of a line search: its axial forces, its energy, and its correction to the end conditions.

use super::external::External;
use super::newton::Newton;
use crate::rod::{ElementData, Layout, RodState, Supports, stored_energy};

impl<const C: usize> Newton<C> {
    /// Undoes the substitution of the multiplier in [`crate::rod::assembly`]: dN = m/(1 − γD).
    pub(crate) fn restore_tensions(elements: &[ElementData], step: &mut [f64]) {
        for (e, data) in elements.iter().enumerate() {
            if data.flexibility > 0.0 {
                step[Layout::<C>.tension(e)] /= 1.0 - data.augmentation() * data.flexibility;
            }
        }
    }

    /// Potential energy of the trial state, minus the work done between `state` and it.
    pub(super) fn energy(
        &self,
        elements: &[ElementData],
        external: &mut dyn External,
        state: &RodState,
    ) -> f64 {
        let energy = stored_energy::<C>(elements, &self.trial) + external.value(elements, &self.trial);
        energy - external.work(state, &self.trial)
    }

    /// Second-order corrections of the end conditions with the current factorisation.
    pub(super) fn correct(&mut self, elements: &[ElementData], supports: &Supports, first: usize) {
        let mut last = f64::INFINITY;
        for _ in 0..self.tuning.corrections {
            let gaps = supports.gaps(&self.trial);
            let size = gaps.iter().fold(0.0f64, |m, g| m.max(g.abs()));
            if size.is_nan() || size >= last || size < 1e-14 {
                break;
            }
            last = size;
            self.spare.fill(0.0);
            for j in 0..6 {
                self.spare[first + j] = -gaps[j];
            }
            self.factor.solve(&mut self.spare);
            Self::restore_tensions(elements, &mut self.spare);
            self.other.copy_from(&self.trial);
            let (turn, _) = RodState::largest_turn::<C>(elements, &self.other, &self.spare);
            if turn.is_nan() || turn > self.tuning.correction_rad {
                break;
            }
            self.trial.advance::<C>(elements, &self.other, &self.spare, 1.0);
            let after = supports.gaps(&self.trial).iter().fold(0.0f64, |m, g| m.max(g.abs()));
            if after.is_nan() || after >= size {
                std::mem::swap(&mut self.trial, &mut self.other);
                break;
            }
        }
    }
}
