//! Command line arguments.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Parser, Subcommand, ValueEnum};
use endowire_methods::NAMES;
use endowire_sweep::Shard;
use endowire_viewer::{Mode, Pose};

use crate::commands::compare::case::CASES;
use crate::commands::experiment::navigation::targets;

/// Simulates catheters and guidewires in blood vessels: scripted insertions, experiments, 3D and fluoroscopic frames.
///
/// Exit codes: 0 done; 1 the computation failed or was interrupted (Ctrl-C; what was recorded is kept); 2 bad input or usage.
#[derive(Debug, Parser)]
#[command(name = "endowire", version, propagate_version = true)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the scripted insertion of a scene and record it: summary.json, steps.csv, shapes.npz, frames/*.png
    Run(RunArgs),
    /// Run a scene many times with other values of its keys: one Parquet row a run. Killed at any moment, the same command goes on
    Sweep(SweepArgs),
    /// Move the instruments of a scene by hand, under fluoroscopy: a window, or a protocol of JSON lines; what is done is recorded as a script
    Play(PlayArgs),
    /// Draw frames of a recorded run, from any position of the C-arm
    Render(RenderArgs),
    /// Write a recorded run as one page for a browser: the shape to turn and to scrub through time, forces, events, frames; or the tables
    /// and pictures of an experiment
    Report(ReportArgs),
    /// Write a recorded run for other programs: a series for ParaView and 3D Slicer (VTK)
    Export(ExportArgs),
    /// Draw fluoroscopic frames of a scene: after its script, or of a contrast injection
    Fluoro(FluoroArgs),
    /// Draw labelled fluoroscopic pictures of many scenes, devices, poses, doses and moments, for learning
    Dataset(DatasetArgs),
    /// Solve one static rod: sections, supports and loads in, shape, energy and reactions out
    Rod(RodArgs),
    /// Compare every reference case with its exact or independently computed answer
    Verify(VerifyArgs),
    /// Check or generate vessel walls
    #[command(subcommand)]
    Vessel(VesselCommand),
    /// Show device files: parts, sizes in all units, stiffnesses, materials, sources, and the shape at rest
    #[command(subcommand)]
    Device(DeviceCommand),
    /// Run time against error, method by method: tables and a work–precision picture
    Compare(CompareArgs),
    /// Repeat an experiment of Li et al. 2011
    #[command(subcommand)]
    Experiment(ExperimentCommand),
    /// Make a folder with a scene to start from: vessel, device, script, views. It runs at once
    New(NewArgs),
    /// Say what this machine has and what of it is used: adapter, display, threads, cache
    Doctor {
        /// Print it as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// Print the completions of a shell on stdout
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Print the manual page on stdout (roff); of a command if one is named
    Man {
        /// Command
        command: Option<String>,
    },
}

#[derive(Debug, clap::Args)]
pub(crate) struct RunArgs {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Carry out the script of this file, tables `script` alone, in place of the scene's own: what `play` has recorded
    #[arg(long, value_name = "FILE")]
    pub(crate) script: Option<PathBuf>,
    /// Folder for the recording; out/NAME OF THE SCENE if absent. An earlier recording in it is replaced
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Record also into a folder that holds other files; of these, summary.json, steps.csv, instruments.csv,
    /// shapes.npz and frames/step_*.png of the same name are replaced
    #[arg(long)]
    pub(crate) force: bool,
    /// Save the state of the run into a file, again and again while it goes on and at its end. The file is whole at any moment, also after
    /// the run was killed
    #[arg(long, value_name = "FILE")]
    pub(crate) save_state: Option<PathBuf>,
    /// Go on from a saved state of the same scene. The recording in DIR goes on after the step the state was saved at: what was recorded
    /// later is dropped, and what follows has the bits of a run that was never interrupted. A new or empty DIR gets the steps from
    /// there on. With --save-state of the same file a run can be killed and resumed any number of times
    #[arg(long, value_name = "FILE")]
    pub(crate) resume: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print the summary as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
    /// Print neither progress nor summary; failures are told
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ReportArgs {
    /// Folder of a recorded run, or of an experiment or comparison
    pub(crate) dir: PathBuf,
    /// File of the page; DIR/report.html if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Scene file, where it is not the one that summary.json names
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct NewArgs {
    /// Folder to make; it must not be there, or be empty
    pub(crate) dir: PathBuf,
    /// Surface of a vessel (STL, OBJ or PLY, in mm), which is copied, or a built-in anatomy
    #[arg(long, default_value = "aortic_arch", value_name = "FILE|NAME")]
    pub(crate) vessel: PathBuf,
    /// Device file, such as one of the catalogue in assets/devices, which is copied; an angled hydrophilic wire of 0.035 in if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) device: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct PlayArgs {
    /// Scene file (TOML); its script is not carried out
    pub(crate) scene: PathBuf,
    /// File for what hands have done: a script that `endowire run SCENE --script FILE` carries out to the bit; out/NAME OF THE
    /// SCENE/played.toml if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Without a window: inputs are lines of JSON on stdin, answers lines of JSON on stdout, and time goes by as inputs say
    #[arg(long)]
    pub(crate) headless: bool,
    /// With --headless: take the lines of this file in place of stdin
    #[arg(long, requires = "headless", value_name = "FILE")]
    pub(crate) inputs: Option<PathBuf>,
    /// With --headless: time goes by as on a clock, and pictures are drawn as for the window
    #[arg(long, requires = "headless")]
    pub(crate) realtime: bool,
    /// Take inputs, lines of JSON, also from programs that connect to this address, such as 127.0.0.1:7000
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) listen: Option<std::net::SocketAddr>,
    /// Width and height of the fluoroscopic picture in pixels, 64 to 1024
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=1024))]
    pub(crate) size: u32,
    /// Warn where a hand pushes or pulls harder than this
    #[arg(long, default_value_t = 1.0, value_name = "N")]
    pub(crate) warn_n: f64,
    /// Warn where a hand holds a greater torque than this
    #[arg(long, default_value_t = 5.0, value_name = "N·MM")]
    pub(crate) warn_nmm: f64,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print at the end what was done, and how fast, as one JSON document on stdout; not without a window and a clock, where stdout is for answers
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SweepArgs {
    /// Sweep file (TOML): a scene, and an axis for each key that varies
    #[arg(required = true)]
    pub(crate) sweep: Option<PathBuf>,
    /// Folder for rows as they come (runs.jsonl), the table of all (runs.parquet), and recordings where they are asked for
    #[arg(long, value_name = "DIR", required = true)]
    pub(crate) out: Option<PathBuf>,
    /// Do one of several parts: the first of four is 1/4. Parts may go into one folder or into several, on one machine or on many
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub(crate) shard: Shard,
    /// Runs at the same time; the number of cores if absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print what has come of it as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
    #[command(subcommand)]
    pub(crate) merge: Option<SweepCommand>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum SweepCommand {
    /// Make one table of the rows in the folders of shards, in whatever order they are given
    Merge {
        /// Folders of endowire sweep --out
        #[arg(required = true, value_name = "DIR")]
        folders: Vec<PathBuf>,
        /// Table to write (Parquet)
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

/// Whether walls are kept from run to run.
#[derive(Debug, clap::Args)]
pub(crate) struct CacheArgs {
    /// Make the vessel's wall anew and keep nothing of it. Otherwise a wall that takes long to make is kept, up to 1 GiB in all, in the
    /// folder walls of $ENDOWIRE_CACHE, or of endowire where the system has the caches of a user (Linux: $XDG_CACHE_HOME or ~/.cache;
    /// macOS: ~/Library/Caches; Windows: %LOCALAPPDATA%). It may be removed at any time
    #[arg(long)]
    pub(crate) no_cache: bool,
}

/// Which views are drawn.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum ViewChoice {
    #[value(name = "3d")]
    ThreeD,
    Fluoro,
    Both,
}

/// What is drawn and written, whatever it is drawn of.
#[derive(Debug, clap::Args)]
pub(crate) struct FrameArgs {
    /// Views to draw; the scene's if absent
    #[arg(long)]
    pub(crate) view: Option<ViewChoice>,
    /// Angles of the C-arm: "LAO 40", "RAO 30 CAU 20", "AP"
    #[arg(long, value_name = "ANGLES")]
    pub(crate) pose: Option<Pose>,
    /// What fluoroscopy shows: fluoro, cine, dsa or roadmap
    #[arg(long, value_parser = mode)]
    pub(crate) mode: Option<Mode>,
    /// Width and height in pixels
    #[arg(long, value_delimiter = 'x', num_args = 1, value_name = "W[xH]")]
    pub(crate) size: Option<Vec<u32>>,
    /// Bits a pixel of fluoroscopic frames, 8 or 16
    #[arg(long)]
    pub(crate) bits: Option<u32>,
    /// Set any other key of the scene's view table, as in c_arm.sid_mm=1000 (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Turn the camera of the 3D view by so many degrees from the first frame to the last
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub(crate) orbit: Option<f64>,
    /// Draw fluoroscopy in a second plane as well, turned by so many degrees (towards LAO) from the first: frames NAME_fluoro_b.png, and a
    /// second DICOM file FILE_b of the pair. Labels, arrays and moving pictures are of the first plane
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub(crate) biplane: Option<f64>,
    /// Write one moving picture of the views side by side: an animated PNG (.png, .apng), a GIF (.gif), or a film (.mp4) where the program
    /// was built with the feature mp4
    #[arg(long, value_name = "FILE")]
    pub(crate) animate: Option<PathBuf>,
    /// Write the fluoroscopic frames as one DICOM file (X-ray angiographic image)
    #[arg(long, value_name = "FILE")]
    pub(crate) dicom: Option<PathBuf>,
    /// Write labels for learning beside each fluoroscopic frame: device mask (PNG), centre line, tip and contacts (JSON)
    #[arg(long)]
    pub(crate) labels: bool,
    /// Write path lengths and line integrals as float arrays (npy) beside each fluoroscopic frame
    #[arg(long)]
    pub(crate) raw: bool,
    /// Write the last image hold, the mean of the last fluoroscopic frames
    #[arg(long)]
    pub(crate) hold: bool,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print what was written as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

/// The methods that are compared. A wrong name is answered with the nearest right one.
fn method_names() -> PossibleValuesParser {
    PossibleValuesParser::new(NAMES)
}

fn all_or_method_names() -> PossibleValuesParser {
    PossibleValuesParser::new(std::iter::once("all").chain(NAMES))
}

fn case_names() -> PossibleValuesParser {
    PossibleValuesParser::new(CASES.map(|case| case.0))
}

fn mode(text: &str) -> Result<Mode, String> {
    serde_json::from_value(serde_json::Value::from(text)).map_err(|e| e.to_string())
}

#[derive(Debug, clap::Args)]
pub(crate) struct RenderArgs {
    /// Folder of a recorded run
    pub(crate) dir: PathBuf,
    /// Scene file of the run, if it is no longer where it was
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// First recorded step to draw
    #[arg(long, default_value_t = 1, value_name = "STEP")]
    pub(crate) from: usize,
    /// Last recorded step to draw; the last one if absent
    #[arg(long, value_name = "STEP")]
    pub(crate) to: Option<usize>,
    /// Draw every so many steps, and the last; every step if absent
    #[arg(long, default_value_t = 1, value_name = "STEPS")]
    pub(crate) every: usize,
    /// Folder for the frames; DIR/render if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frames: FrameArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ExportArgs {
    /// Folder of a recorded run
    pub(crate) dir: PathBuf,
    /// Folder for run.pvd, which lists the steps with their times, step_*.vtp (instruments as lines, contacts as points with their forces)
    /// and vessel.vtp; files of these names are replaced
    #[arg(long, value_name = "DIR")]
    pub(crate) vtk: PathBuf,
    /// Scene file of the run, if it is no longer where it was
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct FluoroArgs {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Steps of the script to carry out before; 0 leaves the vessel without a device
    #[arg(long, value_name = "STEPS")]
    pub(crate) steps: Option<usize>,
    /// Time of the first frame in seconds, for injections
    #[arg(long, default_value_t = 0.0, value_name = "S", allow_negative_numbers = true)]
    pub(crate) time: f64,
    /// Number of frames, at the scene's frames_per_s
    #[arg(long, default_value_t = 1, value_name = "COUNT")]
    pub(crate) count: u32,
    /// Folder for the frames; out/NAME OF THE SCENE if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frames: FrameArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct DatasetArgs {
    /// Specification (TOML)
    pub(crate) spec: PathBuf,
    /// Folder for images, arrays and annotations.json; a call that was ended goes on in it
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print what was written as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct RodArgs {
    /// Case file (TOML)
    pub(crate) case: PathBuf,
    /// Print the solution as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct VerifyArgs {
    /// Add the numerical stress table: stiffness, loads, meshes and shapes far from the ordinary
    #[arg(long)]
    pub(crate) stress: bool,
    /// Instead of the reference cases, run a matrix of insertions into every surface of a folder (STL, OBJ, PLY; NAME.toml beside a
    /// surface may give unit_mm, a table sheath, length_mm and device_radius_mm)
    #[arg(long, value_name = "DIR", conflicts_with = "stress")]
    pub(crate) surfaces: Option<PathBuf>,
    /// Every combination of the matrix: 162 cells a wire instead of 18
    #[arg(long, requires = "surfaces")]
    pub(crate) full: bool,
    /// Only cells whose name has all of these words, as in "phantom* 0.035 mu0.3"
    #[arg(long, value_name = "PATTERN", requires = "surfaces")]
    pub(crate) cells: Option<String>,
    /// Print the cells as scene files instead of running them
    #[arg(long, requires = "surfaces", conflicts_with = "json")]
    pub(crate) scene: bool,
    /// Cells that run at the same time; the number of cores if absent
    #[arg(long, value_name = "N", requires = "surfaces")]
    pub(crate) jobs: Option<usize>,
    /// Longest time of a cell: one that takes longer fails
    #[arg(long, default_value_t = 120.0, value_name = "S", requires = "surfaces")]
    pub(crate) limit_s: f64,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum VesselCommand {
    /// Report on a surface: openings, flipped and degenerate triangles, self-intersections, volume
    Check {
        /// Surface mesh (STL, OBJ or PLY)
        file: PathBuf,
        /// Millimetres per unit of the file
        #[arg(long, default_value_t = 1.0, value_name = "MM", allow_negative_numbers = true)]
        unit_mm: f64,
        /// Count septa between lumens that are thinner than so many mm
        #[arg(long, default_value_t = 1.0, value_name = "MM", allow_negative_numbers = true)]
        septum_mm: f64,
        #[command(flatten)]
        felt: FeltArgs,
        /// Print the report as one JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// Build a wall from a centre-line tree
    Generate(GenerateArgs),
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

/// What is wanted of the wall that devices feel; with none of these it is not made.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct FeltArgs {
    /// Write the evenly meshed wall that devices feel (.ply, .obj or .stl) and report on it
    #[arg(long, value_name = "FILE")]
    pub(crate) felt: Option<PathBuf>,
    /// How far that wall may be from the surface, mm, as vessel.wall.deviation_mm of a scene; 0.1 if absent
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
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
    #[arg(long, value_name = "MM", allow_negative_numbers = true, conflicts_with = "triangles")]
    pub(crate) edge_mm: Option<f64>,
    /// Number of triangles, met within a few percent
    #[arg(long, value_name = "COUNT")]
    pub(crate) triangles: Option<usize>,
    /// Print the report as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct CompareArgs {
    /// Folder for compare.csv, .json, .svg and .png; rows that compare.csv already has are not run again
    #[arg(long, default_value = "out/compare", value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Cases to run; all if absent
    #[arg(long, visible_alias = "case", value_delimiter = ',', value_name = "CASE,…", value_parser = case_names())]
    pub(crate) cases: Vec<String>,
    /// Methods to run; all if absent
    #[arg(long, visible_alias = "method", value_delimiter = ',', value_name = "METHOD,…", value_parser = method_names())]
    pub(crate) methods: Vec<String>,
    /// Numbers of elements to run, as 8,16,32; those that show each method best if absent
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub(crate) elements: Vec<usize>,
    /// Longest time of one solve or insertion
    #[arg(long, default_value_t = 30.0, value_name = "S", allow_negative_numbers = true)]
    pub(crate) limit_s: f64,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ExperimentCommand {
    /// Experiment 1: time per calculation against the number of nodes (the paper's Table 1)
    Timing(TimingArgs),
    /// Experiment 2: a shaped wire steered to every named target of the aortic arch and the hepatic arteries
    Navigation(NavigationArgs),
    /// Experiment 3: a soft tip stopped in a tube, and the loop that grows (the paper's figure 4)
    Loop(LoopArgs),
    /// Experiment 4: shape in the curved tube against a ground truth (the paper's Table 2)
    Deformation(DeformationArgs),
}

#[derive(Debug, clap::Args)]
pub(crate) struct NavigationArgs {
    /// Targets to steer to; all if absent
    #[arg(long, visible_alias = "target", value_delimiter = ',', value_name = "TARGET,…", value_parser = PossibleValuesParser::new(targets()))]
    pub(crate) targets: Vec<String>,
    /// Steer devices of the catalogue in this folder (assets/devices), wires in catheters: to the branches of three types of the aortic
    /// arch and to both hepatic arteries
    #[arg(long, value_name = "DIR")]
    pub(crate) catalogue: Option<PathBuf>,
    /// Folder for navigation.csv, navigation.json and frames of both views
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

impl NavigationArgs {
    /// Whether a target is asked for.
    pub(crate) fn wants(&self, target: &str) -> bool {
        self.targets.is_empty() || self.targets.iter().any(|name| name == target)
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct LoopArgs {
    /// Folder for loop.csv, loop.json, four frames of both views, and loop.svg and .png
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct DeformationArgs {
    /// Measured points (CSV: x_mm,y_mm,z_mm from the sheath to the tip) instead of the computed ground truth
    #[arg(long, value_name = "FILE")]
    pub(crate) measured: Option<PathBuf>,
    /// Method
    #[arg(long, default_value = "kirchhoff", value_name = "METHOD", value_parser = method_names())]
    pub(crate) method: String,
    /// Segment lengths of Table 2 to run (1, 2, 3); all if absent
    #[arg(long, value_delimiter = ',', value_name = "L,…")]
    pub(crate) l_mm: Vec<f64>,
    /// Increments a segment of Table 2 to run (40, 20, 10, 5, 3); all if absent
    #[arg(long, value_delimiter = ',', value_name = "COUNT,…")]
    pub(crate) l_over_h: Vec<u32>,
    /// Folder for deformation.csv and deformation.json
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct TimingArgs {
    /// Numbers of nodes
    #[arg(long, value_delimiter = ',', default_values_t = [50, 100, 150, 200, 300], value_name = "N,N,…")]
    pub(crate) nodes: Vec<usize>,
    /// Timed calculations for each number of nodes
    #[arg(long, default_value_t = 15, value_name = "COUNT")]
    pub(crate) repeats: usize,
    /// Methods: all, or some of them
    #[arg(long, visible_alias = "method", value_delimiter = ',', default_values_t = ["li2011-dense", "li2011-banded", "kirchhoff"].map(String::from), value_name = "METHOD,…", value_parser = all_or_method_names())]
    pub(crate) methods: Vec<String>,
    /// Longest time for a method to be brought in position; one that takes longer is told in a note
    #[arg(long, default_value_t = 10.0, value_name = "S", allow_negative_numbers = true)]
    pub(crate) limit_s: f64,
    /// Folder for timing.csv and timing.json
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}
