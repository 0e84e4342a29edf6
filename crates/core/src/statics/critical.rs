//! Critical loads: where the stiffness on a path of equilibria ceases to be positive definite.

use super::problem::StaticProblem;
use crate::rod::{RodState, Supports};
use crate::solve::{Newton, NewtonOptions};
use crate::{Error, Result, Vec3};

/// The parameter of the path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// The factor of all loads.
    Loads,
    /// The rotation of the end about its tangent, in radians.
    Turns,
}

/// Follows the equilibria of one problem over a parameter, including unstable ones.
#[derive(Debug, Clone)]
struct Path<const C: usize> {
    problem: StaticProblem,
    parameter: Parameter,
    newton: Newton<C>,
    state: RodState,
    supports: Supports,
}

impl<const C: usize> Path<C> {
    fn new(problem: &StaticProblem, parameter: Parameter) -> Self {
        let mut supports = problem.supports.clone();
        supports.begin(&problem.initial);
        Self {
            problem: problem.clone(),
            parameter,
            newton: Newton::new(problem.elements.len()),
            state: problem.initial.clone(),
            supports,
        }
    }

    /// Equilibrium at `value`, starting from the last one; returns the number of negative modes.
    fn at(&mut self, value: f64) -> Result<usize> {
        let problem = &self.problem;
        let mut loads = problem.loads.clone();
        match self.parameter {
            Parameter::Loads => loads.factor = value,
            Parameter::Turns => {
                if let Some(end) = &mut self.supports.end_angle {
                    let change = value - end.turns;
                    end.turns = value;
                    end.target += change;
                    // Distribute the twist over all nodes: otherwise it would all start in the last element.
                    let n = problem.elements.len();
                    let length: f64 = problem.elements.iter().map(|e| e.length).sum();
                    let mut s = 0.0;
                    for i in 0..=n {
                        self.state.angles[i] += change * s / length;
                        s += problem.elements.get(i).map_or(0.0, |e| e.length);
                    }
                }
            }
        }
        let options = NewtonOptions { minimum: false, ..problem.options };
        let report =
            self.newton.solve(&problem.elements, &mut self.supports, &mut loads, &mut self.state, &options);
        if !report.converged {
            return Err(Error::Computation(format!(
                "no equilibrium at parameter {value}: {}",
                report.reason
            )));
        }
        let shift = self.newton.regularisation(&problem.elements);
        let inertia = self
            .newton
            .inertia(&problem.elements, &self.supports, shift)
            .ok_or_else(|| Error::Computation(format!("singular stiffness at parameter {value}")))?;
        Ok(inertia.negative.saturating_sub(report.multipliers))
    }
}

impl StaticProblem {
    /// The lowest parameter between `from` and `to` at which an eigenvalue of the stiffness changes sign, by
    /// bisection on the inertia, to the relative `tolerance`. Only for loads with a potential.
    pub fn critical(&self, parameter: Parameter, from: f64, to: f64, tolerance: f64) -> Result<f64> {
        by_angles!(self.angles, self.bisect(parameter, from, to, tolerance))
    }

    /// Equilibrium at one parameter.
    fn state_at<const C: usize>(&self, parameter: Parameter, value: f64) -> Result<RodState> {
        let mut path = Path::<C>::new(self, parameter);
        path.at(value)?;
        Ok(path.state)
    }

    fn bisect<const C: usize>(
        &self,
        parameter: Parameter,
        from: f64,
        to: f64,
        tolerance: f64,
    ) -> Result<f64> {
        let mut path = Path::<C>::new(self, parameter);
        let base = path.at(from)?;
        let (mut low, mut high) = (from, to);
        if path.at(to)? <= base {
            return Err(Error::Computation(format!("no eigenvalue changes sign between {from} and {to}")));
        }
        while high - low > tolerance * high.abs() {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if path.at(middle)? > base {
                high = middle;
            } else {
                low = middle;
            }
        }
        Ok(0.5 * (low + high))
    }

    /// The parameter at which the response to a small `probe` (force per length) becomes infinite: the definition of
    /// "critical" for loads without potential, whose stiffness is not symmetric. There the reciprocal of the
    /// deflection goes to zero linearly; the zero is found by the secant method from the two values given, both below
    /// it.
    pub fn critical_by_softening(
        &self,
        parameter: Parameter,
        from: f64,
        to: f64,
        probe: [f64; 3],
        tolerance: f64,
    ) -> Result<f64> {
        let mut problem = self.clone();
        let n = problem.elements.len();
        let size = Vec3::from(probe).norm();
        let straight = self.initial.clone();
        let mut stiffness = |value: f64| -> Result<f64> {
            problem.loads = self.loads.clone();
            // The probe must not grow with the factor.
            let share = if parameter == Parameter::Loads { 1.0 / value } else { 1.0 };
            problem.loads.distributed.push((0, n, Vec3::from(probe) * share));
            let state = by_angles!(problem.angles, problem.state_at(parameter, value))?;
            let moved = state
                .positions
                .iter()
                .zip(&straight.positions)
                .map(|(a, b)| (a - b).dot(&Vec3::from(probe)) / size)
                .fold(0.0f64, |m, v| if v.abs() > m.abs() { v } else { m });
            Ok(size / moved)
        };
        let (mut a, mut b) = (from, to);
        let (mut fa, mut fb) = (stiffness(a)?, stiffness(b)?);
        for _ in 0..60 {
            let slope = (fb - fa) / (b - a);
            let c = b - fb / slope;
            if !c.is_finite() {
                break;
            }
            if (c - b).abs() <= tolerance * c.abs() {
                return Ok(c);
            }
            // Stop short of the zero, where the response is still small.
            let next = b + 0.9 * (c - b);
            (a, fa) = (b, fb);
            b = next;
            fb = stiffness(b)?;
        }
        Err(Error::Computation(format!("the response does not soften to a critical value beyond {from}")))
    }
}
