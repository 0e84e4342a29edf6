//! The course of a vessel that yields to the device in it.
//!
//! Device and course are in equilibrium together: with the device's x, the course's a, the wall's energy φ of the
//! places yᵢ = xᵢ − Wᵢ a relative to the vessel, and the vessel's V = ½ aᵀ A a ([`crate::vessel::Course`]),
//!
//! ```text
//! R(x, a) = 0,    A a = p(x, a),    p = Σ Wᵢᵀ gᵢ,    gᵢ = ∂φ/∂yᵢ
//! ```
//!
//! The device's equilibrium is sought with the course held, by all that a rigid vessel needs; then the course follows
//! by Newton's method on its own few unknowns, in which the device responds. With the device's stiffness K, which has been
//! factored, and Hᵢ = ∂gᵢ/∂yᵢ,
//!
//! ```text
//! Z = −K⁻¹ Σ Nᵢᵀ (Hᵢ Wᵢ + Qᵢ),    dx = −Z da,    Qᵢ = F⁻ᵀ Pᵢ
//! M = −dp/da = Σ [Wᵢᵀ Hᵢ Wᵢ + Wᵢᵀ Qᵢ + Qᵢᵀ Wᵢ + (Hᵢ Wᵢ + Qᵢ)ᵀ Nᵢ Z]
//! ```
//!
//! where Nᵢ is the motion of the place in that of the device, and Pᵢ da the gradient of gᵢ·Wᵢ da along the vessel: forces turn
//! with its sections. Friction has its share in Hᵢ, with the material angle as
//! a further unknown of the device. Only the unknowns T that a contact reaches have forces; the others follow, so that
//!
//! ```text
//! ((A⁻¹)_TT⁻¹ + M) a_T⁺ = p + M a_T,    a⁺ = (A⁻¹)_T (A⁻¹)_TT⁻¹ a_T⁺
//! ```
//!
//! This is block elimination of Newton's method for both. The matrix is symmetric, and positive definite where device and vessel together are
//! stable; where it is not, they snap together, and the step descends by the magnitudes of the curvatures.
//!
//! A step within which many contacts begin or cease to slip goes too far: Newton's method knows friction within ε alone, and would find
//! its way from one contact to the next. Friction then sticks within as much as the step moves, and ε is halved from solution to
//! solution until it is that of the part. With the derivative of friction's forces f and couples in −ln ε, ∂f = f′(u) u, a halving by δ
//! moves both by
//!
//! ```text
//! dx = −Z da − K⁻¹ r,    r = δ Σ Nᵢᵀ ∂fᵢ,    (A + M) da = p − A a + δ Σ Wᵢᵀ ∂fᵢ + Pᵀ K⁻¹ r
//! ```
//!
//! where P are the pulls on the device, Z = K⁻¹ P.
//!
//! Where the device is not found at the end of a step, or of a halving of ε, that was too long, and half of it is gone; not
//! where the device has gone so far that it snaps.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3};

use super::Environment;
use super::configuration::{Configuration, Start};
use super::part::{Effort, Limits, Lost};
use super::search::{Beginning, Bounds, Judged, Lagged, Search, Searched};
use super::state::KirchhoffState;
use super::substep::Attempt;
use super::workspace::Tools;
use crate::Vec3;
use crate::contact::{Friction, HandMotion, Reaction};
use crate::rod::scatter::{angle_weights, point_columns};
use crate::rod::{Layout, RodState};
use crate::solve::StopReason;
use crate::vessel::{Course, Displacement};

/// Most times that the course follows in a part.
const MOST_ROUNDS: usize = 80;
/// A step goes back where the energy rises at its end by more than this of the slope by which it fell at its beginning, as where
/// contacts change status.
const RISES: f64 = 0.5;
/// A wider ε shrinks by this factor, from a solution that is this near, relative to the largest force.
const NARROWS: f64 = 0.5;
const NEAR_ENOUGH: f64 = 0.1;
/// A step at whose end the device is not found is halved down to this part of it.
const LEAST_PART: f64 = 0.25;
/// Most sweeps for the eigenvalues of a stiffness, and the least magnitude that they are taken as, relative to the largest.
const MOST_SWEEPS: usize = 1000;
const LEAST_CURVATURE: f64 = 1e-7;
/// The course follows by at most so many radii of the device at once, mm, …
const MOST_RADII: f64 = 2.0;
/// … and turns the device by at most so much, rad.
const MOST_TURN_RAD: f64 = 0.3;

/// The course in a part.
pub(super) struct Yielding<'a> {
    course: &'a Arc<Course>,
    /// How much of what changes around the device is over after the part, 0 to 1.
    to: f64,
    amplitudes_mm: Vec<Vec3>,
    displacement: Displacement,
    /// ε of the part, mm.
    stick_mm: f64,
}

/// How the course follows: its new amplitudes, mm, and the motion of the device with it.
pub(super) struct Follows {
    amplitudes_mm: Vec<Vec3>,
    way: Vec<f64>,
    /// Forces that are not balanced: the gradient of the energy in the amplitudes, N.
    off_n: Vec<Vec3>,
    /// ε that belongs to them, mm.
    stick_mm: f64,
}

impl<'a> Yielding<'a> {
    /// The course at the start of a part, or where earlier commands have left it; none where only the wall yields. Slip
    /// is measured on the material points of the vessel.
    pub(super) fn begin(
        environment: &Environment<'a>,
        (start, attempt): (Start<'_>, Attempt<'_>),
        friction: &mut Friction,
        motions: &[HandMotion],
    ) -> Option<Self> {
        let course = environment.surroundings.course?;
        let was = start.state;
        let amplitudes_mm = match attempt.part.resumed {
            Some(resumed) => resumed.state.course_mm.clone(),
            // As the device, it is expected to go on as in the last part.
            None => {
                let factor = was.correction.repeats(motions).unwrap_or(0.0);
                let each = was.course_mm.iter().zip(&was.course_change_mm);
                each.map(|(at, change)| at + change * factor).collect()
            }
        };
        let displacement = environment.surroundings.displacement(attempt.part.to, &amplitudes_mm)?;
        if amplitudes_mm != was.course_mm {
            let was = environment.surroundings.displacement(attempt.part.to, &start.state.course_mm)?;
            friction.go_with((&was, &displacement));
        }
        let stick_mm = friction.stick_mm();
        Some(Self { course, to: attempt.part.to, amplitudes_mm, displacement, stick_mm })
    }

    pub(super) fn displacement(&self) -> &Displacement {
        &self.displacement
    }

    /// Stores the course in the state after the part.
    pub(super) fn keep(self, was: &KirchhoffState, after: &mut KirchhoffState) {
        after.course_change_mm.clear();
        after
            .course_change_mm
            .extend(self.amplitudes_mm.iter().zip(&was.course_mm).map(|(to, from)| to - from));
        after.course_mm = self.amplitudes_mm;
    }

    /// How far it may follow at once, mm.
    pub(super) fn most_mm(&self, environment: &Environment<'_>) -> f64 {
        MOST_RADII * environment.surroundings.device.min_radius_mm()
    }

    /// How the course follows from an equilibrium of the device; none where it is in equilibrium too.
    ///
    /// # Errors
    /// Stiffnesses that have no inverse.
    pub(super) fn follow<const C: usize>(
        &self,
        search: &mut Search<'_, '_, C>,
        lagged: &Lagged<'_>,
        most_mm: f64,
    ) -> Result<Option<Follows>, StopReason> {
        // It was assembled last.
        let reactions = search.contact.reactions(search.state);
        let touched = Touched::new(self.course, &self.displacement, &reactions);
        let forces = touched.forces(&reactions);
        let own = self.course.forces_n(&self.amplitudes_mm);
        let mut given = vec![Vec3::zeros(); own.len()];
        touched.unknowns.iter().zip(&forces).for_each(|(unknown, force)| given[*unknown] = *force);
        let largest_n = forces.iter().map(Vec3::amax).fold(search.contact.negligible_n(), f64::max);
        let off_n: Vec<Vec3> = own.iter().zip(&given).map(|(own, given)| own - given).collect();
        // No nearer than friction is settled: its normal forces follow from an equilibrium and move the next one.
        let friction = search.tuning.friction.settled;
        let tolerance = if search.has_friction { search.tolerance.max(friction) } else { search.tolerance };
        let is_within =
            |tolerance: f64| off_n.iter().map(Vec3::amax).fold(0.0, f64::max) <= tolerance * largest_n;
        let mut stick_mm = search.contact.stick_mm();
        let is_wide = stick_mm > self.stick_mm;
        if !is_wide && is_within(tolerance) {
            return Ok(None);
        }
        let narrows = is_wide && is_within(NEAR_ENOUGH);
        search.assemble(lagged, true);
        let factored = search.newton.factor(search.elements, search.supports);
        factored.ok_or(StopReason::Singular)?;
        let pulls = touched.pulls(search, &reactions);
        let responses = pulls.responses(search);
        let mut stiffness = touched.held_stiffness(&reactions);
        pulls.soften(&responses, &mut stiffness);
        let mut way = vec![0.0; Layout::<C>::dimension(search.elements.len())];
        let mut forces = forces;
        if narrows {
            let narrower_mm = (NARROWS * stick_mm).max(self.stick_mm);
            let by = 1.0 - narrower_mm / stick_mm;
            stick_mm = narrower_mm;
            touched.narrow(search, &reactions, by, &mut way);
            search.newton.apply_inverse(search.elements, &mut way);
            touched.narrowed(&reactions, by, &mut forces);
            pulls.by_device(&way, &mut forces);
            way.iter_mut().for_each(|value| *value = -*value);
        }
        let next = self.next(&touched, &forces, stiffness, most_mm);
        let amplitudes_mm = next.ok_or(StopReason::Singular)?;
        let moved = |unknown: usize| amplitudes_mm[unknown] - self.amplitudes_mm[unknown];
        for (k, unknown) in touched.unknowns.iter().enumerate() {
            let by = moved(*unknown);
            for axis in 0..3 {
                way.iter_mut().zip(&responses[3 * k + axis]).for_each(|(way, z)| *way -= z * by[axis]);
            }
        }
        Ok(Some(Follows { amplitudes_mm, way, off_n, stick_mm }))
    }

    /// The amplitudes of the next round, mm, with M, to which the vessel's own stiffness is added.
    fn next(
        &self,
        touched: &Touched,
        forces: &[Vec3],
        mut matrix: DMatrix<f64>,
        most_mm: f64,
    ) -> Option<Vec<Vec3>> {
        let count = touched.unknowns.len();
        if count == 0 {
            return Some(vec![Vec3::zeros(); self.course.unknowns()]);
        }
        let among = |i: usize, j: usize| self.course.compliance(touched.unknowns[i], touched.unknowns[j]);
        let condensed = DMatrix::from_fn(count, count, among).cholesky()?.inverse();
        let was = DVector::from_iterator(
            3 * count,
            touched
                .unknowns
                .iter()
                .flat_map(|unknown| self.amplitudes_mm[*unknown].iter().copied().collect::<Vec<_>>()),
        );
        let given =
            DVector::from_iterator(3 * count, forces.iter().flat_map(|force| [force.x, force.y, force.z]));
        // What is not balanced, less what the untouched unknowns take of it.
        let mut right = given;
        for i in 0..count {
            for j in 0..count {
                for axis in 0..3 {
                    matrix[(3 * i + axis, 3 * j + axis)] += condensed[(i, j)];
                    right[3 * i + axis] -= condensed[(i, j)] * was[3 * j + axis];
                }
            }
        }
        let next = was + descent(matrix, &right)?;
        // What the touched unknowns are pulled by, and all of them then.
        let pulled: Vec<(usize, Vec3)> = (0..count)
            .map(|i| {
                let force = (0..count)
                    .map(|j| Vec3::from_column_slice(&next.as_slice()[3 * j..3 * j + 3]) * condensed[(i, j)]);
                (touched.unknowns[i], force.sum())
            })
            .collect();
        let all = self.course.yields_mm(&pulled);
        let farthest_mm =
            all.iter().zip(&self.amplitudes_mm).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        if !farthest_mm.is_finite() {
            return None;
        }
        let part = (most_mm / farthest_mm).min(1.0);
        let between = |(to, from): (&Vec3, &Vec3)| from + (to - from) * part;
        Some(all.iter().zip(&self.amplitudes_mm).map(between).collect())
    }
}

/// Newton's step for a symmetric matrix, with curvatures taken as positive where some are not: then it descends, and goes
/// far where device and vessel snap together.
fn descent(matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    if let Some(factors) = matrix.clone().cholesky() {
        return Some(factors.solve(right));
    }
    let modes = matrix.try_symmetric_eigen(f64::EPSILON, MOST_SWEEPS)?;
    let largest = modes.eigenvalues.amax();
    let mut along = modes.eigenvectors.tr_mul(right);
    let sizes = modes.eigenvalues.iter().map(|curvature| curvature.abs().max(LEAST_CURVATURE * largest));
    along.iter_mut().zip(sizes).for_each(|(part, size)| *part /= size);
    Some(modes.eigenvectors * along)
}

/// A step of the course, gone as far as the energy in equilibrium with the device falls along it.
struct Line {
    /// Newton's step, mm, and the motion of the device with it.
    step_mm: Vec<Vec3>,
    way: Vec<f64>,
    /// The slope by which the energy falls at its beginning, mJ.
    falls_mj: f64,
    /// How much of it has been gone.
    gone: f64,
}

impl Line {
    /// A new step, of which this part is gone.
    fn of(Follows { amplitudes_mm, way, off_n, .. }: Follows, from_mm: &[Vec3], part: f64) -> Self {
        let step_mm: Vec<Vec3> = amplitudes_mm.iter().zip(from_mm).map(|(to, from)| to - from).collect();
        Self { falls_mj: slope_mj(&off_n, &step_mm).abs(), step_mm, way, gone: part }
    }

    /// The part by which to go back, negative, where the energy rises at its end: to where it neither falls nor rises, its slope
    /// taken as linear.
    fn back(&mut self, end: &Follows) -> Option<f64> {
        let rises_mj = slope_mj(&end.off_n, &self.step_mm);
        if rises_mj <= RISES * self.falls_mj {
            return None;
        }
        let back = -self.gone * rises_mj / (self.falls_mj + rises_mj);
        self.gone += back;
        Some(back)
    }
}

/// The slope of the energy along a step of the course, mJ.
fn slope_mj(off_n: &[Vec3], step_mm: &[Vec3]) -> f64 {
    off_n.iter().zip(step_mm).map(|(force, step)| force.dot(step)).sum()
}

/// The unknowns that contacts reach.
struct Touched {
    /// In ascending order.
    unknowns: Vec<usize>,
    /// Of each contact the numbers among these with their blocks of Wᵢ and Qᵢ.
    weights: Vec<Vec<(usize, [Matrix3<f64>; 2])>>,
}

impl Touched {
    fn new(course: &Course, displacement: &Displacement, reactions: &[Reaction]) -> Self {
        let of = |reaction: &Reaction| {
            let back = displacement.local(&reaction.material).inverse.transpose();
            let mut all = course.weights(&reaction.material, &reaction.force_n);
            all.iter_mut().for_each(|(_, [_, by_place])| *by_place = back * *by_place);
            all
        };
        let mut weights: Vec<_> = reactions.iter().map(of).collect();
        let mut unknowns: Vec<usize> = weights.iter().flatten().map(|(unknown, _)| *unknown).collect();
        unknowns.sort_unstable();
        unknowns.dedup();
        for (unknown, _) in weights.iter_mut().flatten() {
            *unknown = unknowns.partition_point(|touched| touched < unknown);
        }
        Self { unknowns, weights }
    }

    /// p, N.
    fn forces(&self, reactions: &[Reaction]) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); self.unknowns.len()];
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            weights.iter().for_each(|(k, [weight, _])| forces[*k] += weight.tr_mul(&reaction.force_n));
        }
        forces
    }

    /// r, what a narrower friction does to the device: its gradient where ε is smaller by this part.
    fn narrow<const C: usize>(
        &self,
        search: &Search<'_, '_, C>,
        reactions: &[Reaction],
        by: f64,
        gradient: &mut [f64],
    ) {
        for reaction in reactions {
            let (e, xi, _) = reaction.place;
            let (force_n, couple) = reaction.by_stick;
            let ways = point_columns::<C>(search.state, &search.elements[e], e, xi);
            ways.iter().for_each(|(row, way)| gradient[*row] += by * way.dot(&force_n));
            if Layout::<C>::ANGLES > 0 {
                let turns = angle_weights::<C>(reaction.place);
                turns.iter().for_each(|(row, share)| gradient[*row] += by * share * couple);
            }
        }
        for row in search.supports.held::<C>().into_iter().flatten() {
            gradient[row] = 0.0;
        }
    }

    /// Adds to p what a narrower friction adds.
    fn narrowed(&self, reactions: &[Reaction], by: f64, forces: &mut [Vec3]) {
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            let force_n = reaction.by_stick.0 * by;
            weights.iter().for_each(|(k, [weight, _])| forces[*k] += weight.tr_mul(&force_n));
        }
    }

    /// What each of the unknowns does to the device.
    fn pulls<const C: usize>(&self, search: &Search<'_, '_, C>, reactions: &[Reaction]) -> Pulls {
        let (elements, state) = (search.elements, &*search.state);
        let rows = Layout::<C>::dimension(elements.len());
        let mut columns = vec![vec![0.0; rows]; 3 * self.unknowns.len()];
        let mut reached = vec![rows..0; self.unknowns.len()];
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            let (e, xi, _) = reaction.place;
            let ways = point_columns::<C>(state, &elements[e], e, xi);
            let turns = angle_weights::<C>(reaction.place);
            let turns = if Layout::<C>::ANGLES > 0 { &turns[..] } else { &[] };
            for (k, [weight, turning]) in weights {
                let all = ways.iter().map(|(row, _)| *row).chain(turns.iter().map(|(row, _)| *row));
                reached[*k] = all.fold(reached[*k].clone(), |reached, row| {
                    reached.start.min(row)..reached.end.max(row + 1)
                });
                for axis in 0..3 {
                    let column = &mut columns[3 * k + axis];
                    let moved = weight.column(axis);
                    let pull = -(reaction.stiffness * moved + turning.column(axis));
                    ways.iter().for_each(|(row, way)| column[*row] += way.dot(&pull));
                    let turn = -reaction.by_angle.dot(&moved);
                    turns.iter().for_each(|(row, share)| column[*row] += share * turn);
                }
            }
        }
        for row in search.supports.held::<C>().into_iter().flatten() {
            columns.iter_mut().for_each(|column| column[row] = 0.0);
        }
        Pulls { columns, reached }
    }

    /// M of a device that does not respond.
    fn held_stiffness(&self, reactions: &[Reaction]) -> DMatrix<f64> {
        let size = 3 * self.unknowns.len();
        let mut matrix = DMatrix::zeros(size, size);
        for (reaction, weights) in reactions.iter().zip(&self.weights) {
            for (i, [one, turning]) in weights {
                for (j, [other, turned]) in weights {
                    let mut block = matrix.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    block += one.tr_mul(&(reaction.stiffness * other + turned)) + turning.tr_mul(other);
                }
            }
        }
        matrix
    }
}

/// Forces on the device where unknowns are displaced: −Σ Nᵢᵀ (Hᵢ Wᵢ + Qᵢ).
struct Pulls {
    /// Three for each unknown.
    columns: Vec<Vec<f64>>,
    /// Of each unknown the rows outside of which its columns are zero.
    reached: Vec<Range<usize>>,
}

impl Pulls {
    /// The columns of Z.
    fn responses<const C: usize>(&self, search: &Search<'_, '_, C>) -> Vec<Vec<f64>> {
        let mut responses = self.columns.clone();
        responses.iter_mut().for_each(|column| search.newton.apply_inverse(search.elements, column));
        responses
    }

    /// Adds to p what a motion of the device takes from it, of which this is the opposite.
    fn by_device(&self, opposite: &[f64], forces: &mut [Vec3]) {
        for (column, pull) in self.columns.iter().enumerate() {
            let rows = self.reached[column / 3].clone();
            let work: f64 = pull[rows.clone()].iter().zip(&opposite[rows]).map(|(a, b)| a * b).sum();
            forces[column / 3][column % 3] += work;
        }
    }

    /// Adds to M of a device that does not respond what its response does.
    fn soften(&self, responses: &[Vec<f64>], matrix: &mut DMatrix<f64>) {
        for (i, pull) in self.columns.iter().enumerate() {
            let rows = self.reached[i / 3].clone();
            for (j, response) in responses.iter().enumerate().skip(i) {
                let softer: f64 =
                    pull[rows.clone()].iter().zip(&response[rows.clone()]).map(|(a, b)| a * b).sum();
                matrix[(i, j)] -= softer;
                if i != j {
                    matrix[(j, i)] -= softer;
                }
            }
        }
    }
}

impl<const C: usize> Tools<C> {
    /// Lets the course follow an equilibrium of the device, and the device the course, until both are in equilibrium.
    pub(super) fn follow_course(
        &mut self,
        environment: &Environment<'_>,
        (first, effort, limits, may_snap): (Searched, Effort, Limits, bool),
        course: &mut Yielding<'_>,
        next: &mut Configuration,
    ) -> Searched {
        let tuning = &environment.options.tuning;
        let stack = environment.surroundings.stack;
        let most_mm = course.most_mm(environment);
        let (mesh, after) = next.parts();
        let KirchhoffState { rod, touches, .. } = after;
        let elements = &mesh.elements;
        let mut searched = first;
        let is_flight = effort == Effort::Flight;
        let mut line: Option<Line> = None;
        let mut widens = !is_flight;
        for _ in 0..MOST_ROUNDS {
            let Some(follows) = searched.follows.take() else { return searched };
            let before = rod.clone();
            let was_mm = course.amplitudes_mm.clone();
            let stick_mm = self.friction.stick_mm();
            let mut next_stick_mm = follows.stick_mm.min(stick_mm);
            if next_stick_mm < stick_mm {
                // The energy along the last step was that of another friction.
                line = None;
            }
            let back = line.as_mut().and_then(|line| line.back(&follows));
            let whole = back.unwrap_or_else(|| {
                let (turn, _) = RodState::largest_turn::<C>(elements, &before, &follows.way);
                let part = (MOST_TURN_RAD / turn).min(1.0);
                line = Some(Line::of(follows, &course.amplitudes_mm, part));
                part
            });
            let Some(Line { step_mm, way, .. }) = &line else { return searched };
            let farthest_mm = step_mm.iter().map(Vec3::norm).fold(0.0, f64::max);
            // What relaxes shrinks ε itself, from one solution to the next.
            let is_wider = widens && back.is_some() && searched.slides == 0 && stick_mm.is_finite();
            if is_wider {
                next_stick_mm = farthest_mm.max(stick_mm);
                widens = false;
            }
            // Where the device was sought last on this step.
            let (mut part, mut sought) = (1.0, 0.0);
            let again = loop {
                let gone = whole * part;
                let amplitudes_mm: Vec<Vec3> =
                    was_mm.iter().zip(step_mm).map(|(from, step)| from + step * gone).collect();
                let Some(moved) = environment.surroundings.displacement(course.to, &amplitudes_mm) else {
                    return searched;
                };
                self.friction.go_with((&course.displacement, &moved));
                let moved_mm = (whole * (part - sought)).abs() * farthest_mm * moved.stretch();
                (course.amplitudes_mm, course.displacement) = (amplitudes_mm, moved);
                if next_stick_mm != stick_mm {
                    self.friction.stick_at(next_stick_mm + (stick_mm - next_stick_mm) * (1.0 - part));
                }
                let way: Vec<f64> = way.iter().map(|value| value * gone).collect();
                let there = environment.displaced(Some(&course.displacement));
                let bounds = |effort: Effort, taken: (usize, usize)| Bounds {
                    effort,
                    most: match effort {
                        Effort::Flight => limits.iterations.saturating_sub(taken.0),
                        _ => limits.iterations.saturating_sub(taken.0).min(tuning.steps.following),
                    },
                    most_solves: limits.solves.saturating_sub(taken.1),
                    resumed: None,
                    moved_mm: Some(moved_mm),
                };
                let begin = |Beginning { newton, guess, contact, state, .. }: Beginning<'_, '_, C>| {
                    state.advance::<C>(elements, &before, &way, 1.0);
                    state.take_tensions::<C>(elements, &before, &way);
                    if contact.is_outside(elements, state) {
                        state.copy_from(&before);
                    }
                    contact.rooms(elements, state, &mut guess.room_mm);
                    newton.neighbourhood.begin(state, &guess.room_mm, &tuning.newton);
                    Ok::<_, Infallible>(())
                };
                let judged =
                    Judged { course: Some((course, most_mm)), before: 0, may_snap: may_snap || is_flight };
                let mut search = |effort: Effort, taken: (usize, usize)| {
                    let bounds = bounds(effort, taken);
                    let Ok(found) = self.with_search(
                        &there,
                        (mesh, stack, &mut *rod),
                        bounds,
                        begin,
                        |search, lagged| search.searched(lagged, &judged, touches),
                    );
                    found
                };
                // With friction that follows; a device in flight may snap once more.
                let again = search(Effort::Near, searched.taken);
                let is_lost = again.wrong.is_some_and(|wrong| wrong != Lost::UnderWay);
                if is_lost && is_flight {
                    let taken = again.taken;
                    let so_far = (searched.taken.0 + taken.0, searched.taken.1 + taken.1);
                    let flown = search(Effort::Flight, so_far);
                    searched.taken = so_far;
                    break flown;
                }
                // One that has gone far is on its way to where it snaps.
                if !is_lost || part <= LEAST_PART || again.off > 1.0 {
                    break again;
                }
                // The end of a shorter step is nearer.
                searched.taken = (searched.taken.0 + again.taken.0, searched.taken.1 + again.taken.1);
                (sought, part) = (part, 0.5 * part);
            };
            line = line.filter(|_| !is_wider);
            if let Some(line) = &mut line {
                line.gone -= whole * (1.0 - part);
            }
            searched = searched.then(again);
        }
        let wrong = Some(Lost::Unsolved(StopReason::Unsettled, searched.found.residual));
        Searched { wrong, ..searched }
    }
}
