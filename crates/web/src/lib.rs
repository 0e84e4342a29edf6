//! endowire in a browser: what a page, or a program in JavaScript, sees of scenes and sessions.
//!
//! Nothing is computed here. A [`Session`] takes the inputs of `endowire_play` as objects, lets time go by, and tells readouts, shapes and
//! pictures, and of a training subject its task and its score; a [`Surface`] says of a file what can be done with it. There is no file system: files are a
//! `Map` from their paths to their bytes, and [`missing_files`] tells which are needed.

mod files;
mod graphics;
mod opened;
mod pad;
mod played;
mod session;
mod subject;
mod surface;
mod three_d;

use std::path::Path;
use std::sync::Arc;

use js_sys::{Array, Map};
use serde::Serialize;
use serde::de::DeserializeOwned;
use wasm_bindgen::prelude::*;

pub use graphics::Graphics;
pub use session::Session;
pub use surface::Surface;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn console_error(text: &str);
}

/// Has a panic tell the console what it was; the module is of no use after one.
#[wasm_bindgen(start)]
fn start() {
    std::panic::set_hook(Box::new(|panic| console_error(&panic.to_string())));
}

/// An error as JavaScript throws it, in the words of the core.
fn thrown(error: impl std::fmt::Display) -> JsError {
    JsError::new(&error.to_string())
}

/// A value as the object that its JSON says.
fn object(value: &impl Serialize) -> Result<JsValue, JsError> {
    let text = serde_json::to_string(value).map_err(thrown)?;
    js_sys::JSON::parse(&text).map_err(|_| thrown("an object cannot be made"))
}

/// The value that the JSON of an object says.
fn value<T: DeserializeOwned>(object: &JsValue) -> Result<T, JsError> {
    let text = js_sys::JSON::stringify(object).ok().and_then(|text| text.as_string());
    serde_json::from_str(&text.unwrap_or_default()).map_err(thrown)
}

/// Paths of the files that a scene or a training subject at `path` needs and that are not among `files`, as far as those tell: ask again with
/// these until nothing is missing. Each path is as `new Session` looks for it.
///
/// # Errors
/// Names file, line and key of what is wrong in one of them.
#[wasm_bindgen(js_name = missingFiles, unchecked_return_type = "string[]")]
pub fn missing_files(
    #[wasm_bindgen(unchecked_param_type = "Map<string, Uint8Array>")] files: &Map,
    path: &str,
) -> Result<Array, JsError> {
    let files = Arc::new(files::of_map(files)?);
    let missing = opened::missing(&files, Path::new(path)).map_err(thrown)?;
    Ok(missing.iter().map(|path| JsValue::from(path.display().to_string())).collect())
}

/// Keys of a session with what they do, for people: of the keyboard, and of a gamepad.
///
/// # Errors
/// None in a browser that is whole.
#[wasm_bindgen(unchecked_return_type = "{ keyboard: [string, string][], gamepad: [string, string][] }")]
pub fn keys() -> Result<JsValue, JsError> {
    #[derive(Serialize)]
    struct Keys {
        keyboard: &'static [(&'static str, &'static str)],
        gamepad: &'static [(&'static str, &'static str)],
    }
    object(&Keys { keyboard: endowire_play::KEYS, gamepad: endowire_play::PAD })
}
