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

mod following;
mod touched;

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::Environment;
use super::configuration::Start;
use super::search::{Lagged, Search};
use super::state::KirchhoffState;
use super::substep::Attempt;
use crate::Vec3;
use crate::contact::{Friction, HandMotion};
use crate::rod::Layout;
use crate::solve::StopReason;
use crate::vessel::{Course, Displacement};
use touched::Touched;

/// Most sweeps for the eigenvalues of a stiffness, and the least magnitude that they are taken as, relative to the largest:
/// bounds of rounding.
const MOST_SWEEPS: usize = 1000;
const LEAST_CURVATURE: f64 = 1e-7;

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
        environment.options.tuning.course.most_radii * environment.surroundings.device.min_radius_mm()
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
        let tuning = &search.tuning.course;
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
        let narrows = is_wide && is_within(tuning.near_enough);
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
            let narrower_mm = (tuning.narrows * stick_mm).max(self.stick_mm);
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
