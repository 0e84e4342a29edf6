//! Arguments of the laboratory.

mod bench;
mod evidence;
mod studies;

use std::path::PathBuf;

use super::CacheArgs;

pub(crate) use bench::{
    BenchCommand, BenchOutputArgs, BendArgs, PushArgs, TipLoadArgs, TorqueArgs, TrackArgs,
};
pub(crate) use evidence::EvidenceArgs;
pub(crate) use studies::{
    CoilArgs, CompareArgs, DeformationArgs, ExperimentCommand, LoopArgs, NavigationArgs, TimingArgs,
};

#[derive(Debug, clap::Args)]
pub(crate) struct VerifyArgs {
    /// Add the numerical stress table: extreme stiffnesses, loads, meshes and shapes
    #[arg(long)]
    pub(crate) stress: bool,
    /// Number of random commands in each case of the stress table with several instruments
    #[arg(long, default_value_t = 1_000, value_name = "COUNT", requires = "stress", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) commands: u32,
    /// Instead of the reference cases, run a matrix of insertions into every surface of a folder (STL, OBJ, PLY; NAME.toml beside a
    /// surface may give unit_mm, a table sheath, length_mm and device_radius_mm)
    #[arg(long, value_name = "DIR", conflicts_with = "stress")]
    pub(crate) surfaces: Option<PathBuf>,
    /// Every combination of the matrix: 162 cells per wire instead of 18
    #[arg(long, requires = "surfaces")]
    pub(crate) full: bool,
    /// Only cells whose name has all of these words, as in "phantom* 0.035 mu0.3"
    #[arg(long, value_name = "PATTERN", requires = "surfaces")]
    pub(crate) cells: Option<String>,
    /// Print the cells as scene files instead of running them
    #[arg(long, requires = "surfaces", conflicts_with = "json")]
    pub(crate) scene: bool,
    /// Cells that run at the same time; the number of cores if absent
    #[arg(long, value_name = "N", requires = "surfaces", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    /// Longest time of a cell: one that takes longer fails
    #[arg(long, default_value_t = 120.0, value_name = "S", requires = "surfaces")]
    pub(crate) limit_s: f64,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}
