//! A session with its pictures and keys, from files in memory.

use std::path::Path;
use std::sync::Arc;

use endowire_core::file::{Files, InMemory};
use endowire_core::vessel::{CentrelineTree, NoStore};
use endowire_core::{Error, Result};
use endowire_methods::Scene;
use endowire_play::{Input, Keys, Limits, Pictures, Session, Sharpened, Sharpening, Snapshot};
use endowire_viewer::{Backend, Image, PixelFormat, ViewSpec};

/// A session as a page shows it.
#[derive(Debug)]
pub(crate) struct Played {
    pub(crate) session: Session,
    pub(crate) keys: Keys,
    pictures: Pictures,
    /// What was seen of the room and the line when the 3D view was drawn last.
    drawn_3d: Option<(usize, Option<[f64; 3]>, u64)>,
}

/// The file that a scene's script is replaced by, where there is one.
pub(crate) const SCRIPT: &str = "script.toml";

impl Played {
    /// The scene at `path` of `files`, with the script of [`SCRIPT`] if that is among them, and pictures of so many pixels a side.
    ///
    /// # Errors
    /// As those of scenes, simulations and pictures: what is wrong in which file, by key.
    pub(crate) fn new(files: &Arc<InMemory>, path: &Path, side_px: u32) -> Result<Self> {
        let mut scene = Scene::read_of(files.clone(), path)?;
        if files.0.contains_key(Path::new(SCRIPT)) {
            scene.take_script(Path::new(SCRIPT))?;
        }
        let simulation = scene.simulation(&NoStore)?;
        let script = scene.steps(simulation.stack(), &NoStore)?;
        let view = view(&scene, path, &**files)?;
        let names = simulation.stack().instruments().iter().map(|one| one.name.clone()).collect();
        let wall = simulation.lumen().wall(&NoStore)?.clone();
        let session = Session::new(simulation, view, side_px, Limits::default())?.with_script(script);
        let pictures = Pictures::new(&scene, &session.snapshot(), wall)?;
        Ok(Self { session, keys: Keys::new(names), pictures, drawn_3d: None })
    }

    /// Takes what keys have come to.
    pub(crate) fn take(&mut self, inputs: &[Input]) {
        for input in inputs {
            // What is refused is an event of the session.
            let _ = self.session.apply(input);
        }
    }

    /// The live fluoroscopic picture of each plane, or the last one.
    ///
    /// # Errors
    /// As [`Pictures::fluoro`].
    pub(crate) fn fluoro(&mut self) -> Result<Vec<Image>> {
        self.drawn(Pictures::fluoro)
    }

    /// The same without delay: a coarse one where the room has just changed.
    ///
    /// # Errors
    /// As [`Pictures::soon`].
    pub(crate) fn soon(&mut self) -> Result<Vec<Image>> {
        self.drawn(Pictures::soon)
    }

    fn drawn(
        &mut self,
        draw: impl for<'a> FnOnce(&'a mut Pictures, &Snapshot) -> Result<&'a [Image]>,
    ) -> Result<Vec<Image>> {
        let snapshot = self.session.snapshot();
        let images = draw(&mut self.pictures, &snapshot)?.to_vec();
        if let Some(delivered) = self.pictures.delivered(&snapshot) {
            self.session.exposed(delivered);
        }
        Ok(images)
    }

    /// What the sharp picture of a room needs that has come to rest.
    ///
    /// # Errors
    /// As [`Pictures::sharpenings`].
    pub(crate) fn sharpenings(&mut self) -> Result<Vec<Sharpening>> {
        self.pictures.sharpenings(&self.session.snapshot())
    }

    /// Takes what was computed of it.
    ///
    /// # Errors
    /// As [`Pictures::sharpened`].
    pub(crate) fn sharpened(&mut self, done: Sharpened) -> Result<()> {
        self.pictures.sharpened(done)
    }

    /// The 3D view, where it is another than the last time.
    ///
    /// # Errors
    /// As [`Pictures::three_d`].
    pub(crate) fn three_d(&mut self) -> Result<Option<Image>> {
        let snapshot = self.session.snapshot();
        let seen = Some((snapshot.readout.step, snapshot.readout.tip_mm, snapshot.lab.revisions()[1]));
        if self.drawn_3d == seen {
            return Ok(None);
        }
        let image = self.pictures.three_d(&snapshot)?;
        self.drawn_3d = seen;
        Ok(Some(image))
    }

    /// What draws the fluoroscopic picture, for people; nothing before the first.
    pub(crate) fn backend(&self) -> Option<&str> {
        self.pictures.backend()
    }
}

/// The `[view]` table of a scene, with what medium flows along.
fn view(scene: &Scene, path: &Path, files: &dyn Files) -> Result<ViewSpec> {
    let mut view = ViewSpec::of_scene(scene, path)?;
    if let Some(ct) = &view.patient.ct {
        let mend = "tomograms are read by the program alone: leave [view.patient.ct] out here";
        return Err(Error::parameter("view.patient.ct.file", ct.file.display(), mend));
    }
    // No graphics processor of a page answers at once.
    view.backend = Backend::Cpu;
    // The viewer reads from a file system, and there is none.
    if let Some(tree) = view.flow.tree.take() {
        view.flow.centreline = Some(Arc::new(CentrelineTree::read_of(files, &tree)?));
    }
    Ok(view)
}

/// Paths of the files that a scene needs, its own first.
///
/// # Errors
/// As [`Scene::from_toml`].
pub(crate) fn named(text: &str, path: &Path) -> Result<Vec<String>> {
    let scene = Scene::from_toml(text, path)?;
    let view = ViewSpec::of_scene(&scene, path)?;
    let mut named = vec![path.to_owned()];
    named.extend(scene.input_paths());
    named.extend(view.flow.tree.filter(|tree| !named.contains(tree)));
    Ok(named.iter().map(|path| path.display().to_string()).collect())
}

/// Red, green, blue and alpha of each pixel.
pub(crate) fn rgba(image: Image) -> Vec<u8> {
    match image.format() {
        PixelFormat::Rgba8 => image.into_data(),
        PixelFormat::Gray8 => image.data().iter().flat_map(|grey| [*grey, *grey, *grey, 255]).collect(),
        PixelFormat::Gray16 => {
            image.data().chunks_exact(2).flat_map(|grey| [grey[0], grey[0], grey[0], 255]).collect()
        }
    }
}
