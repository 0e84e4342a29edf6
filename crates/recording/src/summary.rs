//! The summary of a recording: summary.json.

use std::io;
use std::path::{Path, PathBuf};

use endowire_core::file::whole;
use endowire_core::insertion::Simulation;
use endowire_core::{Error, Result, Vec3};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;

use crate::outcome::RunOutcome;
use crate::packing::Packed;
use crate::provenance::Provenance;
use crate::table::GIVE;

/// File with the summary of a recording.
pub const SUMMARY: &str = "summary.json";

/// Version of the format of recordings. It rises when something that a reader of earlier versions relies on is no
/// longer there; columns and keys may be added without that.
pub const VERSION: u32 = 1;

/// Geometry of a plane of fluoroscopy. `E` is the exposure of its frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plane<E> {
    /// Primary angle of the C-arm.
    pub primary_deg: f64,
    /// Secondary angle.
    pub secondary_deg: f64,
    /// Maps (x, y, z, 1), in mm, to pixel coordinates times the depth.
    pub camera_matrix: [[f64; 4]; 3],
    /// Exposure of its frames; `None` before the first frame.
    pub exposure: Option<E>,
}

/// The results of a whole insertion: summary.json. `E` is what is reported of the exposure of frames.
#[derive(Debug, Clone, Serialize)]
pub struct Summary<E = ()> {
    /// Version of the recording's format, [`VERSION`].
    pub schema: u32,
    /// Provenance.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Whether the run has ended, successfully or not, and everything is written. False while it is running, and if
    /// it was killed; the summary is then that of an earlier step.
    pub complete: bool,
    /// Name of the scene; empty without one.
    pub scene: String,
    /// File of the scene, for drawing frames later; `None` without one.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "path_text_if_any")]
    pub scene_file: Option<PathBuf>,
    /// File of its script, if that is not the scene's own.
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "path_text_if_any")]
    pub script_file: Option<PathBuf>,
    /// Name of the method.
    pub method: String,
    /// Whether the vessel's centre line was needed and, since the scene names none, was extracted from its surface.
    pub centreline_found: bool,
    /// Position of the foremost tip before the first step, mm: in the sheath's mouth if nothing is inserted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_mm: Option<Vec3>,
    /// Outcome of the run.
    #[serde(flatten)]
    pub outcome: RunOutcome,
    /// Packing of the scene's sac, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packing: Option<Packed>,
    /// Time of the simulation, s, without recording and frames.
    pub step_time_s: f64,
    /// Time of the whole run, s.
    pub wall_time_s: f64,
    /// Backend that drew the frames.
    pub renderer: Option<String>,
    /// Planes of fluoroscopy.
    pub planes: Vec<Plane<E>>,
    /// Paths of the frames, relative to the folder of this file.
    pub frames: Vec<String>,
    /// File name of the film.
    pub film: Option<String>,
}

impl Summary {
    /// The summary of a program that moves a simulation by itself, without scene, script and pictures. Where the
    /// simulation is that of a scene, give its file, for those who draw the recording.
    pub(crate) fn of_program(
        provenance: Provenance,
        start_mm: Option<Vec3>,
        outcome: RunOutcome,
        simulation: &Simulation,
    ) -> Self {
        Self {
            schema: VERSION,
            provenance,
            complete: false,
            scene: String::new(),
            scene_file: None,
            script_file: None,
            method: simulation.state().method().to_owned(),
            centreline_found: false,
            start_mm,
            outcome,
            packing: None,
            step_time_s: 0.0,
            wall_time_s: 0.0,
            renderer: None,
            planes: vec![],
            frames: vec![],
            film: None,
        }
    }
}

impl<E: Serialize> Summary<E> {
    /// Writes it into the folder of a recording.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(SUMMARY);
        let written = || -> io::Result<()> {
            let text = serde_json::to_string_pretty(self)? + "\n";
            whole::write_bytes(&path, text.as_bytes())
        };
        written().map_err(|e| Error::file(&path, e))
    }
}

/// A path in a document. Where it is no text, as in a folder named in Latin-1, it has replacement characters.
fn path_text_if_any<S: Serializer>(path: &Option<PathBuf>, into: S) -> std::result::Result<S::Ok, S::Error> {
    match path {
        Some(path) => into.serialize_str(&path.to_string_lossy()),
        None => into.serialize_none(),
    }
}

/// What readers of a recording need of summary.json; all but the version of the format may be missing in what was written by
/// hand.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct About {
    /// Version of the format; 0 where there is no summary.
    pub schema: u32,
    /// File of the scene.
    pub scene_file: Option<PathBuf>,
    /// Name of the scene.
    pub scene: Option<String>,
    /// File of the script, if it was not the scene's own.
    pub script_file: Option<PathBuf>,
    /// Hash of the scene's text and of the files it names.
    pub scene_hash: Option<String>,
    /// Keys of the scene that were set beside its file.
    pub set: Vec<String>,
    /// Where the way of the tip begins; `None` in recordings of versions that did not tell.
    pub start_mm: Option<Vec3>,
    /// Number of steps.
    pub steps: Option<usize>,
    /// Number of steps without an equilibrium; 0 in recordings of versions that did not count them.
    pub unconverged_steps: usize,
    /// Names of the instruments; empty in what was written by hand.
    #[serde(skip)]
    pub instruments: Vec<String>,
    /// Whether the run ended by itself. The key is missing in recordings of versions that packed the arrays only in
    /// that case.
    pub complete: Option<bool>,
}

impl About {
    /// That of a recording in this scene, of which nothing else is known.
    pub fn in_scene(scene: &Path) -> Self {
        Self { scene_file: Some(scene.to_path_buf()), ..Self::default() }
    }

    /// Reads the summary in the folder of a recording.
    ///
    /// # Errors
    /// [`Error::Content`] for a summary that is missing, is no such document, or is of a later version.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(SUMMARY);
        let read = || -> io::Result<Value> { Ok(serde_json::from_slice(&std::fs::read(&path)?)?) };
        let refused = |what: String| Error::content(&path, format!("{what}; {GIVE}"));
        let document = read().map_err(|e| refused(e.to_string()))?;
        if document.get("schema").is_none_or(|schema| schema.as_u64().is_none_or(|schema| schema == 0)) {
            return Err(refused("schema: the version of the format, 1 or more, is missing".to_owned()));
        }
        let instruments = document["instruments"].as_array().into_iter().flatten();
        let names = instruments.filter_map(|one| one["name"].as_str().map(str::to_owned)).collect();
        let about: Self = serde_json::from_value(document).map_err(|e| refused(e.to_string()))?;
        let about = Self { instruments: names, ..about };
        if about.schema > VERSION {
            let what = format!(
                "schema = {}: a later version of the program has recorded this, and this one reads up to {VERSION}: read it with that",
                about.schema
            );
            return Err(Error::content(&path, what));
        }
        Ok(about)
    }

    /// Makes the summary in a folder, if there is one, that of a recording that goes on after step `steps`.
    pub(crate) fn reopen(folder: &Path, steps: usize) -> Result<()> {
        let path = folder.join(SUMMARY);
        let reopened = || -> io::Result<()> {
            let mut document: Value = serde_json::from_slice(&std::fs::read(&path)?)?;
            (document["complete"], document["steps"]) = (false.into(), steps.into());
            whole::write_bytes(&path, (serde_json::to_string_pretty(&document)? + "\n").as_bytes())
        };
        // A summary that is damaged is written anew with the next step.
        if Self::read(folder).is_err() { Ok(()) } else { reopened().map_err(|e| Error::file(&path, e)) }
    }

    /// As [`Self::read`]; `None` if there is no summary.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_if_any(folder: &Path) -> Result<Option<Self>> {
        if folder.join(SUMMARY).exists() { Self::read(folder).map(Some) } else { Ok(None) }
    }

    /// Whether the run ended by itself.
    pub fn is_complete(&self) -> bool {
        self.complete.unwrap_or(true)
    }
}
