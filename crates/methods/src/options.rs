//! The field's methods as `[method]` of a scene: their keys, the defaults, and how far they may go.
//!
//! Defaults are those that serve an insertion best, as found by the example `tune`; a static solve has others, those of the models
//! themselves.

use std::sync::Arc;

use endowire_core::error::in_range;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::{
    BeamFem, ChordEnergy, DiscreteRod, Inserted, InsertionOptions, MassSpring, RigidLinks, RodModel,
};

/// `rigid-links`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RigidLinksOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Force that may be out of balance in all, in units of EI/L²; up to 1.
    pub tolerance: f64,
    /// Time step in units of √(ρL⁴/EI), up to 1000.
    pub time_step: f64,
    /// Joint dampers over joint springs, in the same unit, up to 1000.
    pub damping: f64,
    /// Largest turn of a link in one time step, rad; up to π.
    pub largest_turn_rad: f64,
    /// Most time steps of a part of a command.
    pub max_iterations: usize,
}

impl Default for RigidLinksOptions {
    fn default() -> Self {
        let InsertionOptions { element_mm, tolerance } = InsertionOptions::default();
        let RigidLinks { largest_turn_rad, max_iterations, .. } = RigidLinks::default();
        Self { element_mm, tolerance, time_step: 0.015, damping: 0.05, largest_turn_rad, max_iterations }
    }
}

impl RigidLinksOptions {
    pub(crate) fn inserted(&self) -> Result<Inserted> {
        let Self { element_mm, tolerance, time_step, damping, largest_turn_rad, max_iterations } = *self;
        in_range("method.time_step", time_step, 1e3)?;
        in_range("method.damping", damping, 1e3)?;
        in_range("method.largest_turn_rad", largest_turn_rad, LARGEST_TURN_RAD)?;
        let model = RigidLinks { time_step, damping, largest_turn_rad, max_iterations };
        inserted(model, max_iterations, InsertionOptions { element_mm, tolerance })
    }
}

/// `mass-spring`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MassSpringOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Force that may be out of balance in all, in units of EI/L²; up to 1.
    pub tolerance: f64,
    /// Axial stiffness over bending stiffness, EA h²/EI; up to 10⁶.
    pub axial_ratio: f64,
    /// Damping over that which is critical for the slowest mode, up to 10⁶.
    pub damping: f64,
    /// Time step over the largest stable one, up to 1.
    pub time_step: f64,
    /// Most time steps of a part of a command.
    pub max_iterations: usize,
}

impl Default for MassSpringOptions {
    fn default() -> Self {
        let InsertionOptions { element_mm, tolerance } = InsertionOptions::default();
        let MassSpring { axial_ratio, time_step, .. } = MassSpring::default();
        Self { element_mm, tolerance, axial_ratio, damping: 10.0, time_step, max_iterations: 200_000 }
    }
}

impl MassSpringOptions {
    pub(crate) fn inserted(&self) -> Result<Inserted> {
        let Self { element_mm, tolerance, axial_ratio, damping, time_step, max_iterations } = *self;
        in_range("method.axial_ratio", axial_ratio, LARGEST_RATIO)?;
        in_range("method.damping", damping, LARGEST_DAMPING)?;
        in_range("method.time_step", time_step, 1.0)?;
        let model = MassSpring { axial_ratio, damping, time_step, max_iterations };
        inserted(model, max_iterations, InsertionOptions { element_mm, tolerance })
    }
}

/// `beam-fem`, as published.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BeamFemOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Force that may be out of balance in all, in units of EI/L²; up to 1.
    pub tolerance: f64,
    /// Axial stiffness over bending stiffness, EA h²/EI; up to 10⁶.
    pub axial_ratio: f64,
    /// Largest turn of a node in one increment, rad; up to π.
    pub largest_turn_rad: f64,
    /// Most increments of a part of a command.
    pub max_iterations: usize,
}

impl Default for BeamFemOptions {
    fn default() -> Self {
        let InsertionOptions { element_mm, tolerance } = InsertionOptions::default();
        let BeamFem { axial_ratio, largest_turn_rad, max_iterations, .. } = BeamFem::default();
        Self { element_mm, tolerance, axial_ratio, largest_turn_rad, max_iterations }
    }
}

impl BeamFemOptions {
    pub(crate) fn inserted(&self) -> Result<Inserted> {
        let Self { element_mm, tolerance, axial_ratio, largest_turn_rad, max_iterations } = *self;
        in_range("method.axial_ratio", axial_ratio, LARGEST_RATIO)?;
        in_range("method.largest_turn_rad", largest_turn_rad, LARGEST_TURN_RAD)?;
        let model = BeamFem { axial_ratio, largest_turn_rad, max_iterations, ..BeamFem::default() };
        inserted(model, max_iterations, InsertionOptions { element_mm, tolerance })
    }
}

/// `beam-fem-damped`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BeamFemDampedOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Force that may be out of balance in all, in units of EI/L²; up to 1.
    pub tolerance: f64,
    /// Axial stiffness over bending stiffness, EA h²/EI; up to 10⁶.
    pub axial_ratio: f64,
    /// Viscous damping of the nodes over the time of one increment, in units of EI/L⁴ per length; up to 10⁶.
    pub damping: f64,
    /// Largest turn of a node in one increment, rad; up to π.
    pub largest_turn_rad: f64,
    /// Most increments of a part of a command.
    pub max_iterations: usize,
}

impl Default for BeamFemDampedOptions {
    fn default() -> Self {
        let BeamFemOptions { element_mm, tolerance, axial_ratio, largest_turn_rad, max_iterations } =
            BeamFemOptions::default();
        Self { element_mm, tolerance, axial_ratio, damping: 1e4, largest_turn_rad, max_iterations }
    }
}

impl BeamFemDampedOptions {
    pub(crate) fn inserted(&self) -> Result<Inserted> {
        let Self { element_mm, tolerance, axial_ratio, damping, largest_turn_rad, max_iterations } = *self;
        in_range("method.axial_ratio", axial_ratio, LARGEST_RATIO)?;
        in_range("method.damping", damping, LARGEST_DAMPING)?;
        in_range("method.largest_turn_rad", largest_turn_rad, LARGEST_TURN_RAD)?;
        let model = BeamFem { axial_ratio, damping, largest_turn_rad, max_iterations, ..BeamFem::default() };
        inserted(model, max_iterations, InsertionOptions { element_mm, tolerance })
    }
}

/// `chord-energy`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ChordEnergyOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Force that may be out of balance in all, in units of EI/L²; up to 1.
    pub tolerance: f64,
    /// Most rounds of a part of a command.
    pub max_iterations: usize,
}

impl Default for ChordEnergyOptions {
    fn default() -> Self {
        let InsertionOptions { element_mm, tolerance } = InsertionOptions::default();
        Self { element_mm, tolerance, max_iterations: 20_000 }
    }
}

impl ChordEnergyOptions {
    pub(crate) fn inserted(&self) -> Result<Inserted> {
        let Self { element_mm, tolerance, max_iterations } = *self;
        let options = InsertionOptions { element_mm, tolerance };
        inserted(ChordEnergy { max_iterations }, max_iterations, options)
    }
}

/// `discrete-rod`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DiscreteRodOptions {
    /// Length of a segment, mm.
    pub element_mm: f64,
    /// Force that may be out of balance in all, in units of EI/L²; up to 1.
    pub tolerance: f64,
    /// Damping over that which is critical for the slowest mode, up to 10⁶.
    pub damping: f64,
    /// Time step over the largest stable one, up to 1.
    pub time_step: f64,
    /// Relative error of an edge's length with which a round of projection is the last; up to 1.
    pub length_tolerance: f64,
    /// Most time steps of a part of a command.
    pub max_iterations: usize,
}

impl Default for DiscreteRodOptions {
    fn default() -> Self {
        let InsertionOptions { element_mm, tolerance } = InsertionOptions::default();
        let DiscreteRod { time_step, length_tolerance, .. } = DiscreteRod::default();
        Self { element_mm, tolerance, damping: 10.0, time_step, length_tolerance, max_iterations: 200_000 }
    }
}

impl DiscreteRodOptions {
    pub(crate) fn inserted(&self) -> Result<Inserted> {
        let Self { element_mm, tolerance, damping, time_step, length_tolerance, max_iterations } = *self;
        in_range("method.damping", damping, LARGEST_DAMPING)?;
        in_range("method.time_step", time_step, 1.0)?;
        in_range("method.length_tolerance", length_tolerance, 1.0)?;
        let model = DiscreteRod { damping, time_step, length_tolerance, max_iterations };
        inserted(model, max_iterations, InsertionOptions { element_mm, tolerance })
    }
}

/// Largest `axial_ratio`: stiffer springs lose the bending in their rounding.
const LARGEST_RATIO: f64 = 1e6;
/// Largest `damping`: beyond it nothing moves.
const LARGEST_DAMPING: f64 = 1e6;
/// Largest `largest_turn_rad`.
const LARGEST_TURN_RAD: f64 = std::f64::consts::PI;

fn inserted(
    model: impl RodModel + 'static,
    max_iterations: usize,
    options: InsertionOptions,
) -> Result<Inserted> {
    if max_iterations == 0 {
        return Err(Error::parameter("method.max_iterations", 0, "allow at least one"));
    }
    Ok(Inserted::new(Arc::new(model), options))
}
