//! A session with its pictures and keys, made from files in memory.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use endowire_assess::{Exam, SCHEMA, SessionFile, Site, thinnest_mm};
use endowire_core::file::{Files, InMemory};
use endowire_core::insertion::Script;
use endowire_core::methods::MethodChoice;
use endowire_core::vessel::{CentrelineTree, NoStore};
use endowire_core::{Error, Result};
use endowire_methods::Setting;
use endowire_play::{
    Input, Keys, Limits, Pictures, Session, Sharpened, Sharpening, Snapshot, TICK_SOLVES, lumens, script_head,
};
use endowire_report::{Frame, Recorder, Run, Series, Vessel, events, setup};
use endowire_viewer::{Backend, Graphics, Image, PixelFormat, ViewSpec};
use serde_json::{Value, json};

use crate::opened::Opened;
use crate::three_d::ThreeD;

/// A session on a page.
#[derive(Debug)]
pub(crate) struct Played {
    pub(crate) session: Session,
    pub(crate) keys: Keys,
    /// File of the scene, and its overridden keys.
    scene_path: PathBuf,
    settings: Vec<Setting>,
    /// The script that was given, otherwise that of the subject or the scene.
    script: Script,
    /// Provenance of a report of the session, and its data of the steps.
    provenance: Value,
    setup: Vec<[String; 2]>,
    recorder: Recorder,
    /// Number of steps in the recorder.
    noted: usize,
    pictures: Pictures,
    three_d: ThreeD,
}

/// Name of a file whose script overrides any other.
pub(crate) const SCRIPT: &str = "script.toml";

impl Played {
    /// Opens the file at `path`, with pictures of `side_px` pixels a side: a scene, or a subject, whose script cannot
    /// be played. If `files` contains [`SCRIPT`], that script is used, and can be played in either case.
    ///
    /// # Errors
    /// As those of subjects, scenes, simulations and pictures, by file and key.
    pub(crate) fn new(files: &Arc<InMemory>, path: &Path, side_px: u32) -> Result<Self> {
        let opened = Opened::of(files, path)?;
        let mut scene = opened.read(files)?;
        let given = files.0.contains_key(Path::new(SCRIPT)).then(|| PathBuf::from(SCRIPT));
        let is_shown = opened.subject.is_none() || given.is_some();
        if let Some(script) = given.or_else(|| opened.reference()) {
            scene.take_script(&script)?;
        }
        let simulation = scene.simulation(&NoStore)?;
        let script = scene.steps(simulation.stack(), &NoStore)?;
        let view = view(opened.view(&scene)?, &**files)?;
        let names: Vec<String> =
            simulation.stack().instruments().iter().map(|one| one.name.clone()).collect();
        let all_solid = !lumens(simulation.stack(), &view).contains(&true);
        let radius_mm = thinnest_mm(simulation.stack());
        let wall = simulation.lumen().wall(&NoStore)?.clone();
        let setup = setup(&scene, simulation.stack())?;
        let sac = scene.sac(simulation.lumen(), &NoStore)?;
        let keys = Keys::of(simulation.stack());
        let session = Session::new(simulation, view, side_px, Limits::default())?;
        let mut session = session.with_ticks(TICK_SOLVES)?.with_sac(sac);
        if is_shown {
            session = session.with_script(script.clone());
        }
        let Opened { scene: scene_path, settings, subject } = opened;
        if let Some(subject) = subject {
            let tree = subject.goal.target().map(|_| scene.centreline(&NoStore)).transpose()?;
            let has_sac = scene.vessel.sac.is_some();
            let site = Site { tree, instruments: &names, radius_mm: Some(radius_mm), has_sac, all_solid };
            session = session.with_exam(Exam::new(subject, &site)?);
        }
        let first = session.snapshot();
        let pictures = Pictures::new(&scene, &first, wall)?;
        let provenance = json!({
            "scene": scene.name, "method": scene.method.name(), "seed": scene.seed, "version": env!("CARGO_PKG_VERSION"),
        });
        Ok(Self {
            session,
            keys,
            scene_path,
            settings,
            script,
            provenance,
            setup,
            recorder: Recorder::default(),
            noted: 0,
            pictures,
            three_d: ThreeD::new(),
        })
    }

    /// Makes the script playable that solves the subject.
    pub(crate) fn watched(self) -> Self {
        Self { session: self.session.with_script(self.script.clone()), ..self }
    }

    /// The session file for assessment, recorded at this time; the scene's path is relative to `folder`.
    pub(crate) fn session_file(&self, folder: &Path, recorded_unix_s: Option<u64>) -> SessionFile {
        SessionFile {
            schema: SCHEMA,
            scene_file: folder.join(&self.scene_path),
            set: self.settings.iter().map(ToString::to_string).collect(),
            recorded_unix_s,
            // Inputs are numbers and names, which are always JSON.
            inputs: serde_json::to_value(self.session.inputs()).ok(),
            record: self.session.record().clone(),
        }
    }

    /// The head of its script saved as `file`; the scene's path is relative to `folder`.
    pub(crate) fn script_head(&self, folder: &Path, file: &Path) -> String {
        script_head(&folder.join(&self.scene_path), &self.settings, file)
    }

    /// Applies the inputs produced by keys.
    pub(crate) fn take(&mut self, inputs: &[Input]) {
        for input in inputs {
            // A refused input becomes an event of the session.
            let _ = self.apply(input);
        }
    }

    /// Applies an input.
    ///
    /// # Errors
    /// As [`Session::apply`].
    pub(crate) fn apply(&mut self, input: &Input) -> Result<()> {
        let done = self.session.apply(input);
        self.note();
        done
    }

    /// Advances by 1/60 s.
    pub(crate) fn tick(&mut self) {
        self.session.tick();
        self.note();
    }

    /// Records the current step for a report, or drops steps that were undone.
    fn note(&mut self) {
        let steps = self.session.steps();
        if steps != self.noted {
            self.recorder.note(steps, self.session.simulation());
            self.noted = steps;
        }
    }

    /// The data of a report of the session so far, with these pictures.
    ///
    /// # Errors
    /// [`Error::Parameter`] before the first step.
    pub(crate) fn report(&self, frames: Vec<Frame>) -> Result<Run> {
        if self.noted == 0 {
            return Err(Error::parameter("step", 0, "there is nothing to report: move an instrument first"));
        }
        let readout = self.session.readout();
        let mut summary = self.provenance.clone();
        summary["steps"] = self.noted.into();
        summary["steps_asked"] = self.noted.into();
        summary["inserted_mm"] = self.session.simulation().report().inserted_mm.into();
        summary["time_s"] = readout.time_s.into();
        summary["beam_s"] = readout.lab.beam_s.into();
        summary["dose_ugy"] = readout.lab.dose_ugy.into();
        summary["unconverged_steps"] = readout.went.unconverged_steps.into();
        if !self.settings.is_empty() {
            summary["set"] = self.settings.iter().map(ToString::to_string).collect();
        }
        if let Some(score) = self.session.score() {
            summary["subject"] = score.subject.as_str().into();
            summary["score"] = score.verdict.words().into();
        }
        let rows = self.recorder.rows();
        Ok(Run {
            summary,
            instruments: readout.instruments.into_iter().map(|one| one.name).collect(),
            vessel: Vessel::of(self.session.simulation().lumen().wall(&NoStore)?.mesh()),
            steps: self.recorder.moments().to_vec(),
            series: Series::of(rows),
            events: events(rows),
            frames,
            setup: self.setup.clone(),
            others: vec![],
        })
    }

    /// The live fluoroscopic picture of each plane, or the last one.
    ///
    /// # Errors
    /// As [`Pictures::fluoro`].
    pub(crate) fn fluoro(&mut self) -> Result<Vec<Image>> {
        self.drawn(Pictures::fluoro)
    }

    /// The same without delay: coarse pictures just after a change of the room.
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
        Ok(draw(&mut self.pictures, &snapshot)?.to_vec())
    }

    /// The computations for sharp pictures, once the room no longer changes.
    ///
    /// # Errors
    /// As [`Pictures::sharpenings`].
    pub(crate) fn sharpenings(&mut self) -> Result<Vec<Sharpening>> {
        self.pictures.sharpenings(&self.session.snapshot())
    }

    /// Takes the result of such a computation.
    ///
    /// # Errors
    /// As [`Pictures::sharpened`].
    pub(crate) fn sharpened(&mut self, done: Sharpened) -> Result<()> {
        self.pictures.sharpened(done)
    }

    /// The 3D view, if it differs from the last one. From a graphics processor it arrives in a later call.
    ///
    /// # Errors
    /// As [`Pictures::three_d`].
    pub(crate) fn three_d(&mut self) -> Result<Option<Image>> {
        self.three_d.next(&self.session.snapshot(), &mut self.pictures)
    }

    /// Draws the 3D view on a graphics processor from now on.
    pub(crate) fn three_d_by(&mut self, graphics: Rc<Graphics>) {
        self.three_d.draw_by(graphics, &mut self.pictures);
    }

    /// Draws the 3D view on the processor from now on.
    pub(crate) fn three_d_here(&mut self) {
        self.three_d.draw_here();
    }

    /// Name of the backend that draws the 3D view.
    pub(crate) fn three_d_backend(&self) -> String {
        self.three_d.backend()
    }

    /// Name of the backend that draws the fluoroscopic picture; `None` before the first picture.
    pub(crate) fn backend(&self) -> Option<&str> {
        self.pictures.backend()
    }
}

/// Adapts the `[view]` table of a scene to a page, and reads the centre line along which contrast medium flows.
fn view(mut view: ViewSpec, files: &dyn Files) -> Result<ViewSpec> {
    if let Some(ct) = &view.patient.ct {
        let remedy = "tomograms are read by the program alone: leave [view.patient.ct] out here";
        return Err(Error::parameter("view.patient.ct.file", ct.file.display(), remedy));
    }
    // Graphics processors in a browser answer asynchronously.
    view.backend = Backend::Cpu;
    // The viewer reads from a file system, which does not exist here.
    if let Some(tree) = view.flow.tree.take() {
        view.flow.centreline = Some(Arc::new(CentrelineTree::read_of(files, &tree)?));
    }
    Ok(view)
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
