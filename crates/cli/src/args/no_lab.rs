//! Arguments of the laboratory in a program that was built without it: any.

/// What a command was given.
#[derive(Debug, clap::Args)]
pub(crate) struct Given {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _given: Vec<String>,
}

pub(crate) type BenchCommand = Given;
pub(crate) type CompareArgs = Given;
pub(crate) type EvidenceArgs = Given;
pub(crate) type ExperimentCommand = Given;
pub(crate) type VerifyArgs = Given;
