//! The line search: what fraction of a step is taken.
//!
//! The merit is the potential energy, plus a term of the contacts and, where the far end is held, the weighted errors
//! of its conditions. The first trial is the full step, limited so that no node turns too far and no wall is crossed;
//! further trials are at the minimum of a parabola until the merit decreases enough (Armijo's condition; Nocedal and
//! Wright, *Numerical Optimization*, 2nd ed., section 3.1).

use super::external::ContactMerit;
use super::newton::{ENERGY_ROUNDING, Newton, Problem};
use super::report::{StepRecord, StopReason};
use crate::rod::{ElementData, Layout, RodState};
use crate::tuning::NewtonTuning;

/// State kept from one line search to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct LineSearch {
    /// Weights of the errors of position and of direction in the merit.
    penalty: [f64; 2],
    /// Whether the state is already assembled, as the accepted trial.
    pub(super) assembled: bool,
    /// Energy of straightening the rod: in its rest shape the bending energy is zero as a difference of terms of this
    /// size.
    straightening: f64,
}

impl LineSearch {
    pub(super) fn new(elements: &[ElementData]) -> Self {
        let straightening = elements.iter().map(ElementData::straightening_energy).sum();
        Self { penalty: [0.0; 2], assembled: false, straightening }
    }

    /// Weighted sum of the errors of the end conditions.
    fn weigh(&self, gaps: &[f64; 6]) -> f64 {
        self.penalty[0] * (gaps[0].abs() + gaps[1].abs() + gaps[2].abs())
            + self.penalty[1] * (gaps[3].abs() + gaps[4].abs() + gaps[5].abs())
    }
}

/// The merit at the start of a step.
#[derive(Debug, Clone, Copy)]
struct Merit {
    /// Potential energy.
    energy: f64,
    /// Weighted errors of the end conditions.
    gaps: f64,
    /// Slope of both along the step.
    slope: f64,
    /// Magnitude of the energies that are summed.
    scale: f64,
}

/// A trial that is taken.
#[derive(Debug, Clone, Copy)]
struct Taken {
    part: f64,
    /// Changes of the energy and of the merit.
    energy_change: f64,
    change: f64,
}

/// A step for the line search.
#[derive(Debug, Clone, Copy)]
struct Stride {
    merit: Merit,
    /// Fraction of the step that is tried first.
    part: f64,
    /// Largest rotation of a node in the step, rad.
    turn: f64,
    /// Rotation that measures the distance to the minimum, see [`Newton::whole_turn`].
    whole_turn: f64,
}

impl Merit {
    /// Rounding error of a change of the merit.
    fn rounding(&self) -> f64 {
        ENERGY_ROUNDING * self.scale
    }

    /// Whether a change at a fraction of the step satisfies Armijo's condition.
    fn falls_enough(&self, change: f64, part: f64, armijo: f64) -> bool {
        change <= armijo * part * self.slope.min(0.0) + self.rounding()
    }

    /// Fraction of the step at which the parabola through value, slope and the `change` at `part` has its minimum.
    fn parabola(&self, change: f64, part: f64, tuning: &NewtonTuning) -> f64 {
        let (least, largest) = (tuning.least_cut, tuning.largest_cut);
        let curve = change - self.slope * part;
        let minimum = if curve > 0.0 { -0.5 * self.slope * part / curve } else { 0.5 };
        part * if minimum.is_finite() { minimum.max(least).min(largest) } else { least }
    }
}

impl<const C: usize> Newton<C> {
    /// Moves `state` along the step from the assembled state, given its relative residual and shift, and the
    /// contribution of contacts to the merit. Returns the largest rotation of a full step, or infinity.
    pub(super) fn line_search(
        &mut self,
        problem: &mut Problem<'_>,
        state: &mut RodState,
        search: &mut LineSearch,
        (residual, shift): (f64, f64),
        contacts: &ContactMerit,
    ) -> Result<f64, StopReason> {
        let Stride { merit, mut part, whole_turn, turn } =
            self.stride(problem, state, search, shift, contacts)?;
        let free = problem.supports.conditions() == 0;
        // The predicted decrease is below rounding, so evaluating the energies would be useless.
        let below_rounding =
            problem.minimum && free && turn <= self.tuning.short_rad && -merit.slope <= merit.rounding();
        let multipliers = problem.supports.multipliers;
        let first = Layout::<C>.support(problem.elements.len());
        for j in 0..6 {
            problem.supports.multipliers[j] += self.step[first + j];
        }
        for attempt in 0..self.tuning.trials {
            part = self.place_trial(problem, state, part);
            search.assembled = false;
            let (mut energy_change, mut change);
            if below_rounding {
                change = part * (1.0 - 0.5 * part) * merit.slope;
                energy_change = change;
            } else {
                energy_change = self.energy(problem.elements, problem.external, state) - merit.energy;
                change = energy_change + search.weigh(&problem.supports.gaps(&self.trial)) - merit.gaps;
                if !self.accepts(problem, search, &merit, (residual, change, part), attempt) {
                    part = merit.parabola(change, part, &self.tuning);
                    continue;
                }
            }
            let presses = contacts.size_mj > 0.0;
            if part == 1.0 && shift > 0.0 && free && presses && !below_rounding {
                let first = Taken { part, energy_change, change };
                let longer = self.lengthen(problem, state, (&merit, turn), first);
                Taken { part, energy_change, change } = longer;
            }
            self.steps.push(StepRecord {
                energy_change,
                merit_change: change,
                energy_scale: merit.scale,
                residual,
                fraction: part,
                shift,
            });
            // Targets are those of a full step.
            problem.external.visit_contacts(&mut |contacts| contacts.accept_forces(part.min(1.0)));
            std::mem::swap(state, &mut self.trial);
            problem.supports.follow(state);
            return Ok(if part == 1.0 { whole_turn } else { f64::INFINITY });
        }
        problem.supports.multipliers = multipliers;
        Err(StopReason::NoDescent)
    }

    /// Lengthens a full step under a shift, if the merit falls on, and sets the trial to its end.
    ///
    /// A shift that makes the matrix positive definite also shortens the step along the directions of least curvature.
    /// Where those are curved downwards by little, as on the way from a fold along walls and loops, full steps are many
    /// times too short. A rod that touches nothing is not held back so, and turns too far in longer steps: it may end in
    /// a saddle.
    fn lengthen(
        &mut self,
        problem: &mut Problem<'_>,
        state: &RodState,
        (merit, turn): (&Merit, f64),
        taken: Taken,
    ) -> Taken {
        let NewtonTuning { lengthening: part, least_gain, largest_turn_rad, .. } = self.tuning;
        if part <= 1.0 || part * turn > largest_turn_rad {
            return taken;
        }
        std::mem::swap(&mut self.trial, &mut self.other);
        if self.place_trial(problem, state, part) == part {
            let change = self.energy(problem.elements, problem.external, state) - merit.energy;
            if change < least_gain * taken.change {
                return Taken { part, energy_change: change, change };
            }
        }
        std::mem::swap(&mut self.trial, &mut self.other);
        taken
    }

    /// Measures the step from the assembled state.
    fn stride(
        &self,
        problem: &Problem<'_>,
        state: &RodState,
        search: &mut LineSearch,
        shift: f64,
        contacts: &ContactMerit,
    ) -> Result<Stride, StopReason> {
        let mut merit = self.merit_along(problem, state, search);
        merit.energy += contacts.excess_mj;
        merit.slope += contacts.slope_mj;
        merit.scale += contacts.size_mj;
        let (turn, _) = RodState::largest_turn::<C>(problem.elements, state, &self.step);
        if !turn.is_finite() {
            return Err(StopReason::NotFinite);
        }
        let most = self.tuning.largest_turn_rad;
        let part = if turn > most { most / turn } else { 1.0 };
        Ok(Stride { merit, part, turn, whole_turn: self.whole_turn(problem, turn, shift) })
    }

    /// Slope of the energy and the weighted end conditions along the step.
    pub(super) fn slope_along(
        &self,
        problem: &Problem<'_>,
        state: &RodState,
        search: &mut LineSearch,
    ) -> f64 {
        self.merit_along(problem, state, search).slope
    }

    /// Sets the weights of the end conditions above the reactions after the step, and evaluates the merit along it.
    fn merit_along(&self, problem: &Problem<'_>, state: &RodState, search: &mut LineSearch) -> Merit {
        let l = Layout::<C>;
        let (elements, supports) = (problem.elements, &*problem.supports);
        let first = l.support(elements.len());
        let gaps = supports.gaps(state);
        // Multipliers take their full step: they are estimates at this state, however far it moves.
        for j in 0..6 {
            let value = supports.multipliers[j] + self.step[first + j];
            let penalty = &mut search.penalty[usize::from(j >= 3)];
            *penalty = penalty.max(2.0 * value.abs());
        }
        let mut slope = self.assembly.slope(&self.step);
        for j in 0..6 {
            slope += supports.multipliers[j] * gaps[j];
        }
        let weighed = search.weigh(&gaps);
        slope -= weighed;
        let (stored, outside) = (self.assembly.energy.total(), self.assembly.external_energy);
        let scale = stored.abs() + outside.abs() + weighed + slope.abs() + search.straightening;
        Merit { energy: stored + outside, gaps: weighed, slope, scale }
    }

    /// Rotation in a full step if it is an unshifted Newton step towards a minimum; otherwise infinity. Changes of
    /// axial force count too, because they stiffen the rod against bending over its length.
    fn whole_turn(&self, problem: &Problem<'_>, turn: f64, shift: f64) -> f64 {
        if !(problem.minimum && shift == 0.0 && problem.supports.conditions() == 0) {
            return f64::INFINITY;
        }
        let l = Layout::<C>;
        let elements = problem.elements;
        let pulled = (0..elements.len()).fold(0.0f64, |most, e| most.max(self.step[l.tension(e)].abs()));
        turn.max(self.tuning.stiffening * pulled * self.tuning.regularisation / self.regularisation(elements))
    }

    /// Sets the trial to a fraction of the step, at most `part`, that crosses no surface; returns the fraction.
    fn place_trial(&mut self, problem: &mut Problem<'_>, state: &RodState, mut part: f64) -> f64 {
        let Problem { elements, supports, external, .. } = problem;
        self.trial.advance::<C>(elements, state, &self.step, part);
        for _ in 0..self.tuning.safe_cuts {
            let safe = external.safe_fraction(elements, &self.trial);
            if safe >= 1.0 {
                break;
            }
            part *= safe;
            self.trial.advance::<C>(elements, state, &self.step, part);
        }
        if supports.conditions() > 0 {
            self.correct(elements, supports, Layout::<C>.support(elements.len()));
            // If the correction crosses a surface, it is dropped and the merit weighs the errors of the end
            // conditions.
            if external.safe_fraction(elements, &self.trial) < 1.0 {
                self.trial.advance::<C>(elements, state, &self.step, part);
            }
        }
        self.trial.take_tensions::<C>(elements, state, &self.step);
        part
    }

    /// Whether the trial number `attempt`, at a fraction `part` of the step with this `change` of merit, is accepted.
    fn accepts(
        &mut self,
        problem: &mut Problem<'_>,
        search: &mut LineSearch,
        merit: &Merit,
        (residual, change, part): (f64, f64, f64),
        attempt: usize,
    ) -> bool {
        if !change.is_finite() {
            return false;
        }
        if !problem.options.minimum || merit.falls_enough(change, part, self.tuning.armijo) {
            return true;
        }
        if problem.external.is_conservative() {
            return false;
        }
        // Loads without potential: a smaller residual is accepted too. This costs an assembly, so it is checked last.
        search.assembled = true;
        let Problem { elements, supports, external, options, .. } = problem;
        let trial = std::mem::take(&mut self.trial);
        self.assemble(elements, supports, *external, &trial);
        self.trial = trial;
        let found = self.residual(elements, *external, supports, options.tolerance).relative;
        let NewtonTuning { residual_falls, patience, residual_grows, .. } = self.tuning;
        found < residual_falls * residual || (attempt > patience && found < residual_grows * residual)
    }
}
