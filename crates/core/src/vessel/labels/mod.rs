//! Vessels from segmentations: the surface of the labelled voxels, smoothed, and opened where its vessels end.
//!
//! The voxels ([`mask`]) get a closed surface ([`net`]), which is smoothed within half a voxel and keeps its volume
//! ([`smooth`]); its ends are looked for in the voxels ([`ends`], [`distance`]), and it is cut there by planes across its
//! centre line ([`cut`]).

mod cut;
mod distance;
mod ends;
mod map;
mod mask;
mod net;
mod options;
mod report;
mod smooth;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use super::SurfaceMesh;
use super::generate::push_polygon;
use super::wall::drop_unreferenced;
use crate::{Error, Result, Vec3};
use distance::Voxels;
pub use ends::EndKind;
use ends::{Search, Tip};
pub use map::LabelMap;
use mask::Mask;
use net::Net;
pub use options::{Ends, LabelOptions, Parts};
pub use report::{LabelEnd, LabelReport};
use smooth::Lattice;

/// Half of the side of the box in which a vertex of the surface may be moved, in voxels.
const WITHIN: f64 = 0.5;
/// Least number of voxels of a part that can be a vessel.
const LEAST_VOXELS: usize = 8;
/// Number of quadrilaterals up to which they are divided into four: small vessels are of few voxels, whose facets would
/// be felt.
const DIVIDED: usize = 30_000;
/// Most quadrilaterals, before they are divided: some gigabytes.
const MOST_QUADS: usize = 4_000_000;

/// The surface of a label.
#[derive(Debug, Clone)]
pub struct LabelSurface {
    /// The surface in the axes of the label map, open at [`LabelReport::ends`].
    pub mesh: SurfaceMesh,
    /// What was found in the label map, and what was done.
    pub report: LabelReport,
}

impl LabelSurface {
    /// The surface of the voxels with one of the labels.
    ///
    /// No place of it is farther from the faces of the voxels than half a voxel along each axis, and it has their volume,
    /// but for what the planes cut off. Ends that cannot be cut are left closed and say why.
    ///
    /// # Errors
    /// [`Error::Parameter`] naming `label` for one that does not occur (the message lists those that do) and for the
    /// background; [`Error::Mesh`] for a label of less than eight connected voxels or with more than four million faces.
    pub fn of(map: &LabelMap, options: &LabelOptions) -> Result<Self> {
        let wanted = map.wanted(&options.labels)?;
        let chosen: BTreeSet<u16> = wanted.iter().map(|(label, _)| *label).collect();
        let labels = map.labels();
        let found = Mask::of(map.size(), |index| chosen.contains(&labels[index]));
        let named = || chosen.iter().map(u16::to_string).collect::<Vec<_>>().join(" and ");
        let mut mask = found.ok_or_else(|| Error::parameter("label", named(), "has no voxel"))?;
        let mut report = LabelReport::new(map, wanted);
        let (part, sizes) = mask.parts();
        let kept = match options.parts {
            Parts::Largest => 1,
            Parts::All => sizes.iter().filter(|size| **size >= LEAST_VOXELS).count(),
        };
        if sizes[0] < LEAST_VOXELS {
            return Err(Error::Mesh(format!(
                "the largest connected part of label {} has {} voxels; a vessel needs at least {LEAST_VOXELS}",
                named(),
                sizes[0]
            )));
        }
        mask.keep(|index| (part[index] as usize) < kept);
        report.parts = sizes.len();
        report.kept_voxels = sizes[..kept].iter().sum();
        report.left_out_voxels = sizes[kept..].iter().sum();
        report.filled_voxels = mask.fill_hollows();
        report.thin_part = mask.thin_part();
        Self::of_mask(map, &mask, options.ends, report)
    }

    fn of_mask(map: &LabelMap, mask: &Mask, ends: Ends, mut report: LabelReport) -> Result<Self> {
        let axes = *map.axes_mm();
        let sides_mm: [f64; 3] = std::array::from_fn(|k| axes.column(k).norm());
        let voxel_mm = libm::cbrt(sides_mm[0] * sides_mm[1] * sides_mm[2]);
        let voxels = Voxels::of(mask, axes);
        let (mut found, mut continued) = (Vec::new(), mask.clone());
        if ends != Ends::None {
            let clearance_mm = voxels.clearance_mm();
            let search =
                Search { voxels: &voxels, clearance_mm: &clearance_mm, picture: map.size(), sides_mm };
            for part in search.parts() {
                report.border_touches += part.touches;
                found.push(part);
            }
            continued = continued_beyond(mask, &voxels, found.iter().flat_map(|part| &part.tips), &sides_mm);
        }
        let net = Net::of(&mut continued);
        if net.quads.len() > MOST_QUADS {
            return Err(Error::Mesh(format!(
                "the label has {} faces of voxels, at most {MOST_QUADS} are smoothed; crop the label map or make it coarser",
                net.quads.len()
            )));
        }
        report.joined_voxels = net.filled;
        report.rings = net.rings();
        let (net, edges) = match net.quads.len() <= DIVIDED {
            true => (net.divided(), 2),
            false => (net, 1),
        };
        let into = axes.try_inverse().unwrap_or_default();
        let lattice = Lattice { axes, into, within: WITHIN, edges };
        let volume_mm3 = continued.count() as f64 * axes.determinant().abs();
        let mut at = smooth::smoothed(&net, &lattice, volume_mm3 * axes.determinant().signum());
        let from = axes * Vec3::from(continued.from.map(|k| k as f64));
        at.iter_mut().for_each(|x| *x += from);
        let mut mesh = SurfaceMesh { vertices_mm: at, triangles: Vec::with_capacity(2 * net.quads.len()) };
        for quad in &net.quads {
            let mut quad = *quad;
            if axes.determinant() < 0.0 {
                quad.reverse();
            }
            push_polygon(&mesh.vertices_mm, &quad, &mut mesh.triangles);
        }
        report.volume_error = mesh.signed_volume_mm3() / volume_mm3 - 1.0;
        let closed = mesh.clone();
        for part in &found {
            let tips: Vec<&Tip> =
                part.tips.iter().filter(|tip| ends == Ends::All || tip.kind == EndKind::Border).collect();
            if tips.is_empty() {
                continue;
            }
            let mut middles: Vec<Vec3> = tips.iter().map(|tip| voxels.centre_mm(tip.middle)).collect();
            if middles.len() == 1 {
                middles.push(voxels.centre_mm(part.opposite(tips[0])));
            }
            let lines = cut::lines(&closed, &middles);
            for (number, tip) in tips.into_iter().enumerate() {
                let line = lines.as_ref().map_err(ToString::to_string).map(|lines| lines[number].as_ref());
                let end = line.and_then(|line| {
                    let plane = cut::plane(tip, line, &voxels, voxel_mm)?;
                    let outermost = outermost_mm(&voxels, tip, &sides_mm);
                    cut::cut(&mut mesh, &plane, &outermost, tip.radius_mm, voxel_mm)?;
                    Ok(plane)
                });
                report.ends.push(LabelEnd::new(tip, end, voxels.centre_mm(tip.middle)));
            }
        }
        drop_unreferenced(&mut mesh);
        let shift = map.origin_mm();
        mesh.vertices_mm.iter_mut().for_each(|x| *x += shift);
        report.ends.iter_mut().for_each(|end| end.move_by(&shift));
        Ok(Self { mesh, report })
    }
}

/// Number of voxels by which a vessel is continued beyond the picture's border, along an axis with sides of `side_mm`.
///
/// Smoothing must not round its rim, and the largest sphere at the border must be that of the vessel, not of what a flat end
/// leaves of it: among equal small ones the centre line would end anywhere.
fn continued_by(tip: &Tip, side_mm: f64) -> usize {
    /// Voxels for smoothing.
    const LEAST: usize = 4;
    /// Radii of the vessel for the sphere.
    const RADII: f64 = 1.5;
    /// Most voxels: a wider vessel has room for the sphere of an oblique section anyway.
    const MOST: usize = 64;
    (LEAST + (RADII * tip.radius_mm / side_mm) as usize).min(MOST)
}

/// The mask with vessels continued beyond the border where they leave the picture.
fn continued_beyond<'a>(
    mask: &Mask,
    voxels: &Voxels<'_>,
    tips: impl Iterator<Item = &'a Tip> + Clone,
    sides_mm: &[f64; 3],
) -> Mask {
    let count = |tip: &Tip| {
        let sides = tip.patch.iter().map(|(_, side)| continued_by(tip, sides_mm[side.axis]));
        sides.max().unwrap_or(0)
    };
    let by = tips.clone().map(count).max().unwrap_or(0);
    let mut continued = mask.padded(by);
    for tip in tips {
        for (voxel, side) in &tip.patch {
            let mut at = mask.place(voxels.index[*voxel as usize] as usize).map(|k| k + by);
            for _ in 0..continued_by(tip, sides_mm[side.axis]) {
                at[side.axis] = if side.is_last { at[side.axis] + 1 } else { at[side.axis] - 1 };
                let index = continued.index(at);
                continued.inside[index] = true;
            }
        }
    }
    continued
}

/// A place on the surface's side of an end: the tip, or the middle of where the vessel is continued to.
fn outermost_mm(voxels: &Voxels<'_>, tip: &Tip, sides_mm: &[f64; 3]) -> Vec3 {
    if tip.patch.is_empty() {
        return voxels.centre_mm(tip.tip);
    }
    let beyond = |(voxel, side): &(u32, ends::Side)| {
        let count = continued_by(tip, sides_mm[side.axis]) as f64;
        let step = voxels.axes().column(side.axis) * if side.is_last { count } else { -count };
        voxels.centre_mm(*voxel) + step
    };
    tip.patch.iter().map(beyond).sum::<Vec3>() / tip.patch.len() as f64
}
