//! Steps of bounded cost, for real time.
//!
//! A step ends in the equilibrium after its command, however long that takes. A tick solves part after part of the
//! hands' motion, and ends when its linear solves are used up. An unfinished solution is stored with the state, which
//! stays the last equilibrium, and the next tick continues it; further hand motion is queued. So ticks follow the
//! same path of equilibria as steps. After a fold the device is seen on its way to rest: in each tick as far as its
//! solves permit.
//!
//! An error after a successful part is postponed to the next tick, which repeats it.
//!
//! A moving vessel and changing fields cannot wait: a tick ends at its own time. Their change is gone through like
//! hand motion, in parts if necessary, but with half of the solves; if these do not suffice the device relaxes at
//! its end as far as the other half permits.

use super::Environment;
use super::blocked::refuse_wedged;
use super::carried::taken_along;
use super::command::Sum;
use super::configuration::Start;
use super::extrapolation::Correction;
use super::hands::{Hand, Way, lengths, motions};
use super::state::{KirchhoffState, Ticking, UnderWay};
use super::substep::{Attempt, Effort, Found, Lost};
use super::workspace::{Tools, Work, Workspace};
use crate::contact::extension::check_inside;
use crate::device::line_mm;
use crate::methods::{Move, StepReport};
use crate::tuning::StepTuning;
use crate::{Error, Result};

/// Result of a tick.
#[derive(Debug)]
pub(super) enum Ticked {
    /// A new state.
    Moved,
    /// The device has not moved; with the largest motion of the hands in its next part, mm, and the unfinished work.
    Rests(f64, Ticking),
    /// The solves do not suffice to follow the vessel.
    Overtaken,
}

/// Progress of what changes around the device in a tick: the vessel and fields.
struct Change {
    /// Its part that is over, 0 to 1.
    done: f64,
    /// Largest share of it in the next part.
    most: f64,
    /// Whether the device relaxes at its end, however far away.
    overtaken: bool,
}

impl Change {
    /// The part of it that is over after the next part.
    fn to(&self) -> f64 {
        // A remainder at the level of rounding is ignored.
        let to = self.done + self.most;
        if self.overtaken || to > 1.0 - 1e-9 { 1.0 } else { to }
    }

    /// Its share in the next part.
    fn share(&self) -> f64 {
        self.to() - self.done
    }

    fn goes_on(&self) -> bool {
        self.done < 1.0
    }
}

/// A part of the hands' motion attempted by a tick.
struct Part<'a> {
    effort: Effort,
    /// Earlier ticks' progress in it.
    resumed: Option<&'a UnderWay>,
    /// The largest motion of a hand, mm; of a change without one, its part.
    part_mm: f64,
    /// Whether hands hold still while the device relaxes.
    holds_still: bool,
    /// Newton iterations of the relaxation so far.
    moving: usize,
}

impl<'a> Part<'a> {
    /// Sets `hands` to the positions after the next part: the unfinished one, or one of at most `longest_mm`.
    fn next(
        begun: &'a Ticking,
        (way, longest_mm): (&Way, f64),
        change: &Change,
        (hands, tuning): (&mut Vec<Hand>, &StepTuning),
    ) -> Self {
        let travel_mm = way.travel_mm(tuning.work_rad);
        let part = if travel_mm > longest_mm { longest_mm / travel_mm } else { 1.0 };
        let of_change_mm = if travel_mm == 0.0 { change.share() } else { 0.0 };
        let fresh = |effort: Effort| Self {
            effort,
            resumed: None,
            part_mm: part * travel_mm + of_change_mm,
            holds_still: false,
            moving: 0,
        };
        match begun {
            Ticking::Solving(under_way) => {
                hands.clone_from(&under_way.hands);
                Self { resumed: Some(under_way), part_mm: under_way.part_mm, ..fresh(Effort::Near) }
            }
            Ticking::Moving(moving @ 1..) => {
                hands.clone_from(&way.start);
                Self { holds_still: true, moving: *moving, ..fresh(Effort::Moving) }
            }
            Ticking::Rest | Ticking::Moving(0) => {
                way.at(part, hands);
                let near = matches!(begun, Ticking::Rest) && !change.overtaken;
                fresh(if near { Effort::Near } else { Effort::Moving })
            }
        }
    }

    /// Whether the result must be rejected: a device relaxed before a fold stays near.
    fn strays(&self, found: &Found, tuning: &StepTuning) -> bool {
        let moves = self.effort == Effort::Moving && !self.holds_still;
        moves && self.part_mm > tuning.fold_mm && found.off > 1.0
    }
}

/// How a tick goes on after a part that has failed.
enum After {
    /// With a part from rest.
    Rest,
    /// With a relaxation from a fold.
    Fold,
    /// In the next tick, with the unfinished solution.
    UnderWay,
    /// The device stays where it is.
    Stays,
    /// As a step, since what changes does not wait.
    Overtaken,
    /// Not at all.
    Fails,
}

/// Progress of a tick.
struct Course {
    /// Largest motion of the hands in the next part, mm.
    longest_mm: f64,
    /// Relaxation over a part up to this length, mm, may end nearby.
    let_go_mm: f64,
    /// What changes around the device.
    change: Change,
    /// Whether the vessel moves.
    vessel_moves: bool,
    /// Accumulated results.
    sum: Sum,
    /// Whether there is a new state.
    moved: bool,
    /// Whether the device rests there.
    rests: bool,
    tuning: StepTuning,
}

impl Course {
    fn new(environment: &Environment<'_>, from: &KirchhoffState) -> Self {
        let tuning = environment.options.tuning.steps;
        let vessel_moves = environment.surroundings.moves();
        let is_changed = vessel_moves || environment.surroundings.fields_change();
        // In a vessel that moves the relaxation goes on at its end.
        let overtaken = vessel_moves && matches!(from.tick, Ticking::Moving(1..));
        Self {
            longest_mm: from.stride.part_mm,
            let_go_mm: if environment.has_friction() { tuning.held_mm } else { tuning.fold_mm },
            change: Change { done: if is_changed { 0.0 } else { 1.0 }, most: 1.0, overtaken },
            vessel_moves,
            sum: Sum::default(),
            moved: false,
            rests: true,
            tuning,
        }
    }

    /// The linear solves after which no part begins, of those of the tick: with half of them a moving vessel does not
    /// wait any longer.
    fn within(&self, solves: usize) -> usize {
        if self.vessel_moves && self.change.goes_on() { solves / 2 } else { solves }
    }

    /// Goes on with parts of half this length.
    fn shorten(&mut self, part_mm: f64) {
        self.longest_mm = 0.5 * part_mm;
        self.change.most = 0.5 * self.change.share();
    }

    /// How to go on after a part that has failed.
    fn after(&mut self, lost: Lost, part: &Part<'_>) -> After {
        let change = &mut self.change;
        match (lost, part.effort) {
            (Lost::UnderWay, _) if !change.goes_on() || (change.to() == 1.0 && !self.vessel_moves) => {
                return After::UnderWay;
            }
            (Lost::UnderWay, _) => change.overtaken = true,
            _ if change.overtaken => return After::Overtaken,
            _ if part.holds_still && !change.goes_on() => return After::Stays,
            _ if part.holds_still => change.overtaken = true,
            (_, Effort::Moving) if part.part_mm <= self.tuning.fold_mm => return After::Fails,
            (_, Effort::Near) if part.part_mm <= self.let_go_mm => {
                self.longest_mm = part.part_mm;
                return After::Fold;
            }
            _ => self.shorten(part.part_mm),
        }
        After::Rest
    }

    /// Accepts the result of a part; `lies` tells whether the device hardly moved in it. Returns how to continue.
    fn take(&mut self, part: &Part<'_>, found: &Found, lies: bool, iterations: usize) -> Ticking {
        self.moved = true;
        let share = self.change.share();
        (self.change.done, self.change.overtaken) = (self.change.to(), false);
        self.rests = found.balanced || (part.holds_still && lies && found.residual <= self.tuning.at_rest);
        self.sum.add(found);
        self.sum.relaxations += u32::from(part.effort == Effort::Moving && !part.holds_still);
        if !self.rests {
            self.sum.note_imbalance(found);
        }
        if part.effort == Effort::Near && found.off < self.tuning.nearer {
            self.longest_mm = self.longest_mm.max(2.0 * part.part_mm);
            self.change.most = self.change.most.max(2.0 * share);
        }
        // A device that does not come to rest is left where it is, and reported as not in equilibrium.
        let is_short = part.moving + iterations <= self.tuning.longest;
        let goes_on = part.effort == Effort::Moving && !self.rests && is_short;
        if goes_on { Ticking::Moving(part.moving + iterations) } else { Ticking::Rest }
    }

    /// Writes the results, and the remaining motion of the hands, into the new state.
    fn write(&self, way: &Way, state: &mut KirchhoffState) {
        state.stride.part_mm = self.longest_mm;
        let report = &mut state.report;
        self.sum.write(report);
        report.converged = self.rests;
        report.behind = way.left(&state.tick);
    }
}

impl<const C: usize> Workspace<C> {
    /// Carries out moves, and motion left over by earlier ticks, from the state `from` in about `solves` linear
    /// solves. A new state is in `now`.
    ///
    /// # Errors
    /// As [`Method::tick`](crate::methods::Method::tick).
    pub(super) fn tick(
        &mut self,
        environment: &Environment<'_>,
        from: &KirchhoffState,
        moves: &[Move],
        solves: usize,
    ) -> Result<Ticked> {
        self.begin(environment, from, moves)?;
        let Self { tools, mesh, now, next, way, hands, .. } = self;
        let tuning = &environment.options.tuning.steps;
        let surroundings = &environment.surroundings;
        let mut displaced = surroundings.displacement(0.0);
        let mut course = Course::new(environment, from);
        let (rest, fold, mut moving);
        (rest, fold) = (Ticking::Rest, Ticking::Moving(0));
        // An unfinished solution is of the vessel where it was.
        let mut begun = if course.vessel_moves { &rest } else { &from.tick };
        // Remaining work, or the error that ends the tick.
        let ends = loop {
            let (parts, within) = (course.sum.substeps, course.within(solves));
            let spent = tools.work.solves + tuning.of_a_part * parts;
            if parts > 0 && spent >= solves && !course.change.goes_on() {
                break Ok(begun.clone());
            }
            if course.change.goes_on() && spent >= within && !course.change.overtaken {
                (course.change.overtaken, begun) = (true, &rest);
            }
            let was = if course.moved { now.start() } else { Start { mesh, state: from } };
            let part = Part::next(begun, (way, course.longest_mm), &course.change, (hands, tuning));
            let Part { effort, resumed, part_mm, .. } = part;
            let to = course.change.to();
            let then = surroundings.displacement(to);
            let passage = displaced.as_ref().zip(then.as_ref()).filter(|(before, after)| before != after);
            let taken = taken_along(was, passage);
            let here = taken.as_ref().map_or(was, |state| Start { mesh: was.mesh, state });
            let there = environment.displaced(then.as_ref()).with_fields_at(to);
            course.sum.substeps += 1;
            if line_mm(lengths(hands)) == 0.0 && tools.joined.is_empty() {
                motions(&was.state.report, hands, &mut tools.guess.motions);
                now.withdraw(surroundings.stack, hands);
                course.sum.rub(tools.write_report(&there, hands, now));
                (course.moved, course.rests) = (true, true);
                way.go_on_from(hands);
                break Ok(Ticking::Rest);
            }
            let before = tools.work;
            let most = tuning.most_near.saturating_sub(resumed.map_or(0, |under_way| under_way.iterations));
            let allowed = if course.change.overtaken { solves } else { within };
            let solves_left = allowed.saturating_sub(before.solves).max(1);
            let left = passage.map(|passage| (was, passage));
            let attempted = Attempt { hands, part_mm, effort, most, solves: solves_left, left, resumed };
            match tools.try_step(&there, here, attempted, next) {
                Ok(found) if part.strays(&found, tuning) && !course.change.overtaken => {
                    course.shorten(part_mm);
                    begun = &rest;
                }
                Ok(found) => {
                    let tip_mm = there.wall().material(&next.state.tip_mm());
                    if let Err(left) = check_inside(surroundings.lumen.openings(), &tip_mm, 0.0) {
                        break Err(left);
                    }
                    let way_mm = here.state.rod.farthest_mm(&next.state.rod);
                    let lies = way_mm <= tuning.rest_radii * surroundings.device.min_radius_mm();
                    moving = course.take(&part, &found, lies, tools.work.since(&before));
                    std::mem::swap(now, next);
                    way.go_on_from(hands);
                    (displaced, begun) = (then, &moving);
                    if matches!(moving, Ticking::Rest) && way.is_done() && !course.change.goes_on() {
                        break Ok(Ticking::Rest);
                    }
                }
                Err(lost) => match course.after(lost, &part) {
                    After::Rest => begun = &rest,
                    After::Fold => {
                        let at_start = environment.displaced(displaced.as_ref());
                        if let Err(wedged) = refuse_wedged(&at_start, here, &way.commands) {
                            break Err(wedged);
                        }
                        begun = &fold;
                    }
                    After::UnderWay => {
                        let under_way =
                            tools.under_way(&part, hands, &next.state, (from, before), tuning.most_near);
                        break Ok(Ticking::Solving(Box::new(under_way)));
                    }
                    After::Stays => break Ok(Ticking::Rest),
                    After::Overtaken => return Ok(Ticked::Overtaken),
                    After::Fails => {
                        let inserted_mm = line_mm(lengths(&way.start));
                        let told = format!("no equilibrium beyond {inserted_mm:.3} mm inserted: {lost}");
                        break Err(Error::Computation(format!("kirchhoff: {told}")));
                    }
                },
            }
        };
        if !course.moved {
            return ends.map(|begun| Ticked::Rests(course.longest_mm, begun));
        }
        let state = now.parts().1;
        state.tick = ends.unwrap_or_default();
        course.write(way, state);
        state.report.angles = from.report.angles;
        tools.work.write(&mut state.report, from.report.nodes_solved);
        Ok(Ticked::Moved)
    }
}

impl<const C: usize> Tools<C> {
    /// Stores an unfinished part, with the state `to` of its solution; `before` is the work of the tick before the
    /// part, and `most` the largest number of iterations of it.
    fn under_way(
        &mut self,
        part: &Part<'_>,
        hands: &[Hand],
        to: &KirchhoffState,
        (from, before): (&KirchhoffState, Work),
        most: usize,
    ) -> UnderWay {
        let iterations = self.work.since(&before) + part.resumed.map_or(0, |resumed| resumed.iterations);
        // They are counted once, with the state that the part leads to.
        self.work.nodes_solved = before.nodes_solved;
        // Only its configuration and knowledge of the wall matter.
        let report = StepReport { angles: from.report.angles, ..StepReport::default() };
        let (correction, stride, tick) = (Correction::default(), from.stride, Ticking::Rest);
        UnderWay {
            hands: hands.to_vec(),
            part_mm: part.part_mm,
            state: KirchhoffState { correction, stride, tick, report, ..to.clone() },
            neighbourhood: self.newton.neighbourhood.clone(),
            shift: self.newton.last_shift,
            iterations: iterations.min(most.saturating_sub(1)),
        }
    }
}
