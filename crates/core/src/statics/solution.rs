//! Results of a static problem.

use super::case::is_zero;
use crate::contact::Touching;
use serde::Serialize;

/// Energies of the rod.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Energies {
    /// Bending.
    pub bend: f64,
    /// Twist.
    pub twist: f64,
    /// Stretch.
    pub axial: f64,
    /// Sum of the three.
    pub total: f64,
    /// Potential of dead forces, zero at the start of the rod.
    pub load: f64,
}

/// Force and moment of a support on the rod.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Reaction {
    /// Force.
    pub force: [f64; 3],
    /// Moment about the support, including torque.
    pub moment: [f64; 3],
    /// The component of the moment along the tangent.
    pub torque: f64,
}

/// Reactions at both ends.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Reactions {
    /// At the start.
    pub start: Reaction,
    /// At the end; zero where it is free.
    pub end: Reaction,
}

/// Position and hand forces of one of several instruments.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstrumentSolution {
    /// Its name.
    pub name: String,
    /// Length beyond the start.
    pub inserted: f64,
    /// Position of its tip.
    pub tip: [f64; 3],
    /// Twist: angle of the tip's d₁ against that at the start, rad, any number of turns.
    pub twist: f64,
    /// Push force of its hand: the derivative of the total energy (instruments, loads, and what lies in the sheath)
    /// in its inserted length, at fixed angles and other lengths. `None` where the energy has a kink: where its tip
    /// or the end of one of its sections coincides with that of another, with the start or with a load.
    pub push_force: Option<f64>,
    /// Torque of its hand: the derivative of the energy in its angle.
    pub torque: f64,
    /// Angle, rad, by which what goes on at its end tilts in its play; omitted where it has none.
    #[serde(skip_serializing_if = "is_zero")]
    pub tilt: f64,
}

/// A self-contact of the rod.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TouchSolution {
    /// Arc lengths of the two points.
    pub arcs: [f64; 2],
    /// Their positions.
    pub positions: [[f64; 3]; 2],
    /// Force on the first point, along the line from the second to it; the second has the opposite force.
    pub force: f64,
    /// Penetration of the surfaces.
    pub penetration: f64,
}

impl From<&Touching> for TouchSolution {
    fn from(touching: &Touching) -> Self {
        Self {
            arcs: touching.arcs_mm,
            positions: touching.positions_mm.map(Into::into),
            force: touching.force_n,
            penetration: touching.penetration_mm,
        }
    }
}

/// A solved case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StaticSolution {
    /// Position of the end.
    pub tip: [f64; 3],
    /// Tangent of the end.
    pub tip_tangent: [f64; 3],
    /// Angle between the tangents of start and end, in radians, 0 to π.
    pub tip_angle: f64,
    /// Arc length of the nodes.
    pub arc_lengths: Vec<f64>,
    /// Positions of the nodes.
    pub nodes: Vec<[f64; 3]>,
    /// Tangents of the nodes.
    pub tangents: Vec<[f64; 3]>,
    /// Material directions d₁ of the nodes; for a rod without angles, the untwisted reference.
    pub normals: Vec<[f64; 3]>,
    /// Twist of the whole rod, rad, any number of turns; zero for a rod without angles, and for several instruments.
    pub twist: f64,
    /// Axial force of the elements.
    pub tensions: Vec<f64>,
    /// Energies.
    pub energy: Energies,
    /// Reactions.
    pub reactions: Reactions,
    /// Force that holds the rod in place if the clamp at its start is a frictionless sleeve it can slide through;
    /// `None` if the start is not clamped. See [`Clamp::push_force`](super::Clamp::push_force).
    pub push_force: Option<f64>,
    /// Self-contacts, in order along the rod; omitted if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub touching: Vec<TouchSolution>,
    /// Each instrument, in the order of the case; omitted for a single rod.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instruments: Vec<InstrumentSolution>,
    /// Newton iterations of all load steps.
    pub iterations: usize,
    /// Largest residual, relative to the force scale.
    pub residual: f64,
    /// Positive and negative pivots of the final matrix.
    pub inertia: [usize; 2],
    /// Negative pivots beyond one per multiplier: dimension of the unstable subspace.
    pub negative_modes: usize,
    /// Whether the state is a minimum of the energy. With loads that have no potential (moments, followers) this
    /// refers to the symmetric part of the stiffness.
    pub stable: bool,
    /// Whether the state is an equilibrium.
    pub converged: bool,
    /// Why the iteration stopped.
    pub stop: String,
    /// Whether the rod had material angles.
    pub twisted: bool,
    /// Whether the energy decreased (to rounding) at every accepted step; true for loads without potential.
    pub monotone: bool,
}

impl StaticSolution {
    /// Why the state is not an equilibrium; `None` if it is one.
    pub fn failure(&self) -> Option<String> {
        (!self.converged).then(|| {
            format!(
                "no equilibrium after {} iterations, residual {:.1e}: {}; `[initial] points` sets the shape that \
                 the search starts from, `[solver] load_steps` a way to it",
                self.iterations, self.residual, self.stop
            )
        })
    }

    /// Returns itself if it is an equilibrium, otherwise an error with the reason.
    ///
    /// # Errors
    /// [`Self::failure`] as [`crate::Error::Computation`].
    pub fn checked(self) -> crate::Result<Self> {
        match self.failure() {
            None => Ok(self),
            Some(reason) => Err(crate::Error::Computation(reason)),
        }
    }
}
