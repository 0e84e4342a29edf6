//! The X-ray tube: photons by energy behind the filters.

use endowire_core::{Error, Result};

use super::Material;
use super::table::{ANODE, ATTENUATION};

/// Photons by energy, normalised to one photon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spectrum {
    /// (energy in keV, share of the photons), energies rising.
    pub(crate) lines: Vec<(f64, f64)>,
}

impl Spectrum {
    /// A single energy.
    pub(crate) fn mono(energy_kev: f64) -> Self {
        Self { lines: vec![(energy_kev, 1.0)] }
    }

    /// A tungsten anode at `kvp` kilovolts behind `aluminium_mm` and `copper_mm`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a voltage that is not in the table.
    pub(crate) fn tube(kvp: f64, aluminium_mm: f64, copper_mm: f64) -> Result<Self> {
        let anode = ANODE.column(&format!("{kvp}")).ok_or_else(|| {
            let mend = format!("the table has {} kV", ANODE.names().join(", "));
            Error::parameter("view.xray.kvp", kvp, mend)
        })?;
        let mut lines = Vec::new();
        for (&energy, &photons) in ANODE.energies_kev.iter().zip(anode) {
            let filter = Material::Aluminium.attenuation_per_mm(energy)? * aluminium_mm
                + Material::Copper.attenuation_per_mm(energy)? * copper_mm;
            if photons > 0.0 {
                lines.push((energy, photons * (-filter).exp()));
            }
        }
        let total: f64 = lines.iter().map(|line| line.1).sum();
        lines.iter_mut().for_each(|line| line.1 /= total);
        Ok(Self { lines })
    }

    /// The spectrum behind something with the given line integral at each energy, not normalised.
    pub(crate) fn behind(&self, line_integral: impl Fn(f64) -> f64) -> Self {
        Self { lines: self.lines.iter().map(|&(e, n)| (e, n * (-line_integral(e)).exp())).collect() }
    }

    /// Mean of a quantity over the photons.
    pub(crate) fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let total: f64 = self.lines.iter().map(|line| line.1).sum();
        self.lines.iter().map(|&(e, n)| n * of(e)).sum::<f64>() / total
    }

    /// Photons per mm² that bring an air kerma of one nanogray.
    pub(crate) fn photons_per_mm2_ngy(&self) -> f64 {
        // 1 keV = 1.602e-16 J; µ_en/ρ is in cm²/g, so 1/mm² · keV · cm²/g = 100 · 1.602e-16 · 1000 Gy.
        const NGY: f64 = 1.602_177e-16 * 1e5 * 1e9;
        let air = ATTENUATION.column("air_kerma").unwrap_or_default();
        1.0 / (NGY * self.mean(|e| e * ATTENUATION.at(air, e)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 80 kV behind 0.2 mm of copper and 20 cm of water-like tissue. Reference: 57.8 keV and 33,600 photons/mm²/µGy,
    /// computed with another program from another anode model.
    #[test]
    fn behind_a_patient_the_beam_is_as_hard_and_as_rich_as_published() {
        let tube = Spectrum::tube(80.0, 2.5, 0.2).unwrap();
        let tissue = |e| Material::SoftTissue.attenuation_per_mm(e).unwrap() * 200.0;
        let behind = tube.behind(tissue);
        let mean = behind.mean(|e| e);
        assert!((mean - 57.8).abs() < 1.5, "{mean}");
        let photons = behind.photons_per_mm2_ngy() * 1000.0;
        assert!((photons / 33_600.0 - 1.0).abs() < 0.05, "{photons}");
        assert!(tube.mean(|e| e) < mean - 3.0, "the patient hardens the beam");
    }

    #[test]
    fn unknown_voltages_are_refused_with_the_known_ones() {
        for kvp in [0.0, 81.0, f64::NAN, 500.0] {
            let error = Spectrum::tube(kvp, 2.5, 0.0).unwrap_err().to_string();
            assert!(error.contains("view.xray.kvp") && error.contains("80"), "{error}");
        }
    }
}
