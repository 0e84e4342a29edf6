//! Newton's method on the rod's potential energy, globalised to find minima.
//!
//! The merit is the potential energy itself: a step moves along the constraint manifold (see
//! [`RodState::advance`]), so nothing has to be weighed against it. Where the far end is held, the distance from its
//! conditions is added with a weight above the reactions (an exact penalty), after second-order corrections that
//! re-use the factorisation; once the conditions hold the merit is the energy again. Every accepted step lowers the merit.
//!
//! Each iteration: assemble, factor, look at the inertia. Minima have one negative pivot per multiplier; with more the
//! matrix is shifted by the stiffness of a uniform tension ([`Assembly::add_shift`]) until they are right, so every
//! step descends. At an equilibrium that is not a minimum the method leaves along the direction of most negative
//! curvature (inverse iteration with the shifted factor). A whisper of the shift stays on always: it makes states that
//! can turn freely (a buckled column about its axis) solvable and cannot be seen in the result, since the
//! residual is never shifted.

use super::band::{BandMatrix, Factor, Inertia};
use crate::rod::element::element_energy;
use crate::rod::{Assembly, ElementData, Layout, RodState, Supports};

/// Energies outside the rod: loads, walls.
pub trait External<const C: usize> {
    /// Potential energy at a state.
    fn energy(&mut self, elements: &[ElementData], state: &RodState) -> f64;
    /// Adds gradient, Hessian and energy at a state to the assembly.
    fn add(&mut self, elements: &[ElementData], state: &RodState, assembly: &mut Assembly<C>);
    /// Work done on the way between two states by loads that have no potential.
    fn work(&self, _from: &RodState, _to: &RodState) -> f64 {
        0.0
    }
    /// Whether all of it has a potential. Where not, the stiffness is unsymmetric and there are no minima to look for.
    fn conservative(&self) -> bool {
        true
    }
    /// Whether it can stop a step short, as a wall does.
    fn obstructs(&self) -> bool {
        false
    }
    /// Part of the way from the state last given to [`External::add`] to `to` that crosses nothing.
    fn safe_fraction(&mut self, _elements: &[ElementData], _to: &RodState) -> f64 {
        1.0
    }
    /// Size of the forces and moments it exerts, for the scale of the residual.
    fn scale(&self) -> [f64; 2] {
        [0.0; 2]
    }
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Iterations (factorisations with a step) allowed.
    pub max_iterations: usize,
    /// Residual over force scale below which a state is an equilibrium.
    pub tolerance: f64,
    /// Largest rotation of a node in one step, in radians.
    pub max_turn: f64,
    /// Whether to look for a minimum (or take any equilibrium, as continuation does).
    pub minimum: bool,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self { max_iterations: 500, tolerance: 1e-10, max_turn: 1.0, minimum: true }
    }
}

/// Why Newton's method stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The residual is below its tolerance.
    Converged,
    /// The residual is as small as rounding lets it be on this mesh.
    RoundingFloor,
    /// The iterations allowed are used up.
    MaxIterations,
    /// No step along the search direction lowers the merit.
    NoDescent,
    /// The matrix stayed singular or of wrong inertia under every shift.
    Singular,
    /// The state or the matrix holds a number that is not finite.
    NotFinite,
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Converged => "converged",
            Self::RoundingFloor => "converged to rounding level",
            Self::MaxIterations => "iterations used up",
            Self::NoDescent => "no step lowers the energy",
            Self::Singular => "the stiffness matrix is singular",
            Self::NotFinite => "a number is not finite",
        })
    }
}

/// One accepted step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepRecord {
    /// Change of the potential energy.
    pub energy_change: f64,
    /// Change of the merit: the energy, plus the weighted gaps of the end conditions.
    pub merit_change: f64,
    /// Size of the energies the change is a difference of; changes below 1e-13 of it are rounding.
    pub energy_scale: f64,
    /// Relative residual before the step.
    pub residual: f64,
    /// Part of the Newton step taken.
    pub fraction: f64,
    /// Shift used.
    pub shift: f64,
}

/// How a solution was found.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonReport {
    /// Steps taken.
    pub iterations: usize,
    /// Relative residual of the final state.
    pub residual: f64,
    /// Inertia of the final matrix.
    pub inertia: Inertia,
    /// Negative pivots a minimum has.
    pub multipliers: usize,
    /// Whether the final state is a minimum (neutral directions allowed).
    pub stable: bool,
    /// Whether the final state is an equilibrium.
    pub converged: bool,
    /// Why the method stopped.
    pub reason: StopReason,
    /// The accepted steps.
    pub steps: Vec<StepRecord>,
}

/// Part of EI/L² that is always added as a uniform tension.
const WHISPER: f64 = 1e-8;
/// Changes of energy below this part of the energies' size are rounding.
const ENERGY_ROUNDING: f64 = 1e-13;
/// Halvings towards the minimum along a step that a wall cut short.
const REFINEMENTS: usize = 12;
/// Largest number of unsymmetric rank-one terms.
const MAX_RANK: usize = 24;

/// Newton's method with its memory, for rods of one size. Nothing is allocated per iteration.
#[derive(Debug, Clone)]
pub struct Newton<const C: usize> {
    /// The system at the current state.
    pub assembly: Assembly<C>,
    /// Residual rows of the first node before they were held: its reactions.
    pub start_residual: [f64; 8],
    shifted: BandMatrix<C>,
    factor: Factor<C>,
    step: Vec<f64>,
    spare: Vec<f64>,
    columns: Vec<Vec<f64>>,
    trial: RodState,
    other: RodState,
}

impl<const C: usize> Newton<C> {
    /// Room for a rod of `elements` elements.
    pub fn new(elements: usize) -> Self {
        let n = Layout::<C>::dimension(elements);
        Self {
            assembly: Assembly::new(elements),
            start_residual: [0.0; 8],
            shifted: BandMatrix::zeros(n),
            factor: Factor::new(n),
            step: vec![0.0; n],
            spare: vec![0.0; n],
            columns: Vec::new(),
            trial: RodState::default(),
            other: RodState::default(),
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
        self.shifted.copy_from(&self.assembly.matrix);
        Assembly::add_shift(&mut self.shifted, elements, sigma);
        supports.hold_rows(&mut self.shifted);
        self.factor.factor(&self.shifted).ok()
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

    /// Relative residual of the assembled system, and whether it is below `tolerance` or rounding in every row.
    pub fn relative_residual(
        &self,
        elements: &[ElementData],
        external: &dyn External<C>,
        supports: &Supports,
        tolerance: f64,
    ) -> (f64, bool) {
        self.residual(elements, external, supports, tolerance)
    }

    /// The shift that is always on.
    pub fn whisper(elements: &[ElementData]) -> f64 {
        let length: f64 = elements.iter().map(|e| e.length).sum();
        // EI averaged as springs in series: the stiffness the whole rod shows.
        let soft: f64 = elements.iter().map(|e| e.length / e.bending[1]).sum();
        WHISPER / (length * soft)
    }

    /// Moves `state` to an equilibrium.
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
        let whisper = Self::whisper(elements);
        let mut report = NewtonReport {
            iterations: 0,
            residual: f64::INFINITY,
            inertia: Inertia::default(),
            multipliers,
            stable: false,
            converged: false,
            reason: StopReason::MaxIterations,
            steps: Vec::with_capacity(options.max_iterations.min(1024)),
        };
        self.trial.copy_from(state);
        self.other.copy_from(state);
        let mut shift = 0.0f64;
        let mut penalty = [0.0f64; 2];
        let mut best = f64::INFINITY;
        let mut stalled = 0;
        loop {
            self.assemble(elements, supports, external, state);
            let (residual, small) = self.residual(elements, external, supports, options.tolerance);
            report.residual = residual;
            if !residual.is_finite() {
                report.reason = StopReason::NotFinite;
                return report;
            }
            stalled = if residual < 0.5 * best { 0 } else { stalled + 1 };
            best = best.min(residual);
            let tiny_steps = report.steps.len() >= 3
                && report
                    .steps
                    .iter()
                    .rev()
                    .take(3)
                    .all(|s| s.energy_change.abs() <= ENERGY_ROUNDING * s.energy_scale);
            let floor = stalled >= 3 && tiny_steps && residual < 1e-6;
            let arrived = small || floor;

            // Loads without potential make the stiffness unsymmetric: its symmetric part says nothing about minima.
            let follows = !external.conservative();
            let minimum = options.minimum && !follows;
            // Factor, with a shift until the inertia is right.
            let mut sigma = if arrived || shift < 8.0 * whisper { 0.0 } else { shift / 8.0 };
            let mut tries = 0;
            let mut natural = None;
            loop {
                for (s, (r, c)) in
                    self.step.iter_mut().zip(self.assembly.residual.iter().zip(&self.assembly.correction))
                {
                    *s = -(r + c);
                }
                self.shifted.copy_from(&self.assembly.matrix);
                Assembly::add_shift(&mut self.shifted, elements, whisper + sigma);
                supports.hold_rows(&mut self.shifted);
                let found = self.factor.factor_solve(&self.shifted, &mut self.step);
                if sigma == 0.0 {
                    natural = found.ok();
                }
                match found {
                    Ok(inertia) if inertia.negative == multipliers || !minimum => break,
                    Err(super::band::FactorError::NotFinite { .. }) if tries > 20 => {
                        report.reason = StopReason::NotFinite;
                        return report;
                    }
                    _ => {}
                }
                tries += 1;
                if tries > 60 {
                    report.reason = StopReason::Singular;
                    return report;
                }
                sigma = if sigma == 0.0 { (1e5 * whisper).max(shift / 8.0) } else { sigma * 4.0 };
            }
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
                    report.reason = if small { StopReason::Converged } else { StopReason::RoundingFloor };
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
                    Some(step) => report.steps.push(StepRecord { residual, shift, ..step }),
                    None => {
                        report.reason = StopReason::NoDescent;
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
            let energy_scale =
                stored.total().abs() + self.assembly.external_energy.abs() + weighed + slope.abs();
            let rounding = ENERGY_ROUNDING * energy_scale;
            let mut accepted = None;
            let mut refused = None;
            let old_multipliers = supports.multipliers;
            for j in 0..6 {
                supports.multipliers[j] += self.step[first + j];
            }
            for attempt in 0..24 {
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
                self.tensions(elements, state);
                let energy_change = self.energy(elements, external, state) - before;
                let change = energy_change + weigh(&supports.gaps(&self.trial)) - weighed;
                let enough = change <= 1e-4 * alpha * slope.min(0.0) + rounding;
                // On a path of unstable states the energy says nothing; steps there are short and Newton's own.
                if !options.minimum && change.is_finite() {
                    accepted = Some(StepRecord {
                        energy_change,
                        merit_change: change,
                        energy_scale,
                        residual,
                        fraction: alpha,
                        shift,
                    });
                    break;
                }
                // Where loads have no potential a smaller residual is as good; it costs an assembly, so it is asked last.
                let accept = change.is_finite()
                    && (enough
                        || follows && {
                            let trial = std::mem::take(&mut self.trial);
                            self.assemble(elements, supports, external, &trial);
                            self.trial = trial;
                            let (found, _) = self.residual(elements, external, supports, options.tolerance);
                            found < 0.9 * residual || (attempt > 6 && found < 2.0 * residual)
                        });
                if accept {
                    // A wall hit on the way: the energy falls up to it and rises steeply beyond. The minimum between the
                    // last refusal and here lies in touch with it; short of it the next step would meet it again.
                    let (mut energy_change, mut change) = (energy_change, change);
                    if let Some(refused) = refused {
                        let (mut low, mut high) = (alpha, refused);
                        for _ in 0..REFINEMENTS {
                            let middle = 0.5 * (low + high);
                            self.trial.advance::<C>(elements, state, &self.step, middle);
                            self.tensions(elements, state);
                            let trial_change = self.energy(elements, external, state) - before;
                            if trial_change < energy_change {
                                low = middle;
                                (alpha, energy_change, change) = (middle, trial_change, trial_change);
                            } else {
                                high = middle;
                            }
                        }
                        self.trial.advance::<C>(elements, state, &self.step, alpha);
                        self.tensions(elements, state);
                    }
                    accepted = Some(StepRecord {
                        energy_change,
                        merit_change: change,
                        energy_scale,
                        residual,
                        fraction: alpha,
                        shift,
                    });
                    break;
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
                report.reason = if best < 1e-6 { StopReason::RoundingFloor } else { StopReason::NoDescent };
                report.converged = best < 1e-6;
                if let Some(inertia) = natural {
                    report.inertia = inertia;
                    report.stable = inertia.negative == multipliers;
                }
                return report;
            };
            report.steps.push(record);
            std::mem::swap(state, &mut self.trial);
            supports.follow(state);
        }
    }

    /// Axial forces of inextensible elements at the trial state: they are multipliers and take their full step. (Those of
    /// stretchable elements moved with the state.)
    fn tensions(&mut self, elements: &[ElementData], state: &RodState) {
        for (e, data) in elements.iter().enumerate() {
            if data.flexibility == 0.0 {
                self.trial.tensions[e] = state.tensions[e] + self.step[Layout::<C>.tension(e)];
            }
        }
    }

    /// Undoes the change of multiplier of [`crate::rod::assembly`]: dN = m/(1 − γD).
    fn restore_tensions(elements: &[ElementData], step: &mut [f64]) {
        for (e, data) in elements.iter().enumerate() {
            step[Layout::<C>.tension(e)] /= 1.0 - data.augmentation() * data.flexibility;
        }
    }

    /// Potential energy of the trial state, less the work done on the way from `state`.
    fn energy(&self, elements: &[ElementData], external: &mut dyn External<C>, state: &RodState) -> f64 {
        let mut stored = 0.0;
        for (e, data) in elements.iter().enumerate() {
            stored += element_energy(data, &self.trial.element(e), Layout::<C>::TWIST).total();
        }
        stored + external.energy(elements, &self.trial) - external.work(state, &self.trial)
    }

    /// Second-order corrections of the end conditions with the factorisation at hand.
    fn correct(&mut self, elements: &[ElementData], supports: &Supports, first: usize) {
        let mut last = f64::INFINITY;
        for _ in 0..4 {
            let gaps = supports.gaps(&self.trial);
            let size = gaps.iter().fold(0.0f64, |m, g| m.max(g.abs()));
            if size.is_nan() || size >= last || size < 1e-14 {
                break;
            }
            last = size;
            self.spare.fill(0.0);
            for j in 0..6 {
                self.spare[first + j] = -gaps[j];
            }
            self.factor.solve(&mut self.spare);
            Self::restore_tensions(elements, &mut self.spare);
            self.other.copy_from(&self.trial);
            let (turn, _) = RodState::largest_turn::<C>(elements, &self.other, &self.spare);
            // A correction is small or it is none.
            if turn.is_nan() || turn > 0.3 {
                break;
            }
            self.trial.advance::<C>(elements, &self.other, &self.spare, 1.0);
            let after = supports.gaps(&self.trial).iter().fold(0.0f64, |m, g| m.max(g.abs()));
            if after.is_nan() || after >= size {
                std::mem::swap(&mut self.trial, &mut self.other);
                break;
            }
        }
    }

    /// Woodbury's formula for the unsymmetric rank-one terms: Newton's step stays exact. Returns the sign of
    /// det(I + QᵀS⁻¹P), the ratio of the determinants with and without them.
    fn unsymmetric(&mut self) -> f64 {
        let rank = self.assembly.rank_ones.len().min(MAX_RANK);
        let mut sign = 1.0;
        if rank == 0 {
            return sign;
        }
        while self.columns.len() < rank {
            self.columns.push(vec![0.0; self.step.len()]);
        }
        let terms = &self.assembly.rank_ones[..rank];
        let mut small = [[0.0; MAX_RANK + 1]; MAX_RANK];
        for (k, term) in terms.iter().enumerate() {
            let column = &mut self.columns[k];
            column.fill(0.0);
            column[term.row..term.row + 3].copy_from_slice(&term.p);
            self.factor.solve(column);
        }
        let along = |x: &[f64], k: usize| -> f64 {
            let t = &terms[k];
            (0..3).map(|a| t.q[a] * x[t.column + a]).sum()
        };
        for i in 0..rank {
            for j in 0..rank {
                small[i][j] = along(&self.columns[j], i) + f64::from(u8::from(i == j));
            }
            small[i][MAX_RANK] = along(&self.step, i);
        }
        // Gauss with partial pivoting.
        for k in 0..rank {
            let mut p = k;
            for i in k + 1..rank {
                if small[i][k].abs() > small[p][k].abs() {
                    p = i;
                }
            }
            if p != k {
                small.swap(k, p);
                sign = -sign;
            }
            if small[k][k].abs() < 1e-12 {
                return 0.0;
            }
            sign *= small[k][k].signum();
            for i in k + 1..rank {
                let f = small[i][k] / small[k][k];
                for j in k..=MAX_RANK {
                    small[i][j] -= f * small[k][j];
                }
            }
        }
        let mut x = [0.0; MAX_RANK];
        for k in (0..rank).rev() {
            let mut sum = small[k][MAX_RANK];
            for j in k + 1..rank {
                sum -= small[k][j] * x[j];
            }
            x[k] = sum / small[k][k];
        }
        for (k, value) in x[..rank].iter().enumerate() {
            for (s, c) in self.step.iter_mut().zip(&self.columns[k]) {
                *s -= value * c;
            }
        }
        sign
    }

    /// Relative residual, and whether it is below `tolerance` or rounding in every row.
    fn residual(
        &self,
        elements: &[ElementData],
        external: &dyn External<C>,
        supports: &Supports,
        tolerance: f64,
    ) -> (f64, bool) {
        let l = Layout::<C>;
        let n = elements.len();
        let length: f64 = elements.iter().map(|e| e.length).sum();
        let outside = external.scale();
        let held = supports.multipliers;
        let mut force = self.assembly.scale[0].max(outside[0]);
        force = held[..3].iter().fold(force, |m, v| m.max(v.abs()));
        let mut moment = self.assembly.scale[1].max(outside[1]);
        moment = held[3..].iter().fold(moment, |m, v| m.max(v.abs()));
        let mut relative = 0.0f64;
        let mut small = true;
        for i in 0..=n {
            let (a, b) = (&elements[i.saturating_sub(1)], &elements[i.min(n - 1)]);
            let h = a.length.min(b.length);
            let stiff = (a.bending[2] / (a.length * a.length)).max(b.bending[0] / (b.length * b.length));
            let forces = force + moment / length;
            let moments = moment + force * h;
            // What rounding of unit vectors leaves of a force 12 EI/h² δ and of a moment 6 EI/h δ.
            let floor = 100.0 * f64::EPSILON * stiff;
            let mut row = |value: f64, scale: f64, floor: f64| {
                let value = value.abs();
                if value.is_nan() || value > tolerance * scale + floor {
                    small = false;
                }
                let r =
                    if value <= 1e-3 * floor { 0.0 } else { value / (scale + floor / f64::EPSILON * 1e-16) };
                relative = if r.is_nan() || relative.is_nan() { f64::NAN } else { relative.max(r) };
            };
            for k in 0..3 {
                row(self.assembly.residual[l.position(i) + k], forces, floor);
            }
            for k in 0..2 {
                row(self.assembly.residual[l.tangent(i) + k], moments, floor * h);
            }
            if Layout::<C>::TWIST {
                row(self.assembly.residual[l.angle(i)], moments, floor * h);
                if i < n {
                    row(self.assembly.residual[l.bubble(i)], moments, floor * h);
                }
            }
        }
        let first = l.support(n);
        for j in 0..6 {
            let scale = if j < 3 { length } else { 1.0 };
            let value = self.assembly.residual[first + j].abs() / scale;
            if value.is_nan() || value > tolerance {
                small = false;
            }
            relative = if value.is_nan() || relative.is_nan() { f64::NAN } else { relative.max(value) };
        }
        (relative, small)
    }

    /// Replaces the step by the direction of most negative curvature: inverse iteration with the shifted factor.
    fn negative_curvature(&mut self, elements: &[ElementData], supports: &Supports, state: &RodState) {
        let l = Layout::<C>;
        let n = elements.len();
        let first = l.support(n);
        self.step.fill(0.0);
        // A start that is orthogonal to no mode: both directions across, no symmetry along the rod.
        for i in 0..=n {
            let s = (i as f64 + 0.37) / (n as f64 + 1.0);
            let frame = &state.frames[i];
            let w = frame.local(&crate::Vec3::new(0.31 + s, 0.83 - 0.6 * s * s, 0.29 + 0.4 * s));
            self.step[l.tangent(i)] = w.y;
            self.step[l.tangent(i) + 1] = w.z;
        }
        for _ in 0..6 {
            self.spare.fill(0.0);
            for i in 0..=n {
                let h = elements[i.min(n - 1)].length;
                for a in 0..2 {
                    let row = l.tangent(i) + a;
                    self.spare[row] = h * self.step[row];
                }
                if Layout::<C>::TWIST {
                    self.spare[l.angle(i)] = h * self.step[l.angle(i)];
                }
            }
            for row in supports.held::<C>().into_iter().flatten() {
                self.spare[row] = 0.0;
            }
            self.factor.solve(&mut self.spare);
            let size = self.spare[..first].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let scale = if size > 0.0 { 1.0 / size } else { 1.0 };
            for (s, v) in self.step.iter_mut().zip(&self.spare) {
                *s = v * scale;
            }
        }
        for value in &mut self.step[first..] {
            *value = 0.0;
        }
    }

    /// Moves along the negative curvature in `self.step`, as far as the energy falls.
    fn leave(
        &mut self,
        elements: &[ElementData],
        supports: &mut Supports,
        external: &mut dyn External<C>,
        state: &mut RodState,
    ) -> Option<StepRecord> {
        let l = Layout::<C>;
        let first = l.support(elements.len());
        let (turn, twist) = RodState::largest_turn::<C>(elements, state, &self.step);
        let unit = 0.5 / turn.max(twist).max(1e-300);
        let before = self.assembly.energy.total() + self.assembly.external_energy;
        let scale = self.assembly.energy.total().abs() + self.assembly.external_energy.abs();
        let mut alpha = unit;
        for _ in 0..20 {
            for sign in [1.0, -1.0] {
                self.trial.advance::<C>(elements, state, &self.step, sign * alpha);
                if supports.conditions() > 0 {
                    self.correct(elements, supports, first);
                }
                let change = self.energy(elements, external, state) - before;
                let gaps = supports.gaps(&self.trial);
                let closed = gaps.iter().all(|g| g.abs() < 1e-6);
                if change < 0.0 && closed {
                    self.trial.tensions.copy_from_slice(&state.tensions);
                    std::mem::swap(state, &mut self.trial);
                    supports.follow(state);
                    return Some(StepRecord {
                        energy_change: change,
                        merit_change: change,
                        energy_scale: scale,
                        residual: 0.0,
                        fraction: sign * alpha / unit,
                        shift: 0.0,
                    });
                }
            }
            alpha *= 0.5;
        }
        None
    }
}
