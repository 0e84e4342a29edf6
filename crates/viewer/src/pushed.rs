//! The inserted device, or several instruments, as seen by the viewer.

use endowire_core::device::{Device, Kind, Stack, line_mm};
use endowire_core::insertion::DetachedCoil;
use endowire_core::methods::MethodChoice;
use endowire_core::scene::SceneOf;
use endowire_core::shape::Shape;
use endowire_core::vessel::Displacement;
use endowire_core::{Error, Result, Vec3};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::device::{DevicePart, DeviceView, bore_too_wide};
use crate::device_file::{device_part_names, device_parts, section_parts};
use crate::shaft::SheathMouth;
use crate::spec::ViewSpec;

/// Instruments of a scene and their materials.
#[derive(Debug, Clone)]
pub struct Pushed {
    stack: Stack,
    /// Parts of each to draw.
    parts: Vec<Vec<DevicePart>>,
    /// The kind of each, if its file gives it.
    kinds: Vec<Option<Kind>>,
    /// The names of their parts, if files give them.
    part_names: Vec<Vec<String>>,
    /// Detached coils.
    coils: Vec<DetachedCoil>,
}

impl Pushed {
    /// The instruments of a scene. The parts of a single device come from the `[view]` table if given there, all
    /// others from device files.
    ///
    /// # Errors
    /// As [`SceneOf::stack`]; unknown materials in a device file; a `[view]` table that describes one device where
    /// there are several, or a different one; an injection through a tip if no instrument has a lumen.
    pub fn new<M: MethodChoice + DeserializeOwned + Default>(
        scene: &SceneOf<M>,
        spec: &ViewSpec,
    ) -> Result<Self> {
        let stack = scene.stack()?;
        let (mut parts, mut kinds, mut part_names) = (Vec::new(), Vec::new(), Vec::new());
        for (file, device) in scene.device_files()?.iter().zip(stack.devices()) {
            parts.push(match file {
                Some((path, file)) => {
                    device_parts(file).map_err(|error| Error::content(path, error.to_string()))?
                }
                None => section_parts(device),
            });
            kinds.push(file.as_ref().and_then(|(_, file)| file.kind));
            part_names.push(file.as_ref().map_or_else(Vec::new, |(_, file)| device_part_names(file)));
        }
        if let Some(own) = spec.own_parts(stack.is_several())? {
            for (number, part) in own.iter().enumerate() {
                check_bore(number, part, &stack.instruments()[0].device)?;
            }
            parts[0] = own.to_vec();
            part_names[0].clear();
        }
        let pushed = Self { stack, parts, kinds, part_names, coils: Vec::new() };
        let through_tip = spec.injection.iter().position(|one| one.at_tip);
        if let Some(number) = through_tip.filter(|_| !(0..pushed.parts.len()).any(|i| pushed.has_lumen(i))) {
            let remedy =
                "nothing that is pushed has a lumen: medium comes through a catheter, not along a wire";
            return Err(Error::parameter(format!("view.injection[{number}].at_tip"), true, remedy));
        }
        Ok(pushed)
    }

    /// Instruments with the materials of their parts.
    pub fn of_parts(stack: Stack, parts: Vec<Vec<DevicePart>>) -> Self {
        let count = stack.instruments().len();
        Self { stack, parts, kinds: vec![None; count], part_names: vec![vec![]; count], coils: Vec::new() }
    }

    /// Makes views show these coils, detached from instruments of the stack, after all inserted instruments.
    ///
    /// # Errors
    /// A coil of a nonexistent instrument.
    pub fn leave(&mut self, coils: &[DetachedCoil]) -> Result<()> {
        let count = self.stack.instruments().len();
        if let Some(other) = coils.iter().find(|coil| coil.instrument >= count) {
            let remedy = format!("there are {count} instruments, the innermost is 0");
            return Err(Error::parameter("coil.instrument", other.instrument, remedy));
        }
        self.coils = coils.to_vec();
        Ok(())
    }

    /// Whether medium can flow through an instrument.
    pub fn has_lumen(&self, instrument: usize) -> bool {
        let sections = self.stack.instruments()[instrument].device.sections();
        sections.iter().any(|section| section.inner_radius_mm.is_some())
            || self.parts[instrument].iter().any(|part| part.inner_radius_mm > 0.0)
    }

    /// Whether an instrument is a wire: according to its file, or because it has no lumen.
    pub fn is_wire(&self, instrument: usize) -> bool {
        match self.kinds[instrument] {
            Some(kind) => matches!(kind, Kind::Guidewire | Kind::Microwire),
            None => !self.has_lumen(instrument),
        }
    }

    /// Whether an instrument is a coil on its pusher, according to its file.
    pub fn is_coil(&self, instrument: usize) -> bool {
        self.kinds[instrument] == Some(Kind::Coil)
    }

    /// The name in an instrument's file of a drawn part, by its index.
    pub fn part_name(&self, instrument: usize, part: usize) -> Option<&str> {
        self.part_names[instrument].get(part).map(String::as_str)
    }

    /// The tip of the innermost inserted instrument with a lumen on this line, for these lengths, mm; transformed to
    /// the vessel at rest if it is displaced.
    pub fn tip_at_rest_mm(
        &self,
        shape: &Shape,
        inserted_mm: &[f64],
        displacement: Option<&Displacement>,
    ) -> Option<Vec3> {
        let mut in_line = inserted_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0);
        let (_, first_mm) = in_line.find(|(instrument, _)| self.has_lumen(*instrument))?;
        let tip_mm = shape.position_at(line_mm(inserted_mm.iter().copied()) - first_mm)?;
        Some(displacement.map_or(tip_mm, |displacement| displacement.material(&tip_mm)))
    }

    /// Views of all inserted instruments on this line, for these lengths.
    pub fn views(&self, shape: &Shape, inserted_mm: &[f64]) -> Vec<DeviceView> {
        let line_mm = line_mm(inserted_mm.iter().copied());
        let behind = inserted_mm.iter().filter(|mm| **mm > 0.0).map(|mm| shape.behind(line_mm - mm));
        self.views_of(&behind.collect::<Vec<_>>(), SheathMouth::of_line(shape), inserted_mm)
    }

    /// What [`Self::views`] shows, in their order.
    pub fn shown(&self, inserted_mm: &[f64]) -> Vec<ShownDevice> {
        let shown = |instrument: usize, detached: bool| {
            let name = self.stack.instruments()[instrument].name.clone();
            ShownDevice { instrument, name, detached }
        };
        let is_in = inserted_mm.iter().enumerate().filter(|(_, mm)| **mm > 0.0);
        let left = self.coils.iter().map(|coil| shown(coil.instrument, true));
        is_in.map(|(instrument, _)| shown(instrument, false)).chain(left).collect()
    }

    /// Views of all that is in, on lines of their own out of a sheath.
    pub(crate) fn views_of(
        &self,
        shapes: &[Shape],
        sheath: Option<SheathMouth>,
        inserted_mm: &[f64],
    ) -> Vec<DeviceView> {
        let each = self.stack.devices().zip(&self.parts).zip(inserted_mm).filter(|(_, mm)| **mm > 0.0);
        let view = |(((device, parts), _), shape): (((&Device, &Vec<DevicePart>), &f64), &Shape)| {
            DeviceView { sheath, ..DeviceView::of_device(shape, device, parts) }
        };
        let left = self.coils.iter().map(|coil| {
            let (device, parts) =
                (&self.stack.instruments()[coil.instrument].device, &self.parts[coil.instrument]);
            DeviceView::of_device(&coil.shape, device, parts)
        });
        each.zip(shapes).map(view).chain(left).collect()
    }
}

/// Which device a view shows: numbers of views change as instruments come in and coils are detached.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ShownDevice {
    /// Number of the instrument, the innermost is 0.
    pub instrument: usize,
    /// Its name; empty of a device alone.
    pub name: String,
    /// Whether it is its coil, which was detached.
    pub detached: bool,
}

/// Refuses a table of the view that is as wide inside as its device is outside: it was written for another.
fn check_bore(number: usize, part: &DevicePart, device: &Device) -> Result<()> {
    let [near, far] = part.from_tip_mm.unwrap_or([0.0, f64::INFINITY]);
    let mut begin_mm = 0.0;
    for section in device.sections() {
        let end_mm = begin_mm + section.length_mm;
        let outer_mm = part.outer_radius_mm.unwrap_or(section.radius_mm);
        if near < end_mm && begin_mm < far && part.inner_radius_mm >= outer_mm {
            return Err(bore_too_wide(&format!("view.device[{number}]"), part.inner_radius_mm, outer_mm));
        }
        begin_mm = end_mm;
    }
    Ok(())
}
