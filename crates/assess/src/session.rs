//! The session file of play. It lies beside the script and holds what a script cannot: times, rests and the beam. The
//! folder of a run holds the same in tables.

use std::path::{Path, PathBuf};

use endowire_core::device::Stack;
use endowire_core::input::plain;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::record::Record;
use crate::score::SCHEMA;
use crate::{check, folder};

/// Keys of `[view]` that concern pictures alone: neither a time nor the beam nor what is injected depends on them.
const OF_PICTURES: [&str; 7] = ["backend", "bits", "camera", "every", "film", "size_px", "views"];

/// Content of a `*.session.json`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionFile {
    /// Number of this file's kind: [`SCHEMA`]; 1 in files that do not have it.
    #[serde(default = "first_schema")]
    pub schema: u32,
    /// Scene file.
    pub scene_file: PathBuf,
    /// Overridden keys of the scene, `KEY=VALUE`.
    pub set: Vec<String>,
    /// Time of the recording, seconds since 1970-01-01 UTC; `None` if the session's time advances by its inputs
    /// alone, so that its file is the same at any date.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_unix_s: Option<u64>,
    /// What hands did, by which the session can be repeated; `None` if it was not recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inputs: Option<serde_json::Value>,
    /// The record.
    pub record: Record,
}

/// The kind of files without a number.
fn first_schema() -> u32 {
    1
}

impl SessionFile {
    /// Reads a session (*.session.json), in which nothing need be done, or the folder of a run with its summary.json.
    ///
    /// # Errors
    /// As [`Self::parse`] and [`Record::read`], and a file that cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        if path.is_dir() {
            return folder::read_in_scene(path);
        }
        let bytes = std::fs::read(path).map_err(|error| not_a_session(path, &error))?;
        Self::parse(&bytes, path)
    }

    /// Reads a session from the bytes of its file; `path` is for messages.
    ///
    /// # Errors
    /// [`Error::Content`] if it is not a session, or has an impossible value or an unknown key.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let session: Self = serde_json::from_slice(bytes).map_err(|error| not_a_session(path, &error))?;
        if !(1..=SCHEMA).contains(&session.schema) {
            let remedy = format!("this program reads files up to {SCHEMA}: use the one that wrote it");
            let error = Error::parameter("schema", session.schema, remedy);
            return Err(Error::content(path, error.to_string()));
        }
        let in_record =
            |error: Error| Error::content(path, format!("record.{error}; record the session again"));
        session.record.check().map_err(in_record)?;
        Ok(session)
    }

    /// Its record; refused if nothing was done in it. `path` is for messages.
    pub(crate) fn done(self, path: &Path) -> Result<Record> {
        let refused = |error: Error| Error::content(path, format!("record.{error}"));
        check::done(&self.record).map_err(refused)?;
        Ok(self.record)
    }

    /// Refuses a session in which nothing was done, and one that is not of this scene: with another file or other
    /// settings (as `KEY=VALUE`), or with instruments that do not fit those of the scene. Settings of pictures alone do not count. `path` is for messages.
    ///
    /// # Errors
    /// [`Error::Content`] with what differs.
    pub fn check_in(&self, (scene, set): (&Path, &[String]), stack: &Stack, path: &Path) -> Result<()> {
        let same = match (self.scene_file.canonicalize(), scene.canonicalize()) {
            (Ok(recorded), Ok(scene)) => recorded == scene,
            // A scene that was moved or deleted can only be compared by its file name.
            _ => self.scene_file.file_name() == scene.file_name(),
        };
        if !same || !counted(&self.set).eq(counted(set)) {
            let reported = |scene: &Path, set: &[String]| {
                let set: String = set.iter().map(|setting| format!(" --set '{setting}'")).collect();
                format!("{}{set}", scene.display())
            };
            let refused = format!(
                "was recorded in {}, and the subject is in {}: name the subject that it was recorded with",
                reported(&self.scene_file, &self.set),
                reported(scene, set)
            );
            return Err(Error::content(path, refused));
        }
        let record = check::done(&self.record).and_then(|()| self.record.check_in(stack));
        record.map_err(|error| Error::content(path, error.to_string()))
    }
}

/// The settings that decide something beside pictures.
fn counted(set: &[String]) -> impl Iterator<Item = &String> {
    let of_pictures = |setting: &str| {
        let key = setting.split('=').next().and_then(|key| key.trim().strip_prefix("view."));
        key.is_some_and(|key| OF_PICTURES.contains(&key.split(['.', '[']).next().unwrap_or(key)))
    };
    set.iter().filter(move |setting| !of_pictures(setting))
}

fn not_a_session(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::content(
        path,
        format!("{}; give a session of endowire play or the folder of a run", plain(&error.to_string())),
    )
}
