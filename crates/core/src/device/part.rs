//! One part of a device file: its data, and the sections made of it.

use serde::Deserialize;

use super::quantity::{Ends, Quantity, Way, one_of, second_moment_mm4};
use super::secondary::{Arc, Secondary};
use super::winding::Winding;
use super::{LENGTH_LIMIT_MM, RADIUS_LIMIT_MM, STIFFNESS_LIMIT_NMM2, Section, SoftPlane};
use crate::{Error, Result};

/// Millimetres in an inch.
pub(super) const INCH_MM: f64 = 25.4;
/// Millimetres in a French (Charrière), as a diameter.
const FRENCH_MM: f64 = 1.0 / 3.0;
/// Stiffest material, MPa: diamond.
pub(super) const MODULUS_LIMIT_MPA: f64 = 1.2e6;
/// Largest number of sections that represent a taper.
const MOST_CUTS: usize = 200;
/// Largest arc of a tip, degrees: three turns.
const MOST_ANGLE_DEG: f64 = 1080.0;

/// A `[[part]]` table of the file. Values that may be tapered are one number or two.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PartTable {
    pub(super) name: String,
    length_mm: Option<f64>,
    length_cm: Option<f64>,
    bend: Option<Bend>,
    rest_curvature_per_mm: Option<[f64; 2]>,
    radius_mm: Option<Ends>,
    outer_diameter_mm: Option<Ends>,
    outer_diameter_inch: Option<Ends>,
    outer_diameter_french: Option<Ends>,
    inner_radius_mm: Option<Ends>,
    inner_diameter_mm: Option<Ends>,
    inner_diameter_inch: Option<Ends>,
    inner_diameter_french: Option<Ends>,
    bending_stiffness_nmm2: Option<Ends>,
    flexural_modulus_mpa: Option<Ends>,
    flexural_modulus_gpa: Option<Ends>,
    torsional_stiffness_nmm2: Option<Ends>,
    winding: Option<Winding>,
    secondary: Option<Secondary>,
    sections: Option<usize>,
    material: Option<String>,
    coat: Option<Coat>,
    source: Option<String>,
}

/// An arc of a part's rest shape.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Bend {
    /// Radius of the centre line.
    radius_mm: f64,
    /// Angle between the tangents of the two ends.
    angle_deg: f64,
    /// Direction of bending, about the device's axis; 0 is the first material direction, 180 the opposite bend in the
    /// same plane.
    #[serde(default)]
    direction_deg: f64,
}

/// The outermost layer of a part, of another material: a coil, a jacket, a marker band.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coat {
    /// Its material.
    pub material: String,
    /// Thickness, inwards from the outer radius, mm.
    pub thickness_mm: f64,
}

/// How EI is given.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stiffness {
    /// N·mm².
    Bending(Ends),
    /// Flexural modulus of the whole cross-section, MPa = N/mm².
    Modulus(Ends),
}

/// Largest differences between a taper and its sections. They occur at the ends of sections if EI is monotonic along
/// each, that is, unless modulus and size are tapered against each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutError {
    /// Of the outer radius, mm.
    pub radius_mm: f64,
    /// Of EI, relative to the taper's.
    pub stiffness: f64,
}

/// A named part of a device: constant or linearly tapered between its ends, with one rest curvature or a sequence of
/// arcs.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Its start and end, in arc length from the tip, mm.
    pub from_tip_mm: [f64; 2],
    /// Its material, by a name that the viewer defines.
    pub material: Option<String>,
    /// Its outermost layer, if of another material.
    pub coat: Option<Coat>,
    /// Source of its data.
    pub source: Option<String>,
    radius_mm: Ends,
    inner_radius_mm: Option<Ends>,
    stiffness: Stiffness,
    torsion_nmm2: Option<Ends>,
    /// The plane in which a section bends more easily; what a data sheet describes has none.
    soft_plane: Option<SoftPlane>,
    /// Its arcs of the rest shape, tip first; a part with several is not tapered.
    arcs: Vec<Arc>,
    cuts: usize,
}

impl Part {
    /// A section of a device file without parts.
    pub(super) fn of_section(name: String, section: &Section, begin_mm: f64) -> Self {
        Self {
            name,
            from_tip_mm: [begin_mm, begin_mm + section.length_mm],
            material: None,
            coat: None,
            source: None,
            radius_mm: Ends::constant(section.radius_mm),
            inner_radius_mm: section.inner_radius_mm.map(Ends::constant),
            stiffness: Stiffness::Bending(Ends::constant(section.bending_stiffness_nmm2)),
            torsion_nmm2: section.torsional_stiffness_nmm2.map(Ends::constant),
            soft_plane: section.soft_plane,
            arcs: vec![Arc { length_mm: section.length_mm, curvature_per_mm: section.rest_curvature_per_mm }],
            cuts: 1,
        }
    }

    /// Whether its rest shape is more than one arc.
    pub fn has_secondary_shape(&self) -> bool {
        self.arcs.len() > 1
    }

    /// Its properties at a fraction (0 to 1) of its length from the end towards the tip, as a section of its whole
    /// length.
    pub fn at(&self, fraction: f64) -> Section {
        let radius_mm = self.radius_mm.at(fraction);
        let inner_radius_mm = self.inner_radius_mm.map(|inner| inner.at(fraction));
        Section {
            length_mm: self.from_tip_mm[1] - self.from_tip_mm[0],
            radius_mm,
            inner_radius_mm,
            bending_stiffness_nmm2: match self.stiffness {
                Stiffness::Bending(ei) => ei.at(fraction),
                Stiffness::Modulus(e) => {
                    e.at(fraction) * second_moment_mm4(radius_mm, inner_radius_mm.unwrap_or(0.0))
                }
            },
            torsional_stiffness_nmm2: self.torsion_nmm2.map(|gj| gj.at(fraction)),
            rest_curvature_per_mm: self.arc(fraction).curvature_per_mm,
            steer: None,
            soft_plane: self.soft_plane,
        }
    }

    /// The arc at a fraction of its length.
    fn arc(&self, fraction: f64) -> Arc {
        let mut left_mm = fraction * (self.from_tip_mm[1] - self.from_tip_mm[0]);
        let here = self.arcs.iter().find(|arc| {
            left_mm -= arc.length_mm;
            left_mm < 0.0
        });
        *here.unwrap_or(&self.arcs[self.arcs.len() - 1])
    }

    /// The sections that represent it, tip first: one per arc, and for a taper equal lengths, each with the
    /// properties of its middle.
    pub fn sections(&self) -> Vec<Section> {
        if self.has_secondary_shape() {
            let whole = self.at(0.0);
            let section = |Arc { length_mm, curvature_per_mm }: &Arc| Section {
                length_mm: *length_mm,
                rest_curvature_per_mm: *curvature_per_mm,
                ..whole
            };
            return self.arcs.iter().map(section).collect();
        }
        let count = self.cuts as f64;
        let cut = |k: usize| {
            let middle = self.at((k as f64 + 0.5) / count);
            Section { length_mm: middle.length_mm / count, ..middle }
        };
        (0..self.cuts).map(cut).collect()
    }

    /// The largest differences between the sections and the taper they represent.
    pub fn cut_error(&self) -> CutError {
        let count = self.cuts as f64;
        let mut error = CutError { radius_mm: 0.0, stiffness: 0.0 };
        if self.has_secondary_shape() {
            return error;
        }
        for (k, section) in self.sections().iter().enumerate() {
            for end in [k, k + 1] {
                let taper = self.at(end as f64 / count);
                let relative = section.bending_stiffness_nmm2 / taper.bending_stiffness_nmm2 - 1.0;
                error.radius_mm = error.radius_mm.max((section.radius_mm - taper.radius_mm).abs());
                error.stiffness = error.stiffness.max(relative.abs());
            }
        }
        error
    }
}

impl PartTable {
    /// Its name in errors.
    fn place(&self) -> String {
        format!("part \"{}\"", self.name)
    }

    /// Whether it is wound from a wire.
    pub(super) fn is_wound(&self) -> bool {
        self.winding.is_some()
    }

    /// Its length, mm, if given.
    ///
    /// # Errors
    /// A length given twice or out of range, an arc without a length.
    pub(super) fn length_mm(&self) -> Result<Option<f64>> {
        let place = self.place();
        let length = one_of(&place, length_ways(self.length_mm, self.length_cm), LENGTH_LIMIT_MM)?;
        if let Some(own_mm) = self.secondary.as_ref().and_then(Secondary::length_mm) {
            let Some(length) = length else { return Ok(Some(own_mm)) };
            let remedy = format!("secondary.points_mm is a curve of {own_mm} mm: keep one of the two");
            return Err(Error::parameter(format!("{place}.{}", length.key), length.given, remedy));
        }
        let Some(bend) = self.bend else { return Ok(length.map(|length| length.ends.at(0.0))) };
        if let Some(length) = length {
            let remedy = "bend has the length radius_mm · angle: keep one of the two";
            return Err(Error::parameter(format!("{place}.{}", length.key), length.given, remedy));
        }
        let named = |key: &str| format!("{place}.bend.{key}");
        crate::error::in_range(&named("radius_mm"), bend.radius_mm, LENGTH_LIMIT_MM)?;
        crate::error::in_range(&named("angle_deg"), bend.angle_deg, MOST_ANGLE_DEG)?;
        if !(-360.0..=360.0).contains(&bend.direction_deg) {
            let remedy = "must be a number from -360 to 360";
            return Err(Error::parameter(named("direction_deg"), bend.direction_deg, remedy));
        }
        Ok(Some(bend.radius_mm * bend.angle_deg.to_radians()))
    }

    /// The part that begins at an arc length from the tip. `is_tube`: whether it must have a lumen. `source` is used
    /// if it has none.
    ///
    /// # Errors
    /// Values that are missing, out of range, given twice, or contradictory, by key.
    pub(super) fn resolve(
        &self,
        begin_mm: f64,
        length_mm: f64,
        is_tube: bool,
        source: Option<&str>,
    ) -> Result<Part> {
        let place = self.place();
        let missing =
            |key: &str, remedy: &str| Err(Error::parameter(format!("{place}.{key}"), "absent", remedy));
        let Some(outer) = self.outer(&place)? else {
            let remedy = "give outer_diameter_mm, outer_diameter_inch, outer_diameter_french or radius_mm";
            return missing("outer_diameter_mm", remedy);
        };
        let inner = self.inner(&place)?;
        if is_tube && inner.is_none() {
            let remedy = "the device is a tube by its kind: give inner_diameter_mm, inner_diameter_inch, \
                        inner_diameter_french or inner_radius_mm";
            return missing("inner_diameter_mm", remedy);
        }
        self.check_layers(&place, outer, inner)?;
        let wound = self.winding.map(|winding| winding.resolve(&place, outer.ends)).transpose()?;
        let given = self.stiffness(&place)?;
        let wound_stiffness = wound.map(|wound| (Stiffness::Bending(wound.bending_nmm2), wound.bending_nmm2));
        if wound.is_some() && (given.is_some() || self.torsional_stiffness_nmm2.is_some()) {
            let remedy = "the stiffness is given too, in numbers: keep one of the two";
            return Err(Error::parameter(format!("{place}.winding"), "a table", remedy));
        }
        let Some((stiffness, stiffness_ends)) = given.or(wound_stiffness) else {
            let remedy = "give bending_stiffness_nmm2, flexural_modulus_mpa, flexural_modulus_gpa or winding";
            return missing("bending_stiffness_nmm2", remedy);
        };
        let torsion_way =
            Way { key: "torsional_stiffness_nmm2", given: self.torsional_stiffness_nmm2, factor: 1.0 };
        let torsion = one_of(&place, [torsion_way], STIFFNESS_LIMIT_NMM2)?.map(|q| q.ends);
        let torsion = torsion.or(wound.map(|wound| wound.torsion_nmm2));
        let inner = inner.map(|inner| inner.ends);
        let tapered = [Some(outer.ends), inner, Some(stiffness_ends), torsion];
        let part = Part {
            name: self.name.clone(),
            from_tip_mm: [begin_mm, begin_mm + length_mm],
            material: self.material.clone(),
            coat: self.coat.clone(),
            source: self.source.clone().or_else(|| source.map(str::to_owned)),
            radius_mm: outer.ends,
            inner_radius_mm: inner,
            stiffness,
            torsion_nmm2: torsion,
            soft_plane: None,
            arcs: self.arcs(&place, length_mm, outer.ends)?,
            cuts: self.cuts(&place, tapered.into_iter().flatten().any(Ends::is_taper))?,
        };
        if part.has_secondary_shape() && part.cuts > 1 {
            let remedy = "the part is tapered: a part with a secondary shape is the same everywhere";
            return Err(Error::parameter(format!("{place}.secondary"), "a table", remedy));
        }
        // EI and GJ follow from other values, so their ranges can be checked only now.
        [0.0, 1.0].iter().try_for_each(|end| part.at(*end).check(&place))?;
        Ok(part)
    }

    fn outer(&self, place: &str) -> Result<Option<Quantity>> {
        let ways = [
            Way { key: "radius_mm", given: self.radius_mm, factor: 1.0 },
            Way { key: "outer_diameter_mm", given: self.outer_diameter_mm, factor: 0.5 },
            Way { key: "outer_diameter_inch", given: self.outer_diameter_inch, factor: 0.5 * INCH_MM },
            Way { key: "outer_diameter_french", given: self.outer_diameter_french, factor: 0.5 * FRENCH_MM },
        ];
        one_of(place, ways, RADIUS_LIMIT_MM)
    }

    fn inner(&self, place: &str) -> Result<Option<Quantity>> {
        let ways = [
            Way { key: "inner_radius_mm", given: self.inner_radius_mm, factor: 1.0 },
            Way { key: "inner_diameter_mm", given: self.inner_diameter_mm, factor: 0.5 },
            Way { key: "inner_diameter_inch", given: self.inner_diameter_inch, factor: 0.5 * INCH_MM },
            Way { key: "inner_diameter_french", given: self.inner_diameter_french, factor: 0.5 * FRENCH_MM },
        ];
        one_of(place, ways, RADIUS_LIMIT_MM)
    }

    /// The given form of EI, and its values.
    fn stiffness(&self, place: &str) -> Result<Option<(Stiffness, Ends)>> {
        let modulus = [
            Way { key: "flexural_modulus_mpa", given: self.flexural_modulus_mpa, factor: 1.0 },
            Way { key: "flexural_modulus_gpa", given: self.flexural_modulus_gpa, factor: 1000.0 },
        ];
        let bending = Way { key: "bending_stiffness_nmm2", given: self.bending_stiffness_nmm2, factor: 1.0 };
        let modulus = one_of(place, modulus, MODULUS_LIMIT_MPA)?;
        let bending = one_of(place, [bending], STIFFNESS_LIMIT_NMM2)?;
        match (bending, modulus) {
            (Some(bending), Some(modulus)) => {
                let remedy = format!("{} is given too: keep one of the two", bending.key);
                Err(Error::parameter(format!("{place}.{}", modulus.key), modulus.given, remedy))
            }
            (Some(bending), None) => Ok(Some((Stiffness::Bending(bending.ends), bending.ends))),
            (None, modulus) => Ok(modulus.map(|modulus| (Stiffness::Modulus(modulus.ends), modulus.ends))),
        }
    }

    /// Checks that the lumen is narrower than the part, and the coat thinner than the wall, at both ends and so
    /// everywhere between.
    fn check_layers(&self, place: &str, outer: Quantity, inner: Option<Quantity>) -> Result<()> {
        for end in [0, 1] {
            let radius_mm = outer.ends.0[end];
            let inner_mm = inner.map_or(0.0, |inner| inner.ends.0[end]);
            if let Some(inner) = inner.filter(|_| inner_mm >= radius_mm) {
                let remedy = format!(
                    "is a radius of {inner_mm:.4} mm: must be less than the outer one, {radius_mm:.4} mm"
                );
                return Err(Error::parameter(format!("{place}.{}", inner.key), inner.given, remedy));
            }
            if let Some(coat) = &self.coat
                && !(coat.thickness_mm > 0.0 && coat.thickness_mm < radius_mm - inner_mm)
            {
                let remedy =
                    format!("must be above 0 and less than the wall, {:.4} mm", radius_mm - inner_mm);
                let name = format!("{place}.coat.thickness_mm");
                return Err(Error::parameter(name, coat.thickness_mm, remedy));
            }
        }
        Ok(())
    }

    /// Its arcs of the rest shape: at most one key gives them; without, it is straight.
    fn arcs(&self, place: &str, length_mm: f64, radius_mm: Ends) -> Result<Vec<Arc>> {
        let widest_mm = radius_mm.0[0].max(radius_mm.0[1]);
        let keys = [
            ("bend", self.bend.is_some()),
            ("rest_curvature_per_mm", self.rest_curvature_per_mm.is_some()),
            ("secondary", self.secondary.is_some()),
        ];
        let mut given = keys.into_iter().filter_map(|(key, is_given)| is_given.then_some(key));
        if let (Some(first), Some(second)) = (given.next(), given.next()) {
            let value = self.rest_curvature_per_mm.filter(|_| second == "rest_curvature_per_mm");
            let value = value.map_or_else(|| "a table".to_owned(), |curvature| format!("{curvature:?}"));
            let remedy = format!("{first} is given too: keep one of the two");
            return Err(Error::parameter(format!("{place}.{second}"), value, remedy));
        }
        if let Some(secondary) = &self.secondary {
            return secondary.arcs(place, length_mm, widest_mm);
        }
        let curvature_per_mm = match self.bend {
            Some(bend) if bend.radius_mm < widest_mm => {
                let remedy = format!("must be at least the part's own radius, {widest_mm:.4} mm");
                return Err(Error::parameter(format!("{place}.bend.radius_mm"), bend.radius_mm, remedy));
            }
            Some(bend) => {
                let (sin, cos) = libm::sincos(bend.direction_deg.to_radians());
                [cos / bend.radius_mm, sin / bend.radius_mm]
            }
            None => self.rest_curvature_per_mm.unwrap_or_default(),
        };
        Ok(vec![Arc { length_mm, curvature_per_mm }])
    }

    /// Number of sections.
    fn cuts(&self, place: &str, tapered: bool) -> Result<usize> {
        let refused =
            |value: String, remedy: String| Err(Error::parameter(format!("{place}.sections"), value, remedy));
        match (self.sections, tapered) {
            (None, false) => Ok(1),
            (None, true) => refused(
                "absent".into(),
                format!("the part is tapered: say how many sections it is cut into, 1 to {MOST_CUTS}"),
            ),
            (Some(count), true) if (1..=MOST_CUTS).contains(&count) => Ok(count),
            (Some(count), true) => refused(count.to_string(), format!("must be 1 to {MOST_CUTS}")),
            (Some(count), false) => refused(
                count.to_string(),
                "nothing in the part is tapered: leave it out, or give two values, [towards the tip, at the other end]".into(),
            ),
        }
    }
}

/// The keys that can give a length.
pub(super) fn length_ways(length_mm: Option<f64>, length_cm: Option<f64>) -> [Way; 2] {
    [
        Way { key: "length_mm", given: length_mm.map(Ends::constant), factor: 1.0 },
        Way { key: "length_cm", given: length_cm.map(Ends::constant), factor: 10.0 },
    ]
}
