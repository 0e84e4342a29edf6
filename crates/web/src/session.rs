//! The class `Session` of the JavaScript package.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

use endowire_play::{Input, Modifiers, Pad, Sharpened};
use endowire_report::Frame;
use endowire_viewer::Image;
use js_sys::{Array, Map};
use serde::Deserialize;
use wasm_bindgen::Clamped;
use wasm_bindgen::prelude::*;

use crate::graphics::Graphics;
use crate::played::{Played, rgba};
use crate::subject::{Graded, Task};
use crate::{files, object, pad, thrown, value};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &'static str = include_str!("types.d.ts");

/// An interactive session under fluoroscopy. Inputs and ticks go in; readouts, shapes and pictures come out. It uses
/// no clock.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Session {
    played: Played,
    pad: Pad,
    graphics: Option<Rc<endowire_viewer::Graphics>>,
    /// Sharp pictures that a graphics processor has completed.
    sharpened: Rc<RefCell<Vec<Sharpened>>>,
}

#[wasm_bindgen]
impl Session {
    /// A session of the scene or the training subject at `path` of `files`, with pictures of `side` pixels a side.
    /// The script in `script.toml`, if it is among the files, overrides the scene's own. The script of a subject
    /// cannot be played, unless it is given or the session is `watched`.
    ///
    /// # Errors
    /// Names file, line and key of an error.
    #[wasm_bindgen(constructor)]
    pub fn new(
        #[wasm_bindgen(unchecked_param_type = "Map<string, Uint8Array>")] files: &Map,
        path: &str,
        side: u32,
    ) -> Result<Session, JsError> {
        let files = Arc::new(files::of_map(files)?);
        let played = Played::new(&files, Path::new(path), side).map_err(thrown)?;
        Ok(Self { played, pad: Pad::default(), graphics: None, sharpened: Rc::default() })
    }

    /// The same session with the script that solves its subject, to be played by `{ do: "script" }`. This object
    /// becomes invalid.
    #[must_use]
    pub fn watched(self) -> Session {
        Self { played: self.played.watched(), ..self }
    }

    /// Computes sharp pictures on a graphics processor from now on.
    #[wasm_bindgen(js_name = useGraphics)]
    pub fn use_graphics(&mut self, graphics: &Graphics) {
        self.graphics = Some(graphics.shared());
    }

    /// Applies an input.
    ///
    /// # Errors
    /// A value that is out of range or a name that does not exist; nothing has changed then.
    pub fn apply(
        &mut self,
        #[wasm_bindgen(unchecked_param_type = "Input")] input: &JsValue,
    ) -> Result<(), JsError> {
        let input: Input = value(input)?;
        self.played.apply(&input).map_err(thrown)
    }

    /// Handles a key, by its `code`, that goes down, repeats while held (`again`), or goes up.
    pub fn key(&mut self, code: &str, down: bool, again: bool) {
        let inputs = self.played.keys.key(code, down, again);
        self.played.take(&inputs);
    }

    /// Handles a change of Shift or Ctrl.
    pub fn modify(&mut self, shift: bool, control: bool) {
        let inputs = self.played.keys.modify(Modifiers { shift, control });
        self.played.take(&inputs);
    }

    /// Releases all held keys, because the page has lost the keyboard focus.
    #[wasm_bindgen(js_name = letGo)]
    pub fn let_go(&mut self) {
        let inputs = self.played.keys.let_go();
        self.played.take(&inputs);
    }

    /// Handles the state of a gamepad: indices of pressed buttons in the standard layout, and the deflections of the
    /// left stick upwards and of the right stick to the right and upwards, −1 to 1.
    pub fn gamepad(&mut self, pressed: &[u8], up: f64, right: f64, bend: f64) {
        let before = std::mem::replace(&mut self.pad, pad::held(pressed, [up, right, bend]));
        let inputs = self.played.keys.pad(&before, &self.pad);
        self.played.take(&inputs);
    }

    /// Draws pictures of `side` pixels a side from now on.
    ///
    /// # Errors
    /// A side that is not 1 to 4096.
    #[wasm_bindgen(js_name = showAt)]
    pub fn show_at(&mut self, side: u32) -> Result<(), JsError> {
        self.played.session.show_at(side).map_err(thrown)
    }

    /// Advances by 1/60 s.
    pub fn tick(&mut self) {
        self.played.tick();
    }

    /// The readout for the operator.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(unchecked_return_type = "Readout")]
    pub fn readout(&self) -> Result<JsValue, JsError> {
        object(&self.played.session.readout())
    }

    /// Nodes of the common line of all instruments, from the sheath to the tip: x, y, z of each, mm.
    pub fn positions(&self) -> Vec<f64> {
        self.played
            .session
            .simulation()
            .shape()
            .positions_mm
            .iter()
            .flat_map(|at| [at.x, at.y, at.z])
            .collect()
    }

    /// Wall contacts: position (mm) and force on the wall (N), six numbers each.
    pub fn contacts(&self) -> Vec<f64> {
        let contacts = &self.played.session.simulation().report().contacts;
        contacts
            .iter()
            .flat_map(|one| {
                let (at, force) = (one.position_mm, one.total_n());
                [at.x, at.y, at.z, force.x, force.y, force.z]
            })
            .collect()
    }

    /// The fluoroscopic picture of each plane: live while the pedal is pressed, otherwise the last ones.
    ///
    /// # Errors
    /// What cannot be drawn, by key.
    #[wasm_bindgen(unchecked_return_type = "Picture[]")]
    pub fn fluoro(&mut self) -> Result<Array, JsError> {
        self.played.fluoro().map_err(thrown)?.into_iter().map(picture).collect()
    }

    /// The same without delay: coarse pictures after a change of the room, until it no longer changes and `sharpen`
    /// was called.
    ///
    /// # Errors
    /// What cannot be drawn, by key.
    #[wasm_bindgen(js_name = fluoroSoon, unchecked_return_type = "Picture[]")]
    pub fn fluoro_soon(&mut self) -> Result<Array, JsError> {
        for done in self.sharpened.take() {
            self.played.sharpened(done).map_err(thrown)?;
        }
        self.played.soon().map_err(thrown)?.into_iter().map(picture).collect()
    }

    /// Computes the sharp pictures once the room no longer changes: asynchronously on a graphics processor, otherwise
    /// at once, which takes 0.1 s or more.
    ///
    /// # Errors
    /// What cannot be drawn, by key.
    pub fn sharpen(&mut self) -> Result<(), JsError> {
        for one in self.played.sharpenings().map_err(thrown)? {
            match &self.graphics {
                Some(graphics) => {
                    let (graphics, sharpened) = (graphics.clone(), self.sharpened.clone());
                    wasm_bindgen_futures::spawn_local(async move {
                        let done = one.carry_out_on(&graphics).await;
                        sharpened.borrow_mut().push(done);
                    });
                }
                None => self.played.sharpened(one.carry_out()).map_err(thrown)?,
            }
        }
        Ok(())
    }

    /// Draws the 3D view on a graphics processor from now on; if that fails, on the processor.
    #[wasm_bindgen(js_name = draw3DBy)]
    pub fn draw_3d_by(&mut self, graphics: &Graphics) {
        self.played.three_d_by(graphics.shared());
    }

    /// Draws the 3D view on the processor from now on, which is the default.
    #[wasm_bindgen(js_name = draw3DHere)]
    pub fn draw_3d_here(&mut self) {
        self.played.three_d_here();
    }

    /// The 3D view; `undefined` if it is unchanged. From a graphics processor it arrives in a later call.
    ///
    /// # Errors
    /// What cannot be drawn, by key.
    #[wasm_bindgen(js_name = threeD, unchecked_return_type = "Picture | undefined")]
    pub fn three_d(&mut self) -> Result<JsValue, JsError> {
        match self.played.three_d().map_err(thrown)? {
            Some(image) => picture(image),
            None => Ok(JsValue::UNDEFINED),
        }
    }

    /// Name of the backend that draws the 3D view.
    #[wasm_bindgen(js_name = backend3D)]
    pub fn backend_3d(&self) -> String {
        self.played.three_d_backend()
    }

    /// Name of the backend that draws the fluoroscopic pictures.
    pub fn backend(&self) -> Option<String> {
        self.played.backend().map(str::to_owned)
    }

    /// The record of instruments, beam and injector, tick by tick: the `record` of a `*.session.json`, as measured by
    /// `endowire assess`.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(unchecked_return_type = "SessionRecord")]
    pub fn record(&self) -> Result<JsValue, JsError> {
        object(self.played.session.record())
    }

    /// The text to write above the `script` in its file `name`: its scene, with a path relative to `folder`, and the
    /// command that carries it out.
    #[wasm_bindgen(js_name = scriptHead)]
    pub fn script_head(&self, folder: &str, name: &str) -> String {
        self.played.script_head(Path::new(folder), Path::new(name))
    }

    /// The text of a `*.session.json`, as written by `endowire play` and read by `endowire assess`: the scene's file,
    /// relative to `folder`, its overridden keys, the time of recording, if given (`Date.now() / 1000`), and the
    /// `record`.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(js_name = sessionFile)]
    pub fn session_file(&self, folder: &str, recorded_unix_s: Option<f64>) -> Result<String, JsError> {
        let recorded_unix_s = recorded_unix_s.map(|s| s as u64);
        serde_json::to_string(&self.played.session_file(Path::new(folder), recorded_unix_s)).map_err(thrown)
    }

    /// The task, if the session is a training subject.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(unchecked_return_type = "Task | null")]
    pub fn task(&self) -> Result<JsValue, JsError> {
        let standing = self.played.session.standing();
        object(&standing.as_ref().map(|standing| Task::of(&standing.task)))
    }

    /// The score of a training subject; if it has not ended, that of the session so far.
    ///
    /// # Errors
    /// None in a working browser.
    #[wasm_bindgen(unchecked_return_type = "Score | null")]
    pub fn score(&self) -> Result<JsValue, JsError> {
        let score = self.played.session.score();
        object(&score.as_deref().map(Graded::of))
    }

    /// A report of the session so far: one self-contained HTML page, as `endowire report` makes it of a recording,
    /// with shapes in 3D, forces, events, and these pictures (PNG in Base64).
    ///
    /// # Errors
    /// No step was carried out yet; invalid pictures.
    pub fn report(
        &self,
        #[wasm_bindgen(unchecked_param_type = "{ view: string; png: string }[]")] frames: &JsValue,
    ) -> Result<String, JsError> {
        #[derive(Deserialize)]
        struct Picture {
            view: String,
            png: String,
        }
        let step = self.played.session.steps();
        let frame = |Picture { view, png }| Frame { step, view, png };
        let frames: Vec<Picture> = value(frames)?;
        let run = self.played.report(frames.into_iter().map(frame).collect()).map_err(thrown)?;
        endowire_report::run_page(&run).map_err(thrown)
    }

    /// All motions and injections as the text of a script, which `endowire run` repeats to the bit.
    pub fn script(&self) -> String {
        self.played.session.script()
    }
}

/// Converts a picture to a JavaScript object.
pub(crate) fn picture(image: Image) -> Result<JsValue, JsError> {
    let picture = js_sys::Object::new();
    let (width, height) = (image.width(), image.height());
    for (key, value) in [
        ("width", JsValue::from(width)),
        ("height", JsValue::from(height)),
        ("data", JsValue::from(Clamped(rgba(image)))),
    ] {
        js_sys::Reflect::set(&picture, &key.into(), &value)
            .map_err(|_| thrown("a picture cannot be made"))?;
    }
    Ok(picture.into())
}
