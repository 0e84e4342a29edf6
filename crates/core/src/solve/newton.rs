//! Newton's method on the rod's potential energy, globalised to find minima.
//!
//! The merit is the potential energy itself: a step moves along the constraint manifold (see
//! [`RodState::advance`]), so nothing has to be weighed against it. Where the far end is held, the distance from its
//! conditions is added with a weight above the reactions (an exact penalty), after second-order corrections that
//! re-use the factorisation; once the conditions hold the merit is the energy again. Every accepted step lowers the merit.
//!
//! Each iteration: assemble, factor, look at the inertia. Minima have one negative pivot per multiplier; with more the
//! matrix is shifted by the stiffness of a uniform tension ([`Assembly::unit_shift`]) until they are right, so every
//! step descends. At an equilibrium that is not a minimum the method leaves along the direction of most negative
//! curvature (inverse iteration with the shifted factor). A whisper of the shift stays on always: it makes states that
//! can turn freely (a buckled column about its axis) solvable and cannot be seen in the result, since the
//! residual is never shifted.

use super::band::{Factor, FactorError, Inertia, Shift};
use super::external::External;
use super::report::{NewtonOptions, NewtonReport, StepRecord, StopReason};
use crate::rod::{Assembly, ElementData, Layout, RodState, Supports};

/// Part of EI/L² that is always added as a uniform tension.
const WHISPER: f64 = 1e-8;
/// Shifts tried beyond the first before a matrix is called singular.
const SHIFTS: usize = 60;
/// Changes of energy below this part of the energies' size are rounding.
pub(super) const ENERGY_ROUNDING: f64 = 1e-13;
/// Steps of a solution that are remembered without new memory.
const STEPS: usize = 1024;
/// A whole Newton step that turned no node by more than this, in radians, ends so near to the equilibrium that the residual alone is
/// looked at, …
const SHORT: f64 = 1e-5;
/// … or turned them so little that a method that converges quadratically is within the tolerance: by no more than `NEAR`, and the
/// square of the turn times `QUADRATIC` is no more than the tolerance, …
const NEAR: f64 = 1e-3;
/// … as it is
const QUADRATIC: f64 = 10.0;
/// … where axial forces changed by less than 1 / STIFFENING of that times EI/L², …
const STIFFENING: f64 = 1e-2;
/// … and another step with the same factors leaves a residual smaller by the last turn times no more than this.
const CHORD: f64 = 10.0;

/// Newton's method with its memory, for rods of one size. Nothing is allocated per iteration.
#[derive(Debug, Clone)]
pub struct Newton<const C: usize> {
    /// The system at the current state.
    pub assembly: Assembly<C>,
    /// Residual rows of the first node before they were held: its reactions.
    pub start_residual: [f64; 8],
    unit_shift: Shift,
    pub(super) factor: Factor<C>,
    pub(super) step: Vec<f64>,
    pub(super) spare: Vec<f64>,
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) trial: RodState,
    pub(super) other: RodState,
    /// The steps that the last solution took.
    pub steps: Vec<StepRecord>,
}

impl<const C: usize> Newton<C> {
    /// Room for a rod of `elements` elements.
    pub fn new(elements: usize) -> Self {
        let n = Layout::<C>::dimension(elements);
        Self {
            assembly: Assembly::new(elements),
            start_residual: [0.0; 8],
            unit_shift: Shift::default(),
            factor: Factor::new(n),
            step: vec![0.0; n],
            spare: vec![0.0; n],
            columns: Vec::new(),
            trial: RodState::default(),
            other: RodState::default(),
            steps: Vec::with_capacity(STEPS),
        }
    }

    /// Takes memory for rods of up to `elements` elements.
    pub fn reserve(&mut self, elements: usize) {
        let now = self.trial.elements();
        self.resize(elements);
        self.resize(now);
        self.trial.reserve(elements);
        self.other.reserve(elements);
    }

    /// Changes the size; keeps the memory.
    pub fn resize(&mut self, elements: usize) {
        let n = Layout::<C>::dimension(elements);
        if self.step.len() == n {
            return;
        }
        self.assembly.resize(elements);
        self.factor.resize(n);
        for list in [&mut self.step, &mut self.spare].into_iter().chain(&mut self.columns) {
            list.resize(n, 0.0);
        }
    }

    /// Assembles the whole system at `state`.
    pub fn assemble(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        external: &mut dyn External<C>,
        state: &RodState,
    ) {
        self.assembly.hessian = true;
        self.assemble_parts(elements, supports, external, state);
    }

    /// Assembles residual and energies at `state`, and leaves the matrix empty.
    pub(crate) fn assemble_residual(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        external: &mut dyn External<C>,
        state: &RodState,
    ) {
        self.assembly.hessian = false;
        self.assemble_parts(elements, supports, external, state);
    }

    /// Assembles the system at `state`, without the matrix where the assembly wants none.
    fn assemble_parts(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        external: &mut dyn External<C>,
        state: &RodState,
    ) {
        self.assembly.assemble(elements, state);
        external.add(elements, state, &mut self.assembly);
        supports.add(elements, state, &mut self.assembly);
        for (k, value) in self.start_residual.iter_mut().enumerate() {
            *value = self.assembly.residual.get(k).copied().unwrap_or(0.0);
        }
        supports.hold(&mut self.assembly);
    }

    /// Inertia of the assembled matrix with the shift `sigma`; `None` where it cannot be factored.
    pub fn inertia(&mut self, elements: &[ElementData], supports: &Supports, sigma: f64) -> Option<Inertia> {
        Assembly::<C>::unit_shift(elements, &supports.held::<C>(), &mut self.unit_shift);
        self.factor.factor_shifted(&self.assembly.matrix, &self.unit_shift, sigma).ok()
    }

    /// Factors the assembled matrix with the shift that is always on, for [`Self::apply_inverse`].
    pub fn factor(&mut self, elements: &[ElementData], supports: &Supports) -> Option<Inertia> {
        self.inertia(elements, supports, Self::whisper(elements))
    }

    /// Replaces a right-hand side by the step that answers it, with the matrix factored last.
    pub fn apply_inverse(&self, elements: &[ElementData], b: &mut [f64]) {
        self.factor.solve(b);
        Self::restore_tensions(elements, b);
    }

    /// Newton's step from the assembled state, with the shift that is always on, and the inertia of its matrix; `None` where that
    /// cannot be factored.
    pub fn full_step(&mut self, elements: &[ElementData], supports: &Supports) -> Option<(Inertia, &[f64])> {
        let inertia = self.factor(elements, supports)?;
        self.right_hand_side();
        self.factor.solve(&mut self.step);
        Self::restore_tensions(elements, &mut self.step);
        Some((inertia, &self.step))
    }

    /// Sets the step to the right-hand side it answers.
    fn right_hand_side(&mut self) {
        let (residual, correction) = (&self.assembly.residual, &self.assembly.correction);
        for (s, (r, c)) in self.step.iter_mut().zip(residual.iter().zip(correction)) {
            *s = -(r + c);
        }
    }

    /// The shift that is always on.
    pub fn whisper(elements: &[ElementData]) -> f64 {
        let length: f64 = elements.iter().map(|e| e.length).sum();
        // EI averaged as springs in series: the stiffness the whole rod shows.
        let soft: f64 = elements.iter().map(|e| e.length / e.bending[1]).sum();
        WHISPER / (length * soft)
    }

    /// Factors the matrix and solves for the step, under the whisper and a shift. It begins at an eighth of the last one, or
    /// at none if that was small or `bare` is set, and grows until there are `wanted` negative pivots, if a number is wanted.
    /// Returns the shift, and the inertia under the whisper alone if that was tried and could be factored.
    fn factor_shifted(
        &mut self,
        whisper: f64,
        last: f64,
        bare: bool,
        wanted: Option<usize>,
    ) -> Result<(f64, Option<Inertia>), StopReason> {
        let mut sigma = if bare || last < 8.0 * whisper { 0.0 } else { last / 8.0 };
        let mut natural = None;
        for attempt in 0..=SHIFTS {
            self.right_hand_side();
            let Self { assembly, unit_shift, step, .. } = self;
            let found = self.factor.factor_solve_shifted(&assembly.matrix, unit_shift, whisper + sigma, step);
            if sigma == 0.0 {
                natural = found.ok();
            }
            match found {
                Ok(inertia) if wanted.is_none_or(|negative| inertia.negative == negative) => {
                    return Ok((sigma, natural));
                }
                Err(FactorError::NotFinite { .. }) if attempt > 20 => return Err(StopReason::NotFinite),
                _ => {}
            }
            sigma = if sigma == 0.0 { (1e5 * whisper).max(last / 8.0) } else { sigma * 4.0 };
        }
        Err(StopReason::Singular)
    }

    /// Moves `state` to an equilibrium, and leaves residual, energies and reactions assembled there.
    pub fn solve(
        &mut self,
        elements: &[ElementData],
        supports: &mut Supports,
        external: &mut dyn External<C>,
        state: &mut RodState,
        options: &NewtonOptions,
    ) -> NewtonReport {
        let l = Layout::<C>;
        let multipliers = elements.len() + supports.conditions();
        let mut report = NewtonReport {
            iterations: 0,
            residual: f64::INFINITY,
            inertia: Inertia::default(),
            multipliers,
            stable: false,
            converged: false,
            reason: StopReason::MaxIterations,
        };
        self.trial.copy_from(state);
        self.other.copy_from(state);
        self.steps.clear();
        let whisper = Self::whisper(elements);
        Assembly::<C>::unit_shift(elements, &supports.held::<C>(), &mut self.unit_shift);
        let mut last_turn = f64::INFINITY;
        let mut shift = 0.0f64;
        let mut penalty = [0.0f64; 2];
        let mut best = f64::INFINITY;
        // A device in its own shape stores nothing, as the difference of terms of this size.
        let straightening: f64 = elements.iter().map(ElementData::straightening_energy).sum();
        let mut stalled = 0;
        let mut assembled = false;
        let mut trusting = true;
        loop {
            if !std::mem::take(&mut assembled) {
                self.assembly.hessian = !residual_alone(last_turn, options.tolerance);
                self.assemble_parts(elements, supports, external, state);
            }
            let mut size = self.residual(elements, external, supports, options.tolerance);
            // Where steps no longer shrink a residual, it takes the matrix of the state itself to say so: with factors from
            // before a contact opened or closed, steps may lead to and fro for ever.
            let shrinks = size.relative < 0.5 * best;
            let enough = shrinks && CHORD * last_turn * size.relative <= options.tolerance;
            if !self.assembly.hessian && !size.small && !enough {
                self.assemble(elements, supports, external, state);
                size = self.residual(elements, external, supports, options.tolerance);
            }
            let residual = size.relative;
            report.residual = residual;
            if !residual.is_finite() {
                report.reason = StopReason::NotFinite;
                return report;
            }
            stalled = if residual < 0.5 * best { 0 } else { stalled + 1 };
            best = best.min(residual);
            let tiny_steps = self.steps.len() >= 3
                && self
                    .steps
                    .iter()
                    .rev()
                    .take(3)
                    .all(|s| s.energy_change.abs() <= ENERGY_ROUNDING * s.energy_scale);
            let floor = (size.rounding && stalled >= 1) || (stalled >= 3 && tiny_steps && residual < 1e-6);
            let arrived = size.small || floor;

            // Loads without potential make the stiffness unsymmetric: its symmetric part says nothing about minima.
            let follows = !external.conservative();
            let minimum = options.minimum && !follows;
            let wanted = minimum.then_some(multipliers);
            let (sigma, natural) = if self.assembly.hessian {
                match self.factor_shifted(whisper, shift, arrived, wanted) {
                    Ok(found) => found,
                    Err(reason) => {
                        report.reason = reason;
                        return report;
                    }
                }
            } else {
                self.right_hand_side();
                self.factor.solve(&mut self.step);
                (0.0, Some(self.factor.inertia()))
            };
            shift = sigma;
            if arrived {
                if let Some(inertia) = natural {
                    report.inertia = inertia;
                    report.stable = inertia.negative == multipliers;
                    if follows {
                        // Divergence: the sign of the determinant of the whole, unsymmetric matrix.
                        let sign = self.unsymmetric();
                        report.stable =
                            sign != 0.0 && (sign < 0.0) == ((inertia.negative + multipliers) % 2 == 1);
                    }
                }
                if report.stable || !minimum {
                    report.converged = true;
                    report.reason =
                        if size.small { StopReason::Converged } else { StopReason::RoundingFloor };
                    return report;
                }
            }
            if report.iterations >= options.max_iterations {
                report.reason = StopReason::MaxIterations;
                return report;
            }
            report.iterations += 1;

            if arrived {
                // A saddle: leave it along the most negative curvature.
                self.negative_curvature(elements, supports, state);
                let record = self.leave(elements, supports, external, state);
                match record {
                    Some(step) => {
                        last_turn = f64::INFINITY;
                        self.steps.push(StepRecord { residual, shift, ..step });
                    }
                    None => {
                        // A negative curvature that gains nothing: as good as neutral, but no minimum.
                        report.iterations -= 1;
                        report.converged = true;
                        report.reason =
                            if size.small { StopReason::Converged } else { StopReason::RoundingFloor };
                        return report;
                    }
                }
                (best, stalled) = (f64::INFINITY, 0);
                continue;
            }

            self.unsymmetric();
            Self::restore_tensions(elements, &mut self.step);
            let first = l.support(elements.len());
            let gaps = supports.gaps(state);
            // Multipliers take their full step: they are estimates at this state, however far it moves.
            for j in 0..6 {
                let value = supports.multipliers[j] + self.step[first + j];
                let kind = usize::from(j >= 3);
                penalty[kind] = penalty[kind].max(2.0 * value.abs());
            }
            let weigh = |gaps: &[f64; 6]| -> f64 {
                penalty[0] * (gaps[0].abs() + gaps[1].abs() + gaps[2].abs())
                    + penalty[1] * (gaps[3].abs() + gaps[4].abs() + gaps[5].abs())
            };
            let mut slope = 0.0;
            for i in 0..first {
                slope += self.assembly.residual[i] * self.step[i];
            }
            for e in 0..elements.len() {
                let row = l.tension(e);
                slope -= self.assembly.residual[row] * self.step[row];
            }
            for j in 0..6 {
                slope += supports.multipliers[j] * gaps[j];
            }
            let weighed = weigh(&gaps);
            slope -= weighed;

            let (turn, _) = RodState::largest_turn::<C>(elements, state, &self.step);
            if !turn.is_finite() {
                report.reason = StopReason::NotFinite;
                return report;
            }
            let mut alpha = if turn > options.max_turn { options.max_turn / turn } else { 1.0 };
            let stored = self.assembly.energy;
            let before = stored.total() + self.assembly.external_energy;
            let energy_scale = stored.total().abs()
                + self.assembly.external_energy.abs()
                + weighed
                + slope.abs()
                + straightening;
            let rounding = ENERGY_ROUNDING * energy_scale;
            let record = |energy_change: f64, merit_change: f64, fraction: f64| StepRecord {
                energy_change,
                merit_change,
                energy_scale,
                residual,
                fraction,
                shift,
            };
            // What a step gains that is less than rounding, the energies need not be asked for.
            let blind =
                minimum && supports.conditions() == 0 && turn <= SHORT && slope <= 0.0 && -slope <= rounding;
            // Only where Newton's own step is taken, and the matrix says that it leads to a minimum. Axial forces stiffen the
            // rod against bending over its length.
            let newtons_turn = if minimum && shift == 0.0 && supports.conditions() == 0 {
                let pulled =
                    (0..elements.len()).fold(0.0f64, |most, e| most.max(self.step[l.tension(e)].abs()));
                turn.max(STIFFENING * pulled * WHISPER / whisper)
            } else {
                f64::INFINITY
            };
            let turn_of = |fraction: f64| if fraction == 1.0 { newtons_turn } else { f64::INFINITY };
            // Where the last step's first trial was taken this one's nearly always is: the energy is asked for together with what
            // the next iteration begins with.
            let bold = trusting && supports.conditions() == 0 && !follows && external.memoryless();
            let mut accepted = None;
            let mut refused = None;
            let old_multipliers = supports.multipliers;
            for j in 0..6 {
                supports.multipliers[j] += self.step[first + j];
            }
            for attempt in 0..24 {
                assembled = false;
                self.trial.advance::<C>(elements, state, &self.step, alpha);
                for _ in 0..4 {
                    let safe = external.safe_fraction(elements, &self.trial);
                    if safe >= 1.0 {
                        break;
                    }
                    alpha *= safe;
                    self.trial.advance::<C>(elements, state, &self.step, alpha);
                }
                if supports.conditions() > 0 {
                    self.correct(elements, supports, first);
                }
                self.trial.take_tensions::<C>(elements, state, &self.step);
                if blind {
                    let change = alpha * (1.0 - 0.5 * alpha) * slope;
                    accepted = Some(record(change, change, alpha));
                    break;
                }
                let bold = bold && attempt == 0;
                trusting = attempt == 0;
                let energy_change = if bold {
                    assembled = true;
                    self.assembly.hessian = !residual_alone(turn_of(alpha), options.tolerance);
                    let trial = std::mem::take(&mut self.trial);
                    self.assemble_parts(elements, supports, external, &trial);
                    self.trial = trial;
                    self.assembly.energy.total() + self.assembly.external_energy - before
                } else {
                    self.energy(elements, external, state) - before
                };
                let change = energy_change + weigh(&supports.gaps(&self.trial)) - weighed;
                let enough = change <= 1e-4 * alpha * slope.min(0.0) + rounding;
                // On a path of unstable states the energy says nothing; steps there are short and Newton's own.
                if !options.minimum && change.is_finite() {
                    accepted = Some(record(energy_change, change, alpha));
                    break;
                }
                // Where loads have no potential a smaller residual is as good; it costs an assembly, so it is asked last.
                let accept = change.is_finite()
                    && (enough
                        || follows && {
                            assembled = true;
                            let trial = std::mem::take(&mut self.trial);
                            self.assemble(elements, supports, external, &trial);
                            self.trial = trial;
                            let found =
                                self.residual(elements, external, supports, options.tolerance).relative;
                            found < 0.9 * residual || (attempt > 6 && found < 2.0 * residual)
                        });
                if accept {
                    let (mut energy_change, mut change) = (energy_change, change);
                    if let Some(refused) = refused {
                        (alpha, energy_change) = self.reach_wall(
                            elements,
                            external,
                            state,
                            before,
                            (alpha, refused, energy_change),
                        );
                        (change, assembled) = (energy_change, false);
                    }
                    accepted = Some(record(energy_change, change, alpha));
                    break;
                }
                if bold {
                    self.assembly.hessian = false;
                    self.assemble_parts(elements, supports, external, state);
                }
                if external.obstructs() {
                    refused = Some(alpha);
                }
                // Minimum of the parabola through value, slope and trial value.
                let curve = change - slope * alpha;
                let parabola = if curve > 0.0 { -0.5 * slope * alpha / curve } else { 0.5 };
                alpha *= if parabola.is_finite() { parabola.clamp(0.1, 0.6) } else { 0.1 };
            }
            let Some(record) = accepted else {
                supports.multipliers = old_multipliers;
                if follows {
                    self.assemble(elements, supports, external, state);
                }
                report.reason = if best < 1e-6 { StopReason::RoundingFloor } else { StopReason::NoDescent };
                report.converged = best < 1e-6;
                if let Some(inertia) = natural {
                    report.inertia = inertia;
                    report.stable = inertia.negative == multipliers;
                }
                return report;
            };
            last_turn = turn_of(record.fraction);
            self.steps.push(record);
            std::mem::swap(state, &mut self.trial);
            supports.follow(state);
        }
    }
}

/// Whether a whole step of Newton's method that turned nodes by no more than `last_turn` ends so near to the equilibrium that the
/// residual alone is looked at.
fn residual_alone(last_turn: f64, tolerance: f64) -> bool {
    last_turn <= SHORT || (last_turn <= NEAR && QUADRATIC * last_turn * last_turn <= tolerance)
}
