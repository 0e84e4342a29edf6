//! Play at the end of an instrument: how far what goes on tilts in it, and what that takes.
//!
//! Two instruments of stiffness EIₐ (it ends at s = 0) and EIᵦ (it goes on) lie in one another with a clearance δ to either side.
//! With w their mean, weighted by stiffness, and u = wᵦ − wₐ, deflections are wᵦ = w + c u and wₐ = w − (1 − c) u, c = EIₐ/(EIₐ + EIᵦ),
//! and their energy falls apart:
//!
//! ```text
//! ½∫ (EIₐ + EIᵦ) |w″ − κ̄|² ds  +  ½∫ EIᵣ |u″ − Δκ⁰|² ds,    EIᵣ = EIₐ EIᵦ/(EIₐ + EIᵦ),   |u| ≤ δ
//! ```
//!
//! The first part is the shared line ([`super`]); the second one is left out where there is no play. Behind the end u lies on one
//! side of the lumen. Over a last length L it crosses to the other, a cubic with u″ = 0 where it leaves:
//!
//! ```text
//! 2δ = a L³/6,   φ = u′(0) = a L²/2 = 6δ/L,   M = EIᵣ a L = EIᵣ φ²/(3δ),   U = EIᵣ φ³/(9δ)
//! ```
//!
//! so that φ = √(3δM/EIᵣ), M the moment that turns the two against each other at the end. A relative beam that is held at ℓ behind
//! the end, where the sheath holds both, and that M does not bring to the rim has M = EIᵣ φ/ℓ. Both are met, and U is smooth and strictly
//! convex, with
//!
//! ```text
//! U = EIᵣ/(9δ) (ρ³ − φₛ³),   M = ∂U/∂φ = EIᵣ/(3δ) ρ φ,   ∂²U/∂φ² = EIᵣ/(3δ) (ρ I + φ φᵀ/ρ),   ρ² = φ² + φₛ²,   φₛ = 3δ/ℓ
//! ```
//!
//! in the two directions across. Rest curvatures add −φ·D, D = EIᵣ∫Δκ⁰ u″ ds/φ: with u″ = 2φ(L − x)/L² at x behind the end that is
//! a mean of Δκ⁰ with those weights. It is taken over a fixed length, [`window`], √(12δ/κ) with the largest rest curvature κ of both, so
//! that D is linear in φ and nothing jumps where a bend is pushed through the end.
//!
//! What goes on is the line beyond the end, which is turned there by ψ = c φ against the line behind it: a kink. In terms of ψ, and of the
//! moments EI κ⁰ of the instruments in their own axes, turned by their angles at the end,
//!
//! ```text
//! W(ψ, θ) = U(ψ/c) − ψ·Σᵢ R(θᵢ) nᵢ,    nₐ = −(1 − c)/c EIₐκₐ⁰,   nᵦ = (EIᵦκᵦ⁰ behind the end) − (EIᵦκᵦ⁰ beyond it)
//! ```
//!
//! The last term puts right the energy of rest curvature beyond the end, which counts the whole curvature of the line, kink
//! included. How a kink is part of an element is the subject of [`super::rim`]. In equilibrium c M = EIᵦκ − …, that is M = EIᵣ(κ − κₐ⁰)
//! with κ the curvature just beyond the end: what both would differ by there without each other.
//!
//! The rim and the place where u leaves its side press on the two with f = M/L = M φ/(6δ) each, [`Tilt::rim_force`].

use super::element::Material;
use super::layout::MAX_ANGLES;
use super::quadrature::GAUSS;

/// Length over which stiffness behind an end is averaged where nothing is curved at rest, in clearances: L at a tilt of a tenth of a radian.
const WINDOW: f64 = 60.0;

/// Bending stiffness and moment EI κ⁰ of several instruments together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Side {
    bending: f64,
    /// By set of angles, along d₁ and d₂.
    moments: [[f64; 2]; MAX_ANGLES],
}

/// The play of what goes on in an instrument that ends at the first node of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tilt {
    /// δ.
    clearance: f64,
    /// EIᵣ.
    stiffness: f64,
    /// c.
    part: f64,
    /// φₛ.
    free: f64,
    /// nᵢ by set of angles.
    moments: [[f64; 2]; MAX_ANGLES],
}

/// W with its derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct KinkEnergy {
    pub(super) value: f64,
    pub(super) first: [f64; 2],
    pub(super) second: [[f64; 2]; 2],
    /// First and second derivative in the angle of each set, and its first in ψ.
    pub(super) angles: [([f64; 2], [f64; 2]); MAX_ANGLES],
}

/// Length behind an end that matters to the tilt there, given how much of both is in and the largest rest curvature of the two.
pub(crate) fn window(clearance: f64, held: f64, curvature: f64) -> f64 {
    let length = if curvature > 0.0 { (12.0 * clearance / curvature).sqrt() } else { WINDOW * clearance };
    length.min(held)
}

impl Side {
    /// Adds an instrument with its set of angles, sampled at the Gauss points of the [`window`], which ends at the end.
    pub(crate) fn add(&mut self, material: &Material, set: Option<usize>) {
        let weights = GAUSS.map(|point| point.weight * 2.0 * point.xi);
        self.add_weighed(material, set, &weights);
    }

    fn add_weighed(&mut self, material: &Material, set: Option<usize>, weights: &[f64; 3]) {
        for k in 0..3 {
            let bending = weights[k] * material.bending[k];
            self.bending += bending;
            if let Some(set) = set {
                for a in 0..2 {
                    self.moments[set][a] += bending * material.rest_curvature[k][a];
                }
            }
        }
    }
}

impl Tilt {
    /// The play of what goes on, with these `materials` by set beyond the end, in what ends, both held at this distance
    /// behind the end; `None` without any.
    pub(crate) fn new(
        (clearance, held): (f64, f64),
        ends: &Side,
        goes_on: &Side,
        materials: &[Material; MAX_ANGLES],
    ) -> Option<Self> {
        if !(clearance > 0.0 && held > 0.0 && ends.bending > 0.0 && goes_on.bending > 0.0) {
            return None;
        }
        let both = ends.bending + goes_on.bending;
        let part = ends.bending / both;
        // What the kink has in common with the curvature of the element, at its beginning.
        let weights = GAUSS.map(|point| -point.weight * point.z[1]);
        let mut beyond = Side::default();
        for (set, material) in materials.iter().enumerate() {
            beyond.add_weighed(material, Some(set), &weights);
        }
        let moment = |set: usize, a: usize| {
            goes_on.moments[set][a] - beyond.moments[set][a] - (1.0 - part) / part * ends.moments[set][a]
        };
        Some(Self {
            clearance,
            stiffness: part * goes_on.bending,
            part,
            free: 3.0 * clearance / held,
            moments: std::array::from_fn(|set| [moment(set, 0), moment(set, 1)]),
        })
    }

    /// W at a kink, with the angles θ of the sets at the end.
    pub(super) fn energy(&self, kink: [f64; 2], angles: [f64; MAX_ANGLES]) -> KinkEnergy {
        let Self { clearance, stiffness, part, free, .. } = *self;
        let phi = kink.map(|psi| psi / part);
        let square = phi[0] * phi[0] + phi[1] * phi[1];
        let rho = (square + free * free).sqrt();
        let rate = stiffness / (3.0 * clearance);
        // ρ³ − φₛ³ without the difference of two large numbers.
        let cubes = square / (rho + free) * (rho * rho + rho * free + free * free);
        let mut energy = KinkEnergy {
            value: rate / 3.0 * cubes,
            first: phi.map(|phi| rate * rho * phi / part),
            second: [[0.0; 2]; 2],
            angles: [([0.0; 2], [0.0; 2]); MAX_ANGLES],
        };
        for a in 0..2 {
            for b in 0..2 {
                let unit = if a == b { rho } else { 0.0 };
                energy.second[a][b] = rate * (unit + phi[a] * phi[b] / rho) / (part * part);
            }
        }
        for (set, [m, n]) in self.moments.iter().enumerate().filter(|(_, moment)| **moment != [0.0; 2]) {
            let (sin, cos) = libm::sincos(angles[set]);
            let turned = [cos * m - sin * n, sin * m + cos * n];
            let rate = [-turned[1], turned[0]];
            let along = turned[0] * kink[0] + turned[1] * kink[1];
            energy.value -= along;
            energy.first[0] -= turned[0];
            energy.first[1] -= turned[1];
            energy.angles[set] = ([-(rate[0] * kink[0] + rate[1] * kink[1]), along], [-rate[0], -rate[1]]);
        }
        energy
    }

    /// Tilt φ of a kink.
    pub(crate) fn tilt(&self, kink: [f64; 2]) -> f64 {
        libm::hypot(kink[0], kink[1]) / self.part
    }

    /// Force with which the rim presses at this tilt φ, and the place behind it where the two leave each other: each the same.
    pub(crate) fn rim_force(&self, tilt: f64) -> f64 {
        let Self { clearance, stiffness, free, .. } = *self;
        let moment = stiffness / (3.0 * clearance) * libm::hypot(tilt, free) * tilt;
        moment * tilt / (6.0 * clearance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilt(held: f64) -> Tilt {
        let material = |ei: f64, k: f64| Material {
            bending: [ei; 3],
            torsion: [ei; 3],
            rest_curvature: [[k, 0.5 * k]; 3],
            ..Material::NONE
        };
        let (wire, catheter) = (material(5.0, 0.04), material(60.0, -0.01));
        let (mut ends, mut goes_on) = (Side::default(), Side::default());
        ends.add(&catheter, Some(1));
        goes_on.add(&wire, Some(0));
        Tilt::new((0.2, held), &ends, &goes_on, &[wire, Material::NONE, Material::NONE]).unwrap()
    }

    #[test]
    fn the_energy_of_a_kink_has_these_derivatives() {
        let tilt = tilt(60.0);
        for (kink, angles) in [([0.1, -0.05], [0.3, 1.1, 0.0]), ([0.0, 0.0], [0.0, 2.0, 0.0])] {
            let here = tilt.energy(kink, angles);
            let h = 1e-6;
            for a in 0..2 {
                let moved = |by: f64| {
                    let mut kink = kink;
                    kink[a] += by;
                    tilt.energy(kink, angles)
                };
                let (plus, minus) = (moved(h), moved(-h));
                assert!(((plus.value - minus.value) / (2.0 * h) - here.first[a]).abs() < 1e-8);
                for b in 0..2 {
                    let slope = (plus.first[b] - minus.first[b]) / (2.0 * h);
                    assert!((slope - here.second[a][b]).abs() < 1e-3 * (1.0 + slope.abs()), "{slope}");
                }
                for set in 0..2 {
                    let slope = (plus.angles[set].0[0] - minus.angles[set].0[0]) / (2.0 * h);
                    assert!((slope - here.angles[set].1[a]).abs() < 1e-7);
                }
            }
            for set in 0..2 {
                let turned = |by: f64| {
                    let mut angles = angles;
                    angles[set] += by;
                    tilt.energy(kink, angles)
                };
                let (plus, minus) = (turned(h), turned(-h));
                assert!(((plus.value - minus.value) / (2.0 * h) - here.angles[set].0[0]).abs() < 1e-7);
                let second = (plus.angles[set].0[0] - minus.angles[set].0[0]) / (2.0 * h);
                assert!((second - here.angles[set].0[1]).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn a_straight_wire_tilts_as_two_beams_do_and_what_presses_is_the_moment_over_its_length() {
        let tilt = tilt(1e6);
        // c M by a tilt of a tenth: the rest moment apart.
        let phi = 0.1;
        let ei = 5.0 * 60.0 / 65.0;
        let moment = ei * phi * phi / (3.0 * 0.2);
        let value = tilt.energy([phi * tilt.part, 0.0], [0.0; 3]);
        let without = value.first[0] - tilt.energy([0.0; 2], [0.0; 3]).first[0];
        assert!((without * tilt.part / moment - 1.0).abs() < 1e-4, "{without} {moment}");
        let length = 6.0 * 0.2 / phi;
        assert!((tilt.rim_force(phi) * length / moment - 1.0).abs() < 1e-4);
        // Held near by, it tilts as a clamped beam.
        let held = self::tilt(0.5);
        let stiff = held.energy([0.0; 2], [0.0; 3]).second[0][0] * held.part * held.part;
        assert!((stiff - ei / 0.5).abs() < 1e-9 * stiff);
    }
}
