//! Paths of equilibria past limit points: arc-length continuation in the load factor.
//!
//! Riks' method (1979) with the plane normal to the predictor: the step along the path is measured by the rotation of
//! the rod, √∫|δt|² ds/L, so it does not depend on units, and the load factor follows from the shape.

use super::problem::StaticProblem;
use crate::rod::{ElementData, Layout, RodState};
use crate::solve::{Newton, NewtonOptions};
use crate::{Error, Result};

/// One equilibrium of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPoint {
    /// Factor of the loads.
    pub factor: f64,
    /// Position of the end.
    pub tip: [f64; 3],
    /// Elastic energy.
    pub energy: f64,
    /// Dimension of the unstable subspace.
    pub negative_modes: usize,
    /// Relative residual.
    pub residual: f64,
}

/// Largest number of corrector iterations before a step is halved.
const CORRECTIONS: usize = 12;
/// Largest number of halvings of one step before the path is abandoned.
const HALVINGS: usize = 12;

impl StaticProblem {
    /// Follows the equilibria from the unloaded state for `points` steps of the given root-mean-square rotation (radians). A step
    /// that does not converge is halved. Stable or not, every point is an equilibrium.
    pub fn continuation(&self, step: f64, points: usize) -> Result<Vec<PathPoint>> {
        if !(step.is_finite() && step > 0.0) {
            return Err(Error::parameter("step", step, "must be a positive rotation in radians"));
        }
        by_angles!(self.angles, self.follow(step, points))
    }

    fn follow<const C: usize>(&self, step: f64, points: usize) -> Result<Vec<PathPoint>> {
        let elements = &self.elements;
        let n = elements.len();
        let l = Layout::<C>;
        let mut newton = Newton::<C>::new(n);
        let mut state = self.initial.clone();
        let mut supports = self.supports.clone();
        supports.begin(&state);
        let mut loads = self.loads.clone();
        loads.factor = 0.0;
        let options = NewtonOptions { ..self.options };
        let report = newton.solve(elements, &mut supports, &mut loads, &mut state, &options);
        if !report.converged {
            return Err(Error::Computation(format!("the unloaded state was not found: {}", report.reason)));
        }
        let multipliers = report.multipliers;
        let mut out = Vec::with_capacity(points);
        let mut last = vec![0.0; Layout::<C>::dimension(n)];
        let mut factor = 0.0;
        let mut trial = state.clone();
        let mut base = state.clone();
        for _ in 0..points {
            let mut size = step;
            let mut found = None;
            for _ in 0..HALVINGS {
                let mut held = supports.clone();
                base.copy_from(&state);
                let mut lambda = factor;
                // Predictor.
                let mut direction = self.load_response(&mut newton, &base, &held, lambda)?;
                let mut along = product(elements, l, &direction, &last);
                if along == 0.0 {
                    along = 1.0;
                }
                let length = product(elements, l, &direction, &direction).sqrt();
                if !(length.is_finite() && length > 0.0) {
                    return Err(Error::Computation("the loads do not move the rod".to_owned()));
                }
                let scale = along.signum() * size / length;
                for value in &mut direction {
                    *value *= scale;
                }
                lambda += scale;
                move_by::<C>(elements, &mut trial, &base, &direction, &mut held, l);
                std::mem::swap(&mut base, &mut trial);
                // Corrector, across the predictor.
                for _ in 0..CORRECTIONS {
                    loads.factor = lambda;
                    newton.assemble(elements, &held, &mut loads, &base);
                    let size = newton.residual(elements, &loads, &held, self.options.tolerance);
                    if size.rounding {
                        let inertia = newton.factor(elements, &held).unwrap_or_default();
                        found = Some((
                            lambda,
                            size.relative,
                            inertia.negative.saturating_sub(multipliers),
                            held.clone(),
                        ));
                        break;
                    }
                    let Some((_, step)) = newton.full_step(elements, &held) else { break };
                    let mut correction = step.to_vec();
                    let response = self.load_response(&mut newton, &base, &held, lambda)?;
                    let across = product(elements, l, &direction, &response);
                    let change = -product(elements, l, &direction, &correction) / across;
                    if !change.is_finite() {
                        break;
                    }
                    lambda += change;
                    for (c, r) in correction.iter_mut().zip(&response) {
                        *c += change * r;
                    }
                    let (turn, _) = RodState::largest_turn::<C>(elements, &base, &correction);
                    if turn.is_nan() || turn > 1.0 {
                        break;
                    }
                    move_by::<C>(elements, &mut trial, &base, &correction, &mut held, l);
                    std::mem::swap(&mut base, &mut trial);
                }
                if found.is_some() {
                    last.copy_from_slice(&direction);
                    break;
                }
                size *= 0.5;
            }
            let Some((lambda, residual, negative_modes, held)) = found else {
                return Err(Error::Computation(format!(
                    "the path could not be followed beyond load factor {factor}"
                )));
            };
            factor = lambda;
            supports = held;
            state.copy_from(&base);
            let energy = newton.assembly.energy.total();
            out.push(PathPoint { factor, tip: state.positions[n].into(), energy, negative_modes, residual });
        }
        Ok(out)
    }

    /// The derivative of the shape in the load factor: K⁻¹ times the difference of two residuals, which is exact
    /// because they are linear in the factor.
    fn load_response<const C: usize>(
        &self,
        newton: &mut Newton<C>,
        state: &RodState,
        supports: &crate::rod::Supports,
        factor: f64,
    ) -> Result<Vec<f64>> {
        let mut loads = self.loads.clone();
        loads.factor = factor + 1.0;
        newton.assemble(&self.elements, supports, &mut loads, state);
        let more = newton.assembly.residual.clone();
        loads.factor = factor;
        newton.assemble(&self.elements, supports, &mut loads, state);
        if newton.factor(&self.elements, supports).is_none() {
            return Err(Error::Computation(format!("singular stiffness at load factor {factor}")));
        }
        let mut rate: Vec<f64> = newton.assembly.residual.iter().zip(&more).map(|(a, b)| a - b).collect();
        newton.apply_inverse(&self.elements, &mut rate);
        Ok(rate)
    }
}

/// ∫ δt·δt′ ds / L of two steps.
fn product<const C: usize>(elements: &[ElementData], l: Layout<C>, a: &[f64], b: &[f64]) -> f64 {
    let (mut sum, mut length) = (0.0, 0.0);
    for (e, data) in elements.iter().enumerate() {
        length += data.length;
        for i in [e, e + 1] {
            for k in 0..2 {
                sum += 0.5 * data.length * a[l.tangent(i) + k] * b[l.tangent(i) + k];
            }
        }
    }
    sum / length
}

/// Moves a state and its multipliers by a full step.
fn move_by<const C: usize>(
    elements: &[ElementData],
    trial: &mut RodState,
    base: &RodState,
    step: &[f64],
    supports: &mut crate::rod::Supports,
    l: Layout<C>,
) {
    trial.copy_from(base);
    trial.advance::<C>(elements, base, step, 1.0);
    for (e, data) in elements.iter().enumerate() {
        if data.flexibility == 0.0 {
            trial.tensions[e] = base.tensions[e] + step[l.tension(e)];
        }
    }
    let first = l.support(elements.len());
    for (j, m) in supports.multipliers.iter_mut().enumerate() {
        *m += step[first + j];
    }
    supports.follow(trial);
}
