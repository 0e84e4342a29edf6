//! Tables of options as Python dictionaries, read like those of scene files.

use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::InputError;

/// Reads a dictionary; `name` is its name in errors.
pub(crate) fn read<T: DeserializeOwned>(name: &str, table: &Bound<'_, PyAny>) -> PyResult<T> {
    typed(name, value(name, table)?)
}

/// The values of `defaults`, overridden key by key and table by table by those of a dictionary.
pub(crate) fn read_over<T: DeserializeOwned + Serialize>(
    name: &str,
    defaults: &T,
    table: &Bound<'_, PyAny>,
) -> PyResult<T> {
    let mut all = serde_json::to_value(defaults).map_err(|e| refused(name, &e))?;
    overlay(&mut all, value(name, table)?);
    typed(name, all)
}

/// A document as dictionaries, lists and numbers.
pub(crate) fn write<'py>(py: Python<'py>, document: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(document).map_err(|e| refused("result", &e))?;
    py.import("json")?.call_method1("loads", (text,))
}

fn value(name: &str, table: &Bound<'_, PyAny>) -> PyResult<Value> {
    let text: String = table.py().import("json")?.call_method1("dumps", (table,))?.extract()?;
    // Python writes NaN and Infinity, which no key accepts.
    serde_json::from_str(&text)
        .map_err(|_| InputError::new_err(format!("{name}: every number must be finite")))
}

fn typed<T: DeserializeOwned>(name: &str, value: Value) -> PyResult<T> {
    serde_json::from_value(value).map_err(|e| refused(name, &e))
}

fn refused(name: &str, error: &serde_json::Error) -> PyErr {
    InputError::new_err(format!("{name}: {error}"))
}

fn overlay(below: &mut Value, above: Value) {
    match (below, above) {
        (Value::Object(below), Value::Object(above)) => {
            for (key, value) in above {
                overlay(below.entry(key).or_insert(Value::Null), value);
            }
        }
        (below, above) => *below = above,
    }
}
