//! Scenes of the comparison, and their reference solutions.

use std::time::{Duration, Instant};

use endowire_core::device::Device;
use endowire_core::insertion::{Command, Sheath, Simulation, WallProperties};
use endowire_core::methods::kirchhoff::{Accuracy, KirchhoffOptions};
use endowire_core::shape::Shape;
use endowire_core::vessel::{CentrelineNode, CentrelineTree, GeneratedWall, Resolution, Wall, anatomy};
use endowire_core::{Error, Result, Vec3};

use super::candidate;

/// Result of one run of a method.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    /// Error against the reference, in the case's unit.
    pub error: f64,
    /// Time of the computation alone, s.
    pub time_s: f64,
    /// Iterations, as the method counts them.
    pub iterations: u64,
    /// Number of steps that failed the method's own convergence test.
    pub unconverged: usize,
}

/// A scene.
pub enum Case {
    /// Reference case A1: the tip against the exact solution.
    Cantilever {
        /// PL²/EI.
        load: f64,
        /// Exact tip.
        tip: Vec3,
    },
    /// A device pushed into a vessel.
    Insertion(Box<Scene>),
}

/// A vessel, a device and a sheath.
pub struct Scene {
    wall: Wall,
    sheath: Sheath,
    device: Device,
    inserted_mm: f64,
    /// Increment of every command, mm.
    step_mm: f64,
    truth: Truth,
}

/// The reference of an insertion.
enum Truth {
    /// The exact tip position.
    Tip(Vec3),
    /// The whole shape of our converged solution.
    Shape(Shape),
}

/// Description of the reference of a case.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct TruthNote {
    /// Name of the case.
    pub case: String,
    /// The reference in words.
    pub truth: String,
    /// Root mean square change, mm, at the last halving of its elements.
    pub last_change_mm: Option<f64>,
}

/// Number of elements of the reference mesh at the end of the insertion.
const TRUTH_ELEMENTS: usize = 400;

impl Case {
    /// Creates a case with its reference.
    pub fn new(name: &'static str) -> Result<(Self, TruthNote)> {
        let exact = |case: &str, text: &str| TruthNote {
            case: case.to_owned(),
            truth: text.to_owned(),
            last_change_mm: None,
        };
        let a1 = "exact (Bisshopp and Drucker 1945)";
        match name {
            "cantilever-1" => {
                let tip = Vec3::new(1.0 - 0.0564332362834, -0.301720773800, 0.0);
                Ok((Self::Cantilever { load: 1.0, tip }, exact(name, a1)))
            }
            "cantilever-10" => {
                let tip = Vec3::new(1.0 - 0.554995597754, -0.810609024880, 0.0);
                Ok((Self::Cantilever { load: 10.0, tip }, exact(name, a1)))
            }
            "soft-tube" => {
                let tip = Truth::Tip(Vec3::new(39.744407, 4.116002, 0.0));
                let wall = GeneratedWall::new(&bent_tube()?, Resolution::EdgeMm(0.4))?.wall;
                let scene = Scene {
                    wall,
                    sheath: Sheath::new(Vec3::zeros(), Vec3::x())?,
                    device: Device::uniform(100.0, 0.45, 10.0)?,
                    inserted_mm: 40.0,
                    step_mm: 2.0,
                    truth: tip,
                };
                let note = exact(name, "two-point boundary value solution of case C5, round tube");
                Ok((Self::Insertion(Box::new(scene)), note))
            }
            "curved-tube" => Self::anatomy(name, "curved_tube", 1.0, 0.8, 10.0, 200.0),
            "arch" => Self::anatomy(name, "aortic_arch", 2.0, 2.0, 15.0, 250.0),
            _ => Err(Error::parameter("--cases", name, "is no case")),
        }
    }

    fn anatomy(
        name: &'static str,
        tree: &str,
        depth_mm: f64,
        edge_mm: f64,
        stiffness_nmm2: f64,
        inserted_mm: f64,
    ) -> Result<(Self, TruthNote)> {
        let tree = anatomy::tree(tree).ok_or_else(|| Error::parameter("vessel", tree, "is not built in"))?;
        let made = GeneratedWall::new(&tree, Resolution::EdgeMm(edge_mm))?;
        let sheath = Sheath::at_opening(&made.wall, made.inlet, depth_mm)?;
        let device = Device::uniform(inserted_mm + 50.0, 0.445, stiffness_nmm2)?;
        let mut scene = Scene {
            wall: made.wall,
            sheath,
            device,
            inserted_mm,
            step_mm: 2.0,
            truth: Truth::Tip(Vec3::zeros()),
        };
        let shape = |elements: usize| -> Result<Shape> {
            let tolerance = KirchhoffOptions::of(Accuracy::Fine).tolerance;
            let mut simulation = scene.start("kirchhoff", elements, tolerance)?;
            for _ in 0..scene.steps() {
                simulation.step(Command::advance(scene.step_mm))?;
            }
            Ok(simulation.shape().clone())
        };
        let (coarse, fine) = (shape(TRUTH_ELEMENTS / 2)?, shape(TRUTH_ELEMENTS)?);
        let note = TruthNote {
            case: name.to_owned(),
            truth: format!("kirchhoff with {TRUTH_ELEMENTS} elements"),
            last_change_mm: Some(rms_distance(&coarse, &fine).0),
        };
        scene.truth = Truth::Shape(fine);
        Ok((Self::Insertion(Box::new(scene)), note))
    }

    /// Runs a method once. `None` if it takes longer than `limit`.
    pub fn run(&self, method: &str, elements: usize, limit: Duration) -> Result<Option<Run>> {
        match self {
            Self::Cantilever { load, tip } => {
                let clock = Instant::now();
                let (found, iterations) = candidate::cantilever(method, elements, *load)?;
                let time_s = clock.elapsed().as_secs_f64();
                let error = (found - tip).norm();
                Ok(Some(Run { error, time_s, iterations: iterations as u64, unconverged: 0 }))
            }
            Self::Insertion(scene) => scene.run(method, elements, limit),
        }
    }
}

impl Scene {
    fn steps(&self) -> usize {
        (self.inserted_mm / self.step_mm).round() as usize
    }

    fn start(&self, method: &str, elements: usize, tolerance: f64) -> Result<Simulation> {
        candidate::insertion_within(
            method,
            (self.inserted_mm / elements as f64, tolerance),
            self.wall.clone(),
            WallProperties::default(),
            self.device.clone(),
            self.sheath,
        )
    }

    fn run(&self, method: &str, elements: usize, limit: Duration) -> Result<Option<Run>> {
        let mut simulation = self.start(method, elements, candidate::INSERTION_TOLERANCE)?;
        let (mut iterations, mut unconverged) = (0, 0);
        let clock = Instant::now();
        for _ in 0..self.steps() {
            let report = simulation.step(Command::advance(self.step_mm))?;
            iterations += u64::from(report.iterations);
            unconverged += usize::from(!report.converged);
            if clock.elapsed() > limit {
                return Ok(None);
            }
        }
        let time_s = clock.elapsed().as_secs_f64();
        let error = match &self.truth {
            Truth::Tip(tip) => (simulation.shape().tip_mm().unwrap_or_default() - tip).norm(),
            Truth::Shape(shape) => rms_distance(simulation.shape(), shape).0,
        };
        Ok(Some(Run { error, time_s, iterations, unconverged }))
    }
}

/// Root mean square and largest distance, mm, of the nodes of `shape` from the same points of the device in `truth`.
pub fn rms_distance(shape: &Shape, truth: &Shape) -> (f64, f64) {
    let (mut sum, mut largest) = (0.0, 0.0f64);
    for (x, s) in shape.positions_mm.iter().zip(&shape.from_tip_mm) {
        let distance = (x - point_at(truth, *s)).norm();
        sum += distance * distance;
        largest = largest.max(distance);
    }
    ((sum / shape.len() as f64).sqrt(), largest)
}

/// The point at an arc length from the tip, by cubic interpolation between nodes.
pub fn point_at(shape: &Shape, from_tip_mm: f64) -> Vec3 {
    let (x, t, s) = (&shape.positions_mm, &shape.tangents, &shape.from_tip_mm);
    if shape.len() < 2 {
        return x.first().copied().unwrap_or_default();
    }
    let b = s.partition_point(|s| *s > from_tip_mm).clamp(1, shape.len() - 1);
    let h = s[b - 1] - s[b];
    let u = ((s[b - 1] - from_tip_mm) / h).clamp(0.0, 1.0);
    let v = 1.0 - u;
    x[b - 1] * (v * v * (1.0 + 2.0 * u))
        + x[b] * (u * u * (1.0 + 2.0 * v))
        + (t[b - 1] * v - t[b] * u) * (h * u * v)
}

/// The axis of reference case C5: 20 mm straight, a 90° arc of radius 30 mm, 10 mm straight; bore radius 3 mm.
fn bent_tube() -> Result<CentrelineTree> {
    let (straight, bend, end, radius_mm) = (20.0, 30.0, 10.0, 3.0);
    let mut axis: Vec<[f64; 2]> = (0..20).map(|i| [f64::from(i), 0.0]).collect();
    let arc = 47;
    axis.extend((0..=arc).map(|i| {
        let angle = std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(arc);
        [straight + bend * angle.sin(), bend - bend * angle.cos()]
    }));
    axis.extend((1..=10).map(|i| [straight + bend, bend + end * f64::from(i) / 10.0]));
    let node = |(i, [x, y]): (usize, &[f64; 2])| CentrelineNode {
        position_mm: Vec3::new(*x, *y, 0.0),
        radius_mm,
        parent: i.checked_sub(1),
    };
    CentrelineTree::new(axis.iter().enumerate().map(node).collect())
}
