//! The X-ray tube: photons by energy behind the filters.

use endowire_core::{Error, Result};

use crate::material::Material;
use crate::material::table::{AIR, ANODE};

/// Photons by energy, normalised to one photon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spectrum {
    /// (energy in keV, fraction of the photons), energies ascending.
    pub(crate) lines: Vec<(f64, f64)>,
}

/// Rejects a voltage without a known spectrum.
pub(crate) fn check_kvp(kvp: f64) -> Result<()> {
    anode(kvp).map(drop)
}

/// Photons of the anode at each energy of the table.
fn anode(kvp: f64) -> Result<&'static [f64]> {
    ANODE.column(&format!("{kvp}")).ok_or_else(|| {
        let remedy = format!("the table has {} kV", ANODE.names().join(", "));
        Error::parameter("view.xray.kvp", kvp, remedy)
    })
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
        Ok(Self::filtered(kvp, aluminium_mm, copper_mm)?.0)
    }

    /// As [`Self::tube`], with the fraction of the anode's photons transmitted by the filters.
    pub(crate) fn filtered(kvp: f64, aluminium_mm: f64, copper_mm: f64) -> Result<(Self, f64)> {
        let anode = anode(kvp)?;
        let mut lines = Vec::new();
        for (&energy, &photons) in ANODE.energies_kev.iter().zip(anode) {
            let filter = Material::Aluminium.attenuation_per_mm(energy)? * aluminium_mm
                + Material::Copper.attenuation_per_mm(energy)? * copper_mm;
            if photons > 0.0 {
                lines.push((energy, photons * libm::exp(-filter)));
            }
        }
        let total: f64 = lines.iter().map(|line| line.1).sum();
        lines.iter_mut().for_each(|line| line.1 /= total);
        Ok((Self { lines }, total))
    }

    /// The spectrum behind a material with the given line integral at each energy, not normalised.
    pub(crate) fn behind(&self, line_integral: impl Fn(f64) -> f64) -> Self {
        Self { lines: self.lines.iter().map(|&(e, n)| (e, n * libm::exp(-line_integral(e)))).collect() }
    }

    /// Mean of a quantity over the photons.
    pub(crate) fn mean(&self, of: impl Fn(f64) -> f64) -> f64 {
        let total: f64 = self.lines.iter().map(|line| line.1).sum();
        self.lines.iter().map(|&(e, n)| n * of(e)).sum::<f64>() / total
    }

    /// Air kerma of the lines' photons on each mm², nGy.
    pub(crate) fn kerma_ngy(&self) -> f64 {
        self.lines.iter().map(|line| line.1).sum::<f64>() / self.photons_per_mm2_ngy()
    }

    /// Photons per mm² for an air kerma of one nanogray.
    pub(crate) fn photons_per_mm2_ngy(&self) -> f64 {
        // 1 keV = 1.602e-16 J; µ_en/ρ is in cm²/g, so 1/mm² · keV · cm²/g = 100 · 1.602e-16 · 1000 Gy.
        const NGY: f64 = 1.602_177e-16 * 1e5 * 1e9;
        let air = AIR.column("energy_absorption").unwrap_or_default();
        1.0 / (NGY * self.mean(|e| e * AIR.at(air, e)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Photons per mm² and µGy behind `more_mm` of aluminium.
    fn photons_per_mm2_ugy(tube: &Spectrum, more_mm: f64) -> f64 {
        let aluminium = |e| Material::Aluminium.attenuation_per_mm(e).unwrap() * more_mm;
        tube.behind(aluminium).photons_per_mm2_ngy() * 1000.0
    }

    /// Aluminium that halves the air kerma, mm.
    fn half_value_mm(tube: &Spectrum) -> f64 {
        let kerma =
            |mm: f64| tube.behind(|e| Material::Aluminium.attenuation_per_mm(e).unwrap() * mm).kerma_ngy();
        let (mut low, mut high) = (0.0, 50.0);
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if kerma(middle) > kerma(0.0) / 2.0 { low = middle } else { high = middle }
        }
        low
    }

    /// The reference is SpekPy 2.5 (casim, 12 degrees, bins of 0.1 keV) with NIST's air: 26,141 photons/mm²/µGy. The
    /// half-value layer is that of such a spectrum in xraylib's aluminium.
    #[test]
    fn a_beam_is_as_hard_and_a_dose_has_as_many_quanta_as_another_program_says() {
        let tube = Spectrum::tube(80.0, 2.5, 0.2).unwrap();
        let half_value = half_value_mm(&tube);
        assert!((half_value / 5.49 - 1.0).abs() < 5e-3, "{half_value} mm");
        let photons = photons_per_mm2_ugy(&tube, 0.0);
        assert!((photons / 26_141.0 - 1.0).abs() < 0.01, "{photons}");
        // Counter-check: both detect an additional half millimetre of aluminium.
        let harder = Spectrum::tube(80.0, 3.0, 0.2).unwrap();
        assert!((half_value_mm(&harder) / 5.49 - 1.0).abs() > 5e-3, "{}", half_value_mm(&harder));
        assert!((photons_per_mm2_ugy(&tube, 0.5) / 26_141.0 - 1.0).abs() > 0.01);
    }

    /// 80 kV behind 0.2 mm of copper and 20 cm of tissue. Reference: behind 20 cm of water 57.8 keV and 30,831 photons/mm²/µGy, by
    /// the same program.
    #[test]
    fn behind_a_patient_the_beam_is_as_hard_and_as_rich_as_published() {
        let tube = Spectrum::tube(80.0, 2.5, 0.2).unwrap();
        let tissue = |e| Material::SoftTissue.attenuation_per_mm(e).unwrap() * 200.0;
        let behind = tube.behind(tissue);
        let mean = behind.mean(|e| e);
        assert!((mean - 57.8).abs() < 0.3, "{mean}");
        let photons = behind.photons_per_mm2_ngy() * 1000.0;
        assert!((photons / 30_831.0 - 1.0).abs() < 0.01, "{photons}");
        assert!(tube.mean(|e| e) < mean - 3.0, "the patient hardens the beam");
    }

    /// Transmitted energy absorbed by 0.6 mm of caesium iodide, behind 0.2 and 0.4 mm alone and behind 20 cm of
    /// tissue: spectra of SpekPy 2.5 in bins of 0.1 keV.
    #[test]
    fn bins_that_end_at_edges_are_as_good_as_ten_times_finer_ones() {
        use Material::{Platinum, Tungsten};
        let fine = [
            (Platinum, 60.0, [3.0769e-2, 3.8314e-4, 2.1709e-3, 3.0144e-5]),
            (Platinum, 80.0, [1.0330e-1, 1.9125e-3, 2.0482e-2, 4.1860e-4]),
            (Platinum, 90.0, [1.1878e-1, 2.3110e-3, 2.5625e-2, 5.4209e-4]),
            (Platinum, 100.0, [1.2344e-1, 2.4671e-3, 2.6727e-2, 5.7138e-4]),
            (Platinum, 125.0, [1.3112e-1, 2.8411e-3, 2.7693e-2, 6.2240e-4]),
            (Tungsten, 60.0, [6.0566e-2, 7.2106e-4, 7.0382e-3, 9.4052e-5]),
            (Tungsten, 80.0, [1.2925e-1, 2.1386e-3, 2.8824e-2, 5.1929e-4]),
            (Tungsten, 90.0, [1.3387e-1, 2.3093e-3, 3.0449e-2, 5.5827e-4]),
            (Tungsten, 100.0, [1.3728e-1, 2.4724e-3, 3.1111e-2, 5.8154e-4]),
            (Tungsten, 125.0, [1.5085e-1, 3.0954e-3, 3.4656e-2, 7.2656e-4]),
        ];
        let mu = |material: Material, e: f64| material.attenuation_per_mm(e).unwrap();
        let absorbed = |e: f64| e * (1.0 - (-0.6 * mu(Material::CaesiumIodide, e)).exp());
        let worst = |of: &dyn Fn(Spectrum) -> Spectrum| {
            let mut worst = 0.0_f64;
            for (metal, kvp, expected) in fine {
                let tube = of(Spectrum::tube(kvp, 2.5, 0.2).unwrap());
                let signal = |p: &dyn Fn(f64) -> f64| {
                    tube.lines.iter().map(|&(e, n)| n * absorbed(e) * (-p(e)).exp()).sum::<f64>()
                };
                let slabs = [(0.2, 0.0), (0.2, 200.0), (0.4, 0.0), (0.4, 200.0)];
                for ((metal_mm, tissue_mm), expected) in slabs.into_iter().zip(expected) {
                    let behind =
                        signal(&|e| mu(metal, e) * metal_mm + mu(Material::SoftTissue, e) * tissue_mm);
                    worst = worst.max((behind / signal(&|_| 0.0) / expected - 1.0).abs());
                }
            }
            worst
        };
        let split = worst(&|tube| tube);
        assert!(split < 0.01, "{split}");
        // Counter-check: whole bins of 1 keV.
        let whole = worst(&|tube| {
            let mut lines: Vec<(f64, f64)> = Vec::new();
            for (energy, photons) in tube.lines {
                let middle = energy.floor() + 0.5;
                match lines.last_mut().filter(|last| last.0 == middle) {
                    Some(last) => last.1 += photons,
                    None => lines.push((middle, photons)),
                }
            }
            Spectrum { lines }
        });
        assert!(whole > 0.02, "{whole}");
        eprintln!("against 0.1 keV: {split:.4} with split bins, {whole:.4} with whole ones");
    }

    #[test]
    fn unknown_voltages_are_refused_with_the_known_ones() {
        for kvp in [0.0, 81.0, f64::NAN, 500.0] {
            let error = Spectrum::tube(kvp, 2.5, 0.0).unwrap_err().to_string();
            assert!(error.contains("view.xray.kvp") && error.contains("80"), "{error}");
        }
    }
}
