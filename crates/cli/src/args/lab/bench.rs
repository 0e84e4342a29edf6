//! Arguments of bench tests of devices.

use std::path::PathBuf;

use clap::Subcommand;

use crate::args::CacheArgs;

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// Torque response: the angle of the tip against that of the hand, which turns a device at the end of a track; lag and whip
    Torque(TorqueArgs),
    /// Push (trackability): the force of the hand along a track, without friction and with it
    Push(PushArgs),
    /// Tip load: the force of a tip against a surface that is pressed on it, over the stroke, and where it gives way
    TipLoad(TipLoadArgs),
    /// Three-point bending: flexural rigidity along a device and part by part, and force over deflection
    Bend(BendArgs),
}

/// What a bench test prints and writes.
#[derive(Debug, clap::Args)]
pub(crate) struct BenchOutputArgs {
    /// Print results and all readings as one JSON document on stdout
    #[arg(long, conflicts_with = "csv")]
    pub(crate) json: bool,
    /// Print all readings as CSV on stdout
    #[arg(long)]
    pub(crate) csv: bool,
    /// Also write a page for a browser: curves, table, how it was tested; bench.html if FILE is absent
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "bench.html")]
    pub(crate) page: Option<PathBuf>,
    /// Also draw the curves (.svg or .png)
    #[arg(long, value_name = "PICTURE")]
    pub(crate) out: Option<PathBuf>,
}

/// The track that devices are pushed into.
#[derive(Debug, clap::Args)]
pub(crate) struct TrackArgs {
    /// Centre-line table (x y z radius parent, mm) or surface (STL, OBJ, PLY, VTP or VTK; mm) of the track, or a built-in anatomy; the standard
    /// tortuous path if absent: 4 mm wide, 265 mm long, bends of 90°, 180° and 90° with radii of 40, 25 and 15 mm
    #[arg(long, value_name = "FILE|NAME")]
    pub(crate) track: Option<PathBuf>,
    /// Coefficient of friction between device and track
    #[arg(long, default_value_t = 0.1, value_name = "MU")]
    pub(crate) friction: f64,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct TorqueArgs {
    /// Devices: names in the catalogue (assets/devices) or device files
    #[arg(required = true, value_name = "DEVICE")]
    pub(crate) devices: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) track: TrackArgs,
    /// Angle through which the hand turns, degrees
    #[arg(long, default_value_t = 720.0, value_name = "DEG")]
    pub(crate) turn_deg: f64,
    /// Angle of the hand between two readings, degrees
    #[arg(long, default_value_t = 7.5, value_name = "DEG")]
    pub(crate) step_deg: f64,
    #[command(flatten)]
    pub(crate) output: BenchOutputArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct PushArgs {
    /// Devices: names in the catalogue (assets/devices) or device files
    #[arg(required = true, value_name = "DEVICE")]
    pub(crate) devices: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) track: TrackArgs,
    /// Length between two readings, mm
    #[arg(long, default_value_t = 2.5, value_name = "MM")]
    pub(crate) step_mm: f64,
    #[command(flatten)]
    pub(crate) output: BenchOutputArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct TipLoadArgs {
    /// Devices: names in the catalogue (assets/devices) or device files
    #[arg(required = true, value_name = "DEVICE")]
    pub(crate) devices: Vec<PathBuf>,
    /// Length that sticks out of the holder, mm
    #[arg(long, default_value_t = 10.0, value_name = "MM")]
    pub(crate) free_length_mm: f64,
    /// How far the surface moves towards the holder from where it touches the tip, mm
    #[arg(long, default_value_t = 2.0, value_name = "MM")]
    pub(crate) stroke_mm: f64,
    /// Coefficient of friction between tip and surface; with friction a straight tip is held until it buckles, at up to eight times the force
    #[arg(long, default_value_t = 0.0, value_name = "MU")]
    pub(crate) friction: f64,
    #[command(flatten)]
    pub(crate) output: BenchOutputArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct BendArgs {
    /// Devices: names in the catalogue (assets/devices) or device files
    #[arg(required = true, value_name = "DEVICE")]
    pub(crate) devices: Vec<PathBuf>,
    /// Distance between the supports, mm
    #[arg(long, default_value_t = 20.0, value_name = "MM")]
    pub(crate) span_mm: f64,
    /// Largest deflection, mm, at most a fifth of the span
    #[arg(long, default_value_t = 1.0, value_name = "MM")]
    pub(crate) deflection_mm: f64,
    /// Distance from the tip, mm, at which the force over the deflection is measured; the middle of each device's longest part if absent
    #[arg(long, value_name = "MM")]
    pub(crate) at_mm: Option<f64>,
    #[command(flatten)]
    pub(crate) output: BenchOutputArgs,
}
