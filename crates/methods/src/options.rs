//! The published methods as `[method]` of a scene: keys, defaults and ranges.
//!
//! Defaults are the best for an insertion, as found by the example `tune`; a static solve has others, those of the
//! models themselves.

use std::sync::Arc;

use endowire_core::error::in_range;
use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::{
    BeamFem, ChordEnergy, DiscreteRod, Inserted, InsertionOptions, MassSpring, RigidLinks, RodModel,
};

/// Largest `axial_ratio`: with stiffer springs bending is lost in rounding.
const LARGEST_RATIO: f64 = 1e6;
/// Largest `damping`: beyond it there is practically no motion.
const LARGEST_DAMPING: f64 = 1e6;
/// Largest `largest_turn_rad`.
const LARGEST_TURN_RAD: f64 = std::f64::consts::PI;

/// The options of a model: key, default and upper bound of each positive number, and the largest number of
/// iterations; other parameters are those of the given model.
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
            /// Total force that may be out of balance, in units of EI/L²; up to 1.
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
    /// Largest number of time steps for a part of a command.
    max_iterations = RigidLinks::default().max_iterations;
    /// Time step in units of √(ρL⁴/EI), up to 1000.
    time_step = 0.015, to 1e3;
    /// Ratio of joint dampers to joint springs, in the same unit, up to 1000.
    damping = 0.05, to 1e3;
    /// Largest rotation of a link in one time step, rad; up to π.
    largest_turn_rad = RigidLinks::default().largest_turn_rad, to LARGEST_TURN_RAD;
}

options! {
    /// `mass-spring`.
    MassSpringOptions of MassSpring;
    /// Largest number of time steps for a part of a command.
    max_iterations = 200_000;
    /// Ratio of axial to bending stiffness, EA h²/EI; up to 10⁶.
    axial_ratio = MassSpring::default().axial_ratio, to LARGEST_RATIO;
    /// Damping relative to the critical damping of the slowest mode, up to 10⁶.
    damping = 10.0, to LARGEST_DAMPING;
    /// Time step relative to the largest stable one, up to 1.
    time_step = MassSpring::default().time_step, to 1.0;
}

options! {
    /// `beam-fem`, as published.
    BeamFemOptions of BeamFem and BeamFem::default();
    /// Largest number of increments for a part of a command.
    max_iterations = BeamFem::default().max_iterations;
    /// Ratio of axial to bending stiffness, EA h²/EI; up to 10⁶.
    axial_ratio = BeamFem::default().axial_ratio, to LARGEST_RATIO;
    /// Largest rotation of a node in one increment, rad; up to π.
    largest_turn_rad = BeamFem::default().largest_turn_rad, to LARGEST_TURN_RAD;
}

options! {
    /// `beam-fem-damped`.
    BeamFemDampedOptions of BeamFem and BeamFem::default();
    /// Largest number of increments for a part of a command.
    max_iterations = BeamFem::default().max_iterations;
    /// Ratio of axial to bending stiffness, EA h²/EI; up to 10⁶.
    axial_ratio = BeamFem::default().axial_ratio, to LARGEST_RATIO;
    /// Viscous damping of the nodes over the time of one increment, in units of EI/L⁴ per length; up to 10⁶.
    damping = 1e4, to LARGEST_DAMPING;
    /// Largest rotation of a node in one increment, rad; up to π.
    largest_turn_rad = BeamFem::default().largest_turn_rad, to LARGEST_TURN_RAD;
}

options! {
    /// `chord-energy`.
    ChordEnergyOptions of ChordEnergy;
    /// Largest number of sweeps for a part of a command.
    max_iterations = 20_000;
}

options! {
    /// `discrete-rod`.
    DiscreteRodOptions of DiscreteRod;
    /// Largest number of time steps for a part of a command.
    max_iterations = 200_000;
    /// Damping relative to the critical damping of the slowest mode, up to 10⁶.
    damping = 10.0, to LARGEST_DAMPING;
    /// Time step relative to the largest stable one, up to 1.
    time_step = DiscreteRod::default().time_step, to 1.0;
    /// Relative error of an edge's length at which projection stops; up to 1.
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
