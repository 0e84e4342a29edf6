//! Saves a session to disk.

use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use endowire_assess::{SCHEMA, SessionFile};
use endowire_methods::Setting;
use endowire_play::{Session, Went, script_head};
use endowire_recording::{Claim, lock_file};

use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{session as session_file, tell, to_json, whole};
use crate::subjects::ScoreDocument;

/// Interval between saves of a running session.
const EVERY: Duration = Duration::from_secs(2);

/// The files of a session: its script, and beside it what is assessed. They are always of one session: those of an
/// earlier one are removed before the first is written.
pub(crate) struct Record {
    path: PathBuf,
    head: String,
    scene: PathBuf,
    set: Vec<String>,
    /// Provenance of the score, for a subject.
    provenance: Option<Provenance>,
    /// Start time, for a session in real time.
    recorded_unix_s: Option<u64>,
    /// Begin of the last save.
    saved: Instant,
    /// The save under way: hands do not wait for it.
    saving: Option<JoinHandle<Result<(), Failure>>>,
    /// Whether files of an earlier session are removed.
    cleared: bool,
    _claim: Claim,
}

/// Why a file is not free.
const TAKEN: &str = "another session is being recorded there: wait until it has ended, or give another file";

fn taken(error: endowire_core::Error) -> Failure {
    match error {
        endowire_core::Error::File { path, source } => Failure::write(&path, &source),
        other => Failure::Input(format!("--record {other}")),
    }
}

impl Record {
    /// A record at `path` of a session in a scene with these settings. Its folder is created, and no other session can
    /// record there meanwhile.
    pub(crate) fn new(path: PathBuf, scene: &Path, settings: &[Setting]) -> Result<Self, Failure> {
        let folder = folder_of(&path);
        std::fs::create_dir_all(folder).map_err(|e| Failure::write(folder, &e))?;
        Ok(Self {
            head: script_head(scene, settings, &path),
            scene: scene.to_path_buf(),
            set: settings.iter().map(ToString::to_string).collect(),
            provenance: None,
            recorded_unix_s: None,
            saved: Instant::now(),
            saving: None,
            cleared: false,
            _claim: lock_file(&path, TAKEN).map_err(taken)?,
            path,
        })
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
        folder_of(&self.path)
    }

    /// Saves the session at intervals, in case the program is killed.
    pub(crate) fn keep(&mut self, session: &Session) -> Result<(), Failure> {
        let busy = self.saving.as_ref().is_some_and(|saving| !saving.is_finished());
        if busy || self.saved.elapsed() < EVERY {
            return Ok(());
        }
        self.save(session)
    }

    /// Begins to save the session as it is.
    fn save(&mut self, session: &Session) -> Result<(), Failure> {
        self.saved_whole()?;
        self.saved = Instant::now();
        if !std::mem::replace(&mut self.cleared, true) {
            for file in [session_file::beside(&self.path), self.score_file()] {
                whole::remove(&file).map_err(|e| Failure::write(&file, &e))?;
            }
            // What a session that was killed was writing.
            for file in [&self.path, &session_file::beside(&self.path), &self.score_file()] {
                whole::remove_unfinished(file).map_err(|e| Failure::write(file, &e))?;
            }
        }
        let text = format!("{}{}", self.head, session.script());
        let inputs = serde_json::to_value(session.inputs())
            .map_err(|e| Failure::Computation(format!("the inputs cannot be written as JSON: {e}")))?;
        let of_session = SessionFile {
            schema: SCHEMA,
            scene_file: self.scene.clone(),
            set: self.set.clone(),
            recorded_unix_s: self.recorded_unix_s,
            inputs: Some(inputs),
            record: session.record().clone(),
        };
        let script = self.path.clone();
        self.saving = Some(std::thread::spawn(move || {
            whole::write_bytes(&script, text.as_bytes()).map_err(|e| Failure::write(&script, &e))?;
            session_file::write(&of_session, &session_file::beside(&script))
        }));
        Ok(())
    }

    /// Waits for the save under way.
    fn saved_whole(&mut self) -> Result<(), Failure> {
        let stopped = |_| Failure::Computation(format!("{}: could not be saved", self.path.display()));
        self.saving.take().map_or(Ok(()), |saving| saving.join().map_err(stopped)?)
    }

    /// File of the score of a subject.
    fn score_file(&self) -> PathBuf {
        self.path.with_extension("score.json")
    }

    /// Saves the whole session, with the files for assessment, and reports the path.
    pub(crate) fn finish(&mut self, session: &Session) -> Result<(), Failure> {
        self.save(session)?;
        self.saved_whole()?;
        if let Some((provenance, score)) = self.provenance.as_ref().zip(session.score()) {
            let path = self.score_file();
            let text = to_json(&ScoreDocument { provenance, score: &score })?;
            whole::write_bytes(&path, text.as_bytes()).map_err(|e| Failure::write(&path, &e))?;
        }
        let Went { unconverged_steps, jumps, relaxations } = session.went();
        let counts = [
            (unconverged_steps, "without an equilibrium"),
            (jumps, "with a jump"),
            (relaxations, "last resorts"),
        ];
        let reported =
            counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!(", {count} {what}"));
        let reported: String = reported.collect();
        tell(format_args!("{} steps are recorded in {}{reported}", session.steps(), self.path.display()));
        Ok(())
    }
}

/// Folder of a script.
fn folder_of(script: &Path) -> &Path {
    script.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
