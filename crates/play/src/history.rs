//! All steps of a session, done and undone, and states to go back and forth to.

use endowire_core::Result;
use endowire_core::insertion::{Move, Simulation, State, Step, StepReport};
use endowire_core::vessel::VesselMotion;
use endowire_viewer::InjectionSpec;

use crate::hand::Motion;
use crate::readout::Went;
use crate::script::{self, Lines};

/// A state is kept each so many steps at first: those between are carried out once more, which takes less than a second.
const EVERY: usize = 64;
/// Most states that are kept, of some hundred kilobytes each: where there are more every other one goes. Of a vessel that moves for an hour
/// there is one each 512 steps then.
const MOST_STATES: usize = 512;

/// Contrast medium that a hand has injected.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Injected {
    /// Number of the instrument that it went through; none where none with a lumen was in.
    pub(crate) instrument: Option<usize>,
    /// Volume and rate, as they were given.
    pub(crate) ml: f64,
    pub(crate) ml_per_s: f64,
    /// Steps carried out before it.
    pub(crate) after_step: usize,
    /// What flows of it.
    pub(crate) flow: InjectionSpec,
}

/// A step that was carried out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Done {
    /// None where hands rest and a vessel moves.
    pub(crate) motions: Vec<Motion>,
    /// How many such steps a second has.
    pub(crate) per_s: f64,
    /// The instrument that leaves its coil behind in this step, in which nothing else moves.
    pub(crate) detach: Option<usize>,
    /// Linear solves, where it is a tick.
    pub(crate) solves: Option<usize>,
}

impl Done {
    /// Carries the step out; where the vessel moves, time goes by as it does in the script's line.
    ///
    /// # Errors
    /// As [`Step::carry_out`].
    pub(crate) fn carry_out<'a>(&self, simulation: &'a mut Simulation) -> Result<&'a StepReport> {
        let moves: Vec<Move> = self.motions.iter().map(|motion| motion.as_move()).collect();
        let duration_s = script::step_s(self, 1);
        let time_s = moves_by_itself(simulation).then(|| simulation.time_s() + duration_s);
        let (detach, solves) = (self.detach, self.solves);
        Step { moves: moves.into(), detach, solves, time_s, duration_s }.carry_out(simulation)
    }
}

/// Whether the vessel moves while hands rest.
pub(crate) fn moves_by_itself(simulation: &Simulation) -> bool {
    simulation.motion().is_some_and(VesselMotion::changes)
}

/// What was done, step by step. What was undone stays behind it until something else is done.
#[derive(Debug)]
pub(crate) struct History {
    steps: Vec<Done>,
    /// How many of the steps are done; those after them are undone.
    done: usize,
    /// How all steps up to each went, the first before any.
    went: Vec<Went>,
    /// State after step `every · index`.
    states: Vec<State>,
    every: usize,
    most_states: usize,
    /// Steps after which a hand began to move.
    begun: Vec<usize>,
    /// Whether a hand begins to move with the next step.
    begins: bool,
    /// By their steps.
    injected: Vec<Injected>,
}

impl History {
    pub(crate) fn new(start: &Simulation) -> Self {
        let states = vec![start.state()];
        Self {
            steps: Vec::new(),
            done: 0,
            went: vec![Went::default()],
            states,
            every: EVERY,
            most_states: MOST_STATES,
            begun: Vec::new(),
            begins: false,
            injected: Vec::new(),
        }
    }

    pub(crate) fn steps(&self) -> usize {
        self.done
    }

    /// How the steps that are done went.
    pub(crate) fn went(&self) -> Went {
        self.went[self.done]
    }

    /// Notes that a motion begins with the next step.
    pub(crate) fn begin_motion(&mut self) {
        self.begins = true;
    }

    /// Where the last motion began, before this moment.
    pub(crate) fn last_motion(&self) -> usize {
        self.begun.iter().rev().copied().find(|step| *step < self.done).unwrap_or(0)
    }

    /// Where the next motion of those that were undone ended.
    pub(crate) fn next_motion(&self) -> usize {
        self.begun.iter().copied().find(|step| *step > self.done).unwrap_or(self.steps.len())
    }

    /// Adds a step that `after` has just carried out.
    pub(crate) fn push(&mut self, step: Done, after: &Simulation) {
        self.forget_undone();
        if std::mem::take(&mut self.begins) {
            self.begun.push(self.done);
        }
        self.steps.push(step);
        self.went.push(self.went().and(after.report()));
        self.done += 1;
        if self.done.is_multiple_of(self.every) {
            self.states.push(after.state());
        }
        if self.states.len() > self.most_states {
            self.states = std::mem::take(&mut self.states).into_iter().step_by(2).collect();
            self.every *= 2;
        }
    }

    /// Adds an injection that begins now.
    pub(crate) fn inject(&mut self, injected: Injected) {
        self.forget_undone();
        self.injected.push(injected);
    }

    fn forget_undone(&mut self) {
        let done = self.done;
        self.steps.truncate(done);
        self.went.truncate(done + 1);
        self.states.truncate(done / self.every + 1);
        self.begun.retain(|begun| *begun < done);
        self.injected.retain(|one| one.after_step <= done);
    }

    /// Brings the simulation to the moment after step `step` of those there are, forth or back.
    ///
    /// # Errors
    /// As [`Simulation::step_until`]; steps that were carried out once can be again.
    pub(crate) fn go_to(&mut self, step: usize, simulation: &mut Simulation) -> Result<()> {
        let kept = step / self.every;
        simulation.restore(&self.states[kept])?;
        for done in &self.steps[kept * self.every..step] {
            done.carry_out(simulation)?;
        }
        self.done = step;
        self.begins = false;
        Ok(())
    }

    /// Injections that are undone, by their steps.
    pub(crate) fn undone_injections(&self) -> impl Iterator<Item = &Injected> {
        self.injected.iter().filter(|one| one.after_step > self.done)
    }

    /// Lets those that were undone before and are not any more begin at `time_s`; what flows of them.
    pub(crate) fn inject_again(&mut self, before: usize, time_s: f64) -> Vec<InjectionSpec> {
        let again = |one: &&mut Injected| (before + 1..=self.done).contains(&one.after_step);
        let flow = |one: &mut Injected| {
            one.flow.start_s = time_s;
            one.flow.clone()
        };
        self.injected.iter_mut().filter(again).map(flow).collect()
    }

    /// What is done, as a script.
    pub(crate) fn script(&self, simulation: &Simulation) -> String {
        let injected = self.injected.iter().filter(|one| one.after_step <= self.done);
        let lines = Lines { stack: simulation.stack(), timed: moves_by_itself(simulation) };
        lines.of(&self.steps[..self.done], injected)
    }
}

#[cfg(test)]
mod tests {
    use endowire_core::device::Device;
    use endowire_core::insertion::Sheath;
    use endowire_core::vessel::{GeneratedWall, Resolution, anatomy};

    use super::*;

    #[test]
    fn states_are_few_and_any_moment_can_be_had_again() {
        let made =
            GeneratedWall::new(&anatomy::tree("curved_tube").unwrap(), Resolution::EdgeMm(2.0)).unwrap();
        let sheath = Sheath::at_opening(&made.wall, made.inlet, 1.0).unwrap();
        let wire = Device::uniform(300.0, 0.445, 10.0).unwrap();
        let mut simulation = Simulation::builder(made.wall, wire, sheath).build().unwrap();
        let mut history = History::new(&simulation);
        (history.every, history.most_states) = (4, 5);
        let mut tips = vec![simulation.shape().tip_mm()];
        let mut went = vec![history.went()];
        for k in 0..150 {
            let advance_mm = if k % 5 == 4 { -0.3 } else { 0.7 };
            let motions = vec![Motion { instrument: 0, advance_mm, rotate_deg: 0.0 }];
            let step = Done { motions, per_s: 60.0, detach: None, solves: None };
            step.carry_out(&mut simulation).unwrap();
            history.push(step, &simulation);
            tips.push(simulation.shape().tip_mm());
            went.push(history.went());
            assert!(history.states.len() <= 5 && history.states.len() == history.done / history.every + 1);
        }
        assert_eq!(history.every, 32);
        for step in [150, 3, 64, 127, 0, 128, 149] {
            history.go_to(step, &mut simulation).unwrap();
            assert_eq!(simulation.shape().tip_mm(), tips[step], "{step}");
            assert_eq!(history.went(), went[step], "{step}");
        }
    }

    #[test]
    fn what_went_otherwise_is_counted() {
        let report = |converged, jumped, relaxations| StepReport {
            converged,
            jumped,
            relaxations,
            ..StepReport::default()
        };
        let steps = [report(true, false, 0), report(false, true, 2), report(false, false, 1)];
        let went = steps.iter().fold(Went::default(), Went::and);
        assert_eq!(went, Went { unconverged_steps: 2, jumps: 1, relaxations: 3 });
    }
}
