//! A device as a chain of nodes, and the loads on it.

use endowire_core::Vec3;
use endowire_core::shape::Frame;
use nalgebra::Rotation3;

/// The segments of a clamped chain. Node 0 is the clamp, segment i (from 0) is between nodes i and i + 1.
#[derive(Debug, Clone, Default)]
pub struct Chain {
    /// Position of the clamp, mm.
    pub start_mm: Vec3,
    /// Direction of the clamp, unit length.
    pub direction: Vec3,
    /// Direction towards which the clamp's first material direction points at rotation zero, as for a
    /// [`Sheath`](endowire_core::insertion::Sheath).
    pub bends_towards: Option<Vec3>,
    /// Rotation of the clamp about its direction, rad.
    pub turn_rad: f64,
    /// Lengths of the segments, mm.
    pub lengths_mm: Vec<f64>,
    /// Bending stiffness EI of the segments, N·mm².
    pub bending_nmm2: Vec<f64>,
    /// Torsional stiffness GJ of the segments, N·mm².
    pub torsion_nmm2: Vec<f64>,
    /// Rest curvature of the segments about the two material directions, 1/mm.
    pub rest_curvature_per_mm: Vec<[f64; 2]>,
}

impl Chain {
    /// A straight, uniform chain along x from the origin.
    pub fn uniform(length_mm: f64, segments: usize, bending_nmm2: f64) -> Self {
        Self {
            direction: Vec3::x(),
            lengths_mm: vec![length_mm / segments as f64; segments],
            bending_nmm2: vec![bending_nmm2; segments],
            torsion_nmm2: vec![bending_nmm2 / 1.3; segments],
            rest_curvature_per_mm: vec![[0.0; 2]; segments],
            ..Self::default()
        }
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.lengths_mm.len()
    }

    /// Length of the chain, mm.
    pub fn length_mm(&self) -> f64 {
        self.lengths_mm.iter().sum()
    }

    /// Stiffness, N·mm/rad, of the joint at node `i`: half a segment on either side, in series. Before the clamp
    /// nothing bends, so its joint represents half a segment; this makes a chain second-order accurate.
    pub(crate) fn joint_stiffness(&self, i: usize) -> f64 {
        1.0 / (self.half_flexibility(i)
            + i.checked_sub(1).map_or(0.0, |before| self.half_flexibility(before)))
    }

    fn half_flexibility(&self, segment: usize) -> f64 {
        0.5 * self.lengths_mm[segment] / self.bending_nmm2[segment]
    }

    /// The force unit EI/L², N, of tolerances, for the stiffest segment.
    pub(crate) fn force_unit(&self) -> f64 {
        self.bending_nmm2.iter().fold(0.0, |a: f64, b| a.max(*b)) / self.length_mm().powi(2)
    }

    /// The unloaded chain: straight on from the clamp.
    pub fn straight(&self) -> Posture {
        let mut posture = Posture { positions_mm: vec![self.start_mm], ..Posture::default() };
        let mut x = self.start_mm;
        for h in &self.lengths_mm {
            x += self.direction * *h;
            posture.positions_mm.push(x);
        }
        posture.frames = vec![self.clamp_frame(); self.segments() + 1];
        posture
    }

    /// The clamp's triad, rotated: tangent, first and second material direction as columns.
    pub(crate) fn clamp_frame(&self) -> Rotation3<f64> {
        let Frame { t, u, v } = Frame::new(self.direction, self.bends_towards);
        let (s, c) = self.turn_rad.sin_cos();
        Rotation3::from_basis_unchecked(&[t, u * c + v * s, v * c - u * s])
    }

    /// Bending energy in mJ of springs at the joints of a straight device, ½ k θ².
    pub fn bending_energy_mj(&self, posture: &Posture) -> f64 {
        self.bending_energy_from_mj(posture, &[])
    }

    /// As [`Self::bending_energy_mj`], ½ k |ω − b|² with the bend ω of a joint and the bend `b` in which it is at rest,
    /// both in the direction in which the chord turns, rad.
    pub(crate) fn bending_energy_from_mj(&self, posture: &Posture, at_rest: &[Vec3]) -> f64 {
        let mut before = self.direction;
        let mut energy = 0.0;
        for i in 0..self.segments() {
            let d = posture.chord(i).normalize();
            let (sine, cosine) = (before.cross(&d).norm(), before.dot(&d));
            let mut angle = sine.atan2(cosine);
            if let Some(rest) = at_rest.get(i) {
                let way = (d - before * cosine).try_normalize(1e-12).unwrap_or_else(Vec3::zeros);
                angle = (way * angle - rest).norm();
            }
            energy += 0.5 * self.joint_stiffness(i) * angle * angle;
            before = d;
        }
        energy
    }
}

/// Configuration of a chain.
#[derive(Debug, Clone, Default)]
pub struct Posture {
    /// Node positions, clamp first, mm.
    pub positions_mm: Vec<Vec3>,
    /// Triads of the nodes (tangent, two material directions), for methods that use them.
    pub frames: Vec<Rotation3<f64>>,
}

impl Posture {
    /// The vector of segment `i`, mm.
    pub fn chord(&self, i: usize) -> Vec3 {
        self.positions_mm[i + 1] - self.positions_mm[i]
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.positions_mm.iter().all(|x| x.iter().all(|c| c.is_finite()))
    }
}

/// A force on a node, and its dependence on the node's position: dF = −k n (n·dx).
#[derive(Debug, Clone, Copy, Default)]
pub struct Push {
    /// Force, N.
    pub force_n: Vec3,
    /// Direction n of its stiffness.
    pub normal: Vec3,
    /// Stiffness k, N/mm.
    pub stiffness_n_per_mm: f64,
}

/// Loads on the nodes of a chain.
pub trait NodalLoad {
    /// The load on `node` (1 to the number of segments) at `x`.
    fn on(&mut self, node: usize, x: &Vec3) -> Push;

    /// Distance that a node may move, mm, before its load has to be evaluated anew.
    fn trusted_mm(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether it does not depend on positions, so that it can be applied in increments.
    fn is_dead(&self) -> bool {
        false
    }
}

/// A dead force at the last node.
#[derive(Debug, Clone, Copy)]
pub struct TipForce {
    /// The last node.
    pub node: usize,
    /// Its force, N.
    pub force_n: Vec3,
}

impl NodalLoad for TipForce {
    fn on(&mut self, node: usize, _: &Vec3) -> Push {
        let force_n = if node == self.node { self.force_n } else { Vec3::zeros() };
        Push { force_n, ..Push::default() }
    }

    fn is_dead(&self) -> bool {
        true
    }
}
