//! Provenance of results, included in every JSON document.

use std::path::Path;

use endowire_methods::{Scene, Setting};
use endowire_sweep::{Program, hash_inputs};
use serde::Serialize;

use crate::failure::Failure;

/// This program.
pub(crate) const PROGRAM: Program =
    Program { version: env!("CARGO_PKG_VERSION"), git_revision: env!("ENDOWIRE_GIT_REVISION") };

/// Version, revision, input and seed of a result.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Provenance {
    version: &'static str,
    git_revision: &'static str,
    /// SHA-256 of the scene's text and of the files it names; of nothing if there is no scene.
    scene_hash: String,
    seed: u64,
    /// Keys of the scene that were set on the command line, `KEY=VALUE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    set: Vec<String>,
}

impl Provenance {
    /// For a result of `inputs`: file contents, in order.
    pub(crate) fn new(inputs: &[impl AsRef<[u8]>], seed: u64) -> Self {
        Self {
            version: PROGRAM.version,
            git_revision: PROGRAM.git_revision,
            scene_hash: hash_inputs(inputs),
            seed,
            set: Vec::new(),
        }
    }

    /// For a result of a scene with these settings, and of the files that the scene names.
    pub(crate) fn of_scene(scene: &Scene, settings: &[Setting]) -> Result<Self, Failure> {
        let mut inputs = vec![scene.text().as_bytes().to_vec()];
        for path in scene.input_paths() {
            inputs.push(read_input(&path)?);
        }
        Ok(Self::new(&inputs, scene.seed).with(settings))
    }

    /// The same with the settings of the command line.
    pub(crate) fn with(self, settings: &[Setting]) -> Self {
        Self { set: settings.iter().map(Setting::to_string).collect(), ..self }
    }

    /// In words, for the foot of a page.
    pub(crate) fn words(&self) -> String {
        let Self { version, git_revision, scene_hash, seed, .. } = self;
        format!("endowire {version}, revision {git_revision}, inputs {scene_hash}, seed {seed}")
    }

    /// SHA-256 of the inputs.
    pub(crate) fn scene_hash(&self) -> &str {
        &self.scene_hash
    }

    /// For a result that depends only on the program and its arguments.
    pub(crate) fn of_program(arguments: &str) -> Self {
        Self::new(&[arguments.as_bytes()], 0)
    }
}

/// Reads an input file completely, for its hash.
pub(crate) fn read_input(path: &Path) -> Result<Vec<u8>, Failure> {
    Ok(endowire_core::file::read(path, u64::MAX)?)
}
