//! Smoothing the faces of voxels into a surface, without shrinking it and within half a voxel.
//!
//! Vertices move towards the mean of their neighbours along the surface, an axis with large voxels counting less, as the
//! Laplace operator has it (weights 1/h²). By itself this shrinks a vessel: a tube of three voxels by a tenth. So the
//! volume that each vertex's motion takes away is noted, spread over the surface around it by a random walk, and given
//! back along the normals. What is left is a smoothing that keeps the volume of every stretch of a few voxels: tubes of
//! any radius stay, and so does the volume of the whole, which is corrected to that of the voxels in the end.
//!
//! Each vertex stays in a box of half a voxel around its start, in the voxels' own axes (Gibson, MICCAI 1998). So no
//! voxel's centre changes sides by more than rounding of facets, narrow vessels neither close nor merge, and it is known
//! how far the surface may be from the label.

use nalgebra::Matrix3;

use super::net::Net;
use crate::{Vec3, parallel};

/// Fraction of the way to the mean of the neighbours in a sweep.
const STEP: f64 = 0.5;
/// How far roughness is smoothed, in voxels: the standard deviation of the heat kernel of all sweeps. Of 1.5 to 12, 3 left
/// the least roughness in tubes of 4 to 12 voxels; thinner ones are as rough as their label says at any.
const REACH: f64 = 3.0;
/// How far volume is spread before it is given back, in voxels: farther, narrow places would borrow from wide ones;
/// less far, the steps of a slanting wall would stay.
const SPREAD: f64 = 2.0;
/// Fraction of a vertex's volume that it gives to its neighbours in a step of the walk.
const GIVEN: f64 = 0.8;
/// Sweeps between two times that volume is given back.
const SWEEPS: usize = 4;
/// Times that the volume of the whole is corrected in the end: each leaves a hundredth.
const CORRECTIONS: usize = 4;
/// Most sweeps, where voxels are much longer than wide.
const MOST_SWEEPS: usize = 1000;

/// What holds the vertices.
pub(super) struct Lattice {
    /// Millimetres of a step along each axis of the voxels.
    pub(super) axes: Matrix3<f64>,
    /// Its inverse.
    pub(super) into: Matrix3<f64>,
    /// Half of the side of a vertex's box, in voxels.
    pub(super) within: f64,
    /// Number of edges of the net to a voxel.
    pub(super) edges: usize,
}

/// Neighbours of each vertex with their shares of the mean.
struct Graph {
    begins: Vec<u32>,
    ends: Vec<(u32, f64)>,
}

impl Graph {
    fn of(net: &Net, lattice: &Lattice) -> Self {
        let weights: [f64; 3] = std::array::from_fn(|k| 1.0 / lattice.axes.column(k).norm_squared());
        let mut begins = vec![0_u32; net.vertices.len() + 1];
        // Each edge is met twice, once in each direction.
        for quad in &net.quads {
            quad.iter().for_each(|v| begins[*v as usize + 1] += 1);
        }
        for v in 0..net.vertices.len() {
            begins[v + 1] += begins[v];
        }
        let mut next = begins.clone();
        let mut ends = vec![(0, 0.0); begins[net.vertices.len()] as usize];
        for quad in &net.quads {
            for k in 0..4 {
                let (a, b) = (quad[k], quad[(k + 1) % 4]);
                let (x, y) = (net.vertices[a as usize], net.vertices[b as usize]);
                let axis = (0..3).max_by(|&i, &j| (x[i] - y[i]).abs().total_cmp(&(x[j] - y[j]).abs()));
                ends[next[a as usize] as usize] = (b, axis.map_or(0.0, |axis| weights[axis]));
                next[a as usize] += 1;
            }
        }
        for v in 0..net.vertices.len() {
            let own = &mut ends[begins[v] as usize..begins[v + 1] as usize];
            let sum: f64 = own.iter().map(|(_, weight)| weight).sum();
            own.iter_mut().for_each(|(_, weight)| *weight /= sum);
        }
        Self { begins, ends }
    }

    fn around(&self, v: usize) -> &[(u32, f64)] {
        &self.ends[self.begins[v] as usize..self.begins[v + 1] as usize]
    }
}

/// The net's vertices, smoothed, in millimetres from the centre of the mask's first voxel; the net then encloses
/// `volume_mm3`.
pub(super) fn smoothed(net: &Net, lattice: &Lattice, volume_mm3: f64) -> Vec<Vec3> {
    let graph = Graph::of(net, lattice);
    let start: Vec<Vec3> = net.vertices.iter().map(|v| lattice.axes * Vec3::from(*v)).collect();
    let mut at = start.clone();
    let mut owed = vec![0.0; at.len()];
    let sides: Vec<f64> = lattice.axes.column_iter().map(|side| side.norm()).collect();
    // A sweep is a step of the heat equation of about STEP h²/4, h being the shortest edge.
    let finest = sides.iter().copied().fold(f64::MAX, f64::min) / lattice.edges as f64;
    let voxel = libm::cbrt(sides[0] * sides[1] * sides[2]);
    let sweeps = |reach: f64, step: f64| 2.0 * (reach * voxel / finest).powi(2) / step;
    let all = (sweeps(REACH, STEP) as usize).clamp(SWEEPS, MOST_SWEEPS);
    let walk = (sweeps(SPREAD, GIVEN) as usize).clamp(1, MOST_SWEEPS);
    for _ in 0..all.div_ceil(SWEEPS) {
        for _ in 0..SWEEPS {
            let areas = areas(net, &at);
            let moved = parallel::map(at.len(), |v| {
                let mean: Vec3 = graph.around(v).iter().map(|(w, part)| at[*w as usize] * *part).sum();
                held(at[v] + (mean - at[v]) * STEP, start[v], lattice)
            });
            for v in 0..at.len() {
                owed[v] -= (moved[v] - at[v]).dot(&areas[v]);
            }
            at = moved;
        }
        for _ in 0..walk {
            owed = spread(&owed, &graph);
        }
        give_back(net, &mut at, &start, &mut owed, lattice);
    }
    for _ in 0..CORRECTIONS {
        let missing = volume_mm3 - enclosed_mm3(net, &at);
        let areas = areas(net, &at);
        let all: f64 = areas.iter().map(|area| area.norm()).sum();
        owed = areas.iter().map(|area| missing * area.norm() / all).collect();
        give_back(net, &mut at, &start, &mut owed, lattice);
    }
    at
}

/// A step of the random walk.
fn spread(owed: &[f64], graph: &Graph) -> Vec<f64> {
    let mut next: Vec<f64> = owed.iter().map(|own| own * (1.0 - GIVEN)).collect();
    for (v, own) in owed.iter().enumerate() {
        for (w, part) in graph.around(v) {
            next[*w as usize] += GIVEN * part * own;
        }
    }
    next
}

/// Moves vertices outwards by the volume owed to them. What the boxes do not allow is left to the corrections of the
/// whole: kept for the next time, it drove vertices on all sides into the corners of their boxes.
fn give_back(net: &Net, at: &mut [Vec3], start: &[Vec3], owed: &mut [f64], lattice: &Lattice) {
    let areas = areas(net, at);
    let mean = areas.iter().map(|area| area.norm()).sum::<f64>() / areas.len().max(1) as f64;
    for v in 0..at.len() {
        let norm = areas[v].norm();
        // At a fold there is no outside.
        if norm < 0.1 * mean {
            continue;
        }
        let to = held(at[v] + areas[v] * (owed[v] / (norm * norm)), start[v], lattice);
        owed[v] = 0.0;
        at[v] = to;
    }
}

/// The nearest place to `to` in the box around `start`, along the voxels' axes.
fn held(to: Vec3, start: Vec3, lattice: &Lattice) -> Vec3 {
    let moved = lattice.into * (to - start);
    let within = moved.map(|k| k.clamp(-lattice.within, lattice.within));
    start + lattice.axes * within
}

/// A quarter of the area of the faces around each vertex, outwards: the change of volume with its place.
fn areas(net: &Net, at: &[Vec3]) -> Vec<Vec3> {
    let mut areas = vec![Vec3::zeros(); at.len()];
    for quad in &net.quads {
        let [a, b, c, d] = quad.map(|v| at[v as usize]);
        let quarter = (c - a).cross(&(d - b)) / 8.0;
        quad.iter().for_each(|v| areas[*v as usize] += quarter);
    }
    areas
}

/// The enclosed volume, with each face between its two triangulations.
fn enclosed_mm3(net: &Net, at: &[Vec3]) -> f64 {
    let origin = at.first().copied().unwrap_or_default();
    let cone = |quad: &[u32; 4]| {
        let [a, b, c, d] = quad.map(|v| at[v as usize] - origin);
        let triple = |a: &Vec3, b: &Vec3, c: &Vec3| a.dot(&b.cross(c)) / 12.0;
        triple(&a, &b, &c) + triple(&a, &c, &d) + triple(&a, &b, &d) + triple(&b, &c, &d)
    };
    net.quads.iter().map(cone).sum()
}
