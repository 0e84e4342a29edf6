//! Everything that leaves the program: recordings, arrays, provenance, progress.

pub(crate) mod frames;
pub(crate) mod npz;
pub(crate) mod progress;
pub(crate) mod provenance;
pub(crate) mod recorder;

use serde::Serialize;

use crate::failure::Failure;

/// Prints one JSON document on stdout.
pub(crate) fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    println!("{}", to_json(document)?);
    Ok(())
}

/// A document as indented JSON.
pub(crate) fn to_json(document: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(document)
        .map_err(|e| Failure::Computation(format!("the result cannot be written as JSON: {e}")))
}
