//! The class `Graphics` of the JavaScript package: the browser's graphics processor by WebGPU.

use std::rc::Rc;

use wasm_bindgen::prelude::*;

use crate::thrown;

/// A graphics processor.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Graphics(Rc<endowire_viewer::Graphics>);

#[wasm_bindgen]
impl Graphics {
    /// Opens the browser's graphics processor.
    ///
    /// # Errors
    /// Why there is none.
    pub async fn open() -> Result<Graphics, JsError> {
        endowire_viewer::Graphics::open().await.map(|graphics| Self(Rc::new(graphics))).map_err(thrown)
    }

    /// Its name, for display.
    #[wasm_bindgen(getter)]
    pub fn name(&self) -> String {
        self.0.name().to_owned()
    }
}

impl Graphics {
    pub(crate) fn shared(&self) -> Rc<endowire_viewer::Graphics> {
        self.0.clone()
    }
}
