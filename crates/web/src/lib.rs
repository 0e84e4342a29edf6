//! endowire in a browser: what a page, or a program in JavaScript, sees of scenes and sessions.
//!
//! Nothing is computed here. A [`Session`] takes the inputs of `endowire_play` as objects, lets time go by, and tells readouts, shapes and
//! pictures; a [`Surface`] says of a file what can be done with it. There is no file system: files are a `Map` from their paths to their bytes, and
//! [`scene_files`] tells which a scene needs.

mod files;
mod graphics;
mod pad;
mod played;
mod session;
mod surface;

use std::path::Path;

use js_sys::Array;
use serde::Serialize;
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

/// Paths of the files that a scene needs, the scene's own first: each as `new Session` looks for it.
///
/// # Errors
/// Names line and key of what is wrong in the scene's text.
#[wasm_bindgen(js_name = sceneFiles, unchecked_return_type = "string[]")]
pub fn scene_files(text: &str, path: &str) -> Result<Array, JsError> {
    let named = played::named(text, Path::new(path)).map_err(thrown)?;
    Ok(named.into_iter().map(JsValue::from).collect())
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
