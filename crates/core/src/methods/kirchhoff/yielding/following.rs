//! Course and device follow each other until both are in equilibrium: each round is a step of the course, in which the
//! device is sought anew.

use std::convert::Infallible;

use super::{Follows, Yielding};
use crate::Vec3;
use crate::contact::Touch;
use crate::methods::kirchhoff::Environment;
use crate::methods::kirchhoff::configuration::Configuration;
use crate::methods::kirchhoff::mesh::Mesh;
use crate::methods::kirchhoff::part::{Effort, Limits, Lost};
use crate::methods::kirchhoff::search::{Beginning, Bounds, Judged, Searched};
use crate::methods::kirchhoff::state::KirchhoffState;
use crate::methods::kirchhoff::workspace::Tools;
use crate::rod::RodState;
use crate::solve::StopReason;

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

    /// How far it moves the vessel, mm.
    fn farthest_mm(&self) -> f64 {
        self.step_mm.iter().map(Vec3::norm).fold(0.0, f64::max)
    }

    /// The part by which to go back, negative, where the energy `rises` at its end by more than this of the slope by which it
    /// fell at its beginning: to where it neither falls nor rises, its slope taken as linear.
    fn back(&mut self, end: &Follows, rises: f64) -> Option<f64> {
        let rises_mj = slope_mj(&end.off_n, &self.step_mm);
        if rises_mj <= rises * self.falls_mj {
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

/// What stays the same in all rounds of a part.
struct Task<'a, 'b> {
    environment: &'a Environment<'b>,
    mesh: &'a Mesh,
    effort: Effort,
    limits: Limits,
    may_snap: bool,
}

/// Where a round begins, and how far it goes along a step of the course.
struct Round<'a> {
    before: &'a RodState,
    from_mm: &'a [Vec3],
    line: &'a Line,
    /// The part of the step to go.
    part: f64,
    /// ε at its beginning and at its end, mm.
    stick_mm: [f64; 2],
}

/// The device, which is moved.
struct Device<'a> {
    rod: &'a mut RodState,
    touches: &'a mut Vec<(usize, Touch)>,
}

impl<const C: usize> Tools<C> {
    /// Lets the course follow an equilibrium of the device, and the device the course, until both are in equilibrium.
    pub(in crate::methods::kirchhoff) fn follow_course(
        &mut self,
        environment: &Environment<'_>,
        (first, effort, limits, may_snap): (Searched, Effort, Limits, bool),
        course: &mut Yielding<'_>,
        next: &mut Configuration,
    ) -> Searched {
        let tuning = &environment.options.tuning.course;
        let (mesh, after) = next.parts();
        let KirchhoffState { rod, touches, .. } = after;
        let task = Task { environment, mesh, effort, limits, may_snap };
        let mut searched = first;
        let mut line: Option<Line> = None;
        let mut widens = effort != Effort::Flight;
        for _ in 0..tuning.most_rounds {
            let Some(follows) = searched.follows.take() else { return searched };
            let before = rod.clone();
            let from_mm = course.amplitudes_mm.clone();
            let stick_mm = self.friction.stick_mm();
            let mut next_stick_mm = follows.stick_mm.min(stick_mm);
            if next_stick_mm < stick_mm {
                // The energy along the last step was that of another friction.
                line = None;
            }
            let back = line.as_mut().and_then(|line| line.back(&follows, tuning.rises));
            let part = back.unwrap_or_else(|| {
                let (turn_rad, _) = RodState::largest_turn::<C>(&mesh.elements, &before, &follows.way);
                let part = (tuning.most_turn_rad / turn_rad).min(1.0);
                line = Some(Line::of(follows, &from_mm, part));
                part
            });
            let Some(along) = &line else { return searched };
            // What relaxes shrinks ε itself, from one solution to the next.
            let is_wider = widens && back.is_some() && searched.slides == 0 && stick_mm.is_finite();
            if is_wider {
                next_stick_mm = along.farthest_mm().max(stick_mm);
                widens = false;
            }
            let stick_mm = [stick_mm, next_stick_mm];
            let round = Round { before: &before, from_mm: &from_mm, line: along, part, stick_mm };
            let device = Device { rod: &mut *rod, touches: &mut *touches };
            let Some((again, left)) = self.go(&task, &round, course, device, searched.taken) else {
                return searched;
            };
            line = line.filter(|_| !is_wider);
            if let Some(line) = &mut line {
                line.gone -= left;
            }
            searched = searched.then(again);
        }
        let wrong = Some(Lost::Unsolved(StopReason::Unsettled, searched.found.residual));
        Searched { wrong, ..searched }
    }

    /// Goes along a step of the course with the device, half as far where the device is not found at its end and has not gone
    /// so far that it snaps. What was found with all that it took beside what was `taken` before, and how much of the step is
    /// left; none where the vessel cannot be displaced so.
    fn go(
        &mut self,
        task: &Task<'_, '_>,
        round: &Round<'_>,
        course: &mut Yielding<'_>,
        mut device: Device<'_>,
        taken: (usize, usize),
    ) -> Option<(Searched, f64)> {
        let Task { environment, mesh, limits, .. } = *task;
        let Round { before, line, part: whole, stick_mm: [stick_mm, next_stick_mm], .. } = *round;
        let tuning = &environment.options.tuning;
        let (most_mm, is_flight) = (course.most_mm(environment), task.effort == Effort::Flight);
        let farthest_mm = line.farthest_mm();
        let mut failed = (0, 0);
        // Where the device was sought last on this step.
        let (mut part, mut sought) = (1.0, 0.0);
        loop {
            let gone = whole * part;
            let steps = round.from_mm.iter().zip(&line.step_mm);
            let amplitudes_mm: Vec<Vec3> = steps.map(|(from, step)| from + step * gone).collect();
            let moved = environment.surroundings.displacement(course.to, &amplitudes_mm)?;
            self.friction.go_with((&course.displacement, &moved));
            let moved_mm = (whole * (part - sought)).abs() * farthest_mm * moved.stretch();
            (course.amplitudes_mm, course.displacement) = (amplitudes_mm, moved);
            if next_stick_mm != stick_mm {
                self.friction.stick_at(next_stick_mm + (stick_mm - next_stick_mm) * (1.0 - part));
            }
            let way: Vec<f64> = line.way.iter().map(|value| value * gone).collect();
            let there = environment.displaced(Some(&course.displacement));
            let judged =
                Judged { course: Some((course, most_mm)), before: 0, may_snap: task.may_snap || is_flight };
            let mut search = |effort: Effort, failed: (usize, usize)| {
                let left = limits.iterations.saturating_sub(taken.0 + failed.0);
                let bounds = Bounds {
                    effort,
                    most: if effort == Effort::Flight { left } else { left.min(tuning.steps.following) },
                    most_solves: limits.solves.saturating_sub(taken.1 + failed.1),
                    resumed: None,
                    moved_mm: Some(moved_mm),
                };
                self.search_on(&there, (mesh, &mut device), bounds, (before, &way), &judged)
            };
            // With friction that follows; a device in flight may snap once more.
            let mut again = search(Effort::Near, failed);
            let is_lost = again.wrong.is_some_and(|wrong| wrong != Lost::UnderWay);
            // One that has gone far is on its way to where it snaps.
            let shortens = is_lost && !is_flight && part > tuning.course.least_part && again.off <= 1.0;
            if shortens || (is_lost && is_flight) {
                failed = (failed.0 + again.taken.0, failed.1 + again.taken.1);
            }
            if shortens {
                // The end of a shorter step is nearer.
                (sought, part) = (part, 0.5 * part);
                continue;
            }
            if is_lost && is_flight {
                again = search(Effort::Flight, failed);
            }
            again.taken = (failed.0 + again.taken.0, failed.1 + again.taken.1);
            return Some((again, whole * (1.0 - part)));
        }
    }

    /// Searches from where a device that was in equilibrium in `before` is after this motion.
    fn search_on(
        &mut self,
        environment: &Environment<'_>,
        (mesh, Device { rod, touches }): (&Mesh, &mut Device<'_>),
        bounds: Bounds,
        (before, way): (&RodState, &[f64]),
        judged: &Judged<'_>,
    ) -> Searched {
        let elements = &mesh.elements;
        let begin = |Beginning { newton, guess, contact, state, .. }: Beginning<'_, '_, C>| {
            state.advance::<C>(elements, before, way, 1.0);
            state.take_tensions::<C>(elements, before, way);
            if contact.is_outside(elements, state) {
                state.copy_from(before);
            }
            contact.rooms(elements, state, &mut guess.room_mm);
            newton.neighbourhood.begin(state, &guess.room_mm, &environment.options.tuning.newton);
            Ok::<_, Infallible>(())
        };
        let stack = environment.surroundings.stack;
        let Ok(found) = self.with_search(environment, (mesh, stack, rod), bounds, begin, |search, lagged| {
            search.searched(lagged, judged, touches)
        });
        found
    }
}
