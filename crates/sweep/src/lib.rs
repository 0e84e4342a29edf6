//! Sweeps: one scene run many times with different values of its keys, and a table with one row per run.
//!
//! A [`Sweep`] is read from a sweep file: a scene, and an [axis](Axis) for each key that varies. [`Sweep::carry_out`]
//! does its runs on several threads and saves each row at once (`journal`), so that a sweep that was killed can resume.
//! At the end the rows become one Parquet file (`table`). It depends on the sweep only, not on the number of threads, on
//! interruptions or on shards.
//!
//! ```toml
//! scene = "scenes/curved_tube.toml"   # relative to this file
//! seed = 1                            # of all that is drawn
//! samples = 100                       # runs that are drawn for each combination of lists and grids
//!
//! [set]                               # what all runs have otherwise than the scene
//! "method.element_mm" = 4.0
//!
//! [[axis]]
//! key = "vessel.wall.friction"
//! list = [0.0, 0.1]
//!
//! [[axis]]
//! key = "device.section[0].bending_stiffness_nmm2"
//! latin = { from = 1.0, to = 100.0, log = true }
//! ```

mod axis;
mod draw;
mod file;
mod journal;
mod merge;
mod row;
mod run;
mod shard;
mod shared;
mod table;
mod work;

pub use axis::{Axis, AxisSpec, Grid, Range};
pub use file::{Recorded, Sweep};
pub use merge::{Table, merge, table_of};
pub use row::Row;
pub use run::{Record, Recorder, Run};
pub use shard::Shard;
pub use work::{Order, Progress, SweepReport};
