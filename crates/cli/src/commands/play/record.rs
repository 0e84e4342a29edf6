//! What hands have done, on disk.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use endowire_assess::SessionFile;
use endowire_methods::Setting;
use endowire_play::{Session, Went, script_head};

use crate::failure::Failure;
use crate::output::provenance::Provenance;
use crate::output::{session as session_file, tell, to_json, whole};
use crate::subjects::ScoreDocument;

/// How often a session that goes on is written.
const EVERY: Duration = Duration::from_secs(2);

/// The file of a session's script.
pub(crate) struct Record {
    path: PathBuf,
    head: String,
    scene: PathBuf,
    set: Vec<String>,
    /// Where the score comes from, of a subject.
    provenance: Option<Provenance>,
    /// When it began, of a session that goes by the clock.
    recorded_unix_s: Option<u64>,
    written: Instant,
}

impl Record {
    /// A record in a file of what is done in a scene with these settings.
    pub(crate) fn new(path: PathBuf, scene: &Path, settings: &[Setting]) -> Self {
        let head = script_head(scene, settings, &path);
        let set = settings.iter().map(ToString::to_string).collect();
        let scene = scene.to_path_buf();
        Self { path, head, scene, set, provenance: None, recorded_unix_s: None, written: Instant::now() }
    }

    /// The same of a session that goes by the clock, from now on. One in which time goes by as inputs say has the same bytes at any time.
    pub(crate) fn by_the_clock(self) -> Self {
        // A clock that stands before 1970 does not know the day.
        let since = SystemTime::now().duration_since(UNIX_EPOCH).ok();
        Self { recorded_unix_s: since.map(|since| since.as_secs()), ..self }
    }

    /// The same of a subject: its score is written too.
    pub(crate) fn scored(self, provenance: Provenance) -> Self {
        Self { provenance: Some(provenance), ..self }
    }

    /// The folder that the script goes into.
    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }

    /// Writes the session now and then: what a kill leaves.
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

    /// Writes the whole session, with what it is assessed by, and says where.
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
