//! All output of the program: recordings, arrays, provenance, progress.

pub(crate) mod chart;
#[cfg(feature = "lab")]
pub(crate) mod curves;
pub(crate) mod film;
pub(crate) mod frames;
pub(crate) mod manifest;
pub(crate) mod progress;
pub(crate) mod provenance;
mod recorder;
pub(crate) mod saved;
pub(crate) mod session;
#[cfg(feature = "lab")]
pub(crate) mod study;
pub(crate) mod vtk;

use std::fmt::Display;
use std::io::{ErrorKind, Write, stderr, stdout};
use std::path::Path;

pub(crate) use endowire_core::file::whole;
pub(crate) use recorder::{in_folder, record_anew, refuse_recording};
use serde::Serialize;

use crate::failure::Failure;

/// Prints a document and a line break on stdout. A closed pipe (`| head`) is not an error.
pub(crate) fn print(document: impl Display) -> Result<(), Failure> {
    let mut out = stdout().lock();
    match writeln!(out, "{document}").and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::Computation(format!("cannot write to the standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Prints a message on stderr. Errors are ignored, because results do not depend on it.
pub(crate) fn tell(text: impl Display) {
    let _ = writeln!(stderr().lock(), "{}", printable(text));
}

/// Makes text safe for a terminal: control characters in a name could move the cursor, or change colours or the
/// title.
pub(crate) fn printable(text: impl Display) -> String {
    let mut shown = String::new();
    for character in text.to_string().chars() {
        match character {
            '\n' | '\t' => shown.push(character),
            _ if character.is_control() => shown.extend(character.escape_default()),
            _ => shown.push(character),
        }
    }
    shown
}

/// Prints one JSON document on stdout.
pub(crate) fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    print(to_json(document)?)
}

/// Prints the result of a command: one JSON document, or text for people.
pub(crate) fn answer(
    document: &impl Serialize,
    json: bool,
    text: impl FnOnce() -> String,
) -> Result<(), Failure> {
    if json { print_json(document) } else { print(printable(text())) }
}

/// A path in a document. Where it is no text, as in a folder named in Latin-1, it has replacement characters.
pub(crate) fn path_text<S: serde::Serializer>(path: impl AsRef<Path>, into: S) -> Result<S::Ok, S::Error> {
    into.serialize_str(&path.as_ref().to_string_lossy())
}

/// A document as indented JSON.
pub(crate) fn to_json(document: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(document)
        .map_err(|e| Failure::Computation(format!("the result cannot be written as JSON: {e}")))
}

#[cfg(test)]
mod tests {
    use super::printable;

    #[test]
    fn what_a_terminal_would_obey_is_shown() {
        assert_eq!(
            printable("a\u{1b}]0;title\u{7}\u{9b}31m\r\nb\tµ"),
            "a\\u{1b}]0;title\\u{7}\\u{9b}31m\\r\nb\tµ"
        );
    }
}
