//! A measure and what it means.

use serde::Serialize;

/// What a measure is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// How long it took.
    Time,
    /// What the beam did.
    Radiation,
    /// What was injected.
    Contrast,
    /// How hands and tip moved.
    Motion,
    /// What could have done harm.
    Safety,
    /// Where the tip went.
    Way,
    /// Whether it arrived.
    Task,
}

impl Group {
    /// The groups in order.
    pub const ALL: [Self; 7] =
        [Self::Time, Self::Radiation, Self::Contrast, Self::Motion, Self::Safety, Self::Way, Self::Task];

    /// What it is called.
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

/// What of a measure experts have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Better {
    /// Less of it.
    Lower,
    /// More of it.
    Higher,
}

impl Better {
    /// In a sentence: "less" or "more".
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
    /// What it is called, in lower case and with its unit.
    pub name: &'static str,
    /// What it is about.
    pub group: Group,
    /// Its value; none where what it needs was not recorded, or it means nothing of this procedure.
    pub value: Option<f64>,
    /// Its unit; "1" of ratios and numbers.
    pub unit: &'static str,
    /// Which of two values is the better one.
    pub better: Better,
    /// How it is computed.
    pub definition: &'static str,
    /// Where it was used.
    pub study: &'static str,
}
