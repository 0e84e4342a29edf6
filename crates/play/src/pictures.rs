//! Draws the images of a cath lab: the live image of each plane, or the last one held, and the 3D view.
//!
//! The static part of a frame takes 0.1 s or more after a change of the room; a coarse picture of it takes a fifth of
//! that. Callers that draw on a clock use [`Pictures::soon`] and carry out [`Sharpening`] on another thread; all
//! others wait ([`Pictures::fluoro`]).

use endowire_core::shape::Shape;
use endowire_core::vessel::Wall;
use endowire_core::{Error, Result};
use endowire_methods::Scene;
use endowire_viewer::{Brightness, Image, Moment, Pushed, Renderer, Seen, ViewSpec};

use crate::session::Snapshot;

/// Ratio of picture size to coarse picture size: 128 of 512 pixels, which is enough to see a wire.
const COARSER: u32 = 4;
/// Number of frames for which the room must be unchanged before it is drawn sharply.
const REST: u32 = 3;

/// Grey of a 3D view that is hidden.
const HIDDEN: u8 = 40;

/// The pictures of a session.
#[derive(Debug)]
pub struct Pictures {
    pushed: Pushed,
    wall: Wall,
    planes: Vec<Plane>,
    three_d: Option<(u64, Renderer)>,
    /// The last live image of each plane.
    held: Vec<Image>,
    /// Revision of the room in the last frame, and for how many frames it has been unchanged.
    rested: (u64, u32),
    /// The last live frame: a pulse shows the motion since then.
    before: Option<Before>,
}

/// What a live frame has shown.
#[derive(Debug)]
struct Before {
    shape: Shape,
    inserted_mm: Vec<f64>,
    time_s: f64,
    step: usize,
}

impl Before {
    /// As the moment before a snapshot; `None` where the session has gone back to an earlier step, which is no motion.
    fn of(&self, snapshot: &Snapshot) -> Option<Seen<'_>> {
        let goes_on = self.step <= snapshot.readout.step;
        goes_on.then_some(Seen { shape: &self.shape, inserted_mm: &self.inserted_mm, time_s: self.time_s })
    }
}

/// The renderers of one plane, each with the revision of the room for which it was made.
#[derive(Debug, Default)]
struct Plane {
    sharp: Option<(u64, Renderer)>,
    coarse: Option<(u64, Renderer)>,
    /// Whether the sharp renderer is being updated elsewhere.
    away: bool,
    /// State of the brightness control in the last frame, which that of the next room goes on from.
    brightness: Option<Brightness>,
}

/// The computation of a sharp picture after a change of the room.
#[derive(Debug)]
pub struct Sharpening {
    plane: usize,
    revision: u64,
    spec: ViewSpec,
    renderer: Renderer,
}

/// Its result.
#[derive(Debug)]
pub struct Sharpened {
    plane: usize,
    made: Result<(u64, Renderer)>,
}

impl Sharpening {
    /// Computes the static part of the frames.
    pub fn carry_out(self) -> Sharpened {
        let Self { plane, revision, spec, mut renderer } = self;
        let made = renderer.change(&spec).and_then(|()| renderer.prepare());
        Sharpened { plane, made: made.map(|()| (revision, renderer)) }
    }

    /// The same on a graphics processor, awaiting its answers.
    #[cfg(feature = "gpu")]
    pub async fn carry_out_on(self, graphics: &endowire_viewer::Graphics) -> Sharpened {
        let Self { plane, revision, spec, mut renderer } = self;
        let made = async {
            renderer.change(&spec)?;
            renderer.prepare_on(graphics).await?;
            Ok((revision, renderer))
        };
        Sharpened { plane, made: made.await }
    }
}

impl Pictures {
    /// Pictures of a scene's instruments in its wall.
    ///
    /// # Errors
    /// As [`Pushed::new`].
    pub fn new(scene: &Scene, first: &Snapshot, wall: Wall) -> Result<Self> {
        let pushed = Pushed::new(scene, first.lab.fluoro())?;
        Ok(Self { pushed, wall, planes: vec![], three_d: None, held: vec![], rested: (0, 0), before: None })
    }

    /// The fluoroscopic picture of each plane: live while the pedal is pressed, otherwise the last ones; empty before
    /// the first.
    ///
    /// # Errors
    /// As [`Renderer::new`] and [`Renderer::render_at`]; the previous pictures are kept.
    pub fn fluoro(&mut self, snapshot: &Snapshot) -> Result<&[Image]> {
        if snapshot.lab.is_live() {
            self.sharpen(snapshot)?;
            self.held = self.drawn(snapshot)?;
        }
        Ok(&self.held)
    }

    /// The same without delay: coarse pictures after a change of the room, until the result of [`Self::sharpenings`]
    /// is handed to [`Self::sharpened`].
    ///
    /// # Errors
    /// As [`Self::fluoro`].
    pub fn soon(&mut self, snapshot: &Snapshot) -> Result<&[Image]> {
        if snapshot.lab.is_live() {
            let revision = snapshot.lab.revisions()[0];
            let rested = if self.rested.0 == revision { self.rested.1 + 1 } else { 0 };
            self.rested = (revision, rested);
            self.held = self.drawn(snapshot)?;
        }
        Ok(&self.held)
    }

    /// The computations needed for sharp pictures, whose results go to [`Self::sharpened`]; empty while the room
    /// keeps changing.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn sharpenings(&mut self, snapshot: &Snapshot) -> Result<Vec<Sharpening>> {
        let revision = snapshot.lab.revisions()[0];
        if !snapshot.lab.is_live() || self.rested.0 != revision || self.rested.1 < REST {
            return Ok(vec![]);
        }
        let mut all = Vec::new();
        for (index, (plane, spec)) in self.planes.iter_mut().zip(snapshot.lab.fluoro().planes()).enumerate() {
            if plane.away || plane.sharp.as_ref().is_some_and(|(drawn, _)| *drawn == revision) {
                continue;
            }
            let renderer = match (plane.sharp.take(), &plane.coarse) {
                (Some((_, renderer)), _) => renderer,
                (None, Some((_, coarse))) => coarse.beside(&spec)?,
                (None, None) => Renderer::of_wall(&spec, &self.wall)?,
            };
            plane.away = true;
            all.push(Sharpening { plane: index, revision, spec, renderer });
        }
        Ok(all)
    }

    /// Takes the result of such a computation.
    ///
    /// # Errors
    /// As [`Renderer::change`]; the plane stays coarse.
    pub fn sharpened(&mut self, done: Sharpened) -> Result<()> {
        if let Some(plane) = self.planes.get_mut(done.plane) {
            plane.away = false;
            plane.sharp = Some(done.made?);
        }
        Ok(())
    }

    /// Prepares the sharp renderer of each plane.
    fn sharpen(&mut self, snapshot: &Snapshot) -> Result<()> {
        let revision = snapshot.lab.revisions()[0];
        let specs = snapshot.lab.fluoro().planes();
        self.planes.resize_with(specs.len(), Plane::default);
        for (plane, spec) in self.planes.iter_mut().zip(specs) {
            made(&mut plane.sharp, None, (revision, &spec), &self.wall)?.prepare()?;
        }
        Ok(())
    }

    /// Draws each plane, sharply if its sharp renderer is up to date, otherwise coarsely.
    fn drawn(&mut self, snapshot: &Snapshot) -> Result<Vec<Image>> {
        let revision = snapshot.lab.revisions()[0];
        let specs = snapshot.lab.fluoro().planes();
        self.planes.resize_with(specs.len(), Plane::default);
        let before = self.before.take();
        let moment = moment(snapshot, before.as_ref().and_then(|before| before.of(snapshot)));
        let mut images = Vec::with_capacity(specs.len());
        for (plane, spec) in self.planes.iter_mut().zip(specs) {
            let sharp = plane.sharp.as_mut().filter(|(drawn, _)| *drawn == revision);
            let renderer = match sharp {
                Some((_, renderer)) => renderer,
                None => {
                    let size_px = spec.size_px.map(|n| n.div_ceil(COARSER));
                    let coarse = ViewSpec { size_px, ..spec };
                    let sharp = plane.sharp.as_ref().map(|(_, renderer)| renderer);
                    made(&mut plane.coarse, sharp, (revision, &coarse), &self.wall)?
                }
            };
            if let Some(state) = plane.brightness {
                renderer.brighten(state)?;
            }
            let image = renderer.draw(&mut self.pushed, &moment)?.fluoro;
            plane.brightness = renderer.brightness();
            images.push(image.ok_or_else(|| Error::parameter("view.views", "fluoro", "was not drawn"))?);
        }
        self.before = Some(Before {
            shape: snapshot.shape.clone(),
            inserted_mm: snapshot.inserted_mm.clone(),
            time_s: snapshot.moment.time_s,
            step: snapshot.readout.step,
        });
        Ok(images)
    }

    /// The 3D view; blank while an exam hides it.
    ///
    /// # Errors
    /// As [`Renderer::new`] and [`Renderer::render_at`].
    pub fn three_d(&mut self, snapshot: &Snapshot) -> Result<Image> {
        if snapshot.hides_three_d() {
            return Ok(Image::blank(snapshot.lab.three_d().size_px, HIDDEN));
        }
        let room = (snapshot.lab.revisions()[1], snapshot.lab.three_d());
        let renderer = made(&mut self.three_d, None, room, &self.wall)?;
        let image = renderer.draw(&mut self.pushed, &moment(snapshot, None))?.three_d;
        image.ok_or_else(|| Error::parameter("view.views", "3d", "was not drawn"))
    }

    /// The same begun on a graphics processor, whose answer is awaited.
    ///
    /// # Errors
    /// As [`Self::three_d`] and [`Renderer::three_d_on`].
    #[cfg(feature = "gpu")]
    pub fn three_d_on(
        &mut self,
        snapshot: &Snapshot,
        graphics: &endowire_viewer::Graphics,
    ) -> Result<endowire_viewer::Drawing> {
        let room = (snapshot.lab.revisions()[1], snapshot.lab.three_d());
        let renderer = made(&mut self.three_d, None, room, &self.wall)?;
        let moment = moment(snapshot, None);
        renderer.set(&moment)?;
        renderer.three_d_on(graphics, &moment.devices(&mut self.pushed)?)
    }

    /// Draws the 3D view anew, for instance on another graphics processor than before.
    pub fn forget_three_d(&mut self) {
        self.three_d = None;
    }

    /// Name of the backend that draws the fluoroscopic picture.
    pub fn backend(&self) -> Option<&str> {
        let plane = self.planes.first()?;
        plane.sharp.as_ref().or(plane.coarse.as_ref()).map(|(_, renderer)| renderer.backend())
    }
}

/// The renderer of a room, updated from the previous room, or created with data shared with `beside`.
fn made<'a>(
    place: &'a mut Option<(u64, Renderer)>,
    beside: Option<&Renderer>,
    (revision, spec): (u64, &ViewSpec),
    wall: &Wall,
) -> Result<&'a mut Renderer> {
    match (&mut *place, beside) {
        (Some((drawn, renderer)), _) if *drawn != revision => {
            renderer.change(spec)?;
            *drawn = revision;
        }
        (Some(_), _) => {}
        (none, Some(other)) => *none = Some((revision, other.beside(spec)?)),
        (none, None) => *none = Some((revision, Renderer::of_wall(spec, wall)?)),
    }
    let none = || Error::parameter("view.views", "none", "nothing is drawn");
    place.as_mut().map(|(_, renderer)| renderer).ok_or_else(none)
}

/// The moment of a snapshot.
fn moment<'a>(snapshot: &'a Snapshot, before: Option<Seen<'a>>) -> Moment<'a> {
    Moment {
        frame: snapshot.moment,
        shape: &snapshot.shape,
        inserted_mm: &snapshot.inserted_mm,
        coils: &snapshot.coils,
        contacts: &snapshot.contacts,
        displacement: snapshot.displacement.as_ref(),
        before,
    }
}
