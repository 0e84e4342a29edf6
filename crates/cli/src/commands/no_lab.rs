//! Commands of the laboratory in a program that was built without it: they say so.

use crate::args::{BenchCommand, CompareArgs, EvidenceArgs, ExperimentCommand, VerifyArgs};
use crate::failure::Failure;

fn missing(command: &str) -> Result<(), Failure> {
    Err(Failure::Input(format!(
        "{command}: this program was built without the feature lab: cargo build --release --features lab"
    )))
}

pub(super) fn bench(_: &BenchCommand) -> Result<(), Failure> {
    missing("bench")
}

pub(super) fn compare(_: &CompareArgs) -> Result<(), Failure> {
    missing("compare")
}

pub(super) fn evidence(_: &EvidenceArgs) -> Result<(), Failure> {
    missing("evidence")
}

pub(super) fn experiment(_: &ExperimentCommand) -> Result<(), Failure> {
    missing("experiment")
}

pub(super) fn verify(_: &VerifyArgs) -> Result<(), Failure> {
    missing("verify")
}
