//! A subject in progress: how near the goal is, how much of each limit is used, and when the subject ends. The exam
//! follows a growing record. It ends at the same time whether it sees the record tick by tick or at once.

use std::sync::Arc;

use endowire_core::{Error, Result};
use serde::Serialize;

use crate::groups::assess;
use crate::injection::{exceeds_s, flowed_ml};
use crate::reach::{Reach, Site};
use crate::record::Record;
use crate::score::{Score, Verdict};
use crate::subject::Subject;
use crate::way::Way;

/// What ends a subject.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EndedBy {
    /// The goal was reached.
    Goal,
    /// `limits.time_s` passed.
    Time,
    /// The beam was on for longer than `limits.beam_s`.
    Beam,
    /// More than `limits.contrast_ml` has flowed.
    Contrast,
    /// The wall forces were larger than `limits.wall_force_n`.
    WallForce,
}

impl EndedBy {
    /// In words.
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
    /// The reason.
    pub by: EndedBy,
    /// Time of the end, s.
    pub time_s: f64,
}

/// A limit and how much of it is used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Used {
    /// The limited quantity.
    pub what: &'static str,
    /// Its current value.
    pub value: f64,
    /// Its limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// Progress of a subject.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// Name of the subject in commands.
    pub subject: String,
    /// Title and task, for people.
    #[serde(skip)]
    pub task: Arc<Subject>,
    /// Distance from the tip to the target, mm; `None` while the tip is outside the vessel, and for a sac.
    pub distance_mm: Option<f64>,
    /// Contrast medium that has flowed at the target so far, ml.
    pub injected_there_ml: f64,
    /// Volume of the coils in the sac over the volume of the sac; `None` if there is no sac.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packing_density: Option<f64>,
    /// How far it is to the goal, in words, one line per quantity.
    pub to_go: Vec<String>,
    /// The limits that are set.
    pub used: Vec<Used>,
    /// The result, once it has ended.
    pub verdict: Option<Verdict>,
    /// The whole score, once it has ended.
    #[serde(skip)]
    pub score: Option<Arc<Score>>,
}

/// A subject in progress.
#[derive(Debug, Clone)]
pub struct Exam {
    subject: Arc<Subject>,
    reach: Reach,
    /// Number of samples that were examined and no longer change.
    seen: usize,
    wall_force_n: f64,
    score: Option<Arc<Score>>,
}

impl Exam {
    /// Starts a subject at a site.
    ///
    /// # Errors
    /// [`Error::Content`] if goal or thresholds do not fit the site: a target that the vessel does not name or at the
    /// start of its centre line, an instrument that does not exist, a sac where there is none, or a measure that has no
    /// value there.
    pub fn new(subject: Subject, site: &Site<'_>) -> Result<Self> {
        let reach = Reach::new(&subject.goal, site).and_then(|reach| subject.check_at(site).map(|()| reach));
        let reach = reach.map_err(|error| Error::content(subject.path(), error.to_string()))?;
        let subject = subject.with_common(site.radius_mm);
        Ok(Self { subject: Arc::new(subject), reach, seen: 0, wall_force_n: 0.0, score: None })
    }

    /// Refuses a record without the data that the goal needs: the goal could never be reached in it.
    ///
    /// # Errors
    /// [`Error::Content`] with the goal's key.
    pub fn check(&self, record: &Record) -> Result<()> {
        self.reach.check(record).map_err(|error| Error::content(self.subject.path(), error.to_string()))
    }

    /// The task.
    pub fn subject(&self) -> &Subject {
        &self.subject
    }

    /// The way to its target; `None` for a sac.
    pub fn way(&self) -> Option<&Way> {
        self.reach.way.as_ref()
    }

    /// Examines the new samples of a record. Returns the score when the subject ends.
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
        // The last sample may still grow: consecutive rests are one sample.
        self.seen = record.samples.len().saturating_sub(1);
        None
    }

    /// The score of a whole record: up to the end of the subject, or of all of it if the subject did not end.
    pub fn score(mut self, record: &Record) -> Arc<Score> {
        match self.follow(record) {
            Some(score) => Arc::clone(score),
            None => self.score.clone().unwrap_or_else(|| Arc::new(self.scored(record, None))),
        }
    }

    fn scored(&self, record: &Record, ended: Option<Ended>) -> Score {
        let covered = match ended {
            Some(Ended { by: EndedBy::Goal, .. }) => 1.0,
            _ => self.reach.covered(record),
        };
        Score::new(&self.subject, record, &assess(record, self.way()), ended, covered)
    }

    /// Progress at the end of a record that was followed; once the subject has ended, that at its end.
    pub fn standing(&self, record: &Record) -> Standing {
        let limits = &self.subject.limits;
        let verdict = self.score.as_ref().map(|score| score.verdict);
        let ended = verdict.and_then(|verdict| verdict.ended);
        let end_s = ended.map_or_else(|| record.end_s(), |ended| ended.time_s);
        let used = [
            ("time", end_s, limits.time_s, "s"),
            ("beam", record.beam_on_s(0.0, end_s).unwrap_or(0.0), limits.beam_s, "s"),
            ("contrast", flowed_ml(&record.injections, end_s), limits.contrast_ml, "ml"),
            ("largest wall force", self.wall_force_n, limits.wall_force_n, "N"),
        ];
        let used = used
            .into_iter()
            .filter_map(|(what, value, limit, unit)| Some(Used { what, value, limit: limit?, unit }));
        let last = record.samples.last();
        let mut standing = Standing {
            subject: self.subject.stem(),
            task: Arc::clone(&self.subject),
            distance_mm: last.and_then(|sample| self.reach.distance_mm(sample)),
            injected_there_ml: self.reach.injected_there_ml,
            packing_density: last.and_then(|sample| sample.packing).map(|packed| packed.density),
            to_go: vec![],
            used: used.collect(),
            verdict,
            score: self.score.clone(),
        };
        standing.to_go = standing.to_go_words();
        standing
    }

    /// The end of the subject, if it lies within this sample: the earliest one; at equal times limits precede the
    /// goal.
    fn end_in(&mut self, record: &Record, index: usize) -> Option<Ended> {
        let sample = &record.samples[index];
        let begun_s = index.checked_sub(1).map_or(0.0, |before| record.samples[before].time_s);
        // The values of a sample hold from its end; those of a rest, which may grow, from its beginning.
        let so_s = if sample.rests() { begun_s } else { sample.time_s };
        self.wall_force_n = self.wall_force_n.max(sample.wall_force_n);
        let goal_s = self.reach.reached_s(record, sample, so_s);
        let limits = &self.subject.limits;
        let in_sample = |time_s: &f64| *time_s < sample.time_s;
        let ends = [
            (
                EndedBy::WallForce,
                limits.wall_force_n.filter(|most| sample.wall_force_n > *most).map(|_| so_s),
            ),
            (
                EndedBy::Contrast,
                limits
                    .contrast_ml
                    .and_then(|most| exceeds_s(record.injections.iter(), most))
                    .filter(in_sample),
            ),
            (EndedBy::Beam, limits.beam_s.and_then(|most| record.beam_used_up_s(most)).filter(in_sample)),
            (EndedBy::Time, limits.time_s.filter(in_sample)),
            (EndedBy::Goal, goal_s),
        ];
        let ended = ends.into_iter().filter_map(|(by, time_s)| Some(Ended { by, time_s: time_s? }));
        ended.min_by(|a, b| a.time_s.total_cmp(&b.time_s))
    }
}
