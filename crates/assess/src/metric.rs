//! Measures and their meaning.

use serde::Serialize;

/// What a measure is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// Duration.
    Time,
    /// Use of the beam.
    Radiation,
    /// Injected contrast medium.
    Contrast,
    /// Motion of instruments and tip.
    Motion,
    /// Possible harm.
    Safety,
    /// Path of the tip.
    Way,
    /// Whether the goal was reached.
    Task,
}

impl Group {
    /// All groups, in order.
    pub const ALL: [Self; 7] =
        [Self::Time, Self::Radiation, Self::Contrast, Self::Motion, Self::Safety, Self::Way, Self::Task];

    /// Name of the group.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Radiation => "radiation",
            Self::Contrast => "contrast",
            Self::Motion => "motion",
            Self::Safety => "safety",
            Self::Way => "way",
            Self::Task => "task",
        }
    }
}

/// Which values of a measure are better: those of experts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// Lower values.
    Lower,
    /// Higher values.
    Higher,
}

impl Better {
    /// For use in a sentence: "less" or "more".
    pub fn words(self) -> &'static str {
        match self {
            Self::Lower => "less",
            Self::Higher => "more",
        }
    }
}

/// A measure of a procedure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Metric {
    /// Name, in lower case and with its unit.
    pub name: &'static str,
    /// The same for people, without unit.
    pub title: &'static str,
    /// Its group.
    pub group: Group,
    /// Its value; `None` if the data that it needs were not recorded, or if it has no meaning for this procedure.
    pub value: Option<f64>,
    /// Its unit; "1" for ratios and counts.
    pub unit: &'static str,
    /// Which values are better.
    pub better: Better,
    /// Definition in words.
    pub definition: &'static str,
    /// Study that used it.
    pub study: &'static str,
}
