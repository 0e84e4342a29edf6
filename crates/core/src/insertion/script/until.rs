//! Conditions that end a line of a script early.

use serde::{Deserialize, Serialize};

use crate::error::in_range;
use crate::insertion::Simulation;
use crate::vessel::CentrelineTree;
use crate::{Error, Result, Vec3};

/// Ends a line as soon as one of these holds; evaluated before each of its steps, and after the last.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Until {
    /// Distance of the instrument's tip from the target, mm, or less.
    pub tip_within_mm: Option<f64>,
    /// Name of a point of the vessel's centre line.
    pub target: Option<String>,
    /// Push force of the hand of the line's instrument, N, or more.
    pub push_force_n: Option<f64>,
}

/// The condition that has ended a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Met {
    /// The tip is near the target.
    TipWithinMm,
    /// The push force has been reached.
    PushForceN,
}

/// [`Until`] with its target looked up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Condition {
    /// The instrument to which it refers.
    pub instrument: usize,
    /// Target and distance, mm.
    pub near: Option<(Vec3, f64)>,
    /// The smallest push force, N.
    pub push_force_n: Option<f64>,
}

/// Largest distance, mm, and force, N, accepted.
const LARGEST: f64 = 1e6;

impl Condition {
    /// # Errors
    /// Values out of range, a distance without a target or vice versa, an unknown target.
    pub(super) fn new(
        name: &str,
        until: &Until,
        instrument: usize,
        centreline: Option<&CentrelineTree>,
    ) -> Result<Self> {
        let near = match (until.tip_within_mm, &until.target) {
            (Some(mm), Some(target)) => {
                in_range(&format!("{name}.tip_within_mm"), mm, LARGEST)?;
                Some((place(&format!("{name}.target"), target, centreline)?, mm))
            }
            (Some(mm), None) => {
                let remedy = "of which target? give target, a name of the vessel's centre line";
                return Err(Error::parameter(format!("{name}.tip_within_mm"), mm, remedy));
            }
            (None, Some(target)) => {
                let remedy = "how near to it? give tip_within_mm";
                return Err(Error::parameter(format!("{name}.target"), format!("{target:?}"), remedy));
            }
            (None, None) => None,
        };
        if let Some(force) = until.push_force_n {
            in_range(&format!("{name}.push_force_n"), force, LARGEST)?;
        } else if near.is_none() {
            return Err(Error::parameter(name, "{}", "give tip_within_mm with target, or push_force_n"));
        }
        Ok(Self { instrument, near, push_force_n: until.push_force_n })
    }

    /// The part of it that holds, if any.
    pub(super) fn met(&self, simulation: &Simulation) -> Option<Met> {
        let report = simulation.report();
        let tip = || simulation.tip_of_mm(self.instrument);
        // A target moves with the vessel.
        let now = |target: Vec3| {
            simulation.displacement().map_or(target, |displacement| displacement.place(&target))
        };
        if self.near.is_some_and(|(target, mm)| tip().is_some_and(|tip| (tip - now(target)).norm() <= mm)) {
            return Some(Met::TipWithinMm);
        }
        let push_n = report.hand(self.instrument).push_force_n;
        let pushed = |least: f64| push_n.is_some_and(|push_n| push_n >= least);
        self.push_force_n.is_some_and(pushed).then_some(Met::PushForceN)
    }
}

/// Position of a target.
fn place(key: &str, target: &str, centreline: Option<&CentrelineTree>) -> Result<Vec3> {
    let Some(tree) = centreline else {
        let remedy = "is a name of the vessel's centre line, and none is given";
        return Err(Error::parameter(key, format!("{target:?}"), remedy));
    };
    match tree.target(target) {
        Ok(target) => Ok(tree.nodes()[target.row].position_mm),
        Err(Error::Parameter { value, remedy, .. }) => {
            Err(Error::Parameter { name: key.to_owned(), value, remedy })
        }
        Err(other) => Err(other),
    }
}
