//! Thresholds and limits that cannot be judged, because their data were not recorded or have no meaning for the
//! procedure.

use serde::Serialize;

use crate::goal::Goal;
use crate::metric::{Group, Metric};
use crate::reach::Site;
use crate::record::Record;
use crate::subject::Limits;

const NO_BEAM: &str = "no beam was recorded: a folder of endowire run has none; record it by endowire play, or give the log of the beam as beam.csv beside steps.csv";

/// A threshold or a limit that cannot be judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unjudged {
    /// Name of the measure, or key of the limit.
    pub what: String,
    /// The reason and the remedy.
    pub why: &'static str,
}

/// Why a measure has no value.
pub(crate) fn why_absent(metric: &Metric, record: &Record) -> &'static str {
    if record.is_empty() {
        return "nothing was done in the session";
    }
    let of_beam = ["beam_on_s", "beam_on_idle_s", "moving_without_beam_s", "unseen_share"];
    if record.beam.is_none() && (of_beam.contains(&metric.name) || metric.group == Group::Radiation) {
        return NO_BEAM;
    }
    match metric.name {
        "entrance_ugy" | "entrance_area_ugycm2" | "acquisition_s" | "moving_in_acquisition_s" => {
            return "it was not recorded: the record is of an earlier version, or beam.csv does not give it";
        }
        "unseen_share" => return "no hand moved",
        _ if metric.group == Group::Radiation => return "the beam was never on",
        _ => {}
    }
    match metric.name {
        "against_wall_ml" => {
            "the force at the tip that injected was not recorded: the record is of an earlier version; record it again"
        }
        "catheter_ahead_s" => "there is one instrument alone",
        "packing_density" | "coil_outside_mm" => {
            "no sac is packed: the scene has none, or it was not recorded"
        }
        "spectral_arc_length" | "submovement_s" => "the tip did not move",
        "tip_speed_mm_per_s" => "no hand moved after the first place of the tip that was recorded",
        "path_ratio" => "the tip ends where it began",
        "time_in_trunk_s" => "the tip did not come past the first fork on its way, or there is none",
        _ => "no way to a target is known, or no tip was on it",
    }
}

/// Why a measure has no value in any session with this goal at this site, and the remedy; `None` if it may have one.
pub(crate) fn why_never(metric: &str, goal: &Goal, site: &Site<'_>) -> Option<&'static str> {
    let of_way = ["arrived", "path_ratio", "placement_error_mm", "time_in_trunk_s", "wrong_branches"];
    match (metric, goal) {
        ("packing_density" | "coil_outside_mm", _) if !site.has_sac => Some(
            "there is no sac that coils fill: give [vessel.sac] in the scene, or leave the threshold out",
        ),
        ("catheter_ahead_s", _) if site.instruments.len() == 1 => {
            Some("there is one instrument alone: name another measure")
        }
        (metric, Goal::Packing(_)) if of_way.contains(&metric) => {
            Some("to a sac that is packed no way is known: name another measure, or a target as the goal")
        }
        _ => None,
    }
}

/// The limits that a record has no data for.
pub(crate) fn limits(limits: &Limits, record: &Record) -> Vec<Unjudged> {
    let beam = limits.beam_s.filter(|_| record.beam.is_none());
    beam.map(|_| Unjudged { what: "limits.beam_s".to_owned(), why: NO_BEAM }).into_iter().collect()
}
