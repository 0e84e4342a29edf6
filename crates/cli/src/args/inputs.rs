//! Arguments of the commands that examine inputs of scenes: vessels and devices.

use std::path::PathBuf;

use clap::Subcommand;
use endowire_core::Vec3;
use endowire_core::passable::NO_FORCE_N;
use endowire_core::vessel::{CentrelineEnd, Ends, Parts, PatientAxes, RepairMode, SurfaceFrame};

use super::{CacheArgs, SetArgs};
use crate::commands::parse_end;

#[derive(Debug, Subcommand)]
pub(crate) enum VesselCommand {
    /// Report on a surface: openings, flipped and degenerate triangles, self-intersections, volume
    Check {
        /// Surface mesh (STL, OBJ, PLY, VTP or VTK)
        file: PathBuf,
        #[command(flatten)]
        frame: CoordinateArgs,
        /// Count septa between lumens that are thinner than so many mm
        #[arg(long, default_value_t = 1.0, value_name = "MM")]
        septum_mm: f64,
        #[command(flatten)]
        repair: RepairArgs,
        #[command(flatten)]
        felt: FeltArgs,
        /// Print the report as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// Build a wall from a centre-line tree
    Generate(GenerateArgs),
    /// Make a surface of a segmentation: a label map as TotalSegmentator and 3D Slicer write them (NIfTI), smoothed within half a voxel and opened
    /// at the ends of its vessels
    FromLabels(FromLabelsArgs),
    /// Find the centre line of a surface, with the radius of the largest sphere about each point
    Centreline(CentrelineArgs),
    /// Measure the sac of an aneurysm: neck, volume, height
    Sac(SacArgs),
    /// Report whether a device can follow the path to a target: room, narrowest place, sharpest bend; passes, tight, blocked or short
    Passable(PassableArgs),
    /// Push the devices of a scene into a vessel that yields, and report what becomes of its course: lengths, tortuosity and angles between
    /// named places before and after, and how far these have moved
    Straighten(StraightenArgs),
}

#[derive(Debug, Subcommand)]
pub(crate) enum DeviceCommand {
    /// One device, part by part
    Show {
        /// Device file (TOML)
        file: PathBuf,
        /// Draw its shape at rest (.svg or .png)
        #[arg(long, value_name = "PICTURE")]
        out: Option<PathBuf>,
        /// Print the parts as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// The devices of a folder, one a line
    List {
        /// Folder of device files (TOML)
        #[arg(default_value = "assets/devices")]
        folder: PathBuf,
        /// Draw all shapes at rest on one sheet, to one scale (.svg or .png)
        #[arg(long, value_name = "PICTURE")]
        out: Option<PathBuf>,
        /// Print the devices as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
}

/// Unit and axes of the coordinates in a surface file.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct CoordinateArgs {
    /// Millimetres per unit of the file
    #[arg(long, default_value_t = 1.0, value_name = "MM", value_parser = parse_above_zero)]
    pub(crate) unit_mm: f64,
    /// Axes of the file, LPS or RAS; if absent, those of its header, or LPS
    #[arg(long, value_name = "AXES")]
    pub(crate) axes: Option<PatientAxes>,
}

impl From<CoordinateArgs> for SurfaceFrame {
    fn from(CoordinateArgs { unit_mm, axes }: CoordinateArgs) -> Self {
        Self { unit_mm, axes }
    }
}

/// What of a surface is repaired, as `vessel.repair` and `vessel.keep_open_mm` of a scene say.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct RepairArgs {
    /// all: faults are repaired; none: the surface is taken as it is, or refused
    #[arg(long, value_name = "all|none", default_value = "all")]
    pub(crate) repair: RepairMode,
    /// A place x,y,z in mm: the hole nearest to it is meant, and is not closed (repeatable)
    #[arg(long = "keep-open", value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    pub(crate) keep_open_mm: Vec<Vec3>,
}

/// Requests about the contact wall; without any of them it is not computed.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct FeltArgs {
    /// Write the evenly meshed contact wall (.ply, .obj or .stl) and report on it
    #[arg(long, value_name = "FILE")]
    pub(crate) felt: Option<PathBuf>,
    /// How far that wall may be from the surface, mm, as vessel.wall.deviation_mm of a scene; 0.1 if absent
    #[arg(long, value_name = "MM")]
    pub(crate) deviation_mm: Option<f64>,
    /// Draw that wall (PNG): red where it is inside the surface by that distance, blue where it is outside
    #[arg(long, value_name = "FILE")]
    pub(crate) picture: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct GenerateArgs {
    /// Centre-line table (x y z radius parent, mm), or the name of a built-in anatomy
    pub(crate) tree: PathBuf,
    /// Surface file to write (.stl, .obj or .ply)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Length of the triangles' edges; a quarter of the smallest radius if absent
    #[arg(long, value_name = "MM", conflicts_with = "triangles")]
    pub(crate) edge_mm: Option<f64>,
    /// Number of triangles, met within a few percent
    #[arg(long, value_name = "COUNT")]
    pub(crate) triangles: Option<usize>,
    /// Print the report as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

/// Where a vessel ends: where its label touches the picture's border with at least a third of its section (the vessel goes on beyond the
/// picture), and where a branch at least twice as long as wide ends within the picture (the segmentation stops there; shorter ones are domes and
/// stumps, and stay closed). Each end is cut by a plane across the centre line: at the border as far inside as an oblique vessel needs, within the
/// picture about a radius from its tip. Coordinates are those of scenes (left, posterior, superior, mm), so that the tomogram of the
/// segmentation fits the vessel as the body in the beam ([view.patient.ct])
#[derive(Debug, clap::Args)]
pub(crate) struct FromLabelsArgs {
    /// Label map (.nii, .nii.gz): whole numbers in any type, 0 for the background
    pub(crate) file: PathBuf,
    /// The label of the vessel (repeatable: several labels become one vessel)
    #[arg(long, value_name = "NUMBER", required = true)]
    pub(crate) label: Vec<u16>,
    /// Surface file to write (.stl, .obj or .ply)
    #[arg(long, value_name = "FILE", alias = "output")]
    pub(crate) out: PathBuf,
    /// Which parts of the label, if they do not touch: the largest, or all of at least eight voxels
    #[arg(long, value_name = "largest|all", default_value = "largest")]
    pub(crate) parts: Parts,
    /// Which ends are opened: all, only those at the picture's border, or none
    #[arg(long, value_name = "all|border|none", default_value = "all")]
    pub(crate) ends: Ends,
    /// Print the report as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct CentrelineArgs {
    /// Surface mesh (STL, OBJ, PLY, VTP or VTK)
    pub(crate) file: PathBuf,
    /// Where the centre line begins: the number of an opening, or a place x,y,z inside in mm; if absent, the inlet that `vessel check` reports
    #[arg(long, value_name = "END", value_parser = parse_end, allow_hyphen_values = true)]
    pub(crate) from: Option<CentrelineEnd>,
    /// Where the centre line ends: the number of an opening, or a place x,y,z inside in mm (repeatable); all other openings if absent
    #[arg(long, value_name = "END", value_parser = parse_end, allow_hyphen_values = true)]
    pub(crate) to: Vec<CentrelineEnd>,
    /// Write the centre-line table (x,y,z,radius,parent and the names of ends)
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frame: CoordinateArgs,
    /// Print the branches as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct SacArgs {
    /// Surface mesh (STL, OBJ, PLY, VTP or VTK)
    pub(crate) file: PathBuf,
    /// A place x,y,z within the sac in mm
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    pub(crate) dome: Vec3,
    /// A place x,y,z in the parent artery; if absent, the nearest point of the centre line found in the surface
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    pub(crate) parent: Option<Vec3>,
    #[command(flatten)]
    pub(crate) frame: CoordinateArgs,
    /// Print the measurements as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct PassableArgs {
    /// Surface mesh (STL, OBJ, PLY, VTP or VTK)
    pub(crate) file: PathBuf,
    /// Device file (TOML)
    #[arg(long, value_name = "FILE")]
    pub(crate) device: PathBuf,
    /// Where its tip goes: the number of an opening, a place x,y,z inside in mm, or with --centreline the name of a target
    #[arg(long, value_name = "END", allow_hyphen_values = true)]
    pub(crate) to: String,
    /// What the path passes, where vessels meet again: a target, such as "arm 1", or a place x,y,z in mm; the shortest path if absent
    #[arg(long, value_name = "PLACE", allow_hyphen_values = true)]
    pub(crate) via: Option<String>,
    /// Where the device enters: the number of an opening, or a place x,y,z inside in mm; if absent, the inlet that `vessel check` reports
    #[arg(long, value_name = "END", value_parser = parse_end, allow_hyphen_values = true, conflicts_with = "centreline")]
    pub(crate) from: Option<CentrelineEnd>,
    /// Centre-line table of the surface, with names; if absent, the path is found in the surface
    #[arg(long, value_name = "FILE")]
    pub(crate) centreline: Option<PathBuf>,
    /// Force along the device, N, below which a section counts as passing a bend freely
    #[arg(long, default_value_t = NO_FORCE_N, value_name = "N")]
    pub(crate) force_n: f64,
    /// Draw the path through the vessel, coloured by its room, and plot room and bends along it (.png)
    #[arg(long, value_name = "FILE")]
    pub(crate) picture: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frame: CoordinateArgs,
    /// Print the result as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct StraightenArgs {
    /// Scene with a script and a table [vessel.yielding] (TOML)
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Draw the vessel before and after into this folder, in the views of the scene
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the result as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

/// Parses a place `x,y,z`.
fn parse_place(text: &str) -> Result<Vec3, String> {
    match parse_end(text) {
        Ok(CentrelineEnd::Place(place_mm)) => Ok(place_mm),
        Err(far) if text.split(',').count() == 3 => Err(far),
        _ => Err("expected a place x,y,z in mm".to_owned()),
    }
}

/// Parses a number above 0.
pub(super) fn parse_above_zero(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    let is_right = number.is_finite() && number > 0.0;
    is_right.then_some(number).ok_or_else(|| "must be a finite number above 0".to_owned())
}
