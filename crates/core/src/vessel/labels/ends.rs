//! Where the vessels of a mask end.
//!
//! The way from one end of a part to each of its voxels has its local maxima at the ends of branches. A maximum counts by
//! how much longer the way is there than where its branch meets another (its persistence, as in topology): a bump of
//! the wall is short against the width of the branch, a branch is long. Two kinds of ends are distinguished:
//!
//! - [`EndKind::Border`]: the branch goes on beyond the picture. It touches the border with at least
//!   [`LEAST_PATCH`] of its section, and is at least half as long as wide.
//! - [`EndKind::Blunt`]: it ends within the picture, because the segmentation does. It is at least [`LONG`] times as long
//!   as wide, so that the dome of an aneurysm is no end.

use super::distance::Voxels;
use crate::Vec3;
use crate::vessel::topology::NONE;

/// Least length of a branch that ends within the picture, in widths, and in voxels.
pub(super) const LONG: f64 = 2.0;
const LONG_VOXELS: f64 = 4.0;
/// Least length of a branch that leaves the picture, in widths, and in voxels.
const SHORT: f64 = 0.5;
const SHORT_VOXELS: f64 = 1.5;
/// Least area in which an end touches the border, in sections of its branch.
pub(super) const LEAST_PATCH: f64 = 0.3;
/// Least cosine between a vessel and the normal of the border where it leaves: one that runs along it only touches it.
const STEEP: f64 = 0.55;
/// Part of the largest of these cosines that another side needs, through which the vessel leaves too.
const ALIKE: f64 = 0.8;
/// Ways from an end, in widths, that are near it, and those of the shell about it that shows whether it is an end.
const NEAR: f64 = 1.5;
const AROUND: [f64; 2] = [1.75, 2.5];
/// Part of the largest clearance nearby that counts as the largest: of those places the nearest to the end is taken.
const NEARLY: f32 = 0.9;

/// Smallest part of all voxels whose ends are looked for.
const SPECK: f64 = 1e-3;

/// How a vessel ends in a label map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum EndKind {
    /// It leaves the picture.
    Border,
    /// The label ends within the picture.
    Blunt,
}

/// A side of the picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    pub(super) axis: usize,
    /// Whether it is at the last voxels along the axis, and not at the first.
    pub(super) is_last: bool,
}

/// Connected voxels at a side of the picture.
struct Patch {
    side: Side,
    voxels: Vec<u32>,
}

/// An end of a part.
pub(super) struct Tip {
    pub(super) kind: EndKind,
    /// The voxel farthest out.
    pub(super) tip: u32,
    /// Voxels of the border in which it leaves the picture; empty for a blunt end.
    pub(super) patch: Vec<(u32, Side)>,
    /// A voxel in the middle of the vessel near the end.
    pub(super) middle: u32,
    /// Radius of the largest sphere of its branch, mm.
    pub(super) radius_mm: f64,
}

/// Looks for the ends in a part.
pub(super) struct Search<'a> {
    pub(super) voxels: &'a Voxels<'a>,
    pub(super) clearance_mm: &'a [f32],
    pub(super) picture: [usize; 3],
    /// Millimetres along each axis of a voxel.
    pub(super) sides_mm: [f64; 3],
}

/// A local maximum of the way.
struct Maximum {
    voxel: u32,
    /// How much longer the way is there than where its branch begins, mm.
    length_mm: f64,
    radius_mm: f64,
}

/// A connected part of a mask.
pub(super) struct PartEnds {
    pub(super) tips: Vec<Tip>,
    /// Number of places where it touches the border without an end.
    pub(super) touches: usize,
    /// Places in the middle of the vessel, near the two that are farthest from each other.
    apart: [u32; 2],
}

impl PartEnds {
    /// The place farthest from an end.
    pub(super) fn opposite(&self, tip: &Tip) -> u32 {
        if tip.middle == self.apart[0] { self.apart[1] } else { self.apart[0] }
    }
}

impl Search<'_> {
    /// The ends of each part that is not a speck.
    pub(super) fn parts(&self) -> Vec<PartEnds> {
        let mut is_new = vec![true; self.voxels.len()];
        let mut parts = Vec::new();
        for first in 0..self.voxels.len() as u32 {
            if !std::mem::take(&mut is_new[first as usize]) {
                continue;
            }
            let mut own = self.connected(first, &mut is_new);
            if own.len() as f64 >= SPECK * self.voxels.len() as f64 {
                own.sort_unstable();
                parts.push(self.ends(&own));
            }
        }
        parts
    }

    /// The voxels that are connected to one through new ones, itself first; they are new no longer.
    fn connected(&self, first: u32, is_new: &mut [bool]) -> Vec<u32> {
        let (mut all, mut next) = (vec![first], 0);
        while next < all.len() {
            for other in self.voxels.around(all[next]) {
                if std::mem::take(&mut is_new[other as usize]) {
                    all.push(other);
                }
            }
            next += 1;
        }
        all
    }

    /// The ends of a part.
    fn ends(&self, own: &[u32]) -> PartEnds {
        let ways = self.voxels.ways_mm(&own[..1], f64::INFINITY);
        let longer = |a: &u32, b: &u32| ways[*a as usize].total_cmp(&ways[*b as usize]).then(b.cmp(a));
        let root = own.iter().copied().max_by(longer).unwrap_or_default();
        let ways = self.voxels.ways_mm(&[root], f64::INFINITY);
        let mut maxima = self.maxima(own, &ways);
        // The root is as far from the farthest end as that from it.
        let longest = maxima.first().map_or((0.0, 0.0), |most| (most.length_mm, most.radius_mm));
        maxima.insert(0, Maximum { voxel: root, length_mm: longest.0, radius_mm: longest.1 });
        let patches = self.patches(own);
        let mut taken = vec![false; patches.len()];
        let mut tips = Vec::new();
        let mut apart = [root; 2];
        let voxel_mm = self.sides_mm.iter().copied().fold(0.0, f64::max);
        for (number, maximum) in maxima.iter().enumerate() {
            let width_mm = 2.0 * maximum.radius_mm;
            if number > 1 && maximum.length_mm < SHORT * width_mm {
                continue;
            }
            let around = self.voxels.ways_mm(&[maximum.voxel], AROUND[1] * width_mm);
            let is_near = |way: &f32| f64::from(*way) <= NEAR * width_mm;
            let near: Vec<f32> =
                around.iter().map(|way| if is_near(way) { *way } else { f32::INFINITY }).collect();
            // A bounded way sees the sphere of this end, not that of a wide trunk behind.
            let radius_mm = self.radius_mm(&near).min(maximum.radius_mm);
            let middle = self.middle(&near, maximum.voxel);
            if let Some(place) = apart.get_mut(number) {
                *place = middle;
            }
            let left = self.left_through(&patches, &taken, &around, radius_mm);
            if !left.is_empty() && maximum.length_mm >= (SHORT * width_mm).max(SHORT_VOXELS * voxel_mm) {
                let of_side = |&k: &usize| {
                    let Patch { side, voxels } = &patches[k];
                    voxels.iter().map(|voxel| (*voxel, *side)).collect::<Vec<_>>()
                };
                let patch: Vec<(u32, Side)> = left.iter().flat_map(of_side).collect();
                left.iter().for_each(|&k| taken[k] = true);
                tips.push(Tip {
                    kind: EndKind::Border,
                    tip: maximum.voxel,
                    middle: self.centre(&patch).unwrap_or(maximum.voxel),
                    patch,
                    radius_mm,
                });
            } else if maximum.length_mm >= (LONG * width_mm).max(LONG_VOXELS * voxel_mm)
                && self.is_end(&around, width_mm)
            {
                let (kind, tip) = (EndKind::Blunt, maximum.voxel);
                tips.push(Tip { kind, tip, middle, patch: Vec::new(), radius_mm });
            }
        }
        PartEnds { tips, touches: taken.iter().filter(|taken| !**taken).count(), apart }
    }

    /// The border patches through which a vessel leaves the picture: near its end, across its course, and together large
    /// enough.
    fn left_through(&self, patches: &[Patch], taken: &[bool], near: &[f32], radius_mm: f64) -> Vec<usize> {
        let Some(outward) = self.outward(near, radius_mm) else { return Vec::new() };
        let section_mm2 = std::f64::consts::PI * radius_mm * radius_mm;
        let cosine = |k: usize| self.normal(patches[k].side).dot(&outward);
        let is_near = |k: &usize| {
            let way = patches[*k].voxels.iter().map(|v| near[*v as usize]).fold(f32::INFINITY, f32::min);
            !taken[*k] && f64::from(way) <= 2.0 * radius_mm && cosine(*k) >= STEEP
        };
        let mut left: Vec<usize> = (0..patches.len()).filter(is_near).collect();
        // At an edge of the picture it leaves through two sides; in a bend it may touch another.
        let best = left.iter().map(|k| cosine(*k)).fold(0.0, f64::max);
        left.retain(|k| cosine(*k) >= ALIKE * best);
        let area_mm2: f64 = left.iter().map(|&k| self.area_mm2(&patches[k])).sum();
        if area_mm2 >= LEAST_PATCH * section_mm2 { left } else { Vec::new() }
    }

    /// The direction in which a vessel ends: from the middle of what is about three radii from its end to that of what is
    /// one to two.
    fn outward(&self, near: &[f32], radius_mm: f64) -> Option<Vec3> {
        let mut sums = [(Vec3::zeros(), 0.0); 2];
        for voxel in 0..near.len() as u32 {
            let shell = match f64::from(near[voxel as usize]) / radius_mm {
                way if (1.0..2.0).contains(&way) => 0,
                way if (2.5..3.5).contains(&way) => 1,
                _ => continue,
            };
            sums[shell].0 += self.voxels.centre_mm(voxel);
            sums[shell].1 += 1.0;
        }
        let [(near, a), (far, b)] = sums;
        (near / a - far / b).try_normalize(1e-9).filter(|outward| outward.iter().all(|k| k.is_finite()))
    }

    /// The voxel of a patch nearest to its middle.
    fn centre(&self, patch: &[(u32, Side)]) -> Option<u32> {
        let sum: Vec3 = patch.iter().map(|(voxel, _)| self.voxels.centre_mm(*voxel)).sum();
        let middle = sum / patch.len().max(1) as f64;
        let distance = |voxel: u32| (self.voxels.centre_mm(voxel) - middle).norm_squared();
        let voxels = patch.iter().map(|(voxel, _)| *voxel);
        voxels.min_by(|a, b| distance(*a).total_cmp(&distance(*b)).then(a.cmp(b)))
    }

    /// Whether the vessel goes on from here in a single direction: in a ring the way has maxima too. So near the end, a
    /// sphere about it holds all of the section, and what is around that is of one piece.
    fn is_end(&self, near: &[f32], width_mm: f64) -> bool {
        let is_shell = |v: u32| {
            let way = f64::from(near[v as usize]);
            way.is_finite() && way > AROUND[0] * width_mm
        };
        let mut is_new: Vec<bool> = (0..near.len() as u32).map(is_shell).collect();
        let mut pieces = 0;
        for first in 0..near.len() {
            if !std::mem::take(&mut is_new[first]) {
                continue;
            }
            pieces += 1;
            self.connected(first as u32, &mut is_new);
        }
        pieces < 2
    }

    /// The largest clearance where the way is finite, mm.
    fn radius_mm(&self, near: &[f32]) -> f64 {
        let finite = near.iter().zip(self.clearance_mm).filter(|(way, _)| way.is_finite());
        f64::from(finite.map(|(_, clearance)| *clearance).fold(0.0, f32::max))
    }

    /// The voxel nearest to a blunt end of those in the middle of the vessel.
    fn middle(&self, near: &[f32], tip: u32) -> u32 {
        let widest = self.radius_mm(near) as f32;
        let in_middle = (0..near.len() as u32)
            .filter(|v| near[*v as usize].is_finite() && self.clearance_mm[*v as usize] >= NEARLY * widest);
        in_middle.min_by(|a, b| near[*a as usize].total_cmp(&near[*b as usize])).unwrap_or(tip)
    }

    /// The local maxima of the way, the longest first.
    fn maxima(&self, own: &[u32], ways: &[f32]) -> Vec<Maximum> {
        let mut order = own.to_vec();
        order.sort_by(|a, b| ways[*b as usize].total_cmp(&ways[*a as usize]).then(a.cmp(b)));
        // Branches grow from their maxima towards the root, and end where they meet a longer one.
        let mut branch = vec![NONE; self.voxels.len()];
        let mut branches: Vec<(u32, f64, u32)> = Vec::new();
        let mut found = Vec::new();
        let find = |branches: &mut Vec<(u32, f64, u32)>, mut k: u32| {
            while branches[k as usize].2 != k {
                branches[k as usize].2 = branches[branches[k as usize].2 as usize].2;
                k = branches[k as usize].2;
            }
            k
        };
        let mut met = Vec::new();
        for voxel in order {
            met.clear();
            for next in self.voxels.around(voxel) {
                if branch[next as usize] != NONE {
                    met.push(find(&mut branches, branch[next as usize]));
                }
            }
            met.sort_unstable();
            met.dedup();
            let clearance = f64::from(self.clearance_mm[voxel as usize]);
            let Some(&oldest) = met.first() else {
                branch[voxel as usize] = branches.len() as u32;
                branches.push((voxel, clearance, branches.len() as u32));
                continue;
            };
            branch[voxel as usize] = oldest;
            for younger in &met[1..] {
                let (top, radius_mm, _) = branches[*younger as usize];
                let length_mm = f64::from(ways[top as usize] - ways[voxel as usize]);
                found.push(Maximum { voxel: top, length_mm, radius_mm });
                branches[oldest as usize].1 = branches[oldest as usize].1.max(radius_mm);
                branches[*younger as usize].2 = oldest;
            }
            branches[oldest as usize].1 = branches[oldest as usize].1.max(clearance);
        }
        if let Some((top, radius_mm, _)) = branches.first() {
            let length_mm = f64::from(ways[*top as usize]);
            found.push(Maximum { voxel: *top, length_mm, radius_mm: *radius_mm });
        }
        found.sort_by(|a, b| b.length_mm.total_cmp(&a.length_mm).then(a.voxel.cmp(&b.voxel)));
        found
    }

    /// Whether a voxel is at a side of the picture.
    fn is_at(&self, voxel: u32, side: Side) -> bool {
        let mask = self.voxels.mask;
        let at = mask.place(self.voxels.index[voxel as usize] as usize)[side.axis] as i64;
        let last = self.picture[side.axis] as i64 - 1;
        mask.from[side.axis] + at == if side.is_last { last } else { 0 }
    }

    /// Out of the picture.
    fn normal(&self, side: Side) -> Vec3 {
        let [x, y, z] =
            self.voxels.axes().column_iter().map(|axis| axis.into_owned()).collect::<Vec<_>>()[..]
        else {
            return Vec3::zeros();
        };
        let across = [y.cross(&z), z.cross(&x), x.cross(&y)][side.axis];
        let outwards = across * across.dot(&[x, y, z][side.axis]).signum();
        outwards.normalize() * if side.is_last { 1.0 } else { -1.0 }
    }

    /// Connected voxels at each side of the picture.
    fn patches(&self, own: &[u32]) -> Vec<Patch> {
        let mut patches = Vec::new();
        for (axis, is_last) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
            let side = Side { axis, is_last };
            let mut is_new = vec![false; self.voxels.len()];
            own.iter().for_each(|voxel| is_new[*voxel as usize] = self.is_at(*voxel, side));
            for voxel in own {
                if !std::mem::take(&mut is_new[*voxel as usize]) {
                    continue;
                }
                patches.push(Patch { side, voxels: self.connected(*voxel, &mut is_new) });
            }
        }
        patches
    }

    /// Area of a patch on the border, mm².
    fn area_mm2(&self, patch: &Patch) -> f64 {
        let [x, y, z] = self.sides_mm;
        patch.voxels.len() as f64 * [y * z, z * x, x * y][patch.side.axis]
    }
}
