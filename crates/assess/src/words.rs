//! Subjects and scores in words, for whoever shows them.

use crate::score::{Scored, Verdict};
use crate::subject::{Goal, Limits, Threshold};

impl Goal {
    /// What is to be reached.
    pub fn words(&self) -> String {
        let inject = self.inject_ml.map_or_else(String::new, |ml| format!(", and {ml} ml injected there"));
        format!("tip within {} mm of {}{inject}", self.tip_within_mm, self.target)
    }
}

impl Limits {
    /// Each limit that there is.
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

impl Threshold {
    /// What it asks for.
    pub fn words(&self) -> String {
        let most = self.at_most.map(|most| format!("at most {most}"));
        most.or_else(|| self.at_least.map(|least| format!("at least {least}"))).unwrap_or_default()
    }
}

impl Scored {
    /// Whether what was asked of it is so.
    pub fn kept_words(&self) -> &'static str {
        if self.passed == Some(true) { "kept" } else { "missed" }
    }

    /// Its value with its unit.
    pub fn value_words(&self) -> String {
        match (self.metric.value, self.metric.unit) {
            (None, _) => "not measured".to_owned(),
            // Numbers and ratios.
            (Some(value), "1") if value.fract() == 0.0 => value.to_string(),
            (Some(value), "1") => format!("{value:.3}"),
            (Some(value), unit) => format!("{value:.3} {unit}"),
        }
    }
}

impl Verdict {
    /// What has come of the subject.
    pub fn words(&self) -> String {
        let how = if self.passed { "passed" } else { "not passed" };
        let end = match self.ended {
            Some(ended) => format!("{} after {:.1} s", ended.by.words(), ended.time_s),
            None => "left before the goal was reached".to_owned(),
        };
        format!("{how}, {:.0} of 100: {end}", self.score)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Record;

    #[test]
    fn numbers_are_whole_where_they_count_and_have_their_units() {
        let metrics = crate::assess(&Record::default(), None);
        let words = |name: &str, value: Option<f64>| {
            let metric = *metrics.iter().find(|metric| metric.name == name).unwrap();
            let metric = crate::Metric { value, ..metric };
            Scored { metric, threshold: None, passed: None }.value_words()
        };
        assert_eq!(words("reversals", Some(6.0)), "6");
        assert_eq!(words("path_ratio", Some(1.23456)), "1.235");
        assert_eq!(words("total_s", Some(9.2)), "9.200 s");
        assert_eq!(words("arrived", None), "not measured");
    }
}
