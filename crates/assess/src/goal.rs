//! Goals of a subject: a tip at a place, or a sac packed with coils.

use endowire_core::error::in_range;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::subject::LARGEST;

/// The goal of a subject.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(try_from = "GoalFile", untagged)]
pub enum Goal {
    /// A tip at a place, as with `until` in a script line.
    Place(PlaceGoal),
    /// A sac that is packed.
    Packing(PackingGoal),
}

/// A tip at a place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceGoal {
    /// Name of a point on the vessel's centre line.
    pub target: String,
    /// Largest distance of the tip from it, mm.
    pub tip_within_mm: f64,
    /// Instrument whose tip counts; by default the foremost tip of all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// Contrast medium to inject there afterwards, ml; `None` for no injection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inject_ml: Option<f64>,
}

/// A sac that is packed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PackingGoal {
    /// Smallest volume of the coils in the sac over the volume of the sac.
    pub packing_density: f64,
}

/// The `goal` table as it is in the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GoalFile {
    target: Option<String>,
    tip_within_mm: Option<f64>,
    instrument: Option<String>,
    inject_ml: Option<f64>,
    packing_density: Option<f64>,
}

impl TryFrom<GoalFile> for Goal {
    type Error = String;

    fn try_from(file: GoalFile) -> std::result::Result<Self, String> {
        let GoalFile { target, tip_within_mm, instrument, inject_ml, packing_density } = file;
        let Some(packing_density) = packing_density else {
            return match (target, tip_within_mm) {
                (Some(target), Some(tip_within_mm)) => {
                    Ok(Self::Place(PlaceGoal { target, tip_within_mm, instrument, inject_ml }))
                }
                (Some(target), None) => {
                    Err(format!("tip_within_mm is missing: how near must the tip come to {target:?}?"))
                }
                (None, Some(mm)) => {
                    Err(format!("target is missing: of which point must the tip be within {mm} mm?"))
                }
                (None, None) => {
                    Err("what is to be reached? give target with tip_within_mm, or packing_density"
                        .to_owned())
                }
            };
        };
        let others = [
            ("target", target.is_some()),
            ("tip_within_mm", tip_within_mm.is_some()),
            ("instrument", instrument.is_some()),
            ("inject_ml", inject_ml.is_some()),
        ];
        match others.into_iter().find(|(_, given)| *given) {
            Some((other, _)) => Err(format!(
                "{other} does not go with packing_density = {packing_density}: a place or a sac is to be reached, keep one of the two"
            )),
            None => Ok(Self::Packing(PackingGoal { packing_density })),
        }
    }
}

impl Goal {
    /// Checks the values; `contrast_ml` limits the total volume of medium.
    pub(crate) fn check(&self, contrast_ml: Option<f64>) -> Result<()> {
        let goal = match self {
            Self::Packing(goal) => return in_range("goal.packing_density", goal.packing_density, 1.0),
            Self::Place(goal) => goal,
        };
        in_range("goal.tip_within_mm", goal.tip_within_mm, LARGEST)?;
        let Some(asked) = goal.inject_ml else { return Ok(()) };
        in_range("goal.inject_ml", asked, LARGEST)?;
        match contrast_ml {
            Some(most) if asked > most => {
                let remedy = format!("more than limits.contrast_ml = {most}: raise that, or ask for less");
                Err(Error::parameter("goal.inject_ml", asked, remedy))
            }
            _ => Ok(()),
        }
    }

    /// Name of the target point; `None` for a sac.
    pub fn target(&self) -> Option<&str> {
        match self {
            Self::Place(goal) => Some(&goal.target),
            Self::Packing(_) => None,
        }
    }
}
