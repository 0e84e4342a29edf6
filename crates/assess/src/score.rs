//! The score of a subject: its measures against its thresholds.

use serde::Serialize;

use crate::exam::{Ended, EndedBy};
use crate::metric::Metric;
use crate::record::Record;
use crate::rules::BLIND;
use crate::subject::{Limits, Subject, Threshold};
use crate::total::total;
use crate::unjudged::{Unjudged, limits, why_absent};

/// Number of the JSON documents of scores and measures; it grows when a key changes its meaning or goes.
pub const SCHEMA: u32 = 2;

/// How a subject was done. Within each band the score grows with the credit of all thresholds; no credit leads from one
/// band into a better one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Band {
    /// The goal was reached and all thresholds are met: 80 to 100.
    Passed,
    /// A threshold is missed, or cannot be judged: 40 to 80.
    Missed,
    /// A threshold is missed whose fault is grave: 20 to 40.
    Reckless,
    /// Instruments were moved unseen: 5 to 10, or less with another grave fault.
    Blind,
    /// The goal was not reached: the part of the way that was, of the least score with which it would have been
    /// reached (40, with a grave fault 20, unseen 5 or 0).
    NotReached,
}

impl Band {
    /// The band that faults leave to who reaches the goal.
    fn reached(blind: bool, reckless: bool, all_met: bool) -> Self {
        match (blind, reckless) {
            (true, _) => Self::Blind,
            (false, true) => Self::Reckless,
            _ if all_met => Self::Passed,
            _ => Self::Missed,
        }
    }

    /// The scores without any credit and with all of it.
    fn ends(self, also_reckless: bool) -> [f64; 2] {
        match (self, also_reckless) {
            (Self::Passed, _) => [80.0, 100.0],
            (Self::Missed | Self::NotReached, _) => [40.0, 80.0],
            (Self::Reckless, _) => [20.0, 40.0],
            (Self::Blind, false) => [5.0, 10.0],
            (Self::Blind, true) => [0.0, 5.0],
        }
    }
}

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
    /// Part of the threshold's points that it brings, 0 to 1; `None` if there is none or it cannot be judged.
    pub credit: Option<f64>,
    /// Why the threshold cannot be judged. It then counts as missed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unjudged: Option<&'static str>,
}

/// The result of a subject.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether the goal was reached and all thresholds with points are met.
    pub passed: bool,
    /// From 0 to 100: the credit of all thresholds, within its band.
    pub score: f64,
    /// The band of the score.
    pub band: Band,
    /// Its end; `None` if it was left before.
    pub ended: Option<Ended>,
}

/// The score of a subject and the measures behind it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Number of this document's kind: [`SCHEMA`].
    pub schema: u32,
    /// Name of the subject in commands.
    pub subject: String,
    /// Whether it was done as an exam.
    pub exam: bool,
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

impl Verdict {
    /// The result of these measures at this end, with this part of the way covered.
    fn of(metrics: &[Scored], ended: Option<Ended>, covered: f64) -> Self {
        let counted = || {
            let points = |one: &Scored| one.threshold.as_ref().map(|threshold| threshold.points);
            metrics.iter().filter_map(move |one| Some((one, points(one).filter(|points| *points > 0.0)?)))
        };
        let is_grave = |one: &Scored| one.threshold.as_ref().is_some_and(|threshold| threshold.grave);
        let missed = |grave: &dyn Fn(&Scored) -> bool| {
            counted().any(|(one, _)| one.passed == Some(false) && grave(one))
        };
        let ended_by = |by: EndedBy| ended.is_some_and(|ended| ended.by == by);
        let blind = missed(&|one| one.metric.name == BLIND);
        // A wall that was pressed until the subject ended is as grave.
        let reckless =
            ended_by(EndedBy::WallForce) || missed(&|one| one.metric.name != BLIND && is_grave(one));
        let met = counted().all(|(one, _)| one.passed == Some(true));
        let reached = ended_by(EndedBy::Goal);
        let band = Band::reached(blind, reckless, met && reached);
        let [none, whole] = band.ends(reckless);
        if !reached {
            return Self { passed: false, score: none * covered, band: Band::NotReached, ended };
        }
        let all = total(counted().map(|(_, points)| points));
        let brought = total(counted().map(|(one, points)| points * one.credit.unwrap_or(0.0)));
        let credit = if all > 0.0 { brought / all } else { 1.0 };
        Self { passed: band == Band::Passed, score: none + (whole - none) * credit, band, ended }
    }
}

impl Score {
    /// The score of a record with these measures, with this part of the way to the goal covered, 0 to 1.
    pub(crate) fn new(
        subject: &Subject,
        record: &Record,
        metrics: &[Metric],
        ended: Option<Ended>,
        covered: f64,
    ) -> Self {
        let scored = |metric: &Metric| {
            let threshold = subject.threshold.iter().find(|threshold| threshold.metric == metric.name);
            let judged = threshold.zip(metric.value);
            let passed = judged.map(|(threshold, value)| threshold.holds(value));
            let credit = judged.map(|(threshold, value)| threshold.credit(value));
            let unjudged = threshold.filter(|_| passed.is_none()).map(|_| why_absent(metric, record));
            Scored { metric: *metric, threshold: threshold.cloned(), passed, credit, unjudged }
        };
        let metrics: Vec<Scored> = metrics.iter().map(scored).collect();
        let verdict = Verdict::of(&metrics, ended, covered);
        let not_measured = metrics
            .iter()
            .filter_map(|one| Some(Unjudged { what: one.metric.name.to_owned(), why: one.unjudged? }));
        let unjudged = not_measured.chain(limits(&subject.limits, record)).collect();
        Self {
            schema: SCHEMA,
            subject: subject.stem(),
            exam: subject.exam,
            verdict,
            limits: subject.limits,
            unjudged,
            metrics,
        }
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
