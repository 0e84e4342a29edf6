//! Contrast medium seen by each pixel: the length of its lumen, distributed over the nodes of the tree.
//!
//! The stretches of a ray inside the wall are divided into short steps, each with the shares of its position
//! ([`Mixing`]). A frame then needs one sparse product of the sums of these shares with the nodes' fractions.

use std::sync::Arc;

use endowire_core::Vec3;
use endowire_core::vessel::{Displacement, SurfaceMesh};

use rayon::prelude::*;

use super::flow::Flow;
use super::mixing::{Mixing, STEP_MM};
use super::tissue::tissue;
use crate::c_arm::CArm;
use crate::cpu::wall_crossings;

/// Contrast medium seen by a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Medium {
    pub(crate) pixel: u32,
    /// Mean fraction along its lumen.
    pub(crate) fraction: f32,
    /// Length in tissue, mm.
    pub(crate) tissue_mm: f32,
}

/// Smallest number of pixels per thread.
const FEWEST_PIXELS: usize = 256;
/// Shares of a pixel's lumen below this are redistributed to the others.
const LEAST_SHARE: f32 = 1e-3;

/// The medium seen from one position of the C-arm.
#[derive(Debug)]
pub(crate) struct ContrastMap {
    flow: Arc<Flow>,
    shares: Arc<Shares>,
    displacement: Option<Displacement>,
}

/// The shares of the nodes in the lumen of each pixel.
#[derive(Debug)]
pub(crate) struct Shares {
    /// Pixels inside the wall, ascending, and the ends of their shares.
    pixels: Vec<(u32, u32)>,
    shares: Vec<(u32, f32)>,
    /// Ends of the tree that supply tissue, with the pixels that see it: length, mm, per mm³ of medium.
    tissue: Vec<(usize, Vec<(u32, f32)>)>,
}

impl Shares {
    /// The shares of `flow`, defined in the vessel at rest, in the lumen enclosed by `wall`, with the vessel's
    /// displacement.
    pub(crate) fn new(
        flow: &Flow,
        c_arm: &CArm,
        wall: &SurfaceMesh,
        displacement: Option<&Displacement>,
    ) -> Self {
        let material = |x: Vec3| displacement.map_or(x, |displacement| displacement.material(&x));
        let mut crossings = wall_crossings(c_arm, wall);
        crossings.par_sort_unstable_by(|a, b| {
            (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal)
        });
        let of_pixels: Vec<_> = crossings.chunk_by(|a, b| a.0 == b.0).collect();
        let shared =
            of_pixels.par_iter().with_min_len(FEWEST_PIXELS).map_init(Room::default, |room, of_pixel| {
                (of_pixel[0].0, of_ray(&flow.mixing, c_arm, of_pixel, material, room))
            });
        let mut map = Self { pixels: vec![], shares: vec![], tissue: tissue(flow, c_arm, displacement) };
        for (pixel, shares) in shared.collect::<Vec<_>>().into_iter().filter(|(_, shares)| !shares.is_empty())
        {
            map.shares.extend(shares);
            map.pixels.push((pixel, map.shares.len() as u32));
        }
        map
    }

    fn mixed(&self, of_node: &[f32]) -> Vec<Medium> {
        let mut start = 0;
        let mix = |&(pixel, end): &(u32, u32)| {
            let shares = &self.shares[start..end as usize];
            start = end as usize;
            let fraction = shares.iter().map(|&(node, share)| share * of_node[node as usize]).sum();
            Medium { pixel, fraction, tissue_mm: 0.0 }
        };
        self.pixels.iter().map(mix).collect()
    }
}

impl ContrastMap {
    /// Medium of `flow` distributed to pixels, in a possibly displaced vessel.
    pub(crate) fn new(flow: &Arc<Flow>, shares: Arc<Shares>, displacement: Option<&Displacement>) -> Self {
        let displacement = displacement.cloned();
        Self { flow: Arc::clone(flow), shares, displacement }
    }

    /// The shares of each pixel, which do not depend on the injection.
    pub(crate) fn into_shares(self) -> Arc<Shares> {
        self.shares
    }

    /// The medium of all pixels with any, ascending, with the tip at `tip_mm`.
    pub(crate) fn at(&self, time_s: f64, tip_mm: Option<Vec3>) -> Vec<Medium> {
        let displacement = self.displacement.as_ref();
        let tip_mm = tip_mm.map(|tip| displacement.map_or(tip, |displacement| displacement.material(&tip)));
        let mut carried = self.flow.carried();
        let transport = carried.at(&self.flow, time_s, tip_mm);
        let mut seen = self.shares.mixed(&transport.at(time_s));
        let volumes = transport.tissue_mm3();
        let filled = self.shares.tissue.iter().filter(|end| volumes[end.0] > 0.0);
        for (end, pixels) in filled {
            let volume = volumes[*end] as f32;
            seen.extend(pixels.iter().map(|&(pixel, length)| Medium {
                pixel,
                fraction: 0.0,
                tissue_mm: length * volume,
            }));
        }
        // Stable: the sums are in the order of the ends.
        seen.sort_by_key(|medium| medium.pixel);
        let join = |all: &[Medium]| {
            all[1..].iter().fold(all[0], |sum, one| Medium {
                pixel: sum.pixel,
                fraction: sum.fraction + one.fraction,
                tissue_mm: sum.tissue_mm + one.tissue_mm,
            })
        };
        seen.chunk_by(|a, b| a.pixel == b.pixel).map(join).collect()
    }

    /// The largest fraction that a pixel's lumen ever reaches, with each node at its own maximum.
    pub(crate) fn largest(&self) -> Vec<Medium> {
        self.shares.mixed(self.flow.largest())
    }
}

/// Work buffers of a thread.
#[derive(Debug, Default)]
struct Room {
    /// Shares at a place.
    here: Vec<(u32, f32)>,
    /// Sums of a ray by nodes, zero between rays, and the nodes that it has met, in this order.
    sums: Vec<f32>,
    met: Vec<u32>,
}

impl Room {
    /// Adds a length with the shares of this place.
    fn add(&mut self, length: f32) {
        for &(node, share) in &self.here {
            let at = node as usize;
            if at >= self.sums.len() {
                self.sums.resize(at + 1, 0.0);
            }
            if self.sums[at] == 0.0 {
                self.met.push(node);
            }
            self.sums[at] += share * length;
        }
    }

    /// The sums of the ray.
    fn take(&mut self) -> Vec<(u32, f32)> {
        self.met.drain(..).map(|node| (node, std::mem::take(&mut self.sums[node as usize]))).collect()
    }
}

/// The shares of a ray's length in the lumen.
fn of_ray(
    mixing: &Mixing,
    c_arm: &CArm,
    crossings: &[(u32, f32, bool)],
    material: impl Fn(Vec3) -> Vec3,
    room: &mut Room,
) -> Vec<(u32, f32)> {
    let (pixel, width) = (crossings[0].0, c_arm.size_px()[0]);
    let (source, direction) = c_arm.ray([f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5]);
    let mut all = 0.0;
    let mut depth = 0;
    for pair in crossings.windows(2) {
        depth += if pair[0].2 { 1 } else { -1 };
        let length = f64::from(pair[1].1 - pair[0].1);
        if depth <= 0 || length <= 0.0 {
            continue;
        }
        all += length as f32;
        let steps = (length / STEP_MM).ceil();
        for k in 0..steps as usize {
            let at = f64::from(pair[0].1) + (k as f64 + 0.5) * length / steps;
            mixing.shares(&material(source + direction * at), &mut room.here);
            room.add((length / steps) as f32);
        }
    }
    let mut own = room.take();
    let before: f32 = own.iter().map(|share| share.1).sum();
    own.retain(|share| share.1 > LEAST_SHARE * all);
    let kept: f32 = own.iter().map(|share| share.1).sum();
    own.iter_mut().for_each(|share| share.1 *= before / (kept * all));
    own
}
