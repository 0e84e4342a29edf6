//! All steps of a session, done and undone, with saved states for going to any step.

use endowire_core::Result;
use endowire_core::insertion::{Move, Simulation, State, Step, StepReport};
use endowire_core::vessel::VesselMotion;
use endowire_viewer::InjectionSpec;

use crate::hand::Motion;
use crate::readout::Went;
use crate::script::{self, Lines};

/// Initial interval, in steps, between saved states: steps in between are repeated, which takes less than a second.
const EVERY: usize = 64;
/// Largest number of saved states, of some hundred kilobytes each. If there are more, every other one is dropped; in
/// a vessel that moves for an hour, one in 512 steps then remains.
const MOST_STATES: usize = 512;

/// An injection of contrast medium by the operator.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Injected {
    /// Index of the instrument that it went through; `None` if no instrument with a lumen was inserted.
    pub(crate) instrument: Option<usize>,
    /// Volume and rate as requested.
    pub(crate) ml: f64,
    pub(crate) ml_per_s: f64,
    /// Number of steps carried out before it.
    pub(crate) after_step: usize,
    /// The injection in the pictures.
    pub(crate) flow: InjectionSpec,
}

/// A step that was carried out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Done {
    /// Empty if the operator rests and only the vessel moves.
    pub(crate) motions: Vec<Motion>,
    /// Number of such steps per second.
    pub(crate) per_s: f64,
    /// The instrument that detaches its coil in this step; nothing else moves then.
    pub(crate) detach: Option<usize>,
    /// Limit of linear solves, if the step is a tick.
    pub(crate) solves: Option<usize>,
}

impl Done {
    /// Carries out the step. In a moving vessel, time advances as in a script line.
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

/// Whether the vessel moves while the operator rests.
pub(crate) fn moves_by_itself(simulation: &Simulation) -> bool {
    simulation.motion().is_some_and(VesselMotion::changes)
}

/// All steps. Those that were undone are kept until something else is done.
#[derive(Debug)]
pub(crate) struct History {
    steps: Vec<Done>,
    /// Number of steps that are done; later ones are undone.
    done: usize,
    /// Totals after each number of steps, starting with none.
    went: Vec<Went>,
    /// State after step `every · index`.
    states: Vec<State>,
    every: usize,
    most_states: usize,
    /// Numbers of steps after which a motion began.
    begun: Vec<usize>,
    /// Whether a motion begins with the next step.
    begins: bool,
    /// In order of steps.
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

    /// Whether steps were undone and can be done again.
    pub(crate) fn has_undone(&self) -> bool {
        self.done < self.steps.len()
    }

    /// Totals over the steps that are done.
    pub(crate) fn went(&self) -> Went {
        self.went[self.done]
    }

    /// Marks the next step as the begin of a motion.
    pub(crate) fn begin_motion(&mut self) {
        self.begins = true;
    }

    /// Step at which the last motion before the current step began.
    pub(crate) fn last_motion(&self) -> usize {
        self.begun.iter().rev().copied().find(|step| *step < self.done).unwrap_or(0)
    }

    /// Step at which the next undone motion ended.
    pub(crate) fn next_motion(&self) -> usize {
        self.begun.iter().copied().find(|step| *step > self.done).unwrap_or(self.steps.len())
    }

    /// Adds a step; `after` is the simulation that has just carried it out.
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

    /// Brings the simulation to the state after step `step`, backwards or forwards.
    ///
    /// # Errors
    /// As [`Simulation::step_until`]; repeating a step that succeeded does not fail.
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

    /// Undone injections, in order of steps.
    pub(crate) fn undone_injections(&self) -> impl Iterator<Item = &Injected> {
        self.injected.iter().filter(|one| one.after_step > self.done)
    }

    /// Restarts at `time_s` the injections that were undone when `before` steps were done and no longer are; returns
    /// them.
    pub(crate) fn inject_again(&mut self, before: usize, time_s: f64) -> Vec<InjectionSpec> {
        let again = |one: &&mut Injected| (before + 1..=self.done).contains(&one.after_step);
        let flow = |one: &mut Injected| {
            one.flow.start_s = time_s;
            one.flow.clone()
        };
        self.injected.iter_mut().filter(again).map(flow).collect()
    }

    /// The steps that are done, as a script.
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
            let motions = vec![Motion { instrument: 0, advance_mm, rotate_deg: 0.0, steer: 0.0 }];
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
    fn history_counts_unconverged_steps_jumps_and_relaxations() {
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
