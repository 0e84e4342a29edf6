//! From path lengths to the energy absorbed by the detector.
//!
//! **Beer–Lambert, with many energies.** Behind materials of lengths Lₘ a photon of energy E is transmitted with
//! probability exp(−p), p = Σ μₘ(E) Lₘ. A flat detector integrates energy, so its signal is S = ∫ N(E) η(E) E e^{−p}
//! dE with the photons N of the tube and the fraction η absorbed by caesium iodide.
//!
//! **Single precision.** Everything is relative to a *reference*, a thickness of soft tissue such as the scene's,
//! behind which S = 1. Its length is subtracted from that of the tissue before multiplication by µ, so p is small
//! where signals are not, and sums run over eight lanes: over every line of the table the signal is the tabulated
//! integral within 10⁻⁶, relatively, down to 5·10⁻⁷ of the open beam.
//!
//! **Fewer energies**, if [`XRaySpec::energy_bins`] requests them: with the weights of the spectrum behind the
//! reference the integrand is e^{−(p − p_ref)}, smooth in E between K-edges and near one, and a Gauss rule, separate
//! between the edges of iodine, tungsten and platinum, replaces the table. No rule with far fewer nodes reaches 10⁻⁶:
//! the table has kinks at its entries, and the transmissions of the [`Material`]s span 34 dimensions of 65 to that
//! accuracy (80 kV).
//!
//! **Photon noise.** Each absorbed photon contributes its energy, so var S ∝ ∫ N η E² e^{−p}: as if S/ε photons of
//! the energy ε = ∫NηE² / ∫NηE had been counted.

use endowire_core::Result;

use super::exp::{LANES, exp_lanes};
use super::quadrature::gauss;
use super::spectrum::Spectrum;
use crate::material::{Material, table::ATTENUATION};
use crate::spec::XRaySpec;

/// Smallest fraction of the signal in an interval between edges that gets nodes of its own.
const LEAST_SHARE: f64 = 1e-6;
/// Fraction of the open beam's signal below which lines are omitted. They are those of the lowest energies, and any
/// material attenuates them more than the others.
const LEAST_LINE: f64 = 1e-8;

/// A spectrum behind a reference, reduced to nodes, with the attenuation of materials.
#[derive(Debug, Clone)]
pub(crate) struct Beam {
    /// Energy and fraction of the reference signal of each node.
    nodes: Vec<(f64, f64)>,
    /// Soft tissue of the reference; exact in single precision.
    reference_mm: f64,
    /// Signal of the open beam, from the whole table.
    open: f64,
    /// Absorbed energy at the reference per mm² and nGy, keV.
    kev_per_mm2_ngy: f64,
    /// Weights and weights times energies by lanes, zero in the unused part of the last lane.
    weights: Vec<[[f32; LANES]; 2]>,
    /// Widest vector instructions available. Sums have the same order with any.
    arch: pulp::Arch,
}

/// Attenuation of one material, by lanes of nodes, 1/mm.
pub(crate) type Lanes = Vec<[f32; LANES]>;

/// Fraction of photons of an energy absorbed by the scintillator.
fn absorbed(energy_kev: f64, csi_mm: f64) -> Result<f64> {
    Ok(1.0 - libm::exp(-Material::CaesiumIodide.attenuation_per_mm(energy_kev)? * csi_mm))
}

impl Beam {
    /// The beam of `spec` behind `reference_mm` of soft tissue.
    ///
    /// # Errors
    /// Values outside the tables.
    pub(crate) fn new(spec: &XRaySpec, reference_mm: f64) -> Result<Self> {
        let tube = match spec.energy_kev {
            Some(energy) => Spectrum::mono(energy),
            None => Spectrum::tube(spec.kvp, spec.aluminium_mm, spec.copper_mm)?,
        };
        let reference_mm = f64::from(reference_mm as f32);
        let mut lines = Vec::with_capacity(tube.lines.len());
        for &(energy, photons) in &tube.lines {
            lines.push((energy, photons * absorbed(energy, spec.csi_mm)? * energy));
        }
        let open: f64 = lines.iter().map(|line| line.1).sum();
        lines.retain(|line| line.1 > LEAST_LINE * open);
        for line in &mut lines {
            line.1 *= libm::exp(-Material::SoftTissue.attenuation_per_mm(line.0)? * reference_mm);
        }
        let total: f64 = lines.iter().map(|line| line.1).sum();
        lines.iter_mut().for_each(|line| line.1 /= total);
        let nodes = match spec.energy_bins {
            Some(count) => reduced(&lines, count as usize),
            None => lines,
        };
        let soft = Material::SoftTissue;
        let behind = tube.behind(|e| soft.attenuation_per_mm(e).unwrap_or(0.0) * reference_mm);
        let absorbed_kev = behind.mean(|e| e * absorbed(e, spec.csi_mm).unwrap_or(0.0));
        let mut beam = Self {
            kev_per_mm2_ngy: behind.photons_per_mm2_ngy() * absorbed_kev,
            open: open / total,
            nodes,
            reference_mm,
            weights: vec![],
            arch: pulp::Arch::new(),
        };
        let weights = beam.lanes(|k| beam.nodes[k].1);
        let energies = beam.lanes(|k| beam.nodes[k].1 * beam.nodes[k].0);
        beam.weights = weights.into_iter().zip(energies).map(|(w, e)| [w, e]).collect();
        Ok(beam)
    }

    fn lanes(&self, value: impl Fn(usize) -> f64) -> Lanes {
        let lanes = self.nodes.len().div_ceil(LANES);
        (0..lanes)
            .map(|lane| {
                std::array::from_fn(|i| {
                    let k = lane * LANES + i;
                    if k < self.nodes.len() { value(k) as f32 } else { 0.0 }
                })
            })
            .collect()
    }

    /// Attenuation of a material at each node, 1/mm.
    pub(crate) fn mu(&self, material: Material) -> Result<Vec<f64>> {
        self.nodes.iter().map(|&(energy, _)| material.attenuation_per_mm(energy)).collect()
    }

    /// Attenuation of a millimetre of `material` replacing `displaced`, by lanes.
    pub(crate) fn excess(&self, material: Material, displaced: Option<Material>) -> Result<Lanes> {
        let mut mu = self.mu(material)?;
        if let Some(displaced) = displaced {
            mu.iter_mut().zip(self.mu(displaced)?).for_each(|(a, b)| *a -= b);
        }
        Ok(self.lanes(|k| mu[k]))
    }

    /// Mean of an attenuation over the signal of the reference, 1/mm.
    pub(crate) fn mean(&self, mu: &Lanes) -> f32 {
        let lines = self.weights.iter().zip(mu).flat_map(|([weight, _], mu)| weight.iter().zip(mu));
        lines.map(|(weight, mu)| weight * mu).sum()
    }

    /// Soft tissue of the reference, which must be subtracted for [`Self::add`].
    pub(crate) fn reference_mm(&self) -> f32 {
        self.reference_mm as f32
    }

    /// Adds the signal (and signal times energy in keV) behind layers, by lanes: given their attenuation and length,
    /// that of soft tissue minus [`Self::reference_mm`]. `line_integrals` is a work buffer.
    #[inline]
    pub(crate) fn add<'a>(
        &self,
        layers: impl Iterator<Item = (&'a Lanes, f32)>,
        line_integrals: &mut Lanes,
        sum: &mut [[f32; LANES]; 2],
    ) {
        self.arch.dispatch(Left { weights: &self.weights, layers, line_integrals, sum });
    }

    /// Natural logarithm of the transmission at the reference.
    pub(crate) fn ln_reference(&self) -> f64 {
        -libm::log(self.open)
    }

    /// Energy in keV of photons with the noise of the signal at the reference: ∫NηE² / ∫NηE.
    pub(crate) fn quantum_kev(&self) -> f64 {
        self.nodes.iter().map(|node| node.0 * node.1).sum::<f64>()
            / self.nodes.iter().map(|node| node.1).sum::<f64>()
    }

    /// Absorbed energy in keV of a pixel at the reference.
    pub(crate) fn kev(&self, pixel_mm: f64, dose_ngy: f64) -> f64 {
        self.kev_per_mm2_ngy * pixel_mm * pixel_mm * dose_ngy
    }
}

/// Adds the signal behind layers to a sum. A struct, because its code is inlined where a closure's is not.
struct Left<'a, Layers> {
    weights: &'a [[[f32; LANES]; 2]],
    layers: Layers,
    line_integrals: &'a mut Lanes,
    sum: &'a mut [[f32; LANES]; 2],
}

impl<'a, Layers: Iterator<Item = (&'a Lanes, f32)>> pulp::WithSimd for Left<'_, Layers> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { weights, layers, line_integrals, sum } = self;
        line_integrals.clear();
        line_integrals.resize(weights.len(), [0.0; LANES]);
        for (mu, length) in layers {
            for (p, mu) in line_integrals.iter_mut().zip(mu) {
                let mut left = *p;
                for i in 0..LANES {
                    left[i] -= mu[i] * length;
                }
                *p = left;
            }
        }
        // As local variables, sums stay in registers.
        let [mut signal, mut energy] = *sum;
        for ([weights, energies], p) in weights.iter().zip(line_integrals) {
            let left = exp_lanes(*p);
            for i in 0..LANES {
                signal[i] += weights[i] * left[i];
            }
            for i in 0..LANES {
                energy[i] += energies[i] * left[i];
            }
        }
        *sum = [signal, energy];
    }
}

/// Replaces a table by Gauss rules between the K-edges, with `count` nodes in all if the table has more.
fn reduced(lines: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    if lines.len() <= count {
        return lines.to_vec();
    }
    // Caesium and barium have edges near iodine's; separating them is not worth a node.
    let edges: Vec<f64> = ATTENUATION.edges_kev().into_iter().filter(|e| !(34.0..60.0).contains(e)).collect();
    let mut parts: Vec<Vec<(f64, f64)>> = vec![vec![]; edges.len() + 1];
    for &line in lines {
        parts[edges.partition_point(|&e| e <= line.0)].push(line);
    }
    let share = |part: &[(f64, f64)]| part.iter().map(|line| line.1).sum::<f64>();
    parts.retain(|part| share(part) > LEAST_SHARE);
    // One node each, the others where a node represents most.
    let mut nodes = vec![1_usize; parts.len()];
    for _ in parts.len()..count {
        let most = (0..parts.len()).filter(|&i| nodes[i] < parts[i].len()).max_by(|&a, &b| {
            let load = |i: usize| share(&parts[i]) / (nodes[i] * nodes[i]) as f64;
            load(a).total_cmp(&load(b))
        });
        match most {
            Some(i) => nodes[i] += 1,
            None => break,
        }
    }
    parts.iter().zip(nodes).flat_map(|(part, n)| gauss(part, n)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Beam {
        /// Ratio of the signal behind the given materials to that of the open beam: the transmitted fraction.
        fn transmission(&self, lengths: impl Iterator<Item = (Material, f64)>) -> Result<f64> {
            let mut p = self.mu(Material::SoftTissue)?;
            p.iter_mut().for_each(|p| *p *= -self.reference_mm);
            for (material, length) in lengths {
                p.iter_mut().zip(self.mu(material)?).for_each(|(p, mu)| *p += mu * length);
            }
            Ok(p.iter().zip(&self.nodes).map(|(p, node)| node.1 * (-p).exp()).sum::<f64>() / self.open)
        }
    }

    /// Direct sum over the table, independent of the code above.
    fn tabulated(kvp: f64, lengths: &[(Material, f64)]) -> f64 {
        let tube = Spectrum::tube(kvp, 2.5, 0.2).unwrap();
        let (mut left, mut open) = (0.0, 0.0);
        for &(e, n) in &tube.lines {
            let p: f64 = lengths.iter().map(|(m, l)| m.attenuation_per_mm(e).unwrap() * l).sum();
            let eta = 1.0 - (-Material::CaesiumIodide.attenuation_per_mm(e).unwrap() * 0.6).exp();
            left += n * e * eta * (-p).exp();
            open += n * e * eta;
        }
        left / open
    }

    /// 0 to 40 cm of tissue, alone and with each material of bodies and devices, thin and thick.
    fn slabs() -> Vec<Vec<(Material, f64)>> {
        use Material::*;
        let within: [&[(Material, f64)]; 16] = [
            &[],
            &[(CorticalBone, 2.0)],
            &[(CorticalBone, 30.0)],
            &[(Lung, 150.0), (CorticalBone, 5.0)],
            &[(Blood, 30.0)],
            &[(Contrast370, 0.4), (Blood, 3.6)],
            &[(Contrast370, 12.0)],
            &[(Nitinol, 0.4)],
            &[(Nitinol, 1.8), (CorticalBone, 12.0)],
            &[(Steel316L, 0.9)],
            &[(Platinum, 0.05)],
            &[(Platinum, 0.4)],
            &[(Tungsten, 0.1), (Contrast370, 3.0)],
            &[(PolyurethaneTungsten60, 0.4)],
            &[(PebaxBariumSulphate40, 1.4)],
            &[(PebaxBariumSulphate40, 0.6), (Platinum, 0.1), (Nitinol, 0.9), (Contrast370, 5.0)],
        ];
        let tissue = (0..=16).map(|k| 25.0 * f64::from(k));
        tissue.flat_map(|t| within.map(|more| [&[(SoftTissue, t)], more].concat())).collect()
    }

    /// As in images: the ratio of the signal in single precision to that of the open beam.
    fn drawn(beam: &Beam, slab: &[(Material, f64)]) -> f64 {
        let layers: Vec<(Lanes, f32)> = slab
            .iter()
            .map(|&(m, l)| {
                let off = if m == Material::SoftTissue { beam.reference_mm() } else { 0.0 };
                (beam.excess(m, None).unwrap(), l as f32 - off)
            })
            .collect();
        let mut sum = [[0.0; LANES]; 2];
        beam.add(layers.iter().map(|(mu, l)| (mu, *l)), &mut vec![], &mut sum);
        f64::from(sum[0].iter().sum::<f32>()) * beam.ln_reference().exp()
    }

    /// Largest relative error of `signal` over the slabs.
    fn worst(kvp: f64, signal: impl Fn(&[(Material, f64)]) -> f64) -> f64 {
        // The table is evaluated at lengths representable in single precision.
        let held = |slab: &Vec<(Material, f64)>| -> Vec<(Material, f64)> {
            slab.iter().map(|&(m, l)| (m, f64::from(l as f32))).collect()
        };
        slabs()
            .iter()
            .map(held)
            .map(|slab| (signal(&slab) / tabulated(kvp, &slab) - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn slabs_transmit_the_tabulated_integral_to_a_millionth() {
        for kvp in [60.0, 80.0, 125.0] {
            for reference in [0.0, 200.0, 333.3] {
                let spec = XRaySpec { kvp, ..XRaySpec::default() };
                let beam = Beam::new(&spec, reference).unwrap();
                let single = worst(kvp, |slab| drawn(&beam, slab));
                let double = worst(kvp, |slab| beam.transmission(slab.iter().copied()).unwrap());
                eprintln!(
                    "{kvp} kV, reference {reference} mm: single precision {single:.1e}, double {double:.1e}"
                );
                assert!(single <= 1e-6 && double <= 1e-6, "{kvp} kV, {reference} mm: {single} {double}");
            }
        }
        // Counter-checks: an additional micrometre of tissue is detected, and so is the error of a Gauss rule.
        let beam = Beam::new(&XRaySpec::default(), 200.0).unwrap();
        let more = worst(80.0, |slab| {
            drawn(&beam, slab) * (-1e-3 * Material::SoftTissue.attenuation_per_mm(60.0).unwrap()).exp()
        });
        assert!(more > 1e-6, "{more}");
        let few = Beam::new(&XRaySpec { energy_bins: Some(24), ..XRaySpec::default() }, 200.0).unwrap();
        let few = worst(80.0, |slab| drawn(&few, slab));
        assert!(few > 1e-6, "{few}");
    }

    #[test]
    fn eight_energies_stand_for_the_table_where_a_ten_thousandth_will_do() {
        use Material::*;
        let spec = XRaySpec { energy_bins: Some(8), ..XRaySpec::default() };
        let beam = Beam::new(&spec, 200.0).unwrap();
        assert_eq!(beam.nodes.len(), 8);
        for slab in [
            &[(SoftTissue, 200.0)][..],
            &[(SoftTissue, 170.0), (CorticalBone, 12.0), (Blood, 10.0)],
            &[(SoftTissue, 180.0), (Contrast370, 3.0)],
            &[(SoftTissue, 200.0), (Platinum, 0.1)],
            &[(SoftTissue, 200.0), (Nitinol, 0.9)],
            &[(SoftTissue, 200.0), (PolyurethaneTungsten60, 0.4)],
        ] {
            let error = beam.transmission(slab.iter().copied()).unwrap() / tabulated(80.0, slab) - 1.0;
            eprintln!("{error:+.1e} {slab:?}");
            assert!(error.abs() < 1e-3, "{slab:?}: {error}");
        }
        // Counter-check: one energy is not enough.
        let one = Beam::new(&XRaySpec { energy_kev: Some(58.0), ..spec }, 200.0).unwrap();
        let slab = [(SoftTissue, 180.0), (Contrast370, 3.0)];
        assert!((one.transmission(slab.into_iter()).unwrap() / tabulated(80.0, &slab) - 1.0).abs() > 0.01);
    }

    #[test]
    fn one_energy_is_beer_lambert() {
        let spec = XRaySpec { energy_kev: Some(60.0), ..XRaySpec::default() };
        let beam = Beam::new(&spec, 150.0).unwrap();
        let t =
            beam.transmission([(Material::SoftTissue, 100.0), (Material::Nitinol, 1.0)].into_iter()).unwrap();
        let mu = |m: Material| m.attenuation_per_mm(60.0).unwrap();
        let p = mu(Material::SoftTissue) * 100.0 + mu(Material::Nitinol);
        assert!((-t.ln() / p - 1.0).abs() < 1e-12);
    }
}
