//! The inserted device: a wire or catheter of sections, from the tip backwards.
//!
//! A [`Device`] is the input of methods: sections of constant properties. A [`DeviceFile`] represents a maker's data
//! sheet: named parts in the units of the trade, tapers and arcs, materials and sources, and the sections made of
//! them.

mod file;
#[cfg(test)]
mod file_tests;
mod part;
mod quantity;
mod rest_shape;
mod secondary;
mod soft_plane;
mod stack;
mod steer;
mod winding;

pub(crate) use file::FileTable;
pub use file::{DeviceFile, Kind};
pub(crate) use part::PartTable;
pub use part::{Coat, CutError, Part};
pub use soft_plane::SoftPlane;
pub(crate) use stack::LENGTH_SLACK_MM;
pub use stack::{Instrument, Stack, line_mm};
pub use steer::{MOST_STEER, Steer};

use serde::{Deserialize, Serialize};

use crate::rod::times;
use crate::{Error, Result};

/// A section of a device with constant properties.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Length, mm; at most ten metres, like that of the whole device.
    pub length_mm: f64,
    /// Outer radius, mm; 10⁻⁶ to 50.
    pub radius_mm: f64,
    /// Radius of the lumen, mm; solid if absent. Less than `radius_mm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner_radius_mm: Option<f64>,
    /// Bending stiffness EI, N·mm²; with a soft plane that across it.
    pub bending_stiffness_nmm2: f64,
    /// The plane in which it bends more easily; absent where it bends alike in all planes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub soft_plane: Option<SoftPlane>,
    /// Torsional stiffness GJ, N·mm²; EI/1.3 if absent: a solid round wire of Poisson ratio 0.3. With a soft plane, that of a
    /// solid elliptic one: EI is then 2 EI₁EI₂/(EI₁ + EI₂).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsional_stiffness_nmm2: Option<f64>,
    /// Rest curvature along the first and second material direction, 1/mm: a shaped tip.
    #[serde(default)]
    pub rest_curvature_per_mm: [f64; 2],
    /// How it bends when the device is steered; not at all if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steer: Option<Steer>,
}

impl Section {
    /// A straight section of a solid round wire.
    pub fn straight(length_mm: f64, radius_mm: f64, bending_stiffness_nmm2: f64) -> Self {
        Self {
            length_mm,
            radius_mm,
            inner_radius_mm: None,
            bending_stiffness_nmm2,
            soft_plane: None,
            torsional_stiffness_nmm2: None,
            rest_curvature_per_mm: [0.0; 2],
            steer: None,
        }
    }

    /// GJ, N·mm².
    pub fn torsion_nmm2(&self) -> f64 {
        self.torsional_stiffness_nmm2.unwrap_or_else(|| {
            let across = self.bending_stiffness_nmm2;
            let round = self.soft_plane.map_or(across, |plane| {
                let soft = plane.bending_stiffness_nmm2;
                2.0 * soft * across / (soft + across)
            });
            round / 1.3
        })
    }

    /// Whether it has a rest shape, at some value of the steering.
    fn is_shaped(&self) -> bool {
        self.rest_curvature_per_mm != [0.0; 2] || self.steer.is_some()
    }

    /// Energy per length to straighten it, ½ EI |κ⁰|², in general ½ κ⁰ᵀBκ⁰, mJ/mm = N: also the force with which it comes out of a
    /// straight sheath.
    pub(crate) fn straightening_n(&self) -> f64 {
        let [u, v] = self.rest_curvature_per_mm;
        if self.soft_plane.is_some() {
            let [along_u, along_v] = times(self.stiffness_nmm2(), [u, v]);
            return 0.5 * (along_u * u + along_v * v);
        }
        0.5 * self.bending_stiffness_nmm2 * (u * u + v * v)
    }

    /// Checks every value; errors begin with `name`.
    fn check(&self, name: &str) -> Result<()> {
        for (field, value, limit) in [
            ("length_mm", self.length_mm, LENGTH_LIMIT_MM),
            ("radius_mm", self.radius_mm, RADIUS_LIMIT_MM),
            ("bending_stiffness_nmm2", self.bending_stiffness_nmm2, STIFFNESS_LIMIT_NMM2),
        ] {
            crate::error::in_range(&format!("{name}.{field}"), value, limit)?;
        }
        let across_nmm2 = self.bending_stiffness_nmm2;
        self.soft_plane.iter().try_for_each(|plane| plane.check(name, across_nmm2))?;
        let torsional = format!("{name}.torsional_stiffness_nmm2");
        crate::error::in_range(&torsional, self.torsion_nmm2(), STIFFNESS_LIMIT_NMM2)?;
        if self.radius_mm < LEAST_RADIUS_MM {
            let remedy = format!("must be at least {LEAST_RADIUS_MM} mm: no device is thinner");
            return Err(Error::parameter(format!("{name}.radius_mm"), self.radius_mm, remedy));
        }
        let stiffness = [
            ("bending_stiffness_nmm2", Some(self.bending_stiffness_nmm2)),
            ("torsional_stiffness_nmm2", self.torsional_stiffness_nmm2),
        ];
        for (field, value) in stiffness {
            if let Some(value) = value.filter(|value| *value < LEAST_STIFFNESS_NMM2) {
                let remedy = format!(
                    "must be at least {LEAST_STIFFNESS_NMM2} N·mm²: the softest devices, coils and tips of catheters that the flow carries, have about 0.001"
                );
                return Err(Error::parameter(format!("{name}.{field}"), value, remedy));
            }
        }
        if let Some(inner) = self.inner_radius_mm.filter(|inner| !(*inner > 0.0 && *inner < self.radius_mm)) {
            let remedy = format!(
                "must be above 0 and less than the outer radius, {} mm; leave it out where the device is solid",
                self.radius_mm
            );
            return Err(Error::parameter(format!("{name}.inner_radius_mm"), inner, remedy));
        }
        let curvature = self.rest_curvature_per_mm;
        let bend = libm::hypot(curvature[0], curvature[1]) * self.radius_mm;
        if bend.is_nan() || bend > 1.0 {
            return Err(Error::parameter(
                format!("{name}.rest_curvature_per_mm"),
                format!("{curvature:?}"),
                "must be finite, and its radius no smaller than the device's own",
            ));
        }
        self.steer.iter().try_for_each(|steer| steer.check(name, self.radius_mm, curvature))
    }
}

/// A device: its sections, **tip first**, because the tip is what enters first.
///
/// Points of a device are identified by their arc length from the tip, which does not change as it is pushed.
///
/// ```
/// use endowire_core::{Device, Section};
///
/// // 20 mm that rest in a bow of radius 20 mm, on a straight shaft: length mm, radius mm, bending stiffness N·mm².
/// let tip = Section { rest_curvature_per_mm: [0.05, 0.0], ..Section::straight(20.0, 0.45, 5.0) };
/// let wire = Device::new(vec![tip, Section::straight(280.0, 0.45, 20.0)])?;
/// assert_eq!(wire.section_at(10.0).bending_stiffness_nmm2, 5.0);
/// # Ok::<(), endowire_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Device {
    sections: Vec<Section>,
    length_mm: f64,
    /// Length from the tip that can be detached, mm; 0 if none.
    coil_mm: f64,
    /// The value to which it is steered.
    steered: f64,
}

/// Longest device accepted, mm. Ten metres: three times the longest exchange wire made; more is a unit mistake.
pub(crate) const LENGTH_LIMIT_MM: f64 = 10_000.0;
/// Thickest device accepted, mm. A 30 F sheath has radius 5 mm; more than 50 mm is a unit mistake.
const RADIUS_LIMIT_MM: f64 = 50.0;
/// Thinnest device accepted, mm: a molecule. The spacing of contact points starts at the tip with less than a radius,
/// and their number grows with its logarithm.
const LEAST_RADIUS_MM: f64 = 1e-6;
/// Largest number of sections: each point of a device searches for its own.
const MOST_SECTIONS: usize = 1000;
/// Most flexible section accepted, N·mm²: a fifth of the softest real one. A coil of platinum wire of 0.038 mm, wound
/// to 0.25 mm, has E d⁵/(32 D (1 + ν/2)) = 0.0014 (Wahl, Mechanical Springs, 1963). The shape of softer ones depends
/// on friction alone, and takes up to 18 times as long to find.
const LEAST_STIFFNESS_NMM2: f64 = 2e-4;
/// Stiffest device accepted, N·mm²: a solid steel rod of 12 mm diameter.
const STIFFNESS_LIMIT_NMM2: f64 = 2e8;

impl Device {
    /// A device from its sections, tip first.
    ///
    /// # Errors
    /// Names the first section value that is not finite, not positive, or absurd.
    pub fn new(sections: Vec<Section>) -> Result<Self> {
        if sections.is_empty() {
            return Err(Error::parameter("device.section", "[]", "give at least one section, tip first"));
        }
        if sections.len() > MOST_SECTIONS {
            let value = format!("{} sections", sections.len());
            let remedy = format!("at most {MOST_SECTIONS} are taken: join neighbours that are nearly alike");
            return Err(Error::parameter("device.section", value, remedy));
        }
        for (index, section) in sections.iter().enumerate() {
            section.check(&format!("device.section[{index}]"))?;
        }
        let length_mm = sections.iter().map(|s| s.length_mm).sum();
        crate::error::in_range("device length (sum of section lengths) in mm", length_mm, LENGTH_LIMIT_MM)?;
        Ok(Self { sections, length_mm, coil_mm: 0.0, steered: 0.0 })
    }

    /// The same device as a coil on its pusher, with this length, from the tip on, that can be detached.
    ///
    /// # Errors
    /// A length that is not positive and less than that of the device; a device that is steered or has a soft plane.
    pub fn with_coil(self, coil_mm: f64) -> Result<Self> {
        if self.is_steerable() {
            return Err(Error::parameter("device.coil_mm", coil_mm, "a device that is steered is no coil"));
        }
        if self.has_soft_plane() {
            let remedy = "a device with a soft plane is no coil: leave soft_plane out of its sections";
            return Err(Error::parameter("device.coil_mm", coil_mm, remedy));
        }
        if coil_mm > 0.0 && coil_mm < self.length_mm {
            return Ok(Self { coil_mm, ..self });
        }
        let remedy = format!(
            "must be above 0 and less than the device, {} mm: what is left is the pusher",
            self.length_mm
        );
        Err(Error::parameter("device.coil_mm", coil_mm, remedy))
    }

    /// Whether any of its sections is steered.
    pub fn is_steerable(&self) -> bool {
        self.sections.iter().any(|section| section.steer.is_some())
    }

    /// Whether any of its sections bends more easily in one plane.
    pub fn has_soft_plane(&self) -> bool {
        self.sections.iter().any(|section| section.soft_plane.is_some())
    }

    /// The same device steered to a value from −1 to 1: with the rest curvature that its sections then have.
    pub fn steered(&self, value: f64) -> Self {
        let mut device = self.clone();
        device.steered = value;
        for section in &mut device.sections {
            let Some(steer) = section.steer else { continue };
            let by = steer.curvature_per_mm();
            let rest = &mut section.rest_curvature_per_mm;
            *rest = [0, 1].map(|axis| rest[axis] + (value - self.steered) * by[axis]);
        }
        device
    }

    /// Changes a section, without a check.
    pub(crate) fn change_section(&mut self, section: usize, change: impl FnOnce(&mut Section)) {
        change(&mut self.sections[section]);
    }

    /// The value to which it is steered.
    pub(crate) fn steered_to(&self) -> f64 {
        self.steered
    }

    /// Largest rest curvature of one of its sections, however it is steered, 1/mm.
    pub(crate) fn most_bent_per_mm(&self, section: &Section) -> f64 {
        let by = section.steer.map_or([0.0; 2], |steer| steer.curvature_per_mm());
        steer::most_bent_per_mm(section.rest_curvature_per_mm, self.steered, by)
    }

    /// Length from the tip that can be detached, mm; 0 for devices without a coil.
    pub fn coil_mm(&self) -> f64 {
        self.coil_mm
    }

    /// Whether the coil ends so far from the tip, to rounding.
    pub(crate) fn is_coil_end(&self, from_tip_mm: f64) -> bool {
        self.coil_mm > 0.0 && (from_tip_mm - self.coil_mm).abs() < 1e-9 * self.length_mm
    }

    /// Volume of the coil, the circle of its outer radius along its length, mm³; 0 of devices that are no coils.
    #[cfg(test)]
    pub(crate) fn coil_mm3(&self) -> f64 {
        let mut left_mm = self.coil_mm;
        let each = self.sections.iter().map(|section| {
            let length_mm = left_mm.clamp(0.0, section.length_mm);
            left_mm -= section.length_mm;
            std::f64::consts::PI * section.radius_mm.powi(2) * length_mm
        });
        each.sum()
    }

    /// A uniform device.
    ///
    /// # Errors
    /// As [`Device::new`].
    pub fn uniform(length_mm: f64, radius_mm: f64, bending_stiffness_nmm2: f64) -> Result<Self> {
        Self::new(vec![Section::straight(length_mm, radius_mm, bending_stiffness_nmm2)])
    }

    /// Total length, mm.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// The sections, tip first.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The section at an arc length from the tip; beyond either end, the section at that end.
    pub fn section_at(&self, from_tip_mm: f64) -> &Section {
        let mut end = 0.0;
        for section in &self.sections {
            end += section.length_mm;
            if from_tip_mm < end {
                return section;
            }
        }
        // `new` rejects devices without sections.
        &self.sections[self.sections.len() - 1]
    }

    /// Whether the device has a rest shape or a soft plane, so that rotating its tail moves it.
    pub fn is_shaped(&self) -> bool {
        self.sections.iter().any(Section::is_shaped) || self.has_soft_plane()
    }

    /// Length from the tip within which the device has a rest shape, mm.
    pub fn shaped_mm(&self) -> f64 {
        let mut end_mm = 0.0;
        let mut shaped_mm = 0.0;
        for section in &self.sections {
            end_mm += section.length_mm;
            if section.is_shaped() {
                shaped_mm = end_mm;
            }
        }
        shaped_mm
    }

    /// Energy to straighten this length of the device from its tip on, ∫ ½ EI |κ⁰|² ds, mJ: the energy released by a
    /// sheath when this length is out of it.
    pub(crate) fn straightening_mj(&self, from_tip_mm: f64) -> f64 {
        let mut left_mm = from_tip_mm;
        let each = self.sections.iter().map(|section| {
            let length_mm = left_mm.clamp(0.0, section.length_mm);
            left_mm -= section.length_mm;
            section.straightening_n() * length_mm
        });
        each.sum()
    }

    /// Rotation per torque of the stretch between two distances from the tip, ∫ ds/GJ, rad/(N·mm); negative towards the
    /// tip. Beyond its end the device counts as going on.
    pub(crate) fn compliance_per_nmm(&self, from_mm: f64, to_mm: f64) -> f64 {
        let (first, second) = (from_mm.min(to_mm), from_mm.max(to_mm));
        let (mut begin, mut sum) = (0.0, 0.0);
        for (index, section) in self.sections.iter().enumerate() {
            let is_last = index + 1 == self.sections.len();
            let end = if is_last { f64::INFINITY } else { begin + section.length_mm };
            sum += (second.min(end) - first.max(begin)).max(0.0) / section.torsion_nmm2();
            begin = end;
        }
        if from_mm <= to_mm { sum } else { -sum }
    }

    /// Smallest outer radius, mm.
    pub fn min_radius_mm(&self) -> f64 {
        self.sections.iter().map(|s| s.radius_mm).fold(f64::MAX, f64::min)
    }

    /// Largest outer radius, mm.
    pub fn max_radius_mm(&self) -> f64 {
        self.max_radius_within(f64::INFINITY)
    }

    /// Largest outer radius within this distance of the tip, mm; 0 if the distance is 0.
    pub fn max_radius_within(&self, from_tip_mm: f64) -> f64 {
        let begins = self.sections.iter().scan(0.0, |end_mm, section| {
            let begin_mm = *end_mm;
            *end_mm += section.length_mm;
            Some(begin_mm)
        });
        let within = self.sections.iter().zip(begins).filter(|(_, begin_mm)| *begin_mm < from_tip_mm);
        within.map(|(section, _)| section.radius_mm).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straightening_counts_what_is_bent_and_out() {
        let bent = Section { rest_curvature_per_mm: [0.3, 0.4], ..Section::straight(4.0, 0.5, 8.0) };
        let device = Device::new(vec![bent, Section::straight(10.0, 0.5, 8.0)]).unwrap();
        // ½ · 8 N·mm² · 0.25/mm² on each mm of the first section.
        for (out_mm, expected_mj) in [(0.0, 0.0), (1.5, 1.5), (4.0, 4.0), (9.0, 4.0), (100.0, 4.0)] {
            assert!((device.straightening_mj(out_mm) - expected_mj).abs() < 1e-12);
        }
    }

    #[test]
    fn a_lumen_is_narrower_than_its_device() {
        let tube = |inner_radius_mm| {
            Device::new(vec![Section { inner_radius_mm, ..Section::straight(10.0, 1.0, 1.0) }])
        };
        assert!(tube(None).is_ok() && tube(Some(0.999)).is_ok());
        for bad in [0.0, -0.1, 1.0, 1.5, f64::NAN] {
            let error = tube(Some(bad)).unwrap_err().to_string();
            assert!(error.starts_with("device.section[0].inner_radius_mm = "), "{error}");
            assert!(error.contains("less than the outer radius, 1 mm"), "{error}");
        }
    }

    #[test]
    fn radii_and_sections_beyond_any_device_are_refused_by_key() {
        let straight = |radius_mm| Section::straight(10.0, radius_mm, 1.0);
        let reported = |sections: Vec<Section>| Device::new(sections).unwrap_err().to_string();
        assert!(Device::new(vec![straight(1.0), straight(1e-6)]).is_ok());
        for radius_mm in [1e-7, 1e-300, 1e-323] {
            let error = reported(vec![straight(1.0), straight(radius_mm)]);
            assert!(error.starts_with("device.section[1].radius_mm = 1e-"), "{error}");
            assert!(error.contains("at least 0.000001 mm"), "{error}");
        }
        for stiffness in [1.9e-4, 5e-324] {
            let error = reported(vec![straight(1.0), Section::straight(10.0, 1.0, stiffness)]);
            assert!(error.starts_with("device.section[1].bending_stiffness_nmm2 = "), "{error}");
            let limp = Section { torsional_stiffness_nmm2: Some(stiffness), ..straight(1.0) };
            let error = reported(vec![limp]);
            assert!(error.starts_with("device.section[0].torsional_stiffness_nmm2 = "), "{error}");
        }
        assert!(Device::uniform(10.0, 1.0, 2e-4).is_ok());
        let error = reported(vec![Section::straight(1.0, 1.0, 1.0); 1001]);
        assert!(error.starts_with("device.section = 1001 sections: at most 1000"), "{error}");
    }
}
