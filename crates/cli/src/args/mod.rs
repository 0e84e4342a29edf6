//! Command line arguments.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "doc comments here are help texts, in which script[0] is no link"
)]

mod inputs;
#[cfg_attr(not(feature = "lab"), path = "no_lab.rs")]
mod lab;
mod pictures;
mod subjects;

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use endowire_methods::Setting;
use endowire_sweep::Shard;

pub(crate) use inputs::{
    CentrelineArgs, CoordinateArgs, DeviceCommand, FeltArgs, FromLabelsArgs, GenerateArgs, PassableArgs,
    RepairArgs, SacArgs, StraightenArgs, VesselCommand,
};
pub(crate) use lab::{BenchCommand, CompareArgs, EvidenceArgs, ExperimentCommand, VerifyArgs};
#[cfg(feature = "lab")]
pub(crate) use lab::{
    BenchOutputArgs, BendArgs, CoilArgs, DeformationArgs, LoopArgs, NavigationArgs, PushArgs, TimingArgs,
    TipLoadArgs, TorqueArgs, TrackArgs,
};
pub(crate) use pictures::{DatasetArgs, ExportArgs, FluoroArgs, FrameArgs, RenderArgs, ViewChoice};
pub(crate) use subjects::{SubjectCommand, SubjectRunArgs};

/// Simulates catheters and guidewires in blood vessels: scripted insertions, experiments, 3D and fluoroscopic frames.
///
/// Exit codes: 0 done; 1 the computation failed, steps found no equilibrium (--allow-unconverged takes them), or it was interrupted (Ctrl-C);
/// what was recorded is kept; 2 bad input or usage.
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
    /// Run a scene many times with other values of its keys: one Parquet row a run. After an interruption the same command continues
    Sweep(SweepArgs),
    /// Move the instruments of a scene by hand, under fluoroscopy: a window, or a protocol of JSON lines; the session is recorded as a script
    Play(PlayArgs),
    /// Score sessions of play, or recorded runs, by the measures of studies of trainees: time, radiation, contrast medium, motion, safety, path, task
    Assess(AssessArgs),
    /// Training subjects: a task in a scene with a goal, limits and thresholds of measures
    #[command(subcommand)]
    Subject(SubjectCommand),
    /// Draw frames of a recorded run, from any position of the C-arm
    Render(RenderArgs),
    /// Write a recorded run, or several to compare, as one page for a browser: the shape to turn and to scrub through time, forces over
    /// length, angle, time or steps, events, frames; or the tables and pictures of an experiment
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
    /// Bench tests of devices: torque response, push along a tortuous path, tip load, three-point bending; several devices in one table and
    /// one picture
    #[cfg_attr(feature = "lab", command(subcommand))]
    Bench(BenchCommand),
    /// Studies that compare the model with measurements and exact laws: question, data, figure, error, and what they do not show
    Evidence(EvidenceArgs),
    /// Run time against error, method by method: tables and a work–precision picture
    Compare(CompareArgs),
    /// Repeat an experiment of Li et al. 2011
    #[cfg_attr(feature = "lab", command(subcommand))]
    Experiment(ExperimentCommand),
    /// Make a folder with a scene to start from: vessel, device, script, views. It runs at once
    New(NewArgs),
    /// Report graphics adapter, display, threads and cache of this machine, and which of them are used
    Doctor {
        /// Print the report as one JSON document on stdout
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

/// Values of a scene that replace those of its file.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct SetArgs {
    /// Replace the value of a key of the scene (repeatable). Keys are written in full, as in a sweep:
    /// vessel.wall.friction=0.1, script[0].step_mm=2, device.part[0].length_mm=60 (of a device file too), view.every=10. Values are
    /// written as in the file, texts also without quotes; paths start from the scene's folder
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<Setting>,
}

/// How steps without an equilibrium count.
#[derive(Debug, Default, Clone, Copy, clap::Args)]
pub(crate) struct ConvergenceArgs {
    /// End with exit code 0 even if steps found no equilibrium; they are reported and recorded in either case
    #[arg(long)]
    pub(crate) allow_unconverged: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct RunArgs {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Carry out the script of this file, which contains only tables `script`, instead of the scene's own: for example a session of `play`
    #[arg(long, value_name = "FILE")]
    pub(crate) script: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    /// Folder for the recording; out/NAME OF THE SCENE if absent. An earlier recording in it is replaced
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Record also into a folder that holds other files; of these, summary.json, steps.csv, instruments.csv,
    /// shapes.npz and frames/step_*.png of the same name are replaced
    #[arg(long)]
    pub(crate) force: bool,
    /// Save the state of the run into a file, repeatedly during the run and at its end. The file is complete at any moment, even after the
    /// run was killed
    #[arg(long, value_name = "FILE")]
    pub(crate) save_state: Option<PathBuf>,
    /// Continue from a saved state of the same scene. The recording in DIR continues after the step at which the state was saved: later
    /// steps are dropped, and the following ones have the bits of a run that was never interrupted. A new or empty DIR gets the steps
    /// from there on. If FILE does not exist yet, the run begins from the start and says so: with --save-state of the same file, one command
    /// serves a run that is killed and started again any number of times
    #[arg(long, value_name = "FILE")]
    pub(crate) resume: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) convergence: ConvergenceArgs,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print the summary as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
    /// Print neither progress nor summary, only failures
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ReportArgs {
    /// Folder of a recorded run, or of an experiment or comparison; several runs are compared on one page, curve by curve
    #[arg(required = true, value_name = "DIR")]
    pub(crate) dirs: Vec<PathBuf>,
    /// File of the page; report.html in the first DIR if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Scene file, if it is not the one named in summary.json
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Give a key of the scene another value, beside those that the run had by its --set, which summary.json tells (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<Setting>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct AssessArgs {
    /// Sessions of play (*.session.json), folders of recorded runs, or folders that hold sessions; for several at one task also
    /// the change from one to the next: in the order of recording, or in the given order if some do not contain their time of recording
    #[arg(required = true, value_name = "SESSION|DIR")]
    pub(crate) sessions: Vec<PathBuf>,
    /// Name of the target on the centre line; if absent, the last target that the script names
    #[arg(long, value_name = "NAME")]
    pub(crate) target: Option<String>,
    /// Score them by a training subject, given by its file or its name in assets/subjects, until its goal is reached or a limit is exceeded
    #[arg(long, value_name = "NAME|FILE", conflicts_with_all = ["target", "within_mm", "scene"])]
    pub(crate) subject: Option<PathBuf>,
    /// Carry each session out again by its recorded inputs, and score what they lead to: a session file that was changed is refused
    #[arg(long, requires = "subject")]
    pub(crate) verify: bool,
    /// Distance from the target at which the tip counts as arrived
    #[arg(long, default_value_t = 5.0, value_name = "MM")]
    pub(crate) within_mm: f64,
    /// Scene file, if it is not the one named in the sessions
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Also write a page for a browser: path of the tip on the roadmap; hands, beam, contrast medium and forces over time; notable events; and,
    /// for several sessions, the change of the measures
    #[arg(long, value_name = "FILE")]
    pub(crate) page: Option<PathBuf>,
    /// Print the measures as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct NewArgs {
    /// Folder to create; it must not exist, or be empty
    pub(crate) dir: PathBuf,
    /// Surface of a vessel (STL, OBJ, PLY, VTP or VTK), which is copied, or a built-in anatomy
    #[arg(long, default_value = "aortic_arch", value_name = "FILE|NAME")]
    pub(crate) vessel: PathBuf,
    #[command(flatten)]
    pub(crate) frame: CoordinateArgs,
    /// Device file, such as one of the catalogue in assets/devices, which is copied; an angled hydrophilic wire of 0.035 in if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) device: Option<PathBuf>,
}

#[derive(Debug, Clone, clap::Args)]
pub(crate) struct PlayArgs {
    /// Scene file (TOML); or a training subject, given by its file or its name in assets/subjects: then the window shows the task and the current
    /// values of its limits, and the session is scored
    #[arg(value_name = "SCENE|SUBJECT")]
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    /// Show the scene's script in real time, until an instrument is moved by hand
    #[arg(long)]
    pub(crate) watch: bool,
    /// Begin where the scene's script ends, with what it has injected in the vessel
    #[arg(long, conflicts_with = "watch")]
    pub(crate) after_script: bool,
    /// Use the script of this file, which contains only tables `script`, instead of the scene's own: for example an earlier session
    #[arg(long, value_name = "FILE")]
    pub(crate) script: Option<PathBuf>,
    /// File for the recorded session: a script that `endowire run SCENE --script FILE` carries out to the bit; out/NAME OF THE
    /// SCENE/played.toml, or that of the subject, if absent
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Without a window: inputs are lines of JSON on stdin, answers lines of JSON on stdout, and the inputs determine how time passes
    #[arg(long)]
    pub(crate) headless: bool,
    /// With --headless: read the lines of this file instead of stdin
    #[arg(long, requires = "headless", value_name = "FILE")]
    pub(crate) inputs: Option<PathBuf>,
    /// With --headless: time passes in real time, and pictures are drawn as for the window
    #[arg(long, requires = "headless")]
    pub(crate) realtime: bool,
    /// Also accept inputs, lines of JSON, from programs of this machine that connect to this port, such as 7000, or address, such as [::1]:7000.
    /// The first line of a connection must be the token that is printed at the start; pictures are written into the folder of --record
    #[arg(long, value_name = "PORT|ADDRESS")]
    pub(crate) listen: Option<crate::commands::play::Address>,
    /// Let --listen accept an address that other machines can reach; the connection is not encrypted
    #[arg(long, requires = "listen")]
    pub(crate) allow_remote: bool,
    /// Width and height of the fluoroscopic picture in pixels, 64 to 1024
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=1024))]
    pub(crate) size: u32,
    /// Linear solves in a sixtieth of a second: the rest of the motion follows in the next ones, so that none takes long. `all`: each ends in
    /// equilibrium, and takes a second or more when a device snaps
    #[arg(long, default_value_t, value_name = "N|all")]
    pub(crate) solves: crate::commands::play::Solves,
    /// Warn where a hand pushes or pulls harder than this
    #[arg(long, default_value_t = 1.0, value_name = "N", value_parser = inputs::parse_above_zero)]
    pub(crate) warn_n: f64,
    /// Warn where a hand holds a greater torque than this
    #[arg(long, default_value_t = 5.0, value_name = "N·MM", value_parser = inputs::parse_above_zero)]
    pub(crate) warn_nmm: f64,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print a summary of the session and its speed at the end as one JSON document on stdout; not with --headless alone, where stdout is for answers
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SweepArgs {
    /// Sweep file (TOML): a scene, and an axis for each key that varies
    #[arg(required = true)]
    pub(crate) sweep: Option<PathBuf>,
    /// Folder for the rows of finished runs (runs.jsonl), the table of all runs (runs.parquet), and recordings if the sweep requests them
    #[arg(long, value_name = "DIR", required = true)]
    pub(crate) out: Option<PathBuf>,
    /// Run only one of several parts: the first of four is 1/4. Parts may go into one folder or into several, on one machine or on many
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    pub(crate) shard: Shard,
    /// Runs at the same time; the number of cores if absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print the result as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
    #[command(subcommand)]
    pub(crate) merge: Option<SweepCommand>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum SweepCommand {
    /// Make one table of the rows in the folders of shards; their order does not matter
    Merge {
        /// Folders of endowire sweep --out
        #[arg(required = true, value_name = "DIR")]
        folders: Vec<PathBuf>,
        /// Table to write (Parquet)
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
}

/// Whether walls are stored for later runs.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct CacheArgs {
    /// Compute the vessel's wall anew and do not store it. Otherwise a wall that takes long to compute is stored, up to 1 GiB in all, in the
    /// folder walls of $ENDOWIRE_CACHE, or of endowire where the system has the caches of a user (Linux: $XDG_CACHE_HOME or ~/.cache;
    /// macOS: ~/Library/Caches; Windows: %LOCALAPPDATA%). It may be removed at any time
    #[arg(long)]
    pub(crate) no_cache: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct RodArgs {
    /// Case file (TOML)
    pub(crate) case: PathBuf,
    /// Print the solution as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}
