//! Training subjects: a task in a scene, its end, and its thresholds. A subject is a TOML file, written without code.

use std::path::{Path, PathBuf};

use endowire_core::error::{in_range, nearest_name};
use endowire_core::input::{from_toml, parse_toml};
use endowire_core::{Error, Result};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use crate::goal::Goal;
use crate::metric::{Better, Metric};
use crate::reach::Site;
use crate::record::Record;
use crate::rules::{self, BLIND, MOST_UNSEEN};
use crate::unjudged::why_never;

/// Levels, from the easiest.
const LEVELS: std::ops::RangeInclusive<u8> = 1..=4;
/// Largest valid distance, time, volume, force and number of points.
pub(crate) const LARGEST: f64 = 1e6;

/// A subject as its file defines it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Subject {
    /// Its title.
    pub name: String,
    /// Difficulty, 1 to 4.
    pub level: u8,
    /// The task in words: what to do, why, and what counts.
    pub text: String,
    /// Scene file, relative to the subject's folder; its script serves only as a demonstration.
    pub scene: PathBuf,
    /// Overridden keys of the scene, `KEY=VALUE`.
    #[serde(default)]
    pub set: Vec<String>,
    /// File of `[[script]]` tables that solves the subject, relative to the same folder; by default the scene's own
    /// script.
    pub reference: Option<PathBuf>,
    /// The goal.
    pub goal: Goal,
    /// Limits that end it early.
    #[serde(default)]
    pub limits: Limits,
    /// Whether it is an exam: the 3D view is hidden, nothing can be undone, and almost nothing may be moved unseen.
    #[serde(default)]
    pub exam: bool,
    /// Thresholds of measures. An exam adds those that count in every subject.
    #[serde(default)]
    pub threshold: Vec<Threshold>,
    #[serde(skip)]
    path: PathBuf,
}

/// Limits. A subject ends, not passed, as soon as one of them is exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Time, s.
    pub time_s: Option<f64>,
    /// Time with the beam on, s.
    pub beam_s: Option<f64>,
    /// Contrast medium, ml.
    pub contrast_ml: Option<f64>,
    /// Sum of the magnitudes of wall forces, N.
    pub wall_force_n: Option<f64>,
}

/// Threshold of a measure.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Threshold {
    /// Name of the measure ([`Metric::name`]).
    #[serde(skip_serializing)]
    pub metric: String,
    /// Largest value, for a measure of which less is better.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_most: Option<f64>,
    /// Smallest value, for a measure of which more is better.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_least: Option<f64>,
    /// Value up to which the whole credit is given; from there it falls to half of it at the threshold. Without it, all
    /// values that meet the threshold count alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub good: Option<f64>,
    /// Points in the score; 1 by default. With 0 the measure is reported and need not be met.
    #[serde(default = "one")]
    pub points: f64,
    /// Whether missing it endangers the patient: the score is then at most 40.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub grave: bool,
    /// Where its value comes from: a study, a cohort or a choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

/// Credit at a threshold.
const HALF: f64 = 0.5;

fn one() -> f64 {
    1.0
}

/// The largest possible value of a measure, if it has one.
fn largest(metric: &str) -> Option<f64> {
    match metric {
        "arrived" | "packing_density" => Some(1.0),
        "spectral_arc_length" => Some(0.0),
        _ => None,
    }
}

impl Limits {
    /// The limit of a measure, with its key: no session goes on beyond it.
    fn of(&self, metric: &str) -> Option<(&'static str, f64)> {
        let (key, limit) = match metric {
            "total_s" => ("limits.time_s", self.time_s),
            "beam_on_s" => ("limits.beam_s", self.beam_s),
            "contrast_ml" => ("limits.contrast_ml", self.contrast_ml),
            "wall_force_n" => ("limits.wall_force_n", self.wall_force_n),
            _ => return None,
        };
        limit.map(|limit| (key, limit))
    }
}

impl Threshold {
    /// Whether a value meets the threshold.
    pub(crate) fn holds(&self, value: f64) -> bool {
        self.at_most.is_none_or(|most| value <= most) && self.at_least.is_none_or(|least| value >= least)
    }

    /// Part of its points that a value brings: 1 up to `good`, half at the threshold, and falling beyond it.
    pub(crate) fn credit(&self, value: f64) -> f64 {
        let limit = self.at_most.or(self.at_least).unwrap_or(value);
        // Above 0 beyond the threshold, whichever way is better.
        let beyond = if self.at_most.is_some() { value - limit } else { limit - value };
        let margin = self.good.map_or(0.0, |good| (limit - good).abs());
        if beyond > 0.0 {
            let scale = limit.abs().max(f64::MIN_POSITIVE);
            return (HALF * (1.0 - beyond / scale)).max(0.0);
        }
        if margin > 0.0 { (HALF - HALF * beyond / margin).min(1.0) } else { 1.0 }
    }

    /// Checks it against the measure that it names; `key` is its name in messages.
    fn check(&self, key: &str, metrics: &[Metric]) -> Result<()> {
        let Some(metric) = metrics.iter().find(|metric| metric.name == self.metric) else {
            let nearest = nearest_name(metrics.iter().map(|metric| metric.name), &self.metric);
            let remedy = format!(
                "is no measure; did you mean {:?}? `endowire assess` lists all of them",
                nearest.unwrap_or_default()
            );
            return Err(Error::parameter(format!("{key}.metric"), format!("{:?}", self.metric), remedy));
        };
        let (right, wrong, limit, other) = match metric.better {
            Better::Lower => ("at_most", "at_least", self.at_most, self.at_least),
            Better::Higher => ("at_least", "at_most", self.at_least, self.at_most),
        };
        if let Some(other) = other {
            let remedy = format!("of {} {} is better: give {right}", metric.name, metric.better.words());
            return Err(Error::parameter(format!("{key}.{wrong}"), other, remedy));
        }
        if let Some((most, least)) =
            largest(metric.name).zip(self.at_least).filter(|(most, least)| least > most)
        {
            let remedy = format!(
                "{} is never above {most}, and no session would pass: give that or less",
                metric.name
            );
            return Err(Error::parameter(format!("{key}.at_least"), least, remedy));
        }
        match limit {
            // What is better when lower counts or measures something, which is never below 0.
            Some(limit) if metric.better == Better::Lower && limit < 0.0 => {
                let remedy =
                    format!("{} is never below 0, and no session would pass: give 0 or more", metric.name);
                return Err(Error::parameter(format!("{key}.{right}"), limit, remedy));
            }
            Some(limit) if limit.is_finite() => {}
            Some(limit) => {
                return Err(Error::parameter(format!("{key}.{right}"), limit, "must be a finite number"));
            }
            None => {
                let remedy = format!("which value of {} is asked for? give {right}", metric.name);
                return Err(Error::parameter(format!("{key}.{right}"), "none", remedy));
            }
        }
        if !(0.0..=LARGEST).contains(&self.points) {
            let remedy = format!("must be a number from 0 to {LARGEST}; with 0 it is only reported");
            return Err(Error::parameter(format!("{key}.points"), self.points, remedy));
        }
        if self.grave && self.points == 0.0 {
            let remedy = "what endangers the patient counts: give it points, or leave this out";
            return Err(Error::parameter(format!("{key}.grave"), true, remedy));
        }
        if let Some((good, limit)) = self.good.zip(limit) {
            let holds =
                good.is_finite() && self.holds(good) && (metric.better == Better::Higher || good >= 0.0);
            if !holds {
                let remedy =
                    format!("the whole credit is given up to there: give what meets {right} = {limit}");
                return Err(Error::parameter(format!("{key}.good"), good, remedy));
            }
        }
        let blind =
            self.metric == BLIND && (limit.is_some_and(|limit| limit > MOST_UNSEEN) || self.points == 0.0);
        if blind {
            let remedy = format!(
                "instruments are moved under fluoroscopy in every subject: ask for at most {MOST_UNSEEN}, with points, or leave the threshold out"
            );
            return Err(Error::parameter(format!("{key}.at_most"), limit.unwrap_or_default(), remedy));
        }
        Ok(())
    }
}

impl Subject {
    /// Reads a subject from a file.
    ///
    /// # Errors
    /// [`Error::Content`] with file, key and value of what is invalid, including a scene or reference that does not
    /// exist.
    pub fn read(path: &Path) -> Result<Self> {
        let (subject, _): (Self, String) = from_toml(path)?;
        let subject = subject.of_file(path)?;
        let reference = subject.reference.iter().map(|file| ("reference", file));
        for (key, file) in std::iter::once(("scene", &subject.scene)).chain(reference) {
            if !subject.resolve(file).is_file() {
                let remedy = format!("there is no such file from {}: name one", subject.folder().display());
                let error = Error::parameter(key, format!("{:?}", file.display().to_string()), remedy);
                return Err(Error::content(path, error.to_string()));
            }
        }
        Ok(subject)
    }

    /// Reads a subject from the text of its file; `path` is for messages. The files that it names are not looked for.
    ///
    /// # Errors
    /// As [`Self::read`], except for missing files.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        parse_toml::<Self>(text, path)?.of_file(path)
    }

    /// Whether a text is a subject rather than a scene: it names a scene.
    pub fn is_meant(text: &str) -> bool {
        #[derive(Deserialize)]
        struct Head {
            #[serde(rename = "scene")]
            _scene: IgnoredAny,
        }
        parse_toml::<Head>(text, Path::new("")).is_ok()
    }

    fn of_file(mut self, path: &Path) -> Result<Self> {
        self.path = path.to_path_buf();
        self.check().map_err(|error| Error::content(path, error.to_string()))?;
        Ok(self)
    }

    fn check(&self) -> Result<()> {
        for (key, text) in [("name", &self.name), ("text", &self.text)] {
            if text.trim().is_empty() {
                return Err(Error::parameter(key, "\"\"", "must not be empty"));
            }
        }
        if !LEVELS.contains(&self.level) {
            let remedy = format!("must be from {} to {}", LEVELS.start(), LEVELS.end());
            return Err(Error::parameter("level", self.level, remedy));
        }
        let Self { goal, limits, .. } = self;
        goal.check(limits.contrast_ml)?;
        for (key, limit) in [
            ("limits.time_s", limits.time_s),
            ("limits.beam_s", limits.beam_s),
            ("limits.contrast_ml", limits.contrast_ml),
            ("limits.wall_force_n", limits.wall_force_n),
        ] {
            limit.map_or(Ok(()), |limit| in_range(key, limit, LARGEST))?;
        }
        let metrics = crate::assess(&Record::default(), None);
        for (index, threshold) in self.threshold.iter().enumerate() {
            threshold.check(&format!("threshold[{index}]"), &metrics)?;
            if self.threshold[..index].iter().any(|before| before.metric == threshold.metric) {
                let remedy = "has a threshold already: keep one of the two";
                let key = format!("threshold[{index}].metric");
                return Err(Error::parameter(key, format!("{:?}", threshold.metric), remedy));
            }
            let limit = limits.of(&threshold.metric).zip(threshold.at_most);
            if let Some(((limit, ends_at), most)) = limit.filter(|((_, ends_at), most)| most > ends_at) {
                let remedy = format!(
                    "is never missed, since {limit} = {ends_at} ends the subject before: give at most that, or raise the limit"
                );
                return Err(Error::parameter(format!("threshold[{index}].at_most"), most, remedy));
            }
        }
        Ok(())
    }

    /// Adds the thresholds that count in every subject, unless it has its own. Who works blind, or endangers the patient
    /// by speed, does so in every subject.
    pub(crate) fn with_common(mut self, radius_mm: Option<f64>) -> Self {
        for common in rules::common(radius_mm, self.exam) {
            match self.threshold.iter_mut().find(|own| own.metric == common.metric) {
                None => self.threshold.push(common),
                Some(own) if own.metric == BLIND => {
                    own.grave = true;
                    own.at_most = own.at_most.zip(common.at_most).map(|(own, common)| own.min(common));
                    own.good = own.good.filter(|good| own.at_most.is_some_and(|most| *good <= most));
                }
                Some(own) => own.grave |= common.grave && own.points > 0.0,
            }
        }
        self
    }

    /// Refuses thresholds of measures that have no value at a site.
    pub(crate) fn check_at(&self, site: &Site<'_>) -> Result<()> {
        let mut never = self.threshold.iter().enumerate().filter_map(|(index, threshold)| {
            Some((index, &threshold.metric, why_never(&threshold.metric, &self.goal, site)?))
        });
        match never.next() {
            None => Ok(()),
            Some((index, metric, remedy)) => {
                Err(Error::parameter(format!("threshold[{index}].metric"), format!("{metric:?}"), remedy))
            }
        }
    }

    /// Name of the subject in commands: the stem of its file.
    pub fn stem(&self) -> String {
        self.path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// Its file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    /// Path of a file of the subject, relative to the working directory.
    pub fn resolve(&self, file: &Path) -> PathBuf {
        self.folder().join(file)
    }
}
