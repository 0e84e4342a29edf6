//! Provenance of results.

use endowire_core::Result;
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::seal::hex;

/// The program that computes the results.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Its version.
    pub version: &'static str,
    /// Git revision of its source.
    pub git_revision: &'static str,
}

/// Version, revision, input and seed of a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Git revision of its source.
    pub git_revision: String,
    /// SHA-256 of the scene's text and of the files it names; of nothing if there is no scene.
    pub scene_hash: String,
    /// Seed of all that is random.
    pub seed: u64,
    /// Keys of the scene that were set beside its file, `KEY=VALUE`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
}

impl Provenance {
    /// For a result of `inputs`: file contents, in order.
    pub fn new(program: Program, inputs: &[impl AsRef<[u8]>], seed: u64) -> Self {
        Self {
            version: program.version.to_owned(),
            git_revision: program.git_revision.to_owned(),
            scene_hash: hash_inputs(inputs),
            seed,
            set: Vec::new(),
        }
    }

    /// For a result of a scene, and of the files that the scene names.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn of_scene<M: MethodChoice + DeserializeOwned + Default>(
        program: Program,
        scene: &SceneOf<M>,
    ) -> Result<Self> {
        let mut inputs = vec![scene.text().as_bytes().to_vec()];
        for path in scene.input_paths() {
            inputs.push(endowire_core::file::read(&path, u64::MAX)?);
        }
        Ok(Self::new(program, &inputs, scene.seed))
    }

    /// The same with settings beside the scene's file.
    pub fn with(self, settings: &[impl ToString]) -> Self {
        Self { set: settings.iter().map(ToString::to_string).collect(), ..self }
    }

    /// In words, for the foot of a page.
    pub fn words(&self) -> String {
        let Self { version, git_revision, scene_hash, seed, .. } = self;
        format!("endowire {version}, revision {git_revision}, inputs {scene_hash}, seed {seed}")
    }
}

/// SHA-256 of file contents, in order, as hexadecimal digits.
pub fn hash_inputs(inputs: &[impl AsRef<[u8]>]) -> String {
    let mut hash = Sha256::new();
    for input in inputs.iter().map(AsRef::as_ref) {
        // The lengths ensure that different splits of the same bytes have different hashes.
        hash.update((input.len() as u64).to_le_bytes());
        hash.update(input);
    }
    hex(&hash.finalize())
}
