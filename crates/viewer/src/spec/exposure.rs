//! `[view.exposure]`: exposure control.

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use super::finite_within;

/// Largest number of points of a curve.
const MOST_POINTS: usize = 100;

/// The `[view.exposure]` table: voltage and current follow the patient. Without it the voltage is `xray.kvp`, and the
/// current is whatever gives the wanted dose.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExposureSpec {
    /// Voltages by thickness: pairs of soft tissue in mm, ascending, 0 to 1000, and kV, 50 to 125; linear in between
    /// and constant beyond. At most 100.
    pub curve: Vec<[f64; 2]>,
    /// Smallest and largest tube current, 0.01 to 5000.
    pub current_ma: [f64; 2],
}

impl Default for ExposureSpec {
    fn default() -> Self {
        Self {
            curve: vec![
                [100.0, 60.0],
                [160.0, 70.0],
                [220.0, 80.0],
                [280.0, 95.0],
                [340.0, 115.0],
                [380.0, 125.0],
            ],
            current_ma: [1.0, 1000.0],
        }
    }
}

impl ExposureSpec {
    pub(super) fn validate(&self) -> Result<()> {
        let refuse =
            |value: String, remedy: &str| Err(Error::parameter("view.exposure.curve", value, remedy));
        if !(1..=MOST_POINTS).contains(&self.curve.len()) {
            return refuse(
                format!("{} pairs", self.curve.len()),
                "give 1 to 100 pairs of [thickness in mm, kV]",
            );
        }
        for [thickness_mm, kvp] in &self.curve {
            finite_within("view.exposure.curve (thickness)", *thickness_mm, [0.0, 1000.0])?;
            finite_within("view.exposure.curve (kV)", *kvp, [50.0, 125.0])?;
        }
        if let Some(pair) = self.curve.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            let remedy = "thicknesses must rise from pair to pair";
            return refuse(format!("{:?}, {:?}", pair[0], pair[1]), remedy);
        }
        let [least, most] = self.current_ma;
        for current in self.current_ma {
            finite_within("view.exposure.current_ma", current, [0.01, 5000.0])?;
        }
        if least > most {
            let remedy = "the least current must not be above the largest";
            return Err(Error::parameter("view.exposure.current_ma", format!("[{least}, {most}]"), remedy));
        }
        Ok(())
    }
}
