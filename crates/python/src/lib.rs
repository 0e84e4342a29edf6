//! The native module of the Python package `endowire`: Python classes for the types of the libraries.
//!
//! Nothing is computed here. Arguments become values of `endowire-core` and `endowire-viewer`, results become numpy
//! arrays, and errors become exceptions with the same messages. The interpreter is released during computations.

#![allow(clippy::needless_pass_by_value, reason = "pyo3 hands over what it has extracted")]

mod arrays;
mod assess;
mod batch;
mod control;
mod document;
mod error;
mod forked;
mod frames;
mod gradient;
mod instrument;
mod interrupt;
mod moves;
mod record;
mod recorded;
mod recording;
mod report;
mod rod;
mod scene;
mod simulation;
mod start;
mod state;
mod sweep;
mod vessel;

use pyo3::prelude::*;

/// The native part of `endowire`; import `endowire` instead.
#[pymodule(gil_used = false)]
mod _endowire {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::assess::{assess, course, score};
    #[pymodule_export]
    use super::batch::Batch;
    #[pymodule_export]
    use super::control::Controller;
    #[pymodule_export]
    use super::frames::{Frames, Renderer, check_view};
    #[pymodule_export]
    use super::gradient::Gradient;
    #[pymodule_export]
    use super::instrument::Instrument;
    #[pymodule_export]
    use super::record::Record;
    #[pymodule_export]
    use super::recorded::{Pulled, Recorded};
    #[pymodule_export]
    use super::recording::{Recorder, Recording};
    #[pymodule_export]
    use super::report::StepReport;
    #[pymodule_export]
    use super::rod::solve_rod;
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::simulation::Simulation;
    #[pymodule_export]
    use super::start::Start;
    #[pymodule_export]
    use super::state::State;
    #[pymodule_export]
    use super::sweep::{merge_sweeps, sweep};
    #[pymodule_export]
    use super::vessel::{Vessel, check_vessel};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::forked::imported();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
