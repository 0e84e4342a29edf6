//! Linear attenuation coefficients.
//!
//! The table holds values of xraylib 4.3 (Schoonjans et al., Spectrochimica Acta B 66, 2011, 776–784) at 40,
//! 50, 60 and 80 keV. Photoelectric and Compton attenuation are close to power laws of the energy, so between
//! the entries ln μ is interpolated linearly in ln E. That holds between K-edges only: platinum (78.4 keV)
//! and tungsten (69.5 keV) jump between the last two entries, where no value is given rather than a wrong
//! one.

use std::fmt;
use std::str::FromStr;

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

/// Energies of the table in keV.
const ENERGIES_KEV: [f64; 4] = [40.0, 50.0, 60.0, 80.0];

/// What is in the way of the rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(try_from = "String", into = "&'static str")]
#[non_exhaustive]
pub enum Material {
    /// ICRU soft tissue.
    SoftTissue,
    /// Whole blood.
    Blood,
    /// Cortical bone.
    CorticalBone,
    /// Undiluted iodine contrast medium, 370 mg iodine per ml.
    Contrast370,
    /// Nickel-titanium.
    Nitinol,
    /// Stainless steel 316L.
    Steel316L,
    /// Platinum.
    Platinum,
    /// Tungsten.
    Tungsten,
    /// Polyurethane with 60 % by weight of tungsten.
    PolyurethaneTungsten60,
    /// Pebax with 40 % by weight of barium sulphate.
    PebaxBariumSulphate40,
}

/// Name in scene files, μ in 1/cm at [`ENERGIES_KEV`], K-edge in keV if it lies inside the table.
type Row = (Material, &'static str, [f64; 4], Option<f64>);

const TABLE: [Row; 10] = [
    (Material::SoftTissue, "soft_tissue", [0.262, 0.223, 0.203, 0.182], None),
    (Material::Blood, "blood", [0.286, 0.240, 0.217, 0.193], None),
    (Material::CorticalBone, "cortical_bone", [1.19, 0.767, 0.574, 0.411], None),
    (Material::Contrast370, "contrast_370", [8.44, 4.79, 3.01, 1.48], None),
    (Material::Nitinol, "nitinol", [22.9, 12.4, 7.62, 3.79], None),
    (Material::Steel316L, "steel_316l", [30.3, 16.4, 10.1, 4.95], None),
    (Material::Platinum, "platinum", [267.0, 149.0, 93.0, 187.0], Some(78.4)),
    (Material::Tungsten, "tungsten", [206.0, 115.0, 72.0, 151.0], Some(69.5)),
    (Material::PolyurethaneTungsten60, "polyurethane_tungsten_60", [16.7, 9.4, 5.9, 12.2], Some(69.5)),
    (Material::PebaxBariumSulphate40, "pebax_baso4_40", [8.8, 5.0, 3.2, 1.6], None),
];

impl Material {
    /// All materials, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.0)
    }

    fn row(self) -> &'static Row {
        // Declaration order and table order agree; a test pins it.
        &TABLE[self as usize]
    }

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// Linear attenuation coefficient in 1/mm at `energy_kev`.
    ///
    /// # Errors
    /// [`Error::Parameter`] outside 40 to 80 keV, and between 60 and 80 keV for a material whose K-edge lies
    /// there.
    pub fn attenuation_per_mm(self, energy_kev: f64) -> Result<f64> {
        const KEY: &str = "view.xray.energy_kev";
        let (_, name, mu, k_edge) = self.row();
        let [first, .., last] = ENERGIES_KEV;
        if !(first..=last).contains(&energy_kev) {
            return Err(Error::parameter(KEY, energy_kev, format!("the table covers {first} to {last} keV")));
        }
        let i = ENERGIES_KEV.iter().rposition(|&e| e <= energy_kev).unwrap_or(0).min(ENERGIES_KEV.len() - 2);
        let (e0, e1) = (ENERGIES_KEV[i], ENERGIES_KEV[i + 1]);
        if let Some(edge) = k_edge
            && (e0..e1).contains(edge)
            && energy_kev > e0
            && energy_kev < e1
        {
            let mend = format!("{name} has its K-edge at {edge} keV; use {first} to {e0} keV, or {e1}");
            return Err(Error::parameter(KEY, energy_kev, mend));
        }
        let w = (energy_kev / e0).ln() / (e1 / e0).ln();
        let per_cm = (mu[i].ln() * (1.0 - w) + mu[i + 1].ln() * w).exp();
        Ok(per_cm / 10.0)
    }
}

impl fmt::Display for Material {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Material {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if let Some(row) = TABLE.iter().find(|row| row.1 == text) {
            return Ok(row.0);
        }
        let mut names = TABLE.map(|row| row.1);
        names.sort_by(|a, b| strsim::jaro_winkler(b, text).total_cmp(&strsim::jaro_winkler(a, text)));
        let mend = format!("no such material; did you mean {} or {}? (known: {})", names[0], names[1], {
            TABLE.map(|row| row.1).join(", ")
        });
        Err(Error::parameter("material", format!("\"{text}\""), mend))
    }
}

impl TryFrom<String> for Material {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<Material> for &'static str {
    fn from(material: Material) -> Self {
        material.name()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_order_is_declaration_order() {
        for (i, material) in Material::all().enumerate() {
            assert_eq!(material as usize, i);
            assert_eq!(material.name().parse::<Material>().unwrap(), material);
        }
    }

    #[test]
    fn entries_are_met_and_power_laws_are_exact_between_them() {
        let mu = |e| Material::Steel316L.attenuation_per_mm(e).unwrap();
        for (e, per_cm) in [(40.0, 30.3), (50.0, 16.4), (60.0, 10.1), (80.0, 4.95)] {
            assert!((mu(e) * 10.0 - per_cm).abs() < 1e-12, "{e}");
        }
        // The geometric mean energy has the geometric mean coefficient.
        assert!((mu((40.0 * 50.0_f64).sqrt()) - (3.03 * 1.64_f64).sqrt()).abs() < 1e-12);
        assert!(mu(55.0) < mu(50.0) && mu(55.0) > mu(60.0));
    }

    #[test]
    fn no_value_across_a_k_edge_or_outside_the_table() {
        assert!(Material::Tungsten.attenuation_per_mm(60.0).is_ok());
        assert!(Material::Tungsten.attenuation_per_mm(80.0).is_ok());
        let error = Material::Tungsten.attenuation_per_mm(70.0).unwrap_err().to_string();
        assert!(error.contains("69.5"), "{error}");
        for bad in [39.9, 80.1, f64::NAN, -1.0] {
            assert!(Material::Blood.attenuation_per_mm(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn an_unknown_name_gets_the_nearest_known() {
        let error = "nitinoll".parse::<Material>().unwrap_err().to_string();
        assert!(error.contains("did you mean nitinol"), "{error}");
    }
}
