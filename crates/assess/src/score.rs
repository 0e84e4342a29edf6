//! The score of a subject: its measures against its thresholds.

use serde::Serialize;

use crate::exam::{Ended, EndedBy};
use crate::metric::Metric;
use crate::record::Record;
use crate::subject::{Limits, Subject, Threshold};
use crate::total::total;
use crate::unjudged::{Unjudged, limits, why_absent};

/// The score when all thresholds are met.
const BEST: f64 = 100.0;

/// A measure and the threshold for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// The measure, up to the end of the subject.
    #[serde(flatten)]
    pub metric: Metric,
    /// Its threshold, if there is one.
    pub threshold: Option<Threshold>,
    /// Whether the threshold is met; `None` if there is none or it cannot be judged.
    pub passed: Option<bool>,
    /// Why the threshold cannot be judged. It then counts as missed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unjudged: Option<&'static str>,
}

/// The result of a subject.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether the goal was reached and all thresholds with points are met.
    pub passed: bool,
    /// Points of the thresholds that are met, in percent of all points; 0 if the goal was not reached.
    pub score: f64,
    /// Its end; `None` if it was left before.
    pub ended: Option<Ended>,
}

/// The score of a subject and the measures behind it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Name of the subject in commands.
    pub subject: String,
    /// The result.
    #[serde(flatten)]
    pub verdict: Verdict,
    /// The limits that applied.
    #[serde(skip)]
    pub limits: Limits,
    /// Thresholds and limits that cannot be judged.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unjudged: Vec<Unjudged>,
    /// All measures, ordered by group.
    pub metrics: Vec<Scored>,
}

impl Score {
    /// The score of a record with these measures.
    pub(crate) fn new(subject: &Subject, record: &Record, metrics: &[Metric], ended: Option<Ended>) -> Self {
        let scored = |metric: &Metric| {
            let threshold = subject.threshold.iter().find(|threshold| threshold.metric == metric.name);
            let passed = threshold.zip(metric.value).map(|(threshold, value)| threshold.holds(value));
            let unjudged = threshold.filter(|_| passed.is_none()).map(|_| why_absent(metric, record));
            Scored { metric: *metric, threshold: threshold.cloned(), passed, unjudged }
        };
        let metrics: Vec<Scored> = metrics.iter().map(scored).collect();
        let points = |of: &dyn Fn(&Scored) -> bool| -> f64 {
            let counted = metrics.iter().filter(|one| of(one)).filter_map(|one| one.threshold.as_ref());
            total(counted.map(|threshold| threshold.points))
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
        let not_measured = metrics
            .iter()
            .filter_map(|one| Some(Unjudged { what: one.metric.name.to_owned(), why: one.unjudged? }));
        let unjudged = not_measured.chain(limits(&subject.limits, record)).collect();
        Self { subject: subject.stem(), verdict, limits: subject.limits, unjudged, metrics }
    }

    /// What cannot be judged, grouped by reason, one sentence each.
    pub fn unjudged_words(&self) -> Vec<String> {
        let mut reasons: Vec<(&str, Vec<&str>)> = vec![];
        for Unjudged { what, why } in &self.unjudged {
            match reasons.iter_mut().find(|(known, _)| known == why) {
                Some((_, all)) => all.push(what),
                None => reasons.push((why, vec![what])),
            }
        }
        let words = |(why, all): (&str, Vec<&str>)| format!("not judged: {}: {why}", all.join(", "));
        reasons.into_iter().map(words).collect()
    }

    /// The measures that have a threshold.
    pub fn asked(&self) -> impl Iterator<Item = (&Scored, &Threshold)> {
        self.metrics.iter().filter_map(|one| Some((one, one.threshold.as_ref()?)))
    }
}
