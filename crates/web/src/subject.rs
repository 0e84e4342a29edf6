//! Display of a training subject on a page: its task at the start, and its score.

use endowire_assess::{Metric, Record, Score, Scored, Subject, Threshold};
use serde::Serialize;

/// A task in words.
#[derive(Debug, Serialize)]
pub(crate) struct Task<'a> {
    name: &'a str,
    level: u8,
    /// Whether the 3D view is hidden and nothing can be undone or shown.
    exam: bool,
    text: &'a str,
    /// The goal, in words.
    goal: String,
    /// The limits, in words.
    limits: Vec<String>,
    counts: Vec<Counts<'a>>,
}

/// The threshold of a measure.
#[derive(Debug, Serialize)]
struct Counts<'a> {
    name: &'a str,
    title: &'a str,
    definition: &'static str,
    asked: String,
    points: f64,
}

impl<'a> Task<'a> {
    pub(crate) fn of(subject: &'a Subject) -> Self {
        let measures = endowire_assess::assess(&Record::default(), None);
        Self {
            name: &subject.name,
            level: subject.level,
            exam: subject.exam,
            text: subject.text.trim(),
            goal: subject.goal.words(),
            limits: subject.limits.words(),
            counts: subject.threshold.iter().map(|threshold| counts(threshold, &measures)).collect(),
        }
    }
}

fn counts<'a>(threshold: &'a Threshold, measures: &[Metric]) -> Counts<'a> {
    let name = threshold.metric.as_str();
    let definition = measures.iter().find(|one| one.name == name).map_or("", |one| one.definition);
    Counts { name, title: threshold.title(), definition, asked: threshold.words(), points: threshold.points }
}

/// A score, as in `endowire assess --json`, and in words.
#[derive(Debug, Serialize)]
pub(crate) struct Graded<'a> {
    #[serde(flatten)]
    score: &'a Score,
    words: String,
    rows: Vec<Row<'a>>,
}

/// A measure in words.
#[derive(Debug, Serialize)]
struct Row<'a> {
    name: &'a str,
    title: &'a str,
    definition: &'a str,
    value: String,
    asked: Option<String>,
    points: Option<f64>,
    passed: Option<bool>,
    /// Whether the threshold is met; `None` if there is none.
    kept: Option<&'static str>,
}

impl<'a> Graded<'a> {
    pub(crate) fn of(score: &'a Score) -> Self {
        Self { score, words: score.verdict.words(), rows: score.metrics.iter().map(row).collect() }
    }
}

fn row(scored: &Scored) -> Row<'_> {
    Row {
        name: scored.metric.name,
        title: scored.metric.title,
        definition: scored.metric.definition,
        value: scored.value_words(),
        asked: scored.threshold.as_ref().map(Threshold::words),
        points: scored.threshold.as_ref().map(|threshold| threshold.points),
        passed: scored.passed,
        kept: scored.threshold.as_ref().map(|_| scored.kept_words()),
    }
}
