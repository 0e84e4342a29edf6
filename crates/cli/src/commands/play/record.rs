//! Saves a session to disk.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use endowire_assess::SessionFile;
use endowire_methods::Setting;
use endowire_play::{Session, Went, script_head};

use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{session as session_file, tell, to_json, whole};
use crate::subjects::ScoreDocument;

/// Interval between saves of a running session.
const EVERY: Duration = Duration::from_secs(2);

/// The file of a session's script.
pub(crate) struct Record {
    path: PathBuf,
    head: String,
    scene: PathBuf,
    set: Vec<String>,
    /// Provenance of the score, for a subject.
    provenance: Option<Provenance>,
    /// Start time, for a session in real time.
    recorded_unix_s: Option<u64>,
    written: Instant,
}

impl Record {
    /// A record at `path` of a session in a scene with these settings.
    pub(crate) fn new(path: PathBuf, scene: &Path, settings: &[Setting]) -> Self {
        let head = script_head(scene, settings, &path);
        let set = settings.iter().map(ToString::to_string).collect();
        let scene = scene.to_path_buf();
        Self { path, head, scene, set, provenance: None, recorded_unix_s: None, written: Instant::now() }
    }

    /// Marks the session as one in real time that starts now. A session whose time advances by inputs has no date, so
    /// that its file always has the same bytes.
    pub(crate) fn by_the_clock(self) -> Self {
        // A clock set before 1970 does not know the date.
        let since = SystemTime::now().duration_since(UNIX_EPOCH).ok();
        Self { recorded_unix_s: since.map(|since| since.as_secs()), ..self }
    }

    /// Marks the session as a subject, whose score is written too.
    pub(crate) fn scored(self, provenance: Provenance) -> Self {
        Self { provenance: Some(provenance), ..self }
    }

    /// Folder of the script.
    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    /// Saves the session at intervals, in case the program is killed.
    pub(crate) fn keep(&mut self, session: &Session) -> Result<(), Failure> {
        if self.written.elapsed() < EVERY {
            return Ok(());
        }
        self.written = Instant::now();
        self.write(session)
    }

    fn write(&self, session: &Session) -> Result<(), Failure> {
        let folder = self.folder();
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
        let text = format!("{}{}", self.head, session.script());
        whole::write_bytes(&self.path, text.as_bytes()).map_err(|e| Failure::write(&self.path, &e))
    }

    /// Saves the whole session, with the files for assessment, and reports the path.
    pub(crate) fn finish(&self, session: &Session) -> Result<(), Failure> {
        self.write(session)?;
        let of_session = SessionFile {
            scene_file: self.scene.clone(),
            set: self.set.clone(),
            recorded_unix_s: self.recorded_unix_s,
            record: session.record().clone(),
        };
        session_file::write(&of_session, &session_file::beside(&self.path))?;
        if let Some((provenance, score)) = self.provenance.as_ref().zip(session.score()) {
            let path = self.path.with_extension("score.json");
            let text = to_json(&ScoreDocument { provenance, score: &score })?;
            whole::write_bytes(&path, text.as_bytes()).map_err(|e| Failure::write(&path, &e))?;
        }
        let Went { unconverged_steps, jumps, relaxations } = session.went();
        let counts = [
            (unconverged_steps, "without an equilibrium"),
            (jumps, "with a jump"),
            (relaxations, "last resorts"),
        ];
        let told =
            counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!(", {count} {what}"));
        let told: String = told.collect();
        tell(format_args!("{} steps are recorded in {}{told}", session.steps(), self.path.display()));
        Ok(())
    }
}
