//! From path lengths to what the detector absorbs.
//!
//! **Beer–Lambert, with many energies.** Behind materials of lengths Lₘ a photon of energy E is left with probability
//! exp(−p), p = Σ μₘ(E) Lₘ. A flat detector adds up energy, so its signal is S = ∫ N(E) η(E) E e^{−p} dE with the photons N of
//! the tube and the share η that caesium iodide absorbs.
//!
//! **Few energies.** Everything is told relative to a *reference*, a thickness of soft tissue such as the scene's. With the
//! weights of the spectrum behind it the integrand is e^{−(p − p_ref)}, smooth in E between K-edges and near one, and a Gauss rule
//! of [`BeamSpec::energy_bins`] nodes, separate between the edges of iodine, tungsten and platinum, replaces the table. S = 1 at
//! the reference.
//!
//! **Quanta.** Each absorbed photon gives its energy, so var S ∝ ∫ N η E² e^{−p}: as if S/ε quanta of the energy
//! ε = ∫NηE² / ∫NηE had been counted.

use endowire_core::Result;

use super::exp::{LANES, exp_lanes};
use super::quadrature::gauss;
use super::spectrum::Spectrum;
use super::{Material, table::ATTENUATION};
use crate::spec::XRaySpec;

/// Least share of the signal that a stretch between edges must carry to get nodes of its own.
const LEAST_SHARE: f64 = 1e-6;

/// A spectrum behind a reference, reduced to nodes, with what the materials do to it.
#[derive(Debug, Clone)]
pub(crate) struct Beam {
    /// Energy and share of the reference signal of each node.
    nodes: Vec<(f64, f64)>,
    /// Line integral of the reference at each node.
    reference: Vec<f64>,
    /// Signal without anything in the way, by the whole table.
    open: f64,
    /// Absorbed energy at the reference for each mm² and nGy, keV.
    kev_per_mm2_ngy: f64,
    /// Weights and weights times energies by lanes, the rest of the last lane zero.
    weights: Vec<[[f32; LANES]; 2]>,
}

/// Attenuation of one material, by lanes of nodes, 1/mm.
pub(crate) type Lanes = Vec<[f32; LANES]>;

/// Share of photons of an energy that the scintillator absorbs.
fn absorbed(energy_kev: f64, csi_mm: f64) -> Result<f64> {
    Ok(1.0 - (-Material::CaesiumIodide.attenuation_per_mm(energy_kev)? * csi_mm).exp())
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
        let mut lines = Vec::with_capacity(tube.lines.len());
        let (mut open, mut total) = (0.0, 0.0);
        for &(energy, photons) in &tube.lines {
            let signal = photons * absorbed(energy, spec.csi_mm)? * energy;
            let left = (-Material::SoftTissue.attenuation_per_mm(energy)? * reference_mm).exp();
            open += signal;
            total += signal * left;
            lines.push((energy, signal * left));
        }
        lines.iter_mut().for_each(|line| line.1 /= total);
        let nodes = reduced(&lines, spec.energy_bins as usize);
        let mut reference = Vec::with_capacity(nodes.len());
        for &(energy, _) in &nodes {
            reference.push(Material::SoftTissue.attenuation_per_mm(energy)? * reference_mm);
        }
        let soft = Material::SoftTissue;
        let behind = tube.behind(|e| soft.attenuation_per_mm(e).unwrap_or(0.0) * reference_mm);
        let absorbed_kev = behind.mean(|e| e * absorbed(e, spec.csi_mm).unwrap_or(0.0));
        let mut beam = Self {
            kev_per_mm2_ngy: behind.photons_per_mm2_ngy() * absorbed_kev,
            open: open / total,
            nodes,
            reference,
            weights: vec![],
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

    /// What a millimetre of `material` adds in place of `displaced`, by lanes.
    pub(crate) fn excess(&self, material: Material, displaced: Option<Material>) -> Result<Lanes> {
        let mut mu = self.mu(material)?;
        if let Some(displaced) = displaced {
            mu.iter_mut().zip(self.mu(displaced)?).for_each(|(a, b)| *a -= b);
        }
        Ok(self.lanes(|k| mu[k]))
    }

    /// Minus the line integral of the reference, by lanes: where sums over materials start.
    pub(crate) fn start(&self) -> Lanes {
        self.lanes(|k| -self.reference[k])
    }

    /// Adds to (signal, signal times energy in keV) what is left behind line integrals relative to the reference.
    #[inline]
    pub(crate) fn add(&self, line_integral: impl Fn(usize) -> [f32; LANES], sum: &mut [f32; 2]) {
        for (lane, [weight, energy]) in self.weights.iter().enumerate() {
            let left = exp_lanes(line_integral(lane).map(|p| -p));
            for i in 0..LANES {
                sum[0] += weight[i] * left[i];
                sum[1] += energy[i] * left[i];
            }
        }
    }

    /// Signal behind the given materials over that of the open beam: the transmitted fraction.
    pub(crate) fn transmission(&self, lengths: impl Iterator<Item = (Material, f64)>) -> Result<f64> {
        let mut p: Vec<f64> = self.reference.iter().map(|p| -p).collect();
        for (material, length) in lengths {
            p.iter_mut().zip(self.mu(material)?).for_each(|(p, mu)| *p += mu * length);
        }
        Ok(p.iter().zip(&self.nodes).map(|(p, node)| node.1 * (-p).exp()).sum::<f64>() / self.open)
    }

    /// Natural logarithm of the transmission at the reference.
    pub(crate) fn ln_reference(&self) -> f64 {
        -self.open.ln()
    }

    /// Absorbed energy in keV of a pixel at the reference.
    pub(crate) fn kev(&self, pixel_mm: f64, dose_ngy: f64) -> f64 {
        self.kev_per_mm2_ngy * pixel_mm * pixel_mm * dose_ngy
    }
}

/// Replaces a table by Gauss rules between the K-edges, `count` nodes in all where the table has more.
fn reduced(lines: &[(f64, f64)], count: usize) -> Vec<(f64, f64)> {
    if lines.len() <= count {
        return lines.to_vec();
    }
    // Caesium and barium have edges beside iodine's; telling them apart is worth no node.
    let edges: Vec<f64> = ATTENUATION.edges_kev().into_iter().filter(|e| !(34.0..60.0).contains(e)).collect();
    let mut parts: Vec<Vec<(f64, f64)>> = vec![vec![]; edges.len() + 1];
    for &line in lines {
        parts[edges.partition_point(|&e| e <= line.0)].push(line);
    }
    let share = |part: &[(f64, f64)]| part.iter().map(|line| line.1).sum::<f64>();
    parts.retain(|part| share(part) > LEAST_SHARE);
    // One node each, the others where most is left for a node to stand for.
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

    /// Direct sum over the table, written without the code above.
    fn tabulated(lengths: &[(Material, f64)]) -> f64 {
        let tube = Spectrum::tube(80.0, 2.5, 0.2).unwrap();
        let (mut left, mut open) = (0.0, 0.0);
        for &(e, n) in &tube.lines {
            let p: f64 = lengths.iter().map(|(m, l)| m.attenuation_per_mm(e).unwrap() * l).sum();
            let eta = 1.0 - (-Material::CaesiumIodide.attenuation_per_mm(e).unwrap() * 0.6).exp();
            left += n * e * eta * (-p).exp();
            open += n * e * eta;
        }
        left / open
    }

    fn slabs() -> Vec<Vec<(Material, f64)>> {
        use Material::*;
        vec![
            vec![],
            vec![(SoftTissue, 200.0)],
            vec![(SoftTissue, 170.0), (CorticalBone, 12.0), (Blood, 10.0)],
            vec![(SoftTissue, 180.0), (Contrast370, 3.0)],
            vec![(SoftTissue, 200.0), (Platinum, 0.1)],
            vec![(SoftTissue, 200.0), (Nitinol, 0.9)],
            vec![(SoftTissue, 200.0), (PolyurethaneTungsten60, 0.4)],
        ]
    }

    #[test]
    fn with_every_energy_slabs_transmit_the_tabulated_integral_to_a_millionth() {
        let beam = Beam::new(&XRaySpec { energy_bins: 200, ..XRaySpec::default() }, 200.0).unwrap();
        let lanes = |m| beam.excess(m, None).unwrap();
        for slab in slabs() {
            let exact = tabulated(&slab);
            let computed = beam.transmission(slab.iter().copied()).unwrap();
            assert!((computed / exact - 1.0).abs() < 1e-6, "{slab:?}: {computed} {exact}");
            // What pictures are made from, in single precision, is the same number.
            let tables: Vec<_> = slab.iter().map(|&(m, l)| (lanes(m), l as f32)).collect();
            let start = beam.start();
            let mut sum = [0.0; 2];
            let p = |lane: usize| {
                std::array::from_fn(|i| tables.iter().fold(start[lane][i], |p, (mu, l)| p + mu[lane][i] * l))
            };
            beam.add(p, &mut sum);
            let shown = f64::from(sum[0]) * beam.ln_reference().exp();
            assert!((shown / exact - 1.0).abs() < 3e-6, "{slab:?}: {shown} {exact}");
        }
        // The twin: a hundredth of a millimetre of tissue more is seen.
        let more = beam.transmission([(Material::SoftTissue, 200.01)].into_iter()).unwrap();
        assert!((more / tabulated(&[(Material::SoftTissue, 200.0)]) - 1.0).abs() > 1e-4);
    }

    #[test]
    fn eight_energies_stand_for_the_table() {
        let spec = XRaySpec::default();
        let beam = Beam::new(&spec, 200.0).unwrap();
        assert_eq!(beam.nodes.len(), 8);
        for slab in slabs().into_iter().skip(1) {
            let error = beam.transmission(slab.iter().copied()).unwrap() / tabulated(&slab) - 1.0;
            eprintln!("{error:+.1e} {slab:?}");
            assert!(error.abs() < 1e-3, "{slab:?}: {error}");
        }
        // The twin: one energy is not enough.
        let one = Beam::new(&XRaySpec { energy_kev: Some(58.0), ..spec }, 200.0).unwrap();
        let slab = [(Material::SoftTissue, 180.0), (Material::Contrast370, 3.0)];
        assert!((one.transmission(slab.into_iter()).unwrap() / tabulated(&slab) - 1.0).abs() > 0.01);
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
