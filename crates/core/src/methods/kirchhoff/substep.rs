//! One sub-step: a guess of where the device will be, and Newton's method from there.

use std::borrow::Cow;

use super::guess::Quality;
use super::rest::come_to_rest;
use super::slide::slide;
use super::{Kirchhoff, softest};
use crate::contact::{Counters, HandMotion, SETTLED, WallContact};
use crate::insertion::Surroundings;
use crate::rod::Supports;
use crate::solve::NewtonOptions;

/// Where the wall is stiffer than this many elements of the rod, EI/h⁴, it is approached from softer walls, …
const SOFTEST: f64 = 30.0;
/// … each solved to this residual over force scale, or to what is wanted if that is more.
const LOOSE: f64 = 1e-3;
/// How often friction and wall may be solved for together: each time the equilibrium may turn out to be unstable, and be left.
const ROUNDS: usize = 5;
/// Newton iterations in which a guess that has learnt must come to its end, or the wall is approached from softer ones.
const HURRIED: usize = 15;
/// Residual over force scale above which the last resort has found nothing.
const AT_REST: f64 = 0.05;
/// Newton iterations after which a solution has gone astray: from another guess, nearer by, it is found in fewer.
const STUCK: usize = 60;
/// What is the matter where an equilibrium is on the other side of the wall.
const PASSED: &str = "the device would pass through the wall";
/// What is the matter where they do not.
const UNSETTLED: &str = "friction and wall forces do not settle";

/// How an equilibrium was found.
pub(super) struct Found {
    /// Newton iterations.
    pub(super) iterations: usize,
    /// Energy that friction took, mJ.
    pub(super) dissipated_mj: f64,
    /// Residual over force scale.
    pub(super) residual: f64,
    /// Part by which the normal forces that friction follows differ from those of the wall.
    pub(super) unsettled: f64,
    /// Whether it is an equilibrium.
    pub(super) balanced: bool,
}

/// How far a sub-step goes, and how hard it tries.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt {
    /// Length inserted after it, mm.
    pub(super) inserted_mm: f64,
    /// Angle of the tail after it, rad.
    pub(super) tail_rad: f64,
    /// Whether the wall is in the tip's way.
    pub(super) blocked: bool,
    /// Whether the device is let come to rest as it can, and if so, whether that is taken whatever is left over.
    pub(super) resort: Option<bool>,
}

impl<const C: usize> Kirchhoff<C> {
    /// One sub-step: slides and solves on `self.next`; the current state, and what its points know of the wall, is as before if that
    /// fails. Newton iterations are taken from `budget`.
    pub(super) fn try_step(
        &mut self,
        surroundings: &Surroundings<'_>,
        attempt: Attempt,
        budget: &mut usize,
    ) -> std::result::Result<Found, Cow<'static, str>> {
        self.memory.keep(&mut self.known_now);
        let found = self.solve_step(surroundings, attempt, budget);
        if found.is_err() {
            self.memory.restore(&self.known_now);
        }
        found
    }

    fn solve_step(
        &mut self,
        surroundings: &Surroundings<'_>,
        attempt: Attempt,
        budget: &mut usize,
    ) -> std::result::Result<Found, Cow<'static, str>> {
        let Attempt { inserted_mm, tail_rad, blocked, resort } = attempt;
        let relax = resort.is_some();
        let (modulus, tolerance) = (surroundings.properties.modulus_n_per_mm2, self.options.tolerance);
        let (now, next) = (&self.current, &mut self.next);
        next.mesh.build(surroundings.device, inserted_mm, self.options.element_mm, modulus);
        slide(&now.mesh, &now.state, &self.extension, &next.mesh, &mut next.state);
        let hand = HandMotion {
            from_mm: now.inserted_mm(),
            to_mm: inserted_mm,
            turn_rad: tail_rad - now.state.angles[0],
        };
        next.friction.begin(
            &next.mesh.elements,
            &next.state,
            &next.mesh.points,
            (&now.mesh.points, &now.friction),
            hand,
        );
        next.state.angles[0] = tail_rad;
        let elements = next.mesh.elements.len();
        self.newton.resize(elements);
        let advance = inserted_mm - now.inserted_mm();
        self.memory.slide(&now.mesh.points, &next.mesh.points, advance);
        let mut contact = WallContact::new(
            &self.felt,
            &next.mesh.points,
            &mut self.memory,
            &mut next.friction,
            softest(surroundings.device),
            self.options.skip,
        );
        let candidates = (now, &next.mesh, &mut next.state);
        let quality = self.guess.choose(&self.newton, &mut contact, candidates, hand, blocked);
        contact.keep_forces();
        let mut supports = Supports { start_tangent: true, start_angle: true, ..Supports::default() };
        let near = quality != Quality::Beyond;
        let held =
            near && self.guess.hold(&mut self.newton, &mut contact, &supports, &next.mesh, &mut next.state);
        // A wall much stiffer than an element of the rod is approached by softer ones, ten times stiffer each.
        let data = &next.mesh.elements[elements - 1];
        let element_stiffness = data.bending[2] / self.options.element_mm.powi(4);
        let stiffest = surroundings.properties.stiffest_n_per_mm2();
        let softest_first = (SOFTEST * element_stiffness / stiffest).min(1.0);
        contact.hand_over(softest_first < 1.0);
        // A guess that has learnt from the last step or kept its contacts is so near that the wall may be met as it is.
        let mut hurried = (quality == Quality::Learnt || held) && softest_first < 1.0;
        let mut softness = if hurried { 1.0 } else { softest_first };
        let mut iterations = usize::from(held);
        let mut rounds = 0;
        let found = loop {
            if relax {
                let system = (&mut self.newton, &mut contact, &mut supports);
                let (found, steps) = come_to_rest(
                    system,
                    &next.mesh.elements,
                    &mut next.state,
                    (softest_first, tolerance, surroundings.properties.rubs()),
                );
                iterations += steps;
                break found;
            }
            contact.softness = softness;
            let options = NewtonOptions {
                max_iterations: if hurried { HURRIED } else { self.options.max_iterations.min(STUCK) }
                    .min(*budget),
                tolerance: if softness < 1.0 { tolerance.max(LOOSE) } else { tolerance },
                ..NewtonOptions::default()
            };
            let found = self.newton.solve(
                &next.mesh.elements,
                &mut supports,
                &mut contact,
                &mut next.state,
                &options,
            );
            iterations += found.iterations;
            *budget -= found.iterations;
            if !found.converged && hurried {
                self.guess.plain(&mut next.state);
                hurried = false;
                // Without friction softer walls lead there in fewer iterations than the active set.
                let mut near = false;
                if surroundings.properties.rubs() {
                    contact.restore_forces();
                    let system = (&mut self.newton, &mut contact, &mut supports);
                    let limits = (tolerance, *budget);
                    let steps;
                    (near, steps) =
                        self.settle.approach(system, &next.mesh.elements, &mut next.state, limits);
                    iterations += steps;
                    *budget -= steps;
                }
                if !near {
                    self.guess.plain(&mut next.state);
                    softness = softest_first;
                    contact.softness = softness;
                    contact.hand_over(softest_first < 1.0);
                }
                continue;
            }
            if !found.converged {
                break found;
            }
            if softness < 1.0 {
                softness = (10.0 * softness).min(1.0);
                contact.softness = softness;
                contact.hand_over(softest_first < 1.0);
                continue;
            }
            if !surroundings.properties.rubs() || contact.friction_settled() {
                break found;
            }
            if contact.handed_over() || softest_first < 1.0 {
                let system = (&mut self.newton, &mut contact, &mut supports);
                let limits = (tolerance, *budget);
                let (settled, steps) =
                    self.settle.solve(system, &next.mesh.elements, &mut next.state, limits);
                iterations += steps;
                *budget -= steps;
                rounds += 1;
                if settled && rounds < ROUNDS {
                    continue;
                }
                return Err(UNSETTLED.into());
            }
        };
        let least = if resort == Some(true) { f64::MAX } else { AT_REST };
        let at_rest = found.converged || (relax && found.residual <= least);
        let passed = at_rest && contact.passes_through(&next.mesh.elements, &next.state);
        let unsettled = contact.unsettled();
        let nodes = elements as u64 + 1;
        let (solved, frozen) = if iterations > 0 { (nodes, 0) } else { (0, nodes) };
        let counted = contact.count();
        self.report.counters.add(&Counters { nodes_solved: solved, nodes_frozen: frozen, ..counted });
        if !at_rest {
            // Each renewal of the lagged forces gave Newton's method another energy to lower.
            let unsettled = surroundings.properties.rubs() && !contact.friction_settled();
            let reason = if unsettled { UNSETTLED.to_owned() } else { found.reason.to_string() };
            return Err(format!("{reason} (residual {:.1e})", found.residual).into());
        }
        if passed {
            return Err(PASSED.into());
        }
        self.guess.learn(hand, &next.state);
        let dissipated_mj = next.friction.dissipated_mj(&next.mesh.elements, &next.state, &next.mesh.points);
        let unsettled = if relax && surroundings.properties.rubs() { unsettled } else { 0.0 };
        let balanced = found.converged && unsettled < SETTLED;
        Ok(Found { iterations, dissipated_mj, residual: found.residual, unsettled, balanced })
    }
}
