//! From a moment of a scene to its pictures: the one way on which a recording, a data set, a session and a simulation in
//! Python are drawn, so that every key of the view means the same to all of them.

use endowire_core::Result;
use endowire_core::insertion::DetachedCoil;
use endowire_core::shape::Shape;
use endowire_core::vessel::Displacement;

use crate::device::DeviceView;
use crate::fluoro::FrameTime;
use crate::pulse::Seen;
use crate::pushed::Pushed;
use crate::renderer::{Frames, Renderer};
use crate::three_d::ContactView;

/// What is in a vessel at a moment.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Number and time of its frame.
    pub frame: FrameTime,
    /// The centre line of all instruments.
    pub shape: &'a Shape,
    /// Inserted length of each instrument, mm.
    pub inserted_mm: &'a [f64],
    /// Detached coils.
    pub coils: &'a [DetachedCoil],
    /// Contacts with the wall, for the 3D view.
    pub contacts: &'a [ContactView],
    /// Displacement of the vessel; `None` if it is at rest.
    pub displacement: Option<&'a Displacement>,
    /// The moment before, since which instruments have moved: a pulse (`xray.pulse_ms`) shows the last of that motion.
    /// `None` if they rest, or if it is not known.
    pub before: Option<Seen<'a>>,
}

impl Moment<'_> {
    /// The devices that it shows, for pictures and labels; `pushed` gets its coils.
    ///
    /// # Errors
    /// As [`Pushed::leave`].
    pub fn devices(&self, pushed: &mut Pushed) -> Result<Vec<DeviceView>> {
        pushed.leave(self.coils)?;
        Ok(pushed.views(self.shape, self.inserted_mm))
    }
}

impl Renderer {
    /// Moves the vessel to its place at a moment, and shows the moment's contacts in the 3D view.
    ///
    /// # Errors
    /// As [`Renderer::move_vessel`].
    pub fn set(&mut self, moment: &Moment<'_>) -> Result<()> {
        self.show_contacts(moment.contacts);
        self.move_vessel(moment.displacement)
    }

    /// Draws the wanted views of a moment, in which these instruments are pushed.
    ///
    /// # Errors
    /// As [`Renderer::render_at`] and [`Pushed::leave`].
    pub fn draw(&mut self, pushed: &mut Pushed, moment: &Moment<'_>) -> Result<Frames> {
        self.set(moment)?;
        let devices = moment.devices(pushed)?;
        let now = Seen { shape: moment.shape, inserted_mm: moment.inserted_mm, time_s: moment.frame.time_s };
        let pulse = pushed.pulse(moment.before, now, self);
        self.render_pulse(&devices, &pulse, moment.frame)
    }
}
