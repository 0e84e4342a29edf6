//! The stiffness of a part wound from a stock wire, such as a coil.
//!
//! A helix of small pitch, regarded as a rod along its axis: bending it twists and bends the wire, twisting it only
//! bends the wire. With the wire's E, ν and diameter w, its second moment I = πw⁴/64, the mean diameter D of the
//! winding and its pitch p
//!
//! ```text
//! EI = 2 p E I / (π D (2 + ν)),     GJ = p E I / (π D)
//! ```
//!
//! (A. M. Wahl, *Mechanical Springs*, 2nd ed., 1963, chapters 16 and 17; turns in contact exert no force on each
//! other.)

use serde::Deserialize;

use super::part::{INCH_MM, MODULUS_LIMIT_MPA};
use super::quantity::{Ends, Way, one_of, second_moment_mm4};
use super::{LEAST_STIFFNESS_NMM2, RADIUS_LIMIT_MM, STIFFNESS_LIMIT_NMM2};
use crate::{Error, Result};

/// A `winding` table of the file.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Winding {
    wire_diameter_mm: Option<f64>,
    wire_diameter_inch: Option<f64>,
    /// Modulus of the wire's metal, GPa.
    modulus_gpa: f64,
    /// Poisson ratio of the metal.
    poisson_ratio: f64,
    /// Advance per turn, mm; if absent the wire's diameter: close-wound.
    pitch_mm: Option<f64>,
}

/// Properties of a wound part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wound {
    /// EI, N·mm².
    pub(super) bending_nmm2: Ends,
    /// GJ, N·mm².
    pub(super) torsion_nmm2: Ends,
}

impl Winding {
    /// The properties of a wound part of this outer radius, mm.
    ///
    /// # Errors
    /// Values that are missing, out of range, given twice, or contradictory, by key.
    pub(super) fn resolve(&self, place: &str, outer_mm: Ends) -> Result<Wound> {
        let place = format!("{place}.winding");
        let given = |value: Option<f64>| value.map(Ends::constant);
        let ways = [
            Way { key: "wire_diameter_mm", given: given(self.wire_diameter_mm), factor: 1.0 },
            Way { key: "wire_diameter_inch", given: given(self.wire_diameter_inch), factor: INCH_MM },
        ];
        let thinnest_mm = outer_mm.0[0].min(outer_mm.0[1]);
        let Some(wire) = one_of(&place, ways, 2.0 * RADIUS_LIMIT_MM)? else {
            let name = format!("{place}.wire_diameter_mm");
            return Err(Error::parameter(name, "absent", "give wire_diameter_mm or wire_diameter_inch"));
        };
        let wire_mm = wire.ends.at(0.0);
        if wire_mm >= thinnest_mm {
            let remedy = format!("must be less than the outer radius of the winding, {thinnest_mm:.4} mm");
            return Err(Error::parameter(format!("{place}.{}", wire.key), wire.given, remedy));
        }
        crate::error::in_range(&format!("{place}.modulus_gpa"), self.modulus_gpa, MODULUS_LIMIT_MPA / 1e3)?;
        if !(0.0..=0.5).contains(&self.poisson_ratio) {
            let remedy = "must be a number from 0 to 0.5";
            return Err(Error::parameter(format!("{place}.poisson_ratio"), self.poisson_ratio, remedy));
        }
        let pitch_mm = self.pitch_mm.unwrap_or(wire_mm);
        if !(pitch_mm.is_finite() && pitch_mm >= wire_mm) {
            let remedy =
                format!("must be at least the wire's diameter, {wire_mm:.4} mm: turns lie beside each other");
            return Err(Error::parameter(format!("{place}.pitch_mm"), pitch_mm, remedy));
        }
        let stiffness_nmm2 = 1e3 * self.modulus_gpa * second_moment_mm4(0.5 * wire_mm, 0.0);
        let torsion =
            |radius_mm: f64| pitch_mm * stiffness_nmm2 / (std::f64::consts::PI * (2.0 * radius_mm - wire_mm));
        let torsion_nmm2 = Ends(outer_mm.0.map(torsion));
        let bending_nmm2 = Ends(torsion_nmm2.0.map(|gj| 2.0 * gj / (2.0 + self.poisson_ratio)));
        let range = LEAST_STIFFNESS_NMM2..=STIFFNESS_LIMIT_NMM2;
        if let Some(found) = bending_nmm2.0.iter().find(|found| !range.contains(found)) {
            let remedy = format!(
                "gives a bending stiffness of {found:.1e} N·mm², and must give one of {LEAST_STIFFNESS_NMM2} to {STIFFNESS_LIMIT_NMM2}: take another wire, modulus or pitch"
            );
            return Err(Error::parameter(format!("{place}.{}", wire.key), wire.given, remedy));
        }
        Ok(Wound { bending_nmm2, torsion_nmm2 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn platinum(wire_inch: f64) -> Winding {
        Winding {
            wire_diameter_mm: None,
            wire_diameter_inch: Some(wire_inch),
            modulus_gpa: 170.0,
            poisson_ratio: 0.38,
            pitch_mm: None,
        }
    }

    fn bending_nmm2(wire_inch: f64, outer_inch: f64) -> f64 {
        let outer = Ends::constant(0.5 * outer_inch * INCH_MM);
        platinum(wire_inch).resolve("part", outer).unwrap().bending_nmm2.at(0.5)
    }

    #[test]
    fn windings_of_embolisation_coils_have_the_stiffness_of_the_formula() {
        // Computed by hand from the formula, five digits: wires of 0.00125, 0.00175 and 0.002 inch wound to 0.010,
        // 0.003 to 0.015.
        for (wire, outer, expected) in [
            (0.00125, 0.010, 3.2404e-4),
            (0.00175, 0.010, 1.8484e-3),
            (0.002, 0.010, 3.7164e-3),
            (0.003, 0.015, 1.8814e-2),
        ] {
            let found = bending_nmm2(wire, outer);
            assert!((found / expected - 1.0).abs() < 1e-4, "{wire}: {found}");
        }
        // A thicker wire in the same winding is stiffer by at least the fifth power.
        assert!(bending_nmm2(0.0025, 0.010) / bending_nmm2(0.00125, 0.010) > 32.0);
    }

    #[test]
    fn an_open_winding_is_stiffer_and_twisting_bends_the_wire_alone() {
        let outer = Ends::constant(0.127);
        let close = platinum(0.00125).resolve("part", outer).unwrap();
        let open = Winding { pitch_mm: Some(2.0 * 0.00125 * INCH_MM), ..platinum(0.00125) };
        let open = open.resolve("part", outer).unwrap();
        assert!((open.bending_nmm2.at(0.0) / close.bending_nmm2.at(0.0) - 2.0).abs() < 1e-12);
        assert!((close.torsion_nmm2.at(0.0) / close.bending_nmm2.at(0.0) - 1.19).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_wound_is_refused_by_key() {
        let outer = Ends::constant(0.127);
        let refused = |winding: Winding| winding.resolve("part \"a\"", outer).unwrap_err().to_string();
        assert!(refused(platinum(0.006)).contains("wire_diameter_inch = 0.006"));
        assert!(refused(Winding { wire_diameter_mm: Some(0.03), ..platinum(0.001) }).contains("given too"));
        assert!(refused(Winding { wire_diameter_inch: None, ..platinum(0.0) }).contains("absent"));
        assert!(refused(Winding { poisson_ratio: 0.6, ..platinum(0.001) }).contains("poisson_ratio = 0.6"));
        assert!(refused(Winding { modulus_gpa: f64::NAN, ..platinum(0.001) }).contains("modulus_gpa"));
        assert!(refused(Winding { pitch_mm: Some(0.01), ..platinum(0.001) }).contains("pitch_mm = 0.01"));
        // A limit that can be read, and the key that makes it too soft.
        let endless = refused(Winding { wire_diameter_inch: Some(f64::INFINITY), ..platinum(0.001) });
        assert!(endless.contains("wire_diameter_inch = inf") && endless.len() < 120, "{endless}");
        let soft = refused(platinum(1e-4));
        assert!(soft.contains("winding.wire_diameter_inch = 0.0001: gives a bending stiffness of"), "{soft}");
    }
}
