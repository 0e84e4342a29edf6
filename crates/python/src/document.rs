//! Tables of options as Python dictionaries, read like those of scene files.

use std::path::PathBuf;

use endowire_core::input::{nearest, plain};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyList, PyMapping, PyString, PyTuple};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::arrays::{DEEPEST, MOST_ITEMS, too_many};
use crate::error::{InputError, refuse};

/// Reads a dictionary; `name` is its name in errors.
pub(crate) fn read<T: DeserializeOwned + Serialize>(name: &str, table: &Bound<'_, PyAny>) -> PyResult<T> {
    typed(name, Value::Object(keys(name, table)?))
}

/// Reads a dictionary whose `key` is `choice` if absent.
pub(crate) fn read_choice<T: DeserializeOwned + Serialize>(
    name: &str,
    table: &Bound<'_, PyAny>,
    key: &str,
    choice: &str,
) -> PyResult<T> {
    let mut keys = keys(name, table)?;
    keys.entry(key).or_insert_with(|| choice.into());
    typed(name, Value::Object(keys))
}

/// Reads a list of dictionaries.
pub(crate) fn read_list<T: DeserializeOwned + Serialize>(
    name: &str,
    list: &Bound<'_, PyAny>,
) -> PyResult<Vec<T>> {
    let Value::Array(tables) = value(name, list, DEEPEST)? else {
        return Err(refuse(name, list.repr()?, "must be a list of dictionaries"));
    };
    let typed_at = |(index, table): (usize, Value)| {
        let name = format!("{name}[{index}]");
        match table {
            Value::Object(_) => typed(&name, table),
            other => Err(refuse(&name, other, A_TABLE)),
        }
    };
    tables.into_iter().enumerate().map(typed_at).collect()
}

/// The values of `defaults`, overridden key by key and table by table by those of a dictionary.
pub(crate) fn read_over<T: DeserializeOwned + Serialize>(
    name: &str,
    defaults: &T,
    table: &Bound<'_, PyAny>,
) -> PyResult<T> {
    let mut all = serde_json::to_value(defaults).map_err(|e| refused(name, &e))?;
    overlay(&mut all, Value::Object(keys(name, table)?));
    typed(name, all)
}

/// A document as dictionaries, lists and numbers.
pub(crate) fn write<'py>(py: Python<'py>, document: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(document).map_err(|e| refused("result", &e))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// The keys and values of a dictionary.
fn keys(name: &str, table: &Bound<'_, PyAny>) -> PyResult<Map<String, Value>> {
    match value(name, table, DEEPEST)? {
        Value::Object(keys) => Ok(keys),
        _ => Err(refuse(name, table.repr()?, A_TABLE)),
    }
}

const A_TABLE: &str = "must be a dictionary of keys and values";

/// What was given as a value of a document: numbers, text, lists and dictionaries, also those of numpy, and paths.
/// `name` is that of the key, and `depth` how deeply it may be nested.
fn value(name: &str, object: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth == 0 {
        return Err(InputError::new_err(format!(
            "{name}: is nested more than {DEEPEST} times: give a plain value"
        )));
    }
    if object.is_none() {
        return Ok(Value::Null);
    }
    if let Ok(truth) = object.cast::<PyBool>() {
        return Ok(truth.is_true().into());
    }
    if object.is_instance_of::<PyInt>() {
        let natural = object.extract::<u64>().map(Value::from);
        let number = natural.or_else(|_| object.extract::<i64>().map(Value::from));
        return number.or_else(|_| Err(refuse(name, object.str()?, "is too large a number")));
    }
    if let Ok(number) = object.cast::<PyFloat>() {
        let number = number.value();
        // No key accepts NaN or infinity.
        return match number.is_finite() {
            true => Ok(number.into()),
            false => Err(refuse(name, number, "every number must be finite")),
        };
    }
    if let Ok(text) = object.cast::<PyString>() {
        return text.extract::<String>().map(Value::from);
    }
    if let Ok(list) = object.cast::<PyList>() {
        return items(name, list.iter(), depth);
    }
    if let Ok(list) = object.cast::<PyTuple>() {
        return items(name, list.iter(), depth);
    }
    if let Ok(table) = object.cast::<PyMapping>() {
        return table_of(name, table, depth);
    }
    if let Ok(array) = object.cast::<PyUntypedArray>()
        && array.len() > MOST_ITEMS
    {
        return Err(too_many(name, array.len(), MOST_ITEMS));
    }
    if object.hasattr("tolist")? {
        return value(name, &object.call_method0("tolist")?, depth - 1);
    }
    match object.extract::<PathBuf>() {
        Ok(path) => Ok(path.to_string_lossy().into_owned().into()),
        Err(_) => Err(refuse(name, object.repr()?, "must be a number, text, a list or a dictionary")),
    }
}

fn items<'py>(name: &str, list: impl Iterator<Item = Bound<'py, PyAny>>, depth: usize) -> PyResult<Value> {
    let each = list.enumerate().map(|(index, item)| value(&format!("{name}[{index}]"), &item, depth - 1));
    each.collect::<PyResult<_>>().map(Value::Array)
}

fn table_of(name: &str, table: &Bound<'_, PyMapping>, depth: usize) -> PyResult<Value> {
    let mut keys = Map::new();
    for pair in table.items()?.iter() {
        let (key, inner) = pair.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>()?;
        let Ok(key) = key.extract::<String>() else {
            return Err(refuse(name, key.repr()?, "is no key: keys are text"));
        };
        let inner = value(&format!("{name}.{key}"), &inner, depth - 1)?;
        keys.insert(key, inner);
    }
    Ok(Value::Object(keys))
}

/// Reads a value; dictionaries must not be given as lists, whose values serde takes in the order of a type's fields.
fn typed<T: DeserializeOwned + Serialize>(name: &str, given: Value) -> PyResult<T> {
    let read: T = serde_json::from_value(given.clone()).map_err(|e| refused(name, &e))?;
    let reported = serde_json::to_value(&read).map_err(|e| refused(name, &e))?;
    refuse_lists(name, &given, &reported)?;
    Ok(read)
}

/// Refuses lists in `given` that were read as tables.
fn refuse_lists(name: &str, given: &Value, read: &Value) -> PyResult<()> {
    match (given, read) {
        (Value::Array(_), Value::Object(table)) => {
            let keys: Vec<&str> = table.keys().map(String::as_str).collect();
            let remedy = format!("must be a dictionary of keys and values: {}", keys.join(", "));
            Err(refuse(name, given, &remedy))
        }
        (Value::Array(given), Value::Array(read)) => {
            let mut each = given.iter().zip(read).enumerate();
            each.try_for_each(|(index, (given, read))| refuse_lists(&format!("{name}[{index}]"), given, read))
        }
        (Value::Object(given), Value::Object(read)) => {
            let mut each = given.iter().filter_map(|(key, given)| Some((key, given, read.get(key)?)));
            each.try_for_each(|(key, given, read)| refuse_lists(&format!("{name}.{key}"), given, read))
        }
        _ => Ok(()),
    }
}

/// The error of a reader, with the nearest right key for an unknown one.
fn refused(name: &str, error: &serde_json::Error) -> PyErr {
    let text = plain(&error.to_string());
    InputError::new_err(format!("{name}: {text}{}", nearest(&text)))
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
