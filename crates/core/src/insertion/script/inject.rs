//! Contrast medium injected by a line of a script: recorded for rendering; forces do not depend on it.

use serde::{Deserialize, Serialize};

use super::motion::Lengths;
use crate::device::Stack;
use crate::{Error, Result};

/// Injection of contrast medium through an instrument, starting with the line; the line's hand does not wait for its
/// end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inject {
    /// Volume, 0.1 to 100 ml.
    pub ml: f64,
    /// Rate, 0.01 to 100 ml/s.
    pub ml_per_s: f64,
    /// Name of the instrument; the line's own if absent.
    pub through: Option<String>,
}

/// An injection that has started.
#[derive(Debug, Clone, PartialEq)]
pub struct Injection {
    /// Index of the instrument through which it flows.
    pub instrument: usize,
    /// Volume, ml.
    pub ml: f64,
    /// Rate, ml/s.
    pub ml_per_s: f64,
    /// Steps carried out before it.
    pub after_step: usize,
    /// Its start, s after the start of the script; `None` if the script has no speeds.
    pub time_s: Option<f64>,
}

/// [`Inject`] with its instrument looked up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Bolus {
    /// Its name in messages.
    name: String,
    pub(super) instrument: usize,
    pub(super) ml: f64,
    pub(super) ml_per_s: f64,
}

/// Smallest and largest volume, ml, and rate, ml/s.
const ML: [f64; 2] = [0.1, 100.0];
const ML_PER_S: [f64; 2] = [0.01, 100.0];
/// Longest injection, s. Those of angiography take seconds, of perfusion a minute; the flow of medium is computed in
/// steps of hundredths of a second.
const LONGEST_S: f64 = 200.0;

impl Bolus {
    /// `own` is the index of the line's instrument.
    ///
    /// # Errors
    /// Values out of range; with several instruments, one without a lumen.
    pub(super) fn new(name: String, inject: &Inject, own: usize, stack: &Stack) -> Result<Self> {
        for (key, value, [least, most]) in [("ml", inject.ml, ML), ("ml_per_s", inject.ml_per_s, ML_PER_S)] {
            if !(least..=most).contains(&value) {
                let remedy = format!("must be a number from {least} to {most}");
                return Err(Error::parameter(format!("{name}.{key}"), value, remedy));
            }
        }
        let duration_s = inject.ml / inject.ml_per_s;
        if duration_s > LONGEST_S {
            let remedy =
                format!("takes {duration_s} s with {} ml: at most {LONGEST_S} s are taken", inject.ml);
            return Err(Error::parameter(format!("{name}.ml_per_s"), inject.ml_per_s, remedy));
        }
        let through = format!("{name}.through");
        let instrument = match &inject.through {
            Some(other) => super::line::find(stack, other, &through)?,
            None => own,
        };
        let one = &stack.instruments()[instrument];
        // A single device contains no other instrument, so its lumen may be given for rendering only.
        if stack.is_several() && one.device.sections().iter().any(|s| s.inner_radius_mm.is_none()) {
            let remedy =
                "has no lumen: inject through another, or give inner_radius_mm in all of its sections";
            return Err(Error::parameter(through, format!("{:?}", one.name), remedy));
        }
        Ok(Self { name, instrument, ml: inject.ml, ml_per_s: inject.ml_per_s })
    }

    /// Rejects it if its instrument is not inserted.
    pub(super) fn check_in(&self, lengths: &Lengths) -> Result<()> {
        if lengths.now_mm[self.instrument] > 0.0 {
            return Ok(());
        }
        let remedy = "the instrument is not in when the line begins: advance it before";
        Err(Error::parameter(&self.name, format!("{} ml", self.ml), remedy))
    }
}
