//! Distance to a goal, sample by sample.

use endowire_core::device::{Instrument, Stack};
use endowire_core::error::nearest_name;
use endowire_core::vessel::CentrelineTree;
use endowire_core::{Error, Result};

use crate::goal::{Goal, PackingGoal, PlaceGoal};
use crate::injection::{Injection, flowed_ml, reaches_s};
use crate::record::{Record, Sample};
use crate::way::Way;

/// Times that differ by less count as equal, s: that of a sample is a sum of steps, rounded.
const SAME_S: f64 = 1e-9;

/// Where the goal of a subject lies.
#[derive(Debug, Clone, Copy, Default)]
pub struct Site<'a> {
    /// The vessel's centre line, whose points have names.
    pub tree: Option<&'a CentrelineTree>,
    /// Names of the instruments, innermost first.
    pub instruments: &'a [String],
    /// Radius of the thinnest of them, mm ([`thinnest_mm`]): how fast it may be pushed depends on it. `None` if it is not
    /// known.
    pub radius_mm: Option<f64>,
    /// Whether the scene has a sac whose packing is recorded.
    pub has_sac: bool,
    /// Whether all instruments are known to be solid: medium then leaves through the sheath alone.
    pub all_solid: bool,
}

/// Radius of the thinnest instrument, mm, each where it is thickest.
pub fn thinnest_mm(stack: &Stack) -> f64 {
    let thickest = |one: &Instrument| one.device.sections().iter().map(|s| s.radius_mm).fold(0.0, f64::max);
    stack.instruments().iter().map(thickest).fold(f64::INFINITY, f64::min)
}

/// Progress towards a goal.
#[derive(Debug, Clone)]
pub(crate) struct Reach {
    goal: Goal,
    /// The way to the target.
    pub(crate) way: Option<Way>,
    /// Time since which the tip has been at the target, s.
    there_since_s: Option<f64>,
    /// Medium that has flowed at the target since then, ml.
    pub(crate) injected_there_ml: f64,
}

impl Reach {
    /// Looks up a goal at a site. Errors name the key that does not fit.
    pub(crate) fn new(goal: &Goal, site: &Site<'_>) -> Result<Self> {
        let way = match goal {
            Goal::Place(PlaceGoal { inject_ml: Some(ml), .. }) if site.all_solid => {
                let remedy = "no instrument has a lumen through which medium can be injected there: give inner_radius_mm to one in the scene, or leave this out";
                return Err(Error::parameter("goal.inject_ml", ml, remedy));
            }
            Goal::Place(goal) => Some(way_to(goal, site)?),
            Goal::Packing(_) if site.has_sac => None,
            Goal::Packing(PackingGoal { packing_density }) => {
                let remedy = "there is no sac that coils fill: give [vessel.sac] in the scene";
                return Err(Error::parameter("goal.packing_density", packing_density, remedy));
            }
        };
        Ok(Self { goal: goal.clone(), way, there_since_s: None, injected_there_ml: 0.0 })
    }

    /// Refuses a record without the data that the goal needs.
    pub(crate) fn check(&self, record: &Record) -> Result<()> {
        match &self.goal {
            Goal::Packing(goal) if record.samples.iter().all(|sample| sample.packing.is_none()) => {
                let remedy = "the record does not tell what coils fill: it is of another scene, or of an earlier version; record it again";
                Err(Error::parameter("goal.packing_density", goal.packing_density, remedy))
            }
            Goal::Place(PlaceGoal { inject_ml: Some(ml), .. })
                if record.injections.iter().any(|one| one.outlet.is_none()) =>
            {
                let remedy = "the record does not tell where medium was injected: it is of an earlier version; record it again";
                Err(Error::parameter("goal.inject_ml", ml, remedy))
            }
            Goal::Place(PlaceGoal { instrument: Some(name), .. }) => {
                // A single device is its own foremost tip.
                let Some(hand) = self.way.as_ref().and_then(|way| way.instrument) else { return Ok(()) };
                let refuse =
                    |remedy: String| Err(Error::parameter("goal.instrument", format!("{name:?}"), remedy));
                if record.instruments.get(hand) != Some(name) {
                    let known = match record.instruments.as_slice() {
                        [] => "names no instruments".to_owned(),
                        known => format!("is of {}", known.join(", ")),
                    };
                    return refuse(format!(
                        "the record {known}: give the session, or the folder of the run with its instruments.csv"
                    ));
                }
                let unknown = |sample: &Sample| {
                    let is_in = sample.hands.get(hand).is_none_or(|hand| hand.inserted_mm > 0.0);
                    is_in && sample.tip_of_mm(Some(hand)).is_none()
                };
                if !record.samples.iter().any(unknown) {
                    return Ok(());
                }
                refuse(
                    "the record does not tell where its tip is: it is of an earlier version; record it again"
                        .into(),
                )
            }
            _ => Ok(()),
        }
    }

    /// Distance from the tip to the target, mm; `None` while the tip is outside the vessel, and for a sac.
    pub(crate) fn distance_mm(&self, sample: &Sample) -> Option<f64> {
        let way = self.way.as_ref()?;
        let (target_mm, _) = way.target_mm()?;
        Some((sample.tip_of_mm(way.instrument)? - target_mm).norm())
    }

    /// Part of the way to the goal that a record has covered, 0 to 1: as far as the tip came from where it was first,
    /// without a wrong branch, or as densely as the sac was packed.
    pub(crate) fn covered(&self, record: &Record) -> f64 {
        let part = match (&self.goal, &self.way) {
            (Goal::Packing(goal), _) => {
                let packed = record.samples.iter().filter_map(|sample| sample.packing);
                packed.map(|packed| packed.density / goal.packing_density).fold(0.0, f64::max)
            }
            (Goal::Place(_), Some(way)) => {
                way.covered(record.samples.iter().filter_map(|sample| sample.tip_of_mm(way.instrument)))
            }
            (Goal::Place(_), None) => 0.0,
        };
        part.min(1.0)
    }

    /// Time at which the goal is reached, if it is in this sample, whose values hold from `so_s` on.
    pub(crate) fn reached_s(&mut self, record: &Record, sample: &Sample, so_s: f64) -> Option<f64> {
        let goal = match &self.goal {
            Goal::Packing(goal) => {
                let packed = sample.packing.is_some_and(|packed| packed.density >= goal.packing_density);
                return packed.then_some(so_s);
            }
            Goal::Place(goal) => goal,
        };
        if !self.distance_mm(sample).is_some_and(|mm| mm <= goal.tip_within_mm) {
            (self.there_since_s, self.injected_there_ml) = (None, 0.0);
            return None;
        }
        let since_s = *self.there_since_s.get_or_insert(so_s);
        let there = || record.injections.iter().filter(|one| one.time_s >= since_s && self.leaves_there(one));
        let injected_there_ml = flowed_ml(there(), sample.time_s);
        let flowed_s = goal.inject_ml.map(|asked_ml| reaches_s(there(), asked_ml));
        self.injected_there_ml = injected_there_ml;
        match flowed_s {
            None => Some(so_s),
            Some(flowed_s) => {
                let by_now = |time_s: &f64| *time_s <= sample.time_s + SAME_S;
                flowed_s.map(|time_s| time_s.max(so_s)).filter(by_now).map(|time_s| time_s.min(sample.time_s))
            }
        }
    }

    /// Whether medium leaves at the target: as near to it as the tip must come.
    fn leaves_there(&self, injection: &Injection) -> bool {
        let target = self.way.as_ref().and_then(Way::target_mm).zip(injection.outlet.as_ref());
        target.is_some_and(|((target_mm, within_mm), outlet)| (outlet.at_mm - target_mm).norm() <= within_mm)
    }
}

/// The way to the goal's target, for the tip that the goal names.
fn way_to(goal: &PlaceGoal, site: &Site<'_>) -> Result<Way> {
    let refuse = |value: String, remedy: String| Error::parameter("goal.target", value, remedy);
    let target = format!("{:?}", goal.target);
    let Some(tree) = site.tree else {
        return Err(refuse(target, "is a point of a centre line: give that of the vessel".to_owned()));
    };
    let way = match Way::to_target(tree, &goal.target, goal.tip_within_mm) {
        Ok(Some(way)) => way,
        Ok(None) => {
            let remedy = "is where the centre line begins: name a point farther on".to_owned();
            return Err(refuse(target, remedy));
        }
        Err(Error::Parameter { value, remedy, .. }) => return Err(refuse(value, remedy)),
        Err(other) => return Err(other),
    };
    let Some(name) = &goal.instrument else { return Ok(way) };
    let refuse = |remedy: String| Error::parameter("goal.instrument", format!("{name:?}"), remedy);
    match site.instruments.iter().position(|one| one == name) {
        Some(hand) if site.instruments.len() > 1 => Ok(way.for_instrument(hand)),
        // Its tip is the foremost one.
        Some(_) => Ok(way),
        None if site.instruments.is_empty() => Err(refuse(
            "the record names no instruments: it is of a single device, or of an earlier version".to_owned(),
        )),
        None => {
            let nearest = nearest_name(site.instruments.iter().map(String::as_str), name);
            let remedy = format!(
                "is no instrument of the scene: name one of {}{}",
                site.instruments.join(", "),
                nearest.map_or_else(String::new, |nearest| format!("; did you mean {nearest:?}?"))
            );
            Err(refuse(remedy))
        }
    }
}
