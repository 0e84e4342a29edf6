//! The driver of the exact rod: one command, as a step or as ticks.
//!
//! A command is gone through in parts. Each part is proposed, solved, and then accepted or rejected
//! ([`super::course`]), until the command is done or its linear solves are used up: those that follow from its motion
//! ([`StepTuning::most_solves`](crate::tuning::StepTuning::most_solves)), in a tick at most those it is given. What is
//! then unfinished (a solution, a relaxation, motion of the hands) is kept with the state, and the next tick or step
//! goes on with it. A tick with enough solves therefore is the step.
//!
//! An error after an accepted part of a tick is postponed to the next tick, which repeats it. A step that fails leaves
//! the state as it was.

use std::sync::Arc;

use super::Environment;
use super::blocked::{refuse_narrow, refuse_wedged};
use super::carried::taken_along;
use super::configuration::Start;
use super::course::{Course, Next, Rest};
use super::extrapolation::Correction;
use super::hands::{lengths, line_advance_mm, set_motions};
use super::nearby::Recorder;
use super::part::Effort;
use super::report::Took;
use super::state::{KirchhoffState, UnderWay};
use super::substep::{Attempt, Part};
use super::workspace::{Tools, Work, Workspace};
use crate::contact::extension::check_inside;
use crate::device::line_mm;
use crate::methods::{Energy, Move, Surroundings};
use crate::{Error, Result, Vec3};

/// Result of a command.
#[derive(Debug)]
pub(super) enum Driven {
    /// There is a new state; with what it took.
    Moved(Took),
    /// The device has not moved yet; with what goes on in the next command.
    Waits(Rest),
    /// So many solves do not suffice to follow what changes around the device.
    Overtaken(usize),
}

impl<const C: usize> Workspace<C> {
    /// Begins with moves, and motion left over by earlier commands, from the state `from`.
    ///
    /// # Errors
    /// [`PhysicalEnd`](crate::PhysicalEnd) if the tip has left the vessel and would be pushed on.
    fn begin(&mut self, environment: &Environment<'_>, from: &KirchhoffState, moves: &[Move]) -> Result<()> {
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
        way.begin(surroundings.stack, (&from.hands, &from.behind), moves);
        set_motions(&way.start, &way.target, &mut tools.guess.motions);
        let advance_mm = line_advance_mm(&tools.guess.motions);
        if advance_mm > 0.0 {
            let displaced = surroundings.displacement(0.0, &from.course_mm);
            let line = from.material_line(environment.displaced(displaced.as_ref()).wall());
            check_inside(surroundings.lumen.openings(), line, advance_mm)?;
        }
        Ok(())
    }

    /// Carries out moves, and what earlier commands have left over, from the state `from`: as a tick of about so many
    /// linear solves, or as a step with `solves` = `usize::MAX`. Both end after those that a command may take
    /// ([`most_solves`](crate::tuning::StepTuning::most_solves)). A new state is in `now`.
    ///
    /// # Errors
    /// As [`Method::step`](crate::methods::Method::step).
    pub(super) fn carry_out(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
        solves: usize,
    ) -> Result<Driven> {
        self.carry_out_recorded(environment, from, (moves, solves), None)
    }

    /// As [`Workspace::carry_out`], and records the parts.
    ///
    /// # Errors
    /// As [`Method::step`](crate::methods::Method::step), and where there is no derivative.
    pub(super) fn carry_out_recorded(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        (moves, solves): (&[Move], usize),
        mut recorder: Option<&mut Recorder>,
    ) -> Result<Driven> {
        self.begin(environment, from, moves)?;
        let Self { tools, mesh, now, next, way, hands, .. } = self;
        let surroundings = &environment.surroundings;
        let (start_mm, target_mm) = (line_mm(lengths(&way.start)), line_mm(lengths(&way.target)));
        let mut displaced = surroundings.displacement(0.0, &from.course_mm);
        let mut course = Course::new(environment, from, (way, moves));
        let is_step = solves == usize::MAX;
        let solves = solves.min(course.most_solves);
        let ends = loop {
            if course.is_over(way) || course.pauses(&tools.work, solves) {
                break Ok(());
            }
            // A command of a single part takes milliseconds and is not interrupted.
            if course.parts() > 0 {
                surroundings.check_stop()?;
            }
            let was = if course.moved { now.start() } else { Start { mesh, state: from } };
            let part = course.propose(way, hands);
            let at_start = environment.displaced(displaced.as_ref());
            if part.effort == Effort::Flight
                && !part.holds_still
                && let Err(wedged) = refuse_wedged(&at_start, was, &way.commands)
            {
                break Err(wedged);
            }
            let then = surroundings.displacement(part.to, &was.state.course_mm);
            let passage = displaced.as_ref().zip(then.as_ref()).filter(|(before, after)| before != after);
            let taken = taken_along(was, passage);
            let here = taken.as_ref().map_or(was, |state| Start { mesh: was.mesh, state });
            let there = environment.displaced(then.as_ref()).with_fields_at(part.to);
            if line_mm(lengths(hands)) == 0.0 && tools.joined.is_empty() {
                set_motions(&was.state.hands, hands, &mut tools.guess.motions);
                tools.tails.begin(&there, (was.state, hands));
                now.withdraw(surroundings.stack, hands);
                let along_mj = tools.write_forces(&there, now);
                course.withdrawn(along_mj + tools.around_mj[1]);
                way.go_on_from(hands);
                break Ok(());
            }
            let before = tools.work;
            let left = passage.map(|passage| (was, passage));
            let attempt = Attempt { hands, left, limits: course.limits(&part, &before, solves), part };
            let tried = tools.try_step(&there, here, attempt, next);
            let iterations = tools.work.since(&before);
            course.took(iterations);
            let lost = match tried {
                Ok(found) if course.shortens(&part, &found) => continue,
                Ok(found) => {
                    let reached = surroundings.displacement(part.to, &next.state.course_mm);
                    let there = there.displaced(reached.as_ref());
                    let line = next.state.material_line(there.wall());
                    let openings = surroundings.lumen.openings();
                    let goes_on = check_inside(openings, line, 0.0).and_then(|()| {
                        let to = (&*next.state, &way.target[..]);
                        recorder.as_mut().map_or(Ok(()), |recorder| {
                            recorder.follow(&there, (was, passage), (attempt, &found), to)
                        })
                    });
                    if let Err(ended) = goes_on {
                        break Err(ended);
                    }
                    let way_mm = was.state.rod.farthest_mm(&next.state.rod);
                    let lies = way_mm
                        <= environment.options.tuning.steps.rest_radii * surroundings.device.min_radius_mm();
                    course.accept(&part, &found, lies, iterations);
                    std::mem::swap(now, next);
                    way.go_on_from(hands);
                    displaced = reached;
                    continue;
                }
                Err(lost) => lost,
            };
            match course.reject(&part, lost) {
                Next::Part => {}
                Next::Later => {
                    course.under_way = Some(tools.under_way(&part, &next.state, (from, before)));
                    break Ok(());
                }
                Next::Nothing => break Ok(()),
                Next::Step => return Ok(Driven::Overtaken(solves)),
                Next::Error => {
                    // If the vessel is too narrow to go on, the error says so.
                    let narrow = refuse_narrow(&at_start, was, &way.commands);
                    break narrow.and_then(|()| {
                        Err(Error::Computation(format!(
                            "kirchhoff: no equilibrium between {start_mm:.3} and {target_mm:.3} mm inserted: {lost}"
                        )))
                    });
                }
            }
        };
        // Of a tick, what has been reached so far is kept.
        if is_step || !course.moved {
            ends?;
        }
        if course.has_failed(way) {
            let there = environment.displaced(displaced.as_ref());
            refuse_narrow(&there, now.start(), &way.commands)?;
        }
        Ok(match course.moved {
            true => Driven::Moved(course.end(way, tools.work, now.parts().1)),
            false => Driven::Waits(course.rest(way)),
        })
    }
}

impl<const C: usize> Tools<C> {
    /// Stores an unfinished part, with the state `to` of its solution; `before` is the work of the command before the
    /// part.
    fn under_way(
        &mut self,
        part: &Part<'_>,
        to: &KirchhoffState,
        (from, before): (&KirchhoffState, Work),
    ) -> UnderWay {
        let iterations = self.work.since(&before) + part.resumed.map_or(0, |resumed| resumed.iterations);
        // They are counted once, with the state that the part leads to.
        self.work.nodes_solved = before.nodes_solved;
        // Only its hands, configuration and knowledge of the wall matter.
        let state = KirchhoffState {
            hand_forces: from.hand_forces.clone(),
            twists: from.twists.clone(),
            across_n: from.across_n,
            behind: Vec::new(),
            energy: Energy::default(),
            touches: Vec::new(),
            drag_n: Vec3::zeros(),
            correction: Correction::default(),
            stride: from.stride,
            unfinished: None,
            ..to.clone()
        };
        UnderWay {
            part_mm: part.part_mm,
            effort: part.effort,
            state,
            neighbourhood: self.newton.neighbourhood.clone(),
            shift: self.newton.last_shift,
            iterations,
        }
    }
}
