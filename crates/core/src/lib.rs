//! Catheters and guidewires in blood vessels.
//!
//! Units everywhere: millimetre, newton, second, radian; energy in N·mm = mJ.
//!
//! A vessel, instruments that enter it through a sheath, and a method make a [`Simulation`]. It is moved by [`Command`]s, and after each of them it has
//! a [`Shape`] and a [`StepReport`]:
//!
//! ```
//! use endowire_core::{Command, Device, GeneratedWall, Resolution, Sheath, Simulation, WallProperties, anatomy};
//!
//! // A vessel: a built-in anatomy, a surface (`SurfaceMesh::read`, `Wall::from_surface`) or a centre line (`SweptVessel`).
//! let tree = anatomy::tree("curved_tube").expect("a built-in anatomy");
//! let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(1.5))?;
//! let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
//! // An instrument: length mm, radius mm, bending stiffness N·mm². Several of them make a `Stack`.
//! let wire = Device::uniform(400.0, 0.45, 10.0)?;
//! let wall = WallProperties { friction: 0.05, ..WallProperties::default() };
//! let mut simulation = Simulation::builder(vessel.wall, wire, sheath).properties(wall).build()?;
//! for _ in 0..40 {
//!     simulation.step(Command { advance_mm: 4.0, rotate_rad: 0.02, ..Command::default() })?;
//! }
//! let report = simulation.report();
//! assert!(report.converged && report.push_force_n > 0.0 && !report.contacts.is_empty());
//! let tip_mm = simulation.shape().tip_mm().expect("the wire is in");
//! // `endowire_viewer::Renderer` draws the shape in 3D and in fluoroscopy.
//! # assert!(tip_mm.norm() > 100.0);
//! # Ok::<(), endowire_core::Error>(())
//! ```
//!
//! A scene file contains all of this: [`Scene::read`] and [`Scene::simulation`](scene::SceneOf::simulation).
//!
//! The names at this level are those that a simulation needs. The modules are for extensions:
//!
//! | module | for whom |
//! |---|---|
//! | [`control`] | hands that steer: your own [`Controller`] |
//! | [`field`] | magnets, weight and your own energies |
//! | [`methods`] | your own method behind [`Method`](methods::Method) |
//! | [`device`], [`vessel`], [`flow`], [`scene`] | devices from data sheets; surfaces, their checks and repair; blood; scene files |
//! | [`statics`] | static problems of rods without a vessel |
//! | [`contact`] | the wall as devices feel it: your own method |
//! | [`insertion`] | scripts, batches and tallies of insertions |
//!
//! Features, all of them on; with none a device in a vessel needs half of the crates. What needs one that is off is an [`Error::Feature`] that names it:
//!
//! | feature | what needs it |
//! |---|---|
//! | `markups` | centre lines of 3D Slicer (`.mrk.json`) |
//! | `scene-files` | scenes, devices, scripts and cases in TOML |
//! | `self-contact` | devices that touch themselves |
//! | `threads` | nothing: without it everything runs on the calling thread, [`Batch`] too |
//! | `union` | surfaces whose parts overlap without being joined |
//! | `vtp` | surfaces and centre lines in VTK's XML format |

// Results are bit-identical on every machine: functions whose rounding depends on the platform are disallowed.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

mod banded;
pub mod contact;
pub mod control;
mod coupled;
pub mod device;
pub mod error;
pub mod field;
pub mod file;
pub mod flow;
pub mod input;
pub mod insertion;
pub mod methods;
mod parallel;
pub mod passable;
mod products;
pub mod random;
mod rod;
pub mod scene;
pub mod shape;
mod solve;
pub mod statics;
mod text;
pub mod tuning;
pub mod vessel;

pub use control::{Controller, drive};
pub use device::{Device, DeviceFile, Instrument, Section, Stack};
pub use error::{Error, PhysicalEnd, Result};
pub use field::{EnergyDensity, Field, Magnet, MaterialPoint, Weight};
pub use flow::BloodFlow;
pub use insertion::{Batch, Command, Contact, Move, Sheath, Simulation, State, StepReport, WallProperties};
pub use methods::kirchhoff::{Accuracy, KirchhoffOptions};
pub use nalgebra;
pub use scene::Scene;
pub use shape::Shape;
pub use vessel::{
    CentrelineTree, GeneratedWall, Lumen, NoStore, Resolution, SurfaceMesh, SweptVessel, VesselMotion, Wall,
    anatomy,
};

/// A point or direction in space, millimetres or unit length as its name says.
pub type Vec3 = nalgebra::Vector3<f64>;

/// The README's example is compiled and run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
