//! Insertions into arbitrary surfaces: run by `endowire verify --surfaces DIR`.
//!
//! Every surface of a folder is a vessel (`sidecar`), and every one gets the same matrix of insertions (`cells`): two
//! wires, three increments, element lengths, frictions and moduli of the wall, with and without rotation. A `run`
//! pushes one wire into one surface command by command and reports how it ended: arrived, left through an opening,
//! blocked where the vessel is too narrow – or failed, which the matrix is meant to detect.
//!
//! ```
//! use endowire_lab::surfaces::{Cell, cells};
//!
//! let (quick, full) = (cells(2, false), cells(2, true));
//! assert_eq!((quick.len(), full.len()), (36, 324));
//! ```

mod cells;
mod run;
mod scene;
mod sidecar;
mod start;
mod summary;
mod surface;
mod wire;

pub use cells::{Cell, cells, matches};
pub use run::{CellRow, Ending, run};
pub use sidecar::{Sidecar, SurfaceFile, surfaces_in};
pub use start::Found;
pub use summary::{ITERATIONS_PER_MM, Summary};
pub use surface::{Place, Surface};
pub use wire::{WIRES, Wire};
