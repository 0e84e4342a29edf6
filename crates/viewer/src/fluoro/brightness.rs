//! Automatic brightness control: the tube's output follows what the detector reads in the open field.
//!
//! The control holds the mean signal s of the pixels that show the body between the blades. When medium, a breath or a
//! device changes it, or the blades or the C-arm move, the output g goes to what brings it back, with the time constant
//! τ:
//!
//! ```text
//! ln g(t + Δt) = ln g* + (ln g(t) − ln g*) e^(−Δt/τ),    g* = G s₀/s
//! ```
//!
//! with the output G and the signal s₀ of the body at rest without medium, for which window and exposure are set. A
//! frame follows the readings of those before it, and the first one has the settled output. So a blade that comes in over
//! lungs leaves a picture that is too dark, and brightens.

use super::Signal;

/// State of the control of a plane: outputs of the tube, which another view of the same run goes on from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brightness {
    /// Logarithm of the output in the last frame, and of that which its reading asks for.
    ln_output: f64,
    ln_asked: f64,
    /// Time of that frame, s.
    time_s: f64,
}

/// The control of one view.
#[derive(Debug)]
pub(super) struct Control {
    /// Time constant, s; 0 holds the output.
    constant_s: f64,
    /// Pixels that are read.
    read: Vec<u32>,
    /// Mean signal of them at rest.
    at_rest: f64,
    /// Logarithm of the settled output.
    ln_settled: f64,
    state: Option<Brightness>,
}

impl Control {
    /// For a view with this kerma at the entrance, whose signal at rest is read at these pixels.
    pub(super) fn new(constant_s: f64, entrance_ngy: f64, shown: &[bool], at_rest: &Signal) -> Self {
        let read: Vec<u32> = (0..).zip(shown).filter(|(_, shown)| **shown).map(|(pixel, _)| pixel).collect();
        let at_rest = mean(&read, at_rest);
        let is_held = constant_s == 0.0 || read.is_empty() || at_rest <= 0.0;
        Self {
            constant_s: if is_held { 0.0 } else { constant_s },
            read,
            at_rest,
            ln_settled: libm::log(entrance_ngy / at_rest.max(f64::MIN_POSITIVE)),
            state: None,
        }
    }

    /// What it goes on from in another view; `None` before the first frame, and where it is held.
    pub(super) fn state(&self) -> Option<Brightness> {
        self.state
    }

    /// Goes on from another view of the same run.
    pub(super) fn go_on_from(&mut self, state: Brightness) {
        self.state = Some(state).filter(|_| self.constant_s > 0.0);
    }

    /// The output in the last frame over the settled one.
    pub(super) fn gain(&self) -> f64 {
        self.state.map_or(1.0, |state| libm::exp(state.ln_output - self.ln_settled))
    }

    /// Applies the output of a frame, `since_s` after the last one, to its signal.
    pub(super) fn expose(&mut self, signal: &mut Signal, since_s: f64, time_s: f64) {
        if self.constant_s == 0.0 {
            return;
        }
        let ln_output = self.state.map_or(self.ln_settled, |last| {
            last.ln_asked + (last.ln_output - last.ln_asked) * libm::exp(-since_s / self.constant_s)
        });
        let now = mean(&self.read, signal);
        let ln_asked = if now > 0.0 { self.ln_settled + libm::log(self.at_rest / now) } else { ln_output };
        self.state = Some(Brightness { ln_output, ln_asked, time_s });
        let gain = self.gain() as f32;
        signal.signal.iter_mut().chain(&mut signal.energy).for_each(|v| *v *= gain);
    }
}

impl Brightness {
    /// Time of the frame that it is of, s.
    pub(super) fn time_s(&self) -> f64 {
        self.time_s
    }
}

fn mean(read: &[u32], signal: &Signal) -> f64 {
    let sum: f64 = read.iter().map(|&pixel| f64::from(signal.signal[pixel as usize])).sum();
    sum / read.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(value: f32) -> Signal {
        Signal { signal: vec![value; 4], energy: vec![60.0 * value; 4] }
    }

    /// Outputs over the settled one at these times, of a signal that falls to half after the first frame.
    fn gains(constant_s: f64, times_s: &[f64]) -> Vec<f64> {
        let mut control = Control::new(constant_s, 5000.0, &[true, true, false, true], &even(2.0));
        let mut last_s = 0.0;
        let mut of = |(k, &time_s): (usize, &f64)| {
            let mut signal = even(if k == 0 { 2.0 } else { 1.0 });
            control.expose(&mut signal, time_s - last_s, time_s);
            last_s = time_s;
            assert!((signal.energy[2] / (60.0 * signal.signal[2]) - 1.0).abs() < 1e-6);
            control.gain()
        };
        times_s.iter().enumerate().map(&mut of).collect()
    }

    #[test]
    fn output_doubles_for_half_the_signal_with_its_time_constant_at_any_rate() {
        // Read first after a second: from then on.
        let of = gains(0.3, &[0.0, 1.0, 1.15, 1.3, 4.0]);
        assert!((of[0] - 1.0).abs() < 1e-12 && (of[1] - 1.0).abs() < 1e-12, "{of:?}");
        let expected = |t: f64| libm::exp(core::f64::consts::LN_2 * (1.0 - libm::exp(-t / 0.3)));
        for (k, since_s) in [(2, 0.15), (3, 0.3), (4, 3.0)] {
            assert!((of[k] - expected(since_s)).abs() < 1e-9, "{k}: {of:?}");
        }
        let often: Vec<f64> =
            std::iter::once(0.0).chain((0..=30).map(|k| 1.0 + 0.01 * f64::from(k))).collect();
        assert!((gains(0.3, &often).last().unwrap() - of[3]).abs() < 1e-9);
        // The twin: a control that is held, and a slower one.
        assert_eq!(gains(0.0, &[0.0, 1.0, 2.0]), [1.0; 3]);
        assert!(gains(3.0, &[0.0, 1.0, 1.3])[2] < 1.1);
    }

    #[test]
    fn another_view_begins_with_the_output_of_the_last() {
        let mut wide = Control::new(0.3, 5000.0, &[true; 4], &even(2.0));
        wide.expose(&mut even(2.0), 0.1, 0.0);
        // Blades leave the denser half: it is read as 1 of 2, so that it begins at half of what it settles at.
        let mut narrow = Control::new(0.3, 5000.0, &[true, true, false, false], &even(1.0));
        narrow.go_on_from(wide.state().unwrap());
        narrow.expose(&mut even(1.0), 0.1, 0.1);
        assert!((narrow.gain() - 0.5).abs() < 1e-12, "{}", narrow.gain());
        (0..100).for_each(|k| narrow.expose(&mut even(1.0), 0.1, 0.2 + 0.1 * f64::from(k)));
        assert!((narrow.gain() - 1.0).abs() < 1e-9);
        // The twin: the same view again.
        let mut same = Control::new(0.3, 5000.0, &[true; 4], &even(2.0));
        same.go_on_from(wide.state().unwrap());
        same.expose(&mut even(2.0), 0.1, 0.1);
        assert!((same.gain() - 1.0).abs() < 1e-12);
    }
}
