//! One command: in one sub-step where that will do, in several where it will not, and to where the device comes to rest as it can where
//! the way is lost.

use std::sync::Arc;

use super::Environment;
use super::blocked::{refuse_narrow, refuse_wedged};
use super::carried::carried;
use super::configuration::Start;
use super::hands::lengths;
use super::state::{KirchhoffState, Ticking};
use super::step_control::StepControl;
use super::substep::{Attempt, Effort, Found};
use super::workspace::{Work, Workspace};
use crate::contact::extension::check_inside;
use crate::device::line_mm;
use crate::methods::{Jump, Move, StepReport, Surroundings};
use crate::{Error, Result};

/// Most sub-steps that one command may be cut into.
const SUBSTEP_LIMIT: usize = 4096;
/// Newton iterations that a command may take in all its sub-steps for every millimetre and every [`WORK_RAD`], those in vain
/// included, before it comes to rest as it can: its cost is bounded.
const WORK: f64 = 280.0;
/// See [`WORK`], rad.
pub(super) const WORK_RAD: f64 = 0.1;
/// … and never more than so many times what one solution may take.
const WORK_OF_ONE: usize = 10;
/// How often a device that came to rest at the end of its way, but in no equilibrium, is let go on from there with the hand held still.
const AGAIN: usize = 4;
/// What moved by less than this in another last resort, in its least radii, is at rest.
pub(super) const REST_RADII: f64 = 1e-3;
/// Residual over force scale above which what has stopped is not at rest.
pub(super) const AT_REST: f64 = 0.05;

/// What the sub-steps of a command, or the parts of a tick, come to.
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
    /// Adds a part.
    pub(super) fn add(&mut self, found: &Found) {
        self.imbalance = 0.0;
        self.slides += found.slides;
        self.dissipated_mj += found.dissipated_mj;
        self.borrowed_mj += found.borrowed_mj;
        if let Some(jump) = found.jump {
            let so_far = self.jump.get_or_insert(Jump { released_mj: 0.0, ..jump });
            // The place is that of the largest.
            if jump.released_mj > self.largest_mj {
                (self.largest_mj, so_far.position_mm) = (jump.released_mj, jump.position_mm);
            }
            so_far.released_mj += jump.released_mj;
        }
    }

    /// Notes what a device that was let go from a fold lacks to an equilibrium.
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

/// How a command from a state begins whose hands go so far, mm.
fn control(environment: &Environment<'_>, from: &KirchhoffState, travel_mm: f64) -> StepControl {
    let most = WORK_OF_ONE.saturating_mul(environment.options.max_iterations);
    let work = (WORK * travel_mm.max(1.0)) as usize;
    let control = StepControl::new(work.min(most), from.stride, environment.has_friction());
    let surroundings = &environment.surroundings;
    let set_free = travel_mm == 0.0 && !surroundings.moves() && !surroundings.fields_change();
    if set_free { control.set_free() } else { control }
}

impl<const C: usize> Workspace<C> {
    /// Begins with moves, and what ticks have left over, from the state `from`.
    ///
    /// # Errors
    /// [`PhysicalEnd`](crate::PhysicalEnd) of a tip that has left the vessel and would be pushed on.
    pub(super) fn begin(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
    ) -> Result<()> {
        let Self { tools, now, next, most: (elements, points), way, .. } = self;
        now.own(*elements, *points);
        next.own(*elements, *points);
        // Where nothing is solved for they stay where they are.
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

    /// Carries out a command from the state `from`, and leaves the new state in `now`.
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
        let travel = way.travel_mm(WORK_RAD);
        let mut control = control(environment, from, travel);
        // Where no hand moves the vessel or a field does, time goes by, or something was set free.
        let travel = if travel > 0.0 { travel } else { 1.0 };
        let mut moved = false;
        // Progress of the command, 0 to 1: advance and turn go together.
        let mut done = 0.0f64;
        let mut again = AGAIN;
        let thinnest_mm = surroundings.device.min_radius_mm();
        while done < 1.0 || (!balanced && again > 0) {
            // What has come to rest without an equilibrium at the end of its way goes on from there.
            again -= usize::from(done >= 1.0);
            // A step of one part is not asked: it takes milliseconds.
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
            // A rest that is rounding is none.
            let to = if part >= (1.0 - 1e-9) * rest { 1.0 } else { done + part };
            way.at(to, hands);
            let then = displacement(to);
            let passage = displaced.as_ref().zip(then.as_ref()).filter(|(before, after)| before != after);
            let taken = passage.filter(|_| was.state.rod.elements() > 0).map(|passage| {
                let mut taken = was.state.clone();
                carried(was.mesh, &was.state.rod, passage, &mut taken.rod);
                taken
            });
            let here = taken.as_ref().map_or(was, |state| Start { mesh: was.mesh, state });
            let there = environment.displaced(then.as_ref()).with_fields_at(to);
            sum.substeps += 1;
            if line_mm(lengths(hands)) == 0.0 && tools.joined.is_empty() {
                now.withdraw(surroundings.stack, hands);
                tools.write_report(&there, hands, now);
                break;
            }
            let left = passage.map(|passage| (was, passage));
            let most = control.budget();
            let attempt = Attempt { hands, effort, most, solves: usize::MAX, left, resumed: None };
            let before = tools.work;
            let tried = tools.try_step(&there, here, attempt, next);
            control.took(tools.work.since(&before));
            match tried {
                // Where the device has come to rest with energy that nobody put in, it was too far from where it was.
                Ok(found) if found.lacks && control.can_shorten(part_mm) => control.shorten(part_mm),
                Ok(found) => {
                    sum.add(&found);
                    if effort == Effort::Flight {
                        sum.relaxations += 1;
                        sum.note_imbalance(&found);
                    }
                    // At a crease of the wall forces are those of one side or the other and never in balance; where nothing moves
                    // any more the device is at rest all the same.
                    let rests = done >= 1.0
                        && found.residual <= AT_REST
                        && was.state.rod.farthest_mm(&next.state.rod) <= REST_RADII * thinnest_mm;
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
                // From the same place the same comes of it.
                Err(_) if done >= 1.0 => break,
                Err(lost) => {
                    // No equilibrium: if the vessel is too narrow to go on, the error says so, here and below.
                    if control.failed(part_mm) || sum.substeps > SUBSTEP_LIMIT {
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
