//! What inputs do to a session.

use endowire_assess::{Injection, Outlet};
use endowire_core::insertion::Command;
use endowire_core::vessel::NoStore;
use endowire_core::{Error, Result};

use super::{Session, kind_of};
use crate::demonstration::Demonstration;
use crate::hand::Hand;
use crate::history::{Done, Injected};
use crate::input::Input;
use crate::lumens::lumens;
use crate::readout::EventKind;

impl Session {
    /// Applies an input. A refused input becomes an event and changes nothing else.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value that is out of range or a name that does not exist.
    pub fn apply(&mut self, input: &Input) -> Result<()> {
        self.inputs.push((self.ticks, input.clone()));
        let done = self.check_in_exam(input).and_then(|()| self.carry_out(input));
        if let Err(error) = &done {
            self.happened(kind_of(error), error.to_string());
        }
        done
    }

    fn carry_out(&mut self, input: &Input) -> Result<()> {
        match input {
            Input::Select { instrument } => self.selected = self.simulation.stack().find(instrument)?,
            Input::Move { instrument, mm_per_s, deg_per_s } => {
                let index = self.index(instrument.as_deref())?;
                self.hands[index].hold(*mm_per_s, *deg_per_s)?;
                if *mm_per_s != 0.0 || *deg_per_s != 0.0 {
                    self.take_over();
                }
            }
            Input::Nudge { instrument, mm, deg } => {
                let index = self.index(instrument.as_deref())?;
                self.hands[index].nudge(*mm, *deg)?;
                self.take_over();
            }
            Input::Steer { instrument, to, per_s } => {
                let index = self.index(instrument.as_deref())?;
                self.check_steered(index, *to)?;
                self.hands[index].steer(*to, *per_s)?;
                if to.is_some() {
                    self.take_over();
                }
            }
            Input::Stop {} => {
                self.stop();
                self.demonstration.iter_mut().for_each(|shown| shown.paused = true);
            }
            Input::Script {} => self.demonstrate()?,
            Input::Pedal { down, mode } => self.lab.pedal(*down, *mode)?,
            Input::Inject { ml, ml_per_s } => self.inject(self.injects_through(), *ml, *ml_per_s)?,
            Input::Detach { instrument } => self.detach(self.index(instrument.as_deref())?)?,
            Input::CArm { pose } => self.lab.pose(*pose)?,
            Input::TurnCArm { lao_deg, cra_deg } => self.lab.turn_c_arm([*lao_deg, *cra_deg])?,
            Input::Table { right_mm, down_mm, second } => {
                self.lab.table([*right_mm, *down_mm], *second)?;
            }
            Input::Zoom { factor } => self.lab.zoom(*factor)?,
            Input::Collimate { width, height } => self.lab.collimate([*width, *height])?,
            Input::TurnCamera { azimuth_deg, elevation_deg } => {
                self.lab.turn_camera([*azimuth_deg, *elevation_deg])?;
            }
            Input::ZoomCamera { factor } => self.lab.zoom_camera(*factor)?,
            Input::MoveCamera { right, up } => self.lab.move_camera([*right, *up])?,
            Input::Undo {} => self.go_to(self.history.last_motion())?,
            Input::Redo {} => self.go_to(self.history.next_motion())?,
            Input::GoTo { step } => {
                let steps = self.history.steps();
                if *step > steps {
                    return Err(Error::parameter("step", step, format!("{steps} steps were carried out")));
                }
                self.go_to(*step)?;
            }
        }
        Ok(())
    }

    /// Refuses to steer an instrument that has nothing to be steered.
    fn check_steered(&self, index: usize, to: Option<f64>) -> Result<()> {
        let instrument = &self.simulation.stack().instruments()[index];
        match to {
            Some(to) if !instrument.device.is_steerable() => {
                let name = &instrument.name;
                let remedy =
                    format!("{name:?} is not steered: give a section of it steer, or select another");
                Err(Error::parameter("steer", to, remedy))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn stop(&mut self) {
        self.hands.iter_mut().for_each(|hand| *hand = Hand::default());
    }

    /// Starts the script, or continues it.
    fn demonstrate(&mut self) -> Result<()> {
        if let Some(shown) = &mut self.demonstration {
            shown.paused = false;
            return Ok(());
        }
        let steps = self.history.steps();
        let Some(script) = self.script.clone().filter(|script| !script.is_empty()) else {
            let remedy = "there is none to show: give [[script]] in the scene";
            return Err(Error::parameter("script", "none", remedy));
        };
        if steps > 0 {
            let remedy = "it begins where the scene does: go back to step 0 first";
            return Err(Error::parameter("script", format!("step {steps}"), remedy));
        }
        self.stop();
        self.demonstration = Some(Demonstration::new(script));
        Ok(())
    }

    /// Detaches the coil of an instrument, as a motion.
    fn detach(&mut self, instrument: usize) -> Result<()> {
        self.take_over();
        self.stop();
        // The check uses a copy in which the device has caught up, so that a refusal changes nothing.
        let mut followed = self.simulation.clone();
        if followed.report().is_under_way() {
            followed.step(Command::default())?;
        }
        followed.check_detach(instrument)?;
        self.catch_up()?;
        self.advance(Done { detach: Some(instrument), ..Self::resting() }, true)
    }

    /// Lets the device catch up with its commanded motion and come to rest.
    fn catch_up(&mut self) -> Result<()> {
        if self.simulation.report().is_under_way() { self.advance(Self::resting(), false) } else { Ok(()) }
    }

    /// Ends a script that is being played, because the operator moves an instrument.
    fn take_over(&mut self) {
        if self.demonstration.take().is_some() {
            self.happened(EventKind::Script, "the script ends here: a hand has taken over".to_owned());
        }
    }

    /// Goes to the state after a step, backwards or forwards. Contrast medium of undone steps is removed; that of
    /// redone steps flows from now on.
    fn go_to(&mut self, step: usize) -> Result<()> {
        self.stop();
        self.demonstration = None;
        self.moving = false;
        self.holds_still = true;
        let before = self.history.steps();
        self.history.go_to(step, &mut self.simulation)?;
        self.pack();
        self.telemetry.go_elsewhere();
        let again = self.history.inject_again(before, self.time_s());
        self.lab.flow_again(self.history.undone_injections().map(|one| &one.flow), again)
    }

    /// Injects through an instrument, or through the sheath if there is none or it is not inserted. Pictures, script and
    /// record all take the place where the medium leaves from its [`Outlet`].
    pub(super) fn inject(&mut self, instrument: Option<usize>, ml: f64, ml_per_s: f64) -> Result<()> {
        let outlet = Outlet::of(&self.simulation, instrument);
        let instrument = instrument.filter(|_| outlet.instrument.is_some());
        let time_s = self.time_s();
        let wall = self.simulation.lumen().wall(&NoStore)?;
        let flow = self.lab.inject(wall, (ml, ml_per_s), outlet.at_mm, time_s)?;
        let after_step = self.history.steps();
        self.history.inject(Injected { instrument, ml, ml_per_s, after_step, flow });
        let (volume_ml, rate_ml_per_s) = (ml, ml_per_s);
        self.telemetry.inject(Injection { time_s, volume_ml, rate_ml_per_s, outlet: Some(outlet) });
        Ok(())
    }

    fn index(&self, instrument: Option<&str>) -> Result<usize> {
        instrument.map_or(Ok(self.selected), |name| self.simulation.stack().find(name))
    }

    /// The instrument through which contrast medium is injected: the outermost inserted one with a lumen.
    fn injects_through(&self) -> Option<usize> {
        let open = lumens(self.simulation.stack(), self.lab.fluoro());
        let in_it = |one: &usize| self.simulation.tip_of_mm(*one).is_some();
        (0..open.len()).rev().filter(|one| open[*one]).find(in_it)
    }
}
