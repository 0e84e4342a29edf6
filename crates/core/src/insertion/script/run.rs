//! Execution of a script.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::motion::{Lengths, Motion, Steps};
use super::until::Condition;
use super::{Injection, Met, Script};
use crate::insertion::{Move, Simulation, StepReport};
use crate::{Error, Result};

/// Progress of a script: together with the script, all that is needed to continue.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ScriptCourse {
    /// The motions begun so far, in order; an exchange is two.
    pub motions: Vec<LineCourse>,
}

/// Progress of a motion of a script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LineCourse {
    /// Steps carried out.
    pub steps: usize,
    /// The part of its condition that has ended it.
    pub met: Option<Met>,
}

/// A step of a script.
#[derive(Debug, Clone, PartialEq)]
pub struct Step<'a> {
    /// The moves.
    pub moves: Cow<'a, [Move]>,
    /// The instrument whose coil is detached; then nothing moves.
    pub detach: Option<usize>,
    /// Linear solves, if it is a tick.
    pub solves: Option<usize>,
    /// Time at its end since the start of the script, s; `None` if the script has no speeds.
    pub time_s: Option<f64>,
    /// Its duration, s; 0 if the script has no speeds.
    pub duration_s: f64,
}

/// A script in execution, step by step.
#[derive(Debug, Clone)]
pub struct ScriptRun<'a> {
    script: Cow<'a, Script>,
    course: ScriptCourse,
    lengths: Lengths,
    /// Steps of the current motion.
    steps: Option<Steps>,
    time_s: f64,
    /// Steps carried out.
    done: usize,
    injections: Vec<Injection>,
}

impl Step<'_> {
    /// The step with owned moves.
    pub fn into_owned(self) -> Step<'static> {
        Step { moves: Cow::Owned(self.moves.into_owned()), ..self }
    }

    /// Carries it out. In a tick the wall may stop hands that earlier ones have moved: that is a result of the tick,
    /// not a failure.
    ///
    /// # Errors
    /// As [`Simulation::step_until`], [`Simulation::tick`] and [`Simulation::detach`].
    pub fn carry_out<'a>(&self, simulation: &'a mut Simulation) -> Result<&'a StepReport> {
        match (self.detach, self.solves) {
            (Some(instrument), _) => simulation.detach(instrument),
            (None, None) => simulation.step_until(&self.moves, self.time_s),
            (None, Some(solves)) => {
                let under_way = simulation.report().is_under_way();
                match simulation.tick(&self.moves, solves, self.time_s) {
                    Err(error) if !under_way || error.is_input() => Err(error),
                    _ => Ok(simulation.report()),
                }
            }
        }
    }
}

impl Script {
    /// Starts the script.
    pub fn begin(&self) -> ScriptRun<'_> {
        ScriptRun::of(Cow::Borrowed(self))
    }

    /// Starts the script, which the run then owns.
    pub fn into_run(self) -> ScriptRun<'static> {
        ScriptRun::of(Cow::Owned(self))
    }

    /// Continues the script from its progress; `seen` is called with each step so far.
    ///
    /// # Errors
    /// Progress that is impossible for this script.
    pub fn go_on(&self, course: &ScriptCourse, mut seen: impl FnMut(Step<'_>)) -> Result<ScriptRun<'_>> {
        let mut run = self.begin();
        for (index, line) in course.motions.iter().enumerate() {
            let other = |what: String| {
                let remedy = "the steps are those of another script";
                Error::parameter(format!("motion {} of the script", index + 1), what, remedy)
            };
            for _ in 0..line.steps {
                let reported = run.next_where(|_| None)?.map(&mut seen).is_some();
                if !reported || run.course.motions.len() != index + 1 {
                    return Err(other(format!("{} steps", line.steps)));
                }
                run.carried_out();
            }
            // A line ended by its condition without a step has not been started yet.
            if line.steps == 0 && run.course.motions.len() <= index && !run.begin_motion()? {
                return Err(other("none".to_owned()));
            }
            // Without a condition a line ends when it is complete: a later version of the script may have a longer
            // one.
            if line.met.is_some() {
                run.end_motion(line.met);
            }
        }
        Ok(run)
    }
}

impl<'a> ScriptRun<'a> {
    fn of(script: Cow<'a, Script>) -> Self {
        let lengths = Lengths::at(&script.start_mm);
        Self {
            script,
            course: ScriptCourse::default(),
            lengths,
            steps: None,
            time_s: 0.0,
            done: 0,
            injections: Vec::new(),
        }
    }

    /// The next step; `None` at the end of the script. Conditions are evaluated in `simulation`.
    ///
    /// # Errors
    /// More steps than a script may have.
    pub fn next(&mut self, simulation: &Simulation) -> Result<Option<Step<'_>>> {
        self.next_where(|condition| condition.met(simulation))
    }

    /// The next step, with conditions evaluated by `met`.
    pub(super) fn next_where(&mut self, met: impl Fn(&Condition) -> Option<Met>) -> Result<Option<Step<'_>>> {
        loop {
            if self.steps.is_none() && !self.begin_motion()? {
                return Ok(None);
            }
            let index = self.course.motions.len() - 1;
            let met = self.script.motions[index].until.as_ref().and_then(&met);
            let count = self.steps.as_ref().map_or(0, |steps| steps.count);
            if met.is_none() && self.course.motions[index].steps < count {
                break;
            }
            self.end_motion(met);
        }
        let duration_s = self.steps.as_ref().map_or(0.0, |steps| steps.step_s);
        let time_s = self.script.is_timed().then_some(self.time_s + duration_s);
        let Motion { detach, solves, .. } = self.script.motions[self.course.motions.len() - 1];
        Ok(self.steps.as_ref().map(|steps| Step {
            moves: Cow::Borrowed(&steps.moves),
            detach,
            solves,
            time_s,
            duration_s,
        }))
    }

    /// Reports that the last step returned has been carried out.
    pub fn carried_out(&mut self) {
        let (Some(steps), Some(line)) = (&self.steps, self.course.motions.last_mut()) else { return };
        line.steps += 1;
        self.done += 1;
        self.time_s += steps.step_s;
        for one in &steps.moves {
            self.lengths.now_mm[one.instrument] += one.command.advance_mm;
            self.lengths.steered[one.instrument] += one.command.steer;
        }
        if let Some(instrument) = self.script.motions[self.course.motions.len() - 1].detach {
            (self.lengths.now_mm[instrument], self.lengths.steered[instrument]) = (0.0, 0.0);
        }
    }

    /// Whether the script is at its end: there is no next step.
    pub fn has_ended(&self) -> bool {
        self.steps.is_none() && self.course.motions.len() >= self.script.motions.len()
    }

    /// The injections that have started, including that of the next step if it is the first of its line.
    pub fn injections(&self) -> &[Injection] {
        &self.injections
    }

    /// Progress of the script.
    pub fn course(&self) -> &ScriptCourse {
        &self.course
    }

    /// The conditions evaluated so far that have affected the run, with the indices of their motions: those of
    /// motions that have steps or have been ended.
    pub fn decided(&self) -> impl Iterator<Item = (usize, &Condition)> {
        let begun = self.script.motions.iter().zip(&self.course.motions).enumerate();
        let decided = begun.filter(|(_, (_, line))| line.steps > 0 || line.met.is_some());
        decided.filter_map(|(index, (motion, _))| Some((index, motion.until.as_ref()?)))
    }

    /// Lines with a condition that have ended: the name of each in messages, its progress, and the step of the script
    /// after which it ended.
    pub fn conditions(&self) -> impl Iterator<Item = (&str, LineCourse, usize)> {
        let steps = self.course.motions.iter().scan(0, |steps, line| {
            *steps += line.steps;
            Some(*steps)
        });
        let begun = self.script.motions.iter().zip(&self.course.motions).zip(steps);
        let ended = self.course.motions.len() - usize::from(self.steps.is_some());
        let ended = begun.take(ended).filter(|((motion, _), _)| motion.until.is_some());
        ended.map(|((motion, line), after)| (motion.name.as_str(), *line, after))
    }

    /// Starts the next motion; returns whether there is one.
    fn begin_motion(&mut self) -> Result<bool> {
        let Some(motion) = self.script.motions.get(self.course.motions.len()) else { return Ok(false) };
        if let Some(incoming) = &motion.exchange {
            incoming.check_out(&self.lengths)?;
        }
        if let Some(bolus) = &motion.inject {
            bolus.check_in(&self.lengths)?;
            self.injections.push(Injection {
                instrument: bolus.instrument,
                ml: bolus.ml,
                ml_per_s: bolus.ml_per_s,
                after_step: self.done,
                time_s: self.script.is_timed().then_some(self.time_s),
            });
        }
        self.steps = Some(motion.steps(&self.lengths)?);
        self.lengths.before_mm.clone_from(&self.lengths.now_mm);
        self.course.motions.push(LineCourse::default());
        Ok(true)
    }

    fn end_motion(&mut self, met: Option<Met>) {
        if let Some(line) = self.course.motions.last_mut() {
            line.met = met;
        }
        self.steps = None;
    }
}
