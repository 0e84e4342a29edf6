//! Recordings of runs: a folder of tables (CSV), arrays (NumPy) and a summary (JSON), written step by step beside a
//! simulation and read again.
//!
//! A [`Recorder`] writes each step at once; whatever a program that is killed leaves is a recording of all steps before,
//! and a recording can go on. A [`Recording`] reads one. All columns of all tables are declared here, with units and
//! meanings, and listed by [`schema::document`], of which `recording.schema.json` in the repository is a copy.
//!
//! ```
//! use endowire_core::insertion::{Command, Move};
//! use endowire_core::{Device, GeneratedWall, Resolution, Sheath, Simulation, anatomy};
//! use endowire_recording::{Program, Provenance, Recorder, Recording};
//!
//! let tree = anatomy::tree("straight_tube").expect("a built-in anatomy");
//! let vessel = GeneratedWall::new(&tree, Resolution::EdgeMm(2.0))?;
//! let sheath = Sheath::at_opening(&vessel.wall, vessel.inlet, 1.0)?;
//! let mut simulation = Simulation::builder(vessel.wall, Device::uniform(200.0, 0.45, 10.0)?, sheath).build()?;
//!
//! # let outer = std::env::temp_dir().join(format!("endowire-recording-{}", std::process::id()));
//! # let folder = outer.as_path();
//! let mut recorder = Recorder::new(folder, &simulation)?;
//! for step in 1..=3 {
//!     let moves = [Move { instrument: 0, command: Command::advance(5.0) }];
//!     simulation.step(moves[0].command)?;
//!     recorder.record(&moves, f64::from(step), &simulation)?;          // on disk from here on
//! }
//! let program = Program { version: "1.0", git_revision: "" };
//! let mut summary = recorder.summary(&Provenance::new(program, &[""; 0], 0), &simulation);
//! recorder.finish(&mut summary)?;
//!
//! let recording = Recording::read(folder)?;
//! assert_eq!((recording.steps(), recording.shape(3)), (3, simulation.shape().clone()));
//! assert_eq!(recording.rows()[2].inserted_mm, 15.0);
//! # std::fs::remove_dir_all(folder).unwrap();
//! # Ok::<(), endowire_core::Error>(())
//! ```

mod arrays;
mod coils;
mod columns;
mod folder;
mod injections;
mod instruments;
mod next;
pub mod npz;
mod outcome;
mod outlet;
mod packing;
mod provenance;
mod recorder;
mod recording;
mod rows;
pub mod schema;
pub mod seal;
mod steps;
mod summary;
pub mod table;
mod tables;
mod vessel;

pub use arrays::SHAPES;
pub use coils::{COILS, CoilRow, Left, coils_after, read_coils};
pub use columns::Column;
pub use folder::{Among, Claim, FILMS, Replaced, frame_name, is_recording, lock_file, lock_folder};
pub use injections::{INJECTIONS, InjectionRow};
pub use instruments::{INSTRUMENTS, InstrumentRow, Lengths};
pub use next::check_step;
pub use outcome::{EndedBy, InstrumentOutcome, RunOutcome, StepFailure, UntilOutcome};
pub use outlet::Outlet;
pub use packing::{PACKING, Packed, PackingRow};
pub use provenance::{Program, Provenance, hash_inputs};
pub use recorder::{Recorder, start_mm};
pub use recording::{Recording, WallContact};
pub use rows::Rows;
pub use steps::{STEPS, StepRow, read_steps};
pub use summary::{About, Plane, SUMMARY, Summary, VERSION};
pub use vessel::{PLACES, PlaceRow, RecordedVessel, UnknownRow, VESSEL};
