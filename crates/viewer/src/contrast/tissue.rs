//! Visible medium in the tissue behind the ends of the tree.
//!
//! An artery continues into ever finer ones, which no centre line contains: behind each end they are generated,
//! branching by halves into the tissue that they supply. The medium is distributed evenly over the last ones, each a
//! small cloud, so that a blush has the shape of a territory and the grain of its arterioles.

use std::collections::BTreeMap;

use endowire_core::vessel::Displacement;
use endowire_core::{Vec3, random};

use super::flow::Flow;
use crate::c_arm::CArm;

/// Number of divisions of an end, and length of the first branch relative to the radius of the tissue; each next one
/// is shorter by this factor.
const DIVISIONS: u32 = 7;
const FIRST: f64 = 0.3;
const SHORTER: f64 = 0.85;
/// Largest slope of a branch relative to the one before.
const ASIDE: f64 = 1.0;
/// Standard deviation of the last ones' clouds relative to the radius of the tissue, and number of deviations beyond
/// which nothing is visible.
const CLOUD: f64 = 0.25;
const REACH: f64 = 3.5;

/// Ends of the tree that supply tissue, with the pixels that see it: length, mm, per mm³ of medium.
pub(super) fn tissue(
    flow: &Flow,
    c_arm: &CArm,
    displacement: Option<&Displacement>,
) -> Vec<(usize, Vec<(u32, f32)>)> {
    let ends = flow.supplying_ends();
    ends.map(|(end, node, radius_mm)| {
        let before = node.upstream.map_or(node.position_mm, |up| flow.nodes[up].position_mm);
        let onwards = (node.position_mm - before).try_normalize(0.0).unwrap_or_default();
        let clouds = arterioles(node.position_mm, onwards, radius_mm, end as u64);
        let part = 1.0 / clouds.len() as f64;
        let mut seen = BTreeMap::new();
        for cloud in clouds {
            let middle = displacement.map_or(cloud, |displacement| displacement.place(&cloud));
            add_cloud(c_arm, middle, CLOUD * radius_mm, part, &mut seen);
        }
        (end, seen.into_iter().collect())
    })
    .collect()
}

/// The ends of the finest arteries behind an end of the tree.
fn arterioles(end_mm: Vec3, onwards: Vec3, radius_mm: f64, seed: u64) -> Vec<Vec3> {
    let mut tips = vec![(end_mm, onwards)];
    let mut length_mm = FIRST * radius_mm;
    for division in 0..DIVISIONS {
        let of_division = random::splitmix64(seed, u64::from(division));
        let branch = |(number, (at, along)): (u64, &(Vec3, Vec3))| {
            let lateral = |k: u64| 2.0 * random::unit(random::splitmix64(of_division, 3 * number + k)) - 1.0;
            let turn = Vec3::new(lateral(0), lateral(1), lateral(2)) * ASIDE;
            let ways = [1.0, -1.0].map(|side| (along + turn * side).try_normalize(0.0).unwrap_or(*along));
            ways.map(|way| (at + way * length_mm, way))
        };
        tips = (0..).zip(&tips).flat_map(branch).collect();
        length_mm *= SHORTER;
    }
    tips.into_iter().map(|tip| tip.0).collect()
}

/// Adds a part of the medium in a Gaussian cloud to the pixels that see it.
fn add_cloud(c_arm: &CArm, middle: Vec3, deviation_mm: f64, part: f64, seen: &mut BTreeMap<u32, f32>) {
    let at = c_arm.in_beam(&middle);
    if !c_arm.is_between(&at) {
        return;
    }
    let [width, height] = c_arm.size_px();
    let [u, v] = c_arm.pixel_of(&at);
    let reach_px = REACH * deviation_mm * c_arm.focal_px() / (c_arm.sod_mm() + at.z);
    let range = |at: f64, side: u32| {
        let [low, high] = [at - reach_px, at + reach_px].map(|x| x.clamp(0.0, f64::from(side)) as u32);
        low..high
    };
    let variance = deviation_mm * deviation_mm;
    for y in range(v, height) {
        for x in range(u, width) {
            let (source, direction) = c_arm.ray([f64::from(x) + 0.5, f64::from(y) + 0.5]);
            let off = (middle - source).cross(&direction).norm_squared() / direction.norm_squared();
            let length = libm::exp(-off / (2.0 * variance)) / (std::f64::consts::TAU * variance);
            *seen.entry(y * width + x).or_insert(0.0) += (part * length) as f32;
        }
    }
}
