//! The course of a command: which part comes next, and what has become of the parts so far.

use super::Environment;
use super::hands::{Hand, Way, largest_mm};
use super::part::{Effort, Found, Limits, Lost};
use super::report::Took;
use super::state::{Flight, KirchhoffState, UnderWay, Unfinished};
use super::step_control::{StepControl, Stride};
use super::substep::Part;
use super::sum::Sum;
use super::workspace::Work;
use crate::methods::{Command, Move};
use crate::tuning::StepTuning;

/// What changes around the device while a command is carried out: the vessel and fields. It does not wait.
#[derive(Debug, Clone, Copy)]
struct Change {
    /// How much of it is over, 0 to 1.
    done: f64,
    /// Whether the vessel moves.
    vessel_moves: bool,
    /// Whether the solves do not suffice to go through it in parts: the device then relaxes at its end.
    overtakes: bool,
}

impl Change {
    fn goes_on(&self) -> bool {
        self.done < 1.0
    }
}

/// How a command goes on after a rejected part.
pub(super) enum Next {
    /// With another part.
    Part,
    /// In the next command, with the unfinished solution.
    Later,
    /// Not at all: the device stays where it is.
    Nothing,
    /// Again from its start, with as many solves as it needs: what changes does not wait.
    Step,
    /// With an error.
    Error,
}

/// The course of a command.
pub(super) struct Course<'a> {
    tuning: &'a StepTuning,
    control: StepControl,
    /// The solution that the last command has begun.
    begun: Option<&'a UnderWay>,
    /// The solution that this one leaves unfinished.
    pub(super) under_way: Option<UnderWay>,
    /// The relaxation in progress.
    flight: Option<Flight>,
    change: Change,
    /// Results of the parts so far.
    sum: Sum,
    /// Whether a part was accepted.
    pub(super) moved: bool,
    /// Whether the device rests in equilibrium after it.
    balanced: bool,
    /// Linear solves after which it ends, done or not.
    pub(super) most_solves: usize,
}

impl<'a> Course<'a> {
    /// Begins with the motion of a command, or goes on with that of the last one.
    pub(super) fn new(
        environment: &Environment<'a>,
        from: &'a KirchhoffState,
        (way, moves): (&Way, &[Move]),
    ) -> Self {
        let surroundings = &environment.surroundings;
        let (vessel_moves, fields_change) = (surroundings.moves(), surroundings.fields_change());
        let tuning = &environment.options.tuning.steps;
        let most = tuning.work_of_one.saturating_mul(environment.options.max_iterations);
        let per_mm = tuning.work * surroundings.course.map_or(1.0, |_| tuning.work_of_course);
        let work = |travel_mm: f64| ((per_mm * travel_mm) as usize).min(most);
        let travel_mm = way.travel_mm(tuning);
        let unfinished = from.unfinished.as_deref();
        let control = match unfinished {
            Some(unfinished) => {
                let asked = moves.iter().map(|one| one.command);
                unfinished.control.more(work(largest_mm(asked, tuning)), most)
            }
            None => {
                let control = StepControl::new(
                    work(travel_mm.max(1.0)),
                    from.stride,
                    environment.has_friction(),
                    tuning.again,
                );
                // Something was released.
                let set_free = travel_mm == 0.0 && !vessel_moves && !fields_change;
                if set_free { control.set_free() } else { control }
            }
        };
        let done = if vessel_moves || fields_change { 0.0 } else { 1.0 };
        Self {
            tuning,
            control,
            // An unfinished solution is of the vessel where it was.
            begun: unfinished.filter(|_| !vessel_moves).and_then(|unfinished| unfinished.part.as_ref()),
            under_way: None,
            flight: unfinished.and_then(|unfinished| unfinished.flight),
            change: Change { done, vessel_moves, overtakes: false },
            sum: Sum::default(),
            moved: false,
            balanced: true,
            most_solves: most_solves(&way.commands, tuning),
        }
    }

    /// Number of parts tried.
    pub(super) fn parts(&self) -> usize {
        self.sum.parts
    }

    /// Whether hands and what changes are where they should be, after at least one part.
    fn is_there(&self, way: &Way) -> bool {
        self.moved && way.is_done() && !self.change.goes_on()
    }

    /// Whether the command is done. A device that is not in equilibrium at its end goes on from there.
    pub(super) fn is_over(&self, way: &Way) -> bool {
        let rests = self.balanced || self.control.again() == 0;
        self.is_there(way) && self.flight.is_none() && rests
    }

    /// Whether a command of so many solves ends here. A change that goes on is completed, by relaxation.
    pub(super) fn pauses(&mut self, work: &Work, solves: usize) -> bool {
        let used = work.solves.saturating_add(self.tuning.of_a_part * self.sum.parts);
        if self.change.goes_on() {
            self.change.overtakes |= used >= self.within(solves);
            return false;
        }
        self.sum.parts > 0 && used >= solves
    }

    /// The linear solves of a command after which no part begins: with half of them a moving vessel does not wait any
    /// longer.
    fn within(&self, solves: usize) -> usize {
        if self.change.vessel_moves && self.change.goes_on() { solves / 2 } else { solves }
    }

    /// What a part may cost in a command of so many solves, with this work before it.
    pub(super) fn limits(&self, part: &Part<'_>, before: &Work, solves: usize) -> Limits {
        let most = if self.change.overtakes { solves } else { self.within(solves) };
        let iterations = match part.effort {
            Effort::Near | Effort::Held => self.control.budget(),
            Effort::Flight => {
                let taken = self.flight.map_or(0, |flight| flight.iterations);
                self.tuning.longest.saturating_sub(taken).max(1)
            }
        };
        Limits { iterations, solves: most.saturating_sub(before.solves).max(1) }
    }

    /// The next part, and the positions of the hands after it in `hands`: the unfinished one, the relaxation in
    /// progress, or another part of the motion. What changes around the device goes on in proportion.
    pub(super) fn propose(&mut self, way: &Way, hands: &mut Vec<Hand>) -> Part<'a> {
        self.sum.parts += 1;
        let still = Part { effort: Effort::Flight, part_mm: 0.0, to: 1.0, holds_still: true, resumed: None };
        if let Some(begun) = self.begun.take() {
            hands.clone_from(&begun.state.hands);
            let (effort, part_mm) = (begun.effort, begun.part_mm);
            return Part { effort, part_mm, resumed: Some(begun), holds_still: false, ..still };
        }
        if self.flight.is_some() {
            hands.clone_from(&way.start);
            return still;
        }
        if self.is_there(way) {
            self.control.try_again();
        }
        let travel_mm = way.travel_mm(self.tuning);
        // A change without motion of the hands counts as a millimetre.
        let rest_mm = if travel_mm > 0.0 { travel_mm } else { 1.0 - self.change.done };
        let (effort, part_mm) = self.control.next(rest_mm);
        // A remainder at the level of rounding is ignored.
        let part = if part_mm >= (1.0 - 1e-9) * rest_mm { 1.0 } else { part_mm / rest_mm };
        way.at(part, hands);
        let to = if part == 1.0 { 1.0 } else { self.change.done + part * (1.0 - self.change.done) };
        match self.change.overtakes {
            true => Part { part_mm, holds_still: false, ..still },
            false => Part { effort, part_mm, to, holds_still: self.is_there(way), resumed: None },
        }
    }

    /// Subtracts the Newton iterations of a part from those allowed.
    pub(super) fn took(&mut self, iterations: usize) {
        self.control.took(iterations);
    }

    /// Whether the device came to rest with energy that nobody put in, so that the part was too long: then it is
    /// shortened.
    pub(super) fn shortens(&mut self, part: &Part<'_>, found: &Found) -> bool {
        let is_too_long = found.lacks && !found.is_interrupted && !self.change.overtakes;
        let shortens = is_too_long && self.control.can_shorten(part.part_mm, self.tuning);
        if shortens {
            self.control.shorten(part.part_mm);
        }
        shortens
    }

    /// Takes the result of a part, in which the device barely moved if it `lies` still, after so many iterations.
    pub(super) fn accept(&mut self, part: &Part<'_>, found: &Found, lies: bool, iterations: usize) {
        // At a crease of the wall forces switch between both sides and never balance; if nothing moves any more the
        // device is in equilibrium all the same.
        let rests = part.holds_still && lies && found.residual <= self.tuning.at_rest;
        self.balanced = (found.balanced && !found.lacks) || rests;
        let overtook = self.change.overtakes;
        (self.moved, self.change.done, self.change.overtakes) = (true, part.to, false);
        let begun = self.flight.take();
        self.sum.relaxations += u32::from(part.effort == Effort::Flight && begun.is_none());
        let flight = begun.unwrap_or(Flight::over(part.part_mm)).with(found, iterations);
        if found.is_interrupted && !rests && flight.iterations < self.tuning.longest {
            self.flight = Some(flight);
        } else {
            self.sum.add(&flight, part.effort);
            if !overtook {
                self.control.succeeded(flight.part_mm, found, self.tuning);
            }
        }
        self.sum.go_on(found, part.effort);
    }

    /// How to go on after a part that has failed.
    pub(super) fn reject(&mut self, part: &Part<'_>, lost: Lost) -> Next {
        if lost == Lost::UnderWay && (!self.change.goes_on() || (part.to == 1.0 && !self.change.vessel_moves))
        {
            return Next::Later;
        }
        if self.change.overtakes {
            return Next::Step;
        }
        if self.change.goes_on() && (lost == Lost::UnderWay || part.holds_still) {
            self.change.overtakes = true;
            return Next::Part;
        }
        // A second attempt from the same state would give the same result.
        if part.holds_still {
            self.flight = None;
            self.balanced = false;
            return Next::Nothing;
        }
        if self.control.failed(part.part_mm, lost, self.tuning) || self.sum.parts > self.tuning.substep_limit
        {
            return Next::Error;
        }
        Next::Part
    }

    /// All instruments were pulled out, with this energy dissipated by friction outside the body, mJ.
    pub(super) fn withdrawn(&mut self, dissipated_mj: f64) {
        self.sum.rub(dissipated_mj);
        (self.moved, self.balanced, self.flight, self.change.done) = (true, true, None, 1.0);
    }

    /// Whether the command ends without an equilibrium.
    pub(super) fn has_failed(&self, way: &Way) -> bool {
        self.is_there(way) && !self.balanced && self.flight.is_none()
    }

    /// Step size, remaining motion of the hands, and what the next command goes on with; neither if the command is done.
    pub(super) fn rest(self, way: &Way) -> Rest {
        let Self { control, under_way: part, flight, .. } = self;
        let stride = control.stride();
        if way.is_done() && part.is_none() && flight.is_none() {
            return Rest { stride, behind: Vec::new(), unfinished: None };
        }
        let unfinished = Some(Box::new(Unfinished { control, part, flight }));
        Rest { stride, behind: way.left(), unfinished }
    }

    /// Writes what is left into the new state, and returns what the command took.
    pub(super) fn end(self, way: &Way, work: Work, state: &mut KirchhoffState) -> Took {
        // A device on its way is in no equilibrium, however small its forces are.
        let took = Took { sum: self.sum, work, converged: self.balanced && self.flight.is_none() };
        self.rest(way).write(state);
        took
    }
}

/// The largest number of linear solves of a command with these motions, apart from those of the iteration in progress.
pub(super) fn most_solves(motions: &[Command], tuning: &StepTuning) -> usize {
    tuning.most_solves(largest_mm(motions.iter().copied(), tuning))
}

/// What is left of a command.
#[derive(Debug)]
pub(super) struct Rest {
    stride: Stride,
    behind: Vec<Command>,
    unfinished: Option<Box<Unfinished>>,
}

impl Rest {
    pub(super) fn write(self, state: &mut KirchhoffState) {
        (state.stride, state.behind, state.unfinished) = (self.stride, self.behind, self.unfinished);
    }
}
