//! Scripts: lines of motion that are cut into steps.

use serde::{Deserialize, Serialize};

use super::simulation::check_command;
use super::{Command, Move};
use crate::device::{Device, Stack};
use crate::{Error, Result};

/// One line of a script: a motion and the increments it is cut into.
///
/// `advance_mm`, `retract_mm` or `withdraw`, with or without `rotate_deg`; given together they happen together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScriptLine {
    /// Name of the instrument that moves; a device alone need not be named.
    pub instrument: Option<String>,
    /// Length to push in, mm.
    pub advance_mm: Option<f64>,
    /// Length to pull back, mm.
    pub retract_mm: Option<f64>,
    /// Whether all that is in is pulled back.
    pub withdraw: bool,
    /// Turn of the tail, degrees, of either sign.
    pub rotate_deg: Option<f64>,
    /// Largest increment of length, mm; 1 if absent.
    pub step_mm: Option<f64>,
    /// Largest increment of turn, degrees; 5 if absent.
    pub step_deg: Option<f64>,
    /// Lines of other instruments, which move at the same time; increments are as many as the one that needs most of them has.
    pub with: Vec<ScriptLine>,
}

/// The steps of a script: what moves in each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Script {
    /// Moves of a step, and how often it is repeated.
    lines: Vec<(Vec<Move>, usize)>,
}

/// Most steps of one script: at one kilohertz, over 2 hours of manipulation.
const STEP_LIMIT: f64 = 1e7;

impl ScriptLine {
    /// Signed travel in mm and turn in rad, where this length is in.
    fn travel(&self, name: &str, inserted_mm: f64) -> Result<(f64, f64)> {
        let positive = |field: &str, value: Option<f64>| match value {
            Some(v) if !(v.is_finite() && v >= 0.0) => Err(Error::parameter(
                format!("{name}.{field}"),
                v,
                "must be a number of 0 or more; the direction is in the key (advance_mm, retract_mm)",
            )),
            _ => Ok(value),
        };
        let advance = positive("advance_mm", self.advance_mm)?;
        let retract = positive("retract_mm", self.retract_mm)?;
        let rotate = self.rotate_deg.unwrap_or(0.0);
        if !rotate.is_finite() {
            return Err(Error::parameter(format!("{name}.rotate_deg"), rotate, "must be a finite number"));
        }
        let mm = match (advance, retract) {
            (Some(a), Some(_)) => {
                return Err(Error::parameter(
                    format!("{name}.advance_mm"),
                    a,
                    "a line either advances or retracts: split it in two",
                ));
            }
            (a, r) => a.unwrap_or(0.0) - r.unwrap_or(0.0),
        };
        if self.withdraw && (advance.is_some() || retract.is_some()) {
            let mend = "pulls back all that is in: leave advance_mm and retract_mm out";
            return Err(Error::parameter(format!("{name}.withdraw"), true, mend));
        }
        if advance.is_none() && retract.is_none() && !self.withdraw && self.rotate_deg.is_none() {
            return Err(Error::parameter(name, "{}", "give advance_mm, retract_mm, withdraw or rotate_deg"));
        }
        Ok((if self.withdraw { -inserted_mm } else { mm }, rotate.to_radians()))
    }

    /// Number of the instrument.
    fn number(&self, name: &str, stack: &Stack) -> Result<usize> {
        match &self.instrument {
            Some(instrument) => stack.find(instrument).map_err(|error| match error {
                Error::Parameter { value, mend, .. } => {
                    Error::Parameter { name: format!("{name}.instrument"), value, mend }
                }
                other => other,
            }),
            None if stack.is_several() => {
                let names: Vec<&str> = stack.instruments().iter().map(|one| one.name.as_str()).collect();
                let mend = format!("say which one moves: {}", names.join(", "));
                Err(Error::parameter(format!("{name}.instrument"), "none", mend))
            }
            None => Ok(0),
        }
    }

    /// This line and those with it, each with its name in messages.
    fn together(&self, name: &str) -> Result<Vec<(String, &Self)>> {
        let mut lines = vec![(name.to_owned(), self)];
        for (index, line) in self.with.iter().enumerate() {
            let name = format!("{name}.with[{index}]");
            if !line.with.is_empty() {
                let mend = "is with another line already: list all of them there";
                return Err(Error::parameter(format!("{name}.with"), line.with.len(), mend));
            }
            lines.push((name, line));
        }
        Ok(lines)
    }

    /// Number of equal increments of a travel.
    fn increments(&self, name: &str, (mm, rad): (f64, f64)) -> Result<usize> {
        let mut count: f64 = 1.0;
        for (field, step, travel) in [
            ("step_mm", self.step_mm.unwrap_or(1.0), mm.abs()),
            ("step_deg", self.step_deg.unwrap_or(5.0), rad.to_degrees().abs()),
        ] {
            if !(step.is_finite() && step > 0.0) {
                return Err(Error::parameter(format!("{name}.{field}"), step, "must be a number above 0"));
            }
            // The tolerance keeps 0.3 mm in steps of 0.1 mm at three increments, not four.
            count = count.max((travel / step - 1e-9).ceil());
        }
        if count > STEP_LIMIT {
            return Err(Error::parameter(
                name,
                format!("{} steps", crate::error::number(count)),
                format!("at most {STEP_LIMIT} steps in a line: use larger increments"),
            ));
        }
        Ok(count as usize)
    }
}

impl Script {
    /// The steps of these lines, checked before the first is carried out; `inserted_mm` is what is in of each instrument at the start.
    ///
    /// # Errors
    /// Names the line and key of what is not finite, contradictory or absurd, moves an instrument beyond its ends, or leads to where
    /// instruments cannot be together.
    pub fn new(lines: &[ScriptLine], stack: &Stack, inserted_mm: &[f64]) -> Result<Self> {
        let mut inserted_mm = inserted_mm.to_vec();
        let mut script = Self::default();
        for (index, line) in lines.iter().enumerate() {
            let name = format!("script[{index}]");
            let lines = line.together(&name)?;
            let mut moves: Vec<Move> = Vec::with_capacity(lines.len());
            let mut travels = Vec::with_capacity(lines.len());
            let mut count = 1;
            for (name, line) in &lines {
                let instrument = line.number(name, stack)?;
                if moves.iter().any(|other| other.instrument == instrument) {
                    let value = format!("{:?}", stack.instruments()[instrument].name);
                    let mend = "moves in this line already: split the line in two";
                    return Err(Error::parameter(format!("{name}.instrument"), value, mend));
                }
                let travel = line.travel(name, inserted_mm[instrument])?;
                count = count.max(line.increments(name, travel)?);
                moves.push(Move { instrument, command: Command::default() });
                travels.push(travel);
            }
            let share = 1.0 / count as f64;
            for (one, (mm, rad)) in moves.iter_mut().zip(&travels) {
                one.command = Command { advance_mm: mm * share, rotate_rad: rad * share };
            }
            for step in 1..=count {
                go(stack, &mut inserted_mm, &moves, &lines, step)?;
            }
            script.lines.push((moves, count));
            let steps = script.len();
            if steps as f64 > STEP_LIMIT {
                return Err(Error::parameter("script", steps, format!("at most {STEP_LIMIT} steps in all")));
            }
        }
        Ok(script)
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        self.lines.iter().map(|(_, count)| count).sum()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// The moves of each step.
    pub fn steps(&self) -> impl Iterator<Item = &[Move]> {
        self.lines.iter().flat_map(|(moves, count)| std::iter::repeat_n(moves.as_slice(), *count))
    }
}

/// Adds a step to what is in, if it can be carried out.
fn go(
    stack: &Stack,
    inserted_mm: &mut [f64],
    moves: &[Move],
    lines: &[(String, &ScriptLine)],
    step: usize,
) -> Result<()> {
    for (one, (name, line)) in moves.iter().zip(lines) {
        let device = &stack.instruments()[one.instrument].device;
        let inserted = &mut inserted_mm[one.instrument];
        check_command(one.command, *inserted, device.length_mm()).map_err(|error| match error {
            Error::Parameter { name: key, mend, .. } => {
                let value = line.advance_mm.or(line.retract_mm).unwrap_or(0.0);
                Error::parameter(format!("{name}.{key}"), value, format!("in its step {step}, {mend}"))
            }
            other => other,
        })?;
        *inserted += one.command.advance_mm;
    }
    stack.check_places(inserted_mm.iter().copied()).map_err(|error| match error {
        Error::Parameter { name, value, mend } => {
            Error::Parameter { name: format!("{}: in its step {step}, {name}", lines[0].0), value, mend }
        }
        other => other,
    })
}

/// The commands of a script of a device alone, checked before the first is carried out.
///
/// # Errors
/// As [`Script::new`].
pub fn script_commands(script: &[ScriptLine], device: &Device) -> Result<Vec<Command>> {
    let script = Script::new(script, &Stack::from(device.clone()), &[0.0])?;
    Ok(script.steps().flatten().map(|one| one.command).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Instrument, Section};

    fn advance(mm: f64, step: f64) -> ScriptLine {
        ScriptLine { advance_mm: Some(mm), step_mm: Some(step), ..Default::default() }
    }

    /// The commands of a device of 100 mm.
    fn commands(script: &[ScriptLine]) -> Result<Vec<Command>> {
        script_commands(script, &Device::uniform(100.0, 0.4, 10.0)?)
    }

    #[test]
    fn a_line_is_cut_into_equal_increments_no_larger_than_its_step() {
        let list = commands(&[advance(0.3, 0.1)]).unwrap();
        assert_eq!(list.len(), 3);
        assert!((list.iter().map(|c| c.advance_mm).sum::<f64>() - 0.3).abs() < 1e-15);
        assert_eq!(commands(&[advance(1.05, 0.5)]).unwrap().len(), 3);
    }

    #[test]
    fn turning_and_pushing_in_one_line_happen_together() {
        let line = ScriptLine {
            retract_mm: Some(4.0),
            rotate_deg: Some(90.0),
            step_mm: Some(1.0),
            step_deg: Some(10.0),
            ..Default::default()
        };
        let list = commands(&[advance(4.0, 4.0), line]).unwrap();
        assert_eq!(list.len(), 10);
        assert!(list[1..].iter().all(|c| c.advance_mm < 0.0 && c.rotate_rad > 0.0));
    }

    #[test]
    fn a_bad_line_is_named_with_its_key() {
        for (line, key) in [
            (advance(-1.0, 1.0), "script[1].advance_mm = -1"),
            (advance(f64::NAN, 1.0), "script[1].advance_mm = NaN"),
            (advance(1.0, 0.0), "script[1].step_mm = 0"),
            (advance(1e9, 1e-9), "script[1]"),
            (ScriptLine::default(), "script[1]"),
            (ScriptLine { retract_mm: Some(1.0), ..advance(1.0, 1.0) }, "script[1].advance_mm = 1"),
        ] {
            let message = commands(&[advance(1.0, 1.0), line]).unwrap_err().to_string();
            assert!(message.starts_with(key), "{message}");
        }
    }

    /// Two wires that take turns in a catheter.
    fn stack() -> Stack {
        let one = |name: &str, section: Section| Instrument {
            name: name.to_owned(),
            device: Device::new(vec![section]).unwrap(),
            may_lead: true,
        };
        let catheter = Section { inner_radius_mm: Some(0.5), ..Section::straight(100.0, 0.8, 60.0) };
        Stack::new(vec![
            one("wire", Section::straight(200.0, 0.3, 20.0)),
            one("stiff wire", Section::straight(200.0, 0.4, 90.0)),
            one("catheter", catheter),
        ])
        .unwrap()
    }

    fn line(instrument: &str) -> ScriptLine {
        ScriptLine { instrument: Some(instrument.to_owned()), ..Default::default() }
    }

    #[test]
    fn instruments_move_together_and_a_wire_is_exchanged() {
        let script = [
            ScriptLine {
                advance_mm: Some(30.0),
                with: vec![ScriptLine { advance_mm: Some(60.0), step_mm: Some(20.0), ..line("catheter") }],
                ..line("wire")
            },
            ScriptLine { withdraw: true, step_mm: Some(20.0), ..line("wire") },
            ScriptLine { advance_mm: Some(70.0), step_mm: Some(70.0), ..line("stiff wire") },
        ];
        let script = Script::new(&script, &stack(), &[10.0, 0.0, 0.0]).unwrap();
        let steps: Vec<&[Move]> = script.steps().collect();
        assert_eq!((script.len(), steps.len()), (33, 33));
        let told = |step: usize| -> Vec<(usize, f64)> {
            steps[step].iter().map(|one| (one.instrument, one.command.advance_mm)).collect()
        };
        assert_eq!(told(0), [(0, 1.0), (2, 2.0)]);
        assert_eq!((told(30), told(32)), (vec![(0, -20.0)], vec![(1, 70.0)]));
    }

    #[test]
    fn a_script_says_which_instrument_moves_and_what_does_not_go_is_told_before_it_begins() {
        let advance = |name: &str, mm| ScriptLine { advance_mm: Some(mm), ..line(name) };
        let both = ScriptLine { with: vec![advance("wire", 1.0)], ..advance("wire", 1.0) };
        let deep = ScriptLine { with: vec![both.clone()], ..advance("catheter", 1.0) };
        for (script, told) in [
            (vec![advance("cathter", 1.0)], "script[0].instrument = \"cathter\": did you mean \"catheter\"?"),
            (
                vec![self::advance(1.0, 1.0)],
                "script[0].instrument = none: say which one moves: wire, stiff wire",
            ),
            (vec![both], "script[0].with[0].instrument = \"wire\": moves in this line already"),
            (vec![deep], "script[0].with[0].with = 1: is with another line already"),
            (
                vec![ScriptLine { withdraw: true, ..advance("wire", 1.0) }],
                "script[0].withdraw = true: pulls back all",
            ),
            (
                vec![advance("wire", 201.0)],
                "script[0].advance_mm = 201: in its step 201, the device is 200 mm",
            ),
            (
                vec![advance("wire", 5.0), advance("stiff wire", 5.0)],
                "script[1]: in its step 1, wire.radius_mm = 0.3: \"stiff wire\" has no lumen",
            ),
            (
                vec![advance("catheter", 20.0), advance("wire", 130.0)],
                "script[1]: in its step 121, wire.inserted_mm = 121: 80.000 mm of \"catheter\" are outside",
            ),
        ] {
            let error = Script::new(&script, &stack(), &[0.0; 3]).unwrap_err().to_string();
            assert!(error.starts_with(told), "{error}");
        }
    }
}
