//! Arguments of comparisons and experiments.

use std::path::PathBuf;

use clap::Subcommand;
use clap::builder::PossibleValuesParser;
use endowire_lab::bench::coil;

use endowire_lab::studies::{CANDIDATES, CASES, targets};

/// Parser of names of compared methods, which suggests the nearest name for an unknown one.
fn method_names() -> PossibleValuesParser {
    PossibleValuesParser::new(CANDIDATES)
}

fn all_or_method_names() -> PossibleValuesParser {
    PossibleValuesParser::new(std::iter::once("all").chain(CANDIDATES))
}

fn case_names() -> PossibleValuesParser {
    PossibleValuesParser::new(CASES.map(|case| case.0))
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
    /// Numbers of elements to run, such as 8,16,32; if absent, a suitable range for each method
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub(crate) elements: Vec<usize>,
    /// Longest time of one solve or insertion
    #[arg(long, default_value_t = 30.0, value_name = "S")]
    pub(crate) limit_s: f64,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ExperimentCommand {
    /// Experiment 1: time per calculation against the number of nodes (the paper's Table 1)
    Timing(TimingArgs),
    /// Experiment 2: straight wires pushed into the aortic arch and the hepatic arteries by the paper's method and by ours, and a shaped wire
    /// steered to every named target
    Navigation(NavigationArgs),
    /// Experiment 3: a soft tip stopped in a tube, and the loop that grows (the paper's figure 4)
    Loop(LoopArgs),
    /// Experiment 4: shape in the curved tube against a ground truth (the paper's Table 2)
    Deformation(DeformationArgs),
    /// Coils that fill the sac of an aneurysm, pushed out of a microcatheter and detached one after another
    Coil(CoilArgs),
}

/// Purpose of a coil.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum CoilKind {
    /// Frames the sac.
    Framing,
    /// Fills the framed sac.
    Filling,
    /// Fills the rest.
    Finishing,
}

impl CoilKind {
    /// Name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Framing => "framing",
            Self::Filling => "filling",
            Self::Finishing => "finishing",
        }
    }

    /// How it is made.
    pub(crate) fn wound(self) -> coil::CoilKind {
        match self {
            Self::Framing => coil::CoilKind::FRAMING,
            Self::Filling => coil::CoilKind::FILLING,
            Self::Finishing => coil::CoilKind::FINISHING,
        }
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct CoilArgs {
    /// Coils in their order, as often as they are named
    #[arg(
        long,
        visible_alias = "coil",
        value_delimiter = ',',
        default_value = "framing,filling,finishing",
        value_name = "KIND,…"
    )]
    pub(crate) coils: Vec<CoilKind>,
    /// Volume of the sac, mm³
    #[arg(long, default_value_t = 60.0, value_name = "MM3")]
    pub(crate) volume_mm3: f64,
    /// Length of each coil, mm
    #[arg(long, default_value_t = 60.0, value_name = "MM")]
    pub(crate) length_mm: f64,
    /// Increment by which coils are pushed, mm
    #[arg(long, default_value_t = 0.5, value_name = "MM")]
    pub(crate) step_mm: f64,
    /// Element length, mm
    #[arg(long, default_value_t = 0.75, value_name = "MM")]
    pub(crate) element_mm: f64,
    /// Coefficient of friction of the wall
    #[arg(long, default_value_t = 0.1, value_name = "MU")]
    pub(crate) friction: f64,
    /// Coefficient of friction of coils on themselves and on each other
    #[arg(long, default_value_t = 0.2, value_name = "MU")]
    pub(crate) self_friction: f64,
    /// Height of the catheter's tip above the plane of the neck, as a fraction of the height of the sac; 0.25 if absent
    #[arg(long, value_name = "FRACTION")]
    pub(crate) tip_height: Option<f64>,
    /// Folder for coil.csv, .json, .svg and .png
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
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
    /// Whether a target is requested.
    pub(crate) fn wants(&self, target: &str) -> bool {
        self.targets.is_empty() || self.targets.iter().any(|name| name == target)
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct LoopArgs {
    /// Methods
    #[arg(long, visible_alias = "method", value_delimiter = ',', default_value = "li2011-banded,kirchhoff", value_name = "METHOD,…", value_parser = method_names())]
    pub(crate) methods: Vec<String>,
    /// Folder for loop.csv, loop.json, four frames of both views for each method, and loop.svg and .png
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
    /// Methods
    #[arg(long, visible_alias = "method", value_delimiter = ',', default_value = "li2011-banded,li2011-banded-printed,kirchhoff", value_name = "METHOD,…", value_parser = method_names())]
    pub(crate) methods: Vec<String>,
    /// Segment lengths of Table 2 to run (1, 2, 3); all if absent
    #[arg(long, value_delimiter = ',', value_name = "L,…")]
    pub(crate) l_mm: Vec<f64>,
    /// Increments a segment of Table 2 to run (40, 20, 10, 5, 3); all if absent
    #[arg(long, value_delimiter = ',', value_name = "COUNT,…")]
    pub(crate) l_over_h: Vec<u32>,
    /// Folder for deformation.csv, .json, .svg and .png, and frames of both views of each method's wire
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct TimingArgs {
    /// Numbers of nodes
    #[arg(long, value_delimiter = ',', default_value = "50,100,150,200,300", value_name = "N,N,…")]
    pub(crate) nodes: Vec<usize>,
    /// Timed calculations for each number of nodes
    #[arg(long, default_value_t = 15, value_name = "COUNT")]
    pub(crate) repeats: usize,
    /// Methods: all, or some of them
    #[arg(long, visible_alias = "method", value_delimiter = ',', default_value = "li2011-dense,li2011-banded,kirchhoff", value_name = "METHOD,…", value_parser = all_or_method_names())]
    pub(crate) methods: Vec<String>,
    /// Longest time to bring a method into position; a method that takes longer is named in a note
    #[arg(long, default_value_t = 10.0, value_name = "S")]
    pub(crate) limit_s: f64,
    /// Folder for timing.csv, .json, .svg and .png
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the rows as one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}
