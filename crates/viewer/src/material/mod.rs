//! Linear attenuation coefficients of materials in the beam.
//!
//! Values of xraylib 4.3 (see [`table`]) from 15 to 125 keV, including K-edges.

pub(crate) mod table;

use std::fmt;
use std::str::FromStr;

use endowire_core::{Error, Result};
use serde::{Deserialize, Serialize};

use table::ATTENUATION;

/// Materials in the beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize, Serialize)]
#[serde(try_from = "String", into = "&'static str")]
#[non_exhaustive]
pub enum Material {
    /// Soft tissue (ICRP), 1.0 g/cm³.
    SoftTissue,
    /// Whole blood.
    Blood,
    /// Cortical bone.
    CorticalBone,
    /// Inflated lung, 0.26 g/cm³.
    Lung,
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
    /// Aluminium, of filters.
    Aluminium,
    /// Copper, of filters.
    Copper,
    /// Caesium iodide, of detectors.
    CaesiumIodide,
}

/// Names in scene files, which are also those of the table.
const NAMES: [(Material, &str); 14] = [
    (Material::SoftTissue, "soft_tissue"),
    (Material::Blood, "blood"),
    (Material::CorticalBone, "cortical_bone"),
    (Material::Lung, "lung"),
    (Material::Contrast370, "contrast_370"),
    (Material::Nitinol, "nitinol"),
    (Material::Steel316L, "steel_316l"),
    (Material::Platinum, "platinum"),
    (Material::Tungsten, "tungsten"),
    (Material::PolyurethaneTungsten60, "polyurethane_tungsten_60"),
    (Material::PebaxBariumSulphate40, "pebax_baso4_40"),
    (Material::Aluminium, "aluminium"),
    (Material::Copper, "copper"),
    (Material::CaesiumIodide, "caesium_iodide"),
];

impl Material {
    /// All materials, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        NAMES.iter().map(|row| row.0)
    }

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        // Declaration order and table order agree; a test pins it.
        NAMES[self as usize].1
    }

    /// Linear attenuation coefficient in 1/mm at `energy_kev`; at a K-edge, the value above it.
    ///
    /// # Errors
    /// [`Error::Parameter`] outside 15 to 125 keV.
    pub fn attenuation_per_mm(self, energy_kev: f64) -> Result<f64> {
        let [low, high] = ATTENUATION.range_kev();
        match ATTENUATION.column(self.name()) {
            Some(column) if (low..=high).contains(&energy_kev) => {
                Ok(ATTENUATION.at(column, energy_kev) / 10.0)
            }
            _ => {
                let remedy = format!("the table covers {low} to {high} keV");
                Err(Error::parameter("view.xray.energy_kev", energy_kev, remedy))
            }
        }
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
        if let Some(row) = NAMES.iter().find(|row| row.1 == text) {
            return Ok(row.0);
        }
        let mut names = NAMES.map(|row| row.1);
        names.sort_by(|a, b| strsim::jaro_winkler(b, text).total_cmp(&strsim::jaro_winkler(a, text)));
        let remedy = format!("no such material; did you mean {} or {}? (known: {})", names[0], names[1], {
            NAMES.map(|row| row.1).join(", ")
        });
        Err(Error::parameter("material", format!("\"{text}\""), remedy))
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
    fn known_values_are_met_across_the_edges() {
        // 1/cm at 40, 50, 60 and 80 keV by hand from the tables of NIST and densities.
        for (material, expected) in [
            (Material::SoftTissue, [0.262, 0.223, 0.203, 0.182]),
            (Material::Contrast370, [8.44, 4.79, 3.01, 1.48]),
            (Material::Nitinol, [22.9, 12.4, 7.62, 3.79]),
            (Material::Platinum, [267.0, 149.0, 93.0, 187.0]),
            (Material::PolyurethaneTungsten60, [16.7, 9.4, 5.9, 12.2]),
        ] {
            for (energy, per_cm) in [40.0, 50.0, 60.0, 80.0].into_iter().zip(expected) {
                let mu = material.attenuation_per_mm(energy).unwrap() * 10.0;
                assert!((mu / per_cm - 1.0).abs() < 0.01, "{material} at {energy}: {mu}");
            }
        }
        let iodine = |e| Material::Contrast370.attenuation_per_mm(e).unwrap();
        assert!(iodine(33.2) / iodine(33.1) > 3.0, "the edge that angiography lives from");
    }

    #[test]
    fn no_value_outside_the_table() {
        for bad in [14.9, 125.1, f64::NAN, -1.0] {
            let error = Material::Blood.attenuation_per_mm(bad).unwrap_err().to_string();
            assert!(error.contains("15 to 125"), "{error}");
        }
    }

    #[test]
    fn an_unknown_name_gets_the_nearest_known() {
        let error = "nitinoll".parse::<Material>().unwrap_err().to_string();
        assert!(error.contains("did you mean nitinol"), "{error}");
    }
}
