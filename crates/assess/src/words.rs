//! Subjects and scores in words, for display.

use std::sync::OnceLock;

use crate::exam::Standing;
use crate::goal::{Goal, PackingGoal};
use crate::metric::Metric;
use crate::record::Record;
use crate::score::{Band, Scored, Verdict};
use crate::subject::{Limits, Threshold};

impl Goal {
    /// The goal in words.
    pub fn words(&self) -> String {
        let goal = match self {
            Self::Packing(PackingGoal { packing_density }) => {
                return format!("{} % of the sac filled by coils", percent(*packing_density));
            }
            Self::Place(goal) => goal,
        };
        let whose = goal.instrument.as_ref().map_or_else(String::new, |name| format!(" of {name}"));
        let inject = goal.inject_ml.map_or_else(String::new, |ml| format!(", and {ml} ml injected there"));
        format!("tip{whose} within {} mm of {}{inject}", goal.tip_within_mm, goal.target)
    }
}

/// A fraction in percent, with the digits that were given.
fn percent(part: f64) -> f64 {
    (part * 1e6).round() / 1e4
}

impl Standing {
    /// How far it is to the goal, one line per quantity.
    pub(crate) fn to_go_words(&self) -> Vec<String> {
        let goal = match &self.task.goal {
            Goal::Packing(PackingGoal { packing_density }) => {
                let now = self.packing_density.unwrap_or(0.0);
                return vec![format!("packed: {:.1} of {} %", 100.0 * now, percent(*packing_density))];
            }
            Goal::Place(goal) => goal,
        };
        let to_go = self.distance_mm.map_or_else(|| "not in yet".to_owned(), |mm| format!("{mm:.1} mm"));
        let whose = goal.instrument.as_ref().map_or_else(String::new, |name| format!("{name} "));
        let mut words =
            vec![format!("{whose}to {}: {to_go}, there at {} mm", goal.target, goal.tip_within_mm)];
        if let Some(ml) = goal.inject_ml {
            words.push(format!("injected there: {:.1} of {ml} ml", self.injected_there_ml));
        }
        words
    }
}

impl Limits {
    /// The limits that are set.
    pub fn words(&self) -> Vec<String> {
        let Self { time_s, beam_s, contrast_ml, wall_force_n } = *self;
        let limits = [
            ("time", time_s, "s"),
            ("beam", beam_s, "s"),
            ("contrast", contrast_ml, "ml"),
            ("wall force", wall_force_n, "N"),
        ];
        let given = limits.iter().filter_map(|(what, limit, unit)| Some((what, (*limit)?, unit)));
        given.map(|(what, limit, unit)| format!("{what} {limit} {unit}")).collect()
    }
}

/// All measures, without values.
fn measures() -> &'static [Metric] {
    static ALL: OnceLock<Vec<Metric>> = OnceLock::new();
    ALL.get_or_init(|| crate::assess(&Record::default(), None))
}

impl Threshold {
    /// The measure in words; its name if there is none of this name.
    pub fn title(&self) -> &str {
        self.measure().map_or(&self.metric, |metric| metric.title)
    }

    /// The threshold in words, with its unit.
    pub fn words(&self) -> String {
        let unit = self.measure().map(|metric| metric.unit).filter(|unit| *unit != "1");
        let unit = unit.map_or_else(String::new, |unit| format!(" {unit}"));
        let most = self.at_most.map(|most| format!("at most {most}{unit}"));
        most.or_else(|| self.at_least.map(|least| format!("at least {least}{unit}"))).unwrap_or_default()
    }

    fn measure(&self) -> Option<&'static Metric> {
        measures().iter().find(|metric| metric.name == self.metric)
    }
}

impl Scored {
    /// Whether the threshold is met.
    pub fn kept_words(&self) -> &'static str {
        match self.passed {
            Some(true) => "kept",
            Some(false) => "missed",
            None => "not judged",
        }
    }

    /// The value with its unit.
    pub fn value_words(&self) -> String {
        match (self.metric.value, self.metric.unit) {
            (None, _) => "not measured".to_owned(),
            // Counts and ratios.
            (Some(value), "1") if value.fract() == 0.0 => value.to_string(),
            (Some(value), "1") => format!("{value:.3}"),
            (Some(value), unit) => format!("{value:.3} {unit}"),
        }
    }
}

impl Verdict {
    /// The result in words.
    pub fn words(&self) -> String {
        let how = if self.passed { "passed" } else { "not passed" };
        let end = match self.ended {
            Some(ended) => format!("{} after {:.2} s", ended.by.words(), ended.time_s),
            None => "the session ended before the goal was reached".to_owned(),
        };
        let fault = match self.band {
            Band::Blind => "; instruments were moved unseen",
            Band::Reckless => "; a grave fault",
            _ => "",
        };
        format!("{how}, {:.0} of 100: {end}{fault}", self.score)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_whole_where_they_count_and_have_their_units() {
        let metrics = crate::assess(&Record::default(), None);
        let words = |name: &str, value: Option<f64>| {
            let metric = *metrics.iter().find(|metric| metric.name == name).unwrap();
            let metric = crate::Metric { value, ..metric };
            Scored { metric, threshold: None, passed: None, credit: None, unjudged: None }.value_words()
        };
        assert_eq!(words("reversals", Some(6.0)), "6");
        assert_eq!(words("path_ratio", Some(1.23456)), "1.235");
        assert_eq!(words("total_s", Some(9.2)), "9.200 s");
        assert_eq!(words("arrived", None), "not measured");
    }
}
