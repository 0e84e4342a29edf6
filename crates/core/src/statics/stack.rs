//! Several coaxial instruments on one centre line.
//!
//! Coaxial instruments share a centre line r(s) where they overlap. Each is inextensible, comes out of a straight
//! sheath at s = 0 where its hand holds its angle, and ends at its inserted length lᵢ. They slide and turn in each
//! other without friction, so the energy is a sum over the instruments present at s,
//!
//! ```text
//! U = Σᵢ ∫₀^lᵢ ½ EIᵢ |κ − R(θᵢ) κᵢ|² + ½ GJᵢ (τ + θᵢ′)² ds − Σᵢ ∫₀^lᵢ ½ EIᵢ |κᵢ|² ds
//! ```
//!
//! with the rest curvature κᵢ in the instrument's own material frame, which is turned by θᵢ against the line's
//! reference (Dupont, Lock, Itkowitz and Butler, *Design and control of concentric-tube robots*, IEEE Trans. Robotics
//! 26(2), 2010). The last sum is the energy released by the sheath, which straightens the part inside. Angles are
//! unknowns for instruments with a rest shape; on the others no torque acts.
//!
//! With play (`clearance`), what goes on tilts where another one ends ([`crate::rod::Tilt`]).
//!
//! An instrument is pushed with Fᵢ = ∂U/∂lᵢ. By the envelope theorem that is the derivative of the discrete energy in
//! the mesh alone, at fixed tangents, chords per length and angles: the ends of the instrument and of its sections
//! move with their nodes. It needs no second solution, holds for any load with a potential, and is exact for the
//! mesh.

use super::case::{Instrument, StaticCase};
use super::mesh::{material, nodes, section_at, spread};
use crate::rod::quadrature::GAUSS;
use crate::rod::{
    ElementData, Frame, MAX_ANGLES, Material, RodState, Side, Supports, Tilt, element_energy, shares, window,
};
use crate::solve::External;
use crate::{Error, Result, Vec3};

/// Breaks closer together than this fraction of the line's length share a node: in shorter elements, differences of
/// unit vectors lose the digits that determine curvature.
const NEAR: f64 = 1e-5;
/// Step of finite differences of the energy, as a fraction of the shortest piece between breaks.
const STEP: f64 = 1e-3;

/// A node at which an instrument, a section or a load begins or ends.
#[derive(Debug, Clone)]
struct Break {
    at: f64,
    /// Instruments whose insertion moves it.
    owners: Vec<usize>,
    /// Whether it also belongs to something that does not move with an instrument.
    fixed: bool,
}

/// Coaxial instruments, and the nodes of their mesh.
#[derive(Debug, Clone)]
pub(super) struct Stack {
    instruments: Vec<Instrument>,
    /// Set of angles of each instrument that has one.
    sets: Vec<Option<usize>>,
    breaks: Vec<Break>,
    /// Number of elements between consecutive breaks.
    counts: Vec<usize>,
}

impl Stack {
    /// The instruments of a case, if there are any, with nodes also at `held` arc lengths.
    ///
    /// # Errors
    /// More instruments with rest shapes than there can be sets of angles.
    pub(super) fn new(case: &StaticCase, held: impl Iterator<Item = f64>) -> Result<Option<Self>> {
        let instruments = case.rod.instrument.clone();
        if instruments.is_empty() {
            return Ok(None);
        }
        let mut angles = 0;
        let mut sets = Vec::with_capacity(instruments.len());
        for instrument in &instruments {
            let shaped = instrument.is_shaped();
            sets.push(shaped.then_some(angles));
            angles += usize::from(shaped);
        }
        if angles > MAX_ANGLES {
            return Err(Error::parameter(
                "rod.instrument",
                format!("{angles} with rest curvature or twist"),
                format!("at most {MAX_ANGLES} instruments on one line may have a shape of their own"),
            ));
        }
        let breaks = breaks(&instruments, held, NEAR * case.rod.line_length());
        let places: Vec<f64> = breaks.iter().map(|b| b.at).collect();
        let counts = spread(&places, case.rod.elements);
        Ok(Some(Self { instruments, sets, breaks, counts }))
    }

    /// Number of sets of angles.
    pub(super) fn angles(&self) -> usize {
        self.sets.iter().flatten().count()
    }

    /// The instruments, each with its set of angles, if any.
    pub(super) fn instruments(&self) -> impl Iterator<Item = (&Instrument, Option<usize>)> {
        self.instruments.iter().zip(self.sets.iter().copied())
    }

    /// Nodes and elements.
    pub(super) fn mesh(&self) -> (Vec<f64>, Vec<ElementData>) {
        self.mesh_with(None)
    }

    /// As [`Self::mesh`], with one instrument pushed by a length.
    fn mesh_with(&self, pushed: Option<(usize, f64)>) -> (Vec<f64>, Vec<ElementData>) {
        let by = |index: usize| pushed.filter(|(i, _)| *i == index).map_or(0.0, |(_, by)| by);
        let along = |b: &Break| pushed.filter(|(i, _)| b.owners.contains(i)).map_or(0.0, |(_, by)| by);
        let places: Vec<f64> = self.breaks.iter().map(|b| b.at + along(b)).collect();
        let nodes = nodes(&places, &self.counts);
        let tips: Vec<f64> = self.instruments.iter().enumerate().map(|(k, i)| i.inserted + by(k)).collect();
        let mut elements: Vec<ElementData> =
            nodes.windows(2).map(|w| self.element(w[0], w[1], &tips)).collect();
        if self.instruments.iter().any(|instrument| instrument.clearance > 0.0) {
            for e in 1..elements.len() {
                elements[e].tilt = self.tilt([nodes[e - 1], nodes[e], nodes[e + 1]], &elements[e], &tips);
            }
        }
        (nodes, elements)
    }

    /// An element between two arc lengths, of the instruments whose tips are in it or beyond.
    fn element(&self, from: f64, to: f64, tips: &[f64]) -> ElementData {
        let middle = 0.5 * (from + to);
        let mut data = ElementData::of(to - from, Material::NONE);
        for ((instrument, set), tip) in self.instruments().zip(tips).filter(|(_, tip)| middle < **tip) {
            let part = instrument.between(from, to, *tip);
            for (sum, own) in data.bending.iter_mut().zip(part.bending) {
                *sum += own;
            }
            if let Some(set) = set {
                data.materials[set] = part;
            }
        }
        data
    }

    /// The play of what is in an element between the last two of three nodes, in an instrument that ends between the first
    /// two, at the second.
    fn tilt(&self, [before, node, after]: [f64; 3], data: &ElementData, tips: &[f64]) -> Option<Tilt> {
        let is_in = |k: &usize, from: f64, to: f64| 0.5 * (from + to) < tips[*k];
        let goes_on = |k: &usize| is_in(k, node, after);
        let each = 0..self.instruments.len();
        let (first, last) = (each.clone().find(goes_on)?, each.clone().rfind(goes_on)?);
        let mut ending = each.clone().filter(|k| is_in(k, before, node) && !goes_on(k));
        // Inside it, or around it; next to what goes on.
        let (ends, between) = match (ending.clone().find(|k| *k > last), ending.rfind(|k| *k < first)) {
            (Some(outer), _) => (outer, last..outer),
            (None, Some(inner)) => (inner, inner..first),
            (None, None) => return None,
        };
        let clearance: f64 = self.instruments[between].iter().map(|one| one.clearance).sum();
        let curvature =
            each.clone().filter(|k| *k == ends || goes_on(k)).map(|k| self.instruments[k].most_curved());
        let from = node - window(clearance, node, curvature.fold(0.0, f64::max));
        let side = |of: &mut dyn Iterator<Item = usize>| {
            let mut side = Side::default();
            of.filter(|_| from < node)
                .for_each(|k| side.add(&self.instruments[k].between(from, node, tips[k]), self.sets[k]));
            side
        };
        let (own, others) = (side(&mut std::iter::once(ends)), side(&mut each.filter(goes_on)));
        Tilt::new((clearance, node), &own, &others, &data.materials)
    }

    /// The shape of untwisted instruments: everywhere the mean of their rest curvatures, weighted by stiffness.
    pub(super) fn untwisted(&self, elements: &[ElementData], start: Vec3, frame: Frame) -> RodState {
        let mut frames = vec![frame];
        let mut last = frame;
        for data in elements {
            let mut curvature = [0.0; 2];
            for (instrument, set) in self.instruments() {
                let Some(set) = set else { continue };
                let (sin, cos) = libm::sincos(instrument.hand);
                let own = &data.materials[set];
                for (p, point) in GAUSS.iter().enumerate() {
                    let weight = point.weight * own.bending[p] / data.bending[p];
                    let [u, v] = own.rest_curvature[p];
                    curvature[0] += weight * (cos * u - sin * v);
                    curvature[1] += weight * (sin * u + cos * v);
                }
            }
            last = last.transported(curvature[0] * data.length, curvature[1] * data.length);
            frames.push(last);
        }
        let mut state = RodState::from_frames(elements, start, frames).with_sets(self.angles().max(1));
        let hands: Vec<f64> =
            self.instruments().filter(|(_, set)| set.is_some()).map(|(i, _)| i.hand).collect();
        if !hands.is_empty() {
            state.angles.chunks_exact_mut(hands.len()).for_each(|node| node.copy_from_slice(&hands));
        }
        state
    }

    /// Node of an instrument's tip.
    pub(super) fn tip_node(&self, index: usize) -> usize {
        let k = self.breaks.iter().position(|b| b.at >= self.instruments[index].inserted);
        self.counts[..k.unwrap_or(self.counts.len())].iter().sum()
    }

    /// Push force of an instrument at the equilibrium `state`, external energies included; `None` where it jumps.
    pub(super) fn push_force<const C: usize>(
        &self,
        index: usize,
        state: &RodState,
        supports: &Supports,
        external: &mut dyn External,
    ) -> Option<f64> {
        let shared =
            |b: &Break| b.owners.contains(&index) && (b.fixed || b.owners.iter().any(|i| *i != index));
        if self.breaks.iter().any(shared) {
            return None;
        }
        let shortest = self.breaks.windows(2).map(|w| w[1].at - w[0].at).fold(f64::INFINITY, f64::min);
        let step = STEP * shortest;
        let mut energy = |by: f64| {
            let (_, elements) = self.mesh_with(Some((index, by)));
            let mut moved = state.clone();
            moved.place(&elements);
            let stored: f64 = elements
                .iter()
                .enumerate()
                .map(|(e, data)| element_energy::<C>(data, &state.element::<C>(e)).total())
                .sum();
            let gaps = supports.gaps(&moved);
            let held: f64 = gaps.iter().zip(&supports.multipliers).map(|(gap, m)| gap * m).sum();
            stored + external.value(&elements, &moved) + held
        };
        let near = energy(step) - energy(-step);
        let far = energy(2.0 * step) - energy(-2.0 * step);
        Some((8.0 * near - far) / (12.0 * step) - self.instruments[index].straightening())
    }
}

impl Instrument {
    /// Whether it has a rest shape, so that torque acts on it.
    pub(super) fn is_shaped(&self) -> bool {
        self.section.iter().any(|s| {
            s.rest_curvature != [0.0; 2]
                || s.rest_curvature_end.is_some_and(|end| end != [0.0; 2])
                || s.rest_twist != 0.0
        })
    }

    /// Material between two arc lengths with the tip at a third, at the Gauss points. A section that ends in between
    /// contributes by weights that integrate its part exactly up to squares.
    fn between(&self, from: f64, to: f64, tip: f64) -> Material {
        let h = to - from;
        let places = GAUSS.map(|point| tip - (from + point.xi * h));
        let (section, begin) = section_at(&self.section, tip - 0.5 * (from + to));
        if tip - from <= section.until && tip - to >= begin {
            return material(section, begin, &places);
        }
        let mut sum = Material::NONE;
        let mut begin = 0.0;
        for (k, section) in self.section.iter().enumerate() {
            let until = if k + 1 == self.section.len() { f64::INFINITY } else { section.until };
            let (first, last) = ((tip - until).max(from), (tip - begin).min(to));
            if first < last {
                let shares = shares((first - from) / h, (last - from) / h);
                sum.add_share(&material(section, begin, &places), &shares);
            }
            begin = section.until;
        }
        sum
    }

    /// Largest rest curvature.
    fn most_curved(&self) -> f64 {
        let each = self.section.iter().flat_map(|s| [Some(s.rest_curvature), s.rest_curvature_end]);
        each.flatten().map(|[u, v]| libm::hypot(u, v)).fold(0.0, f64::max)
    }

    /// Energy per length released by the sheath as the instrument is pushed: ½ EI |κ⁰|² at the start.
    fn straightening(&self) -> f64 {
        let (section, begin) = section_at(&self.section, self.inserted);
        let here = material(section, begin, &[self.inserted; 3]);
        let [u, v] = here.rest_curvature[0];
        0.5 * here.bending[0] * (u * u + v * v)
    }
}

/// The start, the ends of instruments and of their sections, and `held` arc lengths, in order. Breaks closer than
/// `near` are merged at the last one: instruments end before their node, not beyond it.
fn breaks(instruments: &[Instrument], held: impl Iterator<Item = f64>, near: f64) -> Vec<Break> {
    let fixed = held.chain([0.0]).map(|at| Break { at, owners: vec![], fixed: true });
    let mut all: Vec<Break> = fixed.collect();
    for (index, instrument) in instruments.iter().enumerate() {
        // Breaks at the tip and after each section but the last, where they are beyond the start.
        let inner = &instrument.section[..instrument.section.len() - 1];
        let begins = [0.0].into_iter().chain(inner.iter().map(|s| s.until));
        let places = begins.map(|from_tip| instrument.inserted - from_tip).filter(|at| *at > 0.0);
        all.extend(places.map(|at| Break { at, owners: vec![index], fixed: false }));
    }
    all.sort_by(|a, b| a.at.total_cmp(&b.at));
    all.dedup_by(|b, a| {
        let one = b.at - a.at <= near;
        if one {
            // The start does not move.
            a.at = if a.at > 0.0 { b.at } else { 0.0 };
            a.owners.append(&mut b.owners);
            a.fixed |= b.fixed;
        }
        one
    });
    all
}
