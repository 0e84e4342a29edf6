//! endowire in a browser: scenes and sessions for pages and programs in JavaScript.
//!
//! Nothing is computed here. A [`Session`] takes the inputs of `endowire_play` as objects, advances in ticks, and
//! gives readouts, shapes and pictures, and for a training subject its task and its score. A [`Surface`] checks
//! whether a file is usable as a vessel. There is no file system: files are a `Map` from paths to bytes, and
//! [`missing_files`] lists those that are needed.

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

/// Prints panics to the console; the module is unusable after a panic.
#[wasm_bindgen(start)]
fn start() {
    std::panic::set_hook(Box::new(|panic| console_error(&panic.to_string())));
}

/// A JavaScript error with the message of an error of the core.
fn thrown(error: impl std::fmt::Display) -> JsError {
    JsError::new(&error.to_string())
}

/// Converts a value to a JavaScript object, through JSON.
fn object(value: &impl Serialize) -> Result<JsValue, JsError> {
    let text = serde_json::to_string(value).map_err(thrown)?;
    js_sys::JSON::parse(&text).map_err(|_| thrown("an object cannot be made"))
}

/// Converts a JavaScript object to a value, through JSON.
fn value<T: DeserializeOwned>(object: &JsValue) -> Result<T, JsError> {
    let text = js_sys::JSON::stringify(object).ok().and_then(|text| text.as_string());
    serde_json::from_str(&text.unwrap_or_default()).map_err(thrown)
}

/// Paths of the files that a scene or a training subject at `path` needs and that are missing in `files`. Files may
/// name further files, so call it again with these added until nothing is missing. `new Session` looks up files by
/// these paths.
///
/// # Errors
/// Names file, line and key of an error in one of the files.
#[wasm_bindgen(js_name = missingFiles, unchecked_return_type = "string[]")]
pub fn missing_files(
    #[wasm_bindgen(unchecked_param_type = "Map<string, Uint8Array>")] files: &Map,
    path: &str,
) -> Result<Array, JsError> {
    let files = Arc::new(files::of_map(files)?);
    let missing = opened::missing(&files, Path::new(path)).map_err(thrown)?;
    Ok(missing.iter().map(|path| JsValue::from(path.display().to_string())).collect())
}

/// The side in pixels for pictures that are shown `shown` pixels a side, if one of `side` takes `frame_ms` milliseconds:
/// as large as shown, or as 30 a second can be drawn of.
#[wasm_bindgen(js_name = fittingSide)]
pub fn fitting_side(shown: u32, side: u32, frame_ms: f64) -> u32 {
    endowire_play::fitting_side(shown, side, frame_ms)
}

/// Keys and gamepad controls of a session with their effects, for display.
///
/// # Errors
/// None in a working browser.
#[wasm_bindgen(unchecked_return_type = "{ keyboard: [string, string][], gamepad: [string, string][] }")]
pub fn keys() -> Result<JsValue, JsError> {
    #[derive(Serialize)]
    struct Keys {
        keyboard: &'static [(&'static str, &'static str)],
        gamepad: &'static [(&'static str, &'static str)],
    }
    object(&Keys { keyboard: endowire_play::KEYS, gamepad: endowire_play::PAD })
}
