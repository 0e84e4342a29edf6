//! A simulation where parameters of its scene have other values, and derivatives by parameters.

use std::sync::{Arc, OnceLock};

use super::builder::check_entry;
use super::simulation::{Environment, Simulation, surroundings};
use crate::methods::{Gradient, Move, Parameter, Parts, Surroundings, Timed};
use crate::vessel::Lumen;
use crate::{Error, Result};

/// An instrument may become thicker by this factor until its contact points look for the wall no farther than where they touch it
/// ([`follow`](crate::tuning::ContactTuning::follow)).
const MOST_THICKER: f64 = 1.1;

impl Simulation {
    /// Derivatives, by these parameters, of what commands would lead to from here, one after the other: one [`Gradient`] for each.
    /// Nothing changes, and time stands still.
    ///
    /// They are those of [`Simulation::step_together`], through all parts of all commands, since friction remembers. Contacts keep
    /// their status, and [`Gradient::margin`] says how far the next change is.
    ///
    /// # Errors
    /// As [`Simulation::step_together`]; a parameter that does not exist or occurs twice, a method other than `kirchhoff`, a vessel that yields, loops that
    /// touch and detached coils ([`Error::Parameter`]); a command that passes a jump ([`Error::Computation`]).
    pub fn gradients(&self, commands: &[Vec<Move>], by: &[Parameter]) -> Result<Vec<Gradient>> {
        self.gradients_until(commands, &vec![self.time_s; commands.len()], by)
    }

    /// As [`Simulation::gradients`], while time proceeds in each command to one of `times_s`, s, and the vessel with it if it moves:
    /// derivatives of [`Simulation::step_until`].
    ///
    /// # Errors
    /// As [`Simulation::gradients`] and [`Simulation::step_until`]; another number of times.
    pub fn gradients_until(
        &self,
        commands: &[Vec<Move>],
        times_s: &[f64],
        by: &[Parameter],
    ) -> Result<Vec<Gradient>> {
        Parameter::check_each_once(by)?;
        match commands {
            [] => self.check_times((commands, times_s)).map(|()| Vec::new()),
            _ => self.record(commands, times_s)?.gradients(by),
        }
    }

    /// Derivatives of what commands would lead to, along one change of parameters together, each so much: the product J dp, of
    /// [`Simulation::gradients_until`], with one slope in each [`Gradient`]. It costs as much as the gradient by one parameter.
    ///
    /// # Errors
    /// As [`Simulation::gradients_until`]; no change.
    pub fn jvp(
        &self,
        commands: &[Vec<Move>],
        times_s: &[f64],
        along: &[(Parameter, f64)],
    ) -> Result<Vec<Gradient>> {
        match commands {
            [] => self.check_times((commands, times_s)).map(|()| Vec::new()),
            _ => self.record(commands, times_s)?.jvp(along),
        }
    }

    /// Checks the times after commands.
    ///
    /// # Errors
    /// Another number of times, and times that are not in their order.
    pub(super) fn check_times(&self, (commands, times_s): Timed<'_>) -> Result<()> {
        if times_s.len() != commands.len() {
            let remedy = format!("there are {} commands: give one for each", commands.len());
            return Err(Error::parameter("times_s", format!("{} times", times_s.len()), remedy));
        }
        let mut last_s = self.time_s;
        for time_s in times_s {
            self.check_time(Some(*time_s))?;
            if *time_s < last_s {
                let remedy = format!("must be in their order, {last_s} s come before it");
                return Err(Error::parameter("times_s", time_s, remedy));
            }
            last_s = *time_s;
        }
        Ok(())
    }

    /// The same simulation, in the same state, where parameters of the scene have other values; the moduli of regions of the wall
    /// change in proportion to the wall's. The device lies where it lay until the next step that moves it, also where the sheath
    /// is elsewhere.
    ///
    /// # Errors
    /// A parameter that does not exist there, occurs twice or belongs to a command, and a value that the scene could not have; an instrument that is
    /// a tenth thicker than all of those the wall was made for, or too thick for the vessel.
    pub fn changed(&self, values: &[(Parameter, f64)]) -> Result<Self> {
        Parameter::check_each_once(values.iter().map(|(parameter, _)| parameter))?;
        let mut parts = self.parts();
        for (parameter, _) in values {
            if parameter.value(&parts)?.is_none() {
                return Err(parameter.refused("it belongs to a command: move the hand"));
            }
        }
        Parameter::set_all(values, &mut parts)?;
        let Parts { stack, wall: properties, sheath, fields } = parts;
        stack.check_sections()?;
        properties.check_outside_regions()?;
        let Environment { lumen, motion, course, flow, thickest_mm, .. } = &*self.scene;
        let radius_mm = stack.radii_mm().1;
        let fits = |lumen: &Lumen| match lumen {
            Lumen::Swept(vessel) => vessel.least_radius_mm() > radius_mm,
            Lumen::Meshed(_) => true,
        };
        let (is_thicker, thickest_mm) = (radius_mm > *thickest_mm, *thickest_mm);
        if is_thicker && (radius_mm > MOST_THICKER * thickest_mm || !fits(lumen)) {
            let remedy = format!(
                "the wall was made for instruments of {thickest_mm} mm: make a simulation of thicker ones"
            );
            return Err(Error::parameter("changed.radius", radius_mm, remedy));
        }
        if sheath != self.scene.sheath || is_thicker {
            check_entry(lumen, motion.as_ref(), &stack, &sheath)?;
        }
        let (lumen, motion, flow) = (lumen.clone(), motion.clone(), flow.clone());
        let (course, mark) = (course.clone(), OnceLock::new());
        let scene = Environment { lumen, properties, sheath, stack, motion, course, flow, thickest_mm, mark };
        // Fields that do not change in the next step are other ones before it too.
        let fields_change = surroundings!(self, self.time_s).fields_change();
        let fields_before = if fields_change { Arc::clone(&self.fields_before) } else { Arc::clone(&fields) };
        Ok(Self { scene: Arc::new(scene), fields, fields_before, ..self.clone() })
    }

    /// The value of a parameter of the scene; none if it belongs to a command.
    ///
    /// # Errors
    /// A parameter that does not exist there.
    pub fn value(&self, parameter: &Parameter) -> Result<Option<f64>> {
        parameter.value(&self.parts())
    }

    /// What parameters change.
    fn parts(&self) -> Parts {
        let Environment { properties, sheath, stack, .. } = &*self.scene;
        let (stack, wall, fields) = (stack.clone(), properties.clone(), Arc::clone(&self.fields));
        Parts { stack, wall, sheath: *sheath, fields }
    }
}
