//! Scripts: lines of motion that are divided into steps.
//!
//! The end of a line is known in advance unless it has a condition ([`Until`]). So a script is carried out step by
//! step ([`ScriptRun`]): its progress is the number of steps of each line begun ([`ScriptCourse`]), from which, with
//! the script, all moves so far, lengths and times can be reconstructed to the bit.

mod inject;
mod line;
mod motion;
mod run;
#[cfg(test)]
mod tests;
mod until;

pub use inject::{Inject, Injection};
pub use line::ScriptLine;
pub use run::{LineCourse, ScriptCourse, ScriptRun, Step};
pub use until::{Condition, Met, Until};

use super::simulation::check_command;
use super::{Command, Move};
use crate::device::{Device, LENGTH_SLACK_MM, MOST_STEER, Stack};
use crate::vessel::CentrelineTree;
use crate::{Error, Result};
use motion::{Lengths, Motion, Part, STEP_LIMIT, Steps, Travel};

/// Motions of hands, one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    motions: Vec<Motion>,
    /// Initial inserted length of each instrument, mm.
    start_mm: Vec<f64>,
    /// Number of steps if no condition is met.
    most_steps: usize,
    /// The same of the steps before the first injection, if there is one.
    before_injection: Option<usize>,
}

impl Script {
    /// The script of these lines, checked as far as possible before the first step; `inserted_mm` are the initial
    /// inserted lengths of the instruments, and targets are those of `centreline`.
    ///
    /// After a line with a condition, lengths are known within bounds; a motion beyond the ends of an instrument for
    /// all of them is rejected here, others when the step is carried out.
    ///
    /// # Errors
    /// Names the line and key of a value that is not finite, contradictory or absurd, moves an instrument beyond its
    /// ends, or leads to impossible combinations of lengths; targets and instruments that do not exist, with the most
    /// similar name; speeds in some lines only.
    pub fn new(
        lines: &[ScriptLine],
        stack: &Stack,
        inserted_mm: &[f64],
        centreline: Option<&CentrelineTree>,
    ) -> Result<Self> {
        let start_mm = inserted_mm.to_vec();
        let mut script = Self { motions: Vec::new(), start_mm, most_steps: 0, before_injection: None };
        for (index, line) in lines.iter().enumerate() {
            script.motions.extend(line.motions(&format!("script[{index}]"), stack, centreline)?);
        }
        script.check_speeds()?;
        let mut bounds = Bounds::at(inserted_mm);
        for motion in &script.motions {
            if motion.inject.is_some() {
                script.before_injection.get_or_insert(script.most_steps);
            }
            script.most_steps += bounds.go(motion, stack)?;
            if script.most_steps as f64 > STEP_LIMIT {
                let remedy = format!("at most {STEP_LIMIT} steps in all");
                return Err(Error::parameter("script", script.most_steps, remedy));
            }
        }
        Ok(script)
    }

    /// Number of steps; with conditions, if none of them is met.
    pub fn len(&self) -> usize {
        self.most_steps
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Whether steps have times: a script has speeds in all of its lines or in none.
    pub(crate) fn is_timed(&self) -> bool {
        self.motions.iter().any(Motion::is_timed)
    }

    /// The name in messages of the first line with a condition; `None` if all steps are known in advance.
    pub(crate) fn conditional(&self) -> Option<&str> {
        self.motions.iter().find(|motion| motion.until.is_some()).map(|motion| motion.name.as_str())
    }

    /// The moves of all steps, if they are known in advance.
    ///
    /// # Errors
    /// A line with a condition, whose end is known only when it is carried out; one that detaches a coil, or whose
    /// steps are ticks.
    pub fn moves(&self) -> Result<Vec<Vec<Move>>> {
        if let Some(line) = self.conditional() {
            let remedy = "where the line ends is not known beforehand: carry the script out step by step";
            return Err(Error::parameter(format!("{line}.until"), "given", remedy));
        }
        if let Some(motion) = self.motions.iter().find(|motion| motion.detach.is_some()) {
            let remedy = "moves alone do not tell it: carry the script out step by step";
            return Err(Error::parameter(format!("{}.detach", motion.name), true, remedy));
        }
        if let Some((name, solves)) =
            self.motions.iter().find_map(|motion| Some((&motion.name, motion.solves?)))
        {
            let remedy = "moves alone do not tell ticks: carry the script out step by step";
            return Err(Error::parameter(format!("{name}.solves"), solves, remedy));
        }
        let mut run = self.begin();
        let mut moves = Vec::with_capacity(self.len());
        while let Some(step) = run.next_where(|_| None)? {
            moves.push(step.moves.to_vec());
            run.carried_out();
        }
        Ok(moves)
    }

    /// Whether contrast medium is injected.
    pub fn injects(&self) -> bool {
        self.motions.iter().any(|motion| motion.inject.is_some())
    }

    /// The name in messages of the first line that detaches a coil.
    pub(crate) fn detaches(&self) -> Option<&str> {
        self.motions.iter().find(|motion| motion.detach.is_some()).map(|motion| motion.name.as_str())
    }

    /// Number of steps before its first injection, if no condition is met before; `None` without one.
    pub fn steps_before_injection(&self) -> Option<usize> {
        self.before_injection
    }

    fn check_speeds(&self) -> Result<()> {
        match self.motions.iter().find(|motion| !motion.parts.is_empty() && !motion.is_timed()) {
            Some(motion) if self.is_timed() => {
                let remedy = "another line has a speed or wait_s: give speed_mm_per_s or speed_deg_per_s in all of them, or no times at all";
                Err(Error::parameter(&motion.name, "no speed", remedy))
            }
            _ => Ok(()),
        }
    }
}

/// Bounds of lengths known in advance, mm.
struct Bounds {
    low: Lengths,
    high: Lengths,
    /// The instruments whose coils are detached.
    detached: Vec<bool>,
}

impl Bounds {
    fn at(inserted_mm: &[f64]) -> Self {
        let lengths = Lengths::at(inserted_mm);
        Self { low: lengths.clone(), high: lengths, detached: vec![false; inserted_mm.len()] }
    }

    /// Detaches a coil: only once, and it cannot be inserted again.
    fn detach(&mut self, motion: &Motion, instrument: usize, stack: &Stack) -> Result<usize> {
        let one = &stack.instruments()[instrument];
        let refused = |remedy: String| {
            Err(Error::parameter(format!("{}.detach", motion.name), format!("{:?}", one.name), remedy))
        };
        if std::mem::replace(&mut self.detached[instrument], true) {
            return refused("is detached already: push the next coil".into());
        }
        let left_mm = stack.out_mm(instrument, &self.low.now_mm) - self.high.now_mm[instrument];
        if left_mm > LENGTH_SLACK_MM {
            return refused(format!("is not out by then: advance it by {left_mm:.3} mm more before"));
        }
        for lengths in [&mut self.low, &mut self.high] {
            lengths.before_mm.clone_from(&lengths.now_mm);
            (lengths.now_mm[instrument], lengths.steered[instrument]) = (0.0, 0.0);
        }
        Ok(1)
    }

    /// Applies a motion; returns its largest number of steps.
    fn go(&mut self, motion: &Motion, stack: &Stack) -> Result<usize> {
        if let Some(part) = motion.parts.iter().find(|part| self.detached[part.instrument]) {
            let name = &stack.instruments()[part.instrument].name;
            let remedy = "its coil is detached: advance the next one";
            return Err(Error::parameter(format!("{}.instrument", part.name), format!("{name:?}"), remedy));
        }
        let steps = motion.steps(&self.high)?;
        if let Some(bolus) = &motion.inject {
            bolus.check_in(&self.high)?;
        }
        if let Some(incoming) = &motion.exchange {
            incoming.check_out(&self.low)?;
        }
        if let Some(instrument) = motion.detach {
            return self.detach(motion, instrument, stack);
        }
        let (low, high) = (self.low.clone(), self.high.clone());
        if low == high {
            self.high.before_mm.clone_from(&high.now_mm);
            for step in 1..=steps.count {
                go(stack, &mut self.high, motion, &steps, step)?;
            }
            self.low = self.high.clone();
            if motion.until.is_some() {
                // It may end at once.
                let ends = self.low.now_mm.iter_mut().zip(&mut self.high.now_mm);
                let steered = self.low.steered.iter_mut().zip(&mut self.high.steered);
                let starts = low.now_mm.iter().chain(&low.steered);
                let ends = ends.chain(steered);
                ends.zip(starts).for_each(|((a, b), start)| (*a, *b) = (a.min(*start), b.max(*start)));
            }
            return Ok(steps.count);
        }
        self.low.before_mm.clone_from(&low.now_mm);
        self.high.before_mm.clone_from(&high.now_mm);
        for part in &motion.parts {
            let device_mm = stack.instruments()[part.instrument].device.length_mm();
            let (mut a, mut b) = (part.end_mm(&low), part.end_mm(&high));
            if motion.until.is_none() {
                check_ends(part, [a, b], device_mm)?;
            } else {
                (a, b) = (a.min(low.now_mm[part.instrument]), b.max(high.now_mm[part.instrument]));
            }
            self.low.now_mm[part.instrument] = a.clamp(0.0, device_mm);
            self.high.now_mm[part.instrument] = b.clamp(0.0, device_mm);
            if let Some(to) = part.steer {
                let (least, most) = if motion.until.is_none() { (to, to) } else { (-MOST_STEER, MOST_STEER) };
                (self.low.steered[part.instrument], self.high.steered[part.instrument]) = (least, most);
            }
        }
        Ok(steps.count)
    }
}

impl Part {
    /// Inserted length at its end, mm.
    fn end_mm(&self, lengths: &Lengths) -> f64 {
        match self.travel {
            // Exactly zero, not a difference with rounding.
            Travel::Out => 0.0,
            _ => lengths.now_mm[self.instrument] + self.travel_mm(lengths),
        }
    }
}

/// Rejects a motion that ends beyond an end of its instrument for all initial lengths within these bounds.
fn check_ends(part: &Part, [low_mm, high_mm]: [f64; 2], device_mm: f64) -> Result<()> {
    let Travel::By(mm) = part.travel else { return Ok(()) };
    if low_mm > device_mm + LENGTH_SLACK_MM {
        let least_mm = low_mm - mm;
        let remedy = format!(
            "the device is {device_mm} mm long and at least {least_mm} mm are inserted: advance less"
        );
        return Err(Error::parameter(format!("{}.advance_mm", part.name), mm, remedy));
    }
    if high_mm < -LENGTH_SLACK_MM {
        let remedy = format!("at most {} mm are inserted: retract less", high_mm - mm);
        return Err(Error::parameter(format!("{}.retract_mm", part.name), -mm, remedy));
    }
    Ok(())
}

/// Adds a step to the lengths, if it can be carried out.
fn go(stack: &Stack, lengths: &mut Lengths, motion: &Motion, steps: &Steps, step: usize) -> Result<()> {
    for (one, part) in steps.moves.iter().zip(&motion.parts) {
        let device = &stack.instruments()[one.instrument].device;
        let inserted = &mut lengths.now_mm[one.instrument];
        check_command(one.command, *inserted, device.length_mm()).map_err(|error| match error {
            Error::Parameter { name: key, remedy, .. } => {
                let (key, value) = match part.travel {
                    // Rounded, to hide the error of unit conversion.
                    _ if key == "rotate_rad" => {
                        ("rotate_deg", (part.turn_rad.to_degrees() * 1e6).round() / 1e6)
                    }
                    Travel::By(mm) => (key.as_str(), mm.abs()),
                    _ => (key.as_str(), (one.command.advance_mm * steps.count as f64).abs()),
                };
                Error::parameter(
                    format!("{}.{key}", part.name),
                    value,
                    format!("in its step {step}, {remedy}"),
                )
            }
            other => other,
        })?;
        *inserted += one.command.advance_mm;
        lengths.steered[one.instrument] += one.command.steer;
    }
    stack.check_places(lengths.now_mm.iter().copied()).map_err(|error| match error {
        Error::Parameter { name, value, remedy } => {
            Error::Parameter { name: format!("{}: in its step {step}, {name}", motion.name), value, remedy }
        }
        other => other,
    })
}

/// The commands of a script of a single device, checked before the first is carried out.
///
/// # Errors
/// As [`Script::new`], and a line with a condition, whose end is known only when it is carried out.
pub fn script_commands(script: &[ScriptLine], device: &Device) -> Result<Vec<Command>> {
    let moves = Script::new(script, &Stack::from(device.clone()), &[0.0], None)?.moves()?;
    Ok(moves.into_iter().flatten().map(|one| one.command).collect())
}
