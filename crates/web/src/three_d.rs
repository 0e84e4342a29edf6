//! The 3D view of a session: drawn at once by the processor, or asynchronously by a graphics processor.

use std::cell::RefCell;
use std::rc::Rc;

use endowire_core::{Error, Result};
use endowire_play::{Pictures, Snapshot};
use endowire_viewer::{Graphics, Image};

/// State shown by a frame: the step, the tip, the room, and whether it is hidden.
type Seen = (usize, Option<[f64; 3]>, u64, bool);

/// Draws the 3D view when its state has changed.
#[derive(Debug)]
pub(crate) struct ThreeD {
    seen: Option<Seen>,
    graphics: Option<OnGraphics>,
    /// Why a graphics processor no longer draws it.
    failure: Option<String>,
}

/// Drawing on a graphics processor.
#[derive(Debug)]
struct OnGraphics {
    graphics: Rc<Graphics>,
    answer: Rc<RefCell<Option<Result<Image>>>>,
    /// Whether a frame is being drawn.
    waits: bool,
}

impl ThreeD {
    pub(crate) fn new() -> Self {
        Self { seen: None, graphics: None, failure: None }
    }

    /// Draws on a graphics processor from now on.
    pub(crate) fn draw_by(&mut self, graphics: Rc<Graphics>, pictures: &mut Pictures) {
        pictures.forget_three_d();
        self.graphics = Some(OnGraphics { graphics, answer: Rc::default(), waits: false });
        self.seen = None;
    }

    /// Draws on the processor from now on.
    pub(crate) fn draw_here(&mut self) {
        (self.graphics, self.seen) = (None, None);
    }

    /// Name of the backend.
    pub(crate) fn backend(&self) -> String {
        match (&self.graphics, &self.failure) {
            (Some(on), _) => on.graphics.name().to_owned(),
            (None, Some(failure)) => format!("CPU reference (adapter failed: {failure})"),
            (None, None) => "CPU reference".to_owned(),
        }
    }

    /// The next frame. From a graphics processor, it is the one requested earlier, once it has arrived.
    pub(crate) fn next(&mut self, snapshot: &Snapshot, pictures: &mut Pictures) -> Result<Option<Image>> {
        let hidden = snapshot.hides_three_d();
        let seen =
            Some((snapshot.readout.step, snapshot.readout.tip_mm, snapshot.lab.revisions()[1], hidden));
        if let Some(on) = self.graphics.as_mut().filter(|_| !hidden) {
            match on.next(snapshot, pictures, self.seen != seen) {
                Ok((image, asked)) => {
                    if asked {
                        self.seen = seen;
                    }
                    return Ok(image);
                }
                Err(Error::Computation(failure)) => {
                    self.failure = Some(failure);
                    self.draw_here();
                }
                Err(error) => return Err(error),
            }
        }
        if self.seen == seen {
            return Ok(None);
        }
        let image = pictures.three_d(snapshot)?;
        self.seen = seen;
        Ok(Some(image))
    }
}

impl OnGraphics {
    /// The frame that has arrived, if any, and whether another one was requested.
    fn next(
        &mut self,
        snapshot: &Snapshot,
        pictures: &mut Pictures,
        is_new: bool,
    ) -> Result<(Option<Image>, bool)> {
        let arrived = self.answer.take();
        self.waits &= arrived.is_none();
        let image = arrived.transpose()?;
        let asks = is_new && !self.waits;
        if asks {
            let drawing = pictures.three_d_on(snapshot, &self.graphics)?;
            let answer = self.answer.clone();
            self.waits = true;
            wasm_bindgen_futures::spawn_local(async move {
                let image = drawing.image().await;
                answer.replace(Some(image));
            });
        }
        Ok((image, asks))
    }
}
