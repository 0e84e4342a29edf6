//! Newton's method on the rod's potential energy, globalised to find minima.
//!
//! The merit is the potential energy itself: a step moves along the constraint manifold (see [`RodState::advance`]),
//! so no constraint violation has to be penalised. Contacts add a merit of their own, and every step includes the
//! contacts active at its end (`contacts.rs`). Where the far end is held, the errors of its conditions are added with
//! a weight above the reactions (an exact penalty), after second-order corrections that re-use the factorisation;
//! once the conditions hold the merit is the energy again. Every accepted step lowers the merit.
//!
//! Each iteration assembles and factors the matrix and checks its inertia. Minima have one negative pivot per
//! multiplier; if there are more, the stiffness of a uniform tension ([`Assembly::unit_shift`]) is added until the
//! number is right, so every step descends. From an equilibrium that is not a minimum the method descends along the
//! direction of most negative curvature (inverse iteration with the shifted factor). A tiny shift is always present,
//! as regularisation: it makes states that can turn freely (a buckled column about its axis) solvable and does not
//! change the result, since the residual is never shifted.

use super::external::External;
use super::factors::Factors;
use super::line_search::LineSearch;
use super::neighbourhood::Neighbourhood;
use super::report::{NewtonOptions, NewtonReport, StepRecord, StopReason};
use super::residual::ResidualSize;
use super::stop::Progress;
use crate::banded::{Inertia, Shift};
use crate::rod::{Assembly, ElementData, Layout, RodState, Supports};
use crate::tuning::NewtonTuning;

/// Changes of energy below this fraction of the energies' magnitude are rounding.
pub(super) const ENERGY_ROUNDING: f64 = 1e-13;
/// Number of steps of a solution that are recorded without allocation.
const STEPS: usize = 1024;

/// Newton's method and its memory, for rods of one size. Iterations do not allocate.
#[derive(Debug, Clone)]
pub(crate) struct Newton<const C: usize> {
    /// The system at the current state.
    pub assembly: Assembly<C>,
    /// Residual rows of the first two nodes before the first node was held: its reactions.
    pub start_residual: [f64; C],
    pub(super) unit_shift: Shift,
    /// Shift of the last shifted step, reduced in each iteration since.
    pub(crate) last_shift: f64,
    pub(super) factor: Factors<C>,
    pub(super) step: Vec<f64>,
    pub(super) spare: Vec<f64>,
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) trial: RodState,
    pub(super) other: RodState,
    /// The steps of the last solution.
    pub steps: Vec<StepRecord>,
    /// Linear solves of the last solution.
    pub(super) solves: usize,
    /// The neighbourhood in which solutions are sought.
    pub(crate) neighbourhood: Neighbourhood,
    /// Numbers of the solution under way, or of the last one.
    pub(super) tuning: NewtonTuning,
}

impl<const C: usize> Newton<C> {
    /// Allocates for a rod of `elements` elements.
    pub(crate) fn new(elements: usize) -> Self {
        let n = Layout::<C>::dimension(elements);
        Self {
            assembly: Assembly::new(elements),
            start_residual: [0.0; C],
            unit_shift: Shift::default(),
            last_shift: 0.0,
            factor: Factors::new(n),
            step: vec![0.0; n],
            spare: vec![0.0; n],
            columns: Vec::new(),
            trial: RodState::default(),
            other: RodState::default(),
            steps: Vec::with_capacity(STEPS),
            solves: 0,
            neighbourhood: Neighbourhood::default(),
            tuning: NewtonTuning::DEFAULT,
        }
    }

    /// Allocates for rods of up to `elements` elements.
    pub(crate) fn reserve(&mut self, elements: usize) {
        let now = self.trial.elements();
        self.resize(elements);
        self.resize(now);
        self.trial.reserve(elements);
        self.other.reserve(elements);
        self.neighbourhood.reserve(elements, Layout::<C>::ANGLES.max(1));
    }

    /// Changes the size without releasing memory.
    pub(crate) fn resize(&mut self, elements: usize) {
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
    pub(crate) fn assemble(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        external: &mut dyn External,
        state: &RodState,
    ) {
        self.assembly.hessian = true;
        self.assemble_parts(elements, supports, external, state);
    }

    /// Assembles the forces at `state` without the matrix; what was factored before stays.
    pub(crate) fn assemble_forces(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        external: &mut dyn External,
        state: &RodState,
    ) {
        self.assembly.hessian = false;
        self.assemble_parts(elements, supports, external, state);
    }

    /// Assembles the system at `state`, without the matrix unless the assembly wants it.
    pub(super) fn assemble_parts(
        &mut self,
        elements: &[ElementData],
        supports: &Supports,
        external: &mut dyn External,
        state: &RodState,
    ) {
        self.assembly.assemble(elements, state);
        external.linearise(elements, state, &mut self.assembly);
        supports.add(elements, state, &mut self.assembly);
        for (k, value) in self.start_residual.iter_mut().enumerate() {
            *value = self.assembly.residual.get(k).copied().unwrap_or(0.0);
        }
        supports.hold(&mut self.assembly);
    }

    /// Moves `state` to an equilibrium; residual, energies and reactions are assembled there.
    pub(crate) fn solve(
        &mut self,
        elements: &[ElementData],
        supports: &mut Supports,
        external: &mut dyn External,
        state: &mut RodState,
        options: &NewtonOptions,
    ) -> NewtonReport {
        (self.solves, self.tuning) = (0, options.tuning);
        // Loads without potential make the stiffness unsymmetric: the inertia of its symmetric part does not indicate
        // minima.
        let minimum = options.minimum && external.is_conservative();
        let problem = Problem { elements, supports, external, options, minimum };
        let report = self.iterate(problem, state);
        NewtonReport { solves: self.solves, ..report }
    }

    fn iterate(&mut self, mut problem: Problem<'_>, state: &mut RodState) -> NewtonReport {
        let (elements, options, minimum) = (problem.elements, problem.options, problem.minimum);
        let supports = &*problem.supports;
        let mut report = NewtonReport::of(problem.multipliers());
        self.trial.copy_from(state);
        self.other.copy_from(state);
        self.steps.clear();
        Assembly::<C>::unit_shift(elements, &supports.held::<C>(), &mut self.unit_shift);
        let mut progress = Progress::new(&options.tuning);
        let mut search = LineSearch::new(elements);
        let mut shift = 0.0;
        self.last_shift = options.last_shift;
        // Whether the last state was an equilibrium except for contacts or lagged friction.
        let mut renewed = false;
        loop {
            let size =
                self.residual_at(&mut problem, state, &progress, std::mem::take(&mut search.assembled));
            report.residual = size.relative;
            if !size.relative.is_finite() {
                return report.stopped(StopReason::NotFinite);
            }
            let mut arrived = progress.has_arrived(&size, options.tolerance, &self.steps);
            if arrived && !problem.settles() {
                if report.iterations >= options.max_iterations {
                    return report.stopped(StopReason::Unsettled);
                }
                progress = Progress::new(&options.tuning);
                // If renewing the base does not settle the contacts, take a step: contact forces change only in
                // steps.
                if !std::mem::replace(&mut renewed, true) {
                    report.iterations += 1;
                    continue;
                }
                arrived = false;
            }
            renewed = false;
            if self.solves >= options.max_solves {
                return report.stopped(StopReason::MaxIterations);
            }
            let natural = match self.descent_step(&problem, &mut shift, arrived) {
                Ok(inertia) => inertia,
                Err(reason) => return report.stopped(reason),
            };
            if arrived {
                self.judge(&problem, natural, &mut report);
                if report.stable || !minimum {
                    return report.converged(size.reason());
                }
            }
            if report.iterations >= options.max_iterations {
                return report.stopped(StopReason::MaxIterations);
            }
            if arrived {
                // A saddle: descend along the most negative curvature. Without a decrease it is practically neutral,
                // but not a minimum.
                self.negative_curvature(elements, problem.supports, state);
                let Some(step) = self.leave(elements, problem.supports, problem.external, state) else {
                    return report.converged(size.reason());
                };
                self.steps.push(StepRecord { residual: size.relative, shift, ..step });
                progress = Progress::new(&options.tuning);
                report.iterations += 1;
                continue;
            }
            report.iterations += 1;
            self.unsymmetric();
            Self::restore_tensions(elements, &mut self.step);
            let searched =
                self.meet_contacts(&mut problem, state, &mut search, &mut shift).and_then(|contacts| {
                    let step = (size.relative, shift);
                    self.line_search(&mut problem, state, &mut search, step, &contacts)
                });
            if shift > 0.0 {
                self.neighbourhood.is_at_a_saddle();
            }
            self.last_shift = shift.max(self.tuning.shift_decay * self.last_shift);
            match searched {
                Ok(_) if state.is_folded(elements) => return report.stopped(StopReason::Folded),
                Ok(_) if self.neighbourhood.is_left_by(state, &self.tuning) => {
                    return report.stopped(StopReason::Left);
                }
                Ok(turn) => progress.has_turned(turn),
                Err(StopReason::NoDescent) => {
                    return self.without_descent(&mut problem, state, &progress, natural, report);
                }
                Err(reason) => return report.stopped(reason),
            }
        }
    }

    /// Assembles `state`, unless `assembled`, and measures its residual. The matrix is left out if the residual is
    /// expected to be small enough, and assembled if it turns out not to be.
    fn residual_at(
        &mut self,
        problem: &mut Problem<'_>,
        state: &RodState,
        progress: &Progress,
        assembled: bool,
    ) -> ResidualSize {
        let Problem { elements, supports, external, options, .. } = problem;
        if !assembled {
            self.assembly.hessian = progress.wants_hessian(options.tolerance);
            self.assemble_parts(elements, supports, *external, state);
        }
        let size = self.residual(elements, *external, supports, options.tolerance);
        if self.assembly.hessian || size.small || progress.shrinks_enough(&size, options.tolerance) {
            return size;
        }
        self.assemble(elements, supports, *external, state);
        self.residual(elements, *external, supports, options.tolerance)
    }

    /// Solves for the descent step from the assembled state and its `shift`; returns the inertia of the unshifted
    /// matrix, if known.
    fn descent_step(
        &mut self,
        problem: &Problem<'_>,
        shift: &mut f64,
        arrived: bool,
    ) -> Result<Option<Inertia>, StopReason> {
        if !self.assembly.hessian {
            // At an equilibrium only the inertia is needed.
            if !arrived {
                self.right_hand_side();
                self.factor.solve(&mut self.step);
            }
            *shift = 0.0;
            return Ok(Some(self.factor.inertia()));
        }
        let (sigma, natural) = self.factor_shifted(problem)?;
        *shift = sigma;
        Ok(natural)
    }

    /// Reports whether an equilibrium with this inertia is stable.
    fn judge(&mut self, problem: &Problem<'_>, natural: Option<Inertia>, report: &mut NewtonReport) {
        let Some(inertia) = natural else { return };
        report.inertia = inertia;
        report.stable = inertia.negative == report.multipliers;
        if !problem.external.is_conservative() {
            // Divergence: the sign of the determinant of the whole, unsymmetric matrix.
            let sign = self.unsymmetric();
            let odd = (inertia.negative + report.multipliers) % 2 == 1;
            report.stable = sign != 0.0 && (sign < 0.0) == odd;
        }
    }

    /// No step lowers the energy: the state is an equilibrium to rounding, or the method has failed.
    fn without_descent(
        &mut self,
        problem: &mut Problem<'_>,
        state: &RodState,
        progress: &Progress,
        natural: Option<Inertia>,
        mut report: NewtonReport,
    ) -> NewtonReport {
        let Problem { elements, supports, external, .. } = problem;
        if !external.is_conservative() {
            self.assemble(elements, supports, *external, state);
        }
        if let Some(inertia) = natural {
            report.inertia = inertia;
            report.stable = inertia.negative == report.multipliers;
        }
        if progress.is_at_rounding() {
            report.converged(StopReason::RoundingFloor)
        } else {
            report.stopped(StopReason::NoDescent)
        }
    }
}

/// The problem to be solved.
pub(super) struct Problem<'a> {
    pub(super) elements: &'a [ElementData],
    pub(super) supports: &'a mut Supports,
    pub(super) external: &'a mut dyn External,
    pub(super) options: &'a NewtonOptions,
    /// Whether a minimum is sought and can exist.
    pub(super) minimum: bool,
}

impl Problem<'_> {
    /// Whether an equilibrium is valid for the contacts, if there are any.
    fn settles(&mut self) -> bool {
        let tolerance = self.options.tolerance;
        let mut settles = true;
        // All are asked, since those that pull let go then.
        self.external.visit_contacts(&mut |contacts| settles &= contacts.settled(tolerance));
        settles
    }

    /// Negative pivots of a minimum: one for each multiplier.
    pub(super) fn multipliers(&self) -> usize {
        self.elements.iter().filter(|data| !data.is_break()).count() + self.supports.conditions()
    }
}
