//! Arguments of the commands that draw: frames of runs and scenes, labelled pictures, files for other programs.

use std::path::PathBuf;

use clap::ValueEnum;
use endowire_core::input::plain;
use endowire_methods::Setting;
use endowire_viewer::{Mode, Pose};

use super::{CacheArgs, ConvergenceArgs, SetArgs};

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
    /// Set any other key of the scene's view table, as in c_arm.sid_mm=1000, or any key of the scene as it is called from its top, as in
    /// vessel.wall.friction=0.1 or device.part[0].length_mm=60 (repeatable). A recorded run has what it was given itself
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Turn the camera of the 3D view by so many degrees from the first frame to the last
    #[arg(long, value_name = "DEGREES")]
    pub(crate) orbit: Option<f64>,
    /// Turn the C-arm by so many degrees (towards LAO) from the first frame to the last; a subtraction has a mask of every angle, of the
    /// first frame's devices. Not where one frame is drawn
    #[arg(long, value_name = "DEGREES")]
    pub(crate) turn: Option<f64>,
    /// Speed of that turn, in place of a number of frames, which follows from it and the scene's frames_per_s
    #[arg(long, requires = "turn", value_name = "SPEED")]
    pub(crate) deg_per_s: Option<f64>,
    /// Draw fluoroscopy in a second plane as well, turned by so many degrees (towards LAO) from the first; the scene's biplane_deg if
    /// absent. What is of it has _b at the end of its name: frames, masks, labels, arrays, the second DICOM file of the pair. Moving
    /// pictures are of the first plane
    #[arg(long, value_name = "DEGREES")]
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

fn mode(text: &str) -> Result<Mode, String> {
    serde_json::from_value(serde_json::Value::from(text)).map_err(|e| plain(&e.to_string()))
}

#[derive(Debug, clap::Args)]
pub(crate) struct RenderArgs {
    /// Folder of a recorded run
    pub(crate) dir: PathBuf,
    /// Scene file of the run, if it is no longer where it was
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// First recorded step to draw; the first one if absent
    #[arg(long, value_name = "STEP")]
    pub(crate) from: Option<usize>,
    /// Last recorded step to draw; the last one if absent
    #[arg(long, value_name = "STEP")]
    pub(crate) to: Option<usize>,
    /// Draw every so many steps, and the last; every step if absent
    #[arg(long, default_value_t = 1, value_name = "STEPS")]
    pub(crate) every: usize,
    /// Frames of the step, where one is drawn: its device rests, at the scene's frames_per_s, while the C-arm or the camera turns and contrast
    /// medium goes on
    #[arg(long, value_name = "COUNT", conflicts_with = "deg_per_s", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) count: Option<u32>,
    /// Folder for the frames; DIR/render if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) frames: FrameArgs,
}

#[derive(Debug, clap::Args)]
pub(crate) struct FluoroArgs {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Steps of the script to carry out before; 0 leaves the vessel without a device
    #[arg(long, value_name = "STEPS")]
    pub(crate) steps: Option<usize>,
    /// Time of the first frame in seconds, for injections
    #[arg(long, default_value_t = 0.0, value_name = "S")]
    pub(crate) time: f64,
    /// Number of frames, at the scene's frames_per_s
    #[arg(long, default_value_t = 1, value_name = "COUNT", conflicts_with = "deg_per_s")]
    pub(crate) count: u32,
    /// Folder for the frames; out/NAME OF THE SCENE if absent
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) convergence: ConvergenceArgs,
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
    pub(crate) set: SetArgs,
    #[command(flatten)]
    pub(crate) convergence: ConvergenceArgs,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
    /// Print what was written as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("form").args(["vtk", "gltf", "usd"]).required(true).multiple(true)))]
pub(crate) struct ExportArgs {
    /// Folder of a recorded run
    pub(crate) dir: PathBuf,
    /// Folder for run.pvd, which lists the steps with their times, step_*.vtp (instruments as lines, contacts as points with their forces)
    /// and vessel.vtp; files of these names are replaced
    #[arg(long, value_name = "DIR")]
    pub(crate) vtk: Option<PathBuf>,
    /// File .glb (glTF 2.0) with the run as an animation: instruments as tubes, the vessel, and the largest contact forces of each step as
    /// arrows; of more than 500 steps as many as that, evenly spaced. A vessel that moves has keys until it is within 0.1 mm, or 2 million vertices
    #[arg(long, value_name = "FILE")]
    pub(crate) gltf: Option<PathBuf>,
    /// File .usda (USD) with the run as curves, the vessel as a mesh and contacts as points with their forces, with time samples
    #[arg(long, value_name = "FILE")]
    pub(crate) usd: Option<PathBuf>,
    /// Scene file of the run, if it is no longer where it was
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Give a key of the scene another value, beside those that the run had by its --set, which summary.json tells (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<Setting>,
    #[command(flatten)]
    pub(crate) cache: CacheArgs,
}
