//! What a static problem returns.

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
    /// The sum of the three.
    pub total: f64,
    /// Potential of dead forces, zero at the start of the rod.
    pub load: f64,
}

/// What a support exerts on the rod.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Reaction {
    /// Force.
    pub force: [f64; 3],
    /// Moment about the support, including torque.
    pub moment: [f64; 3],
    /// Its part along the tangent.
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

/// What one of several instruments does and what its hand feels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstrumentSolution {
    /// Its name.
    pub name: String,
    /// Length beyond the start.
    pub inserted: f64,
    /// Position of its tip.
    pub tip: [f64; 3],
    /// Angle of the tip's d₁ against that at the start, in radians, any number of turns: its twist.
    pub twist: f64,
    /// Force with which its hand pushes: the derivative of the energy of all instruments, loads and what lies in the sheath included, in
    /// its inserted length, at fixed angles and other lengths. `None` where that jumps, as the energy has a kink: where its tip or the end
    /// of one of its sections is at that of another, at the start or at a load.
    pub push_force: Option<f64>,
    /// Torque with which its hand turns it: the derivative of the energy in its angle.
    pub torque: f64,
}

/// A place where the rod presses on itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TouchSolution {
    /// Arc lengths of the two points.
    pub arcs: [f64; 2],
    /// Where they are.
    pub positions: [[f64; 3]; 2],
    /// Force on the first, along the line from the second to it; the second feels the opposite.
    pub force: f64,
    /// Depth to which the surfaces are in each other.
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
    /// Material directions d₁ of the nodes; of a rod that carries no angles, the untwisted reference.
    pub normals: Vec<[f64; 3]>,
    /// Twist of the whole rod in radians, any number of turns; zero where the rod carries no angles, and with several instruments.
    pub twist: f64,
    /// Axial force of the elements.
    pub tensions: Vec<f64>,
    /// Energies.
    pub energy: Energies,
    /// Reactions.
    pub reactions: Reactions,
    /// Force with which the rod must be pushed to stay where it is, if the clamp at its start is a frictionless sleeve that it
    /// slides through; `None` where the start is not clamped. See [`Clamp::push_force`](crate::rod::Clamp::push_force).
    pub push_force: Option<f64>,
    /// Where the rod presses on itself, along it; left out where it does not.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub touching: Vec<TouchSolution>,
    /// Each instrument, in the order of the case; left out for a single rod.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub instruments: Vec<InstrumentSolution>,
    /// Newton iterations, all load steps together.
    pub iterations: usize,
    /// Largest residual over the force scale.
    pub residual: f64,
    /// Positive and negative pivots of the final matrix.
    pub inertia: [usize; 2],
    /// Negative pivots beyond those of the multipliers: dimension of the unstable space.
    pub negative_modes: usize,
    /// Whether the state is a minimum of the energy. With loads that have no potential (moments, followers) this speaks of
    /// the symmetric part of the stiffness.
    pub stable: bool,
    /// Whether the state is an equilibrium.
    pub converged: bool,
    /// Why the iteration stopped.
    pub stop: String,
    /// Whether the rod carried angles.
    pub twisted: bool,
    /// Whether the energy fell at every accepted step (to rounding); true where loads have no potential to fall.
    pub monotone: bool,
}

impl StaticSolution {
    /// Why this is no equilibrium; `None` where it is one.
    pub fn failure(&self) -> Option<String> {
        (!self.converged).then(|| {
            format!(
                "no equilibrium after {} iterations, residual {:.1e}: {}",
                self.iterations, self.residual, self.stop
            )
        })
    }

    /// Itself if it is an equilibrium, an error that says why not otherwise.
    ///
    /// # Errors
    /// [`Self::failure`] as a failed computation.
    pub fn checked(self) -> crate::Result<Self> {
        match self.failure() {
            None => Ok(self),
            Some(reason) => Err(crate::Error::Computation(reason)),
        }
    }
}
