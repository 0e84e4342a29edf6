//! A clamped, straight chain under a dead tip force: a case with an exact solution for every method.

use endowire_core::{Error, Result, Vec3};

use crate::{Chain, RodModel, TipForce};

/// A relaxed cantilever.
#[derive(Debug, Clone, PartialEq)]
pub struct CantileverSolution {
    /// Node positions, clamp first.
    pub nodes: Vec<Vec3>,
    /// Number of iterations, as counted by the method.
    pub iterations: usize,
    /// Whether it reached equilibrium.
    pub converged: bool,
}

/// Relaxes a straight rod of unit length and bending stiffness, clamped at the origin along x, under a dead tip force
/// applied at once to the unloaded shape. `tolerance` is as in [`RodModel::relax`].
///
/// # Errors
/// Zero segments, or a relaxation that diverged.
pub fn cantilever(
    model: &dyn RodModel,
    segments: usize,
    force: Vec3,
    tolerance: f64,
) -> Result<CantileverSolution> {
    if segments == 0 {
        return Err(Error::parameter("segments", segments, "give at least one"));
    }
    let chain = Chain::uniform(1.0, segments, 1.0);
    let mut posture = chain.straight();
    let mut load = TipForce { node: segments, force_n: force };
    let outcome = model.relax(&chain, &mut load, &mut posture, tolerance);
    if !posture.is_finite() {
        return Err(Error::Computation(format!("{}: diverged with {segments} segments", model.name())));
    }
    Ok(CantileverSolution {
        nodes: posture.positions_mm,
        iterations: outcome.iterations,
        converged: outcome.converged,
    })
}
