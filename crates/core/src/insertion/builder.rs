//! Construction of a simulation, with the checks before it begins.

use std::sync::{Arc, OnceLock};

use super::simulation::{Environment, Simulation};
use super::{Sheath, WallProperties};
use crate::device::{Device, Stack};
use crate::error::vector;
use crate::flow::BloodFlow;
use crate::methods::MethodChoice;
use crate::methods::kirchhoff::KirchhoffOptions;
use crate::rod::MAX_ANGLES;
use crate::vessel::{Course, Lumen, NoStore, VesselMotion, WallStore};
use crate::{Error, Result};

/// A simulation to be built from vessel, device and sheath, and optional settings.
pub struct SimulationBuilder<'a> {
    lumen: Lumen,
    stack: Stack,
    sheath: Sheath,
    properties: WallProperties,
    motion: Option<VesselMotion>,
    course: Option<Arc<Course>>,
    flow: Option<BloodFlow>,
    method: Option<&'a dyn MethodChoice>,
    store: &'a dyn WallStore,
}

/// Distance in front of the sheath's mouth, mm, at which the inside test is made: the mouth itself may lie in the
/// plane of an opening, where inside and outside meet.
const MOUTH_MM: f64 = 1e-3;

impl<'a> SimulationBuilder<'a> {
    pub(super) fn new(lumen: Lumen, stack: Stack, sheath: Sheath) -> Self {
        let properties = WallProperties::default();
        let (motion, course, flow, method) = (None, None, None, None);
        Self { lumen, stack, sheath, properties, motion, course, flow, method, store: &NoStore }
    }

    /// Stiffness and friction of the wall; [`WallProperties::default`] unless set.
    #[must_use]
    pub fn properties(mut self, properties: WallProperties) -> Self {
        self.properties = properties;
        self
    }

    /// Motion of the vessel; none unless set.
    #[must_use]
    pub fn motion(mut self, motion: Option<VesselMotion>) -> Self {
        self.motion = motion;
        self
    }

    /// The course of a vessel that yields as a whole; only its wall does unless set.
    #[must_use]
    pub fn course(mut self, course: Option<Course>) -> Self {
        self.course = course.map(Arc::new);
        self
    }

    /// Blood flow, with drag on the device; none unless set.
    #[must_use]
    pub fn flow(mut self, flow: Option<BloodFlow>) -> Self {
        self.flow = flow;
        self
    }

    /// The method for equilibria; [`KirchhoffOptions::default`], the exact rod, unless set.
    #[must_use]
    pub fn method(mut self, method: &'a dyn MethodChoice) -> Self {
        self.method = Some(method);
        self
    }

    /// A store for walls that are costly to build; none unless set.
    #[must_use]
    pub fn store(mut self, store: &'a dyn WallStore) -> Self {
        self.store = store;
        self
    }

    /// The device at the mouth of the sheath, nothing inserted.
    ///
    /// # Errors
    /// A sheath outside the vessel, a device too thick for the vessel at the sheath's mouth, a wall too damaged for
    /// an inside test, blood that flows nowhere in the vessel, wall properties or method options out of range, more
    /// than three instruments with friction, and features that the method does not support.
    pub fn build(self) -> Result<Simulation> {
        let Self { lumen, stack, sheath, properties, motion, course, flow, method, store } = self;
        properties.check(&lumen, store)?;
        flow.iter().try_for_each(|flow| flow.check_within(&lumen))?;
        check_entry(&lumen, motion.as_ref(), &stack, &sheath)?;
        // With more than three instruments, those without a rest shape have friction along the line only.
        let rub = stack.has_inner_friction() && stack.instruments().len() <= MAX_ANGLES;
        let twists = properties.has_friction() || rub;
        let stack = if twists { stack.twisted()? } else { stack };
        let (thickest_mm, mark) = (stack.radii_mm().1, OnceLock::new());
        let scene = Environment { lumen, properties, sheath, stack, motion, course, flow, thickest_mm, mark };
        let own = KirchhoffOptions::default();
        let method = method.unwrap_or(&own);
        if scene.stack.is_several() && !method.takes_several() {
            let remedy = "pushes one device and no more: leave one instrument, or choose kirchhoff";
            return Err(Error::parameter("method.name", method.name(), remedy));
        }
        if scene.stack.is_steerable() && !method.takes_steering() {
            let remedy =
                "knows no devices that are steered: leave steer out of their sections, or choose kirchhoff";
            return Err(Error::parameter("method.name", method.name(), remedy));
        }
        if scene.stack.has_soft_plane() && !method.takes_soft_planes() {
            let remedy =
                "knows one bending stiffness of a section: leave soft_plane out of them, or choose kirchhoff";
            return Err(Error::parameter("method.name", method.name(), remedy));
        }
        let method = method.start(&scene.surroundings([0.0; 2]), store)?;
        let (fields, fields_before) = (Arc::new([]), Arc::new([]));
        Ok(Simulation { scene: Arc::new(scene), method, time_s: 0.0, fields, fields_before, stop: None })
    }
}

/// Rejects a sheath whose mouth is outside the vessel, instruments that are too thick for it there, and a vessel that would move
/// through them.
pub(super) fn check_entry(
    lumen: &Lumen,
    motion: Option<&VesselMotion>,
    stack: &Stack,
    sheath: &Sheath,
) -> Result<()> {
    check_inside(lumen, sheath)?;
    let room_mm = lumen.distance_mm(&sheath.position_mm)?;
    stack.devices().try_for_each(|device| check_mouth(room_mm, device, sheath))?;
    motion.map_or(Ok(()), |motion| check_still(room_mm, motion, stack, sheath))
}

/// Rejects a sheath whose mouth is outside the vessel.
fn check_inside(lumen: &Lumen, sheath: &Sheath) -> Result<()> {
    if lumen.contains(&(sheath.position_mm + sheath.direction * MOUTH_MM))? {
        return Ok(());
    }
    let openings: Vec<String> = lumen
        .openings()
        .iter()
        .map(|o| format!("{} at [{:.1}, {:.1}, {:.1}]", o.index, o.centre_mm.x, o.centre_mm.y, o.centre_mm.z))
        .collect();
    Err(Error::parameter(
        "sheath.position_mm",
        vector(&sheath.position_mm),
        format!(
            "is outside the vessel: place it inside, or name an opening (sheath.opening); openings: {}",
            if openings.is_empty() { "none".to_owned() } else { openings.join(", ") }
        ),
    ))
}

/// Rejects a motion that would move the wall, `mouth_mm` away, through the device in the sheath's mouth, which does
/// not move.
fn check_still(mouth_mm: f64, motion: &VesselMotion, stack: &Stack, sheath: &Sheath) -> Result<()> {
    let mouth = &sheath.position_mm;
    let radius_mm = stack.radii_mm().1;
    let room_mm = mouth_mm - radius_mm;
    let moved_mm = motion.farthest_mm(mouth, room_mm + radius_mm);
    if moved_mm <= room_mm {
        return Ok(());
    }
    let remedy = format!(
        "so far may the vessel move at the sheath's mouth at {}, which stays where it is with {room_mm:.3} mm to spare: keep the vessel \
         still there (still)",
        vector(mouth)
    );
    Err(Error::parameter("vessel.motion", format!("{moved_mm:.3} mm"), remedy))
}

/// Ratio of a device's thickness to the vessel's from which a mistake of units is assumed.
const MISFIT: f64 = 5.0;

/// Rejects a device that is in contact from the start, `room_mm` being the distance of the wall from the sheath's
/// mouth. Farther in, a vessel may be narrower: there the device cannot pass.
fn check_mouth(room_mm: f64, device: &Device, sheath: &Sheath) -> Result<()> {
    let thickest = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0));
    match device.sections().iter().map(|s| s.radius_mm).enumerate().max_by(thickest) {
        Some((section, radius_mm)) if radius_mm > room_mm => Err(Error::parameter(
            format!("device.section[{section}].radius_mm"),
            radius_mm,
            format!(
                "the wall is {room_mm:.3} mm from the sheath's mouth at {}: use a thinner device or move the sheath{}",
                vector(&sheath.position_mm),
                if radius_mm > MISFIT * room_mm {
                    ", or check vessel.unit_mm: they are not of one scale"
                } else {
                    ""
                }
            ),
        )),
        _ => Ok(()),
    }
}
