//! Rows: the results that are kept of each run.

use endowire_recording::RunOutcome;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use toml::Value;

/// The results of a run: its parameters, its outcome and its provenance. A row contains no times, so that a repeated
/// run gives the same bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Number of the run, from 0.
    pub run: usize,
    /// Values of the axes, in order.
    pub parameters: Vec<Json>,
    /// Outcome; `None` if the run could not start.
    pub outcome: Option<RunOutcome>,
    /// Why the run could not start.
    pub refused: Option<String>,
    /// SHA-256 of the scene of the run and of the files that it names.
    pub scene_hash: String,
    /// Seed of the scene.
    pub seed: u64,
    /// Version of the program.
    pub version: String,
    /// Git revision of its source.
    pub git_revision: String,
}

impl Row {
    /// Why the run did not complete its script.
    pub fn failure(&self) -> Option<&str> {
        let step = self.outcome.as_ref().and_then(|outcome| outcome.failure.as_ref());
        self.refused.as_deref().or(step.map(|failure| failure.reason.as_str()))
    }

    /// Whether some steps of the run did not converge.
    pub fn is_unconverged(&self) -> bool {
        self.outcome.as_ref().is_some_and(|outcome| outcome.tally.unconverged_steps > 0)
    }
}

/// The columns of a table that depend on the sweep.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Columns {
    /// Keys of the axes, with the kinds of their values.
    pub(crate) parameters: Vec<(String, ParameterKind)>,
    /// Names of the instruments, if there are several.
    pub(crate) instruments: Vec<String>,
}

/// Kind of an axis's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ParameterKind {
    Boolean,
    Integer,
    Number,
    Text,
    /// Lists, tables, or values of different kinds, as JSON.
    Json,
}

impl ParameterKind {
    pub(crate) fn of(values: &[Value]) -> Self {
        let all = |is: fn(&Value) -> bool| values.iter().all(is);
        if all(Value::is_bool) {
            Self::Boolean
        } else if all(Value::is_integer) {
            Self::Integer
        } else if all(|value| value.is_integer() || value.is_float()) {
            Self::Number
        } else if all(Value::is_str) {
            Self::Text
        } else {
            Self::Json
        }
    }
}

/// Converts a value of a scene file to JSON.
pub(crate) fn json(value: &Value) -> Json {
    match value {
        Value::String(text) => Json::from(text.as_str()),
        Value::Integer(number) => Json::from(*number),
        Value::Float(number) => Json::from(*number),
        Value::Boolean(truth) => Json::from(*truth),
        Value::Datetime(time) => Json::from(time.to_string()),
        Value::Array(list) => list.iter().map(json).collect(),
        Value::Table(table) => table.iter().map(|(key, value)| (key.clone(), json(value))).collect(),
    }
}
