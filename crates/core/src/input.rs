//! Input files: TOML into types, with errors that name file, line and key, and the nearest right key.

use std::path::Path;

use serde::de::DeserializeOwned;

use crate::{Error, Result};

/// Largest input file in bytes: scenes and cases are kilobytes.
const SIZE_LIMIT: u64 = 16 << 20;

/// Similarity (Jaro–Winkler, 0…1) from which a known key is offered for an unknown one.
const SIMILAR: f64 = 0.75;

/// Reads a TOML file into `T`, and returns its text too.
///
/// # Errors
/// A file that cannot be read, is no TOML, or does not fit `T`; unknown keys come with the nearest known one.
pub fn from_toml<T: DeserializeOwned>(path: &Path) -> Result<(T, String)> {
    let size = std::fs::metadata(path).map_err(|e| Error::file(path, e))?.len();
    if size > SIZE_LIMIT {
        return Err(Error::content(
            path,
            format!("{size} bytes are too many for a TOML file: at most {SIZE_LIMIT}"),
        ));
    }
    let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e))?;
    Ok((parse_toml(&text, path)?, text))
}

/// Reads TOML text into `T`; `name` is what errors call it.
///
/// # Errors
/// As [`from_toml`], less those of the file.
pub fn parse_toml<T: DeserializeOwned>(text: &str, name: &Path) -> Result<T> {
    toml::from_str(text).map_err(|e| Error::content(name, explain(&e, text)))
}

/// One line: where, what, and the nearest right key.
fn explain(error: &toml::de::Error, text: &str) -> String {
    let message = error.message().trim().replace('\n', " ");
    let place = error.span().map_or(String::new(), |span| {
        let at = span.start.min(text.len());
        let line = text[..at].matches('\n').count() + 1;
        // The key whose value begins here, if one does.
        let before = text[..at].rsplit('\n').next().unwrap_or_default();
        match before.split_once('=') {
            Some((key, _)) => format!("line {line}: {}: ", key.trim()),
            None => format!("line {line}: "),
        }
    });
    // serde's wording for names it does not know: "unknown field `a`, expected one of `b`, `c`".
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let hint = match quoted.split_first() {
        Some((wrong, known)) if message.starts_with("unknown ") => {
            let best =
                known.iter().map(|k| (strsim::jaro_winkler(wrong, k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
            match best {
                Some((likeness, key)) if likeness >= SIMILAR => format!(" – did you mean `{key}`?"),
                _ => String::new(),
            }
        }
        _ => String::new(),
    };
    format!("{place}{message}{hint}")
}
