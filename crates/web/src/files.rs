//! A JavaScript `Map` as a set of files.

use endowire_core::file::InMemory;
use js_sys::{Map, Uint8Array};
use wasm_bindgen::prelude::*;

use crate::thrown;

/// Converts a map from paths to contents.
///
/// # Errors
/// A key that is not a string, or a value that is not a `Uint8Array`.
pub(crate) fn of_map(map: &Map) -> Result<InMemory, JsError> {
    let mut files = InMemory::default();
    for entry in map.entries() {
        let entry = js_sys::Array::from(&entry.map_err(|_| thrown("files: is no Map"))?);
        let path = entry.get(0).as_string().ok_or_else(|| thrown("files: a path is no string"))?;
        let bytes = entry.get(1).dyn_into::<Uint8Array>();
        let bytes = bytes.map_err(|_| thrown(format!("files: {path}: must be a Uint8Array")))?;
        files.0.insert(path.into(), bytes.to_vec());
    }
    Ok(files)
}
