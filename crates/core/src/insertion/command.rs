//! What the hand does: advance, retract and rotate, alone or together.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// One input of the hand.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Command {
    /// Length pushed in, mm; negative pulls back.
    pub advance_mm: f64,
    /// Turn of the tail about its axis, rad; positive is right-handed about the direction of insertion.
    pub rotate_rad: f64,
}

impl Command {
    /// Pushes in by `mm`.
    pub fn advance(mm: f64) -> Self {
        Self { advance_mm: mm, rotate_rad: 0.0 }
    }

    /// Pulls back by `mm`.
    pub fn retract(mm: f64) -> Self {
        Self::advance(-mm)
    }

    /// Turns the tail by `rad`.
    pub fn rotate(rad: f64) -> Self {
        Self { advance_mm: 0.0, rotate_rad: rad }
    }
}

/// What the hand of one of several instruments does.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Move {
    /// Number of the instrument, the innermost being 0 ([`Stack::find`](crate::device::Stack::find) has it by name).
    pub instrument: usize,
    /// Its motion.
    pub command: Command,
}

/// One line of a script: a motion and the increments it is cut into.
///
/// `advance_mm` or `retract_mm`, with or without `rotate_deg`; given together they happen together.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScriptLine {
    /// Length to push in, mm.
    pub advance_mm: Option<f64>,
    /// Length to pull back, mm.
    pub retract_mm: Option<f64>,
    /// Turn of the tail, degrees, of either sign.
    pub rotate_deg: Option<f64>,
    /// Largest increment of length, mm; 1 if absent.
    pub step_mm: Option<f64>,
    /// Largest increment of turn, degrees; 5 if absent.
    pub step_deg: Option<f64>,
}

/// Most steps of one script: at one kilohertz, over 2 hours of manipulation.
const STEP_LIMIT: f64 = 1e7;

impl ScriptLine {
    /// Signed travel in mm and turn in rad of the whole line.
    fn travel(&self, name: &str) -> Result<(f64, f64)> {
        let positive = |field: &str, value: Option<f64>| match value {
            Some(v) if !(v.is_finite() && v >= 0.0) => Err(Error::parameter(
                format!("{name}.{field}"),
                v,
                "must be a number of 0 or more; the direction is in the key (advance_mm, retract_mm)",
            )),
            _ => Ok(value),
        };
        let advance = positive("advance_mm", self.advance_mm)?;
        let retract = positive("retract_mm", self.retract_mm)?;
        let rotate = self.rotate_deg.unwrap_or(0.0);
        if !rotate.is_finite() {
            return Err(Error::parameter(format!("{name}.rotate_deg"), rotate, "must be a finite number"));
        }
        let mm = match (advance, retract) {
            (Some(a), Some(_)) => {
                return Err(Error::parameter(
                    format!("{name}.advance_mm"),
                    a,
                    "a line either advances or retracts: split it in two",
                ));
            }
            (a, r) => a.unwrap_or(0.0) - r.unwrap_or(0.0),
        };
        if advance.is_none() && retract.is_none() && self.rotate_deg.is_none() {
            return Err(Error::parameter(name, "{}", "give advance_mm, retract_mm or rotate_deg"));
        }
        Ok((mm, rotate.to_radians()))
    }

    /// Number of equal increments of the line.
    pub(super) fn increments(&self, name: &str) -> Result<usize> {
        let (mm, rad) = self.travel(name)?;
        let mut count: f64 = 1.0;
        for (field, step, travel) in [
            ("step_mm", self.step_mm.unwrap_or(1.0), mm.abs()),
            ("step_deg", self.step_deg.unwrap_or(5.0), rad.to_degrees().abs()),
        ] {
            if !(step.is_finite() && step > 0.0) {
                return Err(Error::parameter(format!("{name}.{field}"), step, "must be a number above 0"));
            }
            // The tolerance keeps 0.3 mm in steps of 0.1 mm at three increments, not four.
            count = count.max((travel / step - 1e-9).ceil());
        }
        if count > STEP_LIMIT {
            return Err(Error::parameter(
                name,
                format!("{} steps", crate::error::number(count)),
                format!("at most {STEP_LIMIT} steps in a line: use larger increments"),
            ));
        }
        Ok(count as usize)
    }
}

/// The commands of a script, in order.
///
/// # Errors
/// Names the line and key that is not finite, contradictory or absurd.
pub fn commands(script: &[ScriptLine]) -> Result<Vec<Command>> {
    let mut list = Vec::new();
    for (index, line) in script.iter().enumerate() {
        let name = format!("script[{index}]");
        let (mm, rad) = line.travel(&name)?;
        let count = line.increments(&name)?;
        let share = 1.0 / count as f64;
        list.extend(std::iter::repeat_n(Command { advance_mm: mm * share, rotate_rad: rad * share }, count));
        if list.len() as f64 > STEP_LIMIT {
            return Err(Error::parameter("script", list.len(), format!("at most {STEP_LIMIT} steps in all")));
        }
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advance(mm: f64, step: f64) -> ScriptLine {
        ScriptLine { advance_mm: Some(mm), step_mm: Some(step), ..Default::default() }
    }

    #[test]
    fn a_line_is_cut_into_equal_increments_no_larger_than_its_step() {
        let list = commands(&[advance(0.3, 0.1)]).unwrap();
        assert_eq!(list.len(), 3);
        assert!((list.iter().map(|c| c.advance_mm).sum::<f64>() - 0.3).abs() < 1e-15);
        assert_eq!(commands(&[advance(1.05, 0.5)]).unwrap().len(), 3);
    }

    #[test]
    fn turning_and_pushing_in_one_line_happen_together() {
        let line = ScriptLine {
            retract_mm: Some(4.0),
            rotate_deg: Some(90.0),
            step_mm: Some(1.0),
            step_deg: Some(10.0),
            ..Default::default()
        };
        let list = commands(&[line]).unwrap();
        assert_eq!(list.len(), 9);
        assert!(list.iter().all(|c| c.advance_mm < 0.0 && c.rotate_rad > 0.0));
    }

    #[test]
    fn a_bad_line_is_named_with_its_key() {
        for (line, key) in [
            (advance(-1.0, 1.0), "script[1].advance_mm = -1"),
            (advance(f64::NAN, 1.0), "script[1].advance_mm = NaN"),
            (advance(1.0, 0.0), "script[1].step_mm = 0"),
            (advance(1e9, 1e-9), "script[1]"),
            (ScriptLine::default(), "script[1]"),
            (ScriptLine { retract_mm: Some(1.0), ..advance(1.0, 1.0) }, "script[1].advance_mm = 1"),
        ] {
            let message = commands(&[advance(1.0, 1.0), line]).unwrap_err().to_string();
            assert!(message.starts_with(key), "{message}");
        }
    }
}
