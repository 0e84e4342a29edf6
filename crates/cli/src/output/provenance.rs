//! Provenance of results, included in every JSON document.

use std::path::Path;

use endowire_methods::{Scene, Setting};
use endowire_recording::Program;
use serde::Serialize;

use crate::failure::Failure;

/// This program.
pub(crate) const PROGRAM: Program =
    Program { version: env!("CARGO_PKG_VERSION"), git_revision: env!("ENDOWIRE_GIT_REVISION") };

/// Version and revision of this program, input and seed of a result.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(crate) struct Provenance(endowire_recording::Provenance);

impl Provenance {
    /// For a result of `inputs`: file contents, in order.
    pub(crate) fn new(inputs: &[impl AsRef<[u8]>], seed: u64) -> Self {
        Self(endowire_recording::Provenance::new(PROGRAM, inputs, seed))
    }

    /// For a result of a scene with these settings, and of the files that the scene names.
    pub(crate) fn of_scene(scene: &Scene, settings: &[Setting]) -> Result<Self, Failure> {
        Ok(Self(endowire_recording::Provenance::of_scene(PROGRAM, scene)?.with(settings)))
    }

    /// The same with the settings of the command line.
    pub(crate) fn with(self, settings: &[Setting]) -> Self {
        Self(self.0.with(settings))
    }

    /// In words, for the foot of a page.
    pub(crate) fn words(&self) -> String {
        self.0.words()
    }

    /// SHA-256 of the inputs.
    pub(crate) fn scene_hash(&self) -> &str {
        &self.0.scene_hash
    }

    /// For a result that depends only on the program and its arguments.
    pub(crate) fn of_program(arguments: &str) -> Self {
        Self::new(&[arguments.as_bytes()], 0)
    }

    /// For a recording.
    pub(crate) fn recorded(&self) -> endowire_recording::Provenance {
        self.0.clone()
    }
}

/// Reads an input file completely, for its hash.
pub(crate) fn read_input(path: &Path) -> Result<Vec<u8>, Failure> {
    Ok(endowire_core::file::read(path, u64::MAX)?)
}
