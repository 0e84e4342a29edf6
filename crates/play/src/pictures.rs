//! Draws what a cath lab shows: the live image, or the last one held, and the 3D view.

use endowire_core::vessel::SurfaceMesh;
use endowire_core::{Error, Result};
use endowire_methods::Scene;
use endowire_viewer::{Image, Pushed, Renderer};

use crate::session::Snapshot;

/// Pictures of a session.
#[derive(Debug)]
pub struct Pictures {
    pushed: Pushed,
    /// The vessel, closed.
    wall: SurfaceMesh,
    fluoro: Option<(u64, Renderer)>,
    three_d: Option<(u64, Renderer)>,
    /// The last live image.
    held: Option<Image>,
}

impl Pictures {
    /// Pictures of a scene's instruments in its closed wall ([`Session::closed_wall`](crate::Session::closed_wall)).
    ///
    /// # Errors
    /// As [`Pushed::new`].
    pub fn new(scene: &Scene, first: &Snapshot, wall: SurfaceMesh) -> Result<Self> {
        let pushed = Pushed::new(scene, first.lab.fluoro())?;
        Ok(Self { pushed, wall, fluoro: None, three_d: None, held: None })
    }

    /// The fluoroscopic picture: live while the pedal is down, else the last one; none before the first.
    ///
    /// # Errors
    /// As [`Renderer::new`] and [`Renderer::render_at`]; the picture before stays.
    pub fn fluoro(&mut self, snapshot: &Snapshot) -> Result<Option<&Image>> {
        if snapshot.lab.is_live() {
            let revision = snapshot.lab.revisions()[0];
            if self.fluoro.as_ref().is_none_or(|(drawn, _)| *drawn != revision) {
                self.fluoro = Some((revision, Renderer::new(snapshot.lab.fluoro(), &self.wall)?));
            }
            let views = self.pushed.views(&snapshot.shape, &snapshot.inserted_mm);
            if let Some((_, renderer)) = &mut self.fluoro {
                self.held = renderer.render_at(&views, snapshot.moment)?.fluoro;
            }
        }
        Ok(self.held.as_ref())
    }

    /// The 3D view.
    ///
    /// # Errors
    /// As [`Renderer::new`] and [`Renderer::render_at`].
    pub fn three_d(&mut self, snapshot: &Snapshot) -> Result<Image> {
        let revision = snapshot.lab.revisions()[1];
        if self.three_d.as_ref().is_none_or(|(drawn, _)| *drawn != revision) {
            self.three_d = Some((revision, Renderer::new(snapshot.lab.three_d(), &self.wall)?));
        }
        let views = self.pushed.views(&snapshot.shape, &snapshot.inserted_mm);
        let image = self.three_d.as_mut().and_then(|(_, renderer)| {
            renderer.show_contacts(&snapshot.contacts);
            renderer.render_at(&views, snapshot.moment).map(|frames| frames.three_d).transpose()
        });
        image.unwrap_or_else(|| Err(Error::parameter("view.views", "3d", "was not drawn")))
    }

    /// What draws the fluoroscopic picture, for people.
    pub fn backend(&self) -> Option<&str> {
        self.fluoro.as_ref().map(|(_, renderer)| renderer.backend())
    }
}
