//! Options of the paper's method in a scene.

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use super::slide::TangentReading;
use super::wall::ContactReading;
use endowire_core::error::in_range;
use endowire_core::insertion::Surroundings;

/// Options of the paper's method.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Li2011Options {
    /// Element (segment) length l, mm.
    pub element_mm: f64,
    /// Wall stiffness κ per contact node, N/mm.
    pub wall_stiffness_n_per_mm: f64,
    /// Whether tangents have unit length.
    pub tangents: TangentReading,
    /// What nodes collide with.
    pub contact: ContactReading,
}

impl Default for Li2011Options {
    /// The middle column of the paper's Table 2; the paper does not print κ, and 1 N/mm holds a 5 N·mm² wire
    /// within some hundredths of a millimetre of the wall.
    fn default() -> Self {
        Self {
            element_mm: 2.0,
            wall_stiffness_n_per_mm: 1.0,
            tangents: TangentReading::default(),
            contact: ContactReading::default(),
        }
    }
}

/// Two solvers for the same equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinearSolver {
    /// A B⁻¹ x = b, dense.
    Dense,
    /// Block elimination along the chain.
    Banded,
}

/// Largest number of elements of the dense solve: (4n)² numbers of 8 bytes in four matrices are 1.2 GB at 1,500, and
/// one step takes seconds.
const ELEMENT_LIMIT_DENSE: f64 = 1_500.0;
/// Largest number of elements of the banded solve.
const ELEMENT_LIMIT_BANDED: f64 = 100_000.0;
/// Stiffest wall, N/mm per node.
const STIFFEST_N_PER_MM: f64 = 1e9;

impl LinearSolver {
    /// Name of the method in scenes and states.
    pub(crate) fn method(self) -> &'static str {
        match self {
            Self::Dense => "li2011-dense",
            Self::Banded => "li2011-banded",
        }
    }

    fn element_limit(self) -> f64 {
        match self {
            Self::Dense => ELEMENT_LIMIT_DENSE,
            Self::Banded => ELEMENT_LIMIT_BANDED,
        }
    }
}

impl Li2011Options {
    /// Rejects what the method does not support.
    ///
    /// # Errors
    /// An element length or wall stiffness that is not positive, too many nodes for memory, a wall with friction or
    /// regions or a moving one.
    pub(super) fn check(&self, solver: LinearSolver, surroundings: &Surroundings<'_>) -> Result<()> {
        let length_mm = surroundings.device.length_mm();
        crate::refuse_shape(
            "the paper's method",
            surroundings.device,
            "bends a wire that is straight at rest",
        )?;
        in_range("method.element_mm", self.element_mm, length_mm)?;
        in_range("method.wall_stiffness_n_per_mm", self.wall_stiffness_n_per_mm, STIFFEST_N_PER_MM)?;
        surroundings.properties.refuse_regions("the paper's method")?;
        surroundings.refuse_motion("the paper's method")?;
        surroundings.sheath.refuse_friction("the paper's method")?;
        if surroundings.properties.friction > 0.0 {
            return Err(Error::parameter(
                "vessel.wall.friction",
                surroundings.properties.friction,
                "the paper's method has no friction: set it to 0 or use the method kirchhoff",
            ));
        }
        let (elements, limit) = (length_mm / self.element_mm, solver.element_limit());
        if elements > limit {
            return Err(Error::parameter(
                "method.element_mm",
                self.element_mm,
                format!(
                    "cuts the device of {length_mm} mm into {} elements, more than the {limit} that this method takes: use \
                     longer elements",
                    endowire_core::error::number(elements.ceil())
                ),
            ));
        }
        Ok(())
    }
}
