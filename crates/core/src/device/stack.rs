//! Coaxial instruments: a wire in a microcatheter in a catheter.

use std::borrow::Cow;

use super::{Device, Section};
use crate::contact::{check_friction, check_valve};
use crate::error::nearest_name;
use crate::rod::MAX_ANGLES;
use crate::{Error, Result};

/// A device with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    /// Its name in commands and reports.
    pub name: String,
    /// Its sections.
    pub device: Device,
    /// Whether its tip may be farther in than that of the instrument inside it; if not, it can only be pushed over
    /// that one.
    pub may_lead: bool,
}

/// Instruments on one line, the innermost first; those that are never inserted at the same time may be alternatives.
///
/// ```
/// use endowire_core::{Device, Instrument, Section, Stack};
///
/// let wire = Device::uniform(400.0, 0.4, 10.0)?;
/// let tube = Section { inner_radius_mm: Some(0.5), ..Section::straight(300.0, 0.85, 40.0) };
/// let catheter = Device::new(vec![tube])?;
/// let instrument = |name: &str, device| Instrument { name: name.to_owned(), device, may_lead: true };
/// let stack = Stack::new(vec![instrument("wire", wire), instrument("catheter", catheter)])?;
/// assert_eq!(stack.instruments()[1].name, "catheter");
/// # Ok::<(), endowire_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    instruments: Vec<Instrument>,
    /// Set of material angles of each, if any; coils, of which only one is inserted at a time, share a set.
    sets: Vec<Option<usize>>,
    /// Coefficient of friction between each and those outside it.
    frictions: Vec<f64>,
    /// Friction force, N, of the valve on the hub of each, which seals the instruments inside it.
    valves_n: Vec<f64>,
    /// Whether each has play in those outside it.
    plays: Vec<bool>,
}

/// Largest number of instruments of a stack.
const MOST: usize = 16;
/// Slack in inserted lengths, mm: the rounding of thousands of summed increments.
pub(crate) const LENGTH_SLACK_MM: f64 = 1e-6;

/// Assignment of sets of angles.
#[derive(Default)]
struct Angles {
    count: usize,
    coils: Option<usize>,
}

impl Angles {
    /// The set of a device.
    fn of(&mut self, device: &Device) -> usize {
        let is_coil = device.coil_mm() > 0.0;
        if let Some(set) = self.coils.filter(|_| is_coil) {
            return set;
        }
        self.count += 1;
        if is_coil {
            self.coils = Some(self.count - 1);
        }
        self.count - 1
    }
}

impl From<Device> for Stack {
    /// A single device, named `device`.
    fn from(device: Device) -> Self {
        let sets = vec![device.is_shaped().then_some(0)];
        let instruments = vec![Instrument { name: "device".to_owned(), device, may_lead: true }];
        Self { instruments, sets, frictions: vec![0.0], valves_n: vec![0.0], plays: vec![false] }
    }
}

impl Stack {
    /// Instruments, the innermost first.
    ///
    /// # Errors
    /// No instrument or more than 16, a name that is empty or given twice, and more than three instruments with a
    /// rest shape.
    pub fn new(instruments: Vec<Instrument>) -> Result<Self> {
        if instruments.is_empty() || instruments.len() > MOST {
            let remedy = format!("give 1 to {MOST} instruments, the innermost first");
            return Err(Error::parameter("instrument", instruments.len(), remedy));
        }
        let (mut sets, mut angles) = (Vec::with_capacity(instruments.len()), Angles::default());
        for (index, instrument) in instruments.iter().enumerate() {
            let name = &instrument.name;
            if name.is_empty() || instruments[..index].iter().any(|other| other.name == *name) {
                let remedy = "every instrument has a name of its own: commands call it by that";
                return Err(Error::parameter(
                    format!("instrument[{index}].name"),
                    format!("{name:?}"),
                    remedy,
                ));
            }
            sets.push(instrument.device.is_shaped().then(|| angles.of(&instrument.device)));
        }
        if angles.count > MAX_ANGLES {
            let remedy = format!(
                "at most {MAX_ANGLES} instruments on one line, coils counting as one, may have a shape of their own"
            );
            return Err(Error::parameter(
                "instrument",
                format!("{} with rest curvature", angles.count),
                remedy,
            ));
        }
        let (frictions, valves_n) = (vec![0.0; instruments.len()], vec![0.0; instruments.len()]);
        let plays = vec![false; instruments.len()];
        Ok(Self { instruments, sets, frictions, valves_n, plays })
    }

    /// The same instruments with these Coulomb coefficients of friction, each between one and those outside it.
    ///
    /// # Errors
    /// A number of coefficients other than that of instruments, one outside 0 to 2, or a nonzero one of the
    /// outermost.
    pub fn with_friction(mut self, frictions: Vec<f64>) -> Result<Self> {
        if frictions.len() != self.instruments.len() {
            let remedy = format!("there are {} instruments: give one for each", self.instruments.len());
            return Err(Error::parameter("instrument.friction", frictions.len(), remedy));
        }
        let name = |index: usize| format!("instrument[{index}].friction");
        for (index, friction) in frictions.iter().enumerate() {
            check_friction(&name(index), *friction)?;
        }
        let last = frictions.len() - 1;
        if frictions[last] > 0.0 {
            let remedy =
                "the last instrument has none outside it: the wall's friction is vessel.wall.friction";
            return Err(Error::parameter(name(last), frictions[last], remedy));
        }
        self.frictions = frictions;
        Ok(self)
    }

    /// The same instruments, with a valve on the hub of each whose friction, N, acts on what slips and rotates in it;
    /// 0 for none.
    ///
    /// # Errors
    /// A number of forces other than that of instruments, one outside 0 to 100 N, or a nonzero one of the innermost.
    pub fn sealed(mut self, valves_n: Vec<f64>) -> Result<Self> {
        if valves_n.len() != self.instruments.len() {
            let remedy = format!("there are {} instruments: give one for each", self.instruments.len());
            return Err(Error::parameter("instrument.valve_n", valves_n.len(), remedy));
        }
        let name = |index: usize| format!("instrument[{index}].valve_n");
        for (index, valve_n) in valves_n.iter().enumerate() {
            check_valve(&name(index), *valve_n)?;
        }
        if valves_n[0] > 0.0 {
            let remedy = "nothing lies in the first instrument: the valve of the introducer sheath is sheath.friction_n";
            return Err(Error::parameter(name(0), valves_n[0], remedy));
        }
        self.valves_n = valves_n;
        Ok(self)
    }

    /// The same instruments, those with play in the next one outside them that is in: as much as their radii leave.
    ///
    /// # Errors
    /// A number of entries other than that of instruments, play of the outermost, and play with sections that bend more easily in one
    /// plane.
    pub fn with_clearance(mut self, plays: Vec<bool>) -> Result<Self> {
        if plays.len() != self.instruments.len() {
            let remedy = format!("there are {} instruments: give one for each", self.instruments.len());
            return Err(Error::parameter("instrument.clearance", plays.len(), remedy));
        }
        let last = plays.len() - 1;
        if plays[last] {
            let remedy = "the last instrument has none outside it: its play in the vessel is always modelled";
            return Err(Error::parameter(format!("instrument[{last}].clearance"), true, remedy));
        }
        if let Some(first) = plays.iter().position(|plays| *plays).filter(|_| self.has_soft_plane()) {
            let remedy = "play is modelled for instruments that are as stiff in all planes: leave it or soft_plane out";
            return Err(Error::parameter(format!("instrument[{first}].clearance"), true, remedy));
        }
        self.plays = plays;
        Ok(self)
    }

    /// Whether an instrument has play in those outside it.
    pub fn has_clearance(&self, instrument: usize) -> bool {
        self.plays[instrument]
    }

    /// Whether any of them has.
    pub(crate) fn has_play(&self) -> bool {
        self.plays.contains(&true)
    }

    /// Friction of the valve on the hub of an instrument, N.
    pub fn valve_n(&self, instrument: usize) -> f64 {
        self.valves_n[instrument]
    }

    /// Coefficient of friction between an instrument and those outside it.
    pub fn friction(&self, instrument: usize) -> f64 {
        self.frictions[instrument]
    }

    /// Whether there is friction between any instruments.
    pub(crate) fn has_inner_friction(&self) -> bool {
        self.frictions.iter().any(|friction| *friction > 0.0)
    }

    /// The same instruments with a set of material angles each: friction also twists straight ones.
    ///
    /// # Errors
    /// More than three instruments, all coils counting as one.
    pub(crate) fn twisted(mut self) -> Result<Self> {
        let mut angles = Angles::default();
        let sets = self.devices().map(|device| Some(angles.of(device))).collect();
        if angles.count > MAX_ANGLES {
            let remedy = format!(
                "friction twists every instrument, and at most {MAX_ANGLES} on one line may be twisted: leave some out, or set friction to 0"
            );
            return Err(Error::parameter("instrument", angles.count, remedy));
        }
        self.sets = sets;
        Ok(self)
    }

    /// Whether any of the instruments is steered.
    pub fn is_steerable(&self) -> bool {
        self.devices().any(Device::is_steerable)
    }

    /// Whether any of the instruments bends more easily in one plane.
    pub(crate) fn has_soft_plane(&self) -> bool {
        self.devices().any(Device::has_soft_plane)
    }

    /// The same instruments steered to these values; those that are not steered have none.
    pub(crate) fn steered(&self, values: impl Iterator<Item = f64> + Clone) -> Cow<'_, Self> {
        let is_at = |(device, value): (&Device, f64)| device.steered_to() == value || !device.is_steerable();
        if self.devices().zip(values.clone()).all(is_at) {
            return Cow::Borrowed(self);
        }
        let mut steered = self.clone();
        for (instrument, value) in steered.instruments.iter_mut().zip(values) {
            if instrument.device.is_steerable() {
                instrument.device = instrument.device.steered(value);
            }
        }
        Cow::Owned(steered)
    }

    /// Changes a section of an instrument, which stays as it is otherwise: its set of angles too.
    pub(crate) fn change_section(
        &mut self,
        (instrument, section): (usize, usize),
        change: impl FnOnce(&mut Section),
    ) {
        self.instruments[instrument].device.change_section(section, change);
    }

    /// Checks all sections.
    ///
    /// # Errors
    /// As [`Device::new`].
    pub(crate) fn check_sections(&self) -> Result<()> {
        self.devices().try_for_each(|device| Device::new(device.sections().to_vec()).map(drop))
    }

    /// Number of sets of material angles on the line.
    pub(crate) fn angles(&self) -> usize {
        self.sets.iter().flatten().max().map_or(0, |last| last + 1)
    }

    /// The instruments, the innermost first.
    pub fn instruments(&self) -> &[Instrument] {
        &self.instruments
    }

    /// The innermost instrument's device, or the single device.
    pub fn first(&self) -> &Device {
        // `new` rejects stacks without instruments.
        &self.instruments[0].device
    }

    /// Whether there is more than one instrument.
    pub fn is_several(&self) -> bool {
        self.instruments.len() > 1
    }

    /// How far an instrument must be in for its coil to be out of all others where these lengths are in, mm: its end comes free of what it lay in where it
    /// no longer touches that.
    pub(crate) fn out_mm(&self, instrument: usize, inserted_mm: &[f64]) -> f64 {
        let device = &self.instruments[instrument].device;
        let end_mm = device.section_at(device.coil_mm()).radius_mm;
        let outside = self.devices().zip(inserted_mm).skip(instrument + 1).filter(|(_, mm)| **mm > 0.0);
        let free_mm = outside.map(|(outer, mm)| mm + outer.section_at(0.0).radius_mm + end_mm);
        device.coil_mm() + free_mm.fold(0.0, f64::max)
    }

    /// The devices, the innermost first.
    pub fn devices(&self) -> impl DoubleEndedIterator<Item = &Device> + ExactSizeIterator {
        self.instruments.iter().map(|instrument| &instrument.device)
    }

    /// Set of material angles of each instrument, if any: instruments with a rest shape have one, and all if friction
    /// twists them.
    pub(crate) fn sets(&self) -> &[Option<usize>] {
        &self.sets
    }

    /// Index of the instrument of this name.
    ///
    /// # Errors
    /// An unknown name, with the most similar one.
    pub fn find(&self, name: &str) -> Result<usize> {
        let found = self.instruments.iter().position(|instrument| instrument.name == name);
        found.ok_or_else(|| {
            let names = self.instruments.iter().map(|instrument| instrument.name.as_str());
            let nearest = nearest_name(names, name).unwrap_or_default();
            Error::parameter("instrument", format!("{name:?}"), format!("did you mean {nearest:?}?"))
        })
    }

    /// Length of the longest, mm.
    pub fn length_mm(&self) -> f64 {
        self.devices().map(Device::length_mm).fold(0.0, f64::max)
    }

    /// Smallest and largest outer radius, mm.
    pub fn radii_mm(&self) -> (f64, f64) {
        let thinnest = self.devices().map(Device::min_radius_mm).fold(f64::MAX, f64::min);
        (thinnest, self.devices().map(Device::max_radius_mm).fold(0.0, f64::max))
    }

    /// Smallest bending stiffness, N·mm².
    pub(crate) fn softest_nmm2(&self) -> f64 {
        let sections = self.devices().flat_map(Device::sections);
        sections.map(Section::softest_nmm2).fold(f64::MAX, f64::min)
    }

    /// Outer radius of the outermost instrument at this distance from the tip of the line, mm, with these lengths
    /// inserted.
    pub fn outermost_radius_mm(&self, inserted_mm: &[f64], from_tip_mm: f64) -> f64 {
        let line_mm = line_mm(inserted_mm.iter().copied());
        self.outermost_instrument(inserted_mm, from_tip_mm).map_or(0.0, |index| {
            let own_mm = from_tip_mm - (line_mm - inserted_mm[index]);
            self.instruments[index].device.section_at(own_mm).radius_mm
        })
    }

    /// The outermost instrument there; `None` if none reaches it.
    pub(crate) fn outermost_instrument(&self, inserted_mm: &[f64], from_tip_mm: f64) -> Option<usize> {
        let line_mm = line_mm(inserted_mm.iter().copied());
        inserted_mm.iter().rposition(|inserted| from_tip_mm - (line_mm - inserted) >= 0.0)
    }

    /// Checks that instruments with these lengths inserted can be combined: each in the lumen of the next, with its
    /// tail out of that one's, and its tip ahead or behind as permitted.
    ///
    /// # Errors
    /// The first that cannot be combined with the next inserted one.
    pub(crate) fn check_places(&self, inserted_mm: impl Iterator<Item = f64>) -> Result<()> {
        let mut inner: Option<(&Instrument, f64)> = None;
        // An instrument pulled back to the mouth is out, whatever its rounding.
        for outer in self.instruments.iter().zip(inserted_mm).filter(|(_, mm)| *mm > LENGTH_SLACK_MM) {
            if let Some(inner) = inner.replace(outer) {
                check_pair(inner.0, outer.0)?;
                check_tails(inner, outer)?;
                check_lead(inner, outer)?;
            }
        }
        Ok(())
    }
}

/// Length of the line for these inserted lengths, mm: the largest.
pub fn line_mm(inserted_mm: impl IntoIterator<Item = f64>) -> f64 {
    inserted_mm.into_iter().fold(0.0, f64::max)
}

/// Checks that the tail of an inner instrument stays out of that of the outer one, at its hand.
fn check_tails((inner, inner_mm): (&Instrument, f64), (outer, outer_mm): (&Instrument, f64)) -> Result<()> {
    let tail_mm = outer.device.length_mm() - outer_mm;
    let most_mm = inner.device.length_mm() - tail_mm;
    if inner_mm <= most_mm + LENGTH_SLACK_MM {
        return Ok(());
    }
    let remedy = format!(
        "{tail_mm:.3} mm of {:?} are outside, and the tail of {:?} would be in them: insert at most {:.3} mm, insert {:?} farther, or \
         use a longer instrument",
        outer.name,
        inner.name,
        most_mm.max(0.0),
        outer.name
    );
    Err(Error::parameter(format!("{}.inserted_mm", inner.name), inner_mm, remedy))
}

/// Checks that an outer instrument that must not lead is behind the inner one.
fn check_lead((inner, inner_mm): (&Instrument, f64), (outer, outer_mm): (&Instrument, f64)) -> Result<()> {
    if outer.may_lead || outer_mm <= inner_mm + LENGTH_SLACK_MM {
        return Ok(());
    }
    let remedy = format!(
        "must not lead, and {:?} is {inner_mm:.3} mm in: advance that first, or allow it with may_lead",
        inner.name
    );
    Err(Error::parameter(format!("{}.inserted_mm", outer.name), outer_mm, remedy))
}

/// Checks that one instrument fits into another.
fn check_pair(inner: &Instrument, outer: &Instrument) -> Result<()> {
    let lumen = outer.device.sections().iter().map(|s| s.inner_radius_mm);
    let narrowest = lumen.reduce(|a, b| a.zip(b).map(|(a, b)| a.min(b))).flatten();
    let (name, value) = (format!("{}.radius_mm", inner.name), inner.device.max_radius_mm());
    match narrowest {
        Some(room) if value <= room => Ok(()),
        Some(room) => {
            let remedy = format!(
                "the lumen of {:?} has radius {room} mm: use a thinner instrument, or withdraw one of the two first",
                outer.name
            );
            Err(Error::parameter(name, value, remedy))
        }
        None => {
            let remedy = format!(
                "{:?} has no lumen: give inner_radius_mm in all of its sections, order instruments from the innermost, or withdraw one \
                 of the two first",
                outer.name
            );
            Err(Error::parameter(name, value, remedy))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Section;

    fn instrument(name: &str, radius_mm: f64, inner_radius_mm: Option<f64>) -> Instrument {
        let section = Section { inner_radius_mm, ..Section::straight(100.0, radius_mm, 10.0) };
        Instrument { name: name.to_owned(), device: Device::new(vec![section]).unwrap(), may_lead: true }
    }

    #[test]
    fn what_is_in_together_fits_and_wires_may_be_exchanged() {
        let catheter = instrument("catheter", 0.9, Some(0.5));
        let wires = [instrument("wire", 0.2, None), instrument("stiff wire", 0.5, None)];
        let stack = Stack::new(wires.into_iter().chain([catheter]).collect()).unwrap();
        let reported = |mm: [f64; 3]| stack.check_places(mm.into_iter()).map_err(|e| e.to_string());
        assert!(reported([20.0, 0.0, 20.0]).is_ok() && reported([0.0, 10.0, 20.0]).is_ok());
        assert!(reported([10.0, 10.0, 20.0]).unwrap_err().contains("\"stiff wire\" has no lumen"));
        assert_eq!(stack.find("catheter").unwrap(), 2);
        let error = stack.find("cathter").unwrap_err().to_string();
        assert!(error.contains("did you mean \"catheter\"?"), "{error}");
        let thick = Stack::new(vec![instrument("a", 0.6, None), instrument("b", 0.9, Some(0.5))]).unwrap();
        let error = thick.check_places([1.0, 1.0].into_iter()).unwrap_err().to_string();
        assert!(error.starts_with("a.radius_mm = 0.6: the lumen of \"b\" has radius 0.5 mm"), "{error}");
        assert!(Stack::new(vec![instrument("a", 0.6, None), instrument("a", 0.9, Some(0.5))]).is_err());
    }
    #[test]
    fn tails_stay_outside_and_what_must_not_lead_is_pushed_over_a_wire() {
        let section = Section::straight(150.0, 0.2, 5.0);
        let wire = Device::new(vec![section]).unwrap();
        let wire = Instrument { name: "wire".to_owned(), device: wire, may_lead: true };
        let catheter = Instrument { may_lead: false, ..instrument("catheter", 0.9, Some(0.5)) };
        let stack = Stack::new(vec![wire, catheter]).unwrap();
        let reported = |mm: [f64; 2]| stack.check_places(mm.into_iter()).map_err(|e| e.to_string());
        assert!(
            reported([70.0, 20.0]).is_ok() && reported([20.0, 20.0]).is_ok() && reported([0.0, 20.0]).is_ok()
        );
        let error = reported([70.1, 20.0]).unwrap_err();
        assert!(
            error.starts_with("wire.inserted_mm = 70.1: 80.000 mm of \"catheter\" are outside"),
            "{error}"
        );
        assert!(error.contains("insert at most 70.000 mm"), "{error}");
        let error = reported([20.0, 20.1]).unwrap_err();
        assert!(error.starts_with("catheter.inserted_mm = 20.1: must not lead"), "{error}");
    }
}
