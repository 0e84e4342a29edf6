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

/// Largest `axial_ratio`: stiffer springs lose the bending in their rounding.
const LARGEST_RATIO: f64 = 1e6;
/// Largest `damping`: beyond it nothing moves.
const LARGEST_DAMPING: f64 = 1e6;
/// Largest `largest_turn_rad`.
const LARGEST_TURN_RAD: f64 = std::f64::consts::PI;

/// The options of a model: key, default and most of each that is a number above zero, and the most iterations; what is left of the model
/// is that of another.
macro_rules! options {
    (
        $(#[$about:meta])*
        $name:ident of $model:ident $(and $rest:expr)?;
        $(#[$counts:meta])* max_iterations = $iterations:expr;
        $($(#[$tells:meta])* $key:ident = $default:expr, to $most:expr;)*
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            /// Length of a segment, mm.
            pub element_mm: f64,
            /// Force that may be out of balance in all, in units of EI/L²; up to 1.
            pub tolerance: f64,
            $($(#[$tells])* pub $key: f64,)*
            $(#[$counts])*
            pub max_iterations: usize,
        }

        impl Default for $name {
            fn default() -> Self {
                let InsertionOptions { element_mm, tolerance } = InsertionOptions::default();
                Self { element_mm, tolerance, $($key: $default,)* max_iterations: $iterations }
            }
        }

        impl $name {
            pub(crate) fn inserted(&self) -> Result<Inserted> {
                let Self { element_mm, tolerance, $($key,)* max_iterations } = *self;
                $(in_range(concat!("method.", stringify!($key)), $key, $most)?;)*
                let model = $model { $($key,)* max_iterations $(, ..$rest)? };
                inserted(model, max_iterations, InsertionOptions { element_mm, tolerance })
            }
        }
    };
}

options! {
    /// `rigid-links`.
    RigidLinksOptions of RigidLinks;
    /// Most time steps of a part of a command.
    max_iterations = RigidLinks::default().max_iterations;
    /// Time step in units of √(ρL⁴/EI), up to 1000.
    time_step = 0.015, to 1e3;
    /// Joint dampers over joint springs, in the same unit, up to 1000.
    damping = 0.05, to 1e3;
    /// Largest turn of a link in one time step, rad; up to π.
    largest_turn_rad = RigidLinks::default().largest_turn_rad, to LARGEST_TURN_RAD;
}

options! {
    /// `mass-spring`.
    MassSpringOptions of MassSpring;
    /// Most time steps of a part of a command.
    max_iterations = 200_000;
    /// Axial stiffness over bending stiffness, EA h²/EI; up to 10⁶.
    axial_ratio = MassSpring::default().axial_ratio, to LARGEST_RATIO;
    /// Damping over that which is critical for the slowest mode, up to 10⁶.
    damping = 10.0, to LARGEST_DAMPING;
    /// Time step over the largest stable one, up to 1.
    time_step = MassSpring::default().time_step, to 1.0;
}

options! {
    /// `beam-fem`, as published.
    BeamFemOptions of BeamFem and BeamFem::default();
    /// Most increments of a part of a command.
    max_iterations = BeamFem::default().max_iterations;
    /// Axial stiffness over bending stiffness, EA h²/EI; up to 10⁶.
    axial_ratio = BeamFem::default().axial_ratio, to LARGEST_RATIO;
    /// Largest turn of a node in one increment, rad; up to π.
    largest_turn_rad = BeamFem::default().largest_turn_rad, to LARGEST_TURN_RAD;
}

options! {
    /// `beam-fem-damped`.
    BeamFemDampedOptions of BeamFem and BeamFem::default();
    /// Most increments of a part of a command.
    max_iterations = BeamFem::default().max_iterations;
    /// Axial stiffness over bending stiffness, EA h²/EI; up to 10⁶.
    axial_ratio = BeamFem::default().axial_ratio, to LARGEST_RATIO;
    /// Viscous damping of the nodes over the time of one increment, in units of EI/L⁴ per length; up to 10⁶.
    damping = 1e4, to LARGEST_DAMPING;
    /// Largest turn of a node in one increment, rad; up to π.
    largest_turn_rad = BeamFem::default().largest_turn_rad, to LARGEST_TURN_RAD;
}

options! {
    /// `chord-energy`.
    ChordEnergyOptions of ChordEnergy;
    /// Most rounds of a part of a command.
    max_iterations = 20_000;
}

options! {
    /// `discrete-rod`.
    DiscreteRodOptions of DiscreteRod;
    /// Most time steps of a part of a command.
    max_iterations = 200_000;
    /// Damping over that which is critical for the slowest mode, up to 10⁶.
    damping = 10.0, to LARGEST_DAMPING;
    /// Time step over the largest stable one, up to 1.
    time_step = DiscreteRod::default().time_step, to 1.0;
    /// Relative error of an edge's length with which a round of projection is the last; up to 1.
    length_tolerance = DiscreteRod::default().length_tolerance, to 1.0;
}

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
