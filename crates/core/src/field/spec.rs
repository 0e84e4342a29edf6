//! Fields as scenes and Python name them.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Field, Magnet, Weight};
use crate::device::{LENGTH_SLACK_MM, Stack};
use crate::{Error, Result, Vec3};

/// One of the fields that are there, by its numbers: `[[field]]` of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum FieldSpec {
    /// A length of an instrument that is magnetised along its axis, in a uniform magnetic field ([`Magnet`]).
    Magnet {
        /// Number of the instrument, the innermost is 0.
        #[serde(default)]
        instrument: usize,
        /// Where the magnet begins, from the tip, mm.
        #[serde(default)]
        start_mm: f64,
        /// Where it ends, from the tip, mm; within the instrument.
        end_mm: f64,
        /// Its dipole moment towards the tip, A·m².
        moment_am2: f64,
        /// The field, T.
        field_t: [f64; 3],
    },
    /// A dead force per length of all of an instrument ([`Weight`]).
    Weight {
        /// Number of the instrument, the innermost is 0.
        #[serde(default)]
        instrument: usize,
        /// The force, N/mm.
        force_n_per_mm: [f64; 3],
    },
}

impl FieldSpec {
    /// The field.
    ///
    /// # Errors
    /// As [`Magnet::new`] and [`Weight::new`].
    pub fn field(&self) -> Result<Arc<dyn Field>> {
        Ok(match *self {
            Self::Magnet { instrument, start_mm, end_mm, moment_am2, field_t } => {
                Arc::new(Magnet::new(instrument, start_mm..end_mm, moment_am2, Vec3::from(field_t))?)
            }
            Self::Weight { instrument, force_n_per_mm } => {
                Arc::new(Weight::new(instrument, Vec3::from(force_n_per_mm))?)
            }
        })
    }

    /// Its field, T, or its force per length, N/mm.
    pub(crate) fn vector(&self) -> [f64; 3] {
        match self {
            Self::Magnet { field_t: vector, .. } | Self::Weight { force_n_per_mm: vector, .. } => *vector,
        }
    }

    /// Sets that.
    pub(crate) fn set_vector(&mut self, to: [f64; 3]) {
        match self {
            Self::Magnet { field_t: vector, .. } | Self::Weight { force_n_per_mm: vector, .. } => {
                *vector = to;
            }
        }
    }

    /// Checks that it acts on one of these instruments, and within its length. `name` is its own in errors.
    ///
    /// # Errors
    /// An instrument that is not there; a magnet that ends beyond its instrument.
    pub(crate) fn check(&self, name: &str, stack: &Stack) -> Result<()> {
        let (Self::Magnet { instrument, .. } | Self::Weight { instrument, .. }) = *self;
        let Some(held) = stack.instruments().get(instrument) else {
            let remedy = format!("there are {}, the innermost is 0", stack.instruments().len());
            return Err(Error::parameter(format!("{name}.instrument"), instrument, remedy));
        };
        match *self {
            Self::Magnet { end_mm, .. } if end_mm > held.device.length_mm() + LENGTH_SLACK_MM => {
                let remedy = format!("must be within the instrument, {} mm", held.device.length_mm());
                Err(Error::parameter(format!("{name}.end_mm"), end_mm, remedy))
            }
            _ => Ok(()),
        }
    }
}
