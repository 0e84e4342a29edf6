//! Arguments of studies.

use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct EvidenceArgs {
    /// Study: three-tubes, coil-forces, reversal, whip, capstan, tube-buckling or bending; if absent, they are listed
    #[arg(value_name = "NAME")]
    pub(crate) study: Option<String>,
    /// The measurements, for three-tubes: they are not part of this program, and the study says where to get them
    #[arg(value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,
    /// With three-tubes: also fit with play between the tubes; some minutes
    #[arg(long)]
    pub(crate) play: bool,
    /// With three-tubes: also drive the tubes, with play and friction, along the path of the measurements; some minutes
    #[arg(long)]
    pub(crate) friction: bool,
    /// Print the study as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
    /// Also write a page for a browser: figure, table, question, data, and what the study does not show; evidence.html if FILE is absent
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "evidence.html")]
    pub(crate) page: Option<PathBuf>,
    /// Also draw the figure (.svg or .png)
    #[arg(long, value_name = "PICTURE")]
    pub(crate) out: Option<PathBuf>,
}
