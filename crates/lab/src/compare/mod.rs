//! Run time against error, method by method: the cases, the methods in them, and the fronts of what was measured. `endowire compare` runs them.

pub mod candidate;
pub mod case;
mod front;

use serde::{Deserialize, Serialize};

pub use front::{Front, front};

/// One measurement.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Row {
    /// Name of the case.
    pub case: String,
    /// Name of the method.
    pub method: String,
    /// Number of elements of the whole inserted device.
    pub resolution: usize,
    /// Error in the case's unit: of the tip, relative to the length, or root mean square in mm. `None` without a
    /// result.
    pub error: Option<f64>,
    /// Median time of one solve or one whole insertion, s.
    pub time_s: Option<f64>,
    /// Iterations, as the method counts them.
    pub iterations: Option<u64>,
    /// Why there is no result, or a remark.
    #[serde(default)]
    pub note: String,
}
