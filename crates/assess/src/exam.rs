//! A subject on its way: how near the goal is, what of the limits is used, and when it ends. It follows a record that grows, and ends at the
//! same moment whether it sees the record tick by tick or whole.

use std::sync::Arc;

use endowire_core::vessel::CentrelineTree;
use endowire_core::{Error, Result};
use serde::Serialize;

use crate::groups::assess;
use crate::record::{Record, Sample};
use crate::score::{Score, Verdict};
use crate::subject::Subject;
use crate::way::Way;

/// Volumes that differ by less are the same, ml: sums are rounded.
const SAME_ML: f64 = 1e-9;

/// What ends a subject.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EndedBy {
    /// The goal was reached.
    Goal,
    /// `limits.time_s` has passed.
    Time,
    /// The beam was on for longer than `limits.beam_s`.
    Beam,
    /// More than `limits.contrast_ml` was injected.
    Contrast,
    /// The wall forces were larger than `limits.wall_force_n`.
    WallForce,
}

impl EndedBy {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Goal => "the goal is reached",
            Self::Time => "the time is over",
            Self::Beam => "the beam was on for too long",
            Self::Contrast => "too much contrast medium was injected",
            Self::WallForce => "the wall was pressed too hard",
        }
    }
}

/// The end of a subject.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ended {
    /// Why.
    pub by: EndedBy,
    /// When, s.
    pub time_s: f64,
}

/// A limit, and what of it is used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Used {
    /// What is limited.
    pub what: &'static str,
    /// So far.
    pub value: f64,
    /// At most.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// How a subject stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// What commands call the subject.
    pub subject: String,
    /// Title and task, for people.
    #[serde(skip)]
    pub task: Arc<Subject>,
    /// From the foremost tip to the target, mm; none while nothing is in.
    pub distance_mm: Option<f64>,
    /// Contrast medium injected at the target so far, ml.
    pub injected_there_ml: f64,
    /// The limits that there are.
    pub used: Vec<Used>,
    /// What has come of it, once it has ended.
    pub verdict: Option<Verdict>,
    /// The whole score, likewise.
    #[serde(skip)]
    pub score: Option<Arc<Score>>,
}

/// A subject that is being done.
#[derive(Debug, Clone)]
pub struct Exam {
    subject: Arc<Subject>,
    way: Way,
    /// Samples before this one have been looked at and do not change any more.
    seen: usize,
    /// Since when the tip is at the target, s.
    there_since_s: Option<f64>,
    injected_there_ml: f64,
    wall_force_n: f64,
    score: Option<Arc<Score>>,
}

impl Exam {
    /// A subject in a vessel with this centre line.
    ///
    /// # Errors
    /// [`Error::Content`] for a target that the vessel does not name, or where its centre line begins.
    pub fn new(subject: Subject, tree: &CentrelineTree) -> Result<Self> {
        let (target, within_mm) = (&subject.goal.target, subject.goal.tip_within_mm);
        let refuse = |value: String, mend: String| {
            let error = Error::parameter("goal.target", value, mend);
            Error::content(subject.path(), error.to_string())
        };
        let way = match Way::to_target(tree, target, within_mm) {
            Ok(Some(way)) => way,
            Ok(None) => {
                let mend = "is where the centre line begins: name a point farther on".to_owned();
                return Err(refuse(format!("{target:?}"), mend));
            }
            Err(Error::Parameter { value, mend, .. }) => return Err(refuse(value, mend)),
            Err(other) => return Err(other),
        };
        Ok(Self {
            subject: Arc::new(subject),
            way,
            seen: 0,
            there_since_s: None,
            injected_there_ml: 0.0,
            wall_force_n: 0.0,
            score: None,
        })
    }

    /// What is to be done.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }

    /// The way to its target.
    pub fn way(&self) -> &Way {
        &self.way
    }

    /// Looks at what a record has more than before; the score as soon as it ends.
    pub fn follow(&mut self, record: &Record) -> Option<&Arc<Score>> {
        if self.score.is_some() {
            return None;
        }
        for index in self.seen..record.samples.len() {
            if let Some(ended) = self.end_in(record, index) {
                let done = record.until(index, ended.time_s);
                self.score = Some(Arc::new(self.scored(&done, Some(ended))));
                return self.score.as_ref();
            }
        }
        // The last one may become longer: rests are one sample.
        self.seen = record.samples.len().saturating_sub(1);
        None
    }

    /// The score of a whole record: of what was done until the end, or of all of it where there was none.
    pub fn score(mut self, record: &Record) -> Arc<Score> {
        match self.follow(record) {
            Some(score) => Arc::clone(score),
            None => self.score.clone().unwrap_or_else(|| Arc::new(self.scored(record, None))),
        }
    }

    fn scored(&self, record: &Record, ended: Option<Ended>) -> Score {
        Score::new(&self.subject, &assess(record, Some(&self.way)), ended)
    }

    /// How it stands with a record that was followed.
    pub fn standing(&self, record: &Record) -> Standing {
        let limits = &self.subject.limits;
        let used = [
            ("time", record.end_s(), limits.time_s, "s"),
            ("beam", record.beam_on_s(0.0, record.end_s()).unwrap_or(0.0), limits.beam_s, "s"),
            ("contrast", injected_ml(record, 0.0, f64::INFINITY), limits.contrast_ml, "ml"),
            ("largest wall force", self.wall_force_n, limits.wall_force_n, "N"),
        ];
        let used = used
            .into_iter()
            .filter_map(|(what, value, limit, unit)| Some(Used { what, value, limit: limit?, unit }));
        Standing {
            subject: self.subject.stem(),
            task: Arc::clone(&self.subject),
            distance_mm: record.samples.last().and_then(|sample| self.distance_mm(sample)),
            injected_there_ml: self.injected_there_ml,
            used: used.collect(),
            verdict: self.score.as_ref().map(|score| score.verdict),
            score: self.score.clone(),
        }
    }

    fn distance_mm(&self, sample: &Sample) -> Option<f64> {
        let (target_mm, _) = self.way.target_mm()?;
        Some((sample.on_centreline_mm()? - target_mm).norm())
    }

    /// The end of the subject, if it is in a sample: that which comes first, limits before the goal.
    fn end_in(&mut self, record: &Record, index: usize) -> Option<Ended> {
        let sample = &record.samples[index];
        let begun_s = index.checked_sub(1).map_or(0.0, |before| record.samples[before].time_s);
        // A rest that becomes longer has begun with what it is.
        let so_s = if sample.rests() { begun_s } else { sample.time_s };
        self.wall_force_n = self.wall_force_n.max(sample.wall_force_n);
        let goal_s = self.reached_s(record, sample, so_s);
        let limits = &self.subject.limits;
        let in_sample = |time_s: &f64| *time_s < sample.time_s;
        let ends = [
            (
                EndedBy::WallForce,
                limits.wall_force_n.filter(|most| sample.wall_force_n > *most).map(|_| so_s),
            ),
            (
                EndedBy::Contrast,
                limits.contrast_ml.and_then(|most| exceeded_s(record, most)).filter(in_sample),
            ),
            (EndedBy::Beam, limits.beam_s.and_then(|most| record.beam_used_up_s(most)).filter(in_sample)),
            (EndedBy::Time, limits.time_s.filter(in_sample)),
            (EndedBy::Goal, goal_s),
        ];
        let ended = ends.into_iter().filter_map(|(by, time_s)| Some(Ended { by, time_s: time_s? }));
        ended.min_by(|a, b| a.time_s.total_cmp(&b.time_s))
    }

    /// When the goal is reached, if it is in this sample.
    fn reached_s(&mut self, record: &Record, sample: &Sample, so_s: f64) -> Option<f64> {
        let within_mm = self.subject.goal.tip_within_mm;
        if !self.distance_mm(sample).is_some_and(|mm| mm <= within_mm) {
            (self.there_since_s, self.injected_there_ml) = (None, 0.0);
            return None;
        }
        let since_s = *self.there_since_s.get_or_insert(so_s);
        self.injected_there_ml = injected_ml(record, since_s, sample.time_s);
        let Some(asked_ml) = self.subject.goal.inject_ml else { return Some(so_s) };
        let there = record.injections.iter().filter(|one| (since_s..=sample.time_s).contains(&one.time_s));
        let mut sum_ml = 0.0;
        let last = there.into_iter().find(|one| {
            sum_ml += one.volume_ml;
            sum_ml >= asked_ml - SAME_ML
        });
        last.map(|one| one.time_s.max(so_s))
    }
}

/// Contrast medium that was injected from one moment to another, ml.
fn injected_ml(record: &Record, from_s: f64, to_s: f64) -> f64 {
    let injected = record.injections.iter().filter(|one| (from_s..=to_s).contains(&one.time_s));
    injected.map(|one| one.volume_ml).fold(0.0, |sum, ml| sum + ml)
}

/// When more than so much had been injected, s.
fn exceeded_s(record: &Record, most_ml: f64) -> Option<f64> {
    let mut sum_ml = 0.0;
    let over = record.injections.iter().find(|one| {
        sum_ml += one.volume_ml;
        sum_ml > most_ml + SAME_ML
    });
    over.map(|one| one.time_s)
}
