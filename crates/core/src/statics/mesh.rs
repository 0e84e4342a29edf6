//! Meshes of static problems: nodes where sections, instruments or loads begin or end, and the elements' data.

use super::case::{Rod, Section};
use crate::rod::quadrature::GAUSS;
use crate::rod::{ElementData, Material};

/// GJ/EI assumed if GJ is absent, which is accepted only if the rod does not twist (a round wire with ν = 0.3).
pub(super) const ASSUMED_GJ_RATIO: f64 = 1.0 / 1.3;

/// Number of elements between consecutive breaks, `elements` in all if that is enough, as uniform as possible.
pub(super) fn spread(breaks: &[f64], elements: usize) -> Vec<usize> {
    let length = breaks[breaks.len() - 1];
    let mut counts: Vec<usize> = breaks
        .windows(2)
        .map(|w| (((w[1] - w[0]) / length * elements as f64).floor() as usize).max(1))
        .collect();
    let mut used: usize = counts.iter().sum();
    while used < elements {
        // One more where elements are longest.
        let mut best = 0;
        for k in 0..counts.len() {
            let size = |k: usize| (breaks[k + 1] - breaks[k]) / counts[k] as f64;
            if size(k) > size(best) * (1.0 + 1e-9) {
                best = k;
            }
        }
        counts[best] += 1;
        used += 1;
    }
    counts
}

/// Arc lengths of nodes, given the number of elements between consecutive breaks.
pub(super) fn nodes(breaks: &[f64], counts: &[usize]) -> Vec<f64> {
    let mut nodes = vec![0.0];
    for (w, count) in breaks.windows(2).zip(counts) {
        for k in 1..=*count {
            nodes.push(w[0] + (w[1] - w[0]) * k as f64 / *count as f64);
        }
    }
    nodes
}

/// The section at an arc length, and where it begins.
pub(super) fn section_at(sections: &[Section], place: f64) -> (&Section, f64) {
    let k = sections.iter().position(|s| place < s.until).unwrap_or(sections.len() - 1);
    (&sections[k], if k == 0 { 0.0 } else { sections[k - 1].until })
}

/// Elements of a rod between nodes.
pub(super) fn elements(rod: &Rod, nodes: &[f64]) -> Vec<ElementData> {
    let element = |w: &[f64]| {
        let (from, h) = (w[0], w[1] - w[0]);
        let (section, begin) = section_at(&rod.section, 0.5 * (w[0] + w[1]));
        let places = GAUSS.map(|point| from + point.xi * h);
        let mut flexibility = 0.0;
        if let Some(ea) = section.ea {
            for (point, place) in GAUSS.iter().zip(&places) {
                flexibility += point.weight * h / mix(section, begin, *place, ea, section.ea_end);
            }
        }
        ElementData { flexibility, ..ElementData::of(h, material(section, begin, &places)) }
    };
    nodes.windows(2).map(element).collect()
}

/// A section that begins at `begin`, sampled at the Gauss points of an element.
pub(super) fn material(section: &Section, begin: f64, places: &[f64; 3]) -> Material {
    let mut material = Material { rest_twist: [section.rest_twist; 3], ..Material::NONE };
    for (p, place) in places.iter().enumerate() {
        let mix = |a: f64, b: Option<f64>| mix(section, begin, *place, a, b);
        let bending = mix(section.ei, section.ei_end);
        material.bending[p] = bending;
        material.torsion[p] = section.gj.map_or(ASSUMED_GJ_RATIO * bending, |gj| mix(gj, section.gj_end));
        let end = section.rest_curvature_end.unwrap_or(section.rest_curvature);
        for a in 0..2 {
            material.rest_curvature[p][a] = mix(section.rest_curvature[a], Some(end[a]));
        }
    }
    material
}

/// Linear interpolation of a section's value at a position between its start and its end.
fn mix(section: &Section, begin: f64, place: f64, a: f64, b: Option<f64>) -> f64 {
    let w = ((place - begin) / (section.until - begin)).clamp(0.0, 1.0);
    a + w * (b.unwrap_or(a) - a)
}
