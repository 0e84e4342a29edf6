//! Lines of a script as written, and the corresponding motions.

use serde::{Deserialize, Serialize};

use super::inject::{Bolus, Inject};
use super::motion::{Incoming, Motion, Part, Travel, Wait};
use super::until::{Condition, Until};
use crate::device::{MOST_STEER, Stack};
use crate::error::in_range;
use crate::vessel::CentrelineTree;
use crate::{Error, Result};

/// Time step while hands rest, s: ten images per second.
const STEP_S: f64 = 0.1;
/// Largest increment of a steering value unless given.
const STEP_STEER: f64 = 0.05;
/// Longest rest, s.
const LONGEST_S: f64 = 1e6;

/// One line of a script: a motion, and the increments into which it is divided.
///
/// `advance_mm`, `retract_mm` or `withdraw`, with or without `rotate_deg`, which happens at the same time. `exchange`
/// is two motions. `detach` stands alone: it detaches a coil. `inject` may stand alone: then nothing moves, and no
/// time passes. With `wait_s`, alone or beside it, hands rest and time passes.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScriptLine {
    /// Name of the instrument that moves; optional for a single device.
    pub instrument: Option<String>,
    /// Length to push in, mm.
    pub advance_mm: Option<f64>,
    /// Length to pull back, mm.
    pub retract_mm: Option<f64>,
    /// Whether the whole inserted length is pulled back.
    pub withdraw: bool,
    /// Rotation of the tail, degrees, of either sign.
    pub rotate_deg: Option<f64>,
    /// Value to which the instrument is steered, −1 to 1, in the course of the line.
    pub steer: Option<f64>,
    /// Largest increment of length, mm; 1 if absent.
    pub step_mm: Option<f64>,
    /// Largest increment of rotation, degrees; 5 if absent.
    pub step_deg: Option<f64>,
    /// Largest increment of the steering value; 0.05 if absent.
    pub step_steer: Option<f64>,
    /// Name of the instrument that replaces this one, which is withdrawn first, over a catheter that stays. It is
    /// inserted by `advance_mm`, or as far as this one was.
    pub exchange: Option<String>,
    /// Speed of pushing and pulling, mm/s; with speeds, steps have times.
    pub speed_mm_per_s: Option<f64>,
    /// Speed of rotation, degrees/s.
    pub speed_deg_per_s: Option<f64>,
    /// Speed of steering, 1/s.
    pub speed_steer_per_s: Option<f64>,
    /// Condition that ends the line early; its full motion is then the maximum.
    pub until: Option<Until>,
    /// Time for which the hands rest, s; other motion continues.
    pub wait_s: Option<f64>,
    /// Largest increment of that time, s; 0.1 if absent.
    pub step_s: Option<f64>,
    /// Linear solves per step, which is then a tick ([`Simulation::tick`](crate::insertion::Simulation::tick)):
    /// motion that the device has not followed is left to the next.
    pub solves: Option<usize>,
    /// Whether the coil of the instrument, which must be out, is detached; its pusher is withdrawn.
    pub detach: bool,
    /// Contrast medium injected from the start of the line.
    pub inject: Option<Inject>,
    /// Lines of other instruments, which move at the same time; the number of increments is the largest that any of
    /// them needs.
    pub with: Vec<ScriptLine>,
}

impl ScriptLine {
    /// Whether its condition refers to a target of the vessel's centre line.
    pub(crate) fn has_target(&self) -> bool {
        self.until.as_ref().is_some_and(|until| until.target.is_some())
    }

    /// The motions of the line, one after another; `name` is its name in messages.
    ///
    /// # Errors
    /// Names the key of a value that is not finite, contradictory or unknown.
    pub(super) fn motions(
        &self,
        name: &str,
        stack: &Stack,
        centreline: Option<&CentrelineTree>,
    ) -> Result<Vec<Motion>> {
        let bolus = |own| {
            let inject = self.inject.as_ref();
            inject.map(|inject| Bolus::new(format!("{name}.inject"), inject, own, stack)).transpose()
        };
        if self.detach {
            return Ok(vec![self.detachment(name, stack)?]);
        }
        let solves = self.solves;
        let wait = self.wait(name)?;
        let of_solves =
            |remedy: &str| Err(Error::parameter(format!("{name}.solves"), solves.unwrap_or(0), remedy));
        if solves == Some(0) {
            return of_solves(
                "allow at least one in each step, or leave it out for steps that end in equilibrium",
            );
        }
        if solves.is_some() && wait.is_none() && self.only_injects() {
            return of_solves("a line that only injects has no steps: leave it out");
        }
        if wait.is_some() || self.only_injects() {
            let named = self.inject.as_ref().is_some_and(|inject| inject.through.is_some());
            let asked = self.instrument.is_some() || (self.inject.is_some() && !named);
            let own = if asked { self.number(name, stack)? } else { 0 };
            let inject = bolus(own)?;
            let name = name.to_owned();
            return Ok(vec![Motion { wait, inject, solves, ..Motion::resting(name) }]);
        }
        let mut parts: Vec<Part> = Vec::new();
        for (name, line) in self.together(name)? {
            let part = line.part(name, stack)?;
            if parts.iter().any(|other| other.instrument == part.instrument) {
                let value = format!("{:?}", stack.instruments()[part.instrument].name);
                let remedy = "moves in this line already: split the line in two";
                return Err(Error::parameter(format!("{}.instrument", part.name), value, remedy));
            }
            parts.push(part);
        }
        let lead = parts[0].instrument;
        let inject = bolus(lead)?;
        let until = |until: &Until| Condition::new(&format!("{name}.until"), until, lead, centreline);
        let until = self.until.as_ref().map(until).transpose()?;
        let Some(other) = &self.exchange else {
            let name = name.to_owned();
            return Ok(vec![Motion { parts, until, inject, solves, ..Motion::resting(name) }]);
        };
        // The line's own motion is that of the incoming instrument: its keys apply to the insertion.
        let key = format!("{name}.exchange");
        let instrument = find(stack, other, &key)?;
        if parts.len() > 1 || instrument == lead {
            let remedy = "one instrument takes the place of another: name that one, and leave with out";
            return Err(Error::parameter(key, format!("{other:?}"), remedy));
        }
        let into = match self.advance_mm {
            Some(mm) => Travel::By(mm),
            None => Travel::AsFarAs(lead),
        };
        let mut withdrawn = parts[0].clone();
        (withdrawn.travel, withdrawn.turn_rad, withdrawn.steer) = (Travel::Out, 0.0, None);
        let inserted = Part { instrument, travel: into, ..parts.swap_remove(0) };
        let until = until.map(|condition| Condition { instrument, ..condition });
        let incoming = Incoming { key, instrument, name: other.clone() };
        let motion = |part| Motion { parts: vec![part], solves, ..Motion::resting(name.to_owned()) };
        Ok(vec![
            Motion { inject, exchange: Some(incoming), ..motion(withdrawn) },
            Motion { until, ..motion(inserted) },
        ])
    }

    /// The step that detaches a coil.
    fn detachment(&self, name: &str, stack: &Stack) -> Result<Motion> {
        let alone = Self { instrument: self.instrument.clone(), detach: true, ..Self::default() };
        if *self != alone {
            let remedy = "stands alone with its instrument: leave all that moves, waits or injects to lines of their own";
            return Err(Error::parameter(format!("{name}.detach"), true, remedy));
        }
        let instrument = self.number(name, stack)?;
        let one = &stack.instruments()[instrument];
        if one.device.coil_mm() == 0.0 {
            let remedy = format!(
                "{:?} is no coil: a device file of kind coil whose first part has a winding is one",
                one.name
            );
            return Err(Error::parameter(format!("{name}.detach"), true, remedy));
        }
        Ok(Motion { detach: Some(instrument), ..Motion::resting(name.to_owned()) })
    }

    /// Whether it only injects.
    fn only_injects(&self) -> bool {
        self.inject.is_some() && self.rests()
    }

    /// Whether it specifies no motion.
    fn rests(&self) -> bool {
        let lengths = self.advance_mm.is_some() || self.retract_mm.is_some() || self.withdraw;
        let moves = lengths || self.rotate_deg.is_some() || self.steer.is_some() || self.exchange.is_some();
        !moves && self.until.is_none() && self.with.is_empty()
    }

    /// The time for which hands rest in it, if they do.
    fn wait(&self, name: &str) -> Result<Option<Wait>> {
        let Some(wait_s) = self.wait_s else {
            return match self.step_s {
                Some(step_s) => {
                    let remedy =
                        "cuts the time that hands rest: give wait_s, or step_mm and step_deg of a motion";
                    Err(Error::parameter(format!("{name}.step_s"), step_s, remedy))
                }
                None => Ok(None),
            };
        };
        if !self.rests() {
            let remedy = "hands rest in it: leave all that moves to a line of its own";
            return Err(Error::parameter(format!("{name}.wait_s"), wait_s, remedy));
        }
        in_range(&format!("{name}.wait_s"), wait_s, LONGEST_S)?;
        let step_s = self.step_s.unwrap_or(STEP_S);
        in_range(&format!("{name}.step_s"), step_s, LONGEST_S)?;
        Ok(Some(Wait { wait_s, step_s }))
    }

    /// The motion of this line's instrument.
    fn part(&self, name: String, stack: &Stack) -> Result<Part> {
        for (field, value) in [("advance_mm", self.advance_mm), ("retract_mm", self.retract_mm)] {
            if let Some(v) = value.filter(|v| !(v.is_finite() && *v >= 0.0)) {
                let remedy =
                    "must be a number of 0 or more; the direction is in the key (advance_mm, retract_mm)";
                return Err(Error::parameter(format!("{name}.{field}"), v, remedy));
            }
        }
        let steps = [
            ("step_mm", self.step_mm.unwrap_or(1.0)),
            ("step_deg", self.step_deg.unwrap_or(5.0)),
            ("step_steer", self.step_steer.unwrap_or(STEP_STEER)),
        ];
        let speeds = [
            ("speed_mm_per_s", self.speed_mm_per_s),
            ("speed_deg_per_s", self.speed_deg_per_s),
            ("speed_steer_per_s", self.speed_steer_per_s),
        ];
        let given = speeds.iter().filter_map(|(field, speed)| speed.map(|speed| (*field, speed)));
        for (field, value) in steps.into_iter().chain(given) {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::parameter(format!("{name}.{field}"), value, "must be a number above 0"));
            }
        }
        let rotate = self.rotate_deg.unwrap_or(0.0);
        if !rotate.is_finite() {
            return Err(Error::parameter(format!("{name}.rotate_deg"), rotate, "must be a finite number"));
        }
        let instrument = self.number(&name, stack)?;
        if let Some(steer) = self.steer {
            let device = &stack.instruments()[instrument].device;
            let remedy = if !device.is_steerable() {
                "the instrument is not steered: give a section of it steer, or leave it out"
            } else if !(steer.is_finite() && steer.abs() <= MOST_STEER) {
                "must be a value from −1 to 1"
            } else {
                ""
            };
            if !remedy.is_empty() {
                return Err(Error::parameter(format!("{name}.steer"), steer, remedy));
            }
        }
        let part = Part {
            instrument,
            travel: self.travel(&name)?,
            turn_rad: rotate.to_radians(),
            steer: self.steer,
            step_mm: steps[0].1,
            step_deg: steps[1].1,
            step_steer: steps[2].1,
            speed_mm_per_s: self.speed_mm_per_s,
            speed_deg_per_s: self.speed_deg_per_s,
            speed_steer_per_s: self.speed_steer_per_s,
            name,
        };
        self.check_speed(&part)?;
        Ok(part)
    }

    /// Rejects a part whose only speed is of a motion that it does not make: it would take no time.
    fn check_speed(&self, part: &Part) -> Result<()> {
        // An exchange pulls the whole instrument out.
        let [along, around] = [part.moves()[0] || self.exchange.is_some(), part.moves()[1]];
        let idle = match (along, around, part.speed_mm_per_s, part.speed_deg_per_s) {
            (true, false, None, Some(speed)) => (
                "speed_deg_per_s",
                speed,
                "nothing turns in the line: give speed_mm_per_s, how fast it is pushed or pulled",
            ),
            (false, true, Some(speed), None) => {
                ("speed_mm_per_s", speed, "the line only turns: give speed_deg_per_s, how fast")
            }
            _ => return Ok(()),
        };
        let (key, speed, remedy) = idle;
        Err(Error::parameter(format!("{}.{key}", part.name), speed, remedy))
    }

    /// Its motion along the device.
    fn travel(&self, name: &str) -> Result<Travel> {
        match (self.advance_mm, self.retract_mm, self.withdraw) {
            (Some(a), Some(_), _) => {
                let remedy = "a line either advances or retracts: split it in two";
                Err(Error::parameter(format!("{name}.advance_mm"), a, remedy))
            }
            (a, r, true) if a.is_some() || r.is_some() => {
                let remedy = "pulls back all that is in: leave advance_mm and retract_mm out";
                Err(Error::parameter(format!("{name}.withdraw"), true, remedy))
            }
            (_, Some(r), _) if self.exchange.is_some() => {
                let remedy = "exchange withdraws all of the instrument: leave retract_mm out";
                Err(Error::parameter(format!("{name}.retract_mm"), r, remedy))
            }
            (None, None, false)
                if self.rotate_deg.is_none() && self.steer.is_none() && self.exchange.is_none() =>
            {
                let remedy = "give advance_mm, retract_mm, withdraw, rotate_deg, steer, exchange, detach, wait_s or inject";
                Err(Error::parameter(name, "{}", remedy))
            }
            (_, _, true) => Ok(Travel::Out),
            (a, r, false) => Ok(Travel::By(a.unwrap_or(0.0) - r.unwrap_or(0.0))),
        }
    }

    /// Index of the instrument.
    fn number(&self, name: &str, stack: &Stack) -> Result<usize> {
        match &self.instrument {
            Some(instrument) => find(stack, instrument, &format!("{name}.instrument")),
            None if stack.is_several() => {
                let names: Vec<&str> = stack.instruments().iter().map(|one| one.name.as_str()).collect();
                let remedy = format!("say which one moves: {}", names.join(", "));
                Err(Error::parameter(format!("{name}.instrument"), "none", remedy))
            }
            None => Ok(0),
        }
    }

    /// This line and its `with` lines, each with its name in messages.
    fn together(&self, name: &str) -> Result<Vec<(String, &Self)>> {
        let mut lines = vec![(name.to_owned(), self)];
        for (index, line) in self.with.iter().enumerate() {
            let name = format!("{name}.with[{index}]");
            if !line.with.is_empty() {
                let remedy = "is with another line already: list all of them there";
                return Err(Error::parameter(format!("{name}.with"), line.with.len(), remedy));
            }
            let waits = line.wait_s.is_some() || line.step_s.is_some();
            let keys = [
                ("until", line.until.is_some()),
                ("exchange", line.exchange.is_some()),
                ("inject", line.inject.is_some()),
                ("wait_s", waits),
                ("detach", line.detach),
                ("solves", line.solves.is_some()),
            ];
            for (key, given) in keys {
                if given {
                    let remedy = "belongs to the line itself, not to those with it";
                    return Err(Error::parameter(format!("{name}.{key}"), "given", remedy));
                }
            }
            lines.push((name, line));
        }
        Ok(lines)
    }
}

/// Index of the instrument that a key names.
pub(super) fn find(stack: &Stack, instrument: &str, key: &str) -> Result<usize> {
    stack.find(instrument).map_err(|error| match error {
        Error::Parameter { value, remedy, .. } => Error::Parameter { name: key.to_owned(), value, remedy },
        other => other,
    })
}
