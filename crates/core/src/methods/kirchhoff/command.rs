//! One command: solved in one sub-step if possible, else in several, and by relaxation to rest where the path of
//! equilibria ends.

use std::sync::Arc;

use super::Environment;
use super::blocked::{refuse_narrow, refuse_wedged};
use super::carried::taken_along;
use super::configuration::Start;
use super::hands::{lengths, motions};
use super::state::{KirchhoffState, Ticking};
use super::step_control::StepControl;
use super::substep::{Attempt, Effort, Found};
use super::workspace::{Work, Workspace};
use crate::contact::extension::check_inside;
use crate::device::line_mm;
use crate::methods::{Jump, Move, StepReport, Surroundings};
use crate::{Error, Result};

/// Accumulated results of the sub-steps of a command or a tick.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sum {
    pub(super) substeps: usize,
    pub(super) relaxations: u32,
    slides: u32,
    imbalance: f64,
    dissipated_mj: f64,
    borrowed_mj: f64,
    jump: Option<Jump>,
    largest_mj: f64,
}

impl Sum {
    /// Adds the results of a sub-step.
    pub(super) fn add(&mut self, found: &Found) {
        self.imbalance = 0.0;
        self.slides += found.slides;
        self.dissipated_mj += found.dissipated_mj;
        self.borrowed_mj += found.borrowed_mj;
        if let Some(jump) = found.jump {
            let so_far = self.jump.get_or_insert(Jump { released_mj: 0.0, ..jump });
            // The position is that of the largest jump.
            if jump.released_mj > self.largest_mj {
                (self.largest_mj, so_far.position_mm) = (jump.released_mj, jump.position_mm);
            }
            so_far.released_mj += jump.released_mj;
        }
    }

    /// Adds energy dissipated by friction, mJ.
    pub(super) fn rub(&mut self, dissipated_mj: f64) {
        self.dissipated_mj += dissipated_mj;
    }

    /// Records the imbalance of a device that was relaxed from a fold.
    pub(super) fn note_imbalance(&mut self, found: &Found) {
        self.imbalance = found.residual.max(found.unsettled);
    }

    pub(super) fn write(&self, report: &mut StepReport) {
        report.substeps = self.substeps as u32;
        (report.relaxations, report.slides) = (self.relaxations, self.slides);
        (report.imbalance, report.dissipated_mj) = (self.imbalance, self.dissipated_mj);
        let released =
            |jump: Jump| Jump { released_mj: (jump.released_mj - self.borrowed_mj).max(0.0), ..jump };
        (report.jump, report.jumped) = (self.jump.map(released), self.jump.is_some());
    }
}

/// Initial step control for a command from a state, whose hands move by up to `travel_mm`.
fn control(environment: &Environment<'_>, from: &KirchhoffState, travel_mm: f64) -> StepControl {
    let tuning = &environment.options.tuning.steps;
    let most = tuning.work_of_one.saturating_mul(environment.options.max_iterations);
    let work = (tuning.work * travel_mm.max(1.0)) as usize;
    let control = StepControl::new(work.min(most), from.stride, environment.has_friction(), tuning);
    let surroundings = &environment.surroundings;
    let set_free = travel_mm == 0.0 && !surroundings.moves() && !surroundings.fields_change();
    if set_free { control.set_free() } else { control }
}

impl<const C: usize> Workspace<C> {
    /// Begins with moves, and motion left over by ticks, from the state `from`.
    ///
    /// # Errors
    /// [`PhysicalEnd`](crate::PhysicalEnd) if the tip has left the vessel and would be pushed on.
    pub(super) fn begin(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
    ) -> Result<()> {
        let Self { tools, now, next, most: (elements, points), way, .. } = self;
        now.own(*elements, *points);
        next.own(*elements, *points);
        // If nothing is solved, the coils do not move.
        now.parts().1.coils = Arc::clone(&from.coils);
        let Surroundings { stack, properties, .. } = environment.surroundings;
        let fineness = environment.options.fineness();
        tools.joined.renew(&from.coils, stack, fineness, properties.modulus_n_per_mm2);
        tools.work = Work::default();
        let surroundings = &environment.surroundings;
        way.begin(surroundings.stack, &from.report, moves);
        let advance_mm = line_mm(lengths(&way.target)) - line_mm(lengths(&way.start));
        if advance_mm > 0.0 {
            let displaced = surroundings.displacement(0.0);
            let tip_mm = environment.displaced(displaced.as_ref()).wall().material(&from.tip_mm());
            check_inside(surroundings.lumen.openings(), &tip_mm, advance_mm)?;
        }
        Ok(())
    }

    /// Carries out a command from the state `from`; the new state is in `now`.
    ///
    /// # Errors
    /// As [`Method::step`](crate::methods::Method::step).
    pub(super) fn carry_out(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
    ) -> Result<()> {
        self.begin(environment, from, moves)?;
        let Self { tools, mesh, now, next, way, hands, .. } = self;
        let surroundings = &environment.surroundings;
        let displacement = |part: f64| surroundings.displacement(part);
        let mut displaced = displacement(0.0);
        let (start, target) = (line_mm(lengths(&way.start)), line_mm(lengths(&way.target)));
        let (mut sum, mut balanced) = (Sum::default(), true);
        let tuning = &environment.options.tuning.steps;
        let travel = way.travel_mm(tuning.work_rad);
        let mut control = control(environment, from, travel);
        // Without hand motion the vessel or a field changes, time passes, or something was released.
        let travel = if travel > 0.0 { travel } else { 1.0 };
        let mut moved = false;
        // Progress of the command, 0 to 1: advance and rotation are proportional.
        let mut done = 0.0f64;
        let mut again = tuning.again;
        let thinnest_mm = surroundings.device.min_radius_mm();
        while done < 1.0 || (!balanced && again > 0) {
            // A device that rests at the end of the command, but not in equilibrium, continues from there.
            again -= usize::from(done >= 1.0);
            // A step of a single part takes milliseconds and is not interrupted.
            if sum.substeps > 0 {
                surroundings.check_stop()?;
            }
            let was = if moved { now.start() } else { Start { mesh, state: from } };
            let rest = 1.0 - done;
            let (effort, part_mm) = control.next(rest * travel);
            let part = part_mm / travel;
            let at_start = environment.displaced(displaced.as_ref());
            if effort == Effort::Flight {
                refuse_wedged(&at_start, was, &way.commands)?;
            }
            // A remainder at the level of rounding is ignored.
            let to = if part >= (1.0 - 1e-9) * rest { 1.0 } else { done + part };
            way.at(to, hands);
            let then = displacement(to);
            let passage = displaced.as_ref().zip(then.as_ref()).filter(|(before, after)| before != after);
            let taken = taken_along(was, passage);
            let here = taken.as_ref().map_or(was, |state| Start { mesh: was.mesh, state });
            let there = environment.displaced(then.as_ref()).with_fields_at(to);
            sum.substeps += 1;
            if line_mm(lengths(hands)) == 0.0 && tools.joined.is_empty() {
                motions(&was.state.report, hands, &mut tools.guess.motions);
                now.withdraw(surroundings.stack, hands);
                sum.rub(tools.write_report(&there, hands, now));
                break;
            }
            let left = passage.map(|passage| (was, passage));
            let most = control.budget();
            let attempt = Attempt { hands, part_mm, effort, most, solves: usize::MAX, left, resumed: None };
            let before = tools.work;
            let tried = tools.try_step(&there, here, attempt, next);
            control.took(tools.work.since(&before));
            match tried {
                // The device came to rest with energy that nobody put in, so the equilibrium was too far away.
                Ok(found) if found.lacks && control.can_shorten(part_mm) => control.shorten(part_mm),
                Ok(found) => {
                    sum.add(&found);
                    if effort == Effort::Flight {
                        sum.relaxations += 1;
                        sum.note_imbalance(&found);
                    }
                    // At a crease of the wall forces switch between both sides and never balance; if nothing moves
                    // any more the device is at rest all the same.
                    let rests = done >= 1.0
                        && found.residual <= tuning.at_rest
                        && was.state.rod.farthest_mm(&next.state.rod) <= tuning.rest_radii * thinnest_mm;
                    balanced = (found.balanced && !found.lacks) || rests;
                    check_inside(
                        surroundings.lumen.openings(),
                        &there.wall().material(&next.state.tip_mm()),
                        0.0,
                    )?;
                    std::mem::swap(now, next);
                    displaced = then;
                    moved = true;
                    done = to;
                    control.succeeded(part_mm, &found);
                }
                // A retry from the same state would give the same result.
                Err(_) if done >= 1.0 => break,
                Err(lost) => {
                    // No equilibrium: if the vessel is too narrow to go on, the error says so, here and below.
                    if control.failed(part_mm, lost) || sum.substeps > tuning.substep_limit {
                        refuse_narrow(&at_start, was, &way.commands)?;
                        return Err(Error::Computation(format!(
                            "kirchhoff: no equilibrium between {start:.3} and {target:.3} mm inserted: {lost}"
                        )));
                    }
                }
            }
        }
        if !balanced {
            let there = environment.displaced(displaced.as_ref());
            refuse_narrow(&there, now.start(), &way.commands)?;
        }
        let state = now.parts().1;
        (state.stride, state.tick) = (control.stride(), Ticking::Rest);
        let report = &mut state.report;
        sum.write(report);
        report.converged = balanced;
        report.behind.clear();
        report.angles = from.report.angles;
        tools.work.write(report, from.report.nodes_solved);
        Ok(())
    }
}
