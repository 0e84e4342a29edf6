//! Arguments of commands of training subjects.

use std::path::PathBuf;

use clap::Subcommand;

use super::CacheArgs;

#[derive(Debug, Subcommand)]
pub(crate) enum SubjectCommand {
    /// The subjects of a folder by level, one a line
    List {
        /// Folder of subject files (TOML)
        #[arg(default_value = crate::subjects::FOLDER)]
        folder: PathBuf,
        /// Print the subjects as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// One subject: its task, goal, limits and thresholds
    Show {
        /// Subject file (TOML), or the name of one in assets/subjects
        #[arg(value_name = "NAME|FILE")]
        subject: PathBuf,
        #[command(flatten)]
        cache: CacheArgs,
        /// Print it as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// Do a subject by its reference script, under fluoroscopy, and score it; fails where that does not pass
    Run(SubjectRunArgs),
}

#[derive(Debug, clap::Args)]
pub(crate) struct SubjectRunArgs {
    /// Subject file (TOML), or the name of one in assets/subjects
    #[arg(value_name = "NAME|FILE")]
    pub(crate) subject: PathBuf,
    /// Folder for played.toml, played.session.json and played.score.json, as play leaves them; out/NAME if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print the score as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}
