//! Input files: TOML into types, with errors that name file, line and key, and the most similar valid key.

#[cfg(feature = "scene-files")]
mod reader;
#[cfg(feature = "scene-files")]
mod whole;
mod words;

use std::path::Path;

#[cfg(feature = "scene-files")]
pub use reader::parse_toml;
use serde::de::DeserializeOwned;
pub use words::plain;

#[cfg(not(feature = "scene-files"))]
use crate::Error;
use crate::Result;
use crate::file::{self, FileSystem, Files};

/// Largest input file in bytes: scenes and cases are kilobytes.
const SIZE_LIMIT: u64 = 16 << 20;

/// Similarity (Jaro–Winkler, 0…1) from which a known key is suggested for an unknown one.
const SIMILAR: f64 = 0.75;

/// Reads a TOML file into `T`, and returns its text too.
///
/// # Errors
/// A file that cannot be read, is not TOML, or does not match `T`, including lists that are too long; for unknown
/// keys the most similar known one is suggested.
pub fn from_toml<T: DeserializeOwned>(path: &Path) -> Result<(T, String)> {
    from_toml_of(&FileSystem, path)
}

/// As [`from_toml`], for a file of `files`.
///
/// # Errors
/// As [`from_toml`].
pub fn from_toml_of<T: DeserializeOwned>(files: &dyn Files, path: &Path) -> Result<(T, String)> {
    let text = file::text(&files.read(path, SIZE_LIMIT)?, path)?;
    Ok((parse_toml(&text, path)?, text))
}

/// As [`from_toml`], for TOML text; `name` is its name in errors.
///
/// # Errors
/// [`Error::Feature`]: this build reads none.
#[cfg(not(feature = "scene-files"))]
pub fn parse_toml<T: DeserializeOwned>(_text: &str, name: &Path) -> Result<T> {
    Err(Error::feature("scene-files", name.display()))
}

/// The most similar of the names in serde's message for an unknown one: "unknown field `a`, expected one of `b`,
/// `c`". Empty for other messages, and if none is similar.
pub fn nearest(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match quoted.split_first() {
        Some((wrong, known)) if message.starts_with("unknown ") => {
            let best =
                known.iter().map(|k| (strsim::jaro_winkler(wrong, k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
            match best {
                Some((likeness, key)) if likeness >= SIMILAR => format!(" – did you mean `{key}`?"),
                _ => String::new(),
            }
        }
        _ => String::new(),
    }
}
