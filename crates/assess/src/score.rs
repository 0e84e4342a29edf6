//! What a subject was done with: its thresholds beside the measures.

use serde::Serialize;

use crate::exam::{Ended, EndedBy};
use crate::metric::Metric;
use crate::subject::{Limits, Subject, Threshold};

/// Score of a subject that is done as it should be.
const BEST: f64 = 100.0;

/// A measure and what was asked of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// The measure, until the subject's end.
    #[serde(flatten)]
    pub metric: Metric,
    /// What was asked of it, if anything was.
    pub threshold: Option<Threshold>,
    /// Whether it is so; what was not measured is not.
    pub passed: Option<bool>,
}

/// What has come of a subject.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether its goal was reached, and all its thresholds that have points are kept.
    pub passed: bool,
    /// Points of the thresholds that are kept, in hundredths of all; 0 where the goal was not reached.
    pub score: f64,
    /// How it ended; none where it was left before.
    pub ended: Option<Ended>,
}

/// How well a subject was done, and by which measures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// What commands call the subject.
    pub subject: String,
    /// What has come of it.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// The limits that there were.
    #[serde(skip)]
    pub limits: Limits,
    /// All measures, in the order of their groups.
    pub metrics: Vec<Scored>,
}

impl Score {
    pub(crate) fn new(subject: &Subject, metrics: &[Metric], ended: Option<Ended>) -> Self {
        let scored = |metric: &Metric| {
            let threshold = subject.threshold.iter().find(|threshold| threshold.metric == metric.name);
            let passed = threshold.map(|threshold| threshold.holds(metric.value));
            Scored { metric: *metric, threshold: threshold.cloned(), passed }
        };
        let metrics: Vec<Scored> = metrics.iter().map(scored).collect();
        let points = |of: &dyn Fn(&Scored) -> bool| -> f64 {
            let counted = metrics.iter().filter(|one| of(one)).filter_map(|one| one.threshold.as_ref());
            counted.map(|threshold| threshold.points).sum()
        };
        let (all, kept) = (points(&|_| true), points(&|one| one.passed == Some(true)));
        let reached = ended.is_some_and(|ended| ended.by == EndedBy::Goal);
        let counts = |one: &Scored| one.threshold.as_ref().is_some_and(|threshold| threshold.points > 0.0);
        let all_kept = metrics.iter().filter(|one| counts(one)).all(|one| one.passed == Some(true));
        let score = match (reached, all_kept) {
            (false, _) => 0.0,
            (true, true) => BEST,
            (true, false) => BEST * kept / all,
        };
        let verdict = Verdict { passed: reached && all_kept, score, ended };
        Self { subject: subject.stem(), verdict, limits: subject.limits, metrics }
    }

    /// The measures of which something was asked.
    pub fn asked(&self) -> impl Iterator<Item = (&Scored, &Threshold)> {
        self.metrics.iter().filter_map(|one| Some((one, one.threshold.as_ref()?)))
    }
}
